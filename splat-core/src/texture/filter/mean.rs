//! Weighted means of texels.

/// The mean colour that a lookup finds, and what it took.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Average {
    /// The mean, linear; channels that the texture does not have are 0.
    pub color: [f32; 4],
    /// How many texels (or entries of a summed-area table) were read: the lookup's cost.
    pub texels: u32,
}

/// The same in `f64`: sums of the largest `f32` do not overflow.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Mean {
    pub color: [f64; 4],
    pub texels: u32,
}

impl Mean {
    /// `(1 - t) self + t other`, t in [0, 1].
    pub fn mix(self, other: Self, t: f64) -> Self {
        let color = std::array::from_fn(|i| (1.0 - t) * self.color[i] + t * other.color[i]);
        Self { color, texels: self.texels + other.texels }
    }

    pub fn rounded(self) -> Average {
        Average { color: self.color.map(|value| value as f32), texels: self.texels }
    }
}

/// A weighted sum under way.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct WeightedSum {
    sum: [f64; 4],
    weight: f64,
    texels: u32,
}

impl WeightedSum {
    #[inline]
    pub fn add_texel(&mut self, texel: [f32; 4], weight: f64) {
        self.add(Mean { color: texel.map(f64::from), texels: 1 }, weight);
    }

    #[inline]
    pub fn add(&mut self, mean: Mean, weight: f64) {
        for (sum, value) in self.sum.iter_mut().zip(mean.color) {
            *sum += weight * value;
        }
        self.weight += weight;
        self.texels += mean.texels;
    }

    /// The mean, if any weight was added.
    pub fn mean(self) -> Option<Mean> {
        let color = self.sum.map(|sum| sum / self.weight);
        (self.weight > 0.0).then_some(Mean { color, texels: self.texels })
    }
}
