//! PLY files of trained splats, packed or not.

use super::compressed::{PackedSplats, is_packed};
use super::gaussians::{Splats, is_trained};
use super::header::Header;
use super::rows::{Rows, Table, Tables};
use super::{behind, read_tables, report};
use crate::source::Source;
use crate::table::Element;
use crate::trained::Gaussians;
use crate::{Error, Import, ImportReport, Usage};
use std::io::Read;

/// Whether a table of points is one of trained splats.
pub(super) fn holds_splats(points: &Element) -> bool {
    is_trained(points) || is_packed(points)
}

/// Reads the tables behind a header whose table of points has trained splats.
pub(super) fn read<R: Read>(header: &Header, mut source: Source<R>) -> Result<Import, Error> {
    let path = source.path().to_owned();
    let points = header.points(&path)?;
    let read = if is_packed(&header.elements[points]) { read_packed } else { read_plain };
    let splats = read(header, points, &mut source)?;
    let more = behind(header, splats.end, &mut source)?;
    let (sha256, bytes) = source.finish()?;
    let elements = header.elements.iter().enumerate().map(|(index, element)| {
        let mut report = report(element, splats.usages[index].as_ref());
        report.is_points = index == points;
        report
    });
    let report = ImportReport {
        path,
        format: format!("PLY of {}, {}", splats.kind, header.format.describe()),
        bytes,
        sha256,
        elements: elements.collect(),
        assumptions: splats.gaussians.assumptions(splats.flat),
        losses: more.into_iter().collect(),
    };
    Ok(Import { cloud: splats.gaussians.finish(), report })
}

/// What was read.
struct TrainedTables {
    gaussians: Gaussians,
    /// Whether they are 2DGS.
    flat: bool,
    kind: &'static str,
    /// Number of tables up to the last one that was read.
    end: usize,
    /// Per element, if it is used: per property.
    usages: Vec<Option<Vec<Usage>>>,
}

fn read_plain<R: Read>(
    header: &Header,
    points: usize,
    source: &mut Source<R>,
) -> Result<TrainedTables, Error> {
    header.check_claims(points, points, source)?;
    let mut table = OneTable { index: points, rows: Splats::new(&header.elements[points], source.path())? };
    read_tables(header, source, &mut table)?;
    let end = table.end();
    let Splats { gaussians, flat, usages, .. } = table.rows;
    let mut all = vec![None; header.elements.len()];
    all[points] = Some(usages);
    Ok(TrainedTables { gaussians, flat, kind: "trained splats", end, usages: all })
}

fn read_packed<R: Read>(
    header: &Header,
    points: usize,
    source: &mut Source<R>,
) -> Result<TrainedTables, Error> {
    header.check_claims(points, header.elements.len() - 1, source)?;
    let mut packed = PackedSplats::new(header, points, source.path())?;
    read_tables(header, source, &mut packed)?;
    let usages = (0..header.elements.len()).map(|index| packed.usages(index)).collect();
    let end = packed.end();
    let gaussians = packed.unpack(source.path())?;
    Ok(TrainedTables { gaussians, flat: false, kind: "compressed trained splats", end, usages })
}

/// A file of which one table is wanted.
struct OneTable<T> {
    index: usize,
    rows: T,
}

impl<T: Rows> Tables for OneTable<T> {
    fn end(&self) -> usize {
        self.index + 1
    }

    fn table(&mut self, index: usize) -> Table<'_> {
        if index == self.index { Table::Rows(&mut self.rows) } else { Table::Skipped }
    }
}
