//! The page: one file, nothing from elsewhere.

use super::plot::{Plot, escape};
use std::fmt::Write;

/// A part of the report.
#[derive(Debug, Clone, Default)]
pub struct Section {
    /// Its title.
    pub title: String,
    /// What stands in it, in order.
    pub blocks: Vec<Block>,
}

/// What a part is made of.
#[derive(Debug, Clone)]
pub enum Block {
    /// A heading.
    Heading(String),
    /// A paragraph.
    Text(String),
    /// What to choose, or whether something holds.
    Verdict(String),
    /// Names of the columns, and rows.
    Table(Vec<String>, Vec<Vec<String>>),
    /// A plot.
    Plot(Plot),
}

impl Section {
    /// An empty part.
    pub fn new(title: &str) -> Self {
        Self { title: title.into(), blocks: Vec::new() }
    }

    /// Adds a heading.
    pub fn heading(&mut self, text: impl Into<String>) {
        self.blocks.push(Block::Heading(text.into()));
    }

    /// Adds a paragraph.
    pub fn text(&mut self, text: impl Into<String>) {
        self.blocks.push(Block::Text(text.into()));
    }

    /// Adds a conclusion.
    pub fn verdict(&mut self, text: impl Into<String>) {
        self.blocks.push(Block::Verdict(text.into()));
    }

    /// Adds a table.
    pub fn table(&mut self, names: &[&str], rows: Vec<Vec<String>>) {
        self.blocks.push(Block::Table(names.iter().map(|&name| name.into()).collect(), rows));
    }
}

const STYLE: &str = "body{font:15px/1.45 sans-serif;max-width:72rem;margin:2rem auto;padding:0 1rem;color:#222}\
table{border-collapse:collapse;margin:1rem 0;font-size:13px}\
td,th{border-bottom:1px solid #ddd;padding:.15rem .6rem;text-align:right}\
td:first-child,th:first-child{text-align:left}th{background:#f4f4f4}\
.verdict{background:#eef6ee;border-left:4px solid #4a4;padding:.5rem .8rem}svg{max-width:100%;height:auto}";

/// The whole page.
pub fn page(title: &str, introduction: &[String], sections: &[Section]) -> String {
    let mut html = format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{0}</title>\
         <style>{STYLE}</style></head>\n<body><h1>{0}</h1>\n",
        escape(title)
    );
    for paragraph in introduction {
        html += &format!("<p>{}</p>\n", escape(paragraph));
    }
    for section in sections {
        html += &format!("<h2>{}</h2>\n", escape(&section.title));
        for block in &section.blocks {
            write_block(&mut html, block);
        }
    }
    html + "</body></html>\n"
}

fn write_block(html: &mut String, block: &Block) {
    // Writing to a string cannot fail.
    let _ = match block {
        Block::Heading(text) => writeln!(html, "<h3>{}</h3>", escape(text)),
        Block::Text(text) => writeln!(html, "<p>{}</p>", escape(text)),
        Block::Verdict(text) => writeln!(html, "<p class=\"verdict\">{}</p>", escape(text)),
        Block::Plot(plot) => writeln!(html, "<p>{}</p>", plot.to_svg()),
        Block::Table(names, rows) => {
            let cells = |tag: &str, cells: &[String]| {
                cells.iter().map(|cell| format!("<{tag}>{}</{tag}>", escape(cell))).collect::<String>()
            };
            let rows: String = rows.iter().map(|row| format!("<tr>{}</tr>\n", cells("td", row))).collect();
            writeln!(html, "<table>\n<tr>{}</tr>\n{rows}</table>", cells("th", names))
        }
    };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_needs_nothing_from_elsewhere() {
        let mut section = Section::new("a & b");
        section.heading("h");
        section.text("x < y");
        section.verdict("yes");
        section.table(&["p", "q"], vec![vec!["1".into(), "2".into()]]);
        let html = page("title", &["hello".into()], &[section]);
        assert!(html.contains("a &amp; b") && html.contains("x &lt; y") && html.contains("<td>2</td>"));
        for foreign in ["src=", "href=", "url(", "@import", "<script"] {
            assert!(!html.contains(foreign), "{foreign}");
        }
    }
}
