//! The resolve of eight samples at once: SPEC section 6, surfaces without a sort.
//!
//! A layer is grown from the nearest fragment that remains: whatever overlaps it is absorbed, until nothing changes. As a
//! fragment's interval holds its depth, the layers come out front to back; as entries stand in splat order, each sum runs
//! in splat order. So the bits are those of [`splat_abuffer::Resolver`].

use crate::lanes::{Eight, Kernel, LANES, Lanes};
use crate::lattice::Lattice;
use crate::places::{PLACES, place_of};
use crate::records::{Entry, RecordBuffer, cell_of};
use crate::samples::LaneSamples;
use crate::shade::TileShader;
use crate::surface_sums::SurfaceSums;
use splat_abuffer::{Coverage, MIN_LAYER_WEIGHT, SampleColor, SplatSurface};
use splat_core::pixel::PixelResolver;
use splat_core::{Film, PixelRect};

/// What makes the colours of the samples of a cell.
pub trait ResolveCell {
    /// Whether a cell has no fragments.
    fn is_empty(&self, buffer: &RecordBuffer, cell: usize) -> bool {
        buffer.is_empty(cell)
    }

    /// The colours of the eight samples of a cell.
    fn resolve_cell<L: Lanes>(&mut self, buffer: &RecordBuffer, cell: usize) -> Colors<L>;
}

/// Resolves a region's samples into a film that holds the pixels without fragments already.
pub struct ResolveJob<'a, 'b, 'c, C> {
    /// The pixels; they lie within one tile.
    pub region: PixelRect,
    /// Their records, grouped.
    pub buffer: &'a mut RecordBuffer,
    /// If colours differ from pixel to pixel; then there is no lattice.
    pub shader: Option<&'a mut TileShader<'c>>,
    /// The samples.
    pub samples: &'a LaneSamples,
    /// Resolves a cell.
    pub cells: &'a mut C,
    /// What the cells are, if not groups of the samples of a pixel.
    pub lattice: Option<&'a Lattice>,
    /// Scratch.
    pub scratch: &'a mut Vec<SampleColor>,
    /// Makes pixels of samples.
    pub pixels: &'a mut PixelResolver<'b>,
    /// Where the pixels go.
    pub film: &'a mut Film,
}

impl<C: ResolveCell> Kernel for ResolveJob<'_, '_, '_, C> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(mut self) {
        match self.lattice {
            None => self.resolve_pixels::<L>(),
            Some(lattice) => self.resolve_lattice::<L>(lattice),
        }
    }
}

impl<C: ResolveCell> ResolveJob<'_, '_, '_, C> {
    /// Resolves cells of samples of one pixel.
    #[inline(always)]
    fn resolve_pixels<L: Lanes>(&mut self) {
        let groups = self.samples.groups();
        for y in self.region.y0..self.region.y1 {
            for x in self.region.x0..self.region.x1 {
                let place = place_of(x, y);
                if (0..groups).all(|group| self.cells.is_empty(self.buffer, cell_of(place, group))) {
                    continue;
                }
                if let Some(shader) = &mut self.shader {
                    let cells = (0..groups).map(|group| cell_of(place, group));
                    shader.shade(self.buffer, cells, place, x, y);
                }
                self.pixels.start();
                for group in 0..groups {
                    let colors = self.cells.resolve_cell::<L>(self.buffer, cell_of(place, group)).to_arrays();
                    let samples = 0..self.samples.samples_of(group).min(LANES);
                    self.pixels.add_colors(samples.map(|lane| sample_of(&colors, lane)));
                }
                self.pixels.finish(x, y, self.film);
            }
        }
    }

    /// Resolves the cells of a lattice, and puts their samples in order.
    #[inline(always)]
    fn resolve_lattice<L: Lanes>(&mut self, lattice: &Lattice) {
        let count = self.samples.samples();
        self.scratch.clear();
        self.scratch.resize(PLACES * count, SampleColor::NOTHING);
        for cell in 0..lattice.cells() {
            if self.cells.is_empty(self.buffer, cell) {
                continue;
            }
            let colors = self.cells.resolve_cell::<L>(self.buffer, cell).to_arrays();
            for (lane, &(place, sample)) in lattice.samples(cell).iter().enumerate() {
                self.scratch[usize::from(place) * count + sample as usize] = sample_of(&colors, lane);
            }
        }
        for y in self.region.y0..self.region.y1 {
            for x in self.region.x0..self.region.x1 {
                let samples = &self.scratch[usize::from(place_of(x, y)) * count..][..count];
                self.pixels.start();
                self.pixels.add_colors(samples.iter().copied());
                self.pixels.finish(x, y, self.film);
            }
        }
    }
}

