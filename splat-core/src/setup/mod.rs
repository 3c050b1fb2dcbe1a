//! Set-up, once per splat, in `f64`: SPEC section 3; it replaces L45-159 of the listing.
//!
//! One implementation serves every core, so that they agree on what they draw by construction.

mod bounds;
mod error_bound;
mod margin;
mod outline;
mod projection;
mod view;

pub use bounds::{Extent, half_depth, orthographic_extent, perspective_extent};
pub use error_bound::{EPSILON, ErrorBound};
pub use outline::Outline;
pub use projection::project;
pub(crate) use view::Reach;
pub use view::View;

use crate::evaluate::SplatConstants;
use crate::options::Shading;
use crate::{Cloud, PixelRect, RenderOptions, Shapes, srgb};
use glam::{DVec3, Vec3, Vec3Swizzles};
use margin::Margin;
use splat_abuffer::{Resolve, SplatSurface, Thickness};
use std::cmp::Ordering;
use std::collections::BTreeMap;
use std::ops::Range;

/// Colours and weights beyond this are clamped to it, so that no sum of a layer overflows `f32`.
const MAX_MAGNITUDE: f32 = 1e9;

/// Boxes are widened by this, in pixels, besides the margin for rounding: they only propose candidates.
pub const BOX_PADDING: f64 = 1.0 / 64.0;

/// Linear colour of splats without one: white as a plain colour, light grey under the headlight.
const UNCOLORED: [f32; 3] = [1.0; 3];
const UNCOLORED_LIT: [f32; 3] = [0.6; 3];

/// Light that reaches a surface seen edge-on, relative to one that faces the headlight.
const HEADLIGHT_AMBIENT: f64 = 0.04;

/// A splat in camera space, in `f64`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraSplat {
    /// Its centre.
    pub center: DVec3,
    /// Its sigma-scaled tangent axes.
    pub axes: [DVec3; 2],
    /// Its unit normal.
    pub normal: DVec3,
    /// Whether the eye sees its back.
    pub back: bool,
}

/// A splat that may leave fragments in the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VisibleSplat {
    /// What the evaluation needs.
    pub constants: SplatConstants<f32>,
    /// The pixels in which it may be hit; never empty.
    pub bounds: PixelRect,
    /// An ellipse around the places within `bounds` from which it may be hit.
    pub outline: Outline,
    /// Its index in the cloud.
    pub index: u32,
    /// Factor from the kernel's value to the fragment's weight.
    pub weight_scale: f32,
    /// Whether the eye sees its back.
    pub back: bool,
    /// Whether its facing depends on the point of the lens: its normal tells the outside from the inside, and the lens may
    /// reach through its plane.
    pub flips: bool,
    /// Whether in `bounds` the cutoff alone decides what is a hit: its centre is the reference point, near and far plane are
    /// well away, and for a pinhole all samples lie well before the horizon of its plane (g > 0).
    pub plain: bool,
    /// Its nearest depth, in camera units: the key of splat order.
    pub nearest: f64,
    /// What its fragments share.
    pub surface: SplatSurface,
}

/// The result of set-up.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SetUp {
    /// The splats that may be seen, in splat order: a splat's place here is its rank.
    pub splats: Vec<VisibleSplat>,
    /// Splats that were never rendered, by cause: [`crate::Defect::name`], or `edge_on`.
    pub dropped: BTreeMap<&'static str, usize>,
}

impl SetUp {
    /// What the fragments of each splat share, by rank.
    pub fn surfaces(&self) -> Vec<SplatSurface> {
        self.splats.iter().map(|splat| splat.surface).collect()
    }
}

/// The cause of dropping a splat whose projection has no area that `f32` could tell.
const EDGE_ON: &str = "edge_on";

/// Sets up every splat of a cloud whose normals are known.
pub fn set_up(cloud: &Cloud, view: &View, options: &RenderOptions) -> SetUp {
    let mut result = set_up_range(cloud, view, options, 0..cloud.len());
    result.splats.sort_unstable_by(|a, b| splat_order(cloud, a, b));
    result
}

