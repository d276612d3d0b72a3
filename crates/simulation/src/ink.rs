//! Predicted ink and its distances from the drawing.
//!
//! Ink is where the pen is while the plan has it down. *Stray* is the distance from the ink to the
//! nearest part of the drawing of the same pen, over the time with the pen down (2 ms); *missed* is
//! the distance from the drawing to the nearest ink, over the length of the drawing (0.1 mm).

use std::collections::BTreeMap;

use drawing::{Drawing, Point, Span, Vec2, distance};
use kinematics::{Machine, MotorPos};
use rstar::{AABB, PointDistance, RTree, RTreeObject};

use crate::run::Sample;

/// Chords of curves deviate by at most this, mm.
const CHORD_MM: f64 = 0.005;
/// Distance of the points of the drawing at which missing ink is measured, mm.
const MISSED_STEP_MM: f64 = 0.1;
/// Vertices with a turn from this to a reversal are corners, rad: 45 degrees.
const CORNER_RAD: f64 = std::f64::consts::FRAC_PI_4;
/// Overshoot belongs to a corner for this time after the plan has passed it, us.
const CORNER_US: u64 = 300_000;
/// Points of a line of ink are at least this far apart, mm.
const LINE_STEP_MM: f64 = 0.02;
/// Shorter tails do not show, mm.
const TAIL_MM: f64 = 0.05;

/// A straight piece of a drawing or of ink.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Piece {
    from: Point,
    to: Point,
    stroke: u32,
    index: u32,
}

impl Piece {
    fn distance_squared(&self, p: Point) -> f64 {
        let way = self.to - self.from;
        let square = way.hypot2();
        let t = if square > 0.0 { ((p - self.from).dot(way) / square).clamp(0.0, 1.0) } else { 0.0 };
        (p - (self.from + t * way)).hypot2()
    }
}

impl RTreeObject for Piece {
    type Envelope = AABB<[f64; 2]>;

    fn envelope(&self) -> Self::Envelope {
        AABB::from_corners([self.from.x, self.from.y], [self.to.x, self.to.y])
    }
}

impl PointDistance for Piece {
    fn distance_2(&self, point: &[f64; 2]) -> f64 {
        self.distance_squared(Point::new(point[0], point[1]))
    }
}

/// The pieces of a polyline; one without length for a dot.
fn pieces(points: &[Point], stroke: u32, first: u32) -> impl Iterator<Item = Piece> + '_ {
    let dot = (points.len() == 1).then(|| Piece { from: points[0], to: points[0], stroke, index: first });
    let lines = points.windows(2).zip(first..);
    lines.map(move |(ends, index)| Piece { from: ends[0], to: ends[1], stroke, index }).chain(dot)
}

/// The drawing that ink is compared with, machine mm.
#[derive(Debug)]
pub struct Target {
    /// Pieces of each pen.
    pens: BTreeMap<u16, RTree<Piece>>,
    /// All strokes, flattened, with pen and source.
    strokes: Vec<(u16, Vec<Point>, Span)>,
}

impl Target {
    /// The strokes of a drawing.
    pub fn new(drawing: &Drawing) -> Self {
        let flat = |stroke: drawing::Stroke| (stroke.pen.0, stroke.flatten(CHORD_MM), stroke.source());
        let strokes: Vec<_> = drawing.strokes.iter().map(flat).collect();
        let mut lists: BTreeMap<u16, Vec<Piece>> = BTreeMap::new();
        for (stroke, (pen, points, _)) in (0..).zip(&strokes) {
            lists.entry(*pen).or_default().extend(pieces(points, stroke, 0));
        }
        let pens = lists.into_iter().map(|(pen, list)| (pen, RTree::bulk_load(list))).collect();
        Self { pens, strokes }
    }

    /// Whether there is nothing to draw.
    pub fn is_empty(&self) -> bool {
        self.strokes.is_empty()
    }

