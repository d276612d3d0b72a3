//! Which part of the drawing each row draws: its distance from it, and the bytes it comes from.

use std::collections::BTreeMap;

use drawing::{Drawing, Line, Point, Segment, Span, Stroke, distance, distance_to_line};
use kinematics::{Machine, MotorPos};
use plan::Row;

use crate::replay;

/// Chords of curves deviate from them by at most this, mm.
const CHORD_MM: f64 = 0.002;
/// Beside the way between two rows, this much of the stroke is searched for the nearest place, mm.
const AHEAD_MM: f64 = 2.0;

/// The rows of a plan along its drawing.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Traced {
    /// The distance of each row's pen position from the stroke it draws, mm; 0 with the pen up.
    pub(super) deviation_mm: Vec<f64>,
    /// Where ink begins that comes from other bytes than the ink before, in the order of time.
    pub(super) pieces: Vec<Piece>,
}

/// Ink from one place of the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Piece {
    /// Its first row.
    pub(super) row: usize,
    /// Its bytes.
    pub(super) source: Span,
}

/// Follows the rows along the strokes. `None` if the plan does not have one pen down for each stroke of
/// `drawn`: then it is another drawing's.
pub(super) fn trace(rows: &[Row], machine: &Machine, drawn: &Drawing, placed: &Drawing) -> Option<Traced> {
    let runs = pen_downs(rows);
    if runs.len() != drawn.strokes.len() {
        return None;
    }
    // Joined strokes have the bytes of one of them.
    let is_joined = drawn.strokes.len() != placed.strokes.len();
    let sources = if is_joined { sources(placed) } else { BTreeMap::new() };
    let mut traced = Traced { deviation_mm: vec![0.0; rows.len()], pieces: Vec::new() };
    let loads = replay::loads(rows, machine);
    for ((first, last), stroke) in runs.into_iter().zip(&drawn.strokes) {
        let chords = chords(&stroke, &sources);
        let mut place = Place::default();
        let mut before: Option<Point> = None;
        for (row, load) in loads.iter().enumerate().take(last + 1).skip(first) {
            let at = machine.forward_from_motors(&MotorPos(*load));
            place = nearest(&chords, at, place, before.map_or(0.0, |before| distance(before, at)));
            before = Some(at);
            traced.deviation_mm[row] = place.distance_mm;
            let source = chords[place.chord].1;
            let is_new = row == first || traced.pieces.last().is_none_or(|piece| piece.source != source);
            // The last row has no ink after it.
            if is_new && (row < last || row == first) {
                traced.pieces.push(Piece { row, source });
            }
        }
    }
    Some(traced)
}

/// First and last row of each pen down.
pub(super) fn pen_downs(rows: &[Row]) -> Vec<(usize, usize)> {
    let mut runs = Vec::new();
    let mut start = None;
    for (index, row) in rows.iter().enumerate() {
        let pen_before = if index > 0 { rows[index - 1].pen } else { 0 };
        if row.pen == pen_before {
            continue;
        }
        if let Some(start) = start.take() {
            runs.push((start, index));
        }
        start = (row.pen != 0).then_some(index);
    }
    runs.extend(start.map(|start| (start, rows.len() - 1)));
    runs
}

/// The ends and the middle of a segment in nm, in an order that does not depend on its direction.
type Key = [[i64; 2]; 3];

fn key(segment: &Segment) -> Key {
    let nanometres = |p: Point| [p.x, p.y].map(|mm| (mm * 1e6).round() as i64);
    let (a, b) = (nanometres(segment.start()), nanometres(segment.end()));
    [a.min(b), a.max(b), nanometres(segment.eval(0.5))]
}

/// The bytes of every segment.
fn sources(placed: &Drawing) -> BTreeMap<Key, Span> {
    let mut sources = BTreeMap::new();
    for stroke in &placed.strokes {
        for segment in stroke.segments() {
            sources.entry(key(&segment)).or_insert_with(|| stroke.source());
        }
    }
    sources
}

/// A stroke as chords with their bytes; a dot is a chord of no length.
fn chords(stroke: &Stroke, sources: &BTreeMap<Key, Span>) -> Vec<(Line, Span)> {
    let mut chords = Vec::new();
    for segment in stroke.segments() {
        let own = || stroke.source();
        let source =
            if sources.is_empty() { own() } else { sources.get(&key(&segment)).copied().unwrap_or_else(own) };
        let mut from = segment.start();
        segment.flatten(CHORD_MM, |to| {
            chords.push((Line::new(from, to), source));
            from = to;
        });
    }
    if chords.is_empty() {
        chords.push((Line::new(stroke.start(), stroke.start()), stroke.source()));
    }
    chords
}

/// A place on a stroke.
#[derive(Clone, Copy, Debug, Default)]
struct Place {
    chord: usize,
    distance_mm: f64,
}

/// The nearest place from `from` on, as far as the pen can have come while it moved by `moved_mm`. A
/// stroke may cross itself: the nearest place of all could belong to another of its passes.
fn nearest(chords: &[(Line, Span)], at: Point, from: Place, moved_mm: f64) -> Place {
    let mut best = Place { chord: from.chord, distance_mm: distance_to_line(at, chords[from.chord].0) };
    let reach = 2.0 * moved_mm + AHEAD_MM;
    let mut passed = 0.0;
    for (chord, (line, _)) in chords.iter().enumerate().skip(from.chord + 1) {
        if passed > reach {
            break;
        }
        let distance_mm = distance_to_line(at, *line);
        if distance_mm < best.distance_mm {
            best = Place { chord, distance_mm };
        }
        passed += distance(line.p0, line.p1);
    }
    best
}

#[cfg(test)]
mod tests {
    use drawing::Pen;
    use test_support::machines;

    use super::*;

    #[test]
    fn rows_of_a_joined_stroke_name_the_bytes_of_each_of_its_strokes() {
        let machine = machines::corexy();
        let point = |x: f64, y: f64| Point::new(60.0 + x, 60.0 + y);
        let stroke = |points: &[Point], start: usize| {
            Stroke::polyline(Pen(1), points.to_vec(), Span { start, end: start + 5 }).unwrap()
        };
        let corner = point(10.0, 0.0);
        let placed = Drawing {
            strokes: vec![stroke(&[point(0.0, 0.0), corner], 0), stroke(&[point(10.0, 10.0), corner], 20)]
                .into(),
        };
        let drawn = Drawing::from(vec![stroke(&[point(0.0, 0.0), corner, point(10.0, 10.0)], 0)]);
        let path =
            [(0.0, 0.0, 0), (0.0, 0.0, 1), (5.0, 0.0, 1), (10.0, 0.0, 1), (10.0, 4.0, 1), (10.0, 10.0, 0)];
        let rows: Vec<Row> = path
            .iter()
            .enumerate()
            .map(|(index, &(x, y, pen))| {
                let q = machine.pose_near(point(x, y), &machine.start()).unwrap();
                let ticks = <[f64; 2]>::from(machine.motor_positions(&q)).map(|ticks| ticks.round() as i64);
                Row { t_us: 10_000 * index as u64, pen, ticks }
            })
            .collect();
        let traced = trace(&rows, &machine, &drawn, &placed).unwrap();
        let starts: Vec<(usize, usize)> =
            traced.pieces.iter().map(|piece| (piece.row, piece.source.start)).collect();
        assert_eq!(starts, [(1, 0), (4, 20)]);
        assert!(traced.deviation_mm.iter().all(|mm| *mm < 0.02));
        assert_eq!(trace(&rows[..3], &machine, &placed, &placed), None);
    }
}
