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

// ---------------------------------------------------------------------------------------------------------
// The resolve and closed-form pictures. eps32 = 2^-24, the rounding error of an f32 operation.

/// The rounding error of one f32 operation.
const EPS32: f32 = f32::EPSILON / 2.0;

/// A sample's colour or transmittance, relative to its brightest channel or to 1, from `fragments` fragments
/// by one order of sums against another. A layer of m: the sum of weights is off by m + 1 eps32, the opacity
/// (a quotient of two such) by 2 m + 4, alpha by 3 m + 7, the colour's quotient by 2 m + 5. Over all layers
/// the transmittance is off by the sum of their alphas' errors, at most 10 n, the colour by at most 24 n; and
/// there are two of them. Measured: 4.8e-7 of a bound of 2.8e-5.
pub fn resolve_rounding(fragments: usize) -> f32 {
    48.0 * fragments as f32 * EPS32
}

/// A covered area in pixels, summed over samples, `samples` a pixel, of an outline of `perimeter` pixels. An
/// edge crosses about 4/pi pixels a pixel of its length; in each the covered part p has a variance of p (1 -
/// p) / samples, 1/6 in the mean over p (.23 with the tent's wider edge). Four standard deviations of
/// independent samples, which well-distributed ones undercut. Measured: .12 of it.
pub fn area_of_samples(perimeter: f64, samples: u32) -> f64 {
    4.0 * (perimeter * 4.0 / std::f64::consts::PI * 0.234 / f64::from(samples)).sqrt()
}

/// The centroid of an outline of `perimeter` pixels, by the centres of pixels. An error of the area stands on
/// the outline, at most a quarter of the perimeter from the middle, divided by sqrt(2) for one axis of both;
/// and the centre of a pixel on the edge is .2 pixel (rms) off the middle of what is covered of it, always
/// outwards, which cancels but for a random rest: another .2 of four square roots of the pixels on the edge.
/// Measured: .10 of it.
pub fn centroid_of_samples(perimeter: f64, area: f64, samples: u32) -> f64 {
    let pixels = perimeter * 4.0 / std::f64::consts::PI;
    (area_of_samples(perimeter, samples) * perimeter / 4.0 / std::f64::consts::SQRT_2
        + 4.0 * 0.2 * pixels.sqrt())
        / area
}

/// How far the edge of a disc of 6000 pixels' radius may seem to be off in a pixel: it leans by 12/6000 from
/// one side of a pixel to the other at the corners of a picture of 24 pixels, and f32 places it to 3 * 6000 *
/// 2^-24 = 1.1e-3.
const EDGE: f64 = 12.0 / 6000.0 + 1.1e-3;

/// The covered part of a pixel at an edge along an axis, from 256 samples of which one lies in each of 256
/// strips: 1/256, and the edge itself. Measured: 3.9e-3.
pub const STRAIGHT_EDGE: f64 = 1.0 / 256.0 + EDGE;

/// The same for a slanted edge. One of 256 samples lies in each of 16 x 16 squares, of which the edge crosses
/// at most 31; each adds a variance of 1/6 of a sample: five deviations, sqrt(31/6) = 2.2733. Measured:
/// 1.3e-2.
pub const SLANTED_EDGE: f64 = 5.0 * 2.2733 / 256.0 + EDGE;

/// The sum of a splat's weights, relative, by 16 samples a pixel. The Gaussian of F = 4 jumps by .31 of its
/// mean at a rim of 160 pixels' length: as [`area_of_samples`], .31 times 6.9 pixels of the 2060 covered:
/// 1.0e-3. Measured: 3.2e-5.
pub const SUM_OF_WEIGHTS: f64 = 1e-3;

/// The greatest weight of a splat of sigma 12.8 pixels, found as the mean over the pixel nearest to the
/// centre, whose samples are up to 1.1 pixels off: r2/2 < 3.7e-3, times 1.16 for the windowed kernel.
/// Measured: 7.0e-4.
pub const PEAK_OF_WEIGHTS: f64 = 4.3e-3;

