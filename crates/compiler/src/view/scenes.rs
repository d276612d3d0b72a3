//! Still and moving pictures of a plan: ink by a quantity, the machine in a pose, the animation.

use drawing::{Point, distance};
use kinematics::{MotorPos, PartKind};
use picture::animation::{AnimatedStroke, Animation};
use picture::{ColoredLine, Colour, Key, KeyColors, Label, MachinePose, Overlay, Scene};

use super::View;
use super::motion::Motion;
use super::trace;
use crate::{import, replay, scene};

/// What the colour of ink shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ColorBy {
    /// Its pen.
    Pen,
    /// The speed of the pen.
    Speed,
    /// What limits the speed.
    Limit,
    /// Its distance from the drawing.
    Deviation,
    /// The order in which it is drawn.
    Order,
}

/// Viridis (van der Walt and Smith, 2015) from dark blue to yellow, without its palest end.
const VIRIDIS: [Colour; 9] = [
    [68, 1, 84],
    [71, 44, 122],
    [59, 81, 139],
    [44, 113, 142],
    [33, 144, 141],
    [39, 173, 129],
    [92, 200, 99],
    [156, 212, 50],
    [214, 206, 30],
];
/// Levels of a scale.
const LEVELS: usize = 24;
/// Okabe and Ito's colours; grey for ink that nothing limits.
const KINDS: [Colour; 8] = [
    [0x7F, 0x7F, 0x7F],
    [0x00, 0x72, 0xB2],
    [0xD5, 0x5E, 0x00],
    [0x00, 0x9E, 0x73],
    [0xCC, 0x79, 0xA7],
    [0xE6, 0x9F, 0x00],
    [0x56, 0xB4, 0xE9],
    [0x88, 0x22, 0x55],
];
/// Points of coloured ink nearer than this are left out, mm.
const STEP_MM: f64 = 0.2;
/// Chords of ink deviate from curves by at most this, mm.
const CHORD_MM: f64 = 0.02;
/// Poses of an animation, a second of its turn.
const POSES_A_SECOND: f64 = 20.0;
/// Chords of an animation's ink, mm.
const COARSE_MM: f64 = 0.1;

