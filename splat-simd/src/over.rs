//! The resolve of `over` for eight samples at once: every fragment is a layer of its own, nearest first (SPEC section 6).
//!
//! What a layer adds is divided before it is sorted, for all lanes; what remains are products. The samples of a cell are
//! neighbours and mostly agree on the order. So the layers are sorted by the depths of one lane each, and then inserted
//! one by one, each lane for itself: few have to move.

use crate::lanes::{Eight, LANES, Lanes, prefetch};
use crate::records::{Record, RecordBuffer};
use crate::resolve::{Colors, ResolveCell};
use splat_abuffer::{MIN_ALPHA, SplatSurface};

/// Moves a vector of layers, in the mean of a cell, beyond which it costs less to sort each lane by keys.
const MAX_MOVES: usize = 32;

/// The greatest number of layers whose numbers `f32` can tell apart.
const MAX_NUMBER: usize = 1 << f32::MANTISSA_DIGITS;

/// How many entries ahead their records are asked for.
const PREFETCHED: usize = 8;

/// A layer of each of eight samples; its alpha is 0 where a sample has none.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C, align(32))]
struct StoredLayer {
    depth: Eight,
    /// Its place in splat order, which decides between equal depths.
    number: Eight,
    alpha: Eight,
    color: [Eight; 3],
}

/// The same, in registers.
#[derive(Clone, Copy)]
struct Layer<L> {
    depth: L,
    number: L,
    alpha: L,
    color: [L; 3],
}

impl<L: Lanes> Layer<L> {
    /// The layers of a record, and where there are any: where alpha is enough to be seen.
    #[inline(always)]
    fn new(record: &Record, surface: &SplatSurface, number: usize) -> (Self, L) {
        let alpha = L::load(&record.weight) * L::splat(surface.opacity);
        let seen = L::splat(MIN_ALPHA).less_or_equal(alpha);
        // Multiplied and divided again, as the reference does: the result may be another number.
        let mut color = [alpha; 3];
        for (lanes, value) in color.iter_mut().zip(surface.color) {
            *lanes = (alpha * L::splat(value) / alpha) & seen;
        }
        let alpha = alpha.least(L::splat(1.0)) & seen;
        (Self { depth: L::load(&record.depth), number: L::splat(number as f32), alpha, color }, seen)
    }

    #[inline(always)]
    fn load(stored: &StoredLayer) -> Self {
        let StoredLayer { depth, number, alpha, color } = stored;
        let [red, green, blue] = color;
        let color = [L::load(red), L::load(green), L::load(blue)];
        Self { depth: L::load(depth), number: L::load(number), alpha: L::load(alpha), color }
    }

    #[inline(always)]
    fn store(&self, to: &mut StoredLayer) {
        self.depth.store_cell::<0>(&mut to.depth);
        self.number.store_cell::<0>(&mut to.number);
        self.alpha.store_cell::<0>(&mut to.alpha);
        for (lanes, values) in self.color.into_iter().zip(&mut to.color) {
            lanes.store_cell::<0>(values);
        }
    }

    /// Lanes in which this layer comes before another.
    #[inline(always)]
    fn before(&self, other: &Self) -> L {
        let nearer = self.depth.less(other.depth);
        let beyond = other.depth.less(self.depth);
        nearer | self.number.less(other.number).and_not(beyond)
    }

    /// Where `mask` is set the lanes of `yes`, else those of `no`.
    #[inline(always)]
    fn select(mask: L, yes: &Self, no: &Self) -> Self {
        let ([r, g, b], [other_r, other_g, other_b]) = (yes.color, no.color);
        Self {
            depth: mask.select(yes.depth, no.depth),
            number: mask.select(yes.number, no.number),
            alpha: mask.select(yes.alpha, no.alpha),
            color: [mask.select(r, other_r), mask.select(g, other_g), mask.select(b, other_b)],
        }
    }
}

/// Resolves cells; keeps its memory between them.
#[derive(Debug, Default)]
pub struct Over {
    /// The layers of a cell in splat order; the first `count` are in use, here and below.
    layers: Vec<StoredLayer>,
    /// The same, each lane in order.
    ordered: Vec<StoredLayer>,
    count: usize,
    keys: Vec<u64>,
}

impl ResolveCell for Over {
    #[inline(always)]
    fn resolve_cell<L: Lanes>(&mut self, buffer: &RecordBuffer, cell: usize) -> Colors<L> {
        let (covered, comparable) = self.collect::<L>(buffer, cell);
        if !(comparable && self.insert_all::<L>()) {
            self.sort_lanes();
        }
        let mut colors = Colors::<L>::nothing();
        colors.uncovered = colors.uncovered.and_not(covered);
        for stored in &self.ordered[..self.count] {
            let layer = Layer::load(stored);
            let visible = colors.transmittance * layer.alpha;
            for (sum, color) in colors.color.iter_mut().zip(layer.color) {
                *sum = *sum + visible * color;
            }
            colors.transmittance = colors.transmittance * (L::splat(1.0) - layer.alpha);
        }
        colors
    }
}

