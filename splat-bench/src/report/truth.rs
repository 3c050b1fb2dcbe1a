//! The true picture: everything in `f64`, with its own samples, sums, weights and resolve.
//!
//! It shares with the renderer the splat-centred constants (computed in `f64` by set-up, here never rounded) and the lines of
//! the evaluation, which other tests hold against plain geometry; and nothing else. Candidates come from the boxes of spheres
//! around the splats, the kernel is `libm`'s `exp`, the resolve follows the specification's section 6 word by word.
//!
//! Samples are spread evenly over the plane of the picture, and weighed by the pixel filters' densities: so one
//! pass serves all filters, and the inversion by which the renderer draws from them is judged as well. Each pixel's own
//! square has a jittered grid of samples, its lens points a jittered grid in a random order.

use super::metrics::Picture;
use glam::DVec3;
use rayon::prelude::*;
use splat_abuffer::{Coverage, Resolve, Thickness};
use splat_core::evaluate::{Hit, LensPoint, Limits, SplatConstants};
use splat_core::sampling::SampleTable;
use splat_core::setup::{View, camera_splat, half_depth, project, splat_color};
use splat_core::{Camera, Cloud, Kernel, Lens, PixelFilter, RenderOptions, Shading, Shapes};
use std::f64::consts::TAU;
use std::path::Path;

/// To be raised with every change of what is computed here, so that no older picture is taken from the cache.
const VERSION: u32 = 3;

/// Side of the square of pixels that a task renders.
const TILE: i32 = 16;

/// All pixel filters, in the order of [`Truth`]'s pictures.
pub const FILTERS: [PixelFilter; 4] =
    [PixelFilter::Box, PixelFilter::Tent, PixelFilter::Gaussian, PixelFilter::BlackmanHarris];

/// Layers lighter than this are none: tau of section 6.
const TAU_WEIGHT: f64 = 1e-3;

/// True pictures, one for each of [`FILTERS`].
#[derive(Debug, Clone, PartialEq)]
pub struct Truth {
    pictures: [Picture; 4],
}

impl Truth {
    /// That of a filter.
    pub fn of(&self, filter: PixelFilter) -> &Picture {
        let index = FILTERS.iter().position(|&one| one == filter).expect("all filters are there");
        &self.pictures[index]
    }

    /// The mean of two.
    pub fn mean(a: &Self, b: &Self) -> Self {
        let both = |a: &[f64; 4], b: &[f64; 4]| [0, 1, 2, 3].map(|i| 0.5 * (a[i] + b[i]));
        let pictures = [0, 1, 2, 3].map(|i| {
            let pairs = a.pictures[i].iter().zip(&b.pictures[i]);
            pairs.map(|(a, b)| both(a, b)).collect()
        });
        Self { pictures }
    }
}

/// A splat, as section 3 sets it up.
struct Splat {
    constants: SplatConstants<f64>,
    /// Least and greatest x, then y, in pixels, of where it may be hit.
    bounds: [[f64; 2]; 2],
    /// With a lens: where m = d + p defocus lies for every hit, relative to the reference point's projection, x and y.
    sharp: [[f64; 2]; 2],
    depth: f64,
    weight_scale: f64,
    back: bool,
    ke: f64,
    cap: f64,
    color: [f64; 3],
    opacity: f64,
}

/// A fragment, as section 6 has it.
#[derive(Clone, Copy)]
struct Fragment {
    depth: f64,
    half: f64,
    weight: f64,
    back: bool,
    splat: u32,
}

/// A sample: its place relative to the pixel's corner, in pixels, and its point on the lens times the pixel scale.
#[derive(Debug, Clone, Copy)]
struct Sample {
    jitter: [f64; 2],
    lens: LensPoint<f64>,
}

/// A scene, ready to be sampled anywhere.
pub struct Exact<'a> {
    options: &'a RenderOptions,
    view: View,
    limits: Limits<f64>,
    rim: f64,
    coverage: Coverage,
    splats: Vec<Splat>,
    /// The flips of a lens matter.
    oriented: bool,
}

