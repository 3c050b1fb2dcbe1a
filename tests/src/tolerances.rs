//! Every tolerance of the tests, with its derivation. eps = 2^-53, the rounding error of an f64 operation.
//! "Measured" is the largest value over the scenes of the test that uses the tolerance.

/// The rounding error of one f64 operation.
const EPS: f64 = f64::EPSILON / 2.0;

/// A number that is quoted with so many decimals: half a unit of the last one.
pub fn printed(decimals: i32) -> f64 {
    0.5 * libm::pow(10.0, f64::from(-decimals))
}

/// A handful of roundings of numbers below 8.
pub const EXACT: f64 = 90.0 * EPS;

/// Position of the eye from the inverse of a 4x4 matrix: a motion of up to 5 units and a scale in [0.5, 2],
/// so the eye is within 10 units; the depth map's (z, w) block has entries up to 10 and cancels in the eye's
/// row. 10 units * 10 * 8 roundings. Measured: 7.2e-15.
pub const EYE: f64 = 800.0 * EPS;

/// detM against det(A) n.(p0 - eye): 6 products of three numbers, two below 2 and one below 2 * (9 + 5) = 28,
/// 12 roundings each on the way. Measured: 2.8e-14.
pub const DET_M: f64 = 6.0 * 112.0 * 12.0 * EPS;

/// Entries of M adj(M) - det(M) I for |m_ij| < 1: three products of three factors, each entry of the adjugate
/// at most 2 with 3 roundings; as much again for det(M). Measured: 4.4e-16.
pub const ADJUGATE: f64 = 60.0 * EPS;

/// delta of L111 relative to the sum of the absolute values of its terms: 3 roundings in Mi, 6 in Qhs, for
/// two factors each, and 3 in delta: 21; fourfold, for the cancellation in Mi that those absolute values do
/// not see. Measured: 1.2e-15.
pub const DELTA: f64 = 84.0 * EPS;

/// The conic box of L109 to L125, relative to its shorter side: it loses eps (x0/b)^2 (E28). With x0/w < 1.5,
/// sigma/w > 0.02 and the tilt's cosine above 0.05 the minor half axis is b > 1.4e-3, so (x0/b)^2 < 1.2e6,
/// and delta cancels by the square of the axes' ratio, up to 400: eps * 4.6e8. Measured: 4.8e-9.
pub const CONIC_BOX: f64 = 4.6e8 * EPS;

/// The splat-centred box, relative to its shorter side, against refined sampling. The sample points are
/// centre + offset, so they carry eps |x0|/side < eps * 1.5 / 1.4e-3 each, some four roundings. Measured:
/// 1.6e-14.
pub const CENTRED_BOX: f64 = 4.0 * 1100.0 * EPS;

/// The splat-centred box of a splat of a pixel or less, in pixels of 1/1000, against refined sampling: sample
/// points are centre + offset with |x0/w| < 1, so 4 roundings of 1000 eps. Measured: 5e-13.
pub const SMALL_BOX_PIXELS: f64 = 4.0 * 1000.0 * EPS;

/// The box of a disc clipped at depth .1, relative to its farthest corner: the refined sampling finds the
/// clip's end of the rim to 3.5e-15 radians, where the image of a rim point of radius 1.4 moves by 1.4/.1 of
/// that and the depth's share as much again. Measured: 4.2e-14.
pub const CLIPPED_BOX: f64 = 28.0 * 3.5e-15;

/// Ends of a depth extent below 10 units: ten roundings, and the sampled rim's (quadratic) error of 1e-15.
/// Measured: 2.0e-15.
pub const DEPTH_EXTENT: f64 = 100.0 * EPS;

/// Circle of confusion relative to lensRadius (1/w + 1/focus), the sum before the subtraction: at most twenty
/// roundings in either form. Measured: 3.9e-15 (listing), 5.6e-16 (closed form).
pub const COC: f64 = 40.0 * EPS;

/// (u, v) or relative depth where a ray meets a plane, relative to 1/sine^2 of the angle between both: one
/// sine from the intersection, one from the adjugate's cancellation. A rounding of a coordinate is multiplied
/// by |x0|/sigma < 100; ten of them. Measured: 3.4e-15.
pub const RAY: f64 = 1000.0 * EPS;

/// The weight table of L19 with 256 entries, F = 2, index rounded down: at most exp(F/256/2) - 1 = 3.914e-3
/// too large (E18).
pub const FLOOR_TABLE_F2: f64 = 3.92e-3;

/// Focus at infinity tested at a depth of 1e12: a lens point of radius .2 is 2e-13 of it away.
pub const FAR_FIELD: f64 = 1e-12;

/// The box of a disc that reaches 1e-9 over the near plane at 1: eps is 1e-7 of the overlap, so half of that
/// of the half chord, 4.5e-5: 2.5e-12, and ten roundings.
pub const SLIVER: f64 = 2.5e-11;

/// A share of a lens by counting points of a square grid, 200 or 1000 in the diameter: a straight edge is off
/// by at most one point in the diameter, 1/200 or 1/1000 of 4/pi, and the mean over its rows is much less.
pub const SHARE_OF_40_000: f64 = 4.0 / std::f64::consts::PI / 200.0;
/// See [`SHARE_OF_40_000`].
pub const SHARE_OF_1_000_000: f64 = 4.0 / std::f64::consts::PI / 1000.0;

/// The greatest value over angles .01 degrees apart, of a function whose second derivative is below 1000:
/// (8.7e-5)^2 / 2 * 1000. Measured: below 1e-6.
pub const SCAN: f64 = 4e-6;

/// A second moment from 4096 independent points of a disc: the relative standard deviation is
/// sqrt(1/8 - 1/16) / (1/4) / 64 = 1.6 %, threefold. Measured: 2.9 %.
pub const MOMENT_OF_4096: f64 = 0.047;

/// The share of indices past the table's end (E17) over 100,000 random uv.z: a standard deviation of .15 %,
/// and the notes' unknown distribution of uv.z. Measured: .5 % from the notes' value.
pub const SHARE_PAST_THE_TABLE: f64 = 0.01;

/// A jump of the normalised colour (E19): the table's bias of .39 % in either weight changes a share by at
/// most a quarter of both, and the colour's slope of 10 a unit adds 3.6e-3 over the coarse spacing of 3.6e-4.
/// Measured: 8.3e-4.
pub const JUMP: f64 = 6e-3;

/// An f64 box error in units of the f32 one (E28): 2^-29 = 1.9e-9, times what the largest of 4000 errors of
/// one heavy-tailed sort can differ from that of another, some hundreds. Measured: 6.9e-7.
pub const DOUBLE_OF_SINGLE: f64 = 2e-6;

/// Sums of truncated Gaussians over a grid of .8 sigma (E33) against their integral: the table's bias at F =
/// 4 is .78 % at most, and the truncated rim's ripple is 1 % of the sum. Measured: .7 %.
pub const GRID_SUM: f64 = 0.02;
