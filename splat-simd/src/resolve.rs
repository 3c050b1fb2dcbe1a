//! The resolve of eight samples at once: SPEC section 6, without a sort.
//!
//! A layer is grown from the nearest fragment that remains: whatever overlaps it is absorbed, until nothing changes. As a
//! fragment's interval holds its depth, the layers come out front to back; as entries stand in splat order, each sum runs
//! in splat order. So the bits are those of [`splat_abuffer::Resolver`].

use crate::lanes::{Kernel, LANES, Lanes};
use crate::places::place_of;
use crate::records::{Entry, RecordBuffer};
use crate::samples::LaneSamples;
use splat_abuffer::{Coverage, MIN_LAYER_WEIGHT, SampleColor, SplatSurface};
use splat_core::pixel::PixelResolver;
use splat_core::{Film, PixelRect};

/// Resolves a region's samples into a film that holds the pixels without fragments already.
pub struct ResolveJob<'a, 'b> {
    /// The pixels; they lie within one tile.
    pub region: PixelRect,
    /// Their records, grouped.
    pub buffer: &'a RecordBuffer,
    /// The samples.
    pub samples: &'a LaneSamples,
    /// How much of a sample a surface covers.
    pub coverage: Coverage,
    /// Whether backs are drawn, and told from fronts.
    pub two_sided: bool,
    /// Whether every splat is opaque.
    pub opaque: bool,
    /// Makes pixels of samples.
    pub pixels: &'a mut PixelResolver<'b>,
    /// Where the pixels go.
    pub film: &'a mut Film,
}

impl Kernel for ResolveJob<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        match (self.two_sided, self.opaque) {
            (false, false) => self.resolve::<L, false, false>(),
            (false, true) => self.resolve::<L, false, true>(),
            (true, false) => self.resolve::<L, true, false>(),
            (true, true) => self.resolve::<L, true, true>(),
        }
    }
}

impl ResolveJob<'_, '_> {
    #[inline(always)]
    fn resolve<L: Lanes, const TWO_SIDED: bool, const OPAQUE: bool>(self) {
        let groups = self.samples.groups();
        for y in self.region.y0..self.region.y1 {
            for x in self.region.x0..self.region.x1 {
                let cell = usize::from(place_of(x, y)) * groups;
                if self.buffer.cells(cell..cell + groups).is_empty() {
                    continue;
                }
                self.pixels.start();
                for group in 0..groups {
                    let resolver = CellResolver::<L, TWO_SIDED, OPAQUE> {
                        entries: self.buffer.cell(cell + group),
                        buffer: self.buffer,
                        coverage: self.coverage,
                        done: [L::splat(f32::NAN); 2],
                        colors: Colors::nothing(),
                    };
                    resolver.resolve().add_to(self.pixels, self.samples.samples_of(group));
                }
                self.pixels.finish(x, y, self.film);
            }
        }
    }
}

/// The colours of eight samples in the making.
struct Colors<L> {
    color: [L; 3],
    transmittance: L,
    uncovered: L,
}

impl<L: Lanes> Colors<L> {
    #[inline(always)]
    fn nothing() -> Self {
        Self { color: [L::splat(0.0); 3], transmittance: L::splat(1.0), uncovered: L::splat(1.0) }
    }

    /// Adds the first samples to a pixel, in their order.
    #[inline(always)]
    fn add_to(&self, pixels: &mut PixelResolver<'_>, count: usize) {
        let mut values = [[0.0; LANES]; 5];
        let [red, green, blue] = self.color;
        for (values, lanes) in values.iter_mut().zip([red, green, blue, self.transmittance, self.uncovered]) {
            lanes.store_cell::<0>(values);
        }
        let [red, green, blue, transmittance, uncovered] = &values;
        pixels.add_colors((0..count.min(LANES)).map(|lane| SampleColor {
            color: [red[lane], green[lane], blue[lane]],
            transmittance: transmittance[lane],
            uncovered: uncovered[lane],
        }));
    }

    /// Lays a layer behind what is there, in the lanes of `valid`.
    #[inline(always)]
    fn composite<const OPAQUE: bool>(&mut self, sums: &Sums<L>, coverage: Coverage, valid: L) {
        let one = L::splat(1.0);
        let [least, covered] = match coverage {
            Coverage::Opaque => [L::splat(0.5), one],
            Coverage::Soft { saturation } => {
                [L::splat(MIN_LAYER_WEIGHT), (sums.weight / L::splat(saturation)).least(one)]
            }
        };
        let enough = least.less_or_equal(sums.weight) & valid;
        let (alpha, colored) = if OPAQUE {
            // The weights and their opaque parts are the same sums.
            (covered, enough)
        } else {
            let opacity = sums.weight_opacity / sums.weight;
            ((covered * opacity).least(one), enough & sums.weight_opacity.greater(L::splat(0.0)))
        };
        for (sum, weighted) in self.color.iter_mut().zip(sums.weight_opacity_color) {
            let contribution = self.transmittance * alpha * (weighted / sums.weight_opacity);
            *sum = *sum + (contribution & colored);
        }
        self.transmittance = enough.select(self.transmittance * (one - alpha), self.transmittance);
        self.uncovered = enough.select(self.uncovered * (one - covered), self.uncovered);
    }
}

