//! The tables as text.

use crate::measure::{Column, FILTERS, Measured, Method};

/// Times of one image and set: a row a method, a column an anisotropy.
pub fn times(columns: &[Column]) -> String {
    let mut text = String::from("| filter | core |");
    for column in columns {
        text += &format!(" {}:1, ns | ratio | texels |", column.anisotropy);
    }
    text += &format!("\n|---|---|{}", "---|---|---|".repeat(columns.len()));
    for method in Method::all() {
        text += &format!("\n| {} | {} |", name(method), core(method));
        for column in columns {
            let (found, printed) = (of(column, method), &column.methods[0]);
            text += &format!(" {:.0} | {:.2} | {:.0} |", found.time, printed.time / found.time, found.texels);
        }
    }
    text
}

/// Errors of one image and set. Lanes have the same bits at every level, so one row stands for all.
pub fn errors(columns: &[Column]) -> String {
    let mut text = String::from("| filter | core |");
    for column in columns {
        text += &format!(" {}:1, RMSE | max | of printed |", column.anisotropy);
    }
    text += &format!("\n|---|---|{}", "---|---|---|".repeat(columns.len()));
    let is_first = |method: &Method| method.level.is_none_or(|level| level == splat_simd::Level::Portable);
    for method in Method::all().into_iter().filter(is_first) {
        let core = if method.level.is_some() { "lanes" } else { "scalar" };
        text += &format!("\n| {} | {core} |", name(method));
        for column in columns {
            let [root, greatest] = of(column, method).errors.map(|error| 1e3 * error);
            text += &format!(" {root:.2} | {greatest:.1} | {:.2} |", 1e-3 * root / column.best_printed);
        }
    }
    text
}

/// What was measured of a method.
pub fn of(column: &Column, method: Method) -> &Measured {
    column.methods.iter().find(|found| found.method == method).unwrap_or(&column.methods[0])
}

/// The filter's name.
pub fn name(method: Method) -> &'static str {
    FILTERS.iter().find(|(_, filter)| *filter == method.filter).map_or("", |(name, _)| name)
}

fn core(method: Method) -> &'static str {
    method.level.map_or("scalar", |level| level.name())
}
