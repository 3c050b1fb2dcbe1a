//! The ellipse that a splat is in the picture: its box, and for whoever visits row by row its outline.

use super::bounds::Extent;
use super::number::{greater, lesser};
use crate::distortion::FilmMap;
use crate::evaluate::SplatConstants;
use glam::{DMat2, DVec2};

/// Below this, 1 - (half depth / depth)^2 tells of a splat that reaches to the camera plane: no ellipse is worth its while.
const LEAST_CLEARANCE: f64 = 1.0 / 16.0;

/// An ellipse that reaches farther than this (in pixels) from the splat's pixel is not followed: `f32` could not.
const MAX_REACH: f64 = 4096.0;

/// An ellipse on the picture, in pixels relative to the corner of the splat's pixel (xi, yi).
///
/// It holds every sample position from which the splat may be hit, through any point of the lens, in `f32` as in exact
/// arithmetic: the projection of the disc whose box are the candidates (see `setup/margin.rs`), widened by the circle
/// of confusion, and brought to the film if the lens distorts.
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

    /// The outline of a disc whose picture, blurred, is `ellipse`. (`xf`, `yf`) is the place of the splat's centre in its
    /// pixel.
    #[inline(always)]
    pub(super) fn new(ellipse: &Ellipse, [xf, yf]: [f64; 2]) -> Self {
        let &Ellipse { center, half: [half_width, half_height], sxy, determinant } = ellipse;
        let reach = greater(center[0].abs() + half_width, center[1].abs() + half_height);
        if !(reach < MAX_REACH && half_height > 0.0 && half_width > 0.0) {
            return Self::EVERYTHING;
        }
        let inverse_product = 1.0 / (half_width * half_height);
        Self {
            center: [(xf + center[0]) as f32, (yf + center[1]) as f32],
            half_width: half_width as f32,
            inverse_half_height: (half_width * inverse_product) as f32,
            correlation: (sxy * inverse_product) as f32,
            narrowing: lesser(determinant.sqrt() * inverse_product, 1.0) as f32,
        }
    }

    /// Whether it excludes anything.
    pub fn is_known(&self) -> bool {
        self.half_width.is_finite()
    }
}

/// The picture of a disc that keeps clear of the camera plane: the ellipse (x - center)^T S^-1 (x - center) <= 1, in
/// pixels relative to the picture of the disc's centre.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ellipse {
    center: [f64; 2],
    /// sqrt(Sxx) and sqrt(Syy): half of its width and height.
    half: [f64; 2],
    sxy: f64,
    /// det S.
    determinant: f64,
}

impl Ellipse {
    /// The picture of a disc of `radius` sigma. `None` if it reaches to the camera plane or nearly so.
    #[inline(always)]
    pub(super) fn new(constants: &SplatConstants<f64>, orthographic: bool, radius: f64) -> Option<Self> {
        if !constants.centred {
            return None;
        }
        // The picture of (u, v) lies J (u, v) / (1 + slope.(u, v)) from that of the centre. Undo the rotated basis of
        // `project`: the rows of J are (p, m) and (q, 0).
        let q = 1.0 / constants.a1;
        let m = 1.0 / constants.b[0];
        let p = -constants.b[1] * q * m;
        let per_depth = if orthographic { 0.0 } else { 1.0 / constants.depth };
        let slope = constants.depth_slope.map(|slope| slope * per_depth);
        let square = radius * radius;
        let clearance = 1.0 - square * (slope[0] * slope[0] + slope[1] * slope[1]);
        if clearance < LEAST_CLEARANCE {
            return None;
        }
        // A line x = const touches the picture where x^2 (1 - R^2 slope^2) + 2 x R^2 Jx.slope - R^2 Jx^2 = 0, with the row
        // Jx of J: so its centre, and S = (R^2 J J^T + centre centre^T (1 - R^2 slope^2)) / (1 - R^2 slope^2).
        let inverse_clearance = 1.0 / clearance;
        let scale = square * inverse_clearance;
        let center = [-scale * (p * slope[0] + m * slope[1]), -scale * q * slope[0]];
        let sxx = scale * (p * p + m * m) + center[0] * center[0];
        let syy = scale * q * q + center[1] * center[1];
        Some(Self {
            center,
            half: [sxx.sqrt(), syy.sqrt()],
            sxy: scale * p * q + center[0] * center[1],
            // Without the cancellation of sxx syy - sxy^2.
            determinant: scale * scale * (q * m) * (q * m) * inverse_clearance,
        })
    }

    /// Its box, given the picture of the disc's centre.
    #[inline(always)]
    pub(super) fn extents(&self, from: [f64; 2]) -> [Extent; 2] {
        [0, 1].map(|axis| {
            let center = from[axis] + self.center[axis];
            Extent { min: center - self.half[axis], max: center + self.half[axis] }
        })
    }

    /// An ellipse around what of this one is seen on the film of a lens that distorts, relative to the same place of the
    /// picture: its image under the distortion's tangent at its centre, widened by the bend between that and the edge.
    pub(super) fn on_film(&self, from: DVec2, map: &FilmMap) -> Self {
        let center = from + DVec2::from(self.center);
        let slope = map.slope(center);
        let [sxx, syy] = self.half.map(|half| half * half);
        let s = DMat2::from_cols(DVec2::new(sxx, self.sxy), DVec2::new(self.sxy, syy));
        let image = slope * s * slope.transpose();
        let stretch = slope.determinant();
        Self {
            center: (map.film(center) - from).to_array(),
            half: [image.x_axis.x.sqrt(), image.y_axis.y.sqrt()],
            sxy: image.x_axis.y,
            determinant: stretch * stretch * self.determinant,
        }
        .widened(map.bend(center, DVec2::from(self.half)).to_array())
    }

    /// An ellipse around the sum of this one and an upright one of the radii `blur`, in pixels.
    #[inline(always)]
    pub(super) fn widened(&self, blur: [f64; 2]) -> Self {
        let [bxx, byy] = blur.map(|blur| blur * blur);
        let sharp = bxx + byy == 0.0;
        if sharp {
            return *self;
        }
        // The sum of two ellipses lies within that of the matrix (1 + 1/t) S + (1 + t) B, for any t > 0; this t makes
        // its trace least.
        let [sxx, syy] = self.half.map(|half| half * half);
        let ratio = ((sxx + syy) / (bxx + byy)).sqrt();
        let [grow, widen] = [1.0 + 1.0 / ratio, 1.0 + ratio];
        Self {
            center: self.center,
            half: [(grow * sxx + widen * bxx).sqrt(), (grow * syy + widen * byy).sqrt()],
            sxy: grow * self.sxy,
            determinant: grow * grow * self.determinant
                + grow * widen * (sxx * byy + syy * bxx)
                + widen * widen * bxx * byy,
        }
    }
}