/// The sums of a layer.
struct Sums<L> {
    weight: L,
    weight_opacity: L,
    weight_opacity_color: [L; 3],
}

impl<L: Lanes> Sums<L> {
    #[inline(always)]
    fn zero() -> Self {
        let zero = L::splat(0.0);
        Self { weight: zero, weight_opacity: zero, weight_opacity_color: [zero; 3] }
    }

    /// Adds a fragment a lane; its weight is 0 where there is none.
    #[inline(always)]
    fn add<const OPAQUE: bool>(&mut self, weight: L, surface: &SplatSurface) {
        let weight_opacity = if OPAQUE { weight } else { weight * L::splat(surface.opacity) };
        self.weight = self.weight + weight;
        self.weight_opacity = if OPAQUE { self.weight } else { self.weight_opacity + weight_opacity };
        for (sum, color) in self.weight_opacity_color.iter_mut().zip(surface.color) {
            *sum = *sum + weight_opacity * L::splat(color);
        }
    }
}

/// A cell in the making.
struct CellResolver<'a, L, const TWO_SIDED: bool, const OPAQUE: bool> {
    entries: &'a [Entry],
    buffer: &'a RecordBuffer,
    coverage: Coverage,
    /// How far the last layer of each facing reached: only what begins beyond remains. Not a number before the first.
    done: [L; 2],
    colors: Colors<L>,
}

impl<L: Lanes, const TWO_SIDED: bool, const OPAQUE: bool> CellResolver<'_, L, TWO_SIDED, OPAQUE> {
    /// The colours of the eight samples.
    #[inline(always)]
    fn resolve(mut self) -> Colors<L> {
        // Most samples end with the first opaque layer, for which nothing has to be left out.
        self.layer::<true>();
        while self.layer::<false>() {}
        self.colors
    }

    /// The facing of an entry.
    #[inline(always)]
    fn facing(entry: Entry) -> usize {
        if TWO_SIDED { usize::from(entry.splat.is_back()) } else { 0 }
    }

    /// Depth, and near and far end of its interval, of an entry's fragments. Infinite where there is none.
    #[inline(always)]
    fn interval(&self, entry: Entry) -> [L; 3] {
        let depth = L::load(&self.buffer.record(entry).depth);
        let [slope, cap] = self.buffer.surface(entry).interval;
        let half = (L::splat(slope) * depth).least(L::splat(cap));
        [depth, depth - half, depth + half]
    }

    /// Composites the nearest layer of what remains. False if there is none that could be seen.
    #[inline(always)]
    fn layer<const FIRST: bool>(&mut self) -> bool {
        let live = self.colors.transmittance.greater(L::splat(0.0));
        if !FIRST && live.bits() == 0 {
            return false;
        }
        let infinity = L::splat(f32::INFINITY);
        let nearest = self.nearest::<FIRST>();
        let back = nearest[1].less(nearest[0]);
        let start = if TWO_SIDED { back.select(nearest[1], nearest[0]) } else { nearest[0] };
        let valid = start.less(infinity) & live;
        if valid.bits() == 0 {
            return false;
        }
        let of_facing = if TWO_SIDED { [valid.and_not(back), valid & back] } else { [valid; 2] };
        let (sums, far) = self.grow::<FIRST>(start, of_facing);
        self.colors.composite::<OPAQUE>(&sums, self.coverage, valid);
        for (done, mask) in self.done.iter_mut().zip(of_facing) {
            *done = mask.select(far, *done);
        }
        true
    }

    /// The least depth that remains, for each facing.
    #[inline(always)]
    fn nearest<const FIRST: bool>(&self) -> [L; 2] {
        let infinity = L::splat(f32::INFINITY);
        let mut nearest = [infinity; 2];
        for &entry in self.entries {
            let facing = Self::facing(entry);
            let depth = if FIRST {
                L::load(&self.buffer.record(entry).depth)
            } else {
                let [depth, near, _] = self.interval(entry);
                near.less_or_equal(self.done[facing]).select(infinity, depth)
            };
            nearest[facing] = depth.least(nearest[facing]);
        }
        nearest
    }

    /// The sums of the layer that grows from the depths `start`, and its far end. `of_facing` are the lanes in which that
    /// layer is of each facing.
    #[inline(always)]
    fn grow<const FIRST: bool>(&self, start: L, of_facing: [L; 2]) -> (Sums<L>, L) {
        let infinity = L::splat(f32::INFINITY);
        let mut end = start;
        loop {
            let mut sums = Sums::zero();
            let mut next = infinity;
            for &entry in self.entries {
                let facing = Self::facing(entry);
                let [_, near, far] = self.interval(entry);
                let mut candidate = of_facing[facing];
                if !FIRST {
                    candidate = candidate.and_not(near.less_or_equal(self.done[facing]));
                }
                let member = candidate & near.less_or_equal(end);
                end = member.select(far.greatest(end), end);
                next = candidate.and_not(member).select(near, infinity).least(next);
                sums.add::<OPAQUE>(L::load(&self.buffer.record(entry).weight) & member, self.buffer.surface(entry));
            }
            // What was passed over may overlap what was absorbed after it.
            if (next.less_or_equal(end) & (of_facing[0] | of_facing[1]) & next.less(infinity)).bits() == 0 {
                return (sums, end);
            }
        }
    }
}