/// Sets up a part of the splats of a cloud, in the order of the cloud.
pub fn set_up_range(cloud: &Cloud, view: &View, options: &RenderOptions, range: Range<usize>) -> SetUp {
    let mut result = SetUp::default();
    for index in range {
        if let Some(defect) = cloud.defect(index) {
            *result.dropped.entry(defect.name()).or_default() += 1;
            continue;
        }
        match set_up_splat(cloud, index, view, options) {
            Outcome::Visible(splat) => result.splats.push(splat),
            Outcome::EdgeOn => *result.dropped.entry(EDGE_ON).or_default() += 1,
            Outcome::Culled => {}
        }
    }
    result
}

/// What becomes of a splat.
enum Outcome {
    Visible(VisibleSplat),
    EdgeOn,
    Culled,
}

/// Sets up one splat without a defect.
fn set_up_splat(cloud: &Cloud, index: usize, view: &View, options: &RenderOptions) -> Outcome {
    let splat = camera_splat(cloud, index, view);
    let radius = view.cutoff.sqrt();
    if (options.cull && faces_away(&splat, view)) || view.is_clipped(&splat, radius) {
        return Outcome::Culled;
    }
    let usual = radius * (1.0 + margin::USUAL);
    // What is in front of the near plane has a box, unless it is a line.
    let Some(screen) = screen_box(&splat, usual, view) else { return Outcome::EdgeOn };
    let mut bounds = candidates(&splat, &screen, usual, view);
    if bounds.is_empty() {
        return Outcome::Culled;
    }
    let Some(exact) = project(&splat, view) else { return Outcome::EdgeOn };
    let Some(margin) = rounding_margin(&splat, &exact, &screen, view) else { return Outcome::EdgeOn };
    if margin.radius > usual {
        let Some(screen) = screen_box(&splat, margin.radius, view) else { return Outcome::EdgeOn };
        bounds = candidates(&splat, &screen, margin.radius, view);
    }
    if bounds.is_empty() {
        return Outcome::Culled;
    }
    let constants = SplatConstants { edge_on: margin.edge_on, ..exact }.to_f32();
    if !constants.is_finite() {
        return Outcome::EdgeOn;
    }
    let hit_radius = margin.radius.max(usual);
    let blur = view.circle_of_confusion(view.depth_extent(&splat, hit_radius)) * view.pixel_scale;
    Outcome::Visible(VisibleSplat {
        constants,
        bounds,
        outline: Outline::new(&exact, view.orthographic, hit_radius, blur.to_array()),
        index: index as u32,
        weight_scale: weight_scale(cloud, index, options),
        back: splat.back,
        flips: cloud.oriented && sees_both_sides(&exact, view),
        plain: is_plain(&exact, &bounds, view.depth_extent(&splat, hit_radius), view),
        nearest: splat.center.z - half_depth(&splat, radius),
        surface: surface(cloud, index, &splat, view, options),
    })
}

/// Whether some points of the lens may see the other side than the eye: whether 1 - h.q (which is 1 at the eye) can be
/// negative, or so near to 0 that rounding could make it so.
fn sees_both_sides(constants: &SplatConstants<f64>, view: &View) -> bool {
    view.lens_pixels().is_some_and(|[px, py]| {
        let [hx, hy] = constants.lens_slope.map(f64::abs);
        let certain = hx * px + hy * py < 1.0 - 1.0 / 1024.0;
        !certain
    })
}

