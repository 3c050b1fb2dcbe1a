//! From splats to records: eight samples of a pixel against one splat at a time.

use crate::evaluate::{LaneHits, LaneSplat};
use crate::lanes::{Kernel, LANES, Lanes};
use crate::samples::{LaneSamples, limits};
use splat_abuffer::Fragment;
use splat_core::PixelRect;
use splat_core::kernel::{KernelTable, QUARTIC_BINS};
use splat_core::raster::{Form, Rasterizer};
use splat_core::setup::VisibleSplat;

/// The fragments of one splat in eight samples of a pixel: where there is none, an infinite depth and no weight.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub struct Record {
    /// View depths.
    pub depth: [f32; LANES],
    /// Weights.
    pub weight: [f32; LANES],
}

/// Where a record belongs: a group of samples of a pixel of the region, and the splat.
#[derive(Debug, Clone, Copy)]
pub struct RecordKey {
    /// Pixel of the region times groups, plus group.
    pub cell: u32,
    /// Rank of the splat.
    pub rank: u32,
    /// Whether its back was hit.
    pub back: bool,
}

/// The records of a region, in splat order, and their grouping by cell.
#[derive(Debug, Default)]
pub struct RecordBuffer {
    records: Vec<Record>,
    keys: Vec<RecordKey>,
    starts: Vec<u32>,
    order: Vec<u32>,
    /// Samples tested.
    pub tests: u64,
    /// Fragments stored.
    pub fragments: u64,
}

impl RecordBuffer {
    /// Bytes that a record needs with all that belongs to it.
    pub const BYTES_PER_RECORD: usize = size_of::<Record>() + size_of::<RecordKey>() + size_of::<u32>();

    /// Empties the buffer.
    pub fn clear(&mut self) {
        self.records.clear();
        self.keys.clear();
        self.tests = 0;
        self.fragments = 0;
    }

    /// Number of records.
    pub fn len(&self) -> usize {
        self.records.len()
    }

    /// Groups the records by cell; within one they stay in splat order (a stable counting sort).
    pub fn group(&mut self, cells: usize) {
        self.starts.clear();
        self.starts.resize(cells + 1, 0);
        for key in &self.keys {
            self.starts[key.cell as usize + 1] += 1;
        }
        for cell in 0..cells {
            self.starts[cell + 1] += self.starts[cell];
        }
        self.order.clear();
        self.order.resize(self.keys.len(), 0);
        for (number, key) in self.keys.iter().enumerate() {
            let position = &mut self.starts[key.cell as usize];
            self.order[*position as usize] = number as u32;
            *position += 1;
        }
        self.starts.copy_within(0..cells, 1);
        self.starts[0] = 0;
    }

    /// The numbers of a cell's records, in splat order, after [`RecordBuffer::group`].
    #[inline(always)]
    pub fn cell(&self, cell: usize) -> &[u32] {
        &self.order[self.starts[cell] as usize..self.starts[cell + 1] as usize]
    }

    /// A record and what it belongs to.
    #[inline(always)]
    pub fn get(&self, number: u32) -> (&Record, RecordKey) {
        (&self.records[number as usize], self.keys[number as usize])
    }

    /// The fragment of a record in a lane, if there is one.
    pub fn fragment(&self, number: u32, lane: usize) -> Option<Fragment> {
        let (record, key) = self.get(number);
        (record.weight[lane] > 0.0)
            .then(|| Fragment::new(record.depth[lane], record.weight[lane], key.rank, key.back))
    }

    fn push(&mut self, key: RecordKey, record: Record, fragments: u32) {
        self.keys.push(key);
        self.records.push(record);
        self.fragments += u64::from(fragments);
    }
}

/// What is the same for all regions of a frame.
#[derive(Debug, Clone, Copy)]
pub struct RasterFrame<'a> {
    /// The samples and the kernel.
    pub rasterizer: &'a Rasterizer,
    /// The samples, in lanes.
    pub samples: &'a LaneSamples,
    /// All splats, by rank.
    pub splats: &'a [VisibleSplat],
}

/// Rasterises some splats over a region into a buffer. Gives up, with false, when the buffer exceeds its budget.
#[derive(Debug)]
pub struct RasterJob<'a> {
    /// The frame.
    pub frame: RasterFrame<'a>,
    /// The ranks of the splats, in splat order.
    pub ranks: &'a [u32],
    /// The pixels.
    pub region: PixelRect,
    /// Records that the buffer may hold, unless the region is a single pixel.
    pub budget: usize,
    /// Where the records go.
    pub buffer: &'a mut RecordBuffer,
}

impl Kernel for RasterJob<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<L: Lanes>(self) -> bool {
        match self.frame.rasterizer.form() {
            Form::Pinhole => self.rasterize::<L, PINHOLE>(),
            Form::ThinLens => self.rasterize::<L, THIN_LENS>(),
            Form::Orthographic => self.rasterize::<L, ORTHOGRAPHIC>(),
        }
    }
}

