//! The fragments of a region, eight samples a record.

use crate::evaluate::LaneHits;
use crate::lanes::{Eight, LANES, Lanes};
use crate::places::PLACES;
use splat_abuffer::{Fragment, SplatSurface};

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

/// The list that a record belongs to in the lower half, and its splat in the upper.
#[derive(Debug, Clone, Copy, Default)]
pub struct Key(u64);

impl Key {
    #[inline(always)]
    fn new(list: u32, splat: LocalSplat) -> Self {
        Self(u64::from(splat.0) << 32 | u64::from(list))
    }

    /// The list.
    #[inline(always)]
    pub fn list(self) -> usize {
        self.0 as u32 as usize
    }

    #[inline(always)]
    fn splat(self) -> LocalSplat {
        LocalSplat((self.0 >> 32) as u32)
    }
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

/// The number of a cell of a group of samples of one pixel.
#[inline(always)]
pub fn cell_of(place: u16, group: usize) -> usize {
    group * PLACES + usize::from(place)
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
    /// Number of cells, over [`PLACES`].
    groups: usize,
    /// One list a cell, or one for fronts and one for backs.
    sides: usize,
    /// For each side, group and place where its entries end, once they are grouped.
    lists: Vec<[u32; PLACES]>,
    entries: Vec<Entry>,
    /// The buffer takes no new splat when it holds more records than this.
    limit: usize,
    /// Whether each splat overwrites the one before.
    forgets: bool,
    complete: bool,
    /// Fragments stored.
    pub fragments: u64,
}

impl RecordBuffer {
    /// Bytes that a record needs with all that belongs to it.
    pub const BYTES_PER_RECORD: usize = size_of::<Record>() + size_of::<Key>() + size_of::<Entry>();

    /// Empties the buffer, for a tile of `groups` times [`PLACES`] cells. It will take splats until it holds more than `limit`
    /// records, and keep fronts and backs apart if `two_sided`.
    pub fn clear(&mut self, groups: usize, two_sided: bool, limit: usize) {
        self.groups = groups;
        self.sides = 1 + usize::from(two_sided);
        self.limit = limit;
        self.forgets = false;
        self.complete = true;
        self.count = 0;
        self.ranks.clear();
        self.surfaces.clear();
        self.lists.clear();
        self.lists.resize(groups * self.sides, [0; PLACES]);
        self.fragments = 0;
    }

    /// Makes the buffer forget each splat's records when the next one begins: to measure how long they take to make.
    pub fn forget(&mut self) {
        self.forgets = true;
    }

    /// Begins with a splat, of which at most `cells` cells are hit. `None` if there is no room for it.
    #[inline(always)]
    pub fn begin(&mut self, rank: u32, surface: &SplatSurface, cells: usize) -> Option<Page<'_>> {
        if self.forgets {
            self.count = 0;
        }
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
            groups: self.groups,
            sides: self.sides,
            records: &mut self.records,
            keys: &mut self.keys,
            first: self.count,
            count: self.count,
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
        let lists = self.lists.as_flattened_mut();
        for key in &self.keys[..self.count] {
            lists[key.list()] += 1;
        }
        for end in &mut *lists {
            start += std::mem::replace(end, start);
        }
        if self.entries.len() < self.count {
            self.entries.resize(self.records.len(), Entry::default());
        }
        for (number, key) in self.keys[..self.count].iter().enumerate() {
            let position = &mut lists[key.list()];
            self.entries[*position as usize] = Entry { record: number as u32, splat: key.splat() };
            *position += 1;
        }
    }

    /// The entries of a cell, each side in splat order, after [`RecordBuffer::group`]: fronts and backs, or all and none.
    #[inline(always)]
    pub fn cell(&self, cell: usize) -> [&[Entry]; 2] {
        [self.list(cell), if self.sides == 1 { &[] } else { self.list(self.groups * PLACES + cell) }]
    }

    /// Whether a cell has no entries.
    #[inline(always)]
    pub fn is_empty(&self, cell: usize) -> bool {
        self.cell(cell).iter().all(|entries| entries.is_empty())
    }

    #[inline(always)]
    fn list(&self, list: usize) -> &[Entry] {
        let ends = self.lists.as_flattened();
        let start = if list == 0 { 0 } else { ends[list - 1] };
        &self.entries[start as usize..ends[list] as usize]
    }