    fn nearest(&self, pen: u16, p: Point) -> Option<(f64, Piece)> {
        let tree = self.pens.get(&pen).or_else(|| self.pens.values().next())?;
        tree.nearest_neighbor(&[p.x, p.y]).map(|piece| (piece.distance_squared(p).sqrt(), *piece))
    }
}

/// The largest value, the 99th percentile and the root mean square of distances, mm.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Distances {
    /// The largest.
    pub max_mm: f64,
    /// 99 % are at most this.
    pub p99_mm: f64,
    /// Root mean square.
    pub rms_mm: f64,
}

impl Distances {
    /// Of these distances, which are sorted; all 0 without any.
    pub fn of(distances: &mut [f64]) -> Self {
        let Some(last) = distances.len().checked_sub(1) else { return Self::default() };
        let squares: f64 = distances.iter().map(|d| d * d).sum();
        distances.sort_by(f64::total_cmp);
        Self {
            max_mm: distances[last],
            p99_mm: distances[(last as f64 * 0.99).ceil() as usize],
            rms_mm: (squares / distances.len() as f64).sqrt(),
        }
    }
}

/// Where something is worst.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Worst {
    /// Time since the start, s; `None` for a part of the drawing that no ink came near.
    pub at_s: Option<f64>,
    /// The place, machine mm.
    pub point_mm: Point,
    /// The stroke of the drawing, from 0.
    pub stroke: usize,
    /// Its bytes in the drawing's file.
    pub source: Span,
}

/// Ink drawn because the pen went down or up while the machine still moved.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tails {
    /// How many there are.
    pub count: usize,
    /// The longest one, mm.
    pub longest_mm: f64,
    /// All together, mm.
    pub total_mm: f64,
}

/// How the predicted ink differs from the drawing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct InkError {
    /// From the ink to the drawing.
    pub stray: Distances,
    /// From the drawing to the ink.
    pub missed: Distances,
    /// Where ink strays furthest.
    pub worst_stray: Option<Worst>,
    /// Where ink is missed most.
    pub worst_missed: Option<Worst>,
    /// Length of the ink, mm.
    pub ink_mm: f64,
    /// Tails at pen downs and pen ups.
    pub tails: Tails,
    /// The largest overshoot at a corner, mm.
    pub overshoot_max_mm: f64,
    /// Where it is.
    pub overshoot: Option<Worst>,
}

/// One sample with the pen down.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Dab {
    t_us: u64,
    pen: u16,
    at: Point,
    planned: [f64; 2],
    /// Number of the line of ink that it belongs to.
    line: u32,
}

/// Collects the ink of a simulation.
#[derive(Debug)]
pub struct InkRecorder<'a> {
    machine: &'a Machine,
    dabs: Vec<Dab>,
    line: u32,
    before: Option<Sample>,
    /// Time of the last pen up and the pen's place then; the tail since then, mm.
    lifted: Option<(u64, Point, f64)>,
    /// The tail of a pen down, mm, while the plan rests.
    lowered: Option<f64>,
    tails: Tails,
    lift_contact_us: u64,
}

impl<'a> InkRecorder<'a> {
    /// An empty recorder.
    pub fn new(machine: &'a Machine) -> Self {
        Self {
            machine,
            dabs: Vec::new(),
            line: 0,
            before: None,
            lifted: None,
            lowered: None,
            tails: Tails::default(),
            // Off the paper when it is half way up.
            lift_contact_us: (0.5e6 * machine.pen().lift_time_s) as u64,
        }
    }