impl<'a> Exact<'a> {
    /// Sets up a scene. It must be resolved into surfaces of the default thickness, without materials; clip planes count
    /// as none.
    pub fn new(cloud: &Cloud, camera: &Camera, options: &'a RenderOptions) -> Self {
        let Resolve::Surface { coverage, thickness: Thickness::AroundHit } = options.resolve else {
            panic!("the truth knows surfaces around hits only")
        };
        let view = View::new(camera, options);
        let splats = (0..cloud.len()).filter(|&i| cloud.defect(i).is_none());
        // A pinhole's culling concerns whole splats.
        let hidden = |splat: &Splat| options.cull && splat.back && view.lens.is_none();
        let splats = splats.filter_map(|index| Splat::new(cloud, index, &view, options));
        let mut splats: Vec<Splat> = splats.filter(|splat| !hidden(splat)).collect();
        // For no other reason than that nearly sorted fragments are soon sorted.
        splats.sort_by(|a, b| a.back.cmp(&b.back).then(a.depth.total_cmp(&b.depth)));
        Self {
            limits: Limits::new(options.cutoff, camera.near, camera.far),
            rim: libm::exp(-0.5 * options.cutoff),
            options,
            view,
            coverage,
            splats,
            oriented: cloud.oriented,
        }
    }

    /// The kernel, exact.
    fn kernel(&self, r2: f64) -> f64 {
        match self.options.kernel {
            Kernel::Gaussian => libm::exp(-0.5 * r2),
            Kernel::Windowed => (libm::exp(-0.5 * r2) - self.rim) / (1.0 - self.rim),
            Kernel::Disc => 1.0,
        }
    }

    /// The splats that may be hit from within a rectangle of the picture, in pixels.
    fn candidates(&self, [low, high]: [[f64; 2]; 2]) -> Vec<u32> {
        let meets =
            |splat: &Splat| (0..2).all(|i| splat.bounds[i][0] <= high[i] && low[i] <= splat.bounds[i][1]);
        (0..self.splats.len() as u32).filter(|&i| meets(&self.splats[i as usize])).collect()
    }

    /// Whether a splat may be hit from within a square of the picture, given its least corner and its side, in pixels.
    fn may_be_hit(&self, splat: &Splat, corner: [f64; 2], side: f64) -> bool {
        let meets = |i: usize| splat.bounds[i][0] <= corner[i] + side && corner[i] <= splat.bounds[i][1];
        if !(meets(0) && meets(1)) {
            return false;
        }
        if self.view.lens.is_some() || self.view.orthographic {
            return true;
        }
        // For a pinhole u g, v g and g are linear in the sample's place, and |u|, |v| < R, |u +- v| < sqrt(2) R.
        let c = &splat.constants;
        let center = c.pixel();
        let d = [corner[0] + 0.5 * side - center.x, corner[1] + 0.5 * side - center.y];
        let u = [c.reference[0], c.reference[0] * c.h[0], c.reference[0] * c.h[1] + c.a1];
        let v = [c.reference[1], c.reference[1] * c.h[0] + c.b[0], c.reference[1] * c.h[1] + c.b[1]];
        let g = [1.0, c.h[0], c.h[1]];
        let radius = self.view.radius * (1.0 + 1e-9);
        // The greatest value of the linear function a over the square.
        let greatest =
            |a: [f64; 3]| a[0] + a[1] * d[0] + a[2] * d[1] + 0.5 * side * (a[1].abs() + a[2].abs());
        let diagonal = radius * std::f64::consts::SQRT_2;
        [(1.0, 0.0, radius), (0.0, 1.0, radius), (1.0, 1.0, diagonal), (1.0, -1.0, diagonal)].iter().all(
            |&(along_u, along_v, radius)| {
                [1.0, -1.0].iter().all(|sign| {
                    let a = [0, 1, 2].map(|i| radius * g[i] + sign * (along_u * u[i] + along_v * v[i]));
                    greatest(a) >= 0.0
                })
            },
        )
    }