/// A constant colour from at most `overlap` fragments a sample: a layer's colour is off by 2 m + 5 roundings,
/// alpha (as 1 - T, T near 1) by 3 m + 8. Measured: 2.4e-7 of a bound of 6.8e-6.
pub fn constant_colour(overlap: usize) -> f32 {
    (5.0 * overlap as f32 + 13.0) * EPS32
}

/// Two layers and a background: some ten f32 operations on numbers below 2. Measured: 0.
pub const COMPOSITE: f32 = 20.0 * EPS32;

/// Two Gaussians in display space: the lerp table's error at F = 16, (16/256)^2/32 = 1.2e-4, times the
/// opacity and twice the slope of sRGB's decoding (2.4 at most); a fragment at the 1/255 threshold may fall
/// to either side: 1/255 of a sample of 4. Measured: 1.0e-4.
pub const OVER_PICTURE: f64 = 1.2e-4 * 2.0 * 2.4 + 1.0 / 255.0 / 4.0;

/// The depth of a plane at a sample, relative: 1 + (h0 dx + h1 dy) over a picture of 48 pixels has terms
/// below twice g, four roundings each, then a division and a product, and the rounding to the film. Measured:
/// 9.6e-8 (a mean of 64 samples).
pub const PLANE_DEPTH: f64 = 20.0 * EPS32 as f64;

/// A position within 16 units: its depth by [`PLANE_DEPTH`], its coordinates rounded to f32. Measured:
/// 3.1e-7.
pub const PLANE_POSITION: f64 = 16.0 * (PLANE_DEPTH + EPS32 as f64);

/// Where the mean position of 16 samples falls: one sample in each of 16 strips, so within 1/32 pixel, and as
/// much again for the mean of w x/w, w changing by 2 % a pixel. Measured: 1.1e-2.
pub const PLANE_PIXEL: f64 = 1.0 / 16.0;

/// A unit vector rounded to f32, and normalised before.
pub const UNIT_VECTOR: f64 = 4.0 * EPS32 as f64;

/// A count of hits where so many are expected: four deviations of a Poisson distribution. Measured: .19 of
/// it.
pub fn deviations_of_count(expected: f64) -> f64 {
    4.0 * expected.sqrt()
}

/// A second moment along an axis from so many hits, relative: x^2 has a relative variance of 1 on a disc (and
/// on a polygon of it 1.4 at most); four deviations. Measured: .21 of it.
pub fn deviations_of_moment(hits: f64) -> f64 {
    4.0 * (1.4 / hits).sqrt()
}

/// The mean along an axis of so many hits of this variance: four deviations. Measured: .28 of it.
pub fn deviations_of_mean(variance: f64, hits: f64) -> f64 {
    4.0 * (variance / hits).sqrt()
}

/// The farthest pixel, by its centre, of 12,000 hits of a disc of 7.5 pixels and more blurred by one of 1.5,
/// relative to the sum of both: the density falls to 0 over the last 3 pixels, so that a dozen hits lie
/// within .7 pixel of the rim. Their pixels' centres lie before and behind them. Measured: 1.021 at least.
pub const FARTHEST_PIXEL: f64 = 1.0 - 0.7 / 9.0;

/// The mean over a unit sphere of the sum of weights, its splats' sigma being `sigma`. Areas are set so that
/// the kernels sum to 1 at every centre, by the distance in space; rays meet the splats' planes, which leave
/// the sphere by r^2/2. Both differ by parts of sigma^2: some twice that, its mean square radius being 2
/// sigma^2 at most. And between the centres the sum is another than at them: at the estimated sigma of .8 spacings the mean
/// over a lattice whose centres have 1 is .974 (squares) and .961 (triangles) for windowed F = 4, .948 and 1.012 for
/// Gaussian F = 4, 1.001 and .997 for windowed F = 9. Measured: .031 too little for windowed F = 4, 4000 splats.
pub fn mean_weight(sigma: f64) -> f64 {
    0.053 + 2.4 * sigma * sigma
}

