//! From the fragments of a sample to its colour: SPEC section 6, notes 2.3.

use crate::{Fragment, MAX_RANK, SplatSurface};

/// Layers lighter than this are dropped: a surface needs that much of its weight to be there at all.
pub const MIN_LAYER_WEIGHT: f32 = 1e-3;

/// `over` skips fragments fainter than this, one step of an 8-bit picture, as the trainers do.
pub const MIN_ALPHA: f32 = 1.0 / 255.0;

/// How the fragments of a sample become one colour.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Resolve {
    /// Fragments that overlap in depth are one surface; surfaces are composited front to back.
    Surface {
        /// How much of a sample a surface covers.
        coverage: Coverage,
        /// The depth interval of a fragment.
        thickness: Thickness,
    },
    /// Every fragment is a layer of its own (trained Gaussian splats).
    Over,
}

/// How much of a sample a surface covers, given the sum W of its weights.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Coverage {
    /// All of it if W >= 1/2, else nothing: silhouettes lie where the surface ends.
    Opaque,
    /// min(1, W / saturation).
    Soft {
        /// The W of full coverage; greater than 0.
        saturation: f32,
    },
}

/// The depth interval of a fragment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Thickness {
    /// depth +- min(ke * depth, cap), where `[ke, cap]` is [`SplatSurface::interval`].
    AroundHit,
    /// The listing's [zmin, zmax] (L128-133) of the whole splat, which is [`SplatSurface::interval`].
    /// It cannot merge noisy surfaces that are parallel to the picture: erratum E2.
    WholeSplat,
}

impl Thickness {
    /// The closed interval [near, far] of depths of a fragment.
    fn interval(self, fragment: &Fragment, surface: &SplatSurface) -> [f32; 2] {
        match self {
            Self::AroundHit => {
                let [slope, cap] = surface.interval;
                let half = (slope * fragment.depth).min(cap);
                [fragment.depth - half, fragment.depth + half]
            }
            Self::WholeSplat => surface.interval,
        }
    }
}

impl Coverage {
    /// The covered part of a sample, in [0, 1].
    fn of(self, weight: f32) -> f32 {
        match self {
            _ if weight < MIN_LAYER_WEIGHT => 0.0,
            Self::Opaque => f32::from(u8::from(weight >= 0.5)),
            Self::Soft { saturation } => (weight / saturation).min(1.0),
        }
    }
}

/// The colour of one sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SampleColor {
    /// Premultiplied colour.
    pub color: [f32; 3],
    /// What remains of the light from behind: 1 - alpha, in [0, 1].
    pub transmittance: f32,
    /// The same with every opacity taken as 1: 1 - coverage, in [0, 1].
    pub uncovered: f32,
}

impl SampleColor {
    /// That of a sample that hits nothing.
    pub const NOTHING: Self = Self { color: [0.0; 3], transmittance: 1.0, uncovered: 1.0 };
}

/// A surface (or, for `over`, a fragment) that takes part in a sample's colour.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Layer {
    number: u32,
    nearest: f32,
    back: bool,
    least_rank: u32,
    weight: f32,
    weight_opacity: f32,
    weight_opacity_color: [f32; 3],
}

impl Layer {
    fn new(number: u32, back: bool) -> Self {
        Self {
            number,
            nearest: f32::INFINITY,
            back,
            least_rank: u32::MAX,
            weight: 0.0,
            weight_opacity: 0.0,
            weight_opacity_color: [0.0; 3],
        }
    }

    /// Adds a fragment to the sums. Fragments must come in splat order: the sums are part of the contract.
    fn add(&mut self, fragment: &Fragment, surface: &SplatSurface) {
        self.nearest = self.nearest.min(fragment.depth);
        self.least_rank = self.least_rank.min(fragment.rank());
        let weight_opacity = fragment.weight * surface.opacity;
        self.weight += fragment.weight;
        self.weight_opacity += weight_opacity;
        for (sum, color) in self.weight_opacity_color.iter_mut().zip(surface.color) {
            *sum += weight_opacity * color;
        }
    }
}

/// A key that sorts fragments by facing, then by the near end of their interval: facing in bit 63, the near end's
/// bits, turned so that they sort as the numbers do, below it, and the fragment's number in the lowest 31.
fn near_end_key(back: bool, near: f32, number: usize) -> u64 {
    let bits = near.to_bits();
    let sortable = if bits >> 31 == 0 { bits | 1 << 31 } else { !bits };
    u64::from(back) << 63 | u64::from(sortable) << 31 | number as u64
}

/// Resolves one sample after the other; keeps its scratch memory between them.
#[derive(Debug)]
pub struct Resolver {
    mode: Resolve,
    intervals: Vec<[f32; 2]>,
    order: Vec<u64>,
    layer_of: Vec<u32>,
    layers: Vec<Layer>,
    visible: Option<usize>,
}

impl Resolver {
    /// A resolver of this mode.
    pub fn new(mode: Resolve) -> Self {
        Self { mode, intervals: vec![], order: vec![], layer_of: vec![], layers: vec![], visible: None }
    }

    /// Resolves the fragments of one sample, which it sorts into splat order. `surfaces` is indexed by rank.
    ///
    /// Every fragment must be [admitted](Fragment::is_admitted), and no two may share a rank.
    pub fn resolve(&mut self, fragments: &mut [Fragment], surfaces: &[SplatSurface]) -> SampleColor {
        self.resolve_with(fragments, |fragment| surfaces[fragment.rank() as usize])
    }