/// [`VisibleSplat::plain`].
fn is_plain(constants: &SplatConstants<f64>, bounds: &PixelRect, depth: Extent, view: &View) -> bool {
    if !constants.centred || view.orthographic {
        return false;
    }
    let least;
    let greatest;
    if view.lens.is_some() {
        // The depth of a hit lies in that of the splat, give or take the errors of g and 1 - h.q, 1/16 each.
        [least, greatest] = [depth.min / 1.25, depth.max * 1.25];
    } else {
        // How far g can come from 1 in the candidates' pixels; with 1/16 to spare its rounding does not matter.
        let room = view.max_jitter();
        let center = constants.pixel();
        let farthest = |center: f64, first: i32, end: i32| {
            (f64::from(first) + 0.5 - room - center).abs().max((f64::from(end) - 0.5 + room - center).abs())
        };
        let slope = constants.h[0].abs() * farthest(center.x, bounds.x0, bounds.x1)
            + constants.h[1].abs() * farthest(center.y, bounds.y0, bounds.y1);
        if slope > 15.0 / 16.0 {
            return false;
        }
        [least, greatest] = [constants.depth / 2.0, constants.depth * 17.0];
    }
    view.near < least && greatest < view.far
}

/// The margin that rounding needs; `screen` is the splat's usual box. `None` if it is seen edge-on.
fn rounding_margin(
    splat: &CameraSplat,
    exact: &SplatConstants<f64>,
    screen: &[Extent; 2],
    view: &View,
) -> Option<Margin> {
    let radius = view.cutoff.sqrt();
    let Some(lens_pixels) = view.lens_pixels() else {
        let depth = view.depth_extent(splat, radius);
        return margin::without_lens(exact, depth, &view.reach(exact.pixel(), screen), view);
    };
    let widest = margin::hit_radius(radius);
    let reach = view.reach(exact.pixel(), &screen_box(splat, widest, view)?);
    Some(margin::with_lens(exact, view.depth_extent(splat, widest), &reach, lens_pixels, view))
}

/// A splat of the cloud in camera space (L46-69). The camera's position is subtracted in `f64`.
pub fn camera_splat(cloud: &Cloud, index: usize, view: &View) -> CameraSplat {
    let from_eye = cloud.positions[index].as_dvec3() + (cloud.origin - view.eye);
    let normal = cloud.normals[index].as_dvec3().normalize();
    let world_axes = world_axes(cloud, index, normal);
    let axes = world_axes.map(|axis| view.linear * axis);
    // (A t1) x (A t2) = det(A) A^-T (t1 x t2): it points along the normal unless exactly one of these is mirrored.
    let mirrored = (view.mirrors) != (world_axes[0].cross(world_axes[1]).dot(normal) < 0.0);
    let cross = axes[0].cross(axes[1]).normalize();
    let to_viewer = if view.orthographic { -view.world_forward } else { -from_eye };
    CameraSplat {
        center: view.linear * from_eye,
        axes,
        normal: if mirrored { -cross } else { cross },
        back: cloud.oriented && normal.dot(to_viewer) < 0.0,
    }
}

/// The sigma-scaled tangent axes of a splat in the world (L54-61).
fn world_axes(cloud: &Cloud, index: usize, normal: DVec3) -> [DVec3; 2] {
    match &cloud.shapes {
        Shapes::Discs(sizes) => {
            let size = f64::from(sizes[index]);
            let tu = perpendicular(normal).normalize();
            [size * tu, size * normal.cross(tu)]
        }
        Shapes::Ellipses(axes) => axes[index].map(|axis| axis.as_dvec3()),
    }
}

/// A vector perpendicular to a unit vector, made with the coordinate axis that is farthest from it.
fn perpendicular(normal: DVec3) -> DVec3 {
    let [x, y, z] = normal.abs().to_array();
    let axis = if x <= y && x <= z {
        DVec3::X
    } else if y <= z {
        DVec3::Y
    } else {
        DVec3::Z
    };
    axis.cross(normal)
}

/// The back-face cull (L49-52), corrected for the lens: no point of the aperture sees the front (erratum E21).
fn faces_away(splat: &CameraSplat, view: &View) -> bool {
    if !splat.back {
        return false;
    }
    let lens_radius = view.lens.map_or(0.0, |lens| lens.radius);
    -splat.normal.dot(splat.center) + lens_radius * splat.normal.xy().length() < 0.0 || view.orthographic
}

