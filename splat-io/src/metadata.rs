//! What a picture file says about how it was made.

use glam::DMat4;
use splat_core::PixelRect;
use std::ops::Range;

/// How a picture was made. Every field is optional; what is `None` is not written.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Metadata {
    /// The program and its version.
    pub software: Option<String>,
    /// World to camera space, for column vectors, as [`splat_core::Camera::world_to_camera`].
    pub world_to_camera: Option<DMat4>,
    /// Samples a pixel.
    pub samples: Option<u32>,
    /// The samples that were rendered, if not all.
    pub sample_range: Option<Range<u32>>,
    /// Seed of the sample patterns.
    pub seed: Option<u64>,
    /// The renderer: "reference" or "fast".
    pub engine: Option<String>,
    /// The options, as text.
    pub options: Option<String>,
    /// Pixels an inch of a print, across and down.
    pub pixels_per_inch: Option<f64>,
    /// SHA-256 of the inputs, in hexadecimal.
    pub input_hash: Option<String>,
    /// The camera, as our JSON has it: [`crate::camera_json`].
    pub camera: Option<String>,
    /// The pixels of the frame that were rendered, if not all; EXR files say so by their data window.
    pub crop: Option<PixelRect>,
}

impl Metadata {
    /// What is known, as texts by name, the camera with all its digits; `software` and `options` have names by format.
    pub(crate) fn texts(&self, software: &'static str, options: &'static str) -> Vec<(&'static str, String)> {
        let texts = [
            (software, self.software.clone()),
            (options, self.options.clone()),
            ("worldToCamera", self.world_to_camera.as_ref().map(Self::matrix_text)),
            ("samples", self.samples.map(|samples| samples.to_string())),
            ("sampleRange", self.sample_range.as_ref().map(|range| format!("{}:{}", range.start, range.end))),
            ("seed", self.seed.map(|seed| seed.to_string())),
            ("engine", self.engine.clone()),
            ("inputHash", self.input_hash.clone()),
            ("camera", self.camera.clone()),
            ("crop", self.crop.map(|PixelRect { x0, y0, x1, y1 }| format!("{x0},{y0},{x1},{y1}"))),
        ];
        texts.into_iter().filter_map(|(name, text)| Some((name, text?))).collect()
    }

    /// The matrix as text: its rows, as the camera JSON lists them, with all digits.
    pub(crate) fn matrix_text(matrix: &DMat4) -> String {
        let row = |row: usize| matrix.row(row).to_array().map(|value| value.to_string()).join(", ");
        let rows: Vec<_> = (0..4).map(|index| format!("[{}]", row(index))).collect();
        format!("[{}]", rows.join(", "))
    }
}