    /// The hit of a sample of the pixel (x, y).
    #[inline(always)]
    fn hit(&self, splat: &Splat, [x, y]: [i32; 2], sample: &Sample) -> Option<Hit<f64>> {
        let d = splat.constants.offset(x, y, sample.jitter);
        match self.view.lens {
            _ if self.view.orthographic => splat.constants.orthographic(d, &self.limits),
            None => splat.constants.pinhole(d, &self.limits),
            Some(_) => {
                let (p, sharp) = (sample.lens.p, &splat.sharp);
                let inside = |i: usize| {
                    let m = d[i] + p[i] * splat.constants.defocus;
                    sharp[i][0] <= m && m <= sharp[i][1]
                };
                let possible = inside(0) && inside(1);
                if possible { splat.constants.thin_lens(d, &sample.lens, &self.limits) } else { None }
            }
        }
    }

    /// The colour of each sample of a pixel, given the splats that may be hit.
    fn samples(
        &self,
        pixel: [i32; 2],
        samples: &[Sample],
        candidates: &[u32],
        fragments: &mut Vec<Vec<Fragment>>,
        mut sink: impl FnMut(usize, [f64; 4]),
    ) {
        fragments.resize_with(samples.len(), Vec::new);
        fragments.iter_mut().for_each(Vec::clear);
        for &number in candidates {
            let splat = &self.splats[number as usize];
            for (sample, list) in samples.iter().zip(fragments.iter_mut()) {
                let Some(hit) = self.hit(splat, pixel, sample) else { continue };
                let back = splat.back != (hit.flipped && self.oriented);
                let weight = splat.weight_scale * self.kernel(hit.r2);
                if weight > 0.0 && !(self.options.cull && back) {
                    let half = (splat.ke * hit.depth).min(splat.cap);
                    list.push(Fragment { depth: hit.depth, half, weight, back, splat: number });
                }
            }
        }
        for (number, list) in fragments.iter_mut().enumerate() {
            sink(number, self.resolve(list));
        }
    }

    /// Section 6: layers are what overlaps in depth, directly or through others, fronts and backs apart.
    fn resolve(&self, fragments: &mut [Fragment]) -> [f64; 4] {
        struct Layer {
            nearest: f64,
            weight: f64,
            weight_opacity: f64,
            color: [f64; 3],
        }
        fragments.sort_unstable_by(|a, b| {
            a.back.cmp(&b.back).then((a.depth - a.half).total_cmp(&(b.depth - b.half)))
        });
        let mut layers: Vec<Layer> = Vec::new();
        let mut open: Option<(bool, f64)> = None;
        for fragment in fragments.iter() {
            let (near, far) = (fragment.depth - fragment.half, fragment.depth + fragment.half);
            match &mut open {
                Some((back, end)) if *back == fragment.back && near <= *end => *end = end.max(far),
                _ => {
                    open = Some((fragment.back, far));
                    layers.push(Layer {
                        nearest: f64::INFINITY,
                        weight: 0.0,
                        weight_opacity: 0.0,
                        color: [0.0; 3],
                    });
                }
            }
            let splat = &self.splats[fragment.splat as usize];
            let layer = layers.last_mut().expect("one was just opened");
            layer.nearest = layer.nearest.min(fragment.depth);
            layer.weight += fragment.weight;
            layer.weight_opacity += fragment.weight * splat.opacity;
            for (sum, color) in layer.color.iter_mut().zip(splat.color) {
                *sum += fragment.weight * splat.opacity * color;
            }
        }
        // Fronts come before backs of the same depth: the sort keeps their order.
        layers.sort_by(|a, b| a.nearest.total_cmp(&b.nearest));
        let (mut color, mut transmittance) = ([0.0; 3], 1.0);
        for layer in &layers {
            let coverage = match self.coverage {
                _ if layer.weight < TAU_WEIGHT => 0.0,
                Coverage::Opaque => f64::from(u8::from(layer.weight >= 0.5)),
                Coverage::Soft { saturation } => (layer.weight / f64::from(saturation)).min(1.0),
            };
            let alpha = coverage * layer.weight_opacity / layer.weight;
            if alpha > 0.0 {
                for (sum, weighted) in color.iter_mut().zip(layer.color) {
                    *sum += transmittance * alpha * weighted / layer.weight_opacity;
                }
                transmittance *= 1.0 - alpha;
            }
        }
        [color[0], color[1], color[2], 1.0 - transmittance]
    }

