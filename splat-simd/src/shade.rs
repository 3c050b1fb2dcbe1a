//! Colours that differ from pixel to pixel: those of a tile's splats, for one pixel at a time.

use crate::records::RecordBuffer;
use splat_core::setup::VisibleSplat;
use splat_core::shade::{ShadedSplat, SplatShader};

/// The shader of a tile.
#[derive(Debug)]
pub struct TileShader<'a> {
    shader: SplatShader<'a>,
    /// All splats, by rank.
    splats: &'a [VisibleSplat],
    /// By the splat's number in the tile, once it was needed: how it is shaded, if it is.
    prepared: Vec<Option<Option<Box<ShadedSplat>>>>,
    /// By the same number: the place that it was shaded for last.
    shaded_for: Vec<u16>,
}

/// No place.
const NOWHERE: u16 = u16::MAX;

impl<'a> TileShader<'a> {
    /// The shader of a tile of a frame with these splats.
    pub fn new(shader: SplatShader<'a>, splats: &'a [VisibleSplat]) -> Self {
        Self { shader, splats, prepared: Vec::new(), shaded_for: Vec::new() }
    }

    /// Gives the splats that have records in some cells of a pixel their colours there. `place` is the pixel's in its tile.
    pub fn shade(
        &mut self,
        buffer: &mut RecordBuffer,
        cells: impl Iterator<Item = usize>,
        place: u16,
        x: i32,
        y: i32,
    ) {
        self.prepared.resize_with(buffer.splats(), || None);
        self.shaded_for.resize(buffer.splats(), NOWHERE);
        for cell in cells {
            buffer.recolor(cell, |number, rank| {
                if std::mem::replace(&mut self.shaded_for[number], place) == place {
                    return None;
                }
                let index = self.splats[rank as usize].index as usize;
                let prepared = self.prepared[number].get_or_insert_with(|| {
                    self.shader.splat(index).filter(|splat| !splat.is_whole()).map(Box::new)
                });
                prepared.as_ref().map(|splat| self.shader.shade(splat, x, y).color)
            });
        }
    }
}
