//! What a G-code program draws and how long it takes, for files that plotplan writes: absolute mm,
//! lines and arcs (`I`, `J`), `G93` feeds, dwells, pauses.

use std::f64::consts::TAU;

use drawing::{Point, Rect};

/// Lengths, time and extent of a program.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GcodeSummary {
    /// Lines that are no comments.
    pub lines: usize,
    /// Length of `G1`, `G2` and `G3` in the plane, mm.
    pub drawn_mm: f64,
    /// Length of `G0` in the plane, mm. Its speed is the machine's own.
    pub travel_mm: f64,
    /// Time of lines and arcs at their feeds, s, without accelerations.
    pub drawing_s: f64,
    /// Time of dwells (`G4`), s.
    pub dwell_s: f64,
    /// Extent of what is drawn, mm; `None` if nothing is.
    pub bounds: Option<Rect>,
    /// The comment of each pause (`M0`, `PAUSE`), which names the pen.
    pub pauses: Vec<String>,
}

/// Points along an arc at which its extent is taken.
const ARC_POINTS: u32 = 64;

/// Whether plotplan wrote the program: its preamble, and the comments at which it can be resumed.
pub fn is_ours(text: &str) -> bool {
    let mut preamble = text.lines().take(8);
    preamble.any(|line| line == "G90") && text.lines().any(|line| line.starts_with("; s "))
}

/// The summary of a program. Lines that are not understood count as lines only.
pub fn summary(text: &str) -> GcodeSummary {
    let mut found = GcodeSummary::default();
    let mut at = Point::ORIGIN;
    let (mut feed_mm_min, mut is_inverse_time) = (f64::INFINITY, false);
    for line in text.lines() {
        let (code, comment) = line.split_once([';', '(']).unwrap_or((line, ""));
        let words: Vec<&str> = code.split_ascii_whitespace().collect();
        let Some(first) = words.first() else { continue };
        found.lines += 1;
        let value =
            |letter: char| words.iter().rev().find_map(|word| word.strip_prefix(letter)?.parse::<f64>().ok());
        if matches!(*first, "M0" | "PAUSE") {
            found.pauses.push(comment.trim().trim_end_matches(')').to_owned());
        }
        is_inverse_time = (is_inverse_time || words.contains(&"G93")) && !words.contains(&"G94");
        if *first == "G4" {
            found.dwell_s += value('P').unwrap_or(0.0);
            continue;
        }
        feed_mm_min = value('F').unwrap_or(feed_mm_min);
        let Some(motion) = words.iter().find(|word| ["G0", "G1", "G2", "G3"].contains(word)) else {
            continue;
        };
        if value('X').is_none() && value('Y').is_none() {
            continue;
        }
        let to = Point::new(value('X').unwrap_or(at.x), value('Y').unwrap_or(at.y));
        let points = match *motion {
            "G0" | "G1" => vec![at, to],
            _ => {
                let center = at + (value('I').unwrap_or(0.0), value('J').unwrap_or(0.0));
                arc(at, to, center, *motion == "G2")
            }
        };
        let length_mm: f64 = points.windows(2).map(|pair| pair[0].distance(pair[1])).sum();
        at = to;
        if *motion == "G0" {
            found.travel_mm += length_mm;
            continue;
        }
        found.drawn_mm += length_mm;
        found.drawing_s += if is_inverse_time { 60.0 / feed_mm_min } else { 60.0 * length_mm / feed_mm_min };
        for point in points {
            let here = Rect::from_points(point, point);
            found.bounds = Some(found.bounds.map_or(here, |bounds| bounds.union(here)));
        }
    }
    found
}

/// Points along an arc about a center.
fn arc(from: Point, to: Point, center: Point, is_clockwise: bool) -> Vec<Point> {
    let angle = |point: Point| libm::atan2(point.y - center.y, point.x - center.x);
    let radius = from.distance(center);
    let mut sweep = (angle(to) - angle(from)).rem_euclid(TAU);
    if is_clockwise {
        sweep -= TAU;
    }
    // The same point twice is a full circle.
    if from == to {
        sweep = if is_clockwise { -TAU } else { TAU };
    }
    let point = |k: u32| {
        let (sin, cos) = libm::sincos(angle(from) + sweep * f64::from(k) / f64::from(ARC_POINTS));
        center + (radius * cos, radius * sin)
    };
    (0..=ARC_POINTS).map(point).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_arcs_dwells_and_pauses() {
        let program = "; made by hand\nG21\nG90\nM0 ; pen 1\nG0 X10 Y0\nM3 S90\nG4 P0.5\nG1 X20 Y0 F600\nG3 X20 Y0 I10 J0\nG1 X20 Y30\n";
        let found = summary(program);
        assert_eq!((found.lines, found.pauses), (9, vec!["pen 1".to_owned()]));
        let drawn = 10.0 + 20.0 * std::f64::consts::PI + 30.0;
        assert!((found.drawn_mm - drawn).abs() < 0.05, "{}", found.drawn_mm);
        assert!((found.drawing_s - drawn / 10.0).abs() < 0.01 && found.dwell_s == 0.5);
        assert!((found.travel_mm - 10.0).abs() < 1e-9);
        let bounds = found.bounds.unwrap();
        assert!((bounds.x1 - 40.0).abs() < 1e-9 && (bounds.y0 + 10.0).abs() < 1e-9, "{bounds:?}");
    }
}
