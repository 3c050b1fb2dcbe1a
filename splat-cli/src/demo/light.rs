//! Light, and the shadows that spheres cast: soft and in closed form, so that no noise needs averaging.

use glam::DVec3;
use std::cmp::Ordering;

/// Something in the way of light: a sphere.
#[derive(Debug, Clone, Copy)]
pub struct Occluder {
    /// Its centre.
    pub center: DVec3,
    /// Its radius.
    pub radius: f64,
}

/// A lamp: a sphere that shines, with no falloff but the one that its distance gives.
#[derive(Debug, Clone, Copy)]
struct Lamp {
    center: DVec3,
    radius: f64,
    /// Irradiance of a surface that faces the lamp at the scene's middle.
    color: DVec3,
}

/// Warm, from the upper left, in front.
const KEY: Lamp =
    Lamp { center: DVec3::new(-3.4, 5.2, 3.6), radius: 0.75, color: DVec3::new(1.42, 1.16, 0.88) };

/// Cool, from the right, behind: it draws the edges.
const RIM: Lamp =
    Lamp { center: DVec3::new(9.2, 6.0, -8.4), radius: 2.4, color: DVec3::new(0.24, 0.38, 0.60) };

/// Radiance of the sky overhead.
const SKY: DVec3 = DVec3::new(0.21, 0.26, 0.34);

/// Radiance of the lit ground.
const GROUND: DVec3 = DVec3::new(0.21, 0.17, 0.14);

/// What glass lets through of the light that meets it.
const GLASS_TINT: DVec3 = DVec3::new(0.85, 0.42, 0.14);

/// The lights, and what stands in their way.
#[derive(Debug, Clone)]
pub struct Stage {
    /// Opaque spheres.
    pub spheres: Vec<Occluder>,
    /// Beads of the knot: each a part of one thing.
    pub beads: Vec<Occluder>,
    /// The sphere of glass.
    pub glass: Occluder,
    /// Colour far away.
    pub haze: DVec3,
}

impl Stage {
    /// Light that arrives at a point of a surface, over pi: times the albedo it is what a matt surface sends
    /// out.
    pub fn irradiance(&self, position: DVec3, normal: DVec3) -> DVec3 {
        let mut sum = self.ambient(position, normal);
        for lamp in [KEY, RIM] {
            let cosine = lamp_cosine(&lamp, position, normal);
            if cosine > 0.0 {
                sum += cosine * lamp.color * falloff(&lamp, position) * self.visibility(&lamp, position);
            }
        }
        sum
    }

    /// What a mirror at a point shows in this direction: sky, haze, ground and the two lamps behind square
    /// diffusers.
    pub fn reflection(&self, position: DVec3, direction: DVec3) -> DVec3 {
        let height = direction.y;
        let sky = self.haze.lerp(1.5 * SKY, smoothstep(0.0, 0.9, height));
        let ground = GROUND * (0.35 + 0.65 * smoothstep(0.0, 0.5, position.y));
        let mut color = sky.lerp(ground, smoothstep(0.12, -0.25, height));
        for (lamp, half_side, strength) in [(KEY, 0.20, 3.2), (RIM, 0.24, 1.6)] {
            let towards = (lamp.center - position).normalize();
            let across = towards.cross(DVec3::Y).normalize();
            let [x, y] = [across, across.cross(towards)].map(|axis| axis.dot(direction).abs());
            if direction.dot(towards) > 0.0 {
                let edge = |value: f64| smoothstep(half_side + 0.05, half_side - 0.05, value);
                let visible = self.visibility(&lamp, position).y;
                color += strength * edge(x) * edge(y) * visible * lamp.color;
            }
        }
        color
    }

    /// Direction to the key light.
    pub fn towards_key(position: DVec3) -> DVec3 {
        (KEY.center - position).normalize()
    }

    /// Light from the sky and from the ground, less what the things around keep off.
    fn ambient(&self, position: DVec3, normal: DVec3) -> DVec3 {
        let up = 0.5 + 0.5 * normal.y;
        let mut open = 1.0;
        for sphere in &self.spheres {
            open *= 1.0 - blocked_sky(sphere, position, normal);
        }
        open *= 1.0 - 0.45 * blocked_sky(&self.glass, position, normal);
        // Beads overlap eight times.
        let beads: f64 = self.beads.iter().map(|bead| blocked_sky(bead, position, normal)).sum();
        open *= libm::exp(-0.45 * beads);
        let clearance = smoothstep(-0.05, 0.45, position.y);
        open * up * SKY + (0.3 + 0.7 * open) * (1.0 - up) * clearance * GROUND
    }

