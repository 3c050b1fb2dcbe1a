//! The resolve of eight samples at once: SPEC section 6, without a sort.
//!
//! A layer is grown from the nearest fragment that remains: whatever overlaps it is absorbed, until nothing changes. As a
//! fragment's interval holds its depth, the layers come out front to back; as records stand in splat order, each sum runs
//! in splat order. So the bits are those of [`splat_abuffer::Resolver`].

use crate::lanes::{Kernel, LANES, Lanes};
use crate::raster::RecordBuffer;
use crate::samples::LaneSamples;
use splat_abuffer::{Coverage, MIN_LAYER_WEIGHT, SampleColor, SplatSurface};
use splat_core::pixel::PixelResolver;
use splat_core::{Film, PixelRect};

/// Resolves a region's samples into a film.
pub struct ResolveJob<'a, 'b> {
    /// The pixels.
    pub region: PixelRect,
    /// Their records, grouped.
    pub buffer: &'a RecordBuffer,
    /// The samples.
    pub samples: &'a LaneSamples,
    /// What the fragments of each splat share, by rank.
    pub surfaces: &'a [SplatSurface],
    /// How much of a sample a surface covers.
    pub coverage: Coverage,
    /// Makes pixels of samples.
    pub pixels: &'a mut PixelResolver<'b>,
    /// Where the pixels go.
    pub film: &'a mut Film,
}

impl Kernel for ResolveJob<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let groups = self.samples.groups();
        let mut cell = 0;
        for y in self.region.y0..self.region.y1 {
            for x in self.region.x0..self.region.x1 {
                self.pixels.start();
                for group in 0..groups {
                    let records = self.buffer.cell(cell);
                    let colors = if records.is_empty() {
                        Colors::<L>::nothing()
                    } else {
                        resolve::<L>(records, self.buffer, self.surfaces, self.coverage)
                    };
                    colors.add_to(self.pixels, self.samples.live(group));
                    cell += 1;
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

    /// Adds the samples of the live lanes to a pixel, in their order.
    #[inline(always)]
    fn add_to(&self, pixels: &mut PixelResolver<'_>, live: u32) {
        let color = self.color.map(Lanes::to_array);
        let (transmittance, uncovered) = (self.transmittance.to_array(), self.uncovered.to_array());
        for lane in (0..LANES).filter(|lane| live >> lane & 1 == 1) {
            pixels.add_color(&SampleColor {
                color: color.map(|channel| channel[lane]),
                transmittance: transmittance[lane],
                uncovered: uncovered[lane],
            });
        }
    }

    /// Lays a layer behind what is there, in the lanes of `valid`.
    #[inline(always)]
    fn composite(&mut self, sums: &Sums<L>, coverage: Coverage, valid: L) {
        let zero = L::splat(0.0);
        let one = L::splat(1.0);
        let enough = match coverage {
            Coverage::Opaque => L::splat(0.5).less_or_equal(sums.weight),
            Coverage::Soft { .. } => L::splat(MIN_LAYER_WEIGHT).less_or_equal(sums.weight),
        } & valid;
        let covered = match coverage {
            Coverage::Opaque => one,
            Coverage::Soft { saturation } => (sums.weight / L::splat(saturation)).least(one),
        };
        let opacity = sums.weight_opacity / sums.weight;
        let alpha = (covered * opacity).least(one);
        let colored = enough & sums.weight_opacity.greater(zero);
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
    fn add(&mut self, weight: L, surface: &SplatSurface) {
        let weight_opacity = weight * L::splat(surface.opacity);
        self.weight = self.weight + weight;
        self.weight_opacity = self.weight_opacity + weight_opacity;
        for (sum, color) in self.weight_opacity_color.iter_mut().zip(surface.color) {
            *sum = *sum + weight_opacity * L::splat(color);
        }
    }
}

/// A record as the resolve reads it.
struct Interval<L> {
    depth: L,
    near: L,
    far: L,
}

impl<L: Lanes> Interval<L> {
    #[inline(always)]
    fn new(depth: L, surface: &SplatSurface) -> Self {
        let [slope, cap] = surface.interval;
        let half = (L::splat(slope) * depth).least(L::splat(cap));
        Self { depth, near: depth - half, far: depth + half }
    }
}

/// The colours of the eight samples of a cell.
#[inline(always)]
fn resolve<L: Lanes>(
    records: &[u32],
    buffer: &RecordBuffer,
    surfaces: &[SplatSurface],
    coverage: Coverage,
) -> Colors<L> {
    let infinity = L::splat(f32::INFINITY);
    let mut colors = Colors::nothing();
    let mut live = L::mask(u32::from(u8::MAX));
    // How far the last layer of each facing reached: what begins beyond remains.
    let mut done = [L::splat(f32::NEG_INFINITY); 2];
    loop {
        let mut nearest = [infinity; 2];
        for &number in records {
            let (record, key) = buffer.get(number);
            let interval = Interval::<L>::new(L::load(&record.depth), &surfaces[key.rank as usize]);
            let facing = usize::from(key.back);
            let remains = interval.near.greater(done[facing]);
            nearest[facing] = remains.select(interval.depth, infinity).least(nearest[facing]);
        }
        let back = nearest[1].less(nearest[0]);
        let mut far = back.select(nearest[1], nearest[0]);
        let valid = far.less(infinity) & live;
        if valid.bits() == 0 {
            return colors;
        }
        let facing_masks = [valid.and_not(back), valid & back];
        let sums = loop {
            let mut sums = Sums::zero();
            let mut next = infinity;
            for &number in records {
                let (record, key) = buffer.get(number);
                let surface = &surfaces[key.rank as usize];
                let interval = Interval::<L>::new(L::load(&record.depth), surface);
                let facing = usize::from(key.back);
                let candidate = facing_masks[facing]
                    & interval.near.greater(done[facing])
                    & interval.depth.less(infinity);
                let member = candidate & interval.near.less_or_equal(far);
                far = member.select(far.greatest(interval.far), far);
                next = candidate.and_not(member).select(next.least(interval.near), next);
                sums.add(L::load(&record.weight) & member, surface);
            }
            if (next.less_or_equal(far) & valid).bits() == 0 {
                break sums;
            }
        };
        colors.composite(&sums, coverage, valid);
        for (done, mask) in done.iter_mut().zip(facing_masks) {
            *done = mask.select(far, *done);
        }
        live = live & colors.transmittance.greater(L::splat(0.0));
    }
}
