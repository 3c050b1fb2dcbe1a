//! The tables as text.

use splat_bench::textures::measure::{Column, Method};

/// Times of one image and set: a row a method, a column an anisotropy.
pub fn times(columns: &[Column]) -> String {
    let mut text = String::from("| filter | core |");
    for column in columns {
        text += &format!(" {}:1, ns | ratio | texels |", column.anisotropy);
    }
    text += &format!("\n|---|---|{}", "---|---|---|".repeat(columns.len()));
    for method in Method::all() {
        text += &format!("\n| {} | {} |", method.name(), method.core());
        for column in columns {
            let (found, printed) = (column.of(method), &column.methods[0]);
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
        text += &format!("\n| {} | {core} |", method.name());
        for column in columns {
            let [root, greatest] = column.of(method).errors.map(|error| 1e3 * error);
            text += &format!(" {root:.2} | {greatest:.1} | {:.2} |", 1e-3 * root / column.best_printed);
        }
    }
    text
}
