//! PLY files of trained splats, packed or not.

use super::compressed::{PackedSplats, is_packed};
use super::gaussians::Splats;
use super::header::Header;
use super::rows::{Rows, Table, Tables};
use super::{read_tables, report};
use crate::source::Source;
use crate::{ElementReport, Error, Import, ImportReport};
use std::io::Read;

/// Reads the tables behind a header whose table of points has trained splats.
pub(super) fn read<R: Read>(header: &Header, mut source: Source<R>) -> Result<Import, Error> {
    let path = source.path().to_owned();
    let points = header.points(&path)?;
    let elements: Vec<ElementReport>;
    let (gaussians, flat, kind);
    if is_packed(&header.elements[points]) {
        header.check_claims(points, header.elements.len() - 1, &source)?;
        let mut packed = PackedSplats::new(header, points, &path)?;
        read_tables(header, &mut source, &mut packed)?;
        let reports = header.elements.iter().enumerate();
        let reports = reports.map(|(index, element)| report(element, packed.usages(index).as_ref()));
        elements = reports
            .map(|element| ElementReport {
                is_points: element.name == header.elements[points].name,
                ..element
            })
            .collect();
        (gaussians, flat, kind) = (packed.unpack(&path)?, false, "compressed trained splats");
    } else {
        header.check_claims(points, points, &source)?;
        let mut table = OneTable { index: points, rows: Splats::new(&header.elements[points], &path)? };
        read_tables(header, &mut source, &mut table)?;
        let splats = table.rows;
        let reports = header.elements.iter().enumerate();
        let usages = |index| (index == points).then_some(&splats.usages);
        elements = reports.map(|(index, element)| report(element, usages(index))).collect();
        (gaussians, flat, kind) = (splats.gaussians, splats.flat, "trained splats");
    }
    let (sha256, bytes) = source.finish()?;
    let report = ImportReport {
        path,
        format: format!("PLY of {kind}, {}", header.format.describe()),
        bytes,
        sha256,
        elements,
        assumptions: gaussians.assumptions(flat),
    };
    Ok(Import { cloud: gaussians.finish(), report })
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