/// Its standard deviation. Sigma is one spacing, so F = 4 holds 4 pi = 12.6 centres, and a centre at the rim
/// of the plain Gaussian weighs e^-2 / (2 pi (1 - e^-2)) = .025: two of them come and go. Measured: .033
/// (Gaussian, F = 4), .020 (windowed).
pub const SPREAD_OF_WEIGHT: f64 = 0.05;

/// r2 at the rim (1) of a disc of 15 pixels seen through a lens: numbers of 30 pixels, ten roundings of 2^-24
/// each, over 15 pixels, doubled by the square, times 4 for the tilt.
pub const LENS_R2: f64 = 30.0 * 10.0 / 15.0 * 2.0 * 4.0 * EPS32 as f64;

/// Pixels whose samples lie so near to a rim that the rounding of a lens ray in focus decides: the f32
/// evaluation is uncertain to 1e-5 pixel or so, the rims are 400 pixels long with 8 samples a pixel: .03
/// samples. Measured: 0.
pub const IN_FOCUS_PIXELS: usize = 2;

/// A share near a half of so many hits: four deviations of a binomial distribution. Measured: .08 of it.
pub fn deviations_of_share(hits: f64) -> f64 {
    4.0 * 0.5 / hits.sqrt()
}

/// A variance below 1/15 from sums of 16 squares in f64, rounded to f32.
pub const VARIANCE: f32 = 1e-8;

/// Values of an `over` film in display space, below 1.1: a film's f32 rounding, in a part and in the whole,
/// times the slope of sRGB's encoding relative to its value (at most 1), and alpha's. Measured: 3.4e-8.
pub const DISPLAY_SPACE: f64 = 8.0 * EPS32 as f64;

/// The part of the pixels that may differ by more than 2/255 when the world is shifted: the 0.1 %.
/// Positions move by 1e-7 of the cloud's extent, so only samples on the very edge of a splat can change.
pub const SHIFTED_PIXELS: f64 = 1e-3;

/// A pixel over a background against the same without and what it leaves: colour and alpha of the latter, and the former, are
/// rounded to f32, all at most 1: 3 * 2^-24, and what f64 adds.
pub const BACKGROUND: f64 = 3.01 * EPS32 as f64;

/// What an eighth of a lens's radius leaves of the difference to the pinhole. Differences are of the first order in the radius
/// (edges move by so much), so it is 1/8 in the limit, and more where edges are blurred over pixels already. Measured:
/// .14 at most.
pub const CLOSING: f64 = 0.3;

/// The mean difference of a lens of 1e-9 to the pinhole: positions move by 1e-8 pixel, less than an f32 has digits for, but
/// the two forms of section 4 round differently, by some 2^-24 (6e-8) of the colours. Measured: 1e-10.
pub const CLOSED: f64 = 1e-7;

/// How far apart two estimates of the same picture may be, in standard deviations. By chance one of 10^6 pairs is; the tests
/// have some ten, always the same. Measured: 2.3.
pub const DEVIATIONS: f64 = 5.0;

/// What those estimates must tell apart: so many pixels to the side, and colours brighter by this.
pub const DETECTED: [f64; 2] = [0.1, 0.02];

/// The ratio of the variances of pictures of 4 and of 16 samples: 4 if samples are independent, 8 at edges (N^-3/2) for evenly
/// distributed ones, up to 64 in smooth parts (N^-3: Owen's scrambled nets). Of 16 seeds and some 1000 pixels a variance is
/// known to some percent. Measured: 17 and 7.3.
pub const FOUR_TIMES_THE_SAMPLES: [f64; 2] = [4.0, 64.0];

/// Share of the interior pixels of a closed surface that may be less than .99 opaque at 16 samples. Not derived: it is
/// what the project promises for surfels made from meshes, a quarter of what its first issue allows.
pub const INTERIOR_HOLES: f64 = 0.00025;

// ---------------------------------------------------------------------------------------------------------
// Set-up and evaluation of `splat-core`

