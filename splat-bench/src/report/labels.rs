//! What is written beside the points of a plot, where there is room.

use super::plot::{escape, write_line};

/// Size of the letters, and about how wide one is.
const HEIGHT: f64 = 9.0;
const LETTER: f64 = 5.6;

/// How far from its point a text may be, in the order in which it is tried.
const DISTANCES: [f64; 4] = [5.0, 12.0, 22.0, 34.0];

/// From where on a line leads to the point.
const FAR: f64 = 10.0;

/// Points, and the texts that belong to some of them.
#[derive(Debug, Default)]
pub struct Labels {
    /// Left, right, top and bottom of what the texts must stay in.
    pub area: [f64; 4],
    /// All points: no text may hide one.
    pub points: Vec<[f64; 2]>,
    /// Points, their texts and colours.
    pub texts: Vec<([f64; 2], String, &'static str)>,
}

/// Left, right, top and bottom.
type Rectangle = [f64; 4];

impl Labels {
    /// Writes all texts for which there is a place: for the tables have them all, and one over the other helps nobody.
    /// Of several points in one place the first text stands.
    pub fn write(&self, svg: &mut String) {
        let mut taken: Vec<Rectangle> =
            self.points.iter().map(|[x, y]| [x - 3.0, x + 3.0, y - 3.0, y + 3.0]).collect();
        let mut named: Vec<[f64; 2]> = Vec::new();
        for (point, text, color) in self.texts.iter().filter(|(_, text, _)| !text.is_empty()) {
            let is_near = |other: &[f64; 2]| (other[0] - point[0]).hypot(other[1] - point[1]) < 2.0;
            if named.iter().any(is_near) {
                continue;
            }
            let Some((place, distance)) = self.find(*point, text, &taken) else { continue };
            taken.push(place);
            named.push(*point);
            let [left, right, top, bottom] = place;
            if distance > FAR {
                let end = [point[0].clamp(left, right), point[1].clamp(top, bottom)];
                write_line(
                    svg,
                    &format!(
                        "<line x1=\"{:.1}\" y1=\"{:.1}\" x2=\"{:.1}\" y2=\"{:.1}\" stroke=\"{color}\" stroke-width=\"0.5\"/>",
                        point[0], point[1], end[0], end[1]
                    ),
                );
            }
            write_line(
                svg,
                &format!(
                    "<text x=\"{left:.1}\" y=\"{:.1}\" font-size=\"{HEIGHT}\" fill=\"{color}\">{}</text>",
                    bottom - 2.0,
                    escape(text)
                ),
            );
        }
    }

    /// A free place for a text, the nearest first, and its distance from the point.
    fn find(&self, [x, y]: [f64; 2], text: &str, taken: &[Rectangle]) -> Option<(Rectangle, f64)> {
        let width = LETTER * text.chars().count() as f64;
        let places = DISTANCES.into_iter().flat_map(|distance| {
            let slant = 0.7 * distance;
            let (left, middle) = (x - width, x - 0.5 * width);
            // Beside it, above and below it; the least x and y of the text.
            [
                [x + slant, y - slant - HEIGHT],
                [x + slant, y + slant],
                [x + distance, y - 0.5 * HEIGHT],
                [left - slant, y - slant - HEIGHT],
                [left - slant, y + slant],
                [left - distance, y - 0.5 * HEIGHT],
                [middle, y - distance - HEIGHT],
                [middle, y + distance],
            ]
            .map(|[left, top]| ([left, left + width, top, top + HEIGHT], distance))
        });
        let [left, right, top, bottom] = self.area;
        let is_inside = |r: &Rectangle| r[0] >= left && r[1] <= right && r[2] >= top && r[3] <= bottom;
        let meet = |a: &Rectangle, b: &Rectangle| a[0] < b[1] && b[0] < a[1] && a[2] < b[3] && b[2] < a[3];
        let mut free = places.filter(|(place, _)| is_inside(place) && !taken.iter().any(|t| meet(place, t)));
        free.next()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_do_not_overlap_nor_hide_points() {
        let points: Vec<[f64; 2]> =
            (0..12).map(|i| [50.0 + 4.0 * f64::from(i % 4), 50.0 + f64::from(i)]).collect();
        let labels = Labels {
            area: [0.0, 200.0, 0.0, 100.0],
            texts: points.iter().map(|&point| (point, "some text".to_owned(), "#000")).collect(),
            points: points.clone(),
        };
        let mut taken = Vec::new();
        for (point, text, _) in &labels.texts {
            if let Some((place, _)) = labels.find(*point, text, &taken) {
                for other in &taken {
                    let [a, b]: [&Rectangle; 2] = [&place, other];
                    assert!(a[0] >= b[1] || b[0] >= a[1] || a[2] >= b[3] || b[2] >= a[3]);
                }
                taken.push(place);
            }
        }
        assert!(taken.len() >= 5, "{}", taken.len());
        let mut svg = String::new();
        labels.write(&mut svg);
        assert!(svg.matches("<text").count() >= 4);
    }
}
