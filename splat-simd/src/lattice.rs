//! Large circles of confusion: cells of samples that share their place on the lens, not on the picture.
//!
//! Through one point of the lens a splat is a small sharp disc, however large its circle of confusion. As the table of
//! lens patterns holds each pattern once in every block of 8 x 8 pixels, the samples of one lens point are a lattice
//! of spacing 8, and of eight neighbouring lens points (a *group*) each block has one sample each: a cell. So a splat
//! looks, for every group, only at the blocks in which its disc lies, about one: the work does not grow with the blur.

use crate::lanes::{Eight, LANES, Lanes};
use crate::lens_image::{Image, LensImages, Nearness};
use crate::places::{Apart, PLACES, TILE, place_of};
use splat_core::PixelRect;
use splat_core::raster::Rasterizer;
use splat_core::sampling::{BLOCK, PATTERNS, SampleTable};
use splat_core::setup::{BOX_PADDING, VisibleSplat};

/// Blocks a side of a tile.
const BLOCKS: usize = TILE as usize / BLOCK;

/// A sample of a block: its lens pattern and its number.
#[derive(Debug, Clone, Copy, Default)]
struct LensSample {
    pattern: usize,
    sample: usize,
    lens: [f32; 2],
}

/// The samples of a cell.
#[derive(Debug, Clone, Copy)]
struct Cell {
    /// Column and row in the tile.
    pixel: [Eight; 2],
    /// Position relative to the pixel's corner.
    jitter: [Eight; 2],
}

/// A list of cells, by their numbers.
#[derive(Debug, Default)]
pub struct CellList {
    /// The first `count` are in use.
    cells: Vec<u32>,
    count: usize,
    /// Scratch: cells whose blocks are reached.
    reached: Vec<u32>,
}

impl CellList {
    /// The cells.
    #[inline(always)]
    pub fn cells(&self) -> &[u32] {
        &self.cells[..self.count]
    }

    /// Makes room for this many cells.
    #[inline(always)]
    fn reserve(&mut self, cells: usize) {
        // More are written than kept.
        if self.cells.len() <= cells {
            self.cells.resize(cells + 1, 0);
            self.reached.resize(cells + BLOCKS * BLOCKS, 0);
        }
    }
}

/// Some blocks of a tile, the first `count` of `blocks`: those of some neighbouring columns and rows.
#[derive(Debug, Clone, Copy)]
struct BlockRange {
    count: u32,
    blocks: [u8; BLOCKS * BLOCKS],
}

/// The number of an empty range.
const NO_BLOCKS: usize = BLOCKS - 1;

/// Those from a column and a row (in bits 0 and 1, and 2 and 3) to others (in bits 4 and 5, 6 and 7).
const BLOCK_RANGES: [BlockRange; 256] = {
    let mut ranges = [BlockRange { count: 0, blocks: [0; BLOCKS * BLOCKS] }; 256];
    let mut number = 0;
    while number < ranges.len() {
        let [first_column, first_row, last_column, last_row] =
            [number & 3, number >> 2 & 3, number >> 4 & 3, number >> 6];
        let range = &mut ranges[number];
        let mut block = 0;
        while block < BLOCKS * BLOCKS {
            let [column, row] = [block % BLOCKS, block / BLOCKS];
            if first_column <= column && column <= last_column && first_row <= row && row <= last_row {
                range.blocks[range.count as usize] = block as u8;
                range.count += 1;
            }
            block += 1;
        }
        number += 1;
    }
    ranges
};

/// The samples of a frame, by groups of lens points.
#[derive(Debug)]
pub struct Lattice {
    /// Lens points of each group.
    lens: Vec<[Eight; 2]>,
    /// For eight groups at a time their boxes on the lens: middle and half the length in x, and in y.
    boxes: Vec<[Eight; 4]>,
    /// Group by group, of each block.
    cells: Vec<Cell>,
    /// The same: where in the tile the samples are, to rounding.
    positions: Vec<[Eight; 2]>,
    /// The same: place and number (from the first that is taken) of each sample.
    samples: Vec<[(u16, u32); LANES]>,
    /// For each place, the cell and the lane of each of its samples.
    cell_of: Vec<(u32, u8)>,
    /// Number of samples a pixel.
    count: usize,
    images: LensImages,
    /// Mean side of the groups' boxes on the lens, in pixels at depth 1.
    group_size: f64,
}

