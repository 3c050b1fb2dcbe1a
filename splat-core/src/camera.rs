//! Cameras: perspective with a pinhole or a thin lens, and orthographic. SPEC section 1.

use crate::Error;
use glam::{DMat3, DMat4, DVec2, DVec3, DVec4, Vec4Swizzles};

/// A camera.
///
/// Camera space has x right, y **down** and w forward (depth), the eye at its origin. Row 0 of the picture is the
/// top one; pixel (i, j) covers [i, i + 1) x [j, j + 1).
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    /// Width of the full frame, in pixels.
    pub width: u32,
    /// Height of the full frame, in pixels.
    pub height: u32,
    /// How camera space becomes pixels.
    pub projection: Projection,
    /// Principal point (`vpMid` in the listing), in pixels.
    pub principal_point: DVec2,
    /// World to camera space, for column vectors: p_camera = M p_world. May carry scale; the last row is 0 0 0 1.
    pub world_to_camera: DMat4,
    /// Nothing nearer than this depth is seen, in camera units; greater than 0 (0 allowed if orthographic).
    pub near: f64,
    /// Nothing farther than this depth is seen, in camera units; infinity for no limit.
    pub far: f64,
    /// Clip planes (a, b, c, d) in world space: a splat wholly in a x + b y + c z + d < 0 is not drawn.
    pub clip_planes: Vec<DVec4>,
    /// How the lens of a real camera bends the picture; `None` is an ideal one. Perspective only.
    pub distortion: Option<Distortion>,
}

/// Lens distortion after Brown and Conrady, in the form and with the names of OpenCV and COLMAP.
///
/// An ideal point (x, y) in tan units (x/w, y/w) with r2 = x^2 + y^2 is seen at
/// x (1 + k1 r2 + k2 r2^2 + k3 r2^3) + 2 p1 x y + p2 (r2 + 2 x^2), and for y likewise with p1 and p2 exchanged.
///
/// Any coefficients make a picture. Where they fold it over or stretch it more than eightfold it stays empty, as beyond
/// the image circle of a lens: see [`crate::distortion`].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Distortion {
    /// k1, k2, k3.
    pub radial: [f64; 3],
    /// p1, p2.
    pub tangential: [f64; 2],
}

/// How camera space becomes pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Projection {
    /// pixel = (x/w, y/w) * focal_length + principal_point.
    Perspective {
        /// Focal length (`vpScale` in the listing), in pixels, per axis; both positive.
        focal_length: DVec2,
        /// A thin lens, or `None` for a pinhole.
        lens: Option<Lens>,
    },
    /// pixel = (x, y) * pixels_per_unit + principal_point.
    Orthographic {
        /// Pixels a camera unit; positive.
        pixels_per_unit: f64,
    },
}

/// A thin lens in the plane w = 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lens {
    /// Radius of the aperture, in camera units; greater than 0.
    pub radius: f64,
    /// Depth of the plane of focus, in camera units; infinity allowed.
    pub focus: f64,
    /// Number of straight blades (3 or more), or 0 for a round aperture.
    pub blades: u32,
}

impl Lens {
    /// The listing's lens of f-number `fstop`, focused at depth `focus`, its image plane at 1.
    ///
    /// lensRadius = focalLength / (2 N) (L33), focalLength = 1 / (1 + 1/focus) (L32, in the form that allows
    /// a focus at infinity: erratum E8).
    pub fn from_fstop(fstop: f64, focus: f64, blades: u32) -> Self {
        let focal_length = 1.0 / (1.0 + 1.0 / focus);
        Self { radius: focal_length / (2.0 * fstop), focus, blades }
    }
}

impl Camera {
    /// The lens, where there is one.
    pub fn lens(&self) -> Option<Lens> {
        match self.projection {
            Projection::Perspective { lens, .. } => lens,
            Projection::Orthographic { .. } => None,
        }
    }

    /// Pixels a unit of x/w (perspective) or of x (orthographic), per axis: `vpScale` of the listing.
    pub fn pixel_scale(&self) -> DVec2 {
        match self.projection {
            Projection::Perspective { focal_length, .. } => focal_length,
            Projection::Orthographic { pixels_per_unit } => DVec2::splat(pixels_per_unit),
        }
    }