/// Roundings, in eps of f32, of g = 1 + h.d, or of side and of h.m in g = side + h.m, relative to 1 + |h0 d0| + |h1 d1|,
/// offsets by their largest jitter: two of the constants, two of the products and of the sum, one of the final sum, and
/// in m two of the offset or three of p k, and one of their sum: nine; below twice that.
pub const SIDE_ROUNDINGS: f64 = 16.0;

/// Samples farther from the frame than this, in pixels, are not aimed at: no picture has them.
pub const FAR_FROM_THE_FRAME: f64 = 1e5;

/// The a-priori bound of an ordinary splat, in sigma: notes 3.5 say 3.7e-6 with offsets known to 1.5 eps
/// near the centre (a jitter of 1 pixel); with the widest filter's jitter of 2 pixels, and its roundings
/// counted one by one, they are known to 6 eps.
pub const ORDINARY_BOUND: f64 = 3.7e-6 * 4.0;

/// (u, v) in f64, by set-up and evaluation, against the intersection of ray and plane: what eight roundings
/// of every number that enters do to it, set-up having some eight in a row (screen point, Jacobian,
/// determinant, rotation, quotient, sum, product with the offset, quotient by g). Measured: 1.1.
pub const EXACT_ROUNDINGS: f64 = 8.0;

/// The same for an ordinary splat, absolute, in sigma (and the relative depth): a pixel's numbers add up to
/// less than 1000 sigma, times 1 + r < 3, times eps, times three of the eight roundings, since not all of
/// them happen at once. Measured: 4.8e-14.
pub const EXACT_ORDINARY: f64 = 1e-12;

/// A culled splat may still be hit by a sample within the rounding of f32 of its rim or of the near plane,
/// 6e-8 of them; a hundred times that must not be culled.
pub const INSIDE_BY: f64 = 1e-5;

/// The error of (u, v), in sigma, up to which f32 can tell where a splat is hit: beyond it set-up drops a
/// pinhole's splat as edge-on.
pub const CERTAIN: f64 = 0.25;

/// A weight of `quartic8` for a Gaussian with F = 2, beyond what the error of r2 makes of it: 1.1e-7 of the polynomial
/// (section 4), which counts its roundings, and the two of x = r2 c, eps32 each, times x/2 < 1.
pub const HARD_WEIGHT: f64 = 1.1e-7 + 2.0 * EPS32 as f64;

/// The near plane as rounded to f32, relative.
pub const HARD_NEAR: f64 = EPS32 as f64;

/// A colour from sums of `fragments` fragments of random weight in one layer. The a-priori bound, [`resolve_rounding`], takes all
/// roundings to have one sign. They are as good as random: a running sum S_k is rounded by at most eps32 S_k, so the deviation of the
/// whole, relative to the last sum, is below eps32 sqrt(sum (k/n)^2) / sqrt(3) = eps32 sqrt(n) / 3; ten of them, since the
/// errors of numerator and denominator are two, and pixels are many. Measured: 4.7e-6 of 6.3e-5.
pub fn many_fragments(fragments: usize) -> f64 {
    10.0 * f64::from(EPS32) * libm::sqrt(fragments as f64) / 3.0
}

/// The share of certain hits of a steep splat that a lens may lose next to the splat's plane: g must exceed
/// 8 times the largest error of the numerators, and a hit is certain where it exceeds 4 times its own: half of a strip
/// that is some hundredth of the lens. Measured: .6 % (a splat of 20 pixels, 89.9 degrees), .2 % (2 pixels, 89.5
/// degrees).
pub const LENS_STRIP: f64 = 0.01;

/// Percent of all hits that a splat of 2 pixels before the focus may lose, of tilts up to 60, 85 and 89 degrees: what the
/// specification says (notes 3.5), and a third. Measured: 0, .050, .22.
pub const LOST_2_PX: [f64; 3] = [0.0, 0.067, 0.3];

/// The same of a splat of .3 pixel. Measured: 0, .27, 1.5.
pub const LOST_03_PX: [f64; 3] = [0.0, 0.4, 2.0];