/// The exact box of a disc of `radius` sigma as a pinhole sees it: `[x, y]` in pixels (L106-125, corrected). `None` if
/// the disc is nearer than the near plane.
fn screen_box(splat: &CameraSplat, radius: f64, view: &View) -> Option<[Extent; 2]> {
    let side = |axis: usize| {
        let extent = if view.orthographic {
            Some(orthographic_extent(splat, radius, axis))
        } else {
            perspective_extent(splat, radius, view.box_near(), axis)
        };
        extent.map(|extent| Extent {
            min: extent.min * view.pixel_scale[axis] + view.principal_point[axis],
            max: extent.max * view.pixel_scale[axis] + view.principal_point[axis],
        })
    };
    Some([side(0)?, side(1)?])
}

/// The pixels of the window in which a disc of `radius` sigma with this box may be hit: the box widened by the circle
/// of confusion and the pixel filter (L137-159, corrected).
fn candidates(splat: &CameraSplat, screen: &[Extent; 2], radius: f64, view: &View) -> PixelRect {
    let blur = view.circle_of_confusion(view.depth_extent(splat, radius));
    view.pixels_that_reach(&[0, 1].map(|axis| {
        let blur = blur * view.pixel_scale[axis];
        Extent { min: screen[axis].min - blur, max: screen[axis].max + blur }
    }))
}

/// The factor from the kernel's value to a fragment's weight: area / (|T1 x T2| I), so that the weights of a
/// closed surface sum to about 1. SPEC section 4. The kernel's own value counts for `disc`, for `over`, and where
/// no area is known.
fn weight_scale(cloud: &Cloud, index: usize, options: &RenderOptions) -> f32 {
    match (&cloud.areas, options.resolve, options.kernel) {
        (Some(areas), Resolve::Surface { .. }, kernel) if kernel != crate::Kernel::Disc => {
            let scale =
                f64::from(areas[index]) / (splat_area(cloud, index) * kernel.integral(options.cutoff));
            (scale as f32).min(MAX_MAGNITUDE)
        }
        _ => 1.0,
    }
}

/// |T1 x T2| of a splat, in squared scene units.
pub(crate) fn splat_area(cloud: &Cloud, index: usize) -> f64 {
    match &cloud.shapes {
        Shapes::Discs(sizes) => f64::from(sizes[index]) * f64::from(sizes[index]),
        Shapes::Ellipses(axes) => {
            let [t1, t2] = axes[index].map(|axis| axis.as_dvec3());
            t1.cross(t2).length()
        }
    }
}

/// What the splat's fragments share: its colour (the listing's splat shader, L161-162), opacity and depth interval.
fn surface(
    cloud: &Cloud,
    index: usize,
    splat: &CameraSplat,
    view: &View,
    options: &RenderOptions,
) -> SplatSurface {
    let shade = match options.shading {
        Shading::Color => 1.0,
        Shading::Headlight => {
            let to_viewer = if view.orthographic { DVec3::Z } else { splat.center.normalize() };
            HEADLIGHT_AMBIENT + (1.0 - HEADLIGHT_AMBIENT) * splat.normal.dot(to_viewer).abs()
        }
    };
    let color = base_color(cloud, index, options.shading).map(|value| {
        let value = f64::from((value * shade as f32).clamp(-MAX_MAGNITUDE, MAX_MAGNITUDE));
        // Trained splats blend in their display space.
        (if options.resolve == Resolve::Over { srgb::encode(value) } else { value }) as f32
    });
    let opacity = cloud.opacities.as_ref().map_or(1.0, |opacities| opacities[index].clamp(0.0, 1.0));
    SplatSurface { color, opacity, interval: depth_interval(splat, view, options) }
}

