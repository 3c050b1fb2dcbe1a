//! Error against time, as SVG.

use plotters::prelude::*;
use splat_bench::textures::measure::{Column, FILTERS, Measured, Method};
use splat_simd::Level;
use std::error::Error;
use std::path::Path;

/// Pixels.
const SIZE: (u32, u32) = (1000, 800);

/// What stands beside a point, in the order of [`FILTERS`].
const LABELS: [&str; 9] =
    ["printed", "EWA", "1.5", "Q = 2", "3", "Texram", "ceiling", "Gaussian", "trilinear"];

/// Filters whose points would hide others.
const LEFT_OUT: [&str; 3] = ["1.5", "3", "ceiling"];

type Area<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;
type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<LogCoord<f64>, LogCoord<f64>>>;

/// One chart an anisotropy: each filter a line from the scalar core (circle) to AVX2 (disc).
///
/// # Errors
/// If the file cannot be written.
pub fn write(file: &Path, name: &str, columns: &[Column]) -> anyhow::Result<()> {
    draw(file, name, columns).map_err(|error| anyhow::anyhow!("{}: {error}", file.display()))
}

fn draw(file: &Path, name: &str, columns: &[Column]) -> Result<(), Box<dyn Error>> {
    let root = SVGBackend::new(file, SIZE).into_drawing_area();
    root.fill(&WHITE)?;
    for (area, column) in root.split_evenly((2, 2)).iter().zip(columns) {
        chart(area, &format!("{name}, {}:1", column.anisotropy), column)?;
    }
    Ok(root.present()?)
}

fn chart(area: &Area<'_>, title: &str, column: &Column) -> Result<(), Box<dyn Error>> {
    let range = |value: fn(&Measured) -> f64| {
        let least = column.methods.iter().map(value).fold(f64::INFINITY, f64::min);
        let greatest = column.methods.iter().map(value).fold(0.0, f64::max);
        (least / 1.5..greatest * 2.5).log_scale()
    };
    let mut chart: Chart<'_, '_> = ChartBuilder::on(area)
        .caption(title, ("sans-serif", 16))
        .margin(12)
        .x_label_area_size(36)
        .y_label_area_size(60)
        .build_cartesian_2d(range(|method| method.time), range(|method| 1e3 * method.errors[0]))?;
    chart.configure_mesh().x_desc("ns a lookup").y_desc("1000 RMSE").light_line_style(WHITE).draw()?;
    for (i, (label, (_, filter))) in LABELS.into_iter().zip(FILTERS).enumerate() {
        if LEFT_OUT.contains(&label) {
            continue;
        }
        let color = Palette99::pick(i).to_rgba();
        let at = |level: Option<Level>| {
            let found = column.of(Method { filter, level });
            (found.time, 1e3 * found.errors[0])
        };
        let (scalar, lanes) = (at(None), at(Some(Level::Avx2)));
        let has_lanes =
            column.methods.iter().any(|found| found.method.filter == filter && found.method.level.is_some());
        chart.draw_series([Circle::new(scalar, 4, color.stroke_width(1))])?;
        let end = if has_lanes { lanes } else { scalar };
        if has_lanes {
            chart.draw_series([PathElement::new([scalar, lanes], color.stroke_width(1))])?;
            chart.draw_series([Circle::new(lanes, 4, color.filled())])?;
        }
        let style = ("sans-serif", 12).into_font().color(&color);
        chart.draw_series([EmptyElement::at(end) + Text::new(label, (6, -12), style)])?;
    }
    Ok(())
}

/// Logarithmic axes of `f64`.
type LogCoord<T> = plotters::coord::combinators::LogCoord<T>;
