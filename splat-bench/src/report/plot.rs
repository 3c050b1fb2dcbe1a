//! Plots as SVG: points and lines over two logarithmic axes.

use super::labels::Labels;
use std::fmt::Write;

/// A set of points.
#[derive(Debug, Clone)]
pub struct Series {
    /// Its name in the legend.
    pub name: String,
    /// x, y, and what is written beside the point.
    pub points: Vec<(f64, f64, String)>,
    /// Whether a line joins them.
    pub joined: bool,
    /// Whether they are rings around other series' points.
    pub rings: bool,
}

/// A plot over logarithmic axes.
#[derive(Debug, Clone)]
pub struct Plot {
    /// Its title.
    pub title: String,
    /// What x and y are, with units.
    pub axes: [String; 2],
    /// What it shows.
    pub series: Vec<Series>,
}

const SIZE: [f64; 2] = [700.0, 400.0];

/// Left, right, top and bottom of the plot within the picture.
const FRAME: [f64; 4] = [70.0, 470.0, 30.0, 350.0];

/// Colours that are told apart also by the colour-blind (Okabe and Ito 2008, the light ones darker, and two more).
const COLORS: [&str; 9] =
    ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#b07800", "#3a9bd0", "#000000", "#7f3fbf", "#888888"];

impl Plot {
    /// The plot as an `svg` element. Points without a logarithm are left out.
    pub fn to_svg(&self) -> String {
        let shown = |x: f64, y: f64| x > 0.0 && y > 0.0 && x.is_finite() && y.is_finite();
        let points = || self.series.iter().flat_map(|s| &s.points).filter(|p| shown(p.0, p.1));
        let range = |value: fn(&(f64, f64, String)) -> f64| {
            let logs = points().map(|point| value(point).log10());
            let (low, high) = logs.fold((f64::MAX, f64::MIN), |(low, high), l| (low.min(l), high.max(l)));
            let room = 0.05 * (high - low).max(0.2);
            [low - room, high + room]
        };
        let [width, height] = SIZE;
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" height=\"{height}\" \
             font-family=\"sans-serif\" font-size=\"11\" role=\"img\">\n<title>{0}</title>\n\
             <rect width=\"{width}\" height=\"{height}\" fill=\"#fff\"/>\n\
             <text x=\"{1}\" y=\"18\" font-size=\"13\" font-weight=\"bold\">{0}</text>\n",
            escape(&self.title),
            FRAME[0]
        );
        if points().next().is_none() {
            return svg + "</svg>\n";
        }
        let ranges = [range(|p| p.0), range(|p| p.1)];
        let place = |x: f64, y: f64| {
            let part = |value: f64, [low, high]: [f64; 2]| (value.log10() - low) / (high - low);
            let [left, right, top, bottom] = FRAME;
            [left + part(x, ranges[0]) * (right - left), bottom - part(y, ranges[1]) * (bottom - top)]
        };
        self.write_axes(&mut svg, ranges, place);
        let mut labels = Labels { area: FRAME, ..Labels::default() };
        for (number, series) in self.series.iter().enumerate() {
            let color = if series.rings { "#000000" } else { COLORS[number % COLORS.len()] };
            let mark = if series.rings {
                format!("r=\"5\" fill=\"none\" stroke=\"{color}\"")
            } else {
                format!("r=\"3\" fill=\"{color}\"")
            };
            let places: Vec<([f64; 2], &str)> = series
                .points
                .iter()
                .filter(|(x, y, _)| shown(*x, *y))
                .map(|(x, y, label)| (place(*x, *y), label.as_str()))
                .collect();
            if series.joined {
                let path: Vec<String> = places.iter().map(|([x, y], _)| format!("{x:.1},{y:.1}")).collect();
                write_line(
                    &mut svg,
                    &format!(
                        "<polyline points=\"{}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"1.3\"/>",
                        path.join(" ")
                    ),
                );
            }
            for ([x, y], label) in places {
                write_line(&mut svg, &format!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" {mark}/>"));
                labels.points.push([x, y]);
                labels.texts.push(([x, y], label.to_owned(), color));
            }
            let y = FRAME[2] + 8.0 + 16.0 * number as f64;
            let x = FRAME[1] + 15.0;
            write_line(
                &mut svg,
                &format!(
                    "<circle cx=\"{x}\" cy=\"{y}\" {mark}/><text x=\"{}\" y=\"{}\" font-size=\"10\">{}</text>",
                    x + 8.0,
                    y + 4.0,
                    escape(&series.name)
                ),
            );
        }
        labels.write(&mut svg);
        svg + "</svg>\n"
    }

    /// The frame, lines at powers of ten (and at 2 and 5 times those where there are few), and their numbers.
    fn write_axes(&self, svg: &mut String, ranges: [[f64; 2]; 2], place: impl Fn(f64, f64) -> [f64; 2]) {
        let [left, right, top, bottom] = FRAME;
        let corner = ranges.map(|range| 10f64.powf(range[0]));
        for x in ticks(ranges[0]) {
            let [at, _] = place(x, corner[1]);
            write_line(
                svg,
                &format!(
                    "<line x1=\"{at:.1}\" y1=\"{top}\" x2=\"{at:.1}\" y2=\"{bottom}\" stroke=\"#ddd\"/>\
                 <text x=\"{at:.1}\" y=\"{}\" text-anchor=\"middle\">{}</text>",
                    bottom + 14.0,
                    number(x)
                ),
            );
        }
        for y in ticks(ranges[1]) {
            let [_, at] = place(corner[0], y);
            write_line(
                svg,
                &format!(
                    "<line x1=\"{left}\" y1=\"{at:.1}\" x2=\"{right}\" y2=\"{at:.1}\" stroke=\"#ddd\"/>\
                 <text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
                    left - 4.0,
                    at + 4.0,
                    number(y)
                ),
            );
        }
        let (middle_x, middle_y) = (0.5 * (left + right), 0.5 * (top + bottom));
        write_line(
            svg,
            &format!(
                "<rect x=\"{left}\" y=\"{top}\" width=\"{}\" height=\"{}\" fill=\"none\" stroke=\"#888\"/>\
             <text x=\"{middle_x}\" y=\"{}\" text-anchor=\"middle\">{}</text>\
             <text transform=\"translate(14 {middle_y}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
                right - left,
                bottom - top,
                bottom + 34.0,
                escape(&self.axes[0]),
                escape(&self.axes[1])
            ),
        );
    }
}