    /// The picture of every filter, with `side`^2 samples in each pixel's square.
    pub fn truth(&self, side: u32, seed: u64) -> Truth {
        let patterns: Vec<Pattern> = (0..PATTERNS).map(|i| Pattern::new(side, seed ^ (i << 32))).collect();
        let [width, height] = self.view.frame.map(|side| side as i32);
        // Filters reach one pixel beyond a pixel's own square, so there are squares around the frame, too.
        let tiles: Vec<[i32; 2]> = (-1..=height)
            .step_by(TILE as usize)
            .flat_map(|y| (-1..=width).step_by(TILE as usize).map(move |x| [x, y]))
            .collect();
        let parts: Vec<Sums> = tiles.par_iter().map(|&tile| self.tile(tile, &patterns, seed)).collect();
        let mut sums = Sums::new([-2, -2], [width + TILE + 4, height + TILE + 4]);
        for part in &parts {
            sums.add(part);
        }
        let pixels = || (0..height).flat_map(|y| (0..width).map(move |x| [x, y]));
        Truth { pictures: [0, 1, 2, 3].map(|filter| pixels().map(|at| sums.mean(at, filter)).collect()) }
    }

    /// The sums to which a tile's squares contribute.
    fn tile(&self, [x0, y0]: [i32; 2], patterns: &[Pattern], seed: u64) -> Sums {
        let [width, height] = self.view.frame.map(|side| side as i32);
        let (x1, y1) = ((x0 + TILE).min(width + 1), (y0 + TILE).min(height + 1));
        let mut sums = Sums::new([x0 - 1, y0 - 1], [TILE + 2, TILE + 2]);
        let of_tile = self.candidates([[x0, y0], [x1, y1]].map(|corner| corner.map(f64::from)));
        let (mut samples, mut fragments, mut candidates) = (Vec::new(), Vec::new(), Vec::new());
        for y in y0..y1 {
            for x in x0..x1 {
                let pattern = self.even_samples([x, y], patterns, seed, &mut samples);
                let corner = [x, y].map(f64::from);
                candidates.clear();
                let may_be_hit = |&i: &u32| self.may_be_hit(&self.splats[i as usize], corner, 1.0);
                candidates.extend(of_tile.iter().copied().filter(may_be_hit));
                let mut around: Around = [[0.0; WEIGHTS]; 4];
                self.samples([x, y], &samples, &candidates, &mut fragments, |number, color| {
                    add_sample(&mut around, &pattern.weights[number], color);
                });
                sums.add_around([x, y], &around, &pattern.total);
            }
        }
        sums
    }

