//! Surfels on a mesh.

use super::Mesh;
use super::eliminate::{Candidate, eliminate, greatest_radius};
use glam::{DVec2, DVec3, Vec2, Vec3};
use rand_pcg::Pcg32;
use rand_pcg::rand_core::Rng;
use splat_core::{Cloud, Error, Shapes, TextureCoordinates};

/// The greatest number of surfels that [`sample_surface`] makes: they take some 200 bytes each while it works.
pub const MOST_SURFELS: usize = 20_000_000;

/// Candidates a surfel. More are hardly more even, and take longer.
const CANDIDATES: usize = 4;

/// A mesh as surfels.
#[derive(Debug, Clone, PartialEq)]
pub struct Sampled {
    /// The surfels, in the order of the triangles that they lie on.
    pub cloud: Cloud,
    /// The mesh's area, in squared scene units: the sum of the surfels' areas.
    pub area: f64,
    /// Number of triangles without an area, on which there are no surfels.
    pub skipped: usize,
    /// Number of surfels on triangles without texture coordinates, where others have some; theirs are zero.
    pub without_texture: usize,
}

/// Covers a mesh evenly with `count` surfels. The same arguments give the same surfels, on every machine.
///
/// - *Where*: four times as many random candidates are thinned out until what is left is evenly spread (blue noise),
///   whatever the triangles' sizes. `seed` changes the candidates.
/// - *Area*: the mesh's over `count`, for each.
/// - *Normal*: that of the triangle, since splats are tangent to the surface. The corners' order tells the outside, or
///   the vertices' normals, where the mesh has some.
/// - *Axes*: two at right angles, of length sigma = one spacing (the square root of the area), at which the renderer's
///   default leaves no hole. The first points where s grows and t stays, the second makes both right-handed with the
///   normal.
/// - *Texture coordinates*: the triangle's own affine map, exactly.
/// - *Colours*: interpolated linearly from the vertices'.
///
/// `progress` is told the share done, 0 to 1.
///
/// # Errors
/// [`Error::Invalid`] if `count` is 0 or more than [`MOST_SURFELS`], or if no triangle has an area; else as
/// [`Mesh::check`].
pub fn sample_surface(
    mesh: &Mesh,
    count: usize,
    seed: u64,
    progress: &mut dyn FnMut(f64),
) -> Result<Sampled, Error> {
    if !(1..=MOST_SURFELS).contains(&count) {
        return Err(Error::invalid("number of surfels", count, "1 to 20000000"));
    }
    mesh.check()?;
    let (area, skipped) = mesh.area();
    if area == 0.0 || !area.is_finite() {
        let found = format!("{area} in {} triangles", mesh.triangles.len());
        return Err(Error::invalid("area of the mesh", found, "more than 0, and finite"));
    }
    let places = scatter(mesh, area, CANDIDATES * count, seed);
    let kept = thin_out(mesh, &places, area, count, progress);

    let sigma = (area / count as f64).sqrt();
    let positions: Vec<DVec3> = kept.iter().map(|&place| places[place as usize].position(mesh)).collect();
    let mut cloud = Cloud::from_points(&positions);
    let frames = FrameCache::new(mesh, sigma);
    let frames: Vec<Frame> = kept
        .iter()
        .scan(frames, |frames, &place| Some(frames.of(places[place as usize].triangle as usize)))
        .collect();
    cloud.normals = frames.iter().map(|frame| frame.normal.as_vec3()).collect();
    cloud.shapes =
        Shapes::Ellipses(frames.iter().map(|frame| frame.axes.map(|axis| axis.as_vec3())).collect());
    cloud.areas = Some(vec![(area / count as f64) as f32; count]);
    cloud.oriented = true;
    let kept = || kept.iter().map(|&place| &places[place as usize]);
    cloud.colors = mesh.colors.as_ref().map(|colors| {
        kept().map(|place| place.color(mesh.triangles[place.triangle as usize], colors)).collect()
    });
    let mut without_texture = 0;
    if !mesh.texture_triangles.is_empty() {
        let coordinates = kept().zip(&frames).map(|(place, frame)| {
            frame.texture_coordinates(place).unwrap_or_else(|| {
                without_texture += 1;
                TextureCoordinates::default()
            })
        });
        cloud.texture_coordinates = Some(coordinates.collect());
    }
    Ok(Sampled { cloud, area, skipped, without_texture })
}

