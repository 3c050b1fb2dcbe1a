//! Fragments of a tile, grouped by sample.

use crate::Fragment;

/// The fragments of one tile.
///
/// [`push`](Self::push) appends in any order; [`group`](Self::group) then sorts the stream by sample (a stable
/// counting sort), after which [`sample`](Self::sample) gives each sample's list. The buffer is meant to be kept
/// and [`cleared`](Self::clear) from tile to tile, so that its memory is allocated once.
#[derive(Debug, Default)]
pub struct TileBuffer {
    samples: usize,
    stream: Vec<(u32, Fragment)>,
    starts: Vec<usize>,
    grouped: Vec<Fragment>,
}

impl TileBuffer {
    /// Bytes that the buffer needs a fragment: once in the stream, once grouped.
    pub const BYTES_PER_FRAGMENT: usize = size_of::<(u32, Fragment)>() + size_of::<Fragment>();

    /// Empties the buffer for a tile of this many samples.
    pub fn clear(&mut self, samples: usize) {
        self.samples = samples;
        self.stream.clear();
        self.starts.clear();
        self.grouped.clear();
    }

    /// Number of fragments.
    pub fn len(&self) -> usize {
        self.stream.len()
    }

    /// Whether there is no fragment.
    pub fn is_empty(&self) -> bool {
        self.stream.is_empty()
    }

    /// Appends a fragment to a sample (its index within the tile), unless it is
    /// [not admitted](Fragment::is_admitted).
    pub fn push(&mut self, sample: usize, fragment: Fragment) {
        debug_assert!(sample < self.samples, "sample {sample} of {}", self.samples);
        if fragment.is_admitted() {
            self.stream.push((sample as u32, fragment));
        }
    }

    /// Groups the fragments by sample, in order of arrival within each.
    pub fn group(&mut self) {
        self.starts.clear();
        self.starts.resize(self.samples + 1, 0);
        for &(sample, _) in &self.stream {
            self.starts[sample as usize + 1] += 1;
        }
        for sample in 0..self.samples {
            self.starts[sample + 1] += self.starts[sample];
        }
        self.grouped.resize(self.stream.len(), Fragment::new(0.0, 0.0, 0, false));
        // `starts` serves as the write positions, and is shifted back by one sample when all is written.
        for &(sample, fragment) in &self.stream {
            let position = &mut self.starts[sample as usize];
            self.grouped[*position] = fragment;
            *position += 1;
        }
        self.starts.copy_within(0..self.samples, 1);
        self.starts[0] = 0;
    }

    /// The fragments of a sample, after [`group`](Self::group).
    pub fn sample(&mut self, sample: usize) -> &mut [Fragment] {
        &mut self.grouped[self.starts[sample]..self.starts[sample + 1]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_by_sample_in_order_of_arrival_and_refuses_what_is_not_admitted() {
        let mut buffer = TileBuffer::default();
        buffer.clear(4);
        for (sample, rank) in [(2, 0), (0, 1), (2, 2), (3, 3), (2, 4)] {
            buffer.push(sample, Fragment::new(1.0, 1.0, rank, false));
        }
        for bad in [f32::NAN, f32::INFINITY, 0.0, -1.0] {
            buffer.push(1, Fragment::new(1.0, bad, 9, false));
        }
        buffer.push(1, Fragment::new(f32::INFINITY, 1.0, 9, false));
        buffer.group();
        let mut ranks = |sample| buffer.sample(sample).iter().map(Fragment::rank).collect::<Vec<_>>();
        assert_eq!([ranks(0), ranks(1), ranks(2), ranks(3)], [vec![1], vec![], vec![0, 2, 4], vec![3]]);
        buffer.clear(1);
        buffer.group();
        assert!(buffer.sample(0).is_empty());
    }
}
