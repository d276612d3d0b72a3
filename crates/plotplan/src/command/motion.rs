//! Where a plan's rows take the pen.

use drawing::{Drawing, Pen, Point, Span, Stroke};
use kinematics::{Machine, MotorPos};
use picture::Ink;
use plan::Row;

/// The pen's ways over the paper, machine mm.
pub(super) struct Motion {
    /// With the pen down.
    pub(super) ink: Vec<Ink>,
    /// With the pen up.
    pub(super) travel: Vec<Vec<Point>>,
}

impl Motion {
    /// Follows the rows; what is not straight becomes chords within `chord_mm` of it.
    pub(super) fn of(rows: &[Row], machine: &Machine, chord_mm: f64) -> Self {
        let mut ink: Vec<Ink> = Vec::new();
        let mut travel: Vec<Vec<Point>> = Vec::new();
        let mut pen = None;
        for pair in rows.windows(2) {
            let ends = [pair[0], pair[1]].map(|row| MotorPos::from(row.ticks.map(|ticks| ticks as f64)));
            let path = chords(machine, ends[0], ends[1], chord_mm);
            if pen != Some(pair[0].pen) {
                pen = Some(pair[0].pen);
                let start = vec![path[0]];
                if pair[0].pen == 0 {
                    travel.push(start);
                } else {
                    ink.push(Ink { pen: pair[0].pen, points: start });
                }
            }
            let line =
                if pair[0].pen == 0 { travel.last_mut() } else { ink.last_mut().map(|ink| &mut ink.points) };
            if let Some(line) = line {
                line.extend(path[1..].iter().filter(|point| Some(**point) != path.first().copied()));
            }
        }
        travel.retain(|line| line.len() > 1);
        Self { ink, travel }
    }

    /// What it draws, as a drawing that lies where the machine draws it.
    pub(super) fn drawing(self) -> Drawing {
        let strokes = self.ink.into_iter();
        let strokes = strokes.filter_map(|ink| Stroke::polyline(Pen(ink.pen), ink.points, Span::default()));
        Drawing { strokes: strokes.collect() }
    }
}

/// The pen's path while the motors move linearly between two rows.
fn chords(machine: &Machine, from: MotorPos, to: MotorPos, chord_mm: f64) -> Vec<Point> {
    let bend = machine
        .geometry()
        .second_derivative_bound(&machine.joint_positions(&from), &machine.joint_positions(&to));
    let pieces = (bend / (8.0 * chord_mm)).sqrt().ceil().clamp(1.0, 1000.0) as usize;
    (0..=pieces)
        .map(|k| machine.forward_from_motors(&(from + (k as f64 / pieces as f64) * (to - from))))
        .collect()
}