impl Lattice {
    /// The lattice of a frame with a lens that does not distort.
    pub fn new(rasterizer: &Rasterizer, images: LensImages) -> Self {
        let range = rasterizer.range();
        let table = rasterizer.samples();
        let mut points: Vec<LensSample> = (0..PATTERNS)
            .flat_map(|pattern| {
                let points = table.lens_of_pattern(pattern);
                range.clone().map(move |sample| LensSample { pattern, sample, lens: points[sample].p })
            })
            .collect();
        gather_neighbors(&mut points);
        let groups: Vec<&[LensSample; LANES]> = points.as_chunks().0.iter().collect();
        let boxes = groups.as_chunks().0.iter().map(boxes_of).collect::<Vec<_>>();
        let mut lattice = Self {
            lens: groups.iter().map(|group| [0, 1].map(|axis| group.map(|point| point.lens[axis]))).collect(),
            group_size: mean_size(&boxes),
            boxes,
            cells: Vec::new(),
            positions: Vec::new(),
            samples: Vec::new(),
            cell_of: vec![(0, 0); PLACES * range.len()],
            count: range.len(),
            images,
        };
        let pixels: [_; BLOCKS * BLOCKS] = std::array::from_fn(|block| pixels_of_patterns(table, block));
        for group in groups {
            for pixel_of in &pixels {
                lattice.add_cell(group, group.map(|point| pixel_of[point.pattern]), rasterizer);
            }
        }
        lattice
    }

    /// Adds the cell of a group that lies in these pixels of a tile.
    fn add_cell(&mut self, group: &[LensSample; LANES], pixels: [[i32; 2]; LANES], rasterizer: &Rasterizer) {
        let table = rasterizer.samples();
        let number = self.cells.len() as u32;
        let jitter: [[f32; 2]; LANES] = std::array::from_fn(|lane| {
            let [x, y] = pixels[lane];
            table.jitter(x, y)[group[lane].sample]
        });
        let cell = Cell {
            pixel: [0, 1].map(|axis| pixels.map(|pixel| pixel[axis] as f32)),
            jitter: [0, 1].map(|axis| jitter.map(|jitter| jitter[axis])),
        };
        let position = |axis: usize, lane: usize| cell.pixel[axis][lane] + cell.jitter[axis][lane];
        self.positions.push([0, 1].map(|axis| std::array::from_fn(|lane| position(axis, lane))));
        self.cells.push(cell);
        let first = rasterizer.range().start;
        let samples = std::array::from_fn(|lane| {
            let [x, y] = pixels[lane];
            (place_of(x, y), (group[lane].sample - first) as u32)
        });
        for (lane, &(place, sample)) in samples.iter().enumerate() {
            self.cell_of[usize::from(place) * self.count + sample as usize] = (number, lane as u8);
        }
        self.samples.push(samples);
    }

    /// Number of cells of a tile.
    pub fn cells(&self) -> usize {
        self.cells.len()
    }

    /// The place and the number of each sample of a cell.
    #[inline(always)]
    pub fn samples(&self, cell: usize) -> &[(u16, u32); LANES] {
        &self.samples[cell]
    }

    /// The cell and the lane of a sample of a place.
    pub fn cell_of(&self, place: u16, sample: usize) -> (usize, usize) {
        let (cell, lane) = self.cell_of[usize::from(place) * self.count + sample];
        (cell as usize, usize::from(lane))
    }

    /// Whether a splat has less to test here than pixel by pixel, by an estimate; and by how many cells.
    pub fn gain(&self, splat: &VisibleSplat, region: &PixelRect) -> f64 {
        let Some(image) = self.images.image(splat) else { return 0.0 };
        let blur = self.images.lens_radius * image.defocus.map(f64::abs).into_iter().fold(0.0, f64::max);
        let [width, height] =
            [0, 1].map(|axis| image.max[axis] - image.min[axis] + 2.0 * self.images.filter_radius);
        let share = splat.bounds.intersect(region).area() as f64 / splat.bounds.area() as f64;
        let by_pixels =
            0.8 * (width + 2.0 * blur) * (height + 2.0 * blur) * (self.count as f64 / LANES as f64);
        let group = self.group_size / self.images.lens_radius * blur;
        let blocks = |side: f64| 1.0 + (side + group) / BLOCK as f64;
        let groups = self.lens.len() as f64;
        // Each group's box takes about as long as a cell's eighth in every tile that the splat may touch.
        share * (by_pixels - groups * blocks(width) * blocks(height)) - groups / LANES as f64
    }