    /// The same, where `surface_of` gives what a fragment's splat shares among its fragments (of this sample at least).
    pub fn resolve_with(
        &mut self,
        fragments: &mut [Fragment],
        surface_of: impl Fn(&Fragment) -> SplatSurface,
    ) -> SampleColor {
        fragments.sort_unstable_by_key(Fragment::rank);
        match self.mode {
            Resolve::Surface { coverage, thickness } => {
                self.find_layers(fragments, &surface_of, thickness);
                self.sum_layers(fragments, &surface_of);
                self.layers.retain(|layer| coverage.of(layer.weight) > 0.0);
                self.layers.sort_unstable_by(|a, b| {
                    let nearer = a.nearest.total_cmp(&b.nearest);
                    nearer.then(a.back.cmp(&b.back)).then(a.least_rank.cmp(&b.least_rank))
                });
                self.composite(|layer| {
                    // The quotients are written out: a product with a reciprocal can stop short of 1, and an
                    // opaque layer would let light through.
                    (coverage.of(layer.weight), layer.weight_opacity / layer.weight)
                })
            }
            Resolve::Over => {
                self.one_layer_each(fragments, &surface_of);
                self.composite(|layer| (1.0, layer.weight_opacity))
            }
        }
    }

    /// The layers that made the last sample, front to back.
    pub fn layers(&self) -> &[Layer] {
        &self.layers
    }

    /// The layer at which the last sample's transmittance fell to 1/2 or less.
    pub fn visible_layer(&self) -> Option<&Layer> {
        self.visible.map(|index| &self.layers[index])
    }

    /// The fragments of a layer of the last sample, in splat order, out of the fragments given for it.
    pub fn fragments_of<'a>(
        &'a self,
        layer: &'a Layer,
        fragments: &'a [Fragment],
    ) -> impl Iterator<Item = &'a Fragment> {
        let members = self.layer_of.iter().zip(fragments);
        members.filter_map(|(&number, fragment)| (number == layer.number).then_some(fragment))
    }

    /// Numbers the layers: the connected components, facing by facing, of the graph of overlapping intervals.
    fn find_layers(
        &mut self,
        fragments: &[Fragment],
        surface_of: impl Fn(&Fragment) -> SplatSurface,
        thickness: Thickness,
    ) {
        self.intervals.clear();
        self.intervals.extend(fragments.iter().map(|f| thickness.interval(f, &surface_of(f))));
        self.order.clear();
        let keys = self.intervals.iter().zip(fragments).enumerate();
        self.order.extend(keys.map(|(i, (&[near, _], fragment))| near_end_key(fragment.is_back(), near, i)));
        self.order.sort_unstable();

        self.layers.clear();
        self.layer_of.clear();
        self.layer_of.resize(fragments.len(), 0);
        let mut far_end = f32::NEG_INFINITY;
        for &key in &self.order {
            let i = (key & u64::from(MAX_RANK)) as usize;
            let back = fragments[i].is_back();
            let [near, far] = self.intervals[i];
            let open = self.layers.last().is_some_and(|layer| layer.back == back && near <= far_end);
            if open {
                far_end = far_end.max(far);
            } else {
                self.layers.push(Layer::new(self.layers.len() as u32, back));
                far_end = far;
            }
            self.layer_of[i] = self.layers.len() as u32 - 1;
        }
    }

    /// Sums each layer's fragments in splat order, with one accumulator.
    fn sum_layers(&mut self, fragments: &[Fragment], surface_of: impl Fn(&Fragment) -> SplatSurface) {
        for (fragment, &number) in fragments.iter().zip(&self.layer_of) {
            self.layers[number as usize].add(fragment, &surface_of(fragment));
        }
    }

    /// `over`: a layer for each fragment that can be seen, nearest first.
    fn one_layer_each(&mut self, fragments: &[Fragment], surface_of: impl Fn(&Fragment) -> SplatSurface) {
        self.layer_of.clear();
        self.layer_of.extend(0..fragments.len() as u32);
        // By depth; fragments come in splat order, so their number decides as their rank would.
        self.order.clear();
        let keys = fragments.iter().enumerate();
        self.order.extend(keys.map(|(i, fragment)| near_end_key(false, fragment.depth, i)));
        self.order.sort_unstable();
        self.layers.clear();
        for &key in &self.order {
            let number = (key & u64::from(MAX_RANK)) as usize;
            let fragment = &fragments[number];
            let mut layer = Layer::new(number as u32, fragment.is_back());
            layer.add(fragment, &surface_of(fragment));
            if layer.weight_opacity >= MIN_ALPHA {
                self.layers.push(layer);
            }
        }
    }

    /// Lays the sorted layers over each other, front to back. `cover` gives a layer's coverage and opacity.
    fn composite(&mut self, cover: impl Fn(&Layer) -> (f32, f32)) -> SampleColor {
        let mut sample = SampleColor::NOTHING;
        self.visible = None;
        for (index, layer) in self.layers.iter().enumerate() {
            let (coverage, opacity) = cover(layer);
            let alpha = (coverage * opacity).min(1.0);
            if layer.weight_opacity > 0.0 {
                for (sum, color) in sample.color.iter_mut().zip(layer.weight_opacity_color) {
                    *sum += sample.transmittance * alpha * (color / layer.weight_opacity);
                }
            }
            sample.transmittance *= 1.0 - alpha;
            sample.uncovered *= 1.0 - coverage;
            if self.visible.is_none() && sample.transmittance <= 0.5 {
                self.visible = Some(index);
            }
        }
        sample
    }
}
