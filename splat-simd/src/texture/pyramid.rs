//! A pyramid's texels where lanes can load them: eight neighbours of a row at once, wherever the eight start.

use super::Between;
use super::rows::Place;
use crate::lanes::LANES;
use splat_core::texture::filter::{BILINEAR_VARIANCE, KERNEL_VARIANCE, MAX_PERIODS};
use splat_core::texture::pyramid::{Level, Pyramid, Wrap};

/// Values between two channels of a level, lest the same texel's meet in one set of the cache.
const APART: usize = 48;

/// The largest position, in periods, of wraps that are no period.
const FAR: f64 = 64.0;

/// A [`Pyramid`] in linear `f32`, prepared once for lookups by lanes.
///
/// The channels of a level stand one after the other, each row with a border that repeats, clamps, mirrors or is black as the
/// texture's wrap says. So any eight texels of a row stand together, and no lookup has a branch for wraps within a
/// row; rows are wrapped one at a time. (Channels by themselves, since eight weights then meet eight texels: interleaved
/// ones need each weight four times.)
///
/// Memory: 16/3 bytes a texel and channel (two channels take as much as three), and the borders: 8 to 16 texels a row. A row of a mirrored texture
/// stands twice.
#[derive(Debug, Clone)]
pub struct LanePyramid {
    pub(super) channels: usize,
    pub(super) wrap: [Wrap; 2],
    pub(super) levels: Vec<LaneLevel>,
    /// Texels are stored over this power of two, lest sums of the largest `f32` overflow.
    pub(super) unit: f32,
}

/// One level.
#[derive(Debug, Clone)]
pub(super) struct LaneLevel {
    /// Texels per axis.
    pub size: [f64; 2],
    /// What set-up needs of it.
    pub metric: Metric,
    columns: Columns,
    rows: Rows,
    /// Values of one channel.
    plane: usize,
    /// From one channel to the next.
    distance: usize,
    texels: Vec<f32>,
}

/// A level's measures, in texels of level 0 where nothing else is said.
#[derive(Debug, Clone, Copy)]
pub(super) struct Metric {
    /// The larger side of a texel.
    pub coarseness: f32,
    /// Texels of this level per texel of level 0, per axis.
    pub scale: [f32; 2],
    /// What variance-compensated EWA adds to the diagonal of the ellipse's matrix.
    pub rest: [f32; 2],
    /// The most that an ellipse reaches from its centre, in texels of this level.
    pub reach: [f32; 2],
    /// The variance of bilinear interpolation, per axis the larger.
    pub variance: f32,
    /// The reciprocal of the distance to the next level, where there is one: of logarithms of coarseness, to the base 2,
    /// and of variances.
    pub per_step: [f32; 2],
}

/// How columns are found in a row.
#[derive(Debug, Clone, Copy)]
struct Columns {
    /// Texels of one channel of a row, borders included.
    stride: usize,
    /// After how many texels they repeat; [`i32::MAX`] for wraps that have borders instead.
    period: i32,
    /// The least and the greatest start of eight texels of which one at least differs from the border.
    range: [i32; 2],
    /// Texels of the border at the left.
    border: i32,
    /// The first and the last column that stands as it is numbered.
    interior: [i32; 2],
}

/// How rows are found.
#[derive(Debug, Clone, Copy)]
struct Rows {
    wrap: Wrap,
    count: i32,
}

/// Where eight texels of a row start, before the border; moved along the row in steps of [`LANES`].
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Column(i32);

impl Columns {
    fn new(wrap: Wrap, count: u32) -> Self {
        let eight = LANES as i32;
        let count = count as i32;
        let periodic = |period: i32| {
            let period = period * ((eight + period - 1) / period);
            let stride = period + eight;
            Self {
                stride: stride as usize,
                period,
                range: [0, i32::MAX],
                border: 0,
                interior: [0, stride - 1],
            }
        };
        match wrap {
            Wrap::Repeat => periodic(count),
            Wrap::Mirror => periodic(2 * count),
            Wrap::Clamp | Wrap::Black => Self {
                stride: (count + 2 * eight) as usize,
                period: i32::MAX,
                range: [-eight, count],
                border: eight,
                interior: [-eight, count + eight - 1],
            },
        }
    }

    /// The place of texel `x`, any at all.
    #[inline(always)]
    fn start(&self, x: i32) -> Column {
        let within = self.period == i32::MAX || (0..self.period).contains(&x);
        Column(if within { x } else { x.rem_euclid(self.period) })
    }

    /// Eight texels farther.
    #[inline(always)]
    fn advance(&self, column: Column) -> Column {
        let next = column.0.saturating_add(LANES as i32);
        Column(if next >= self.period { next - self.period } else { next })
    }

    /// The place in the row.
    #[inline(always)]
    fn offset(&self, column: Column) -> isize {
        column.0.clamp(self.range[0], self.range[1]) as isize + self.border as isize
    }
}