    /// A pixel's samples: one of the patterns, and over the lens a jittered grid in a random order.
    fn even_samples<'p>(
        &self,
        [x, y]: [i32; 2],
        patterns: &'p [Pattern],
        seed: u64,
        samples: &mut Vec<Sample>,
    ) -> &'p Pattern {
        let place = (u64::from(x as u32) << 32) | u64::from(y as u32);
        let mut random = SplitMix(seed ^ SplitMix(place).next());
        let pattern = &patterns[random.next() as usize % patterns.len()];
        samples.clear();
        let lens = LensPoint { p: [0.0; 2] };
        samples.extend(pattern.jitter.iter().map(|&jitter| Sample { jitter, lens }));
        let Some(lens) = self.view.lens else { return pattern };
        let side = pattern.side;
        let mut order: Vec<u32> = (0..side * side).collect();
        for i in (1..order.len()).rev() {
            order.swap(i, (random.unit() * (i + 1) as f64) as usize);
        }
        for (sample, &i) in samples.iter_mut().zip(&order) {
            // Equal areas to equal areas; the truth knows round lenses only.
            let [first, second] = random.in_cell(i, side);
            let (radius, angle) = (first.sqrt(), TAU * second);
            let unit = [radius * libm::cos(angle), radius * libm::sin(angle)];
            sample.lens.p = [0, 1].map(|axis| unit[axis] * lens.radius * self.view.pixel_scale[axis]);
        }
        pattern
    }

    /// The picture with the renderer's own samples: what is left is the error of its arithmetic.
    pub fn with_samples_of(&self, table: &SampleTable) -> Picture {
        let [width, height] = self.view.frame.map(|side| side as i32);
        let tiles: Vec<[i32; 2]> = (0..height)
            .step_by(TILE as usize)
            .flat_map(|y| (0..width).step_by(TILE as usize).map(move |x| [x, y]))
            .collect();
        let render = |&[x0, y0]: &[i32; 2]| {
            let (x1, y1) = ((x0 + TILE).min(width), (y0 + TILE).min(height));
            let reach = 1.0;
            let of_tile = self.candidates([
                [x0, y0].map(|low| f64::from(low) - reach),
                [x1, y1].map(|high| f64::from(high) + reach),
            ]);
            let (mut fragments, mut candidates, mut pixels) = (Vec::new(), Vec::new(), Vec::new());
            for y in y0..y1 {
                for x in x0..x1 {
                    let jitter = table.jitter(x, y).iter().map(|jitter| jitter.map(f64::from));
                    let mut lens = table.lens(x, y).iter().map(|lens| lens.p.map(f64::from));
                    let samples: Vec<Sample> = jitter
                        .map(|jitter| Sample {
                            jitter,
                            lens: LensPoint { p: lens.next().unwrap_or([0.0; 2]) },
                        })
                        .collect();
                    let corner = [x, y].map(|low| f64::from(low) - reach);
                    candidates.clear();
                    let may_be_hit =
                        |&i: &u32| self.may_be_hit(&self.splats[i as usize], corner, 1.0 + 2.0 * reach);
                    candidates.extend(of_tile.iter().copied().filter(may_be_hit));
                    let mut sum = [0.0; 4];
                    self.samples([x, y], &samples, &candidates, &mut fragments, |_, color| {
                        sum = [0, 1, 2, 3].map(|i| sum[i] + color[i]);
                    });
                    pixels.push((y * width + x, sum.map(|sum| sum / samples.len() as f64)));
                }
            }
            pixels
        };
        let mut picture = vec![[0.0; 4]; (width * height) as usize];
        for (index, color) in tiles.par_iter().map(render).collect::<Vec<_>>().into_iter().flatten() {
            picture[index as usize] = color;
        }
        picture
    }
}

