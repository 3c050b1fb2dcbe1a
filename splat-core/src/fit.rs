//! Cameras that show a whole cloud.

use crate::camera::MAX_SIDE;
use crate::setup::{View, camera_splat};
use crate::{Camera, Cloud, Error, Projection, RenderOptions};
use glam::{DMat3, DMat4, DVec2, DVec3};

/// The axis of the world that points up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Up {
    /// +y up, the front towards +z: scanned objects.
    Y,
    /// +z up, the front towards -y: maps, buildings.
    Z,
    /// -y up, the front towards -z: clouds in the axes of a camera.
    MinusY,
    /// -z up, the front towards +y.
    MinusZ,
}

impl Up {
    /// Unit vectors up, to the front and to the right (as seen by someone who looks at the front).
    pub fn axes(self) -> [DVec3; 3] {
        match self {
            Self::Y => [DVec3::Y, DVec3::Z, DVec3::X],
            Self::Z => [DVec3::Z, -DVec3::Y, DVec3::X],
            Self::MinusY => [-DVec3::Y, -DVec3::Z, DVec3::X],
            Self::MinusZ => [-DVec3::Z, DVec3::Y, DVec3::X],
        }
    }
}

/// From where, and how large, a cloud is seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Framing {
    /// Width of the picture, in pixels.
    pub width: u32,
    /// Height of the picture, in pixels.
    pub height: u32,
    /// The axis that points up.
    pub up: Up,
    /// Direction of the camera around the up axis, in degrees: 0 is in front, 90 at the right.
    pub azimuth: f64,
    /// Direction of the camera above the horizon, in degrees.
    pub elevation: f64,
    /// Whether the camera is orthographic.
    pub orthographic: bool,
}

impl Default for Framing {
    /// The three-quarter view, 1280 x 960, y up.
    fn default() -> Self {
        Self { width: 1280, height: 960, up: Up::Y, azimuth: 30.0, elevation: 20.0, orthographic: false }
    }
}

/// Field of view along the picture's longer side, in degrees: that of a 55 mm lens on a full-frame camera.
pub const FIELD_OF_VIEW: f64 = 36.0;

/// The part of the picture's width or height that the cloud may fill.
const FILL: f64 = 0.92;

/// Default near depth, as a part of the cloud's diagonal. SPEC section 9.
pub const NEAR: f64 = 1e-4;

/// The camera that shows every splat of a cloud (with normals and sizes), whole, as large as fits.
///
/// Trained splats always have strays, and often a far background: of those only the splats within [`fence`] count.
///
/// # Errors
/// [`Error::Empty`] if no splat of the cloud can be rendered; [`Error::Invalid`] for a size out of range.
pub fn fit(cloud: &Cloud, framing: &Framing, options: &RenderOptions) -> Result<Camera, Error> {
    for (what, side) in [("width", framing.width), ("height", framing.height)] {
        if side == 0 || side > MAX_SIDE {
            return Err(Error::invalid(what, side, "1 to 65536 pixels"));
        }
    }
    let rotation = rotation(framing);
    let size = DVec2::new(framing.width.into(), framing.height.into());
    let focal_length = 0.5 * size.max_element() / libm::tan(0.5 * FIELD_OF_VIEW.to_radians());
    let tangent = FILL * 0.5 * size / focal_length;
    let slope = if framing.orthographic { DVec2::ZERO } else { tangent };
    let support = Support::of(cloud, rotation, slope, options)?;

    // A point (x, w) lies within the picture of an eye (ex, ew) if x - tx w <= ex - tx ew and -x - tx w <= -ex - tx ew.
    let middle = 0.5 * (support.high - support.low);
    let half = 0.5 * (support.high + support.low);
    let diagonal = cloud.diagonal().max(2.0 * half.max_element()).max(f64::MIN_POSITIVE);
    let projection;
    let depth;
    if framing.orthographic {
        let pixels_per_unit = (FILL * 0.5 * size / half.max(DVec2::splat(1e-12 * diagonal))).min_element();
        projection = Projection::Orthographic { pixels_per_unit };
        depth = support.nearest - diagonal;
    } else {
        projection = Projection::Perspective { focal_length: DVec2::splat(focal_length), lens: None };
        depth = (-half / tangent).min_element().min(support.nearest - 2.0 * NEAR * diagonal);
    }
    // The support was taken relative to the cloud's origin.
    let eye = rotation * cloud.origin + middle.extend(depth);
    Ok(Camera {
        width: framing.width,
        height: framing.height,
        projection,
        principal_point: 0.5 * size,
        world_to_camera: DMat4::from_translation(-eye) * DMat4::from_mat3(rotation),
        near: NEAR * diagonal,
        far: f64::INFINITY,
        clip_planes: Vec::new(),
        distortion: None,
    })
}