impl Over {
    /// Collects the layers of a cell, and keys of the depths of the first lane that each has. Gives the lanes that have any
    /// layer, and whether comparisons suffice to sort them.
    #[inline(always)]
    fn collect<L: Lanes>(&mut self, buffer: &RecordBuffer, cell: usize) -> (L, bool) {
        self.count = 0;
        self.keys.clear();
        let room: usize = buffer.cell(cell).iter().map(|entries| entries.len()).sum();
        if self.layers.len() < room {
            self.layers.resize(room, StoredLayer::default());
            self.ordered.resize(room, StoredLayer::default());
        }
        let (mut covered, mut not_positive) = (L::splat(0.0), L::splat(0.0));
        for entries in buffer.cell(cell) {
            for (i, &entry) in entries.iter().enumerate() {
                let next = entries[(i + PREFETCHED).min(entries.len() - 1)];
                prefetch(buffer.record(next));
                let number = self.count;
                let (layer, seen) = Layer::<L>::new(buffer.record(entry), buffer.surface(entry), number);
                if seen.bits() == 0 {
                    continue;
                }
                covered = covered | seen;
                not_positive = not_positive | (layer.depth.less_or_equal(L::splat(0.0)) & seen);
                layer.store(&mut self.layers[number]);
                self.count += 1;
                let lane = seen.bits().trailing_zeros() as usize % LANES;
                self.keys.push(key(buffer.record(entry).depth[lane], number));
            }
        }
        // Comparisons do not tell zeros apart, as the order of all numbers does, nor do large numbers stay exact.
        (covered, not_positive.bits() == 0 && self.count <= MAX_NUMBER)
    }

    /// Puts the layers of each lane in order, if they nearly are by their keys. Gives up, and false, after too many moves.
    #[inline(always)]
    fn insert_all<L: Lanes>(&mut self) -> bool {
        self.keys.sort_unstable();
        // The last layer of each lane so far.
        let zero = L::splat(0.0);
        let mut last = Layer { depth: zero, number: zero, alpha: zero, color: [zero; 3] };
        let mut moves = 0;
        for (place, &key) in self.keys.iter().enumerate() {
            let mut layer = Layer::load(&self.layers[key as u32 as usize]);
            // A lane without a layer stays where it is.
            let seen = zero.less(layer.alpha);
            layer.depth = seen.select(layer.depth, last.depth);
            layer.number = seen.select(layer.number, last.number);
            let early = layer.before(&last);
            if early.bits() == 0 {
                layer.store(&mut self.ordered[place]);
                last = layer;
            } else {
                moves += insert(&mut self.ordered[..=place], layer);
                last = Layer::select(early, &last, &layer);
                if moves > MAX_MOVES * (place + 1) {
                    return false;
                }
            }
        }
        true
    }

    /// Puts the layers of each lane in order, whatever order they are in; of equal depths the first stays first.
    fn sort_lanes(&mut self) {
        let Self { layers, ordered, count, keys } = self;
        let (layers, ordered) = (&layers[..*count], &mut ordered[..*count]);
        ordered.fill(StoredLayer::default());
        for lane in 0..LANES {
            let seen = layers.iter().enumerate().filter(|(_, layer)| layer.alpha[lane] > 0.0);
            keys.clear();
            keys.extend(seen.map(|(number, layer)| key(layer.depth[lane], number)));
            keys.sort_unstable();
            for (to, &key) in ordered.iter_mut().zip(&*keys) {
                let from = &layers[key as u32 as usize];
                to.alpha[lane] = from.alpha[lane];
                for (to, from) in to.color.iter_mut().zip(&from.color) {
                    to[lane] = from[lane];
                }
            }
        }
    }
}

/// Inserts a layer into those that are in order before the last place, which is free. Gives the number of places by which
/// it moved.
#[inline(always)]
fn insert<L: Lanes>(layers: &mut [StoredLayer], mut layer: Layer<L>) -> usize {
    let last = layers.len() - 1;
    let mut place = last;
    while place > 0 {
        let other = Layer::load(&layers[place - 1]);
        let early = layer.before(&other);
        if early.bits() == 0 {
            break;
        }
        Layer::select(early, &other, &layer).store(&mut layers[place]);
        layer = Layer::select(early, &layer, &other);
        place -= 1;
    }
    layer.store(&mut layers[place]);
    last - place
}