impl View<'_> {
    /// The plan as a picture: its ink coloured by a quantity, the machine in its pose at a time, s.
    ///
    /// # Errors
    /// Where the distance from the drawing is asked for and the drawing is not known.
    pub fn scene(&self, by: ColorBy, at_s: Option<f64>) -> Result<Scene, &'static str> {
        let title = format!("{} on {}", self.title, self.machine.name());
        let mut scene = scene::of_plan(&title, self.rows, self.machine, self.header.pen_colors.clone());
        let until = at_s.map_or(self.rows.len() - 1, |at_s| self.row_at(at_s));
        let (lines, key) = self.colored(by, until)?;
        if by != ColorBy::Pen || at_s.is_some() {
            scene.ink.clear();
        }
        if by == ColorBy::Pen && at_s.is_some() {
            let ink = replay::Motion::of(&self.rows[..=until], self.machine, CHORD_MM).ink;
            let ink = ink
                .into_iter()
                .map(|line| picture::Ink { pen: line.pen, line: picture::InkLine::Points(line.points) });
            scene.ink = ink.collect();
        }
        scene.overlay = Overlay { lines, key, ..Overlay::default() };
        if let Some(at_s) = at_s {
            let ahead = replay::Motion::of(&self.rows[until..], self.machine, CHORD_MM).ink;
            scene.overlay.ahead = ahead.into_iter().map(|line| line.points).collect();
            scene.overlay.machine = Some(self.pose(&replay::loads(self.rows, self.machine), at_s));
        }
        Ok(scene)
    }

    /// The last row at or before a time.
    fn row_at(&self, at_s: f64) -> usize {
        let t_us = (at_s.max(0.0) * 1e6) as u64;
        self.rows.partition_point(|row| row.t_us <= t_us).saturating_sub(1)
    }

    /// Where the mechanism is at a time, in the motors' ticks.
    fn loads_at(&self, loads: &[[f64; 2]], at_s: f64) -> MotorPos {
        let row = self.row_at(at_s);
        let next = (row + 1).min(self.rows.len() - 1);
        let [from, to] = [self.rows[row], self.rows[next]];
        let span_s = (to.t_us - from.t_us) as f64 * 1e-6;
        let share =
            if span_s > 0.0 { ((at_s - from.t_us as f64 * 1e-6) / span_s).clamp(0.0, 1.0) } else { 0.0 };
        let [from, to] = [row, next].map(|row| MotorPos(loads[row]));
        from + share * (to - from)
    }

    /// The machine at a time.
    fn pose(&self, loads: &[[f64; 2]], at_s: f64) -> MachinePose {
        let linkage = self.machine.mechanism().linkage(self.machine.sheet());
        let points = linkage.points(&self.machine.joint_positions(&self.loads_at(loads, at_s)));
        let ends = |kind| {
            let parts = linkage.parts.iter().filter(move |part| part.kind == kind);
            parts.map(|part| [points[part.from], points[part.to]]).collect::<Vec<_>>()
        };
        MachinePose {
            rails: ends(PartKind::Rail),
            links: ends(PartKind::Link),
            pivots: ends(PartKind::Pivot).into_iter().map(|[at, _]| at).collect(),
            pen: points[linkage.pen],
            is_down: Some(self.rows[self.row_at(at_s)].pen).filter(|pen| *pen != 0),
        }
    }

    /// Ink up to a row in the colours of a quantity, with their key; none for pens.
    fn colored(&self, by: ColorBy, until: usize) -> Result<(Vec<ColoredLine>, Option<Key>), &'static str> {
        let is_ink = |row: &usize| self.rows[*row].pen != 0;
        let (title, values, text): (_, Vec<f64>, fn(f64) -> String) = match by {
            ColorBy::Pen => return Ok((Vec::new(), None)),
            ColorBy::Limit => {
                let motion = Motion::of(self);
                let kinds: Vec<usize> = (0..self.rows.len()).map(|row| motion.binding(row)).collect();
                let names = motion.limits.iter().map(|(name, _)| name.as_str());
                let names = ["no limit above 95 %"].into_iter().chain(names).enumerate();
                let used =
                    names.filter(|(index, _)| (0..=until).filter(is_ink).any(|row| kinds[row] == *index));
                let entries = used.map(|(index, name)| (KINDS[index % KINDS.len()], label(name)));
                let key =
                    Key { title: label("what limits the pen"), colors: KeyColors::Kinds(entries.collect()) };
                return Ok((self.lines(until, |row| KINDS[kinds[row] % KINDS.len()]), Some(key)));
            }
            ColorBy::Speed => ("pen speed", Motion::of(self).pen_mm_s, |value| format!("{value:.1} mm/s")),
            ColorBy::Order => {
                let times = self.rows.iter().map(|row| row.t_us as f64 * 1e-6);
                ("order", times.collect(), |value| format!("{value:.1} s"))
            }
            ColorBy::Deviation => {
                let traced = self
                    .drawing
                    .as_ref()
                    .and_then(|drawing| trace::trace(self.rows, self.machine, drawing.drawn, drawing.placed));
                let traced = traced
                    .ok_or("the plan does not hold its drawing, so the distance from it is not known")?;
                ("distance from the drawing", traced.deviation_mm, |value| format!("{value:.3} mm"))
            }
        };
        let most = (0..self.rows.len()).filter(is_ink).map(|row| values[row]).fold(0.0, f64::max);
        let level = |row: usize| {
            let share = if most > 0.0 { values[row] / most } else { 0.0 };
            viridis(((share * LEVELS as f64) as usize).min(LEVELS - 1))
        };
        let colors = KeyColors::Scale {
            colors: (0..LEVELS).map(viridis).collect(),
            ends: [label(&text(0.0)), label(&text(most))],
        };
        Ok((self.lines(until, level), Some(Key { title: label(title), colors })))
    }

    /// Ink up to a row: rows of one colour in turn are one line.
    fn lines(&self, until: usize, color: impl Fn(usize) -> Colour) -> Vec<ColoredLine> {
        let loads = replay::loads(self.rows, self.machine);
        let place = |row: usize| self.machine.forward_from_motors(&MotorPos(loads[row]));
        let mut lines: Vec<ColoredLine> = Vec::new();
        let mut continues = false;
        for row in 0..until {
            if self.rows[row].pen == 0 {
                continues = false;
                continue;
            }
            let (color, to) = (color(row), place(row + 1));
            match lines.last_mut().filter(|line| continues && line.color == color) {
                Some(line) => {
                    let ends_stroke = row + 1 == until || self.rows[row + 1].pen == 0;
                    // The line's last point moves on, until it is far enough from the one before.
                    if let [.., before, last] = &mut line.points[..]
                        && distance(*before, *last) < STEP_MM
                        && !ends_stroke
                    {
                        *last = to;
                    } else {
                        line.points.push(to);
                    }
                }
                None => lines.push(ColoredLine { color, points: vec![place(row), to] }),
            }
            continues = true;
        }
        lines
    }

    /// The plan as an animation that lasts `turn_s` seconds, and its scene.
    pub fn animation(&self, turn_s: f64) -> (Scene, Animation) {
        let title = format!("{} on {}", self.title, self.machine.name());
        let mut scene = scene::of_plan(&title, &[], self.machine, self.header.pen_colors.clone());
        scene.start = None;
        let loads = replay::loads(self.rows, self.machine);
        let duration_s = self.header.duration_us as f64 * 1e-6;
        let count = (turn_s * POSES_A_SECOND).clamp(2.0, 2000.0) as usize;
        let poses: Vec<MachinePose> =
            (0..=count).map(|k| self.pose(&loads, duration_s * k as f64 / count as f64)).collect();
        let each = |of: fn(&MachinePose) -> &Vec<[Point; 2]>| {
            (0..of(&poses[0]).len()).map(|part| poses.iter().map(|pose| of(pose)[part]).collect()).collect()
        };
        let pivots = (0..poses[0].pivots.len()).map(|k| poses.iter().map(|pose| pose.pivots[k]).collect());
        let animation = Animation {
            turn_s,
            rails: each(|pose| &pose.rails),
            links: each(|pose| &pose.links),
            pivots: pivots.collect(),
            pen: poses.iter().map(|pose| pose.pen).collect(),
            strokes: self.animated_strokes(&loads, duration_s / (turn_s * POSES_A_SECOND)),
        };
        (scene, animation)
    }

    /// Every stroke with its progress in steps of about `step_s`.
    fn animated_strokes(&self, loads: &[[f64; 2]], step_s: f64) -> Vec<AnimatedStroke> {
        let share = |row: usize| self.rows[row].t_us as f64 / self.header.duration_us.max(1) as f64;
        let place = |row: usize| self.machine.forward_from_motors(&MotorPos(loads[row]));
        trace::pen_downs(self.rows)
            .into_iter()
            .map(|(first, last)| {
                let mut points = vec![place(first)];
                let mut lengths = vec![0.0];
                for row in first + 1..=last {
                    let to = place(row);
                    lengths.push(lengths[row - first - 1] + distance(place(row - 1), to));
                    if distance(points[points.len() - 1], to) >= COARSE_MM || row == last {
                        points.push(to);
                    }
                }
                let whole = lengths[last - first].max(1e-9);
                let mut progress = vec![[share(first), 0.0]];
                let mut told_us = self.rows[first].t_us;
                for row in first + 1..last {
                    if (self.rows[row].t_us - told_us) as f64 * 1e-6 >= step_s {
                        told_us = self.rows[row].t_us;
                        progress.push([share(row), lengths[row - first] / whole]);
                    }
                }
                progress.push([share(last), 1.0]);
                AnimatedStroke { pen: self.rows[first].pen, points: straightened(&points), progress }
            })
            .collect()
    }
}