impl Splat {
    /// `None` if it lies before the near plane, or is a line.
    fn new(cloud: &Cloud, index: usize, view: &View, options: &RenderOptions) -> Option<Self> {
        let splat = camera_splat(cloud, index, view);
        let [t1, t2] = splat.axes;
        let extent = half_depth(&splat, view.radius);
        if splat.center.z + extent <= view.near {
            return None;
        }
        let constants = project(&splat, view)?;
        // A sphere around the disc, and the box around that.
        let sphere = view.radius
            * t1.length().hypot(t2.length()).min(
                // Perpendicular axes: the longer one is enough.
                if t1.dot(t2).abs() < 1e-9 * t1.length() * t2.length() {
                    t1.length().max(t2.length())
                } else {
                    f64::INFINITY
                },
            )
            * (1.0 + 1e-9);
        let depths = [(splat.center.z - extent).max(view.near), splat.center.z + extent];
        let image = [0, 1].map(|axis| image(splat.center, sphere, depths, view, axis));
        let bounds = [0, 1].map(|axis| {
            // The circle of confusion.
            let blur = |lens: Lens| lens.radius * farthest(1.0 / lens.focus, depths) * view.pixel_scale[axis];
            let blur = view.lens.map_or(0.0, blur);
            [image[axis][0] - blur, image[axis][1] + blur]
        });
        // A hit at depth w that a pinhole would see at d' has m = d' + p (1/wr - 1/w).
        let reference = constants.pixel().to_array();
        let sharp = [0, 1].map(|axis| {
            let spread =
                |lens: Lens| lens.radius * farthest(1.0 / constants.depth, depths) * view.pixel_scale[axis];
            let spread = view.lens.map_or(0.0, spread) + 1e-6;
            [image[axis][0] - reference[axis] - spread, image[axis][1] - reference[axis] + spread]
        });
        // |T1 x T2| in the world, where areas are.
        let world_area = match &cloud.shapes {
            Shapes::Discs(sizes) => f64::from(sizes[index]).powi(2),
            Shapes::Ellipses(axes) => axes[index][0].as_dvec3().cross(axes[index][1].as_dvec3()).length(),
        };
        let weight_scale = match &cloud.areas {
            Some(areas) if options.kernel != Kernel::Disc => {
                f64::from(areas[index]) / (world_area * kernel_integral(options))
            }
            _ => 1.0,
        };
        let sigma = t1.cross(t2).length().sqrt();
        let half = options.thickness * sigma;
        let cap = extent + half;
        let (ke, cap) = if view.orthographic {
            (f64::INFINITY, (half / splat.normal.z.abs()).min(cap))
        } else {
            (half / splat.normal.dot(splat.center).abs(), cap)
        };
        let light = match options.shading {
            Shading::Color => 1.0,
            Shading::Headlight => {
                let to_eye = if view.orthographic { DVec3::Z } else { splat.center.normalize() };
                0.04 + 0.96 * splat.normal.dot(to_eye).abs()
            }
            Shading::Lambert { .. } => panic!("the truth knows no lamp but the headlight"),
        };
        Some(Self {
            constants,
            bounds,
            sharp,
            depth: splat.center.z,
            weight_scale,
            back: splat.back,
            ke,
            cap,
            color: splat_color(cloud, index, view, options.shading).map(|value| f64::from(value) * light),
            opacity: cloud.opacities.as_ref().map_or(1.0, |all| f64::from(all[index])),
        })
    }
}

/// The kernel's integral over the disc: docs/specification.md, section 2.
fn kernel_integral(options: &RenderOptions) -> f64 {
    let f = options.cutoff;
    let c = libm::exp(-0.5 * f);
    let pi = std::f64::consts::PI;
    match options.kernel {
        Kernel::Gaussian => 2.0 * pi * (1.0 - c),
        Kernel::Windowed => (2.0 * pi * (1.0 - c) - pi * f * c) / (1.0 - c),
        Kernel::Disc => pi * f,
    }
}

/// Least and greatest coordinate, in pixels, at which a pinhole or an orthographic camera sees what lies between two depths
/// within a sphere.
fn image(center: DVec3, sphere: f64, [near, far]: [f64; 2], view: &View, axis: usize) -> [f64; 2] {
    let (low, high) = (center[axis] - sphere, center[axis] + sphere);
    let extent = if view.orthographic {
        [low, high]
    } else {
        [(low / near).min(low / far), (high / near).max(high / far)]
    };
    extent.map(|value| value * view.pixel_scale[axis] + view.principal_point[axis])
}

/// How far the reciprocal of a depth may be from a number.
fn farthest(inverse: f64, depths: [f64; 2]) -> f64 {
    (1.0 / depths[0] - inverse).abs().max((1.0 / depths[1] - inverse).abs())
}

/// The sums of the samples around each pixel of a rectangle, for each filter: colour, alpha, weight.
struct Sums {
    first: [i32; 2],
    size: [i32; 2],
    all: Vec<[[f64; 5]; 4]>,
}

impl Sums {
    fn new(first: [i32; 2], size: [i32; 2]) -> Self {
        Self { first, size, all: vec![[[0.0; 5]; 4]; (size[0] * size[1]) as usize] }
    }

    fn index(&self, [x, y]: [i32; 2]) -> usize {
        ((y - self.first[1]) * self.size[0] + x - self.first[0]) as usize
    }