    /// Whether all rays are parallel.
    pub fn is_orthographic(&self) -> bool {
        matches!(self.projection, Projection::Orthographic { .. })
    }

    /// The linear part of `world_to_camera`.
    pub fn linear(&self) -> DMat3 {
        DMat3::from_mat4(self.world_to_camera)
    }

    /// Camera units a scene unit: the cube root of the linear part's determinant, and exactly 1 where it is within
    /// 10^-6 of that, as it is for rotations written with few digits.
    pub fn scale(&self) -> f64 {
        let scale = libm::cbrt(self.linear().determinant().abs());
        if (scale - 1.0).abs() < 1e-6 { 1.0 } else { scale }
    }

    /// World position of the eye (perspective) or of the camera-space origin (orthographic), found by solving
    /// M eye = 0, since M may carry scale.
    pub fn eye(&self) -> DVec3 {
        -(self.linear().inverse() * self.world_to_camera.w_axis.xyz())
    }

    /// Checks every field.
    ///
    /// # Errors
    /// [`Error::Invalid`] naming the field, what it holds, and what it may hold.
    pub fn check(&self) -> Result<(), Error> {
        const POSITIVE: &str = "a finite number greater than 0";
        let positive = |what, value: f64| {
            if value.is_finite() && value > 0.0 { Ok(()) } else { Err(Error::invalid(what, value, POSITIVE)) }
        };
        for (what, value) in [("camera width", self.width), ("camera height", self.height)] {
            if value == 0 || value > MAX_SIDE {
                return Err(Error::invalid(what, value, "1 to 65536 pixels"));
            }
        }
        match self.projection {
            Projection::Perspective { focal_length, lens } => {
                positive("camera fx", focal_length.x)?;
                positive("camera fy", focal_length.y)?;
                positive("camera near", self.near)?;
                if let Some(lens) = lens {
                    positive("lens radius", lens.radius)?;
                    if lens.focus.is_nan() || lens.focus <= 0.0 {
                        return Err(Error::invalid("lens focus", lens.focus, "a distance greater than 0"));
                    }
                    if matches!(lens.blades, 1 | 2) || lens.blades > 64 {
                        return Err(Error::invalid("lens blades", lens.blades, "0 (round) or 3 to 64"));
                    }
                }
            }
            Projection::Orthographic { pixels_per_unit } => {
                positive("camera pixels_per_unit", pixels_per_unit)?;
                if !(self.near.is_finite() && self.near >= 0.0) {
                    return Err(Error::invalid("camera near", self.near, "a finite number, 0 or more"));
                }
            }
        }
        if self.far.is_nan() || self.far <= self.near {
            return Err(Error::invalid("camera far", self.far, "a depth greater than near"));
        }
        if !self.principal_point.is_finite() {
            return Err(Error::invalid("camera cx, cy", self.principal_point, "finite numbers"));
        }
        if !self.world_to_camera.is_finite() || self.world_to_camera.row(3) != DVec4::W {
            let expected = "16 finite numbers with the last row 0 0 0 1";
            return Err(Error::invalid("camera world_to_camera", self.world_to_camera, expected));
        }
        if !self.eye().is_finite() {
            let expected = "a matrix whose upper left 3x3 part can be inverted";
            return Err(Error::invalid("camera world_to_camera", self.world_to_camera, expected));
        }
        if let Some(Distortion { radial: [k1, k2, k3], tangential: [p1, p2] }) = self.distortion {
            let finite = [k1, k2, k3, p1, p2].into_iter().all(f64::is_finite);
            if self.is_orthographic() || !finite {
                let found = format!("k1, k2, k3 = {k1}, {k2}, {k3}; p1, p2 = {p1}, {p2}");
                return Err(Error::invalid(
                    "camera distortion",
                    found,
                    "finite numbers, of a perspective camera",
                ));
            }
        }
        if self.clip_planes.iter().any(|plane| !plane.is_finite()) {
            return Err(Error::invalid("clip plane", "a value that is not finite", "finite numbers"));
        }
        Ok(())
    }
}

/// Greatest width and height of a picture, in pixels.
pub const MAX_SIDE: u32 = 65_536;