/// A key that sorts by depth, as [`f32::total_cmp`] does, and then by a number, which stands in the lower half.
fn key(depth: f32, number: usize) -> u64 {
    let bits = depth.to_bits();
    let sortable = if bits >> 31 == 0 { bits | 1 << 31 } else { !bits };
    u64::from(sortable) << 32 | number as u64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::LaneHits;
    use crate::lanes::{Kernel, Level};
    use proptest::prelude::*;
    use proptest::test_runner::{RngSeed, TestRunner};
    use splat_abuffer::{Resolve, Resolver};
    use std::cell::RefCell;
    use wide::f32x8;

    /// What there is of a splat in a cell: depths and weights (0 where there is none).
    type Made = (Eight, Eight, SplatSurface);

    /// A buffer of one cell.
    fn buffer_of(splats: &[Made]) -> RecordBuffer {
        let mut buffer = RecordBuffer::default();
        buffer.clear(1, false, usize::MAX);
        for (rank, (depth, weight, surface)) in splats.iter().enumerate() {
            let mut page = buffer.begin(rank as u32, surface, 1).unwrap();
            let [depth, r2] = [f32x8::new(*depth), f32x8::new(*weight)];
            let missed = r2.less_or_equal(f32x8::splat(0.0));
            page.put(0, rank % 2 == 1, &LaneHits { missed, flipped: f32x8::splat(0.0), r2, depth });
            page.close(1);
        }
        buffer.group();
        buffer
    }

    /// Resolves the only cell of a buffer, and tells whether its lanes had to be sorted by keys.
    struct OneCell<'a>(&'a mut Over, &'a RecordBuffer);

    impl Kernel for OneCell<'_> {
        type Output = ([Eight; 5], bool);

        #[inline(always)]
        fn run<L: Lanes>(self) -> ([Eight; 5], bool) {
            let Self(over, buffer) = self;
            let (_, comparable) = over.collect::<L>(buffer, 0);
            let inserted = comparable && over.insert_all::<L>();
            (over.resolve_cell::<L>(buffer, 0).to_arrays(), !inserted)
        }
    }

    /// Checks that every level has the reference's bits. Gives whether the lanes had to be sorted by keys.
    fn check(splats: &[Made]) -> bool {
        let buffer = buffer_of(splats);
        let surfaces: Vec<SplatSurface> = splats.iter().map(|(.., surface)| *surface).collect();
        let mut by_keys = false;
        for level in Level::available() {
            let mut over = Over::default();
            let (found, sorted) = level.run_single(OneCell(&mut over, &buffer));
            by_keys = sorted;
            for lane in 0..LANES {
                let entries = buffer.cell(0).into_iter().flatten();
                let mut fragments: Vec<_> =
                    entries.filter_map(|&entry| buffer.fragment(entry, lane)).collect();
                let sample = Resolver::new(Resolve::Over).resolve(&mut fragments, &surfaces);
                let [red, green, blue] = sample.color;
                let expected = [red, green, blue, sample.transmittance, sample.uncovered].map(f32::to_bits);
                let found = found.map(|values| values[lane].to_bits());
                assert_eq!(found, expected, "{}, lane {lane} of {} splats", level.name(), splats.len());
            }
        }
        by_keys
    }

    /// A weight or an opacity: any, none, all, or just enough or not enough to be seen.
    fn part() -> impl Strategy<Value = f32> {
        let limit = prop_oneof![Just(MIN_ALPHA), Just(MIN_ALPHA.next_down()), Just(MIN_ALPHA.next_up())];
        prop_oneof![4 => 0.0f32..0.3, 2 => Just(1.0f32), 2 => limit, 1 => Just(0.0)]
    }

    /// Splats whose depths grow by `slope` from one to the next, but for noise: of a few values or any.
    fn splats(count: std::ops::Range<usize>, slope: f32) -> impl Strategy<Value = Vec<Made>> {
        let noise = prop_oneof![1 => 0.0f32..1.0, 1 => (0u8..4).prop_map(|value| f32::from(value) / 4.0)];
        let lanes = prop::array::uniform8((noise, part()));
        let surface = (prop::array::uniform3(-0.2f32..1.5), part())
            .prop_map(|(color, opacity)| SplatSurface { color, opacity, interval: [0.0; 2] });
        prop::collection::vec((lanes, surface), count).prop_map(move |all| {
            let made = all.into_iter().enumerate().map(|(number, (lanes, surface))| {
                let depth = lanes.map(|(noise, _)| 1.0 + slope * number as f32 + noise);
                (depth, lanes.map(|(_, weight)| weight), surface)
            });
            made.collect()
        })
    }

    #[test]
    fn any_cell_has_the_bits_of_the_reference() {
        let config = ProptestConfig {
            cases: 120,
            rng_seed: RngSeed::Fixed(1),
            failure_persistence: None,
            ..ProptestConfig::default()
        };
        let few = splats(0..30, 0.0).boxed();
        // More than 64 a sample; the former nearly in order, the latter not at all.
        let near = splats(80..200, 0.05).boxed();
        let any = splats(200..300, 0.0).boxed();
        let ways = RefCell::new([0; 2]);
        let run = TestRunner::new(config).run(&prop_oneof![few, near, any], |splats| {
            ways.borrow_mut()[usize::from(check(&splats))] += 1;
            Ok(())
        });
        run.unwrap();
        let ways = ways.into_inner();
        assert!(ways.iter().all(|&count| count > 20), "{ways:?}");
    }

    #[test]
    fn zeros_are_in_order_of_their_signs() {
        let surface = |color| SplatSurface { color: [color; 3], opacity: 0.5, interval: [0.0; 2] };
        let splats = [(0.5, 0.1), (0.0, 0.2), (-0.0, 0.4), (0.25, 0.8), (-0.0, 0.9)];
        assert!(check(&splats.map(|(depth, color)| ([depth; LANES], [1.0; LANES], surface(color)))));
    }
}
