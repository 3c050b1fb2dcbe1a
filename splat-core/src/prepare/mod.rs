//! What a cloud lacks, estimated from its points: normals, sizes, and the area that each splat stands for.
//!
//! Every estimate depends on the set of points only, not on their order.

mod area;
mod cell;
mod local;
mod neighbors;
mod normal;
mod orientation;
mod outlier;
#[cfg(test)]
mod tests;

pub use orientation::Orientation;
pub use outlier::Outliers;

use crate::{Cloud, Kernel, RenderOptions, Shapes};
use glam::{Vec2, Vec3};
use local::Local;
use neighbors::Neighbors;
use splat_abuffer::Resolve;

/// What the estimates depend on. The default is what `surface` wants.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PrepareOptions {
    /// The kernel that the picture will use.
    pub kernel: Kernel,
    /// Its cutoff F.
    pub cutoff: f64,
    /// Whether weights will be normalised, for which areas are needed (`surface`, but not `over`).
    pub areas: bool,
    /// Neighbours from which a normal is estimated, at least 3.
    pub normals_k: usize,
    /// How normals without sides get them.
    pub orientation: Orientation,
    /// The size of all round splats, given or not, in scene units; `None`: as given, or estimated.
    pub radius: Option<f64>,
    /// Neighbours from which a size is estimated, at least 1.
    pub radius_k: usize,
    /// Factor on all sizes, given and estimated.
    pub size_scale: f64,
    /// Which points are dropped.
    pub outliers: Outliers,
}

impl Default for PrepareOptions {
    fn default() -> Self {
        Self {
            kernel: Kernel::Windowed,
            cutoff: 4.0,
            areas: true,
            normals_k: 16,
            orientation: Orientation::default(),
            radius: None,
            radius_k: 16,
            size_scale: 1.0,
            outliers: Outliers::default(),
        }
    }
}

impl PrepareOptions {
    /// What a picture with these options needs.
    pub fn for_picture(options: &RenderOptions) -> Self {
        let areas = options.resolve != Resolve::Over;
        Self { kernel: options.kernel, cutoff: options.cutoff, areas, ..Self::default() }
    }
}

impl PrepareOptions {
    /// Whether [`prepare`] has nothing to estimate of a cloud, nor to look for.
    pub fn would_keep(&self, cloud: &Cloud) -> bool {
        let known_areas = !self.areas || self.kernel == Kernel::Disc || cloud.areas.is_some();
        let known_sides = self.orientation == Orientation::TwoSided || cloud.oriented;
        let known = !cloud.normals.is_empty() && known_sides && unknown_sizes(cloud) == 0 && known_areas;
        known && self.outliers == Outliers::Keep
    }
}

/// What was estimated.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Estimated {
    /// Number of points marked as outliers.
    pub outliers: usize,
    /// Whether the cloud had no normals.
    pub normals: bool,
    /// Whether its normals had no sides and now have.
    pub sides: bool,
    /// Number of splats whose size was unknown.
    pub sizes: usize,
    /// Whether the areas were unknown.
    pub areas: bool,
}