    /// Takes a sample.
    pub fn observe(&mut self, sample: &Sample) {
        let pen_before = self.before.map_or(0, |before| before.pen);
        if sample.pen != 0 {
            let at = self.machine.forward_from_motors(&MotorPos(sample.ticks));
            if sample.pen != pen_before {
                self.line += 1;
                self.lowered = Some(0.0);
            } else if let (Some(tail), Some(last)) = (&mut self.lowered, self.dabs.last()) {
                if self.before.is_some_and(|before| before.planned == sample.planned) {
                    *tail += distance(last.at, at);
                } else {
                    let tail = *tail;
                    self.lowered = None;
                    self.tail(tail);
                }
            }
            let planned = sample.planned;
            self.dabs.push(Dab { t_us: sample.t_us, pen: sample.pen, at, planned, line: self.line });
        } else {
            if pen_before != 0
                && let Some(last) = self.dabs.last()
            {
                self.lifted = Some((sample.t_us, last.at, 0.0));
                self.lowered = None;
            }
            if let Some((since, from, tail)) = self.lifted {
                if sample.t_us - since <= self.lift_contact_us {
                    let at = self.machine.forward_from_motors(&MotorPos(sample.ticks));
                    self.lifted = Some((since, at, tail + distance(from, at)));
                } else {
                    self.lifted = None;
                    self.tail(tail);
                }
            }
        }
        self.before = Some(*sample);
    }

    fn tail(&mut self, mm: f64) {
        if mm > TAIL_MM {
            self.tails.count += 1;
            self.tails.longest_mm = self.tails.longest_mm.max(mm);
            self.tails.total_mm += mm;
        }
    }

    /// The lines of ink with their pens, machine mm; points nearer than 0.02 mm to the last one are
    /// left out.
    pub fn lines(&self) -> Vec<(u16, Vec<Point>)> {
        let line = |dabs: &[Dab]| {
            let mut points = vec![dabs[0].at];
            let mut last = dabs[0].at;
            for dab in &dabs[1..] {
                if distance(last, dab.at) > LINE_STEP_MM {
                    last = dab.at;
                    points.push(last);
                }
            }
            (dabs[0].pen, points)
        };
        self.dabs.chunk_by(|a, b| a.line == b.line).map(line).collect()
    }

    /// The root mean square of stray and missed distances together, from every `thin`-th sample and
    /// points of the drawing `step_mm` apart: quick, for searches.
    pub fn quick_rms(&self, target: &Target, thin: usize, step_mm: f64) -> f64 {
        if self.dabs.is_empty() || target.is_empty() {
            return f64::INFINITY;
        }
        let kept: Vec<Dab> = self.dabs.iter().step_by(thin.max(1)).copied().collect();
        let stray = kept.iter().filter_map(|dab| target.nearest(dab.pen, dab.at)).map(|(d, _)| d * d);
        let stray = stray.sum::<f64>() / kept.len() as f64;
        let mut missed = missed(&kept, target, step_mm);
        let missed_mm = Distances::of(&mut missed.0).rms_mm;
        (0.5 * (stray + missed_mm * missed_mm)).sqrt()
    }

    /// Compares the ink with the drawing.
    pub fn compare(&self, target: &Target) -> InkError {
        let mut stray: Vec<f64> = Vec::with_capacity(self.dabs.len());
        let mut worst = (0.0, None);
        for dab in &self.dabs {
            let Some((far, _)) = target.nearest(dab.pen, dab.at) else { continue };
            if far > worst.0 {
                worst = (far, Some(*dab));
            }
            stray.push(far);
        }
        let (mut missed, worst_missed) = missed(&self.dabs, target, MISSED_STEP_MM);
        let worst_stray = worst.1.and_then(|dab| {
            // The part of the drawing that the plan was at: the nearest one need not be it.
            let planned = self.machine.forward_from_motors(&MotorPos(dab.planned));
            let (_, piece) = target.nearest(dab.pen, planned)?;
            Some(target.place(Some(dab.t_us), dab.at, piece.stroke))
        });
        let overshoot = self.overshoot(target);
        let moved = self.dabs.windows(2).filter(|pair| pair[0].line == pair[1].line);
        InkError {
            stray: Distances::of(&mut stray),
            missed: Distances::of(&mut missed),
            worst_stray,
            worst_missed,
            ink_mm: moved.map(|pair| distance(pair[0].at, pair[1].at)).sum(),
            tails: self.tails,
            overshoot_max_mm: overshoot.map_or(0.0, |(mm, _)| mm),
            overshoot: overshoot.map(|(_, place)| place),
        }
    }