/// Fragments that overlap in depth are one surface.
pub struct Surfaces<const OPAQUE: bool> {
    /// How much of a sample a surface covers.
    pub coverage: Coverage,
}

impl<const OPAQUE: bool> ResolveCell for Surfaces<OPAQUE> {
    #[inline(always)]
    fn resolve_cell<L: Lanes>(&mut self, buffer: &RecordBuffer, cell: usize) -> Colors<L> {
        let resolver = CellResolver::<L, OPAQUE> {
            remaining: buffer.cell(cell),
            buffer,
            coverage: self.coverage,
            colors: Colors::nothing(),
        };
        resolver.resolve()
    }
}

/// [`Surfaces`] of which most are summed already.
pub struct SummedSurfaces<'a, const LINES: usize> {
    /// How much of a sample a surface covers.
    pub coverage: Coverage,
    /// The sums of the cells of one layer, of `LINES` lines each.
    pub sums: &'a mut SurfaceSums,
}

impl<const LINES: usize> ResolveCell for SummedSurfaces<'_, LINES> {
    #[inline(always)]
    fn is_empty(&self, buffer: &RecordBuffer, cell: usize) -> bool {
        self.sums.is_empty::<LINES>(cell) && buffer.is_empty(cell)
    }

    #[inline(always)]
    fn resolve_cell<L: Lanes>(&mut self, buffer: &RecordBuffer, cell: usize) -> Colors<L> {
        if self.sums.is_layered(cell) {
            return Surfaces::<true> { coverage: self.coverage }.resolve_cell(buffer, cell);
        }
        let mut colors = Colors::nothing();
        colors.composite::<true>(&self.sums.take::<L, LINES>(cell), self.coverage);
        colors
    }
}

/// The colour of a lane.
#[inline(always)]
fn sample_of([red, green, blue, transmittance, uncovered]: &[Eight; 5], lane: usize) -> SampleColor {
    SampleColor {
        color: [red[lane], green[lane], blue[lane]],
        transmittance: transmittance[lane],
        uncovered: uncovered[lane],
    }
}

/// The colours of eight samples in the making.
pub struct Colors<L> {
    /// Red, green and blue: [`SampleColor::color`].
    pub color: [L; 3],
    /// [`SampleColor::transmittance`].
    pub transmittance: L,
    /// [`SampleColor::uncovered`].
    pub uncovered: L,
}

impl<L: Lanes> Colors<L> {
    /// Those of samples that hit nothing.
    #[inline(always)]
    pub fn nothing() -> Self {
        Self { color: [L::splat(0.0); 3], transmittance: L::splat(1.0), uncovered: L::splat(1.0) }
    }

    /// Red, green, blue, transmittance and what is uncovered of each lane.
    #[inline(always)]
    pub fn to_arrays(&self) -> [Eight; 5] {
        let mut values = [[0.0; LANES]; 5];
        let [red, green, blue] = self.color;
        for (values, lanes) in values.iter_mut().zip([red, green, blue, self.transmittance, self.uncovered]) {
            lanes.store_cell::<0>(values);
        }
        values
    }

