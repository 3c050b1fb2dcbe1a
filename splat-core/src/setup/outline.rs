//! An ellipse around all places of the picture from which a splat may be hit, for whoever visits row by row.

use crate::evaluate::SplatConstants;

/// Below this, 1 - (half depth / depth)^2 tells of a splat that reaches to the camera plane: no ellipse is worth its while.
const LEAST_CLEARANCE: f64 = 1.0 / 16.0;

/// An ellipse that reaches farther than this (in pixels) from the splat's pixel is not followed: `f32` could not.
const MAX_REACH: f64 = 4096.0;

/// An ellipse on the picture, in pixels relative to the corner of the splat's pixel (xi, yi).
///
/// It holds every sample position from which the splat may be hit, through any point of the lens, in `f32` as in exact
/// arithmetic: the projection of the disc whose box are the candidates (see [`super::margin`]), widened by the circle
/// of confusion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outline {
    /// Its centre.
    pub center: [f32; 2],
    /// Half of its width; infinite where nothing is known.
    pub half_width: f32,
    /// 1 over half of its height.
    pub inverse_half_height: f32,
    /// Sxy / sqrt(Sxx Syy), where S is the matrix of the ellipse p^T S^-1 p = 1: how slanted it is.
    pub correlation: f32,
    /// sqrt(1 - correlation^2): how wide its middle row is, relative to `half_width`.
    pub narrowing: f32,
}

impl Outline {
    /// An outline that excludes nothing.
    pub const EVERYTHING: Self = Self {
        center: [0.0; 2],
        half_width: f32::INFINITY,
        inverse_half_height: 0.0,
        correlation: 0.0,
        narrowing: 1.0,
    };

    /// The outline of a disc of `radius` sigma, widened by a circle of confusion of the radii `blur`, in pixels.
    pub fn new(
        constants: &SplatConstants<f64>,
        orthographic: bool,
        radius: f64,
        blur: [f64; 2],
    ) -> Self {
        Self::ellipse(constants, orthographic, radius, blur).unwrap_or(Self::EVERYTHING)
    }

    fn ellipse(
        constants: &SplatConstants<f64>,
        orthographic: bool,
        radius: f64,
        blur: [f64; 2],
    ) -> Option<Self> {
        if !constants.centred {
            return None;
        }
        // The picture of (u, v) lies J (u, v) / (1 + slope.(u, v)) from that of the centre. Undo the rotated basis of
        // `project`: the rows of J are (p, m) and (q, 0).
        let q = 1.0 / constants.a1;
        let m = 1.0 / constants.b[0];
        let p = -constants.b[1] * q * m;
        let slope = constants.depth_slope.map(|s| if orthographic { 0.0 } else { s / constants.depth });
        let square = radius * radius;
        let clearance = 1.0 - square * (slope[0] * slope[0] + slope[1] * slope[1]);
        if clearance < LEAST_CLEARANCE {
            return None;
        }
        // A line x = const touches the picture where x^2 (1 - R^2 slope^2) + 2 x R^2 Jx.slope - R^2 Jx^2 = 0, with the row
        // Jx of J: so its centre, and S = (R^2 J J^T + centre centre^T (1 - R^2 slope^2)) / (1 - R^2 slope^2).
        let scale = square / clearance;
        let center = [-scale * (p * slope[0] + m * slope[1]), -scale * q * slope[0]];
        let sxx = scale * (p * p + m * m) + center[0] * center[0];
        let syy = scale * q * q + center[1] * center[1];
        let sxy = scale * p * q + center[0] * center[1];
        // det S without its cancellation.
        let determinant = scale * scale * (q * m) * (q * m) / clearance;

        // The sum of two ellipses lies within that of the matrix (1 + 1/t) S + (1 + t) B, for any t > 0; this t makes
        // its trace least.
        let [bxx, byy] = blur.map(|blur| blur * blur);
        let ratio = ((sxx + syy) / (bxx + byy)).sqrt();
        let (grow, widen) = if bxx + byy > 0.0 { (1.0 + 1.0 / ratio, 1.0 + ratio) } else { (1.0, 0.0) };
        let [xx, yy] = [grow * sxx + widen * bxx, grow * syy + widen * byy];
        let determinant = grow * grow * determinant
            + grow * widen * (sxx * byy + syy * bxx)
            + widen * widen * bxx * byy;
        let [half_width, half_height] = [xx.sqrt(), yy.sqrt()];
        let reach = (center[0].abs() + half_width).max(center[1].abs() + half_height);
        if !(reach < MAX_REACH && half_height > 0.0 && half_width > 0.0) {
            return None;
        }
        Some(Self {
            center: [(constants.xf + center[0]) as f32, (constants.yf + center[1]) as f32],
            half_width: half_width as f32,
            inverse_half_height: (1.0 / half_height) as f32,
            correlation: (grow * sxy / (half_width * half_height)) as f32,
            narrowing: ((determinant / (xx * yy)).sqrt().min(1.0)) as f32,
        })
    }

    /// Whether it excludes anything.
    pub fn is_known(&self) -> bool {
        self.half_width.is_finite()
    }
}
