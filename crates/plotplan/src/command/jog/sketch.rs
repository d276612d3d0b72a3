//! Drawing by hand: what the mouse does becomes strokes, and the machine draws them while the mouse goes on.
//!
//! The program of the second report sends a position at a time and waits for the machine's acknowledgement.
//! Here the pen draws all lines that have come in meanwhile in one plan of the planner, within the limits of
//! the motors and as fast as they allow; it rests between two such plans, with the pen down.

use std::collections::VecDeque;

use drawing::{Drawing, Line, Pen, Point, Segment, Span, Stroke, Vec2};
use kinematics::Machine;
use plan::Row;
use planner::Settings;

use super::{JogError, Jogger};

/// What the mouse, or a pencil, does at a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Stylus {
    /// The button is pressed.
    Press(Point),
    /// It moves with the button pressed.
    Drag(Point),
    /// The button is released.
    Release,
}

impl Stylus {
    /// The same, moved.
    pub(super) fn moved(self, by: Vec2) -> Self {
        match self {
            Self::Press(point) => Self::Press(point + by),
            Self::Drag(point) => Self::Drag(point + by),
            Self::Release => Self::Release,
        }
    }
}

/// What the machine does next.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Step {
    /// Goes there and lowers the pen.
    Start(Point),
    /// Draws lines through these points.
    Through(Vec<Point>),
    /// Lifts the pen.
    End,
}

/// What was drawn by hand, and what the machine has still to draw.
#[derive(Clone, Debug, Default)]
pub(super) struct Sketch {
    queue: VecDeque<Step>,
    /// Whether the button is pressed.
    is_held: bool,
    /// The end of the stroke that is being drawn; `None` where the mouse is out of reach.
    end: Option<Point>,
    /// All of it, machine mm.
    pub(super) strokes: Vec<Vec<Point>>,
    complaint: Option<String>,
}

impl Sketch {
    /// Adds what the mouse did, machine mm. A stroke ends where the mouse leaves the machine's reach, and another
    /// one begins where it comes back.
    pub(super) fn add(&mut self, stylus: Stylus, machine: &Machine) {
        match stylus {
            Stylus::Press(point) => {
                self.end_stroke();
                self.is_held = true;
                self.start(point, machine);
            }
            Stylus::Drag(point) if self.is_held => self.go_on(point, machine),
            Stylus::Drag(_) => {}
            Stylus::Release => {
                self.is_held = false;
                self.end_stroke();
            }
        }
    }

    fn start(&mut self, point: Point, machine: &Machine) {
        if let Err(error) = machine.check_point(point) {
            self.complaint = Some(error.to_string());
            return;
        }
        self.queue.push_back(Step::Start(point));
        self.strokes.push(vec![point]);
        self.end = Some(point);
    }

    fn go_on(&mut self, point: Point, machine: &Machine) {
        let Some(from) = self.end else { return self.start(point, machine) };
        if from == point {
            return;
        }
        if let Err(error) = machine.check_segment(&Segment::Line(Line::new(from, point))) {
            self.complaint = Some(error.to_string());
            self.end_stroke();
            if machine.check_point(point).is_ok() {
                self.start(point, machine);
            }
            return;
        }
        match self.queue.back_mut() {
            Some(Step::Through(points)) => points.push(point),
            _ => self.queue.push_back(Step::Through(vec![point])),
        }
        if let Some(stroke) = self.strokes.last_mut() {
            stroke.push(point);
        }
        self.end = Some(point);
    }

    fn end_stroke(&mut self) {
        if self.end.take().is_some() {
            self.queue.push_back(Step::End);
        }
    }

    /// The next step, as much as has come in of it.
    pub(super) fn next(&mut self) -> Option<Step> {
        self.queue.pop_front()
    }

    /// Forgets what the machine has not drawn. The button must be pressed again.
    pub(super) fn stop(&mut self) {
        self.queue.clear();
        (self.is_held, self.end) = (false, None);
    }