    /// Number of splats of the region.
    pub fn splats(&self) -> usize {
        self.ranks.len()
    }

    /// The number and the rank of the splat of each record of a cell.
    pub fn splats_of(&self, cell: usize) -> impl Iterator<Item = (usize, u32)> {
        self.cell(cell).into_iter().flatten().map(|entry| {
            let number = entry.splat.number();
            (number, self.ranks[number])
        })
    }

    /// Gives a splat, by its number in the region, another colour.
    pub fn recolor(&mut self, number: usize, color: [f32; 3]) {
        self.surfaces[number].color = color;
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
    number: u32,
    groups: usize,
    sides: usize,
    first: usize,
    count: usize,
    /// The buffer's own counts, brought up to date by [`Page::close`].
    totals: (&'a mut usize, &'a mut u64),
}

/// The part of a page for a group of samples and a side.
#[derive(Debug)]
pub struct Column<'a> {
    records: &'a mut [Record],
    keys: &'a mut [Key],
    /// Key of place 0.
    key: Key,
    count: usize,
    total: &'a mut usize,
}

impl Page<'_> {
    /// Where the hits of a group of samples go, on a side: at most `cells` cells.
    #[inline(always)]
    pub fn column(&mut self, group: usize, back: bool, cells: usize) -> Column<'_> {
        let list = if self.sides == 2 && back { self.groups + group } else { group };
        // One more is written than kept.
        let room = self.count..self.count + cells + 1;
        Column {
            keys: &mut self.keys[room.clone()],
            records: &mut self.records[room],
            key: Key::new((list * PLACES) as u32, LocalSplat::new(self.number, back)),
            count: 0,
            total: &mut self.count,
        }
    }

    /// Takes the hits of any cell, if there are any. For the time being their r2 stand in place of their weights.
    #[inline(always)]
    pub fn put<L: Lanes>(&mut self, cell: u32, back: bool, hits: &LaneHits<L>) {
        let list = if self.sides == 2 && back { self.groups * PLACES + cell as usize } else { cell as usize };
        let record = &mut self.records[self.count];
        (hits.depth | hits.missed).store_cell::<0>(&mut record.depth);
        hits.r2.store_cell::<0>(&mut record.weight);
        self.keys[self.count] = Key::new(list as u32, LocalSplat::new(self.number, back));
        self.count += usize::from(hits.missed.bits() as u8 != u8::MAX);
    }

    /// The records of the page.
    #[inline(always)]
    pub fn records(&mut self) -> &mut [Record] {
        &mut self.records[self.first..self.count]
    }

    /// The records of the page, and to which list each belongs.
    #[inline(always)]
    pub fn records_and_keys(&self) -> (&[Record], &[Key]) {
        let page = self.first..self.count;
        (&self.records[page.clone()], &self.keys[page])
    }

    /// Ends the splat, which has this many fragments.
    #[inline(always)]
    pub fn close(self, fragments: u32) {
        *self.totals.0 = self.count;
        *self.totals.1 += u64::from(fragments);
    }
}

impl Column<'_> {
    /// Takes the hits in a place: `CELL` of the lanes. For the time being their r2 stand in place of their weights.
    ///
    /// If `SPARSE` a cell without a hit leaves no record. If not it leaves an empty one: a few of them cost less than to wait
    /// for the hits before the place of the next record is known.
    #[inline(always)]
    pub fn put<L: Lanes, const SPARSE: bool, const CELL: usize>(&mut self, place: u16, hits: &LaneHits<L>) {
        // Written in any case: a branch would be mispredicted at every rim.
        let record = &mut self.records[self.count];
        (hits.depth | hits.missed).store_cell::<CELL>(&mut record.depth);
        hits.r2.store_cell::<CELL>(&mut record.weight);
        self.keys[self.count] = Key(self.key.0 | u64::from(place));
        let misses = (hits.missed.bits() >> (CELL * LANES)) as u8;
        self.count += if SPARSE { usize::from(misses != u8::MAX) } else { 1 };
    }

    /// Ends the column.
    #[inline(always)]
    pub fn close(self) {
        *self.total += self.count;
    }
}