    /// The largest overshoot at a corner: how far ink goes beyond the second side, seen from the
    /// first one, before and for 0.3 s after the plan passes the corner.
    fn overshoot(&self, target: &Target) -> Option<(f64, Worst)> {
        let mut largest: Option<(f64, Worst)> = None;
        let mut corner: Option<(u64, Piece, Point, Vec2)> = None;
        let mut last: Option<Piece> = None;
        for dab in &self.dabs {
            let planned = self.machine.forward_from_motors(&MotorPos(dab.planned));
            let Some((_, piece)) = target.nearest(dab.pen, planned) else { continue };
            if let Some(before) = last.filter(|before| before.stroke == piece.stroke && *before != piece) {
                corner = outward(&before, &piece).map(|(at, normal)| (dab.t_us, piece, at, normal));
            }
            last = Some(piece);
            let Some((since, second, at, normal)) = corner else { continue };
            if dab.t_us - since > CORNER_US || second != piece {
                corner = None;
                continue;
            }
            let beyond = (dab.at - at).dot(normal);
            if beyond > largest.map_or(0.0, |(mm, _)| mm) {
                largest = Some((beyond, target.place(Some(dab.t_us), at, piece.stroke)));
            }
        }
        largest
    }
}

/// The corner between two pieces that follow each other, and the direction across the second one away
/// from the first; `None` where there is no corner.
fn outward(first: &Piece, second: &Piece) -> Option<(Point, Vec2)> {
    let (a, b) = if first.index + 1 == second.index {
        (first.to - first.from, second.to - second.from)
    } else if second.index + 1 == first.index {
        (first.from - first.to, second.from - second.to)
    } else {
        return None;
    };
    let at = if first.index < second.index { first.to } else { first.from };
    let (a, b) = (unit(a)?, unit(b)?);
    if libm::atan2(a.cross(b).abs(), a.dot(b)) < CORNER_RAD {
        return None;
    }
    // At a reversal the first direction itself.
    Some((at, unit(a - a.dot(b) * b).unwrap_or(a)))
}

fn unit(v: Vec2) -> Option<Vec2> {
    let length = v.hypot2().sqrt();
    (length > 1e-9).then(|| v / length)
}

/// Distances from the drawing to the ink, over the drawing's length, and the worst place.
fn missed(dabs: &[Dab], target: &Target, step_mm: f64) -> (Vec<f64>, Option<Worst>) {
    let mut lists: BTreeMap<u16, Vec<Piece>> = BTreeMap::new();
    for line in dabs.chunk_by(|a, b| a.line == b.line) {
        let points: Vec<Point> = line.iter().map(|dab| dab.at).collect();
        lists.entry(line[0].pen).or_default().extend(pieces(&points, line[0].line, 0));
    }
    let trees: BTreeMap<u16, RTree<Piece>> =
        lists.into_iter().map(|(pen, list)| (pen, RTree::bulk_load(list))).collect();
    let mut distances = Vec::new();
    let mut worst = (-1.0, None);
    for (stroke, (pen, points, _)) in (0..).zip(&target.strokes) {
        let Some(tree) = trees.get(pen) else { continue };
        let mut measure = |p: Point| {
            let Some(piece) = tree.nearest_neighbor(&[p.x, p.y]) else { return };
            let far = piece.distance_squared(p).sqrt();
            if far > worst.0 {
                worst = (far, Some((p, stroke)));
            }
            distances.push(far);
        };
        measure(points[0]);
        for ends in points.windows(2) {
            let count = (distance(ends[0], ends[1]) / step_mm).ceil().max(1.0);
            for part in 1..=count as u32 {
                measure(ends[0].lerp(ends[1], f64::from(part) / count));
            }
        }
    }
    (distances, worst.1.map(|(p, stroke)| target.place(None, p, stroke)))
}

