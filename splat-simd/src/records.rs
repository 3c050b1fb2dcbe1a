//! The fragments of a region, eight samples a record.

use crate::lanes::{Eight, LANES, Lanes};
use crate::places::PLACES;
use splat_abuffer::{Fragment, SplatSurface};
use std::ops::Range;

/// The fragments of one splat in the eight samples of a cell: where there is none, a depth that is not a number and no
/// weight.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C, align(64))]
pub struct Record {
    /// View depths.
    pub depth: Eight,
    /// Weights.
    pub weight: Eight,
}

/// The list that a record belongs to, and its splat.
#[derive(Debug, Clone, Copy, Default)]
struct Key {
    list: u32,
    splat: LocalSplat,
}

/// A splat of a region: its number in the region's list in the upper 31 bits, the facing that was hit in the lowest.
#[derive(Debug, Clone, Copy, Default)]
pub struct LocalSplat(u32);

impl LocalSplat {
    /// The splat of this number; `back` if its back was hit.
    #[inline(always)]
    pub fn new(number: u32, back: bool) -> Self {
        Self(number << 1 | u32::from(back))
    }

    /// The splat's number in the region's list.
    #[inline(always)]
    pub fn number(self) -> usize {
        (self.0 >> 1) as usize
    }

    /// Whether its back was hit.
    #[inline(always)]
    pub fn is_back(self) -> bool {
        self.0 & 1 != 0
    }
}

/// A record of a cell.
#[derive(Debug, Clone, Copy, Default)]
pub struct Entry {
    /// Number of the record.
    pub record: u32,
    /// Its splat.
    pub splat: LocalSplat,
}

/// The records of a region, in splat order, and their grouping by cell.
#[derive(Debug, Default)]
pub struct RecordBuffer {
    /// The first `count` are in use.
    records: Vec<Record>,
    keys: Vec<Key>,
    count: usize,
    /// The splats of the region: their ranks, and what their fragments share.
    ranks: Vec<u32>,
    surfaces: Vec<SplatSurface>,
    /// Number of lists a cell: one, or one for fronts and one for backs.
    sides: usize,
    /// For each list of each cell the number of its records, then, grouped, where its entries end.
    ends: Vec<u32>,
    entries: Vec<Entry>,
    /// The buffer takes no new splat when it holds more records than this.
    limit: usize,
    complete: bool,
    /// Fragments stored.
    pub fragments: u64,
}

/// The fragments of a splat in one cell, or two.
#[derive(Debug, Clone, Copy)]
pub struct Hits<L> {
    /// Set where the lane is not hit.
    pub missed: L,
    /// View depths; arbitrary where there is no hit.
    pub depth: L,
    /// Weights; arbitrary where there is no hit.
    pub weight: L,
}

impl RecordBuffer {
    /// Bytes that a record needs with all that belongs to it.
    pub const BYTES_PER_RECORD: usize = size_of::<Record>() + size_of::<Key>() + size_of::<Entry>();

    /// Empties the buffer, for a region of pixels of `groups` cells. It will take splats until it holds more than `limit`
    /// records, and keep fronts and backs apart if `two_sided`.
    pub fn clear(&mut self, groups: usize, two_sided: bool, limit: usize) {
        self.sides = 1 + usize::from(two_sided);
        self.limit = limit;
        self.complete = true;
        self.count = 0;
        self.ranks.clear();
        self.surfaces.clear();
        self.ends.clear();
        self.ends.resize(PLACES * groups * self.sides, 0);
        self.fragments = 0;
    }

