//! Colours that differ from pixel to pixel: those of a tile's splats, for one pixel at a time.

use crate::lanes::Level;
use crate::records::RecordBuffer;
use crate::texture::{LanePyramid, LaneSampler, Lookup};
use glam::Vec2;
use splat_core::setup::VisibleSplat;
use splat_core::shade::{Materials, ShadedSplat, Sight, SplatShader};
use splat_core::texture::filter::Average;
use splat_core::texture::{Filter, Footprint, ImageLookup, ImageTexture, Pyramid, ScalarLookup};
use std::sync::Arc;

/// The images of a picture's materials, ready for lanes.
#[derive(Debug)]
pub struct LaneImages {
    level: Level,
    images: Vec<(Arc<Pyramid>, LanePyramid)>,
}

impl LaneImages {
    /// No images.
    pub fn new(level: Level) -> Self {
        Self { level, images: Vec::new() }
    }

    /// Makes ready the images of materials, those that are not, and forgets all others.
    pub fn set(&mut self, material: &Materials) {
        let mut wanted = material.images();
        // The printed filter is not for lanes.
        wanted.retain(|image| image.sampler.filter != Filter::EwaPrinted);
        self.images.retain(|(known, _)| wanted.iter().any(|image| Arc::ptr_eq(&image.pyramid, known)));
        for image in wanted {
            if self.of(image).is_none() {
                self.images.push((image.pyramid.clone(), LanePyramid::new(&image.pyramid)));
            }
        }
    }

    /// The image for lanes, if there is one.
    fn of(&self, image: &ImageTexture) -> Option<&LanePyramid> {
        let is_printed = image.sampler.filter == Filter::EwaPrinted;
        let mut known = self.images.iter().filter(|(known, _)| Arc::ptr_eq(&image.pyramid, known));
        known.next().map(|(_, pyramid)| pyramid).filter(|_| !is_printed)
    }
}

impl ImageLookup for LaneImages {
    fn lookup(&self, image: &ImageTexture, st: Vec2, footprint: &Footprint) -> [f32; 4] {
        match self.of(image) {
            Some(pyramid) => LaneSampler::new(&image.sampler).lookup(self.level, pyramid, st, footprint),
            None => ScalarLookup.lookup(image, st, footprint),
        }
    }
}

/// The shader of a tile.
#[derive(Debug)]
pub struct TileShader<'a> {
    shader: SplatShader<'a>,
    /// All splats, by rank.
    splats: &'a [VisibleSplat],
    /// If one image decides all colours, and can be looked up by lanes.
    image: Option<LaneImage<'a>>,
    /// By the splat's number in the tile, once it was needed: how it is shaded, if it is.
    prepared: Vec<Option<Option<Box<ShadedSplat>>>>,
    /// By the same number: the place that it was shaded for last.
    shaded_for: Vec<u16>,
    /// The splats to be shaded for a pixel, and what it sees of them.
    sights: Vec<(usize, Sight)>,
    lookups: Vec<Lookup>,
    found: Vec<Average>,
}

/// The image that decides all colours.
#[derive(Debug, Clone, Copy)]
struct LaneImage<'a> {
    image: &'a ImageTexture,
    pyramid: &'a LanePyramid,
    sampler: LaneSampler,
    level: Level,
}

/// No place.
const NOWHERE: u16 = u16::MAX;

impl<'a> TileShader<'a> {
    /// The shader of a tile of a frame with these splats.
    pub fn new(
        shader: SplatShader<'a>,
        splats: &'a [VisibleSplat],
        material: &'a Materials,
        images: &'a LaneImages,
    ) -> Self {
        let image = material.image().and_then(|image| {
            let sampler = LaneSampler::new(&image.sampler);
            images.of(image).map(|pyramid| LaneImage { image, pyramid, sampler, level: images.level })
        });
        Self {
            shader,
            splats,
            image,
            prepared: Vec::new(),
            shaded_for: Vec::new(),
            sights: Vec::new(),
            lookups: Vec::new(),
            found: Vec::new(),
        }
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
        self.sights.clear();
        for cell in cells {
            for (number, rank) in buffer.splats_of(cell) {
                if std::mem::replace(&mut self.shaded_for[number], place) != place {
                    self.see(number, rank, x, y);
                }
            }
        }
        match self.image {
            Some(image) => self.look_up(&image, buffer),
            None => {
                for (number, sight) in &self.sights {
                    if let Some(Some(splat)) = &self.prepared[*number] {
                        buffer.recolor(*number, self.shader.shaded(splat, sight).color);
                    }
                }
            }
        }
    }

    /// Notes what the pixel sees of a splat, if it has a colour of its own there.
    fn see(&mut self, number: usize, rank: u32, x: i32, y: i32) {
        let index = self.splats[rank as usize].index as usize;
        let prepared =
            self.prepared[number].get_or_insert_with(|| self.shader.splat_by_pixel(index).map(Box::new));
        if let Some(splat) = prepared {
            self.sights.push((number, self.shader.sight(splat, x, y)));
        }
    }

    /// Shades by one image, looked up for all splats of the pixel at once.
    fn look_up(
        &mut self,
        LaneImage { image, pyramid, sampler, level }: &LaneImage<'_>,
        buffer: &mut RecordBuffer,
    ) {
        self.lookups.clear();
        self.lookups.extend(self.sights.iter().map(|(_, sight)| {
            let (st, footprint) = image.place(sight.image_point());
            Lookup { st, footprint }
        }));
        self.found.resize(self.lookups.len(), Average::default());
        sampler.lookups(*level, pyramid, &self.lookups, &mut self.found);
        for ((number, sight), average) in self.sights.iter().zip(&self.found) {
            if let Some(Some(splat)) = &self.prepared[*number] {
                let seen = image.color_of(average.color);
                buffer.recolor(*number, self.shader.color_by_image(splat, sight, seen));
            }
        }
    }
}