impl Rows {
    /// The number of the stored row that stands at `y`, any at all: below the texture is black.
    #[inline(always)]
    fn at(&self, y: i32) -> usize {
        if (0..self.count).contains(&y) {
            return y as usize;
        }
        let row = match self.wrap {
            Wrap::Repeat => y.rem_euclid(self.count),
            Wrap::Clamp => y.clamp(0, self.count - 1),
            Wrap::Mirror => {
                let place = y.rem_euclid(2 * self.count);
                place.min(2 * self.count - 1 - place)
            }
            Wrap::Black => self.count,
        };
        row as usize
    }
}

/// The channels of a level.
#[derive(Clone, Copy)]
pub(super) struct Planes<'a, const C: usize>([&'a [f32]; C]);

impl LaneLevel {
    /// Where the row at `y` starts in each channel; any y at all.
    #[inline(always)]
    pub fn row(&self, y: i32) -> isize {
        self.rows.at(y) as isize * self.columns.stride as isize
    }

    /// The place of texel `x` of any row, any at all.
    #[inline(always)]
    pub fn column(&self, x: i32) -> Column {
        self.columns.start(x)
    }

    /// Eight texels farther.
    #[inline(always)]
    pub fn advance(&self, column: Column) -> Column {
        self.columns.advance(column)
    }

    /// The place in the row.
    #[inline(always)]
    pub fn in_row(&self, column: Column) -> isize {
        self.columns.offset(column)
    }

    /// From one row to the next.
    #[inline(always)]
    pub fn stride(&self) -> isize {
        self.columns.stride as isize
    }

    /// Whether texels of these ranges stand as they are numbered, borders included.
    #[inline(always)]
    pub fn is_interior(&self, columns: [i32; 2], rows: [i32; 2]) -> bool {
        columns[0] >= self.columns.interior[0]
            && columns[1] <= self.columns.interior[1]
            && rows[0] >= 0
            && rows[1] < self.rows.count
    }

    /// Where a texel stands, if it stands as it is numbered.
    #[inline(always)]
    pub fn offset(&self, x: i32, y: i32) -> isize {
        y as isize * self.stride() + x as isize + self.columns.border as isize
    }

    /// The texels.
    #[inline(always)]
    pub fn planes<const C: usize>(&self) -> Planes<'_, C> {
        let length = self.plane;
        let mut planes: [&[f32]; C] = [&[]; C];
        for (channel, plane) in planes.iter_mut().enumerate() {
            // All of the same length, so that one test of an index serves all.
            *plane = &self.texels[channel * self.distance..][..length];
        }
        Planes(planes)
    }
}

impl<'a, const C: usize> Planes<'a, C> {
    /// `N` texels of each channel. None only where there are not as many, which never is.
    #[inline(always)]
    pub fn texels<const N: usize>(&self, offset: isize) -> Option<[&'a [f32; N]; C]> {
        let start = offset as usize;
        let mut texels = [&[0.0; N]; C];
        for (texels, plane) in texels.iter_mut().zip(self.0) {
            *texels = plane.get(start..)?.first_chunk()?;
        }
        Some(texels)
    }
}

impl LanePyramid {
    /// The pyramid's texels, made linear and arranged for lanes.
    pub fn new(pyramid: &Pyramid) -> Self {
        let unit = unit(pyramid);
        let mut levels: Vec<LaneLevel> =
            (0..pyramid.levels().len()).map(|index| level(pyramid, index, unit)).collect();
        for index in 1..levels.len() {
            let (finer, coarser) = (levels[index - 1].metric, levels[index].metric);
            let octaves = libm::log2(f64::from(coarser.coarseness) / f64::from(finer.coarseness));
            levels[index - 1].metric.per_step =
                [(1.0 / octaves) as f32, 1.0 / (coarser.variance - finer.variance)];
        }
        Self { channels: pyramid.channels(), wrap: pyramid.wrap(), levels, unit }
    }

    /// Values per texel, 1 to 4.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// What lies beyond the edges, in s and t.
    pub fn wrap(&self) -> [Wrap; 2] {
        self.wrap
    }

    /// Where a position is among the texels of a level.
    #[inline(always)]
    pub(super) fn place(&self, level: usize, [s, t]: [f32; 2]) -> Place {
        let size = self.levels[level].size;
        let (x, y) = (reduced(s, self.wrap[0]) * size[0] - 0.5, reduced(t, self.wrap[1]) * size[1] - 0.5);
        let (column, row) = (x.floor(), y.floor());
        Place { whole: [column as i32, row as i32], rest: [(x - column) as f32, (y - row) as f32] }
    }

    /// The coarsest level whose texels are at most `size` large, in texels of level 0; 0 if there is none.
    #[inline(always)]
    pub(super) fn coarsest_within(&self, size: f32) -> usize {
        // The level of powers of two is not too coarse, and right but for roundings up.
        let octave = (size.to_bits() >> 23) as i32 - 127;
        let mut level = (octave.max(0) as usize).min(self.levels.len() - 1);
        while self.levels.get(level + 1).is_some_and(|next| next.metric.coarseness <= size) {
            level += 1;
        }
        level
    }

