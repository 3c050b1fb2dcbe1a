//! The sample evaluation of SPEC section 4 over lanes: line by line that of [`splat_core::evaluate`], which says what
//! each quantity means. Where that returns early, this computes on and masks.

use crate::lanes::Lanes;
use splat_core::evaluate::{Limits, SplatConstants};

/// A splat's constants, each in every lane.
#[derive(Debug, Clone, Copy)]
pub struct LaneSplat<L> {
    h: [L; 2],
    a1: L,
    b: [L; 2],
    reference: [L; 2],
    depth: L,
    depth_slope: [L; 2],
    defocus: L,
    lens_slope: [L; 2],
    edge_on: L,
}

/// The limits of hits, each in every lane.
#[derive(Debug, Clone, Copy)]
pub struct LaneLimits<L> {
    cutoff: L,
    near: L,
    far: L,
}

/// Hits of several samples: lanes without a hit hold arbitrary values.
#[derive(Debug, Clone, Copy)]
pub struct LaneHits<L> {
    /// Set where the lane is not hit.
    pub missed: L,
    /// Set where the lane's lens point is on the other side of the splat's plane than the eye.
    pub flipped: L,
    /// u^2 + v^2.
    pub r2: L,
    /// View depth w, in camera units.
    pub depth: L,
}

/// Two values, each in every lane. (Not `map`: a closure that is not inlined loses the instruction set.)
#[inline(always)]
fn pair<L: Lanes>([first, second]: [f32; 2]) -> [L; 2] {
    [L::splat(first), L::splat(second)]
}

impl<L: Lanes> LaneLimits<L> {
    /// The limits in every lane.
    #[inline(always)]
    pub fn new(limits: &Limits<f32>) -> Self {
        Self { cutoff: L::splat(limits.cutoff), near: L::splat(limits.near), far: L::splat(limits.far) }
    }
}

impl<L: Lanes> LaneSplat<L> {
    /// The constants in every lane.
    #[inline(always)]
    pub fn new(constants: &SplatConstants<f32>) -> Self {
        Self {
            h: pair(constants.h),
            a1: L::splat(constants.a1),
            b: pair(constants.b),
            reference: pair(constants.reference),
            depth: L::splat(constants.depth),
            depth_slope: pair(constants.depth_slope),
            defocus: L::splat(constants.defocus),
            lens_slope: pair(constants.lens_slope),
            edge_on: L::splat(constants.edge_on),
        }
    }

    /// [`SplatConstants::pinhole`] for a sample a lane. `PLAIN` is that of the splat, here and below:
    /// what it excludes is not tested.
    #[inline(always)]
    pub fn pinhole<const PLAIN: bool>(&self, d: [L; 2], limits: &LaneLimits<L>) -> LaneHits<L> {
        let g = L::splat(1.0) + (self.h[0] * d[0] + self.h[1] * d[1]);
        let outside = if PLAIN { None } else { Some(L::splat(0.0).not_less(g)) };
        let nu = self.a1 * d[1];
        let nv = self.b[0] * d[0] + self.b[1] * d[1];
        self.hits::<PLAIN>(outside, nu, nv, g, self.depth, L::splat(0.0), limits)
    }

    /// [`SplatConstants::thin_lens`] for a sample and a lens point `p` a lane.
    #[inline(always)]
    pub fn thin_lens<const PLAIN: bool>(&self, d: [L; 2], p: [L; 2], limits: &LaneLimits<L>) -> LaneHits<L> {
        let m = [d[0] + p[0] * self.defocus, d[1] + p[1] * self.defocus];
        let side = L::splat(1.0) - (self.lens_slope[0] * p[0] + self.lens_slope[1] * p[1]);
        let g = side + (self.h[0] * m[0] + self.h[1] * m[1]);
        let outside = Some(self.edge_on.not_less(g * side));
        let t = p[0] * m[1] - p[1] * m[0];
        let n = [m[0] + self.lens_slope[1] * t, m[1] - self.lens_slope[0] * t];
        let nu = self.a1 * n[1];
        let nv = self.b[0] * n[0] + self.b[1] * n[1];
        let flipped = side.less(L::splat(0.0));
        self.hits::<PLAIN>(outside, nu, nv, g, self.depth * side, flipped, limits)
    }

    /// [`SplatConstants::orthographic`] for a sample a lane.
    #[inline(always)]
    pub fn orthographic(&self, d: [L; 2], limits: &LaneLimits<L>) -> LaneHits<L> {
        let u = self.reference[0] + self.a1 * d[1];
        let v = self.reference[1] + (self.b[0] * d[0] + self.b[1] * d[1]);
        let r2 = u * u + v * v;
        let depth = self.depth + (self.depth_slope[0] * u + self.depth_slope[1] * v);
        let missed = r2.not_less(limits.cutoff) | limits.near.not_less(depth) | depth.not_less(limits.far);
        LaneHits { missed, flipped: L::splat(0.0), r2, depth }
    }