    /// The part of a lamp that a point sees, tinted by glass.
    fn visibility(&self, lamp: &Lamp, position: DVec3) -> DVec3 {
        let mut open: f64 = 1.0;
        for sphere in &self.spheres {
            open *= 1.0 - covered(lamp, sphere, position);
        }
        let bead = self.beads.iter().map(|bead| covered(lamp, bead, position)).fold(0.0, f64::max);
        let glass = covered(lamp, &self.glass, position);
        open * (1.0 - bead) * DVec3::ONE.lerp(0.55 * GLASS_TINT, glass)
    }

    /// The light that the sphere of glass gathers on the ground, behind itself.
    pub fn caustic(&self, position: DVec3) -> DVec3 {
        let Occluder { center, radius } = self.glass;
        let away = (center - KEY.center).normalize();
        let spot = center - away * (center.y / away.y);
        let along = DVec3::new(away.x, 0.0, away.z).normalize();
        let offset = position - (spot - 0.12 * radius * along);
        let (u, v) =
            (offset.dot(along) / (0.62 * radius), offset.dot(along.cross(DVec3::Y)) / (0.42 * radius));
        let (wide, core) = (u * u + v * v, 5.0 * (u + 0.25) * (u + 0.25) + 9.0 * v * v);
        GLASS_TINT * (0.55 * libm::exp(-2.0 * wide) + 1.1 * libm::exp(-core))
    }
}

/// Cosine of the lamp's direction, eased where the lamp sets behind the surface's horizon.
fn lamp_cosine(lamp: &Lamp, position: DVec3, normal: DVec3) -> f64 {
    let to_lamp = lamp.center - position;
    let sine = lamp.radius / to_lamp.length();
    let cosine = to_lamp.normalize().dot(normal);
    match cosine.partial_cmp(&sine) {
        Some(Ordering::Less) if cosine > -sine => (cosine + sine) * (cosine + sine) / (4.0 * sine),
        Some(Ordering::Less) => 0.0,
        _ => cosine,
    }
}

/// Irradiance relative to that at the middle: the inverse square of the distance.
fn falloff(lamp: &Lamp, position: DVec3) -> f64 {
    lamp.center.length_squared() / (lamp.center - position).length_squared()
}

/// The part of a lamp that a sphere covers, seen from a point: two discs that overlap, to a smooth
/// approximation. A point of the sphere itself is not covered by it.
fn covered(lamp: &Lamp, sphere: &Occluder, position: DVec3) -> f64 {
    let (to_lamp, to_sphere) = (lamp.center - position, sphere.center - position);
    let (lamp_distance, distance) = (to_lamp.length(), to_sphere.length());
    let apart = smoothstep(1.02 * sphere.radius, 1.5 * sphere.radius, distance);
    if apart == 0.0 || distance > lamp_distance || to_lamp.dot(to_sphere) < 0.0 {
        return 0.0;
    }
    let (lamp_size, size) = (lamp.radius / lamp_distance, sphere.radius / distance);
    let separation = (to_lamp / lamp_distance - to_sphere / distance).length();
    let largest = (size / lamp_size * (size / lamp_size)).min(1.0);
    apart * largest * smoothstep(size + lamp_size, (size - lamp_size).abs().min(size), separation)
}

/// The part of a surface's hemisphere, weighted by the cosine, that a sphere takes up.
fn blocked_sky(sphere: &Occluder, position: DVec3, normal: DVec3) -> f64 {
    let to_sphere = sphere.center - position;
    let distance = to_sphere.length();
    if distance < 1.02 * sphere.radius {
        return 0.0;
    }
    let size = sphere.radius / distance;
    let cosine = to_sphere.dot(normal) / distance;
    ((cosine + size) / (1.0 + size)).max(0.0) * size * size
}

/// 0 up to the first edge, 1 from the second, smooth between; the edges may be given in either order.
pub fn smoothstep(from: f64, to: f64, value: f64) -> f64 {
    let t = ((value - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
