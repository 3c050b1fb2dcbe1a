//! Where a splat out of focus may be hit, sample by sample.
//!
//! Through one point of the lens a splat is a small sharp disc, however large its circle of confusion: what a pinhole sees of
//! it, moved by the lens point times its defocus.

use crate::lanes::Lanes;
use splat_core::setup::{BOX_PADDING, MAX_ERROR, USUAL_MARGIN, View, VisibleSplat};

/// What the images of all splats have in common.
#[derive(Debug, Clone, Copy)]
pub struct LensImages {
    near: f64,
    /// 1 / focus.
    inverse_focus: f64,
    /// sqrt(F).
    radius: f64,
    /// Radius of the pixel filter, in pixels.
    pub filter_radius: f64,
    /// Radius of the lens, in pixels at depth 1.
    pub lens_radius: f64,
}

impl LensImages {
    /// Those of a view; `None` without a lens, and if it distorts.
    pub fn new(view: &View) -> Option<Self> {
        let lens = view.lens.filter(|_| view.distortion.is_none())?;
        Some(Self {
            near: view.near,
            inverse_focus: 1.0 / lens.focus,
            radius: view.cutoff.sqrt(),
            filter_radius: view.filter_radius,
            lens_radius: lens.radius * view.pixel_scale.max_element(),
        })
    }

    /// The range of the defocus of most of some splats in splat order.
    pub fn defocus_range(&self, splats: &[VisibleSplat]) -> [f64; 2] {
        // A few strays would make it too large for the others.
        let strays = splats.len() / 64;
        let ends = [splats.get(strays), splats.iter().rev().nth(strays)];
        ends.map(|splat| splat.map_or(0.0, |splat| -f64::from(splat.constants.defocus)))
    }

    /// What a pinhole sees of a splat, and how far its depths are out of focus. `None` if that is not known.
    #[inline(always)]
    pub fn image(&self, splat: &VisibleSplat) -> Option<Image> {
        if !splat.outline.is_known() {
            return None;
        }
        // The ellipse of `splat_core::setup::Outline`, without the circle of confusion.
        let c = &splat.constants;
        let [a1, b0, b1, depth] = [c.a1, c.b[0], c.b[1], c.depth].map(f64::from);
        let (q, m) = (1.0 / a1, 1.0 / b0);
        let p = -b1 * q * m;
        let [s0, s1] = c.depth_slope.map(|slope| f64::from(slope) / depth);
        let radius = if splat.certain { self.radius * (1.0 + USUAL_MARGIN) } else { self.radius + MAX_ERROR };
        let square = radius * radius;
        let steepness = s0 * s0 + s1 * s1;
        let clearance = 1.0 - square * steepness;
        if clearance < 1.0 / 32.0 {
            return None;
        }
        let scale = square / clearance;
        let center = [-scale * (p * s0 + m * s1), -scale * q * s0];
        // The constants are rounded; that is little against the padding.
        let half = [scale * (p * p + m * m) + center[0] * center[0], scale * q * q + center[1] * center[1]]
            .map(|square| square.sqrt() * (1.0 + 1e-5) + BOX_PADDING);
        let middle = [f64::from(c.xf) + center[0], f64::from(c.yf) + center[1]];
        let half_depth = depth * radius * steepness.sqrt() * (1.0 + 1e-5);
        let nearest = (depth - half_depth).max(self.near) * (1.0 - 1e-4);
        let defocus = [nearest, (depth + half_depth) * (1.0 + 1e-5)].map(|w| self.inverse_focus - 1.0 / w);
        Some(Image {
            min: [middle[0] - half[0], middle[1] - half[1]],
            max: [middle[0] + half[0], middle[1] + half[1]],
            defocus,
        })
    }

    /// Where along an axis the samples are by which a splat may be hit.
    #[inline(always)]
    pub fn nearness(&self, image: &Image, axis: usize, splat: &VisibleSplat, corner: [i32; 2]) -> Nearness {
        let center = [splat.constants.xi, splat.constants.yi];
        let origin = f64::from(center[axis]) - f64::from(corner[axis]);
        let [near, far] = image.defocus;
        let defocus = image.defocus();
        let spread = self.lens_radius * 0.5 * (near - far).abs();
        let [middle, half] =
            [0.5 * (image.max[axis] + image.min[axis]) + origin, 0.5 * (image.max[axis] - image.min[axis])];
        // Some roundings of terms that may cancel: of a position, the product, their difference, and the ends.
        let terms = middle.abs() + half + self.lens_radius * defocus.abs() + 64.0;
        let rounding = 2.0 * f64::from(f32::EPSILON) * terms;
        let half = half + spread + rounding;
        Nearness { min: (middle - half) as f32, max: (middle + half) as f32, defocus: defocus as f32 }
    }

    /// How far samples that a splat may hit look past where they would, if its defocus were another, in pixels per axis.
    pub fn drift(&self, image: &Image, defocus: f64) -> f64 {
        let terms = self.lens_radius * (image.defocus().abs() + defocus.abs()) + 64.0;
        let rounding = 4.0 * f64::from(f32::EPSILON) * terms;
        self.lens_radius * (image.defocus() - defocus).abs() + rounding
    }
}

/// What a pinhole sees of a splat, and how far its depths are out of focus.
#[derive(Debug, Clone, Copy)]
pub struct Image {
    /// The least and the greatest place, in pixels relative to the splat's.
    pub min: [f64; 2],
    pub max: [f64; 2],
    /// 1/focus - 1/w at its nearest and farthest.
    pub defocus: [f64; 2],
}

impl Image {
    /// The middle of its defocus.
    pub fn defocus(&self) -> f64 {
        let [near, far] = self.defocus;
        0.5 * (near + far)
    }
}

/// What is near a splat along an axis: samples from `min` to `max`, plus lens point times `defocus`, in pixels from the tile's
/// first.
pub struct Nearness {
    /// Least.
    pub min: f32,
    /// Greatest.
    pub max: f32,
    defocus: f32,
}

impl Nearness {
    /// Where samples are near.
    #[inline(always)]
    pub fn is_near<L: Lanes>(&self, position: L, lens: L) -> L {
        let sharp = position - lens * L::splat(self.defocus);
        L::splat(self.min).less_or_equal(sharp) & sharp.less_or_equal(L::splat(self.max))
    }
}