    /// Begins with a splat, of which at most `cells` cells are hit. `None` if there is no room for it.
    #[inline(always)]
    pub fn begin(&mut self, rank: u32, surface: &SplatSurface, cells: usize) -> Option<Page<'_>> {
        if self.count > self.limit {
            self.complete = false;
            return None;
        }
        // A cell may be hit on both sides, and one record more is written than kept.
        let needed = self.count + 2 * cells + 1;
        if needed > self.records.len() {
            let length = needed.max(2 * self.records.len());
            self.records.resize(length, Record::default());
            self.keys.resize(length, Key::default());
        }
        self.ranks.push(rank);
        self.surfaces.push(*surface);
        Some(Page {
            number: self.ranks.len() as u32 - 1,
            sides: self.sides,
            keys: &mut self.keys[..self.records.len()],
            records: &mut self.records,
            list_counts: &mut self.ends,
            count: self.count,
            fragments: self.fragments,
            totals: (&mut self.count, &mut self.fragments),
        })
    }

    /// Whether it took all splats that it was given.
    pub fn is_complete(&self) -> bool {
        self.complete
    }

    /// Groups the records by cell and side; within one they stay in splat order (a stable counting sort).
    pub fn group(&mut self) {
        let mut start = 0;
        for end in &mut self.ends {
            start += std::mem::replace(end, start);
        }
        if self.entries.len() < self.count {
            self.entries.resize(self.records.len(), Entry::default());
        }
        for (number, key) in self.keys[..self.count].iter().enumerate() {
            let position = &mut self.ends[key.list as usize];
            self.entries[*position as usize] = Entry { record: number as u32, splat: key.splat };
            *position += 1;
        }
    }

    /// The entries of a cell, each side in splat order, after [`RecordBuffer::group`]: fronts and backs, or all and none.
    #[inline(always)]
    pub fn cell(&self, cell: usize) -> [&[Entry]; 2] {
        if self.sides == 1 {
            [self.list(cell..cell + 1), &[]]
        } else {
            [self.list(2 * cell..2 * cell + 1), self.list(2 * cell + 1..2 * cell + 2)]
        }
    }

    /// Whether some cells have no entries.
    #[inline(always)]
    pub fn are_empty(&self, cells: Range<usize>) -> bool {
        self.list(cells.start * self.sides..cells.end * self.sides).is_empty()
    }

    #[inline(always)]
    fn list(&self, lists: Range<usize>) -> &[Entry] {
        let start = if lists.start == 0 { 0 } else { self.ends[lists.start - 1] };
        &self.entries[start as usize..self.ends[lists.end - 1] as usize]
    }

    /// The record of an entry.
    #[inline(always)]
    pub fn record(&self, entry: Entry) -> &Record {
        &self.records[entry.record as usize]
    }

    /// What the fragments of an entry's splat share.
    #[inline(always)]
    pub fn surface(&self, entry: Entry) -> &SplatSurface {
        &self.surfaces[entry.splat.number()]
    }

    /// The fragment of an entry in a lane, if there is one.
    pub fn fragment(&self, entry: Entry, lane: usize) -> Option<Fragment> {
        let record = self.record(entry);
        let rank = self.ranks[entry.splat.number()];
        (record.weight[lane] > 0.0)
            .then(|| Fragment::new(record.depth[lane], record.weight[lane], rank, entry.splat.is_back()))
    }
}

/// Where the records of one splat go.
#[derive(Debug)]
pub struct Page<'a> {
    records: &'a mut [Record],
    keys: &'a mut [Key],
    list_counts: &'a mut [u32],
    number: u32,
    sides: usize,
    count: usize,
    fragments: u64,
    /// The buffer's own counts, brought up to date by [`Page::close`].
    totals: (&'a mut usize, &'a mut u64),
}

impl Page<'_> {
    /// Takes the hits of a cell: `CELL` of the lanes.
    #[inline(always)]
    pub fn put<L: Lanes, const CELL: usize>(&mut self, cell: usize, back: bool, hits: &Hits<L>) {
        let misses = (hits.missed.bits() >> (CELL * LANES)) as u8;
        // Written in any case, but kept only if something was hit: a branch would be mispredicted at every rim.
        let record = &mut self.records[self.count];
        (hits.depth | hits.missed).store_cell::<CELL>(&mut record.depth);
        hits.weight.and_not(hits.missed).store_cell::<CELL>(&mut record.weight);
        let list = if self.sides == 1 { cell } else { 2 * cell + usize::from(back) };
        self.keys[self.count] = Key { list: list as u32, splat: LocalSplat::new(self.number, back) };
        let kept = u32::from(misses != u8::MAX);
        self.list_counts[list] += kept;
        self.count += kept as usize;
        self.fragments += u64::from(misses.count_zeros());
    }

    /// Ends the splat.
    #[inline(always)]
    pub fn close(self) {
        *self.totals.0 = self.count;
        *self.totals.1 = self.fragments;
    }
}