/// The extent of a clipped disc on the screen, relative to the numbers of which its points are made (size /
/// least depth * (1 + screen), and 1/sqrt of a short chord's share of the depth): some twenty roundings in
/// a row, the discriminant's doubled, for the closed form, and as many for the sampled truth. Measured: 7.7
/// eps.
pub const EXTENT: f64 = 64.0 * EPS;

/// The centre of a splat against its extent, where centre and axes differ by up to 1e3 in length, so that
/// sums of their squares hide up to 1e6 of each other's digits: 1e6 eps, and some 1000 roundings of chance.
pub const OF_A_SIZE: f64 = 1e9 * EPS;

/// The greatest value of a plane of the world over a splat, in units of distance: a pose of up to 5 units
/// and a scale of 2, some thirty roundings of numbers below 30.
pub const PLANE: f64 = 1000.0 * EPS;

/// A share of the lens by 100 x 100 points, relative to its radius: a segment of the disc that is .03 R
/// high is wider than .2 R in its middle, and the points are .02 R apart, so that it holds one.
pub const LENS_GRID: f64 = 0.03;

/// A splat under a pose of any matrix with a determinant above .1, within 3 units: its inverse has entries
/// below 20, and three products in a row have some ten roundings each. Measured: 1e-14.
pub const POSE: f64 = 600.0 * EPS;

/// A depth interval is rounded to f32 once: 2^-24, and what f64 adds. Measured: 5.92e-8.
pub const INTERVAL: f64 = 5.97e-8;

/// A fragment's depth, relative, against the truth: three roundings (2e-7) for most splats (notes 3.2),
/// some twenty for the steep ones of these scenes whose g is the difference of larger numbers. Measured:
/// 4.1e-7.
pub const DEPTH_F32: f64 = 1.2e-6;

/// Extreme pixel centres of a blurred point, in pixels: half a pixel, a pixel's splat, and the rim of a
/// disc whose outermost two pixels 64 samples may miss.
pub const BOKEH: f64 = 3.0;

/// How much less than the exact kernel a weight of the floor table may be: r2 in f32 is off by some ten
/// roundings, which can carry it into the next bin, and half of that is the exponential's change; the entry
/// is rounded, too.
pub const WEIGHT_F32: f64 = 6e-7;

/// Linear interpolation in 256 bins at F = 2, relative: 1.9e-6 (notes, E18), and 2.5 roundings of f32.
pub const LERP_F2: f64 = 2.1e-6;

// Footprints, differentials and mappings.

/// The determinant of a 2x2 matrix of `f32` in `f64`: both products are exact, their difference is rounded
/// once. Measured, by way of a quotient: 2.2e-16.
pub const DETERMINANT: f64 = EPS;

/// The product of a 2x2 matrix with a determinant above .1 and entries below 2, and its inverse, against 1:
/// the condition is below 80, some six roundings. Measured: 3.6e-15.
pub const INVERSE: f64 = 480.0 * EPS;

/// A footprint that was rounded to `f32`, relative: half a unit in the last place, and what `f64` adds.
pub const FOOTPRINT_F32: f64 = 6.0e-8;

/// Semi-axes and products of a footprint's principal axes, relative to the major one: some ten roundings of
/// `f64`.
pub const PRINCIPAL: f64 = 20.0 * EPS;

/// A derivative in `f64` against extrapolated central differences: their error is h^4/480 times the fifth
/// derivative and some eps/h. At h = 1e-3, a distance of .3 from the axis and changes of .9 (scaled by up to
/// 2) the former is 4!/(2 pi) (1.8/.3)^5 = 3e4: 6e-11. Measured: 5.7e-12.
pub const CENTRAL_DIFFERENCE: f64 = 1e-10;

/// The splat's derivatives, relative to the largest, against extrapolated differences of its evaluation in
/// `f64` with the same constants: at h = 1e-2 pixel eps/h is 1e-14, of (u, v) up to 100 times their
/// derivative. Measured: 2.6e-13.
pub const SPLAT_DERIVATIVE: f64 = 1e-11;

