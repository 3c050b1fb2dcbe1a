//! Large circles of confusion: cells of samples that share their place on the lens, not on the picture.
//!
//! Through one point of the lens a splat is a small sharp disc, however large its circle of confusion. As the table of
//! lens patterns holds each pattern once in every block of 8 x 8 pixels, the samples of one lens point are a lattice
//! of spacing 8, and of eight neighbouring lens points (a *group*) each block has one sample each: a cell. So a splat
//! looks, for every group, only at the blocks in which its disc lies, about one: the work does not grow with the blur.

use crate::evaluate::LaneHits;
use crate::lanes::{Eight, LANES, Lanes};
use crate::places::{PLACES, TILE, place_of};
use splat_core::PixelRect;
use splat_core::raster::Rasterizer;
use splat_core::sampling::{BLOCK, PATTERNS};
use splat_core::setup::{BOX_PADDING, MAX_ERROR, USUAL_MARGIN, View, VisibleSplat};

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

/// The number of a cell, and that of its group.
#[derive(Debug, Clone, Copy)]
pub struct CellNumber {
    /// Blocks times groups, plus group.
    pub cell: u32,
    /// Group of lens points.
    pub group: u32,
}

/// The samples of a frame, by groups of lens points.
#[derive(Debug)]
pub struct Lattice {
    /// Lens points of each group.
    lens: Vec<[Eight; 2]>,
    /// For eight groups at a time their boxes on the lens: middle and half the length in x, and in y.
    boxes: Vec<[Eight; 4]>,
    /// Block by block, of each group.
    cells: Vec<Cell>,
    /// The same: where in the tile the samples are, to rounding.
    positions: Vec<[Eight; 2]>,
    /// The same: place and number (from the first that is taken) of each sample.
    samples: Vec<[(u16, u32); LANES]>,
    /// For each place, the cell and the lane of each of its samples.
    cell_of: Vec<(u32, u8)>,
    /// Number of samples a pixel.
    count: usize,
    near: f64,
    /// 1 / focus.
    inverse_focus: f64,
    /// sqrt(F).
    radius: f64,
    filter_radius: f64,
    /// Mean side of the groups' boxes on the lens, and radius of the lens, in pixels at depth 1.
    group_size: f64,
    lens_radius: f64,
}