/// The points without those that lie on the line between their neighbours, within `COARSE_MM`.
fn straightened(points: &[Point]) -> Vec<Point> {
    let mut kept: Vec<Point> = Vec::new();
    let mut start = 0;
    for end in 0..points.len() {
        let line = drawing::Line::new(points[start], points[end]);
        let bends =
            points[start..end].iter().any(|point| drawing::distance_to_line(*point, line) > COARSE_MM);
        if end == 0 || bends {
            start = end.saturating_sub(1);
            kept.push(points[start]);
        }
    }
    kept.extend(points.last().filter(|_| points.len() > 1));
    kept
}

/// The colour of a level.
fn viridis(level: usize) -> Colour {
    let place = level as f64 / (LEVELS - 1) as f64 * (VIRIDIS.len() - 1) as f64;
    let index = (place as usize).min(VIRIDIS.len() - 2);
    let share = place - index as f64;
    let mix = |k: usize| {
        let [low, high] = [VIRIDIS[index][k], VIRIDIS[index + 1][k]].map(f64::from);
        (low + share * (high - low)).round() as u8
    };
    [mix(0), mix(1), mix(2)]
}

/// A text with its strokes, in the font that HP-GL labels have.
pub(crate) fn label(text: &str) -> Label {
    /// Capital letters are this high in the program below, mm, and 0.7 high in a label.
    const CAPITAL_MM: f64 = 7.0;
    /// Where the text begins, mm.
    const ORIGIN_MM: f64 = 10.0;
    let program = format!("IN;SP1;PA400,400;SI0.45,0.7;LB{text}\u{3}");
    let read = import::read(program.as_bytes(), &import::Options::default());
    let strokes = read.map(|document| {
        let strokes = document.pages.into_iter().flat_map(|page| page.drawing.strokes);
        let scale = 0.7 / CAPITAL_MM;
        let points = |point: Point| {
            ((point.to_vec2() - Point::new(ORIGIN_MM, ORIGIN_MM).to_vec2()) * scale).to_point()
        };
        strokes.map(|stroke| stroke.flatten(0.05).into_iter().map(points).collect()).collect()
    });
    Label { text: text.to_owned(), strokes: strokes.unwrap_or_default() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_have_strokes_of_their_height() {
        let label = label("What limits 95 %");
        let points: Vec<Point> = label.strokes.iter().flatten().copied().collect();
        let top = points.iter().map(|point| point.y).fold(0.0, f64::max);
        let right = points.iter().map(|point| point.x).fold(0.0, f64::max);
        assert!((0.65..0.9).contains(&top), "{top}");
        assert!((5.0..15.0).contains(&right), "{right}");
        assert!(points.iter().all(|point| point.x > -0.2 && point.y > -0.3));
    }

    #[test]
    fn straight_runs_of_points_become_their_ends() {
        let points: Vec<Point> =
            (0..=10).map(|k| Point::new(f64::from(k), 0.0)).chain([Point::new(10.0, 5.0)]).collect();
        assert_eq!(
            straightened(&points),
            [Point::new(0.0, 0.0), Point::new(10.0, 0.0), Point::new(10.0, 5.0)]
        );
        assert_eq!(straightened(&points[..1]), [Point::new(0.0, 0.0)]);
    }
}
