//! Set-up, once per splat, in `f64`: SPEC section 3; it replaces L45-159 of the listing.
//!
//! One implementation serves every core, so that they agree on what they draw by construction. It takes two steps: the
//! sort keys of the splats that face the viewer and lie between the planes ([`sort_keys`]), and in their order whatever
//! else is needed of a splat ([`SetUp::extend`]). So nothing large is ever sorted, and next to nothing is computed of a
//! splat that faces away.
//!
//! What is marked `#[inline(always)]` here passes dozens of numbers, which would else go through memory: it takes a third off
//! the time.

mod bounds;
mod error_bound;
mod margin;
mod number;
mod order;
mod outline;
mod projection;
mod view;

pub use bounds::{Extent, half_depth, orthographic_extent, perspective_extent};
pub use error_bound::{EPSILON, ErrorBound};
pub use margin::{MAX_ERROR, USUAL as USUAL_MARGIN};
pub use order::{SortKey, sort_keys, splat_order};
pub use outline::Outline;
pub use projection::project;
pub(crate) use projection::rotation;
pub(crate) use view::Reach;
pub use view::View;

use crate::evaluate::SplatConstants;
use crate::options::Shading;
use crate::shade::SplatShader;
use crate::texture::ScalarLookup;
use crate::{Cloud, PixelRect, RenderOptions, Shapes, srgb};
use glam::DVec3;
use margin::Margin;
use number::greater;
use outline::Ellipse;
use splat_abuffer::{Resolve, SplatSurface, Thickness};
use std::collections::BTreeMap;

/// Colours and weights beyond this are clamped to it, so that no sum of a layer overflows `f32`.
const MAX_MAGNITUDE: f32 = 1e9;

/// Boxes are widened by this, in pixels, besides the margin for rounding: they only propose candidates.
pub const BOX_PADDING: f64 = 1.0 / 64.0;

/// Linear colour of splats without one: white as a plain colour, light grey under the headlight.
const UNCOLORED: [f32; 3] = [1.0; 3];
pub(crate) const UNCOLORED_LIT: [f32; 3] = [0.6; 3];

/// Light that reaches a surface seen edge-on, relative to one that faces the headlight.
const HEADLIGHT_AMBIENT: f64 = 0.04;

/// Light that reaches a surface which faces away from the lamp, relative to one that faces it.
const LAMBERT_AMBIENT: f64 = 0.15;

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
    /// The pixels (of the film, if the lens distorts) in which it may be hit; never empty.
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
    /// Whether rounding moves no hit by more than a trifle: all lie within sqrt(F) sigma, give or take
    /// [`USUAL_MARGIN`] of it; else within [`MAX_ERROR`] sigma of that.
    pub certain: bool,
}

/// The result of set-up.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SetUp {
    /// The splats that may be seen, in splat order: a splat's place here is its rank.
    pub splats: Vec<VisibleSplat>,
    /// What the fragments of each share, by rank.
    pub surfaces: Vec<SplatSurface>,
    /// Whether some of them are of a colour, not of a grey.
    pub colored: bool,
    /// Splats that were never rendered, by cause: [`crate::Defect::name`], or `edge_on`.
    pub dropped: Dropped,
}

/// Numbers of splats, by the cause of dropping them.
pub type Dropped = BTreeMap<&'static str, usize>;

/// The cause of dropping a splat whose projection has no area that `f32` could tell.
const EDGE_ON: &str = "edge_on";

impl SetUp {
    /// Makes room for this many splats more.
    pub fn reserve(&mut self, count: usize) {
        self.splats.reserve_exact(count);
        self.surfaces.reserve_exact(count);
    }

    /// Forgets everything but keeps the memory.
    pub fn clear(&mut self) {
        self.splats.clear();
        self.surfaces.clear();
        self.colored = false;
        self.dropped.clear();
    }

    /// Sets up the next splats, given their indices in splat order.
    pub fn extend(&mut self, cloud: &Cloud, view: &View, options: &RenderOptions, order: &[u32]) {
        for &index in order {
            if let Outcome::EdgeOn = self.push(cloud, index as usize, view, options) {
                count_dropped(&mut self.dropped, EDGE_ON, 1);
            }
        }
    }

