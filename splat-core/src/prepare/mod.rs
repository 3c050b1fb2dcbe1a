//! What a cloud lacks, estimated from its points: normals, sizes, and the area that each splat stands for.
//!
//! Every estimate depends on the set of points only, not on their order.

mod area;
mod neighbors;
mod normal;
mod size;

use crate::{Cloud, Kernel, Shapes};
use neighbors::Neighbors;

/// What the estimates depend on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PrepareOptions {
    /// The kernel that the picture will use.
    pub kernel: Kernel,
    /// Its cutoff F.
    pub cutoff: f64,
    /// Whether weights will be normalised, for which areas are needed (`surface`, but not `over`).
    pub areas: bool,
    /// Factor on all sizes, given and estimated.
    pub size_scale: f64,
}

/// What was estimated.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Estimated {
    /// Whether the cloud had no normals.
    pub normals: bool,
    /// Number of splats whose size was unknown.
    pub sizes: usize,
    /// Whether the areas were unknown.
    pub areas: bool,
}

/// Completes a cloud, so that it can be rendered. What the cloud has is kept; the axes of ellipses tell their normals.
pub fn prepare(cloud: &mut Cloud, options: &PrepareOptions) -> Estimated {
    let mut estimated = Estimated::default();
    if let (Shapes::Ellipses(axes), true) = (&cloud.shapes, cloud.normals.is_empty()) {
        cloud.normals = axes.iter().map(|[t1, t2]| t1.cross(*t2).normalize_or_zero()).collect();
    }
    let without_normals = cloud.normals.is_empty() && !cloud.is_empty();
    let unknown_sizes = match &cloud.shapes {
        Shapes::Discs(sizes) => sizes.iter().filter(|&&size| size == 0.0).count(),
        Shapes::Ellipses(_) => 0,
    };
    let without_areas = options.areas && options.kernel != Kernel::Disc && cloud.areas.is_none();
    if without_normals || unknown_sizes > 0 || without_areas {
        let neighbors = Neighbors::new(cloud);
        if without_normals {
            cloud.normals = normal::estimate(cloud, &neighbors);
            cloud.oriented = false;
            estimated.normals = true;
        }
        if let Shapes::Discs(sizes) = &mut cloud.shapes
            && unknown_sizes > 0
        {
            estimated.sizes = unknown_sizes;
            size::estimate(sizes, &neighbors);
        }
        scale_sizes(cloud, options.size_scale as f32);
        if without_areas {
            cloud.areas = Some(area::estimate(cloud, &neighbors, options));
            estimated.areas = true;
        }
    } else {
        scale_sizes(cloud, options.size_scale as f32);
    }
    estimated
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::TextureCoordinates;
    use glam::{DVec3, Vec2, Vec3};

    const OPTIONS: PrepareOptions =
        PrepareOptions { kernel: Kernel::Windowed, cutoff: 4.0, areas: true, size_scale: 1.0 };

    /// n x n points on the plane z = 0, at this spacing.
    fn grid(n: usize, spacing: f64) -> Cloud {
        let points: Vec<DVec3> =
            (0..n * n).map(|i| DVec3::new((i % n) as f64, (i / n) as f64, 0.0) * spacing).collect();
        Cloud::from_points(&points)
    }

    #[test]
    fn a_regular_grid_gets_its_normal_spacing_and_area() {
        let mut cloud = grid(21, 0.5);
        let estimated = prepare(&mut cloud, &OPTIONS);
        assert_eq!(estimated, Estimated { normals: true, sizes: 441, areas: true });
        let centre = 10 * 21 + 10;
        assert!(cloud.normals.iter().all(|n| n.z.abs() > 0.999_99), "{:?}", cloud.normals[centre]);
        let Shapes::Discs(sizes) = &cloud.shapes else { panic!("discs") };
        // The eighth neighbour of a square grid is at sqrt(2) spacings: sigma = sqrt(2) sqrt(pi / 8) = 0.886 of them.
        approx::assert_relative_eq!(sizes[centre], 0.5 * 0.886_227, max_relative = 1e-5);
        // The sum of the kernel over a square grid differs from its integral by a few per cent at this sigma.
        approx::assert_relative_eq!(cloud.areas.as_ref().unwrap()[centre], 0.25, max_relative = 0.05);
    }

    #[test]
    fn estimates_do_not_depend_on_the_order_of_points() {
        let mut cloud = grid(9, 1.0);
        // Move the points off the grid, so that nothing is symmetric, and repeat one.
        for (i, p) in cloud.positions.iter_mut().enumerate() {
            *p += Vec3::new((i * 7 % 11) as f32, (i * 5 % 13) as f32, (i * 3 % 7) as f32) * 0.02;
        }
        cloud.positions[3] = cloud.positions[4];
        let mut reversed = cloud.clone();
        reversed.positions.reverse();
        prepare(&mut cloud, &OPTIONS);
        prepare(&mut reversed, &OPTIONS);
        reversed.normals.reverse();
        reversed.areas.as_mut().unwrap().reverse();
        assert_eq!(cloud.normals, reversed.normals);
        assert_eq!(cloud.areas, reversed.areas);
    }

    #[test]
    fn bad_and_few_points_do_no_harm() {
        for count in 1..4 {
            let mut points = vec![DVec3::NAN, DVec3::new(1e300, 0.0, 0.0)];
            points.extend((0..count).map(|i| DVec3::new(f64::from(i), 0.0, 0.0)));
            let mut cloud = Cloud::from_points(&points);
            prepare(&mut cloud, &OPTIONS);
            assert!((2..points.len()).all(|i| cloud.defect(i).is_none()), "{cloud:?}");
            assert!(cloud.defect(0).is_some() && cloud.defect(1).is_some());
        }
        let mut coincident = Cloud::from_points(&[DVec3::ONE; 20]);
        prepare(&mut coincident, &OPTIONS);
        assert!((0..20).all(|i| coincident.defect(i).is_none()), "{coincident:?}");
    }

    #[test]
    fn a_splat_that_grows_carries_more_of_its_texture() {
        let mut cloud = grid(3, 1.0);
        cloud.shapes = Shapes::Ellipses(vec![[Vec3::X, Vec3::Y]; 9]);
        let given =
            TextureCoordinates { center: Vec2::splat(0.5), per_u: Vec2::X, per_v: Vec2::new(2.0, 3.0) };
        cloud.texture_coordinates = Some(vec![given; 9]);
        prepare(&mut cloud, &PrepareOptions { size_scale: 0.5, ..OPTIONS });
        let halved = TextureCoordinates { per_u: 0.5 * given.per_u, per_v: 0.5 * given.per_v, ..given };
        assert_eq!(cloud.texture_coordinates, Some(vec![halved; 9]));
        assert_eq!(cloud.shapes, Shapes::Ellipses(vec![[0.5 * Vec3::X, 0.5 * Vec3::Y]; 9]));
    }
}