impl Lattice {
    /// The lattice of a frame; `None` without a lens, and if it distorts: then no two pixels share their positions.
    pub fn new(rasterizer: &Rasterizer, view: &View) -> Option<Self> {
        let lens = view.lens.filter(|_| view.distortion.is_none())?;
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
            near: view.near,
            inverse_focus: 1.0 / lens.focus,
            radius: view.cutoff.sqrt(),
            filter_radius: view.filter_radius,
            lens_radius: lens.radius * view.pixel_scale.max_element(),
        };
        for block in 0..BLOCKS * BLOCKS {
            lattice.add_block(block, &groups, rasterizer);
        }
        Some(lattice)
    }

    /// Adds the cells of a block.
    fn add_block(&mut self, block: usize, groups: &[&[LensSample; LANES]], rasterizer: &Rasterizer) {
        let table = rasterizer.samples();
        let first = rasterizer.range().start;
        let corner = [block % BLOCKS * BLOCK, block / BLOCKS * BLOCK];
        // Where in the block each lens pattern stands.
        let mut pixel_of = [[0; 2]; PATTERNS];
        for i in 0..PATTERNS {
            let [x, y] = [corner[0] + i % BLOCK, corner[1] + i / BLOCK].map(|coordinate| coordinate as i32);
            pixel_of[table.patterns_of(x, y)[1]] = [x, y];
        }
        for group in groups {
            let pixels = group.map(|point| pixel_of[point.pattern]);
            let jitter = |lane: usize, axis: usize| {
                let [x, y] = pixels[lane];
                table.jitter(x, y)[group[lane].sample][axis]
            };
            let number = self.cells.len() as u32;
            let cell = Cell {
                pixel: [0, 1].map(|axis| pixels.map(|pixel| pixel[axis] as f32)),
                jitter: [0, 1].map(|axis| std::array::from_fn(|lane| jitter(lane, axis))),
            };
            let position = |axis: usize, lane: usize| cell.pixel[axis][lane] + cell.jitter[axis][lane];
            self.positions.push([0, 1].map(|axis| std::array::from_fn(|lane| position(axis, lane))));
            self.cells.push(cell);
            let samples = std::array::from_fn(|lane| {
                let [x, y] = pixels[lane];
                (place_of(x, y), (group[lane].sample - first) as u32)
            });
            for (lane, &(place, sample)) in samples.iter().enumerate() {
                self.cell_of[usize::from(place) * self.count + sample as usize] = (number, lane as u8);
            }
            self.samples.push(samples);
        }
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
    pub fn gain(&self, splat: &VisibleSplat, image: Option<&Image>, region: &PixelRect) -> f64 {
        let Some(image) = image else { return 0.0 };
        let blur = self.lens_radius * image.defocus.map(f64::abs).into_iter().fold(0.0, f64::max);
        let [width, height] = [0, 1].map(|axis| image.max[axis] - image.min[axis] + 2.0 * self.filter_radius);
        let share = splat.bounds.intersect(region).area() as f64 / splat.bounds.area() as f64;
        let by_pixels =
            0.8 * (width + 2.0 * blur) * (height + 2.0 * blur) * (self.count as f64 / LANES as f64);
        let group = self.group_size / self.lens_radius * blur;
        let blocks = |side: f64| 1.0 + (side + group) / BLOCK as f64;
        let groups = self.lens.len() as f64;
        // Each group's box takes about as long as a cell's eighth in every tile that the splat may touch.
        share * (by_pixels - groups * blocks(width) * blocks(height)) - groups / LANES as f64
    }

    /// What a pinhole sees of a splat, and how far its depths are out of focus. `None` if that is not known.
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

    /// Lists the cells of a tile (given by its first pixel) in which a splat may be hit.
    #[inline(always)]
    pub fn list<L: Lanes>(
        &self,
        splat: &VisibleSplat,
        image: Option<&Image>,
        corner: [i32; 2],
        list: &mut Vec<CellNumber>,
    ) {
        list.clear();
        let groups = self.lens.len() as u32;
        let Some(image) = image else {
            let blocks = 0..(BLOCKS * BLOCKS) as u32;
            let cells = blocks.flat_map(|block| (0..groups).map(move |group| (block * groups, group)));
            list.extend(cells.map(|(first, group)| CellNumber { cell: first + group, group }));
            return;
        };
        let [x, y] = [0, 1].map(|axis| self.reach(image, axis, splat, corner));
        for (eight, boxes) in self.boxes.iter().enumerate() {
            // Bit l + 8 b is set where the box of group l reaches block b of a row, or of a column.
            let columns = x.blocks::<L>(&boxes[0], &boxes[1]);
            let rows = y.blocks::<L>(&boxes[2], &boxes[3]);
            if columns == 0 || rows == 0 {
                continue;
            }
            let group = (eight * LANES) as u32;
            for row in 0..BLOCKS as u32 {
                let row_groups = rows >> (row * LANES as u32) & 0xff;
                let mut found = columns & (row_groups * 0x0101_0101);
                while found != 0 {
                    let bit = found.trailing_zeros();
                    found &= found - 1;
                    let group = group + bit % LANES as u32;
                    let block = row * BLOCKS as u32 + bit / LANES as u32;
                    list.push(CellNumber { cell: block * groups + group, group });
                }
            }
        }
        let near = [0, 1].map(|axis| self.nearness(image, axis, splat, corner));
        self.keep_near::<L>(&near, list);
    }

    /// Keeps those of some cells of which a sample is near a splat.
    #[inline(always)]
    fn keep_near<L: Lanes>(&self, [x, y]: &[Nearness; 2], list: &mut Vec<CellNumber>) {
        let mut kept = 0;
        for i in 0..list.len() {
            let number = list[i];
            let (position, lens) = (&self.positions[number.cell as usize], &self.lens[number.group as usize]);
            let far = x.is_far(L::load(&position[0]), L::load(&lens[0]))
                | y.is_far(L::load(&position[1]), L::load(&lens[1]));
            // Written in any case: which is kept cannot be foreseen.
            list[kept] = number;
            kept += usize::from(far.bits() as u8 != u8::MAX);
        }
        list.truncate(kept);
    }

    /// Where along an axis the samples are by which a splat may be hit.
    #[inline(always)]
    fn nearness(&self, image: &Image, axis: usize, splat: &VisibleSplat, corner: [i32; 2]) -> Nearness {
        let center = [splat.constants.xi, splat.constants.yi];
        let origin = f64::from(center[axis]) - f64::from(corner[axis]);
        let [near, far] = image.defocus;
        let defocus = 0.5 * (near + far);
        let spread = self.lens_radius * 0.5 * (near - far).abs();
        let [middle, half] =
            [0.5 * (image.max[axis] + image.min[axis]) + origin, 0.5 * (image.max[axis] - image.min[axis])];
        // Three roundings of terms that may cancel.
        let rounding =
            (middle.abs() + self.lens_radius * defocus.abs() + 64.0) * 4.0 * f64::from(f32::EPSILON);
        Nearness { middle: middle as f32, half: (half + spread + rounding) as f32, defocus: defocus as f32 }
    }

    /// How far a splat reaches along an axis, for [`Reach::blocks`].
    #[inline(always)]
    fn reach(&self, image: &Image, axis: usize, splat: &VisibleSplat, corner: [i32; 2]) -> Reach {
        let room = self.filter_radius + BOX_PADDING + 0.5;
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
    pub fn offset<L: Lanes>(
        &self,
        number: CellNumber,
        apart: &Apart<L>,
        minus_fraction: &[L; 2],
    ) -> ([L; 2], [L; 2]) {
        let Cell { pixel, jitter } = &self.cells[number.cell as usize];
        let lens = &self.lens[number.group as usize];
        let whole = match apart {
            // The sum is exact, as its terms are.
            Apart::Near([x, y]) => [*x + L::load(&pixel[0]), *y + L::load(&pixel[1])],
            Apart::Far(apart) => far_offset(*apart, pixel),
        };
        (
            [
                whole[0] + (L::load(&jitter[0]) + minus_fraction[0]),
                whole[1] + (L::load(&jitter[1]) + minus_fraction[1]),
            ],
            [L::load(&lens[0]), L::load(&lens[1])],
        )
    }

    /// Drops the hits of a cell whose pixels are not in a region of the tile.
    #[inline(always)]
    pub fn clip<L: Lanes>(&self, cell: u32, corner: [i32; 2], region: &PixelRect, hits: &mut LaneHits<L>) {
        let Cell { pixel, .. } = &self.cells[cell as usize];
        let (x, y) = (L::load(&pixel[0]), L::load(&pixel[1]));
        let edge = |edge: i32, corner: i32| L::splat((edge - corner) as f32);
        hits.missed = hits.missed
            | x.less(edge(region.x0, corner[0]))
            | x.not_less(edge(region.x1, corner[0]))
            | y.less(edge(region.y0, corner[1]))
            | y.not_less(edge(region.y1, corner[1]));
    }
}

/// How far the first pixel of a tile is from a splat's pixel.
#[derive(Debug, Clone, Copy)]
pub enum Apart<L> {
    /// So near that offsets in the tile are exact sums.
    Near([L; 2]),
    /// So far that they have to be rounded as the reference does.
    Far([i32; 2]),
}

impl<L: Lanes> Apart<L> {
    /// From the splat's pixel to the tile's first.
    #[inline(always)]
    pub fn new(splat: &VisibleSplat, corner: [i32; 2]) -> Self {
        let [x, y] = [corner[0] - splat.constants.xi, corner[1] - splat.constants.yi];
        if x.unsigned_abs().max(y.unsigned_abs()) < 1 << 23 {
            Self::Near([L::splat(x as f32), L::splat(y as f32)])
        } else {
            Self::Far([x, y])
        }
    }
}

/// What a pinhole sees of a splat, for [`Lattice`]: in pixels relative to its pixel; and 1/focus - 1/w at its nearest and farthest.
#[derive(Debug, Clone, Copy)]
pub struct Image {
    min: [f64; 2],
    max: [f64; 2],
    defocus: [f64; 2],
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

/// What is near a splat along an axis: samples within `half` of `middle` plus lens point times `defocus`, in pixels from the
/// tile's first.
struct Nearness {
    middle: f32,
    half: f32,
    defocus: f32,
}

impl Nearness {
    #[inline(always)]
    fn is_far<L: Lanes>(&self, position: L, lens: L) -> L {
        let offset = (position - L::splat(self.middle)) - lens * L::splat(self.defocus);
        L::splat(self.half).less(offset.greatest(L::splat(0.0) - offset))
    }
}

impl Reach {
    /// The blocks 0 to 3 that a splat reaches through eight groups of lens points, given the middle and half the length of
    /// their boxes: bit l + 8 b is set for block b and group l.
    #[inline(always)]
    fn blocks<L: Lanes>(&self, middle: &Eight, half: &Eight) -> u32 {
        let (middle, half) = (L::load(middle), L::load(half));
        let (defocus, spread) = (L::splat(self.defocus), L::splat(self.spread));
        let shift = middle * defocus;
        let zero = L::splat(0.0);
        // (m +- h)(d +- s) lies within |m| s + h (|d| + s) of m d.
        let around =
            middle.greatest(zero - middle) * spread + half * L::splat(self.defocus.abs() + self.spread);
        let low = L::splat(self.min) + shift - around;
        let high = L::splat(self.max) + shift + around;
        let mut blocks = 0;
        for block in 0..BLOCKS {
            let reached = low.less(L::splat(block as f32 + 1.0)) & L::splat(block as f32).less_or_equal(high);
            blocks |= (reached.bits() & u32::from(u8::MAX)) << (block * LANES);
        }
        blocks
    }
}

/// Offsets too large for exact sums: each rounded once, as the reference does.
#[inline(never)]
fn far_offset<L: Lanes>(apart: [i32; 2], pixel: &[Eight; 2]) -> [L; 2] {
    let axis = |axis: usize| L::load(&pixel[axis].map(|pixel| (apart[axis] + pixel as i32) as f32));
    [axis(0), axis(1)]
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