    /// Sets up the next splat, if it is to be seen.
    #[inline(always)]
    fn push(&mut self, cloud: &Cloud, index: usize, view: &View, options: &RenderOptions) -> Outcome {
        let splat = camera_splat(cloud, index, view);
        let usual = view.radius * (1.0 + margin::USUAL);
        let Some(exact) = project(&splat, view) else {
            // A line. It counts as dropped only where it would be seen.
            let seen = exact_box(&splat, usual, view).map(|screen| candidates(&splat, &screen, usual, view));
            return if seen.is_some_and(|bounds| bounds.is_empty()) {
                Outcome::Culled
            } else {
                Outcome::EdgeOn
            };
        };
        let Some(mut image) = Image::new(&splat, &exact, usual, view) else { return Outcome::EdgeOn };
        let mut bounds = candidates(&splat, &image.screen, usual, view);
        if bounds.is_empty() {
            return Outcome::Culled;
        }
        let Some(margin) = rounding_margin(&splat, &exact, &image.screen, view) else {
            return Outcome::EdgeOn;
        };
        let radius = greater(margin.radius, usual);
        if radius > usual {
            let Some(wider) = Image::new(&splat, &exact, radius, view) else { return Outcome::EdgeOn };
            bounds = candidates(&splat, &wider.screen, radius, view);
            image = wider;
            if bounds.is_empty() {
                return Outcome::Culled;
            }
        }
        let constants = SplatConstants { edge_on: margin.edge_on, ..exact }.to_f32();
        if !constants.is_finite() {
            return Outcome::EdgeOn;
        }
        let depth = view.depth_extent(&splat, radius);
        let surface = surface(cloud, index, &splat, &exact, view, options);
        self.colored |= surface.color != [surface.color[0]; 3];
        self.surfaces.push(surface);
        self.splats.push(VisibleSplat {
            constants,
            bounds,
            outline: image.outline(&exact, depth, view),
            index: index as u32,
            weight_scale: weight_scale(cloud, index, view, options),
            back: splat.back,
            flips: cloud.oriented && sees_both_sides(&exact, view),
            plain: is_plain(&exact, &bounds, depth, view),
            certain: radius == usual,
        });
        Outcome::Visible
    }

    /// Takes over the splats that come next in splat order.
    pub fn append(&mut self, next: &mut Self) {
        self.splats.append(&mut next.splats);
        self.surfaces.append(&mut next.surfaces);
        self.colored |= std::mem::take(&mut next.colored);
        self.add_dropped(std::mem::take(&mut next.dropped));
    }

    /// Adds splats that were dropped before they could be set up.
    pub fn add_dropped(&mut self, dropped: Dropped) {
        for (cause, count) in dropped {
            count_dropped(&mut self.dropped, cause, count);
        }
    }
}

fn count_dropped(dropped: &mut Dropped, cause: &'static str, count: usize) {
    *dropped.entry(cause).or_default() += count;
}

/// Sets up every splat of a cloud whose normals are known.
pub fn set_up(cloud: &Cloud, view: &View, options: &RenderOptions) -> SetUp {
    let (mut keys, dropped) = sort_keys(cloud, view, options, 0..cloud.len());
    keys.sort_unstable();
    let order = splat_order(cloud, keys);
    let mut result = SetUp { dropped, ..SetUp::default() };
    result.reserve(order.len());
    result.extend(cloud, view, options, &order);
    result
}

/// What becomes of a splat.
enum Outcome {
    Visible,
    EdgeOn,
    Culled,
}

/// What a pinhole or an orthographic camera sees of a disc.
struct Image {
    /// Its exact box, `[x, y]` in pixels.
    screen: [Extent; 2],
    /// The ellipse that it is, unless it reaches to the camera plane.
    ellipse: Option<Ellipse>,
}

impl Image {
    /// The image of a disc of `radius` sigma. `None` if it is nearer than the near plane.
    #[inline(always)]
    fn new(splat: &CameraSplat, constants: &SplatConstants<f64>, radius: f64, view: &View) -> Option<Self> {
        let ellipse = Ellipse::new(constants, view.orthographic, radius);
        let uncut = view.orthographic || splat.center.z - half_depth(splat, radius) >= view.box_near();
        // Nearly always the ellipse knows the box. What the near plane may cut is a matter of its own.
        let screen = match &ellipse {
            Some(ellipse) if uncut => ellipse.extents(constants.pixel().to_array()),
            _ => exact_box(splat, radius, view)?,
        };
        Some(Self { screen, ellipse })
    }

    fn outline(&self, constants: &SplatConstants<f64>, depth: Extent, view: &View) -> Outline {
        let blur = view.circle_of_confusion(depth) * view.pixel_scale;
        self.ellipse.as_ref().map_or(Outline::EVERYTHING, |ellipse| {
            let mut ellipse = ellipse.widened(blur.to_array());
            if let Some(map) = &view.distortion {
                ellipse = ellipse.on_film(constants.pixel(), map);
            }
            Outline::new(&ellipse, [constants.xf, constants.yf])
        })
    }
}

