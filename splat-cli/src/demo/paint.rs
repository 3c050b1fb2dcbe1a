//! What the surfaces of the still life look like: colours with the light baked in.

use super::light::{Stage, smoothstep};
use super::surfaces::{Point, fibonacci_direction};
use glam::{DQuat, DVec3};
use std::f64::consts::TAU;

/// A colour and an opacity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Paint {
    /// Linear.
    pub color: DVec3,
    /// In [0, 1].
    pub opacity: f64,
}

/// The lights, and the eye that sees the shine.
#[derive(Debug, Clone)]
pub struct Painter {
    /// The lights.
    pub stage: Stage,
    /// Where the camera is.
    pub eye: DVec3,
}

/// Ivory, gold, teal, slate and rust.
const IVORY: DVec3 = DVec3::new(0.78, 0.70, 0.58);
const GOLD: DVec3 = DVec3::new(0.75, 0.42, 0.09);
const TEAL: DVec3 = DVec3::new(0.02, 0.20, 0.23);
const SLATE: DVec3 = DVec3::new(0.13, 0.17, 0.27);
const RUST: DVec3 = DVec3::new(0.52, 0.10, 0.045);

/// The night blue of the knot, between its stripes.
const INDIGO: DVec3 = DVec3::new(0.022, 0.026, 0.075);

/// Dots on the patterned sphere.
const DOTS: usize = 233;

impl Painter {
    /// Something opaque: a matt body of this albedo under a coat that mirrors `shine` of what it faces, and
    /// everything at a grazing angle.
    fn coated(&self, point: &Point, albedo: DVec3, shine: DVec3) -> DVec3 {
        let view = (self.eye - point.position).normalize();
        let cosine = view.dot(point.normal).clamp(0.0, 1.0);
        let grazing = libm::pow(1.0 - cosine, 5.0);
        let mirrored = 2.0 * view.dot(point.normal) * point.normal - view;
        let reflected = self.stage.reflection(point.position, mirrored);
        let matt = albedo * self.stage.irradiance(point.position, point.normal);
        matt + (shine + (DVec3::ONE - shine) * 0.55 * grazing) * reflected
    }

    /// The ground: rows of scallops, each of a few rings, in stone; they fade into the haze.
    pub fn ground(&self, point: &Point) -> Paint {
        let distance = (point.position - self.eye).length();
        let contrast = 0.85 * smoothstep(17.0, 5.0, distance);
        // The mean over the piece of ground that the point stands for: its pattern may be finer than that.
        const ACROSS: i32 = 3;
        const ALONG: i32 = 5;
        let mut albedo = DVec3::ZERO;
        for (i, j) in (0..ACROSS).flat_map(|i| (0..ALONG).map(move |j| (i, j))) {
            let [u, v] = [(i, ACROSS), (j, ALONG)].map(|(i, n)| (f64::from(i) + 0.5) / f64::from(n) - 0.5);
            let place = point.position + u * point.sides[0] + v * point.sides[1];
            albedo += stone(place.x, place.z, contrast) / f64::from(ACROSS * ALONG);
        }
        let mut light = self.stage.irradiance(point.position, point.normal);
        light += self.stage.caustic(point.position);
        let pool = libm::exp(-0.018 * (point.position - DVec3::new(0.1, 0.0, -0.2)).length_squared());
        let clear = pool * smoothstep(24.0, 5.5, distance);
        opaque(self.stage.haze.lerp(albedo * light, clear))
    }

    /// The knot: stripes wound around it, in the colours of a thin film.
    pub fn knot(&self, point: &Point) -> Paint {
        let [t, angle] = point.place;
        let view = (self.eye - point.position).normalize();
        let cosine = view.dot(point.normal).clamp(0.0, 1.0);
        let wave = libm::sin(3.0 * angle + 15.0 * t);
        let stripe = smoothstep(-0.16, 0.16, wave + 0.25);
        let film = rainbow(0.52 + 0.16 * libm::sin(2.0 * t) + 0.50 * (1.0 - cosine));
        let albedo = INDIGO.lerp(0.62 * film, stripe);
        let shine = DVec3::splat(0.05).lerp(0.10 + 0.28 * film, stripe);
        opaque(self.coated(point, albedo, shine))
    }

    /// The large sphere: dots on a Fibonacci spiral, whose colours follow its arms.
    pub fn dotted(&self, point: &Point, turned: DQuat) -> Paint {
        let direction = turned * point.normal;
        let near = (0..DOTS).map(|dot| (fibonacci_direction(dot, DOTS).dot(direction), dot));
        let (cosine, dot) = near.fold((-1.0, 0), |best, next| if next.0 > best.0 { next } else { best });
        let distance = (2.0 - 2.0 * cosine).max(0.0).sqrt();
        let color = match dot % 8 {
            0 | 1 => RUST,
            3 | 4 => TEAL,
            6 => GOLD,
            _ => SLATE,
        };
        let inside = smoothstep(0.098, 0.076, distance);
        opaque(self.coated(point, IVORY.lerp(color, inside), DVec3::splat(0.045)))
    }

