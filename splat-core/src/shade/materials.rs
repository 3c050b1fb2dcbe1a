//! Which splats have which material.

use super::Material;
use crate::texture::ImageTexture;

/// The materials of a cloud: one for all splats, or one for each of several runs of them, as where clouds are joined.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Materials {
    runs: Vec<Run>,
}

/// Splats of one material, from where the previous run ends.
#[derive(Debug, Clone, PartialEq)]
struct Run {
    /// Index of the first splat after the run.
    end: usize,
    material: Material,
}

static PLAIN: Material = Material::PLAIN;

impl From<Material> for Materials {
    fn from(material: Material) -> Self {
        Self::of_runs([(usize::MAX, material)])
    }
}

impl Materials {
    /// Materials of runs of splats, in the order of the cloud: how many splats, and what they are made of. Splats after
    /// the last run are plain.
    pub fn of_runs(runs: impl IntoIterator<Item = (usize, Material)>) -> Self {
        let mut end: usize = 0;
        let runs = runs.into_iter().map(|(count, material)| {
            end = end.saturating_add(count);
            Run { end, material }
        });
        Self { runs: runs.collect() }
    }

    /// The material of the splat with this index in the cloud.
    #[inline]
    pub fn of(&self, index: usize) -> &Material {
        let run = match &self.runs[..] {
            [] => None,
            [only] if index < only.end => Some(only),
            runs => runs.get(runs.partition_point(|run| run.end <= index)),
        };
        run.map_or(&PLAIN, |run| &run.material)
    }

    /// All of them.
    pub fn iter(&self) -> impl Iterator<Item = &Material> {
        self.runs.iter().map(|run| &run.material)
    }

    /// Whether there is nothing but the cloud's colours.
    pub fn is_plain(&self) -> bool {
        self.iter().all(Material::is_plain)
    }

    /// Whether some splat's colour differs from pixel to pixel.
    pub fn varies_by_pixel(&self) -> bool {
        self.iter().any(Material::varies_by_pixel)
    }

    /// The only image that decides what colour any splat has, if that is so.
    pub fn image(&self) -> Option<&ImageTexture> {
        match &self.runs[..] {
            [only] if only.end == usize::MAX => only.material.image(),
            _ => None,
        }
    }

    /// All images.
    pub fn images(&self) -> Vec<&ImageTexture> {
        self.iter().flat_map(Material::images).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::super::Detail;
    use super::*;
    use crate::texture::Texture;
    use std::sync::Arc;

    #[test]
    fn runs_follow_each_other() {
        let textured = |value| Material {
            texture: Some(Arc::new(Texture::Constant([value; 3]))),
            ..Material::default()
        };
        let [a, b] = [textured(0.25), Material { detail: Detail::Splat, ..textured(0.5) }];
        let materials = Materials::of_runs([
            (2, a.clone()),
            (0, Material::default()),
            (3, b.clone()),
            (1, Material::default()),
        ]);
        let expected = [&a, &a, &b, &b, &b, &PLAIN, &PLAIN, &PLAIN];
        for (index, expected) in expected.into_iter().enumerate() {
            assert_eq!(materials.of(index), expected, "{index}");
        }
        assert!(!materials.is_plain() && materials.varies_by_pixel());
        assert!(!Materials::of_runs([(2, b.clone())]).varies_by_pixel());
        assert_eq!(Materials::from(b.clone()).of(1 << 40), &b);
        assert!(Materials::default().is_plain() && Materials::default().of(0).is_plain());
    }
}
