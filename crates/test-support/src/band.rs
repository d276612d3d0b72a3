//! Strokes whose fastest drawing within a tolerance is known: `cargo xtask bound` computes it, and
//! the planner's tests compare plans with it.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use drawing::{Point, Rect};
use kinematics::{Cartesian, JointPos, JointRange, Machine, MachineParts, Motor, PenLimits};

use crate::{Random, machines};

/// The tolerance within which the optimum is computed, mm.
pub const TOLERANCE_MM: f64 = 0.1;

/// A machine of the comparison and where the strokes' origin lies on it.
#[derive(Debug)]
pub struct Setup {
    /// Its name in the table of optima.
    pub name: &'static str,
    /// The machine without jerk limits.
    pub machine: Machine,
    /// The strokes' origin, machine mm.
    pub origin: Point,
}

/// A CoreXY table of 500 mm/s² and 100 mm/s a motor with the pen at most at 60 mm/s, and the arm of
/// [`machines::arm`].
pub fn setups() -> [Setup; 2] {
    let pen = PenLimits {
        max_speed_mm_s: 60.0,
        max_travel_speed_mm_s: f64::INFINITY,
        lift_time_s: 0.1,
        drop_time_s: 0.1,
    };
    let motors = ["a", "b"].map(|name| Motor::new(name, 92.0, 100.0, 500.0));
    let table = machines::build(MachineParts {
        joints: [JointRange { min: 0.0, max: 200.0 }; 2],
        coupling: [[1.0, 1.0], [1.0, -1.0]],
        pen,
        start: JointPos::ZERO,
        ..MachineParts::new("table", Cartesian, motors, Rect::new(0.0, 0.0, 200.0, 200.0))
    });
    [
        Setup { name: "corexy", machine: table, origin: Point::new(100.0, 100.0) },
        Setup { name: "arm", machine: machines::arm(), origin: Point::new(112.7, 206.2) },
    ]
}

type Points = Vec<(f64, f64)>;

/// All strokes by name, mm.
pub fn strokes() -> Vec<(&'static str, Points)> {
    vec![
        ("turn by 29 degrees", turn(29.0)),
        ("right angle", turn(90.0)),
        ("turn by 149 degrees", turn(149.0)),
        ("out and back", vec![(0.0, 0.0), (5.0, 0.0), (0.0, 0.0)]),
        ("triangle", polygon(3, 4.0)),
        ("square", rectangle(10.0, 10.0)),
        ("rectangle", rectangle(10.0, 2.0)),
        ("small square", rectangle(1.0, 1.0)),
        ("small corner", vec![(0.0, 0.0), (0.3, 0.0), (0.3, 0.3)]),
        ("hexagon", polygon(6, 4.0)),
        ("star", star()),
        ("stairs", (0..=12).map(|k| (2.0 * f64::from((k + 1) / 2), 2.0 * f64::from(k / 2))).collect()),
        ("zigzag", (0..9).map(|k| (1.5 * f64::from(k), if k % 2 == 0 { 0.0 } else { 2.598 })).collect()),
        ("small zigzag", (0..21).map(|k| (0.4 * f64::from(k), 0.5 * f64::from(k % 2))).collect()),
        ("circle, 1 mm", arc(1.0, 0.0, TAU, 24)),
        ("circle, 3 mm", arc(3.0, 0.0, TAU, 36)),
        ("circle, 20 mm", arc(20.0, 0.0, TAU, 72)),
        ("noisy circle", noisy_circle()),
        ("figure eight", curve(60, |t| (4.0 * libm::sin(TAU * t), 2.0 * libm::sin(2.0 * TAU * t)))),
        ("rose", curve(96, |t| polar(4.0 * libm::cos(2.0 * TAU * t), TAU * t))),
        ("spiral", curve(72, |t| polar(0.5 + 4.0 * t, 3.0 * TAU * t))),
        ("dense wave", curve(100, |t| (10.0 * t, 0.5 * libm::sin(5.0 * TAU * t)))),
        ("long wave", curve(40, |t| (20.0 * t, 2.0 * libm::sin(TAU * t)))),
        ("noisy line", noisy_line()),
        ("random walk", random_walk()),
        ("letter S", letter_s()),
        ("letter R", letter_r()),
        ("letter E", letter_e()),
        ("letter M", vec![(0.0, 0.0), (0.0, 4.0), (1.5, 1.5), (3.0, 4.0), (3.0, 0.0)]),
        ("letter U", letter_u()),
        ("lines, arc and corners", lines_and_arc()),
    ]
}