    /// Lists the cells of a tile (given by its first pixel) in which a splat may be hit.
    #[inline(always)]
    pub fn list<L: Lanes>(&self, splat: &VisibleSplat, corner: [i32; 2], list: &mut CellList) {
        list.reserve(self.cells.len());
        if let Some(image) = &self.images.image(splat) {
            let reach = [0, 1].map(|axis| self.reach(image, axis, splat, corner));
            let count = self.list_reached::<L>(&reach, &mut list.reached);
            let near = [0, 1].map(|axis| self.images.nearness(image, axis, splat, corner));
            self.keep_near::<L>(&near, count, list);
        } else {
            list.count = self.cells.len();
            list.cells.iter_mut().zip(0..self.cells.len() as u32).for_each(|(cell, number)| *cell = number);
        }
    }

    /// Lists the cells whose blocks a splat reaches. Returns their number.
    #[inline(always)]
    fn list_reached<L: Lanes>(&self, [x, y]: &[Reach; 2], list: &mut [u32]) -> usize {
        let mut count = 0;
        for (eight, boxes) in self.boxes.iter().enumerate() {
            let (columns, column_range) = x.blocks::<L>(&boxes[0], &boxes[1]);
            let (rows, row_range) = y.blocks::<L>(&boxes[2], &boxes[3]);
            let reached = columns & rows;
            if reached.bits() == 0 {
                continue;
            }
            let ranges = column_range + row_range * L::splat(BLOCKS as f32);
            let ranges = reached.select(ranges, L::splat(NO_BLOCKS as f32)).whole();
            for (lane, range) in ranges.into_iter().enumerate() {
                let range = &BLOCK_RANGES[range as usize % BLOCK_RANGES.len()];
                let first = ((eight * LANES + lane) * BLOCKS * BLOCKS) as u32;
                // As many as there can be, without a branch; the next ones overwrite those that are too many.
                if let Some(room) = list.get_mut(count..count + BLOCKS * BLOCKS) {
                    for (cell, &block) in room.iter_mut().zip(&range.blocks) {
                        *cell = first + u32::from(block);
                    }
                }
                count += range.count as usize;
            }
        }
        count
    }

    /// Keeps of the first `count` reached cells of a list those of which a sample is near a splat.
    #[inline(always)]
    fn keep_near<L: Lanes>(&self, [x, y]: &[Nearness; 2], count: usize, list: &mut CellList) {
        let (lenses, positions) = (self.lens.as_slice(), self.positions.as_slice());
        let (reached, cells) = (&list.reached[..count], list.cells.as_mut_slice());
        let mut kept = 0;
        for &cell in reached {
            let [lens_x, lens_y] = &lenses[cell as usize / (BLOCKS * BLOCKS)];
            let [position_x, position_y] = &positions[cell as usize];
            let near = x.is_near(L::load(position_x), L::load(lens_x))
                & y.is_near(L::load(position_y), L::load(lens_y));
            // Written in any case: which is kept cannot be foreseen.
            cells[kept] = cell;
            kept += usize::from(near.bits() as u8 != 0);
        }
        list.count = kept;
    }

    /// How far a splat reaches along an axis, for [`Reach::blocks`].
    #[inline(always)]
    fn reach(&self, image: &Image, axis: usize, splat: &VisibleSplat, corner: [i32; 2]) -> Reach {
        let room = self.images.filter_radius + BOX_PADDING + 0.5;
        let center = [splat.constants.xi, splat.constants.yi];
        let origin = f64::from(center[axis]) - f64::from(corner[axis]);
        let [near, far] = image.defocus;
        let in_blocks = |pixels: f64| (pixels / BLOCK as f64) as f32;
        Reach {
            min: in_blocks(image.min[axis] - room + origin),
            max: in_blocks(image.max[axis] + room + origin),
            defocus: in_blocks(0.5 * (near + far)),
            spread: in_blocks(0.5 * (near - far).abs()),
        }
    }

    /// Offset of a cell's samples from a splat, as the reference has it, and their lens points. `apart` is that of the
    /// tile's first pixel.
    #[inline(always)]
    pub fn offset<L: Lanes>(&self, cell: u32, apart: &Apart<L>, minus_fraction: &[L; 2]) -> ([L; 2], [L; 2]) {
        let Cell { pixel, jitter } = &self.cells[cell as usize];
        let lens = &self.lens[cell as usize / (BLOCKS * BLOCKS)];
        let whole = apart.to([L::load(&pixel[0]), L::load(&pixel[1])]);
        (
            [
                whole[0] + (L::load(&jitter[0]) + minus_fraction[0]),
                whole[1] + (L::load(&jitter[1]) + minus_fraction[1]),
            ],
            [L::load(&lens[0]), L::load(&lens[1])],
        )
    }

    /// Column and row in the tile of a cell's samples.
    #[inline(always)]
    pub fn pixels<L: Lanes>(&self, cell: u32) -> [L; 2] {
        let Cell { pixel, .. } = &self.cells[cell as usize];
        [L::load(&pixel[0]), L::load(&pixel[1])]
    }
}