    /// Between the levels whose texels are `width` texels of level 0 large, on a logarithmic scale.
    #[inline(always)]
    pub(super) fn of_width(&self, width: f32) -> Between {
        let finer = self.coarsest_within(width);
        let Metric { coarseness, per_step, .. } = self.levels[finer].metric;
        let share = logarithm((width / coarseness).clamp(1.0, 2.0)) * per_step[0];
        Between { finer, share: share.clamp(0.0, 1.0) }
    }

    /// Between the levels of which bilinear interpolation has this variance.
    #[inline(always)]
    pub(super) fn of_variance(&self, variance: f32) -> Between {
        // Of powers of two, level L has 4^L / 4 - 1 / 12.
        let mut finer = self.coarsest_within((4.0 * variance + 1.0 / 3.0).sqrt());
        while finer > 0 && self.levels[finer].metric.variance > variance {
            finer -= 1;
        }
        while self.levels.get(finer + 1).is_some_and(|next| next.metric.variance <= variance) {
            finer += 1;
        }
        let Metric { variance: least, per_step, .. } = self.levels[finer].metric;
        Between { finer, share: ((variance - least) * per_step[1]).clamp(0.0, 1.0) }
    }

    /// A level's measures; those of the coarsest for any beyond.
    #[inline(always)]
    pub(super) fn metric(&self, level: usize) -> &Metric {
        &self.levels[level.min(self.levels.len() - 1)].metric
    }

    /// Texels of the finest level, in s and t.
    pub fn size(&self) -> [u32; 2] {
        self.levels[0].size.map(|count| count as u32)
    }
}

/// A position in periods, reduced by the wrap so that texel indices are small; what is not finite becomes 0.
#[inline(always)]
fn reduced(position: f32, wrap: Wrap) -> f64 {
    let position = if position.is_finite() { f64::from(position) } else { 0.0 };
    match wrap {
        Wrap::Repeat => position - position.floor(),
        Wrap::Mirror => position - 2.0 * (0.5 * position).floor(),
        Wrap::Clamp | Wrap::Black => position.clamp(-FAR, FAR),
    }
}

/// The logarithm to the base 2 of a ratio in [1, 2], by the series of `2 artanh(z)`, z = (x - 1) / (x + 1) <= 1/3: what is
/// left out is below 2 z^13 / 13 / ln 2 = 1.4e-7.
#[inline(always)]
fn logarithm(x: f32) -> f32 {
    let z = (x - 1.0) / (x + 1.0);
    let z2 = z * z;
    let [a, b, c, d, e] = [1.0 / 3.0, 1.0 / 5.0, 1.0 / 7.0, 1.0 / 9.0, 1.0 / 11.0];
    let series = ((((e * z2 + d) * z2 + c) * z2 + b) * z2 + a) * z2 + 1.0;
    2.0 * std::f32::consts::LOG2_E * z * series
}

/// The power of two over which texels are stored: 1 unless they are so large that a sum of weighted ones may overflow.
fn unit(pyramid: &Pyramid) -> f32 {
    let finest = &pyramid.levels()[0];
    let [width, height] = finest.size().map(i64::from);
    let texels = (0..height).flat_map(|y| (0..width).map(move |x| pyramid.texel(0, x, y)));
    let greatest = texels.flatten().fold(0.0_f32, |greatest, value| greatest.max(value.abs()));
    if greatest > 1e30 { 1_048_576.0 } else { 1.0 }
}

fn level(pyramid: &Pyramid, index: usize, unit: f32) -> LaneLevel {
    let source = &pyramid.levels()[index];
    let [width, height] = source.size();
    let columns = Columns::new(pyramid.wrap()[0], width);
    let rows = Rows { wrap: pyramid.wrap()[1], count: height as i32 };
    let black = i64::from(rows.wrap == Wrap::Black);
    let channels = pyramid.channels();
    let plane = (i64::from(height) + black) as usize * columns.stride;
    let distance = plane + APART;
    // Kernels are compiled for 1, 3 and 4 channels.
    let stored = if channels == 2 { 3 } else { channels };
    let mut texels = vec![0.0; distance * stored];
    for y in 0..plane / columns.stride {
        for column in 0..columns.stride {
            // The black row, too, stands where the pyramid is black.
            let texel = pyramid.texel(index, column as i64 - i64::from(columns.border), y as i64);
            for (channel, value) in texel.into_iter().enumerate().take(channels) {
                texels[channel * distance + y * columns.stride + column] = value / unit;
            }
        }
    }
    let size = [f64::from(width), f64::from(height)];
    LaneLevel { size, metric: metric(source), columns, rows, plane, distance, texels }
}

fn metric(level: &Level) -> Metric {
    let size = level.texel_size();
    let variance = |axis: usize| level.variance()[axis] + size[axis] * size[axis] * BILINEAR_VARIANCE;
    Metric {
        coarseness: level.coarseness() as f32,
        scale: size.map(|size| (1.0 / size) as f32),
        rest: level.variance().map(|variance| ((BILINEAR_VARIANCE - variance) / KERNEL_VARIANCE) as f32),
        reach: level.size().map(|count| (MAX_PERIODS * f64::from(count)) as f32),
        variance: variance(0).max(variance(1)) as f32,
        per_step: [0.0; 2],
    }
}