// The forms of the evaluation, as constants to specialise by.
const PINHOLE: u8 = 0;
const THIN_LENS: u8 = 1;
const ORTHOGRAPHIC: u8 = 2;

impl RasterJob<'_> {
    #[inline(always)]
    fn rasterize<L: Lanes, const FORM: u8>(self) -> bool {
        let Self { frame, ranks, region, budget, buffer } = self;
        buffer.clear();
        for &rank in ranks {
            rasterize_splat::<L, FORM>(&frame, rank, &region, buffer);
            if buffer.len() > budget && region.area() > 1 {
                return false;
            }
        }
        true
    }
}

/// Tests all samples of a splat's candidate pixels in the region.
#[inline(always)]
fn rasterize_splat<L: Lanes, const FORM: u8>(
    frame: &RasterFrame<'_>,
    rank: u32,
    region: &PixelRect,
    buffer: &mut RecordBuffer,
) {
    let splat = &frame.splats[rank as usize];
    let lane_splat = LaneSplat::<L>::new(&splat.constants);
    let limits = limits::<L>(frame.rasterizer);
    let fraction = [L::splat(splat.constants.xf), L::splat(splat.constants.yf)];
    let groups = frame.samples.groups();
    let candidates = splat.bounds.intersect(region);
    for y in candidates.y0..candidates.y1 {
        let row = L::splat((y - splat.constants.yi) as f32);
        for x in candidates.x0..candidates.x1 {
            let column = L::splat((x - splat.constants.xi) as f32);
            let pixel = (y - region.y0) as usize * region.width() + (x - region.x0) as usize;
            let [filter_pattern, lens_pattern] = frame.rasterizer.samples().patterns_of(x, y);
            for (group, [jx, jy]) in frame.samples.jitter(filter_pattern).iter().enumerate() {
                let d = [column + (L::load(jx) - fraction[0]), row + (L::load(jy) - fraction[1])];
                let hits = match FORM {
                    PINHOLE => lane_splat.pinhole(d, &limits),
                    THIN_LENS => lane_splat.thin_lens(d, &frame.samples.lens(lens_pattern, group), &limits),
                    _ => lane_splat.orthographic(d, &limits),
                };
                let live = frame.samples.live(group);
                buffer.tests += u64::from(live.count_ones());
                if hits.mask & live != 0 {
                    store(frame, splat, rank, (pixel * groups + group) as u32, &hits, live, buffer);
                }
            }
        }
    }
}

/// Stores the fragments of some hits: one record, or one a facing where the lens sees both.
#[inline(always)]
fn store<L: Lanes>(
    frame: &RasterFrame<'_>,
    splat: &VisibleSplat,
    rank: u32,
    cell: u32,
    hits: &LaneHits<L>,
    live: u32,
    buffer: &mut RecordBuffer,
) {
    let mask = hits.mask & live;
    let weight = L::splat(splat.weight_scale) * kernel_values(frame.rasterizer.table(), hits.r2, mask);
    let mask = mask & weight.greater(L::splat(0.0)).bits();
    let flipped = if splat.flips { hits.flipped } else { 0 };
    let backs = if splat.back { !flipped } else { flipped };
    for (back, lanes) in [(false, mask & !backs), (true, mask & backs)] {
        if lanes == 0 || (back && frame.rasterizer.culls()) {
            continue;
        }
        let selected = L::mask(lanes);
        let record = Record {
            depth: selected.select(hits.depth, L::splat(f32::INFINITY)).to_array(),
            weight: (weight & selected).to_array(),
        };
        buffer.push(RecordKey { cell, rank, back }, record, lanes.count_ones());
    }
}

/// [`KernelTable::weight`] for a sample a lane; lanes outside of the mask hold arbitrary values.
#[inline(always)]
fn kernel_values<L: Lanes>(table: &KernelTable, r2: L, mask: u32) -> L {
    let Some(quartic) = table.quartic() else {
        let r2 = r2.to_array();
        let value = |lane: usize| if mask >> lane & 1 == 1 { table.weight(r2[lane]) } else { 0.0 };
        return L::load(&std::array::from_fn(value));
    };
    let position = r2 * L::splat(quartic.scale);
    // The second operand comes out where the first one is not a number.
    let bin = position.least(L::splat((QUARTIC_BINS - 1) as f32)).truncate();
    let t = position - bin;
    let [c0, c1, c2, c3, c4] = &quartic.coefficients;
    let c = |coefficients| bin.look_up(coefficients);
    (((c(c4) * t + c(c3)) * t + c(c2)) * t + c(c1)) * t + c(c0)
}