/// A point of the tangent plane, n.p + d: some six roundings of numbers below 10. Measured: 8.4e-16.
pub const ON_PLANE: f64 = 120.0 * EPS;

/// How a direction changes from one ray to another 1e-5 away, against the derivative, relative: of the first
/// order in the distance, times second derivatives of up to 10. Measured: 2.9e-5.
pub const FIRST_ORDER: f64 = 1e-4;

/// As [`FIRST_ORDER`], over many surfaces, with incidence up to 73 degrees, curvatures up to 2 and refraction
/// to within .1 of the critical cosine: second derivatives of up to 100. Measured: 1.2e-4.
pub const FIRST_ORDER_MANY: f64 = 1e-3;

/// Where a camera's ray is on the picture, in pixels: a pose of up to 5 units, scaled by 1/2 to 2 and
/// inverted, some ten roundings of numbers below 10, times 90 pixels a unit. Measured: 1.3e-13.
pub const RAY_PIXEL: f64 = 10_000.0 * EPS;

/// Neighbours on a plane by two formulas: planes that are up to 50 degrees steep, some twenty roundings of
/// numbers below 10.
pub const NEIGHBOUR: f64 = 200.0 * EPS;

/// The derivative of a splat by its constants rounded to `f32`, relative: ten of them, 2^-24 each, and some
/// more where a steep splat's differ in size. Measured: 5.7e-8.
pub const SPLAT_CONSTANTS: f64 = 1e-6;

/// acos(z) and atan2 of the same point in `f64`, over pi: eps/sin(theta) for the former, of 2000 points of a
/// cube, the nearest of which to the axis are .02 from it in the mean. Measured: 6.8e-16.
pub const ACOS: f64 = 100.0 * EPS;

/// A checkerboard's mean over up to 3 x 3 checks by 64 x 64 midpoints: four edges in each direction, each off
/// by up to half a sample of 64, of an amplitude of 2 halved: 8/64 of half the amplitude.
pub const CHECKS_BY_4096: f64 = 0.5 * 8.0 / 64.0;

/// The root mean square of that: up to 8 edges, each uniformly off by half a sample of 64 (sqrt(8/12)/64),
/// halved; fewer edges in most of the boxes. Measured: 3.8e-3.
pub const CHECKS_BY_4096_RMS: f64 = 0.0065;

/// The clamped spectrum against the mean over an ellipse: 2 J1(w)/w is .71 at w = pi/2 (1/4 cycle), where all
/// is kept, and .18 at w = pi, where nothing is. The greatest difference is .3016, at .27 cycle, where the
/// fading has hardly begun.
pub const CLAMPING: f64 = 0.302;

/// A smooth function's mean by 64 x 64 strata: in each it varies by up to pi/32 of an amplitude of 1 with
/// slopes of up to 10, over the root of their number. Measured: 8.6e-4; by 8 x 8 strata, 64 times this is
/// allowed, 2.5e-2.
pub const SUPERSAMPLED: f64 = 1e-3;

/// A function with edges: strata along up to 400 of the 4096 are cut by one, of a variance of 1/4 at most,
/// four standard deviations, and the same of the truth.
pub const SUPERSAMPLED_EDGES: f64 = 2.0 * 4.0 * 10.0 / 4096.0;

/// The share of noise that its mean over a disc keeps, from 1000 places: each of a standard deviation of
/// about .3 of it.
pub const NOISE_SHARE: f64 = 0.03;

// ---------------------------------------------------------------------------------------------------------
// Pyramids and filters

/// Anisotropies of the error bars below.
pub const ANISOTROPIES: [f64; 4] = [1.0, 4.0, 16.0, 64.0];

/// The root mean squared error of variance-compensated EWA at its default quality over that of pbrt's EWA at the width that is best
/// for it (which differs by anisotropy), on a photograph. Not derived: what the project promises (specification,
/// section 7). Measured: .17, .11, .10, .09.
pub const VC_PHOTOGRAPH: [f64; 4] = [0.30; 4];

/// The same on a checkerboard of 16 texels a square. Measured: .52, .24, .23, .22.
pub const VC_CHECKERBOARD: [f64; 4] = [0.85, 0.5, 0.5, 0.5];