/// The unlit, linear colour of a splat.
pub fn base_color(cloud: &Cloud, index: usize, shading: Shading) -> [f32; 3] {
    match (&cloud.colors, shading) {
        (Some(colors), _) => colors[index].to_array(),
        (None, Shading::Color) => UNCOLORED,
        (None, Shading::Headlight) => UNCOLORED_LIT,
    }
}

/// [`SplatSurface::interval`]: SPEC section 6, or the listing's (L128-133, corrected: erratum E1).
fn depth_interval(splat: &CameraSplat, view: &View, options: &RenderOptions) -> [f32; 2] {
    let extent = half_depth(splat, view.cutoff.sqrt());
    if let Resolve::Surface { thickness: Thickness::WholeSplat, .. } = options.resolve {
        return [(splat.center.z - extent) as f32, (splat.center.z + extent) as f32];
    }
    let sigma = splat.axes[0].cross(splat.axes[1]).length().sqrt();
    let half = options.thickness * sigma;
    let cap = extent + half;
    if view.orthographic {
        // Constant over the splat: the slope must not limit it.
        return [f32::INFINITY, (half / splat.normal.z.abs()).min(cap) as f32];
    }
    // n.P is the same for every point P of the plane, the reference point among them.
    [(half / splat.normal.dot(splat.center).abs()) as f32, cap as f32]
}

/// Splat order: by nearest depth, then by the splat's own data, so that the order in the file changes nothing.
pub fn splat_order(cloud: &Cloud, a: &VisibleSplat, b: &VisibleSplat) -> Ordering {
    a.nearest.total_cmp(&b.nearest).then_with(|| {
        let (a, b) = (a.index as usize, b.index as usize);
        compare(cloud.positions[a], cloud.positions[b])
            .then_with(|| compare(cloud.normals[a], cloud.normals[b]))
            .then_with(|| match &cloud.shapes {
                Shapes::Discs(sizes) => sizes[a].total_cmp(&sizes[b]),
                Shapes::Ellipses(axes) => {
                    compare(axes[a][0], axes[b][0]).then_with(|| compare(axes[a][1], axes[b][1]))
                }
            })
            .then_with(|| cloud.colors.as_ref().map_or(Ordering::Equal, |c| compare(c[a], c[b])))
            .then_with(|| cloud.opacities.as_ref().map_or(Ordering::Equal, |o| o[a].total_cmp(&o[b])))
            .then_with(|| cloud.areas.as_ref().map_or(Ordering::Equal, |s| s[a].total_cmp(&s[b])))
            // Equal in everything: interchangeable in the picture, told apart only by the id.
            .then(a.cmp(&b))
    })
}

/// A total order of vectors, component by component.
fn compare(a: Vec3, b: Vec3) -> Ordering {
    let pairs = a.to_array().into_iter().zip(b.to_array());
    pairs.map(|(a, b)| a.total_cmp(&b)).find(|order| order.is_ne()).unwrap_or(Ordering::Equal)
}

/// The shape of a splat as a measure of distance from its centre.
#[derive(Debug, Clone, Copy)]
pub(crate) struct InverseShape {
    u: DVec3,
    v: DVec3,
    normal: DVec3,
}

impl InverseShape {
    /// The shape of a splat without a defect: the dual basis of its axes in its plane, and across it a unit of the
    /// same area's root.
    pub(crate) fn new(cloud: &Cloud, index: usize) -> Self {
        let normal = cloud.normals[index].as_dvec3().normalize();
        let [t1, t2] = world_axes(cloud, index, normal);
        let cross = t1.cross(t2);
        let squared = cross.length_squared();
        Self {
            u: t2.cross(cross) / squared,
            v: cross.cross(t1) / squared,
            normal: cross / (squared * cross.length()).sqrt(),
        }
    }

    /// The squared distance of an offset from the splat's centre, in sigma.
    pub(crate) fn r2(&self, offset: DVec3) -> f64 {
        DVec3::new(self.u.dot(offset), self.v.dot(offset), self.normal.dot(offset)).length_squared()
    }
}