pub fn write_line(svg: &mut String, line: &str) {
    // Writing to a string cannot fail.
    let _ = writeln!(svg, "{line}");
}

/// Round numbers within a range of logarithms.
fn ticks([low, high]: [f64; 2]) -> Vec<f64> {
    let steps: &[f64] = if high - low > 2.5 { &[1.0] } else { &[1.0, 2.0, 5.0] };
    let powers = low.floor() as i32..=high.ceil() as i32;
    let all = powers.flat_map(|power| steps.iter().map(move |step| step * 10f64.powi(power)));
    all.filter(|tick| (low..=high).contains(&tick.log10())).collect()
}

/// A number in few characters.
pub fn number(value: f64) -> String {
    let size = value.abs();
    if value == 0.0 {
        "0".into()
    } else if !value.is_finite() {
        format!("{value}")
    } else if !(1e-3..1e6).contains(&size) {
        format!("{value:.1e}")
    } else if size >= 100.0 {
        format!("{value:.0}")
    } else {
        // Three digits, without the zeros at the end.
        let digits = (2 - size.log10().floor() as i32).max(0) as usize;
        let text = format!("{value:.digits$}");
        if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').into() } else { text }
    }
}

/// Text for HTML and SVG.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_three_digits() {
        let numbers = [0.0, 12.345, 0.5, 1234.5, 1.5e-7, 0.01234, 2e7].map(number);
        assert_eq!(numbers, ["0", "12.3", "0.5", "1234", "1.5e-7", "0.0123", "2.0e7"]);
    }

    #[test]
    fn a_plot_is_well_formed_and_shows_its_points() {
        let points = vec![(1.0, 0.1, "a<b".into()), (10.0, 0.01, "c".into()), (0.0, 1.0, "d".into())];
        let series = vec![Series { name: "one".into(), points, joined: true, rings: false }];
        let svg = Plot { title: "t".into(), axes: ["x".into(), "y".into()], series }.to_svg();
        assert!(svg.starts_with("<svg") && svg.ends_with("</svg>\n"));
        // Two points and one entry of the legend; the point at 0 has no logarithm.
        assert_eq!(svg.matches("<circle").count(), 3);
        assert!(svg.contains("a&lt;b") && !svg.contains("NaN"));
    }

    #[test]
    fn an_empty_plot_is_no_trouble() {
        let svg =
            Plot { title: String::new(), axes: [String::new(), String::new()], series: vec![] }.to_svg();
        assert!(svg.ends_with("</svg>\n"));
    }
}