    /// The common end of the perspective forms.
    #[inline(always)]
    #[expect(clippy::too_many_arguments, reason = "the seven quantities of one formula, inlined twice")]
    fn hits<const PLAIN: bool>(
        &self,
        outside: Option<L>,
        nu: L,
        nv: L,
        g: L,
        scaled_depth: L,
        flipped: L,
        limits: &LaneLimits<L>,
    ) -> LaneHits<L> {
        let inverse_g = L::splat(1.0) / g;
        let [mut u, mut v] = [nu * inverse_g, nv * inverse_g];
        if !PLAIN {
            // Else it is 0, which changes no square.
            [u, v] = [self.reference[0] + u, self.reference[1] + v];
        }
        let r2 = u * u + v * v;
        let depth = scaled_depth * inverse_g;
        let mut missed = r2.not_less(limits.cutoff);
        if !PLAIN {
            missed = missed | limits.near.not_less(depth) | depth.not_less(limits.far);
        }
        if let Some(outside) = outside {
            missed = missed | outside;
        }
        LaneHits { missed, flipped, r2, depth }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use splat_core::evaluate::{Hit, LensPoint};
    use wide::f32x8;

    /// Numbers of every magnitude that set-up can make, both signs, and zero.
    fn number() -> impl Strategy<Value = f32> {
        prop_oneof![
            8 => -4.0f32..4.0,
            // Any bits with an exponent of -30 to 30.
            4 => (97u32..157, 0u32..1 << 23, any::<bool>()).prop_map(|(exponent, digits, negative)| {
                f32::from_bits(u32::from(negative) << 31 | exponent << 23 | digits)
            }),
            1 => Just(0.0f32),
        ]
    }

    fn constants() -> impl Strategy<Value = SplatConstants<f32>> {
        let pair = || [number(), number()];
        let reference = prop_oneof![Just([0.0, 0.0]).boxed(), pair().boxed()];
        (pair(), number(), pair(), reference, number(), pair(), number(), pair()).prop_map(
            |(h, a1, b, reference, depth, depth_slope, defocus, lens_slope)| SplatConstants {
                xi: 0,
                yi: 0,
                xf: 0.0,
                yf: 0.0,
                h,
                a1,
                b,
                reference,
                centred: reference == [0.0, 0.0],
                depth: depth.abs(),
                depth_slope,
                defocus,
                lens_slope,
                edge_on: 1e-9,
            },
        )
    }

    /// Checks the lanes against the reference's hits, bit by bit.
    fn check(lanes: &LaneHits<f32x8>, scalar: [Option<Hit<f32>>; 8]) -> Result<(), TestCaseError> {
        let (r2, depth) = (lanes.r2.to_array(), lanes.depth.to_array());
        for (lane, hit) in scalar.into_iter().enumerate() {
            let bit = |mask: f32x8| mask.bits() >> lane & 1 == 1;
            prop_assert_eq!(bit(lanes.missed), hit.is_none());
            if let Some(hit) = hit {
                prop_assert_eq!(r2[lane].to_bits(), hit.r2.to_bits());
                prop_assert_eq!(depth[lane].to_bits(), hit.depth.to_bits());
                prop_assert_eq!(bit(lanes.flipped), hit.flipped);
            }
        }
        Ok(())
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(20_000))]

        #[test]
        fn lanes_have_the_bits_of_the_reference(
            splat in constants(),
            x in proptest::array::uniform8(number()),
            y in proptest::array::uniform8(number()),
            lens in [number(), number()],
        ) {
            let limits = Limits { cutoff: 4.0, near: 1e-3, far: 1e6 };
            let lane_limits = LaneLimits::new(&limits);
            let lane_splat = LaneSplat::<f32x8>::new(&splat);
            let d = [f32x8::from(x), f32x8::from(y)];
            let each = |evaluate: &dyn Fn([f32; 2]) -> Option<Hit<f32>>| -> [Option<Hit<f32>>; 8] {
                std::array::from_fn(|lane| evaluate([x[lane], y[lane]]))
            };
            check(&lane_splat.pinhole::<false>(d, &lane_limits), each(&|d| splat.pinhole(d, &limits)))?;
            check(&lane_splat.orthographic(d, &lane_limits), each(&|d| splat.orthographic(d, &limits)))?;
            let point = LensPoint { p: lens };
            let lane_point = [f32x8::splat(point.p[0]), f32x8::splat(point.p[1])];
            check(
                &lane_splat.thin_lens::<false>(d, lane_point, &lane_limits),
                each(&|d| splat.thin_lens(d, &point, &limits)),
            )?;
        }
    }
}