/// The same on a zone plate. Measured: .36, .30, .34, .29.
pub const VC_ZONE_PLATE: [f64; 4] = [0.5; 4];

/// A mean of equal values, relative: its sums are f64, so it is the value but for the rounding to f32, and half an ulp
/// that the quotient may move it.
pub const CONSTANT_TEXTURE: f64 = 1.2e-7;

/// A convex combination may leave the range of its values by the rounding to f32 and of f64 sums, relative to the
/// greatest of them.
pub const TEXEL_RANGE: f64 = 1.2e-7;

/// Conjugate vectors of one ellipse, given in f32: each is off by 2^-24 of the major axis, which moves the minor one by
/// up to 2^-24 times the anisotropy (16) of itself: 1e-6, and the filtered value of [0, 1) by a few times that.
pub const CONJUGATE: f64 = 1e-5;

/// The jump of variance-compensated EWA across a switch of levels, as root mean square over that of the larger of its two errors
/// there: at most their sum. Measured: .9 to 1.0, so the jump is the error of the coarser side alone. In numbers, at qualities 1.5, 2, 3,
/// for textures in [0, 1]: photograph .0023, .0010, .0004; zone plate .012, .0064, .0027; checkerboard .019, .010, .0044.
pub const LEVEL_SWITCH: f64 = 2.0;

/// The variance of a lookup of a parabola against the kernel's, relative: sums over texels stand for the integral, which
/// is off by a few percent where the kernel is 1.25 to 3 texels wide, and the level's own variance is a mean over phases.
pub const LOOKUP_VARIANCE: f64 = 0.05;

/// The sum of a mesh's surfels' areas, and their axes, relative: all are rounded to f32 once, by up to 2^-24, or twice in
/// a product of two. Measured: 1.5e-7.
pub const SAMPLED_AREA: f64 = 4.0 / 16_777_216.0;

/// A surfel's place from its texture coordinates, in scene units: positions of up to 4, axes and coordinates in f32, and
/// the inverse of a map whose area is a tenth or more of its sides' squares (below 8): some ten roundings of 4 * 2^-24,
/// enlarged twentyfold. Measured: below 1e-5.
pub const INTERPOLATED: f64 = 10.0 * 4.0 * 20.0 / 16_777_216.0;

/// The nearest other surfel on an evenly sampled mesh, in spacings (the square root of the area of one): least, and mean.
/// The densest packing has 1.07, random points 0.50 in the mean and 0.01 as the least. Measured: 0.71 and 0.83.
pub const EVEN_SPACING: [f64; 2] = [0.65, 0.8];

/// The standard deviation of the distance to the nearest other surfel, over its mean. Random points have 0.52. Measured:
/// 0.090.
pub const SPACING_SCATTER: f64 = 0.12;

/// Surfels on a part of a mesh's surface against its share, for 1000 expected on a side of a cube (250 in its middle):
/// 4 * 1000 random candidates have a standard deviation of 1.6 % (3.2 %), of which the elimination evens out a part.
/// Measured: 1.8 %.
pub const EVEN_SHARE: f64 = 0.05;

// ---------------------------------------------------------------------------------------------------------
// The splat shader

/// Where a texture is seen, in pixels: a lookup is drawn towards its splat's centre by 1 - 1/(1 + .136/sigma^2), sigma in
/// pixels, times up to 2 sigma, which the splats on all sides of a pixel cancel but for the part that their weights differ by
/// within a pixel; a tilted splat has a sigma of 1.9 pixels at 62 degrees. Plus the mean of the samples that a pixel has.
pub const TEXTURE_PLACE: f64 = 0.1;

/// A direction from a sky of 256 x 128 texels, as seen in a plane mirror: within half a row of a pole (pi/256 = .0123) the
/// last row stands for the pole; plus the mean over a pixel's footprint (1/100, squared) and the splats' own places.
pub const SKY_TEXEL: f64 = 0.015;