    /// Adds the sums that a square's samples make for the pixels around it, and their weights.
    fn add_around(&mut self, [x, y]: [i32; 2], around: &Around, total: &[f64; WEIGHTS]) {
        for (i, offset) in (0..9).map(|i| (i as usize, [i % 3 - 1, i / 3 - 1])) {
            let index = self.index([x + offset[0], y + offset[1]]);
            for (filter, sums) in self.all[index].iter_mut().enumerate() {
                let Some(weight) = weight_index(i, filter) else { continue };
                let values = [around[0], around[1], around[2], around[3], *total].map(|sums| sums[weight]);
                for (sum, value) in sums.iter_mut().zip(values) {
                    *sum += value;
                }
            }
        }
    }

    /// Adds the sums of a part.
    fn add(&mut self, part: &Self) {
        for y in 0..part.size[1] {
            for x in 0..part.size[0] {
                let at = [part.first[0] + x, part.first[1] + y];
                let (to, from) = (self.index(at), part.index(at));
                let from = part.all[from].as_flattened();
                for (sum, value) in self.all[to].as_flattened_mut().iter_mut().zip(from) {
                    *sum += value;
                }
            }
        }
    }

    /// The weighted mean of a pixel.
    fn mean(&self, at: [i32; 2], filter: usize) -> [f64; 4] {
        let [red, green, blue, alpha, weight] = self.all[self.index(at)][filter];
        [red, green, blue, alpha].map(|sum| sum / weight)
    }
}

/// Number of weights that a sample has: for each of the three by three pixels around its square those of the tent, the
/// Gaussian and the window, and the box's for its own.
const WEIGHTS: usize = 28;

/// Which of them counts for the pixel `i` of the three by three and a filter; `None` if that is 0.
fn weight_index(i: usize, filter: usize) -> Option<usize> {
    match filter {
        0 => (i == 4).then_some(WEIGHTS - 1),
        _ => Some(9 * (filter - 1) + i),
    }
}

/// For each channel, the sums of a square's samples times each of their weights.
type Around = [[f64; WEIGHTS]; 4];

/// Adds a sample.
#[inline(always)]
fn add_sample(around: &mut Around, weights: &[f64; WEIGHTS], color: [f64; 4]) {
    if color[3] == 0.0 {
        return;
    }
    for (sums, value) in around.iter_mut().zip(color) {
        for (sum, weight) in sums.iter_mut().zip(weights) {
            *sum += weight * value;
        }
    }
}

/// A jittered grid of samples over a pixel's square.
struct Pattern {
    side: u32,
    jitter: Vec<[f64; 2]>,
    weights: Vec<[f64; WEIGHTS]>,
    /// Their sum.
    total: [f64; WEIGHTS],
}

/// How many there are.
const PATTERNS: u64 = 64;

impl Pattern {
    fn new(side: u32, seed: u64) -> Self {
        let mut random = SplitMix(seed);
        let jitter: Vec<[f64; 2]> = (0..side * side).map(|i| random.in_cell(i, side)).collect();
        let weights: Vec<[f64; WEIGHTS]> = jitter.iter().map(|&jitter| weights(jitter)).collect();
        let total = std::array::from_fn(|i| weights.iter().map(|weights| weights[i]).sum());
        Self { side, jitter, weights, total }
    }
}

/// The weights of a sample: the filters' densities along x times those along y.
fn weights(jitter: [f64; 2]) -> [f64; WEIGHTS] {
    let [along_x, along_y] = jitter.map(|jitter| densities(jitter - 0.5));
    let mut weights = [0.0; WEIGHTS];
    for i in 0..9 {
        for filter in 0..4 {
            if let Some(index) = weight_index(i, filter) {
                weights[index] = along_x[i % 3][filter] * along_y[i / 3][filter];
            }
        }
    }
    weights
}