    /// Lays a layer behind what is there, where its weight is enough.
    #[inline(always)]
    fn composite<const OPAQUE: bool>(&mut self, sums: &Sums<L>, coverage: Coverage) {
        let one = L::splat(1.0);
        let [least, covered] = match coverage {
            Coverage::Opaque => [L::splat(0.5), one],
            Coverage::Soft { saturation } => {
                [L::splat(MIN_LAYER_WEIGHT), (sums.weight / L::splat(saturation)).least(one)]
            }
        };
        let enough = least.less_or_equal(sums.weight);
        let (alpha, colored) = if OPAQUE {
            // The weights and their opaque parts are the same sums.
            (covered, enough)
        } else {
            let opacity = sums.weight_opacity / sums.weight;
            ((covered * opacity).least(one), enough & L::splat(0.0).less(sums.weight_opacity))
        };
        for (sum, weighted) in self.color.iter_mut().zip(sums.weight_opacity_color) {
            let contribution = self.transmittance * alpha * (weighted / sums.weight_opacity);
            *sum = *sum + (contribution & colored);
        }
        self.transmittance = enough.select(self.transmittance * (one - alpha), self.transmittance);
        self.uncovered = enough.select(self.uncovered * (one - covered), self.uncovered);
    }
}

/// Near and far end of the intervals of a splat's fragments at these depths; not a number where there is none.
#[inline(always)]
pub fn interval<L: Lanes>(depth: L, surface: &SplatSurface) -> [L; 2] {
    let [slope, cap] = surface.interval;
    let half = (L::splat(slope) * depth).least(L::splat(cap));
    [depth - half, depth + half]
}

/// The sums of a layer.
pub struct Sums<L> {
    /// Of the weights.
    pub weight: L,
    weight_opacity: L,
    /// Of weight times opacity times colour.
    pub weight_opacity_color: [L; 3],
}

impl<L: Lanes> Sums<L> {
    #[inline(always)]
    fn zero() -> Self {
        let zero = L::splat(0.0);
        Self { weight: zero, weight_opacity: zero, weight_opacity_color: [zero; 3] }
    }

    /// Those of opaque fragments: of weights, and of weights times colours.
    #[inline(always)]
    pub fn opaque(weight: L, weight_color: [L; 3]) -> Self {
        Self { weight, weight_opacity: weight, weight_opacity_color: weight_color }
    }

    /// Adds a fragment a lane; its weight is 0 where there is none.
    #[inline(always)]
    pub fn add<const OPAQUE: bool>(&mut self, weight: L, surface: &SplatSurface) {
        let weight_opacity = if OPAQUE { weight } else { weight * L::splat(surface.opacity) };
        self.weight = self.weight + weight;
        self.weight_opacity = if OPAQUE { self.weight } else { self.weight_opacity + weight_opacity };
        for (sum, color) in self.weight_opacity_color.iter_mut().zip(surface.color) {
            *sum = *sum + weight_opacity * L::splat(color);
        }
    }
}

/// A cell in the making.
struct CellResolver<'a, L, const OPAQUE: bool> {
    /// The entries of each facing, in splat order, or nothing where all of them are resolved.
    remaining: [&'a [Entry]; 2],
    buffer: &'a RecordBuffer,
    coverage: Coverage,
    colors: Colors<L>,
}