/// How far from its centre a splat is looked up, in sigma: the mean of the product of two Gaussians, at most 2 (the
/// radius) times the part that the pixel has, plus a semi-axis of 1/sqrt(KERNEL_VARIANCE) = 2.71 times the root of the
/// other part: at most sqrt(2^2 + 2.71^2) with equality where both have half.
pub const LOOKUP_REACH: f64 = 3.4;

/// Colours of image textures in both engines, for texels in [0, 1]: a lookup by lanes and a scalar one are within some 16
/// roundings of 2^-24 of each other where both decide for the same level of the pyramid, and so is a mean of them.
pub const ENGINES_COLORS: f64 = 2e-6;

// ---------------------------------------------------------------------------------------------------------
// Texture lookups by lanes

/// A texture lookup by lanes against the scalar one, for values in [0, 1], per anisotropy A. In `f32`: the ellipse takes some
/// 30 roundings; a texel's place along a row of up to A half-widths is off by A ulps, r2 by twice and the weight by four
/// times that; and each of eight lanes adds up to A / 2 vectors a row's width, which is off by half an ulp each. Together
/// (32 + 8 A) 2^-24, of which most cancel: errors of weights have mean 0.
pub fn lanes(anisotropy: f64) -> f64 {
    (32.0 + 8.0 * anisotropy) / 16_777_216.0
}

/// How far, relative to an axis, a decision of `f32` lies from that of `f64`: some 30 roundings of 2^-24.
pub const LANES_DECIDE: f64 = 2e-6;

/// A mean of equal values by lanes: the sum of weighted values and that of weights are off by as many roundings as a lane
/// has vectors (up to 80 for an anisotropy of 16), 2^-24 each, on both sides alike but for one in each product.
pub const LANES_CONSTANT: f64 = 5e-6;

/// How far a mean by lanes may leave the range of its values, relative to the greatest of them: as for
/// [`LANES_CONSTANT`].
pub const LANES_RANGE: f64 = 5e-6;

// ---------------------------------------------------------------------------------------------------------
// Lens distortion

/// The mean of the hits of a disc of 1.5 pixels against its centre's image, in pixels: 300 hits or more, evenly spread, say
/// where the rim is to a thousandth of the disc; the disc's own bend moves the mean by .001.
pub const DISTORTED_POINT: f64 = 0.01;

/// The mean of what a line 5 pixels wide has in a column, 64 samples a pixel, against the line's middle, in pixels: some 200
/// hits, the ends of the column's runs off by a part of a sample's distance of 1/8.
pub const DISTORTED_LINE: f64 = 0.06;

/// Depth of a hit, relative, per 1 + its relative change over a tan unit: roundings of 2^-24, and positions of 10^-7 pixel.
pub const DISTORTED_DEPTH: f64 = 1e-5;

/// A position of the film by way of the depth in `f32`, in pixels: 2^-24 of places 100 pixels from the axis, a few times.
pub const DISTORTED_POSITION: f64 = 1e-4;

// ---------------------------------------------------------------------------------------------------------
// Trained splats

/// A colour by spherical harmonics against the sum written down: 16 terms of at most 1/2, rounded in `f32`, then coded and
/// decoded again, some ten roundings more whose slope is at most 13: (16 + 130) 2^-25.
pub const HARMONIC_COLOR: f32 = 5e-6;

/// Root mean square difference of pictures of Playbot from different files, display-referred. Measured: .0034, .0095, .0000,
/// .0099; these are half as much again. A step of the formats, of colours (1/32 of each harmonic, some 8 of them), is .01 in a
/// splat, and errors of splats average out; `.spz` cuts harmonics off at 1, too, and `.splat` colours at 0 and 1.
pub const PLAYBOT_COMPRESSED: f64 = 0.005;
/// As above, for `.spz`.
pub const PLAYBOT_SPZ: f64 = 0.015;
/// As above, for 2DGS, which is the same but for rounding.
pub const PLAYBOT_2DGS: f64 = 1e-4;
/// As above, for `.splat`.
pub const PLAYBOT_SPLAT: f64 = 0.015;