/// The unit vector from a cloud's centre towards a place around it, as [`Framing`] describes that of a camera; angles in
/// degrees.
pub fn direction(up: Up, azimuth: f64, elevation: f64) -> DVec3 {
    let [up, front, side] = up.axes();
    let (azimuth, elevation) = (azimuth.to_radians(), elevation.to_radians());
    let horizontal = libm::cos(azimuth) * front + libm::sin(azimuth) * side;
    libm::cos(elevation) * horizontal + libm::sin(elevation) * up
}

/// World to camera axes: right, down, forward.
fn rotation(framing: &Framing) -> DMat3 {
    let [_, front, side] = framing.up.axes();
    let azimuth = framing.azimuth.to_radians();
    let towards_camera = direction(framing.up, framing.azimuth, framing.elevation);
    let right = libm::cos(azimuth) * side - libm::sin(azimuth) * front;
    let forward = -towards_camera;
    let down = forward.cross(right);
    DMat3::from_cols(right, down, forward).transpose()
}

/// A ball around the bulk of a cloud: its centre, as an offset from the origin, and its radius.
///
/// The centre is the median of the finite positions, by coordinate. With Q1 and Q3 the quartiles of their distances from
/// it, the radius is Q3 + 1.5 (Q3 - Q1): Tukey's fence (1977), beyond which values count as outliers. `None` without points.
pub fn fence(cloud: &Cloud) -> Option<(DVec3, f64)> {
    let finite = || cloud.positions.iter().filter(|p| p.is_finite()).map(|p| p.as_dvec3());
    let quantile = |mut values: Vec<f64>, quarter: usize| {
        let rank = values.len().checked_sub(1)? * quarter / 4;
        Some(*values.select_nth_unstable_by(rank, f64::total_cmp).1)
    };
    let median = |axis: usize| quantile(finite().map(|p| p[axis]).collect(), 2);
    let centre = DVec3::new(median(0)?, median(1)?, median(2)?);
    let distances: Vec<f64> = finite().map(|p| p.distance(centre)).collect();
    let (low, high) = (quantile(distances.clone(), 1)?, quantile(distances, 3)?);
    Some((centre, high + 1.5 * (high - low)))
}

/// How far a cloud reaches, in camera axes relative to its origin.
struct Support {
    /// Greatest x - slope w and y - slope w.
    high: DVec2,
    /// Greatest -x - slope w and -y - slope w.
    low: DVec2,
    /// Least w.
    nearest: f64,
}

impl Support {
    fn of(cloud: &Cloud, rotation: DMat3, slope: DVec2, options: &RenderOptions) -> Result<Self, Error> {
        // A view from the cloud's origin, in which only the axes matter.
        let camera = Camera {
            width: 1,
            height: 1,
            projection: Projection::Orthographic { pixels_per_unit: 1.0 },
            principal_point: DVec2::ZERO,
            world_to_camera: DMat4::from_mat3(rotation) * DMat4::from_translation(-cloud.origin),
            near: 0.0,
            far: f64::INFINITY,
            clip_planes: Vec::new(),
            distortion: None,
        };
        let view = View::new(&camera, options);
        let radius = options.cutoff.sqrt();
        let mut support = Self {
            high: DVec2::splat(f64::NEG_INFINITY),
            low: DVec2::splat(f64::NEG_INFINITY),
            nearest: f64::INFINITY,
        };
        let fence = if cloud.trained { fence(cloud) } else { None };
        let is_within = |index: usize| {
            fence.is_none_or(|(centre, radius)| {
                cloud.positions[index].as_dvec3().distance_squared(centre) <= radius * radius
            })
        };
        for index in (0..cloud.len()).filter(|&index| cloud.defect(index).is_none() && is_within(index)) {
            let splat = camera_splat(cloud, index, &view);
            let reach = |direction: DVec3| {
                let [a, b] = splat.axes.map(|axis| direction.dot(axis));
                direction.dot(splat.center) + radius * DVec2::new(a, b).length()
            };
            for axis in 0..2 {
                let sideways = DVec3::AXES[axis];
                let inwards = slope[axis] * DVec3::Z;
                support.high[axis] = support.high[axis].max(reach(sideways - inwards));
                support.low[axis] = support.low[axis].max(reach(-sideways - inwards));
            }
            support.nearest = support.nearest.min(-reach(-DVec3::Z));
        }
        if support.nearest == f64::INFINITY {
            return Err(Error::Empty(format!("{} points read, none usable", cloud.len())));
        }
        Ok(support)
    }
}