fn polar(r: f64, angle: f64) -> (f64, f64) {
    let (sin, cos) = libm::sincos(angle);
    (r * cos, r * sin)
}

/// Two lines of 20 mm.
fn turn(degrees: f64) -> Points {
    let (x, y) = polar(20.0, degrees.to_radians());
    vec![(0.0, 0.0), (20.0, 0.0), (20.0 + x, y)]
}

fn polygon(corners: u32, radius: f64) -> Points {
    arc(radius, 0.3, TAU, corners)
}

fn rectangle(width: f64, height: f64) -> Points {
    vec![(0.0, 0.0), (width, 0.0), (width, height), (0.0, height), (0.0, 0.0)]
}

fn arc(radius: f64, start: f64, sweep: f64, chords: u32) -> Points {
    curve(chords, |t| polar(radius, start + sweep * t))
}

fn curve(chords: u32, at: impl Fn(f64) -> (f64, f64)) -> Points {
    (0..=chords).map(|k| at(f64::from(k) / f64::from(chords))).collect()
}

fn star() -> Points {
    (0..=10)
        .map(|k| polar(if k % 2 == 0 { 5.0 } else { 2.0 }, FRAC_PI_2 + 0.1 * TAU * f64::from(k)))
        .collect()
}

/// 100 points of a circle of 6 mm, each off by up to 0.08 mm.
fn noisy_circle() -> Points {
    let mut random = Random(3);
    let mut at = |k: u32| polar(6.0 + random.between(-0.08, 0.08), TAU * f64::from(k % 100) / 100.0);
    (0..=100).map(&mut at).collect()
}

fn noisy_line() -> Points {
    let mut random = Random(5);
    (0..=40).map(|k| (0.5 * f64::from(k), random.between(-0.08, 0.08))).collect()
}

fn random_walk() -> Points {
    let mut random = Random(7);
    let mut at = (0.0, 0.0);
    let mut points = vec![at];
    for _ in 0..12 {
        let (x, y) = polar(random.between(0.3, 4.0), random.between(0.0, TAU));
        at = (at.0 + x, at.1 + y);
        points.push(at);
    }
    points
}

fn shifted(points: Points, x: f64, y: f64) -> impl Iterator<Item = (f64, f64)> {
    points.into_iter().map(move |(px, py)| (px + x, py + y))
}

/// Of chords, 4 mm high.
fn letter_s() -> Points {
    let upper = shifted(arc(1.0, 0.2 * PI, 1.3 * PI, 13), 1.0, 3.0);
    upper.chain(shifted(arc(1.0, 0.5 * PI, -1.3 * PI, 13), 1.0, 1.0).skip(1)).collect()
}

fn letter_r() -> Points {
    let bowl = shifted(arc(1.0, FRAC_PI_2, -PI, 9), 1.4, 3.0);
    let stem = [(0.0, 0.0), (0.0, 4.0)].into_iter();
    stem.chain(bowl).chain([(0.0, 2.0), (1.0, 2.0), (2.4, 0.0)]).collect()
}

/// Its middle bar is drawn to and fro.
fn letter_e() -> Points {
    vec![(2.5, 0.0), (0.0, 0.0), (0.0, 2.0), (1.8, 2.0), (0.0, 2.0), (0.0, 4.0), (2.5, 4.0)]
}

fn letter_u() -> Points {
    let bottom = shifted(arc(1.5, PI, PI, 12), 1.5, 1.5);
    [(0.0, 4.0)].into_iter().chain(bottom).chain([(3.0, 4.0)]).collect()
}

fn lines_and_arc() -> Points {
    let quarter = shifted(arc(5.0, -FRAC_PI_2, FRAC_PI_2, 30), 10.0, 5.0);
    let end = [(15.0, 9.0), (11.0, 9.0), (11.0, 7.0), (6.0, 12.0)];
    [(0.0, 0.0)].into_iter().chain(quarter).chain(end).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strokes_have_names_of_their_own_and_no_zero_length_lines() {
        let strokes = strokes();
        for (k, (name, points)) in strokes.iter().enumerate() {
            assert!(strokes[..k].iter().all(|(other, _)| other != name), "{name} twice");
            let shortest = points.windows(2).map(|p| libm::hypot(p[1].0 - p[0].0, p[1].1 - p[0].1));
            assert!(shortest.fold(f64::INFINITY, f64::min) > 0.01, "{name}");
        }
    }
}