/// The densities of all filters at a sample `x` from the centre of its own square (at most 1/2), as seen from the centres of
/// the square before, its own, and the one after: docs/specification.md, section 5. Their common factors do not matter.
fn densities(x: f64) -> [[f64; 4]; 3] {
    // exp(-2 (x + k)^2) = exp(-2 x^2) exp(-4 k x) exp(-2 k^2): sigma is 1/2.
    let (middle, ratio) = ((-2.0 * x * x).exp(), (4.0 * x).exp());
    let beside = middle * (-2.0f64).exp();
    let gaussian = [beside / ratio, middle, beside * ratio];
    // The window of radius 3/2: a phase of 2 pi / 3 a pixel.
    let phase = TAU / 3.0;
    let (sine, cosine) = (phase * x).sin_cos();
    let (sine_third, cosine_third) = (0.75f64.sqrt(), -0.5);
    let cosines =
        [cosine * cosine_third - sine * sine_third, cosine, cosine * cosine_third + sine * sine_third];
    // With t = x/3 + 1/2 the printed a0 - a1 cos 2 pi t + .. has all signs positive about the centre.
    let window = cosines.map(|c| {
        0.35875 + 0.48829 * c + 0.14128 * (2.0 * c * c - 1.0) + 0.01168 * (4.0 * c * c * c - 3.0 * c)
    });
    let offsets = [x + 1.0, x, x - 1.0];
    [0, 1, 2]
        .map(|i| [f64::from(u8::from(i == 1)), (1.0 - offsets[i].abs()).max(0.0), gaussian[i], window[i]])
}

/// Random numbers that have nothing to do with the renderer's: SplitMix64 (Steele et al. 2014).
struct SplitMix(u64);

impl SplitMix {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A point of the cell i of a grid of side x side cells over the unit square.
    fn in_cell(&mut self, i: u32, side: u32) -> [f64; 2] {
        [i % side, i / side].map(|cell| (f64::from(cell) + self.unit()) / f64::from(side))
    }
}

/// The true pictures of a scene, out of the cache if they are there.
///
/// # Errors
/// If the cache cannot be written.
pub fn cached(
    cache: &Path,
    cloud: &Cloud,
    camera: &Camera,
    options: &RenderOptions,
    side: u32,
    seed: u64,
) -> anyhow::Result<Truth> {
    let path = cache.join(format!("truth-{:016x}.f64", key(cloud, camera, options, side, seed)));
    let count = (camera.width * camera.height) as usize;
    if let Some(truth) = std::fs::read(&path).ok().and_then(|bytes| decode(&bytes, count)) {
        return Ok(truth);
    }
    let truth = Exact::new(cloud, camera, options).truth(side, seed);
    std::fs::create_dir_all(cache)?;
    let bytes: Vec<u8> =
        truth.pictures.iter().flatten().flatten().flat_map(|value| value.to_le_bytes()).collect();
    // Whole or not at all, also where two runs meet.
    let unfinished = path.with_extension(format!("{}", std::process::id()));
    std::fs::write(&unfinished, bytes)?;
    std::fs::rename(&unfinished, &path)?;
    Ok(truth)
}

fn decode(bytes: &[u8], count: usize) -> Option<Truth> {
    let (values, rest) = bytes.as_chunks::<8>();
    if !rest.is_empty() || values.len() != 4 * 4 * count {
        return None;
    }
    let values: Vec<f64> = values.iter().map(|&bytes| f64::from_le_bytes(bytes)).collect();
    let pictures = [0, 1, 2, 3].map(|i| values[4 * count * i..][..4 * count].as_chunks::<4>().0.to_vec());
    Some(Truth { pictures })
}

/// A hash (FNV-1a) of all that a true picture depends on.
fn key(cloud: &Cloud, camera: &Camera, options: &RenderOptions, side: u32, seed: u64) -> u64 {
    let RenderOptions { kernel, cutoff, resolve, thickness, cull, shading, .. } = options;
    let text = format!(
        "{VERSION} {camera:?} {kernel:?} {cutoff:?} {resolve:?} {thickness:?} {cull:?} {shading:?} {side} {seed} {cloud:?}"
    );
    text.bytes().fold(0xCBF2_9CE4_8422_2325, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01B3)
    })
}

#[cfg(test)]
#[path = "truth_tests.rs"]
mod tests;