    /// Why something was left out since this was last called.
    pub(super) fn take_complaint(&mut self) -> Option<String> {
        self.complaint.take()
    }
}

impl Jogger<'_> {
    /// Does a step; lines deviate by at most `tolerance_mm`.
    pub(super) fn draw(
        &mut self,
        step: &Step,
        tolerance_mm: f64,
        stops: &mut dyn FnMut() -> bool,
    ) -> Result<(), JogError> {
        match step {
            Step::Start(point) => {
                self.go_to(*point, stops)?;
                self.set_pen(true, stops)
            }
            Step::Through(points) => self.draw_through(points, tolerance_mm, stops),
            Step::End => self.set_pen(false, stops),
        }
    }

    /// Draws lines through these points from where the pen stands; it is down before and after.
    fn draw_through(
        &mut self,
        points: &[Point],
        tolerance_mm: f64,
        stops: &mut dyn FnMut() -> bool,
    ) -> Result<(), JogError> {
        let rows = self.rows_through(points, tolerance_mm)?;
        let Some(last) = rows.last().filter(|_| rows.len() > 1) else { return Ok(()) };
        let start = super::start_ticks(self.machine);
        let program =
            self.encoded(&rows, |source| self.backend.continuing_program(source, &self.encode, start))?;
        self.execute(program, stops)?;
        for row in &rows {
            self.went_to(row.ticks);
        }
        self.went_to(last.ticks);
        self.aim = points.last().copied();
        Ok(())
    }

    /// The rows of lines through these points, pen down, from where the motors are.
    fn rows_through(&self, points: &[Point], tolerance_mm: f64) -> Result<Vec<Row>, JogError> {
        let refused = |what: String| JogError::Refused(what);
        // A machine that starts here: the pen needs no time, it is down.
        let mut parts = self.machine.parts().clone();
        parts.start = self.pose();
        (parts.pen.lift_time_s, parts.pen.drop_time_s) = (0.0, 0.0);
        let machine = Machine::new(parts).map_err(|error| refused(error.to_string()))?;
        let mut line = vec![self.pen()];
        line.extend(points.iter().copied().filter(|point| *point != self.pen()));
        let Some(stroke) = Stroke::polyline(Pen(1), line, Span::default()).filter(|stroke| !stroke.is_dot())
        else {
            return Ok(Vec::new());
        };
        let period_us = (machine.parts().period_s * 1e6).round() as u64;
        let settings = Settings::new(tolerance_mm, period_us);
        let drawing = Drawing::from(vec![stroke]);
        let planned =
            planner::plan(&machine, drawing, &settings).map_err(|error| refused(error.to_string()))?;
        let rows: Vec<Row> = planned.rows().map(|row| row.row).collect();
        let first = rows.iter().position(|row| row.pen != 0).unwrap_or(0);
        let last = rows.iter().rposition(|row| row.pen != 0).map_or(0, |row| row + 1);
        let rows = rows.get(first..=last.max(first)).unwrap_or_default();
        // The plan begins with the motors in the middle of their play.
        let mut all = self.crossing(rows.first().map_or(self.ticks, |row| row.ticks), period_us);
        let begins_us = all.last().map_or(0, |row| row.t_us);
        let zero_us = rows.first().map_or(0, |row| row.t_us);
        let rest = rows.iter().skip(usize::from(!all.is_empty()));
        all.extend(rest.map(|row| Row { t_us: begins_us + row.t_us - zero_us, pen: 1, ..*row }));
        Ok(all)
    }

    /// The way of the motors through their play, within their limits; empty if they are there.
    ///
    /// `s = 3 u² - 2 u³` has the peak speed 3/2 and the peak acceleration 6 over its duration.
    fn crossing(&self, to: [i64; 2], period_us: u64) -> Vec<Row> {
        if to == self.ticks {
            return Vec::new();
        }
        let way = [0, 1].map(|motor: usize| (to[motor] - self.ticks[motor]) as f64);
        let seconds = self.machine.motors().iter().zip(way).map(|(motor, way)| {
            let far = way.abs();
            f64::max(
                1.5 * far / motor.max_speed_ticks_s,
                (6.0 * far / motor.max_acceleration_ticks_s2).sqrt(),
            )
        });
        let periods = (seconds.fold(0.0, f64::max) * 1e6 / period_us as f64).ceil().max(1.0);
        (0..=periods as u64)
            .map(|k| {
                let u = k as f64 / periods;
                let s = u * u * (3.0 - 2.0 * u);
                let ticks = [0, 1].map(|motor| self.ticks[motor] + (s * way[motor]).round() as i64);
                Row { t_us: k * period_us, pen: 1, ticks }
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use drawing::Rect;
    use kinematics::{Cartesian, JointRange, MachineParts, Motor};

    use super::*;

    fn table() -> Machine {
        let motors = ["x", "y"].map(|name| Motor::new(name, 10.0, 100.0, 1000.0));
        let mut parts = MachineParts::new("table", Cartesian, motors, Rect::new(0.0, 0.0, 100.0, 100.0));
        parts.joints = [JointRange { min: 0.0, max: 100.0 }; 2];
        parts.start = [0.0, 0.0].into();
        Machine::new(parts).expect("a machine")
    }

    fn steps(sketch: &mut Sketch) -> Vec<Step> {
        std::iter::from_fn(|| sketch.next()).collect()
    }

    #[test]
    fn mouse_becomes_strokes_of_all_that_has_come_in() {
        let (machine, mut sketch) = (table(), Sketch::default());
        let at = |x: f64, y: f64| Point::new(x, y);
        sketch.add(Stylus::Drag(at(1.0, 1.0)), &machine);
        sketch.add(Stylus::Press(at(10.0, 10.0)), &machine);
        sketch.add(Stylus::Drag(at(20.0, 10.0)), &machine);
        sketch.add(Stylus::Drag(at(20.0, 10.0)), &machine);
        sketch.add(Stylus::Drag(at(20.0, 20.0)), &machine);
        let through = |points: &[Point]| Step::Through(points.to_vec());
        assert_eq!(
            steps(&mut sketch),
            [Step::Start(at(10.0, 10.0)), through(&[at(20.0, 10.0), at(20.0, 20.0)])]
        );
        sketch.add(Stylus::Drag(at(30.0, 20.0)), &machine);
        sketch.add(Stylus::Release, &machine);
        sketch.add(Stylus::Drag(at(40.0, 20.0)), &machine);
        assert_eq!(steps(&mut sketch), [through(&[at(30.0, 20.0)]), Step::End]);
        assert_eq!(sketch.strokes[0].len(), 4);
        assert_eq!(sketch.take_complaint(), None);
    }

    #[test]
    fn stroke_ends_at_the_edge_of_the_reach_and_another_begins_inside() {
        let (machine, mut sketch) = (table(), Sketch::default());
        let at = |x: f64| Point::new(x, 50.0);
        sketch.add(Stylus::Press(at(90.0)), &machine);
        for x in [99.0, 105.0, 110.0, 98.0, 95.0] {
            sketch.add(Stylus::Drag(at(x)), &machine);
        }
        sketch.add(Stylus::Release, &machine);
        assert_eq!(
            steps(&mut sketch),
            [
                Step::Start(at(90.0)),
                Step::Through(vec![at(99.0)]),
                Step::End,
                Step::Start(at(98.0)),
                Step::Through(vec![at(95.0)]),
                Step::End
            ]
        );
        assert!(sketch.take_complaint().is_some(), "the reach");
        // A click is a dot.
        sketch.add(Stylus::Press(at(5.0)), &machine);
        sketch.add(Stylus::Release, &machine);
        assert_eq!(steps(&mut sketch), [Step::Start(at(5.0)), Step::End]);
    }
}