/// Completes a cloud, so that it can be rendered. What the cloud has is kept; the axes of ellipses tell their normals.
///
/// Runs on rayon's threads; the result is the same for any number of them, and for any order of the points. `progress` is
/// told the share done, 0 to 1.
pub fn prepare(cloud: &mut Cloud, options: &PrepareOptions, progress: &mut dyn FnMut(f64)) -> Estimated {
    let mut estimated = Estimated {
        outliers: outlier::mark(cloud, options.outliers, &mut |done| progress(0.3 * done)),
        ..Estimated::default()
    };
    if let (Shapes::Ellipses(axes), true) = (&cloud.shapes, cloud.normals.is_empty()) {
        cloud.normals = axes.iter().map(|[t1, t2]| t1.cross(*t2).normalize_or_zero()).collect();
    }
    if let (Shapes::Discs(sizes), Some(radius)) = (&mut cloud.shapes, options.radius) {
        sizes.fill(radius as f32);
    }
    estimated.normals = cloud.normals.is_empty() && !cloud.is_empty();
    estimated.sides = options.orientation != Orientation::TwoSided && (estimated.normals || !cloud.oriented);
    estimated.sizes = unknown_sizes(cloud);
    estimated.areas = options.areas && options.kernel != Kernel::Disc && cloud.areas.is_none();

    let needs_locals = estimated.normals || estimated.sides || estimated.sizes > 0;
    let neighbors = (needs_locals || estimated.areas).then(|| Neighbors::new(cloud));
    if let (Some(neighbors), true) = (&neighbors, needs_locals) {
        complete(cloud, neighbors, options, &estimated, &mut |done| progress(0.3 + 0.3 * done));
    }
    scale_sizes(cloud, options.size_scale as f32);
    if let (Some(neighbors), true) = (&neighbors, estimated.areas) {
        cloud.areas = Some(area::estimate(cloud, neighbors, options, &mut |done| progress(0.6 + 0.4 * done)));
    }
    estimated
}

/// The number of splats whose size is unknown.
pub fn unknown_sizes(cloud: &Cloud) -> usize {
    match &cloud.shapes {
        Shapes::Discs(sizes) => sizes.iter().filter(|&&size| size == 0.0).count(),
        Shapes::Ellipses(_) => 0,
    }
}

/// Estimates what one search for every place's neighbours tells: normals, their sides, sizes.
fn complete(
    cloud: &mut Cloud,
    neighbors: &Neighbors,
    options: &PrepareOptions,
    wanted: &Estimated,
    progress: &mut dyn FnMut(f64),
) {
    let mut locals = local::explore(neighbors, &cloud.normals, options, progress);
    if wanted.normals {
        cloud.normals = vec![Vec3::ZERO; cloud.len()];
        for (place, local) in locals.iter().enumerate() {
            neighbors.members(place).for_each(|index| cloud.normals[index] = local.normal);
        }
        cloud.oriented = false;
    }
    if wanted.sides {
        orientation::orient(cloud, neighbors, &locals, options.orientation);
    }
    if wanted.sizes > 0 {
        local::cap_sizes(neighbors, &mut locals);
        fill_sizes(cloud, neighbors, &locals, wanted.sizes == cloud.len());
    }
}

/// Gives splats of unknown size their axes, or, where the sizes of others are known, the size of the same area.
fn fill_sizes(cloud: &mut Cloud, neighbors: &Neighbors, locals: &[Local], all_unknown: bool) {
    let places = locals.iter().enumerate();
    let splats = places.flat_map(|(place, local)| neighbors.members(place).map(move |index| (index, local)));
    if all_unknown {
        let mut axes = vec![[Vec3::ZERO; 2]; cloud.len()];
        splats.for_each(|(index, local)| axes[index] = local.axes);
        cloud.shapes = Shapes::Ellipses(axes);
        // The derivatives of round splats mean nothing.
        for coordinates in cloud.texture_coordinates.iter_mut().flatten() {
            (coordinates.per_u, coordinates.per_v) = (Vec2::ZERO, Vec2::ZERO);
        }
    } else if let Shapes::Discs(sizes) = &mut cloud.shapes {
        for (index, local) in splats.filter(|&(index, _)| sizes[index] == 0.0).collect::<Vec<_>>() {
            sizes[index] = local.size();
        }
    }
}

/// Multiplies every size, and with it what a texture changes by per sigma.
fn scale_sizes(cloud: &mut Cloud, scale: f32) {
    if scale == 1.0 {
        return;
    }
    for coordinates in cloud.texture_coordinates.iter_mut().flatten() {
        coordinates.per_u *= scale;
        coordinates.per_v *= scale;
    }
    match &mut cloud.shapes {
        Shapes::Discs(sizes) => sizes.iter_mut().for_each(|size| *size *= scale),
        Shapes::Ellipses(axes) => axes.iter_mut().flatten().for_each(|axis| *axis *= scale),
    }
}
