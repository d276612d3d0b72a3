//! Motors with backlash: where they reverse on a path, and the motion that takes up the play.
//!
//! A motor is commanded half its backlash ahead of the mechanism, in the direction in which it moves
//! (`kinematics::Play`). At a reversal the pen stops, and the motor crosses the play on its own. The
//! mechanism rests meanwhile, so the ink stays on its path, and the limits hold as for every motion.

use kinematics::{JointPos, Machine, MotorPos};

use crate::joint_path::{GridInterval, JointPath, PathDerivatives, PathGeometry};

/// A motor that moves by less between two reversals does not reverse, ticks: rounding errors do that.
const LEAST_WAY: f64 = 1e-3;
/// Derivatives below this share of the largest one of the path are 0.
const ZERO: f64 = 1e-9;
/// Steps of the bisection: the interval shrinks to its last digits.
const BISECTIONS: u32 = 50;
/// A reversal this close to an end of its interval is taken there, as a share of it.
const AT_END: f64 = 1e-6;

/// A place on a path where a motor reverses.
#[derive(Clone, Copy, Debug)]
struct Reversal {
    motor: usize,
    /// Index of its interval.
    interval: usize,
    /// Share of that interval before it.
    share: f64,
    pose: JointPos,
}

/// The parts of a path that ends at `end` between which a motor with backlash reverses, with the pose
/// at the end of each.
pub(crate) fn between_reversals(
    machine: &Machine,
    path: JointPath,
    end: JointPos,
) -> Vec<(JointPath, JointPos)> {
    if !machine.has_backlash() {
        return vec![(path, end)];
    }
    let mut all: Vec<Reversal> = (0..2).flat_map(|motor| reversals(machine, &path, &end, motor)).collect();
    all.sort_by(|a, b| (a.interval, a.share).partial_cmp(&(b.interval, b.share)).expect("finite shares"));
    let mut parts = Vec::with_capacity(all.len() + 1);
    let mut rest = path.intervals.into_iter().enumerate();
    let mut intervals: Vec<GridInterval> = Vec::new();
    // What is left of the interval that was divided last, and where it begins in that interval.
    let mut left: Option<(usize, GridInterval, f64)> = None;
    for at in all {
        while left.is_none_or(|(index, ..)| index < at.interval) {
            intervals.extend(left.map(|(_, interval, _)| interval));
            left = rest.next().map(|(index, interval)| (index, interval, 0.0));
        }
        let Some((index, interval, begin)) = left else { break };
        let share = (at.share - begin) / (1.0 - begin);
        if share > AT_END
            && share < 1.0 - AT_END
            && let Some([before, after]) = interval.divided(machine, &path.geometry, share)
        {
            intervals.push(before);
            left = Some((index, after, at.share));
        } else if share >= 0.5 {
            intervals.push(interval);
            left = rest.next().map(|(index, interval)| (index, interval, 0.0));
        }
        if !intervals.is_empty() {
            let intervals = std::mem::take(&mut intervals);
            parts.push((JointPath { geometry: path.geometry.clone(), intervals }, at.pose));
        }
    }
    intervals.extend(left.map(|(_, interval, _)| interval));
    intervals.extend(rest.map(|(_, interval)| interval));
    if intervals.is_empty() {
        if let Some(last) = parts.last_mut() {
            last.1 = end;
        }
    } else {
        parts.push((JointPath { geometry: path.geometry, intervals }, end));
    }
    parts
}

/// The reversals of one motor along the path.
fn reversals(machine: &Machine, path: &JointPath, end: &JointPos, motor: usize) -> Vec<Reversal> {
    let PathGeometry::Drawn(start, section) = &path.geometry else { return Vec::new() };
    if machine.motors()[motor].backlash_ticks == 0.0 {
        return Vec::new();
    }
    let samples = |interval: &GridInterval| interval.first.map(|first| first[motor]);
    let largest = path.intervals.iter().flat_map(samples).map(f64::abs).fold(0.0, f64::max);
    let sign = |rate: f64| if rate.abs() <= ZERO * largest { 0.0 } else { rate.signum() };
    let mut found: Vec<Reversal> = Vec::new();
    let mut direction = 0.0;
    let mut near = *start;
    for (index, interval) in path.intervals.iter().enumerate() {
        let piece = &section[interval.piece];
        let pose_at = |share: f64, near: &JointPos| {
            let s = interval.start + share * interval.length;
            path.geometry.pose(machine, interval.piece, s, near).ok()
        };
        let rate_at = |share: f64, near: &JointPos| {
            let t = ((interval.start + share * interval.length) * piece.rate).min(1.0);
            pose_at(share, near)
                .map_or(0.0, |pose| PathDerivatives::of(machine, piece, t, &pose).first[motor])
        };
        let mut last_share = 0.0;
        for (rate, share) in samples(interval).into_iter().zip([0.0, 0.5, 1.0]) {
            let now = sign(rate);
            if now != 0.0 && direction != 0.0 && now != direction {
                let mut bracket = [last_share, share];
                for _ in 0..BISECTIONS {
                    let middle = 0.5 * (bracket[0] + bracket[1]);
                    let is_before = rate_at(middle, &near) * direction > 0.0;
                    bracket[usize::from(!is_before)] = middle;
                }
                let share = if last_share < share { bracket[0] } else { share };
                let pose = pose_at(share, &near).unwrap_or(near);
                found.push(Reversal { motor, interval: index, share, pose });
            }
            if now != 0.0 {
                direction = now;
            }
            last_share = share;
        }
        near = pose_at(1.0, &near).unwrap_or(near);
    }
    without_trembling(machine, start, end, found)
}

/// Without the reversals between which the motor hardly moves.
fn without_trembling(
    machine: &Machine,
    start: &JointPos,
    end: &JointPos,
    mut found: Vec<Reversal>,
) -> Vec<Reversal> {
    let position = |pose: &JointPos, motor: usize| machine.motor_positions(pose)[motor];
    let mut index = 0;
    while index < found.len() {
        let Reversal { motor, pose, .. } = found[index];
        let before = if index == 0 { *start } else { found[index - 1].pose };
        let after = found.get(index + 1).map_or(*end, |next| next.pose);
        let here = position(&pose, motor);
        let small = |other: &JointPos| (position(other, motor) - here).abs() < LEAST_WAY;
        if small(&after) {
            // With the next one, after which it moves on as before.
            found.drain(index..(index + 2).min(found.len()));
            index = index.saturating_sub(1);
        } else if index == 0 && small(&before) {
            found.remove(0);
        } else {
            index += 1;
        }
    }
    found
}

/// The direction in which each motor moves from one pose to another, 1 or -1; 0 for a motor at rest.
pub(crate) fn directions(machine: &Machine, from: &JointPos, to: &JointPos) -> [f64; 2] {
    let way = machine.motor_rates(&(*to - *from));
    [0, 1].map(|motor| if way[motor].abs() < LEAST_WAY { 0.0 } else { way[motor].signum() })
}

/// The path along which the motors cross their play, by `change` ticks.
pub(crate) fn crossing(machine: &Machine, change: MotorPos) -> JointPath {
    JointPath {
        geometry: PathGeometry::Travel(JointPos::ZERO, machine.joint_rates(&change)),
        intervals: vec![GridInterval {
            length: 1.0,
            piece: 0,
            start: 0.0,
            first: [change; 3],
            second: [MotorPos::ZERO; 3],
            pen_speed: 0.0,
            square_pen_speeds: [[0.0, 0.0]; 3],
            second_derivative_bound: 0.0,
            near_corner: false,
            interpolation_error: 0.0,
            polynomial_error: 0.0,
        }],
    }
}