    /// A pearl, in a hue of its own.
    pub fn pearl(&self, point: &Point, hue: f64) -> Paint {
        let view = (self.eye - point.position).normalize();
        let cosine = view.dot(point.normal).clamp(0.0, 1.0);
        let body = DVec3::new(0.72, 0.66, 0.60).lerp(rainbow(hue + 0.35 * (1.0 - cosine)), 0.22);
        let color = self.coated(point, body, DVec3::splat(0.10));
        let distance = (point.position - self.eye).length();
        opaque(color.lerp(self.stage.haze, smoothstep(5.5, 15.0, distance)))
    }

    /// Amber glass: clear where one looks through it squarely, a mirror at its rim, with the light that it
    /// gathers on the far side of its inside. The normal is the one outwards.
    pub fn glass(&self, point: &Point) -> Paint {
        let view = (self.eye - point.position).normalize();
        let facing = view.dot(point.normal);
        let cosine = facing.abs();
        let grazing = libm::pow(1.0 - cosine, 3.0);
        let towards_key = Stage::towards_key(point.position);
        let amber = DVec3::new(0.95, 0.36, 0.045);
        if facing < 0.0 {
            let gathered = libm::pow(point.normal.dot(-towards_key).max(0.0), 4.0);
            let color = amber * (0.14 + 0.85 * gathered + 0.25 * grazing);
            return Paint { color: shoulder(color), opacity: 0.22 + 0.6 * gathered + 0.4 * grazing };
        }
        let mirrored = 2.0 * facing * point.normal - view;
        let reflected = self.stage.reflection(point.position, mirrored);
        let mirror = 0.16 + 0.70 * grazing;
        let body = 0.20 + 0.55 * grazing;
        let sheen = (mirror * reflected).max_element().min(0.9);
        let opacity = body + (1.0 - body) * sheen;
        let lit = amber * (0.10 + 0.35 * self.stage.irradiance(point.position, point.normal));
        let color = (body * lit + mirror * reflected) / opacity;
        Paint { color: shoulder(color), opacity }
    }
}

/// The albedo of the ground at a place, given how much its pattern stands out.
fn stone(x: f64, z: f64, contrast: f64) -> DVec3 {
    let (ring, tone) = scallop(x, z);
    let line = smoothstep(0.20, 0.10, (ring - 0.5).abs());
    let stone = DVec3::new(0.40, 0.385, 0.37) * (0.93 + 0.14 * tone);
    stone.lerp(DVec3::new(0.135, 0.175, 0.215), contrast * line)
}

/// A place on the scallops: how far across its ring, 0 to 1, and a tone of the scallop, 0 to 1.
fn scallop(x: f64, z: f64) -> (f64, f64) {
    const RADIUS: f64 = 0.42;
    const RINGS: f64 = 3.0;
    // Rows of discs, half a radius apart, each in front of the next; the nearest that covers the place is
    // seen.
    let row_step = 0.5 * RADIUS;
    let last = (z / row_step).floor() as i32 + 2;
    for row in (last - 5..=last).rev() {
        let shift = if row.rem_euclid(2) == 0 { 0.0 } else { RADIUS };
        let column = libm::round((x - shift) / (2.0 * RADIUS));
        let (dx, dz) = (x - shift - 2.0 * RADIUS * column, z - f64::from(row) * row_step);
        let distance = (dx * dx + dz * dz).sqrt() / RADIUS;
        if distance < 1.0 {
            let tone = super::surfaces::hash(column as i32, row);
            return ((RINGS * distance).fract(), tone);
        }
    }
    (0.5, 0.5)
}

/// The colours of a thin film, once around for every 1.
fn rainbow(hue: f64) -> DVec3 {
    let wave = |phase: f64| 0.5 + 0.5 * libm::cos(TAU * (hue - phase));
    let pure = DVec3::new(wave(0.0), wave(0.36), wave(0.64));
    pure * pure * 0.85 + 0.10
}

/// Something that lets nothing through.
fn opaque(color: DVec3) -> Paint {
    Paint { color: shoulder(color), opacity: 1.0 }
}

/// Bends the brightest colours towards white instead of clipping them, as film does.
fn shoulder(color: DVec3) -> DVec3 {
    const KNEE: f64 = 0.6;
    let bend = |value: f64| {
        if value < KNEE {
            value
        } else {
            KNEE + (1.0 - KNEE) * (1.0 - libm::exp(-(value - KNEE) / (1.0 - KNEE)))
        }
    };
    DVec3::new(bend(color.x), bend(color.y), bend(color.z))
}