/// How far a splat reaches along an axis, in blocks from the tile's first.
struct Reach {
    /// The pinhole's image, widened by the pixel filter.
    min: f32,
    max: f32,
    /// 1/focus - 1/w, times blocks a pixel: the middle of its range, and half of its length.
    defocus: f32,
    spread: f32,
}

impl Reach {
    /// Whether a splat reaches any blocks through each of eight groups of lens points, given the middle and half the length of
    /// their boxes; and the first, plus 16 times the last.
    #[inline(always)]
    fn blocks<L: Lanes>(&self, middle: &Eight, half: &Eight) -> (L, L) {
        let (middle, half) = (L::load(middle), L::load(half));
        let (defocus, spread) = (L::splat(self.defocus), L::splat(self.spread));
        let shift = middle * defocus;
        let (zero, last) = (L::splat(0.0), L::splat((BLOCKS - 1) as f32));
        // (m +- h)(d +- s) lies within |m| s + h (|d| + s) of m d.
        let around = magnitude(middle) * spread + half * L::splat(self.defocus.abs() + self.spread);
        let low = L::splat(self.min) + shift - around;
        let high = L::splat(self.max) + shift + around;
        let reached = low.less(last + L::splat(1.0)) & zero.less_or_equal(high);
        (reached, low.greatest(zero).round_down() + high.least(last).round_down() * L::splat(16.0))
    }
}

/// The numbers without their signs.
#[inline(always)]
fn magnitude<L: Lanes>(numbers: L) -> L {
    numbers.greatest(L::splat(0.0) - numbers)
}

/// The pixel of a tile, in one of its blocks, in which each lens pattern stands.
fn pixels_of_patterns(table: &SampleTable, block: usize) -> [[i32; 2]; PATTERNS] {
    let corner = [block % BLOCKS * BLOCK, block / BLOCKS * BLOCK];
    let mut pixel_of = [[0; 2]; PATTERNS];
    for i in 0..PATTERNS {
        let [x, y] = [corner[0] + i % BLOCK, corner[1] + i / BLOCK].map(|coordinate| coordinate as i32);
        pixel_of[table.patterns_of(x, y)[1]] = [x, y];
    }
    pixel_of
}

/// Orders lens points so that each eight in a row are neighbours: halves them along the longer side of their box, again and
/// again.
fn gather_neighbors(points: &mut [LensSample]) {
    if points.len() <= LANES {
        return;
    }
    let side = |axis: usize| {
        let values = points.iter().map(|point| point.lens[axis]);
        values.clone().fold(f32::MIN, f32::max) - values.fold(f32::MAX, f32::min)
    };
    let axis = usize::from(side(1) > side(0));
    // Equal ones in the order of their numbers: nothing depends on the sort.
    points.sort_unstable_by(|a, b| {
        let order = a.lens[axis].total_cmp(&b.lens[axis]);
        order.then((a.pattern, a.sample).cmp(&(b.pattern, b.sample)))
    });
    let half = (points.len() / 2).next_multiple_of(LANES);
    let (low, high) = points.split_at_mut(half);
    gather_neighbors(low);
    gather_neighbors(high);
}

/// The boxes of eight groups: middle and half the length in x, and in y.
fn boxes_of(groups: &[&[LensSample; LANES]; LANES]) -> [Eight; 4] {
    let edge = |axis: usize, pick: fn(f32, f32) -> f32| {
        groups.map(|group| group.iter().map(|point| point.lens[axis]).reduce(pick).unwrap_or(0.0))
    };
    let middle_and_half = |axis: usize| {
        let (min, max) = (edge(axis, f32::min), edge(axis, f32::max));
        let middle: Eight = std::array::from_fn(|group| 0.5 * (min[group] + max[group]));
        // However the middle was rounded, and a little more for the sums to come.
        let half = std::array::from_fn(|group| {
            (max[group] - middle[group]).max(middle[group] - min[group]) * (1.0 + 1e-5)
        });
        [middle, half]
    };
    let ([x, dx], [y, dy]) = (middle_and_half(0), middle_and_half(1));
    [x, dx, y, dy]
}

/// The mean of the longer sides of the boxes.
fn mean_size(boxes: &[[Eight; 4]]) -> f64 {
    let sides = boxes
        .iter()
        .flat_map(|[_, dx, _, dy]| (0..LANES).map(move |lane| 2.0 * f64::from(dx[lane].max(dy[lane]))));
    sides.clone().sum::<f64>() / sides.count() as f64
}