/// A place on a mesh.
#[derive(Debug, Clone, Copy)]
struct Place {
    triangle: u32,
    /// Shares of the second and third corner.
    barycentric: [f32; 2],
}

impl Place {
    /// The shares of all three corners.
    fn shares(&self) -> [f64; 3] {
        let [b, c] = self.barycentric.map(f64::from);
        [1.0 - b - c, b, c]
    }

    /// The world position, in scene units.
    fn position(&self, mesh: &Mesh) -> DVec3 {
        let [a, b, c] = mesh.corners(self.triangle as usize);
        let [_, second, third] = self.shares();
        a + second * (b - a) + third * (c - a)
    }

    fn color(&self, corners: [u32; 3], colors: &[Vec3]) -> Vec3 {
        let shares = self.shares();
        (0..3).map(|i| shares[i] as f32 * colors[corners[i] as usize]).sum()
    }
}

/// `count` places, independent and uniformly distributed over the surface, in the triangles' order.
///
/// No strata, no sequence of low discrepancy: they would be more even on large triangles than on small ones, and the
/// elimination keeps more of what is even. (With a sequence the sides of a cube, meshed differently, had up to 10 % too
/// many or too few surfels; so they have 2 %.)
fn scatter(mesh: &Mesh, area: f64, count: usize, seed: u64) -> Vec<Place> {
    const STREAM: u64 = 0x5375_7266_656c_7321;
    let mut random = Pcg32::new(seed, STREAM);
    let mut unit = move || f64::from(random.next_u32()) / 4_294_967_296.0;
    let mut targets: Vec<f64> = (0..count).map(|_| unit() * area).collect();
    targets.sort_unstable_by(f64::total_cmp);
    let mut places = Vec::with_capacity(count);
    let (mut reached, mut last) = (0.0, None);
    for triangle in 0..mesh.triangles.len() {
        let Some(own) = mesh.triangle_area(triangle) else { continue };
        reached += own;
        last = Some(triangle);
        while places.len() < count && targets[places.len()] < reached {
            places.push(place(triangle, [unit(), unit()]));
        }
    }
    // Rounding of the sum can leave some over.
    while let Some(triangle) = last.filter(|_| places.len() < count) {
        places.push(place(triangle, [unit(), unit()]));
    }
    places
}

/// A point of the unit square on a triangle.
fn place(triangle: usize, [b, c]: [f64; 2]) -> Place {
    let folded = if b + c > 1.0 { [1.0 - b, 1.0 - c] } else { [b, c] };
    Place { triangle: triangle as u32, barycentric: folded.map(|share| share as f32) }
}

/// The indices of the `count` places that are most evenly spread.
fn thin_out(
    mesh: &Mesh,
    places: &[Place],
    area: f64,
    count: usize,
    progress: &mut dyn FnMut(f64),
) -> Vec<u32> {
    let scale = greatest_radius(area, count).recip();
    let center = mesh.corners(places[places.len() / 2].triangle as usize)[0];
    let candidates: Vec<Candidate> = places
        .iter()
        .map(|place| {
            let [a, b, c] = mesh.corners(place.triangle as usize);
            Candidate {
                place: ((place.position(mesh) - center) * scale).as_vec3(),
                normal: (b - a).cross(c - a).normalize_or_zero().as_vec3(),
            }
        })
        .collect();
    eliminate(&candidates, count, progress)
}

