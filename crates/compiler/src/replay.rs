//! Plans read back: their machine, the pen's motion, the certificate recomputed.

use drawing::{Affine, Drawing, Pen, Point, Span, Stroke, Vec2};
use kinematics::{Machine, MotorPos, Play};
use plan::Row;
use plan::file::PlanFile;
use verify::Certificate;

/// Chords of a plan's own ink deviate from it by at most this share of the tolerance.
const OWN_INK: f64 = 0.01;

/// One connected line of a plan, ink or travel.
#[derive(Clone, Debug, PartialEq)]
pub struct Polyline {
    /// The pen's number; 0 for travel.
    pub pen: u16,
    /// Its points, machine mm; a single point is a dot.
    pub points: Vec<Point>,
}

/// The pen's motion over the paper, in the order of time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Motion {
    /// With the pen down.
    pub ink: Vec<Polyline>,
    /// With the pen up; each of at least two points.
    pub travel: Vec<Polyline>,
}

impl Motion {
    /// Follows the rows through forward kinematics. Chords deviate from curves by at most `chord_mm`.
    pub fn of(rows: &[Row], machine: &Machine, chord_mm: f64) -> Self {
        let mut lines: Vec<Polyline> = Vec::new();
        let ticks = |row: &Row| row.ticks.map(|ticks| ticks as f64);
        let Some(first) = rows.first() else { return Self::default() };
        let mut play = Play::new(machine, ticks(first));
        for pair in rows.windows(2) {
            let pen = pair[0].pen;
            let offset = machine.pen_offset_mm(pen);
            let mut from = play.loads();
            let mut path = vec![machine.forward_from_motors(&MotorPos(from)) + offset];
            let corners = play.follow(ticks(&pair[1]));
            for to in corners.into_iter().flatten().chain([play.loads()]) {
                let chords = chords(machine, MotorPos(from), MotorPos(to), chord_mm);
                path.extend(chords.into_iter().skip(1).map(|point| point + offset));
                from = to;
            }
            if lines.last().is_none_or(|line| line.pen != pen) {
                lines.push(Polyline { pen, points: vec![path[0]] });
            }
            if let Some(line) = lines.last_mut() {
                line.points.extend(path[1..].iter().filter(|point| **point != path[0]));
            }
        }
        let (ink, mut travel): (Vec<Polyline>, Vec<Polyline>) =
            lines.into_iter().partition(|line| line.pen != 0);
        travel.retain(|line| line.points.len() > 1);
        Self { ink, travel }
    }

    /// The ink as a drawing in machine mm.
    pub fn drawing(self) -> Drawing {
        let strokes = self.ink.into_iter();
        let strokes =
            strokes.filter_map(|line| Stroke::polyline(Pen(line.pen), line.points, Span::default()));
        Drawing { strokes: strokes.collect() }
    }
}

/// Where the mechanism is at each row, in the motors' ticks: on a machine with backlash, not where the motors are.
pub fn loads(rows: &[Row], machine: &Machine) -> Vec<[f64; 2]> {
    let mut play: Option<Play> = None;
    rows.iter()
        .map(|row| {
            let ticks = row.ticks.map(|ticks| ticks as f64);
            let play = play.get_or_insert_with(|| Play::new(machine, ticks));
            play.follow(ticks);
            play.loads()
        })
        .collect()
}

/// Where the mechanism goes while the pens draw `drawing`: strokes of pens with an offset are moved by it.
pub fn on_carriage(drawing: Drawing, machine: &Machine) -> Drawing {
    moved(drawing, |pen| -machine.pen_offset_mm(pen.0))
}

/// What the pens draw while the mechanism follows `drawing`: the inverse of [`on_carriage`].
pub fn on_paper(drawing: Drawing, machine: &Machine) -> Drawing {
    moved(drawing, |pen| machine.pen_offset_mm(pen.0))
}

fn moved(mut drawing: Drawing, by: impl Fn(Pen) -> Vec2) -> Drawing {
    // Strokes that stay where they are keep their bits.
    if drawing.pens().into_iter().all(|pen| by(pen) == Vec2::ZERO) {
        return drawing;
    }
    drawing.strokes.update(|stroke| {
        let by = by(stroke.pen);
        if by != Vec2::ZERO {
            stroke.transform(Affine::translate(by));
        }
    });
    drawing
}

/// The pen's path while the motors move linearly between two rows.
fn chords(machine: &Machine, from: MotorPos, to: MotorPos, chord_mm: f64) -> Vec<Point> {
    let bend = machine
        .mechanism()
        .second_derivative_bound(&machine.joint_positions(&from), &machine.joint_positions(&to));
    let pieces = (bend / (8.0 * chord_mm)).sqrt().ceil().clamp(1.0, 1000.0) as usize;
    (0..=pieces)
        .map(|k| machine.forward_from_motors(&(from + (k as f64 / pieces as f64) * (to - from))))
        .collect()
}

/// Replays a plan against `drawing` (machine mm). Without one, its ink is compared with itself, so
/// that only the motion is verified.
pub fn certify(
    plan: &PlanFile,
    machine: &Machine,
    drawing: Option<&Drawing>,
    tolerance_mm: f64,
) -> Certificate {
    /// The least tolerance for a plan's own ink, mm.
    const OWN_TOLERANCE_MM: f64 = 0.1;
    let own;
    let drawing = if let Some(drawing) = drawing {
        drawing
    } else {
        let chord_mm = OWN_INK * tolerance_mm.max(OWN_TOLERANCE_MM);
        own = on_carriage(Motion::of(&plan.table.rows, machine, chord_mm).drawing(), machine);
        &own
    };
    verify::certify(machine, drawing, &plan.table.header, tolerance_mm, || {
        plan.table.rows.iter().map(|row| (*row, None))
    })
}