impl<L: Lanes, const OPAQUE: bool> CellResolver<'_, L, OPAQUE> {
    /// The colours of the eight samples.
    #[inline(always)]
    fn resolve(mut self) -> Colors<L> {
        let [fronts, backs] = self.remaining;
        let complete = if backs.is_empty() {
            self.single_surface(0)
        } else if fronts.is_empty() {
            self.single_surface(1)
        } else {
            let [front, back] = [self.nearest(0), self.nearest(1)];
            let backs_first = back.less(front).bits();
            let hit = (front.least(back)).less(L::splat(f32::INFINITY)).bits();
            if backs_first == 0 {
                self.single_surface(0) && (self.is_opaque() || self.single_surface(1))
            } else if backs_first == hit {
                self.single_surface(1) && (self.is_opaque() || self.single_surface(0))
            } else {
                false
            }
        };
        if !complete {
            self.all_surfaces();
        }
        self.colors
    }

    /// Whether nothing behind could be seen.
    #[inline(always)]
    fn is_opaque(&self) -> bool {
        L::splat(0.0).less(self.colors.transmittance).bits() == 0
    }

    /// The least depth of a facing's fragments, infinite where there is none.
    #[inline(always)]
    fn nearest(&self, facing: usize) -> L {
        let mut nearest = L::splat(f32::INFINITY);
        for &entry in self.remaining[facing] {
            nearest = L::load(&self.buffer.record(entry).depth).least(nearest);
        }
        nearest
    }

    /// [`interval`] of an entry.
    #[inline(always)]
    fn interval(&self, entry: Entry, surface: &SplatSurface) -> [L; 2] {
        interval(L::load(&self.buffer.record(entry).depth), surface)
    }

    /// Composites all of a facing's fragments as one layer, if it is one wherever it is hit: if in each sample the
    /// intervals have a point in common. So it is with almost all samples of a smooth surface, and costs a single pass.
    /// Else does nothing, and gives false.
    #[inline(always)]
    fn single_surface(&mut self, facing: usize) -> bool {
        let mut last_near = L::splat(f32::NEG_INFINITY);
        let mut first_far = L::splat(f32::INFINITY);
        let mut sums = Sums::zero();
        for &entry in self.remaining[facing] {
            let surface = self.buffer.surface(entry);
            let [near, far] = self.interval(entry, surface);
            last_near = near.greatest(last_near);
            first_far = far.least(first_far);
            sums.add::<OPAQUE>(L::load(&self.buffer.record(entry).weight), surface);
        }
        if last_near.not_less_or_equal(first_far).bits() != 0 {
            return false;
        }
        self.colors.composite::<OPAQUE>(&sums, self.coverage);
        self.remaining[facing] = &[];
        true
    }

    /// Composites what remains, layer by layer.
    #[inline(always)]
    fn all_surfaces(&mut self) {
        let infinity = L::splat(f32::INFINITY);
        // How far the last layer of each facing reached: only what begins beyond remains. Not a number before the first.
        let mut done = [L::splat(f32::NAN); 2];
        loop {
            let live = L::splat(0.0).less(self.colors.transmittance);
            let [front, back] = [self.nearest_beyond(0, done[0]), self.nearest_beyond(1, done[1])];
            let is_back = back.less(front);
            let start = is_back.select(back, front);
            let valid = start.less(infinity) & live;
            if valid.bits() == 0 {
                return;
            }
            let of_facing = [valid.and_not(is_back), valid & is_back];
            let (sums, end) = self.grow(start, &done, &of_facing);
            self.colors.composite::<OPAQUE>(&sums, self.coverage);
            for (done, mask) in done.iter_mut().zip(of_facing) {
                *done = mask.select(end, *done);
            }
        }
    }

    /// The least depth of a facing's fragments whose intervals begin beyond `done`.
    #[inline(always)]
    fn nearest_beyond(&self, facing: usize, done: L) -> L {
        let infinity = L::splat(f32::INFINITY);
        let mut nearest = infinity;
        for &entry in self.remaining[facing] {
            let [near, _] = self.interval(entry, self.buffer.surface(entry));
            let depth = L::load(&self.buffer.record(entry).depth);
            nearest = near.less_or_equal(done).select(infinity, depth).least(nearest);
        }
        nearest
    }

    /// The sums of the layer that grows from the depths `start`, and its far end. `of_facing` are the lanes in which that
    /// layer is of each facing; what does not begin beyond `done` belongs to earlier ones.
    #[inline(always)]
    fn grow(&self, start: L, done: &[L; 2], of_facing: &[L; 2]) -> (Sums<L>, L) {
        let infinity = L::splat(f32::INFINITY);
        let mut end = start;
        loop {
            let mut sums = Sums::zero();
            let mut next = infinity;
            for facing in 0..2 {
                for &entry in self.remaining[facing] {
                    let surface = self.buffer.surface(entry);
                    let [near, far] = self.interval(entry, surface);
                    let candidate = of_facing[facing].and_not(near.less_or_equal(done[facing]));
                    let member = candidate & near.less_or_equal(end);
                    end = far.or_not(member).greatest(end);
                    next = near.or_not(candidate.and_not(member)).least(next);
                    sums.add::<OPAQUE>(L::load(&self.buffer.record(entry).weight) & member, surface);
                }
            }
            // What was passed over may overlap what was absorbed after it.
            let overlaps = next.less_or_equal(end) & next.less(infinity) & (of_facing[0] | of_facing[1]);
            if overlaps.bits() == 0 {
                return (sums, end);
            }
        }
    }
}