/// Whether some points of the lens may see the other side than the eye: whether 1 - h.q (which is 1 at the eye) can be
/// negative, or so near to 0 that rounding could make it so.
#[inline(always)]
fn sees_both_sides(constants: &SplatConstants<f64>, view: &View) -> bool {
    view.lens_pixels().is_some_and(|[px, py]| {
        let [hx, hy] = constants.lens_slope.map(f64::abs);
        let certain = hx * px + hy * py < 1.0 - 1.0 / 1024.0;
        !certain
    })
}

/// [`VisibleSplat::plain`].
#[inline(always)]
fn is_plain(constants: &SplatConstants<f64>, bounds: &PixelRect, depth: Extent, view: &View) -> bool {
    // With distortion the ideal places of the candidates' pixels are nowhere listed.
    if !constants.centred || view.orthographic || view.distortion.is_some() {
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
            greater(
                (f64::from(first) + 0.5 - room - center).abs(),
                (f64::from(end) - 0.5 + room - center).abs(),
            )
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
#[inline(always)]
fn rounding_margin(
    splat: &CameraSplat,
    exact: &SplatConstants<f64>,
    screen: &[Extent; 2],
    view: &View,
) -> Option<Margin> {
    let Some(lens_pixels) = view.lens_pixels() else {
        let depth = view.depth_extent(splat, view.radius);
        return margin::without_lens(exact, depth, &view.reach(exact.pixel(), screen), view);
    };
    let widest = margin::hit_radius(view.radius);
    let reach = view.reach(exact.pixel(), &Image::new(splat, exact, widest, view)?.screen);
    Some(margin::with_lens(exact, view.depth_extent(splat, widest), &reach, lens_pixels, view))
}

/// A splat of the cloud in camera space (L46-69).
#[inline(always)]
pub fn camera_splat(cloud: &Cloud, index: usize, view: &View) -> CameraSplat {
    let from_eye = from_eye(cloud, index, view);
    let normal = cloud.normals[index].as_dvec3().normalize();
    let world_axes = world_axes(cloud, index, normal);
    let axes = world_axes.map(|axis| view.linear * axis);
    let left_handed = match cloud.shapes {
        Shapes::Discs(_) => false,
        Shapes::Ellipses(_) => world_axes[0].cross(world_axes[1]).dot(normal) < 0.0,
    };
    // (A t1) x (A t2) = det(A) A^-T (t1 x t2): it points along the normal unless exactly one of these is mirrored.
    let mirrored = view.mirrors != left_handed;
    let cross = axes[0].cross(axes[1]).normalize();
    CameraSplat {
        center: view.linear * from_eye,
        axes,
        normal: if mirrored { -cross } else { cross },
        back: shows_back(cloud, index, from_eye, view),
    }
}

/// From the eye to a splat, in the world. The camera's position is subtracted in `f64`.
fn from_eye(cloud: &Cloud, index: usize, view: &View) -> DVec3 {
    cloud.positions[index].as_dvec3() + (cloud.origin - view.eye)
}

/// Whether the eye sees the back of a splat, given where that is from the eye.
fn shows_back(cloud: &Cloud, index: usize, from_eye: DVec3, view: &View) -> bool {
    let away = if view.orthographic { view.world_forward } else { from_eye };
    cloud.oriented && cloud.normals[index].as_dvec3().dot(away) > 0.0
}

/// The sigma-scaled tangent axes of a splat in the world (L54-61).
#[inline(always)]
pub(crate) fn world_axes(cloud: &Cloud, index: usize, normal: DVec3) -> [DVec3; 2] {
    match &cloud.shapes {
        Shapes::Discs(sizes) => {
            let size = f64::from(sizes[index]);
            // Of the normal as it stands: so it need not wait for the unit one.
            let tu = perpendicular(cloud.normals[index].as_dvec3()).normalize();
            [size * tu, size * normal.cross(tu)]
        }
        Shapes::Ellipses(axes) => axes[index].map(|axis| axis.as_dvec3()),
    }
}

/// A vector perpendicular to another one: the product of the coordinate axis that is farthest from it and the vector.
fn perpendicular(normal: DVec3) -> DVec3 {
    let [x, y, z] = normal.to_array();
    let [ax, ay, az] = normal.abs().to_array();
    // Weighed, not branched to: which axis it is cannot be foreseen.
    let number = |yes: bool| if yes { 1.0 } else { 0.0 };
    let not_x = number((ax > ay) | (ax > az));
    let is_z = not_x * number(ay > az);
    let [is_x, is_y] = [1.0 - not_x, not_x - is_z];
    DVec3::new(is_y * z - is_z * y, is_z * x - is_x * z, is_x * y - is_y * x)
}

/// The exact box of a disc of `radius` sigma as a pinhole sees it: `[x, y]` in pixels (L106-125, corrected). `None` if
/// the disc is nearer than the near plane.
fn exact_box(splat: &CameraSplat, radius: f64, view: &View) -> Option<[Extent; 2]> {
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
#[inline(always)]
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
fn weight_scale(cloud: &Cloud, index: usize, view: &View, options: &RenderOptions) -> f32 {
    match (&cloud.areas, options.resolve, options.kernel) {
        (Some(areas), Resolve::Surface { .. }, kernel) if kernel != crate::Kernel::Disc => {
            let scale = f64::from(areas[index]) / (splat_area(cloud, index) * view.kernel_integral);
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
#[inline(always)]
fn surface(
    cloud: &Cloud,
    index: usize,
    splat: &CameraSplat,
    exact: &SplatConstants<f64>,
    view: &View,
    options: &RenderOptions,
) -> SplatSurface {
    let color = if options.material.of(index).is_plain() {
        let light = light(splat, || shading_normal(cloud, index, view), view, options) as f32;
        let color = splat_color(cloud, index, view, options.shading);
        finished_color(color.map(|value| value * light), options)
    } else {
        SplatShader::new(cloud, view, options, &ScalarLookup).whole(index, splat, exact).color
    };
    let opacity = cloud.opacities.as_ref().map_or(1.0, |opacities| opacities[index].clamp(0.0, 1.0));
    SplatSurface { color, opacity, interval: depth_interval(splat, view, options) }
}

/// The unit world normal of a splat on the viewer's side.
pub(crate) fn shading_normal(cloud: &Cloud, index: usize, view: &View) -> DVec3 {
    let normal = cloud.normals[index].as_dvec3().normalize();
    let away = if view.orthographic { view.world_forward } else { from_eye(cloud, index, view) };
    if normal.dot(away) > 0.0 { -normal } else { normal }
}

/// The light on a splat with this [`shading_normal`].
#[inline(always)]
pub(crate) fn light(
    splat: &CameraSplat,
    normal: impl FnOnce() -> DVec3,
    view: &View,
    options: &RenderOptions,
) -> f64 {
    match options.shading {
        Shading::Color => 1.0,
        Shading::Headlight => {
            let to_viewer = if view.orthographic { DVec3::Z } else { splat.center.normalize() };
            HEADLIGHT_AMBIENT + (1.0 - HEADLIGHT_AMBIENT) * splat.normal.dot(to_viewer).abs()
        }
        Shading::Lambert { to_light } => {
            let cosine = normal().dot(to_light.normalize());
            LAMBERT_AMBIENT + (1.0 - LAMBERT_AMBIENT) * cosine.max(0.0)
        }
    }
}

/// A colour in the resolve's terms.
#[inline(always)]
pub(crate) fn finished_color(color: [f32; 3], options: &RenderOptions) -> [f32; 3] {
    let color = color.map(|value| value.clamp(-MAX_MAGNITUDE, MAX_MAGNITUDE));
    if options.resolve == Resolve::Over {
        // Trained splats blend in their display space.
        return color.map(|value| srgb::encode(f64::from(value)) as f32);
    }
    color
}

/// The unlit, linear colour of a splat as the cloud has it, seen by this viewer.
pub fn splat_color(cloud: &Cloud, index: usize, view: &View, shading: Shading) -> [f32; 3] {
    if let Some(harmonics) = &cloud.harmonics {
        let away = if view.orthographic { view.world_forward } else { from_eye(cloud, index, view) };
        let color = harmonics.color(index, away.normalize_or_zero().as_vec3());
        return color.map(|value| srgb::decode(f64::from(value)) as f32);
    }
    match (&cloud.colors, shading) {
        (Some(colors), _) => colors[index].to_array(),
        (None, Shading::Color) => UNCOLORED,
        (None, Shading::Headlight | Shading::Lambert { .. }) => UNCOLORED_LIT,
    }
}

/// [`SplatSurface::interval`]: SPEC section 6, or the listing's (L128-133, corrected: erratum E1).
fn depth_interval(splat: &CameraSplat, view: &View, options: &RenderOptions) -> [f32; 2] {
    let extent = half_depth(splat, view.radius);
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