impl Target {
    fn place(&self, t_us: Option<u64>, point_mm: Point, stroke: u32) -> Worst {
        Worst {
            at_s: t_us.map(|t_us| t_us as f64 * 1e-6),
            point_mm,
            stroke: stroke as usize,
            source: self.strokes[stroke as usize].2,
        }
    }
}

#[cfg(test)]
mod tests {
    use drawing::{Pen, Stroke};
    use test_support::machines;

    use super::*;

    fn square() -> Drawing {
        let corners = [(50.0, 50.0), (80.0, 50.0), (80.0, 80.0), (50.0, 80.0)];
        let points = corners.map(Point::from).to_vec();
        Drawing { strokes: Stroke::polyline(Pen(1), points, Span { start: 3, end: 9 }).into_iter().collect() }
    }

    /// Samples along a polyline at 1 mm a sample, with the ink shifted by `shift`.
    fn recorded(machine: &Machine, points: &[Point], shift: Vec2) -> InkError {
        let ticks = |p: Point| {
            let pose = machine.pose_near(p, &machine.start()).unwrap();
            <[f64; 2]>::from(machine.motor_positions(&pose))
        };
        let mut recorder = InkRecorder::new(machine);
        let mut t_us = 0;
        for ends in points.windows(2) {
            for part in 0..=100 {
                let p = ends[0].lerp(ends[1], f64::from(part) / 100.0);
                let sample =
                    Sample { t_us, pen: 1, ticks: ticks(p + shift), planned: ticks(p), commands: [0.0; 2] };
                recorder.observe(&sample);
                t_us += 2000;
            }
        }
        recorder.compare(&Target::new(&square()))
    }

    #[test]
    fn ink_on_the_drawing_has_no_error() {
        let machine = machines::corexy();
        let points: Vec<Point> = square().strokes.to_vec()[0].points().collect();
        let error = recorded(&machine, &points, Vec2::ZERO);
        assert!(error.stray.max_mm < 1e-9 && error.missed.max_mm < 1e-9, "{error:?}");
        assert!((error.ink_mm - 90.0).abs() < 1e-9);
        assert_eq!(error.overshoot_max_mm.round(), 0.0);
    }

    #[test]
    fn shifted_ink_and_missing_ink_are_measured() {
        let machine = machines::corexy();
        let points: Vec<Point> = square().strokes.to_vec()[0].points().collect();
        let error = recorded(&machine, &points, Vec2::new(0.0, -2.0));
        assert!((error.stray.max_mm - 2.0).abs() < 1e-9, "{:?}", error.stray);
        assert_eq!(error.worst_stray.unwrap().source, Span { start: 3, end: 9 });
        // Without its last side the drawing is missed by its length.
        let error = recorded(&machine, &points[..3], Vec2::ZERO);
        assert!((error.missed.max_mm - 30.0).abs() < 1e-9, "{:?}", error.missed);
        assert!(error.stray.max_mm < 1e-9);
    }

    #[test]
    fn overshoot_is_measured_across_the_second_side() {
        let machine = machines::corexy();
        let points: Vec<Point> = square().strokes.to_vec()[0].points().collect();
        // Ink 0.7 mm too far in x: beyond the corner at (80, 50).
        let error = recorded(&machine, &points, Vec2::new(0.7, 0.0));
        assert!((error.overshoot_max_mm - 0.7).abs() < 1e-9, "{error:?}");
    }

    #[test]
    fn percentile_and_rms_of_distances() {
        let mut all: Vec<f64> = (0..=100).map(f64::from).collect();
        let distances = Distances::of(&mut all);
        assert_eq!((distances.max_mm, distances.p99_mm), (100.0, 99.0));
        assert!((distances.rms_mm - (338_350.0_f64 / 101.0).sqrt()).abs() < 1e-12);
        assert_eq!(Distances::of(&mut []), Distances::default());
    }
}