/// What the surfels of a triangle share.
#[derive(Debug, Clone, Copy)]
struct Frame {
    normal: DVec3,
    /// Of length sigma.
    axes: [DVec3; 2],
    texture: Option<TextureFrame>,
}

/// The affine map of a triangle's texture coordinates.
#[derive(Debug, Clone, Copy)]
struct TextureFrame {
    corners: [DVec2; 3],
    per_u: DVec2,
    per_v: DVec2,
}

impl Frame {
    /// The frame of a triangle that has an area.
    fn new(mesh: &Mesh, triangle: usize, sigma: f64) -> Self {
        let [a, b, c] = mesh.corners(triangle);
        let (ab, ac) = (b - a, c - a);
        let cross = ab.cross(ac);
        let upright = cross / cross.length();
        let inside_out = mesh.normal_corners(triangle).is_some_and(|normals| {
            normals.iter().map(|normal| normal.as_dvec3().dot(upright)).sum::<f64>() < 0.0
        });
        let normal = if inside_out { -upright } else { upright };
        let texture = mesh.texture_corners(triangle).filter(|corners| corners.iter().all(|c| c.is_finite()));
        // The gradient g of a value that changes by p along ab and by q along ac: g.ab = p, g.ac = q, g.normal = 0.
        let gradient = |p: f64, q: f64| (p * ac.cross(upright) + q * upright.cross(ab)) / cross.length();
        let gradients = texture.map(|[at_a, at_b, at_c]| {
            let (along_ab, along_ac) = (at_b - at_a, at_c - at_a);
            [gradient(along_ab.x, along_ac.x), gradient(along_ab.y, along_ac.y)]
        });
        let direction =
            gradients.and_then(|gradients| along_s(gradients, upright)).unwrap_or(ab / ab.length());
        let axes = [sigma * direction, sigma * normal.cross(direction)];
        let along = |[s, t]: [DVec3; 2], axis: DVec3| DVec2::new(s.dot(axis), t.dot(axis));
        let texture = texture.zip(gradients).map(|(corners, gradients)| TextureFrame {
            corners,
            per_u: along(gradients, axes[0]),
            per_v: along(gradients, axes[1]),
        });
        Self { normal, axes, texture }
    }

    /// The texture coordinates of a surfel of this triangle, if it has any.
    fn texture_coordinates(&self, place: &Place) -> Option<TextureCoordinates> {
        let TextureFrame { corners, per_u, per_v } = self.texture?;
        let [_, second, third] = place.shares();
        let center = corners[0] + second * (corners[1] - corners[0]) + third * (corners[2] - corners[0]);
        let [center, per_u, per_v]: [Vec2; 3] = [center, per_u, per_v].map(|vector| vector.as_vec2());
        Some(TextureCoordinates { center, per_u, per_v })
    }
}

/// The unit vector in the triangle along which s grows and t stays, from their gradients; where t is constant, the
/// gradient of s. `None` where s is constant along it, too.
fn along_s([s, t]: [DVec3; 2], normal: DVec3) -> Option<DVec3> {
    let direction = t.cross(normal).try_normalize().or_else(|| s.try_normalize())?;
    let growth = s.dot(direction);
    if growth == 0.0 { None } else { Some(direction * growth.signum()) }
}

/// The frame of the last triangle, since surfels come in the triangles' order.
struct FrameCache<'a> {
    mesh: &'a Mesh,
    sigma: f64,
    last: Option<(usize, Frame)>,
}

impl<'a> FrameCache<'a> {
    fn new(mesh: &'a Mesh, sigma: f64) -> Self {
        Self { mesh, sigma, last: None }
    }

    fn of(&mut self, triangle: usize) -> Frame {
        match self.last {
            Some((last, frame)) if last == triangle => frame,
            _ => {
                let frame = Frame::new(self.mesh, triangle, self.sigma);
                self.last = Some((triangle, frame));
                frame
            }
        }
    }
}
