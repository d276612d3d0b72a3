//! Speeds of the pen and the motors at every row, and which limit binds: what `viewer/js/plan.js`
//! computes for its page.

use drawing::{Point, distance};
use kinematics::{Machine, MotorPos};

use super::View;
use crate::replay;

/// Positions in whole ticks are differenced over a number of rows at which their rounding changes the
/// acceleration by at most this share of its limit.
const ROUNDING: f64 = 0.1;
/// And over at most this many rows.
const MOST_ROWS: usize = 50;
/// A limit binds from this share on.
const BINDS: f64 = 0.95;

/// The motion of a plan: values hold from their row to the next.
pub(super) struct Motion {
    /// Speed of the pen over the paper, mm/s.
    pub(super) pen_mm_s: Vec<f64>,
    /// What can limit the pen, with the share that each row uses of it.
    pub(super) limits: Vec<(String, Vec<f64>)>,
}

impl Motion {
    pub(super) fn of(view: &View<'_>) -> Self {
        let rows = view.rows;
        let header = view.header;
        let period_s = header.period_us.max(1) as f64 * 1e-6;
        let least = header.motors.iter().map(|motor| motor.limits.acceleration).fold(f64::INFINITY, f64::min);
        let stride = match view.exact {
            Some(_) => 1,
            None => ((2.0 / ROUNDING / least).sqrt() / period_s).ceil().clamp(1.0, MOST_ROWS as f64) as usize,
        };
        let positions: Vec<[f64; 2]> = match view.exact {
            Some(exact) => exact.to_vec(),
            None => rows.iter().map(|row| row.ticks.map(|ticks| ticks as f64)).collect(),
        };
        let loads = replay::loads(rows, view.machine);
        let lags: Vec<[f64; 2]> = rows
            .iter()
            .zip(&loads)
            .map(|(row, load)| [0, 1].map(|motor| load[motor] - row.ticks[motor] as f64))
            .collect();
        let mut motion = Self {
            pen_mm_s: vec![0.0; rows.len()],
            limits: vec![("the pen's speed".to_owned(), vec![0.0; rows.len()])],
        };
        let names = |motor: &plan::Motor| {
            let jerk = motor.limits.jerk.map(|_| format!("jerk of {}", motor.name));
            [Some(format!("speed of {}", motor.name)), Some(format!("acceleration of {}", motor.name)), jerk]
        };
        for name in header.motors.iter().flat_map(names).flatten() {
            motion.limits.push((name, vec![0.0; rows.len()]));
        }
        // Between two rests the rows are a period apart.
        let mut start = 0;
        for end in 1..=rows.len() {
            let is_rest =
                end == rows.len() || 2 * (rows[end].t_us - rows[end - 1].t_us) > 3 * header.period_us;
            if is_rest {
                let span = Span { first: start, last: end - 1, stride, step_s: stride as f64 * period_s };
                motion.span(view, &positions, &lags, &span);
                start = end;
            }
        }
        motion
    }

    fn span(&mut self, view: &View<'_>, positions: &[[f64; 2]], lags: &[[f64; 2]], span: &Span) {
        let pen_at =
            |row: usize| place(view.machine, [0, 1].map(|motor| positions[row][motor] + lags[row][motor]));
        for row in span.first..span.last {
            let [more, before, here, after] = [-2, -1, 0, 1].map(|k| positions[span.at(row, k)]);
            let pen_mm_s = distance(pen_at(span.at(row, 0)), pen_at(span.at(row, 1))) / span.step_s;
            self.pen_mm_s[row] = pen_mm_s;
            let mut shares = vec![pen_mm_s / view.pen_speed_mm_s(view.rows[row].pen)];
            for (k, motor) in view.header.motors.iter().enumerate() {
                let h = span.step_s;
                shares.push((after[k] - here[k]).abs() / h / motor.limits.speed);
                shares
                    .push((after[k] - 2.0 * here[k] + before[k]).abs() / (h * h) / motor.limits.acceleration);
                let third = after[k] - 3.0 * here[k] + 3.0 * before[k] - more[k];
                shares.extend(motor.limits.jerk.map(|jerk| third.abs() / (h * h * h) / jerk));
            }
            for ((_, column), share) in self.limits.iter_mut().zip(shares) {
                column[row] = share;
            }
        }
    }

    /// Index of the limit that binds at a row, from 1; 0 if none does.
    pub(super) fn binding(&self, row: usize) -> usize {
        let mut best = (0, BINDS);
        for (index, (_, shares)) in self.limits.iter().enumerate() {
            if shares[row] >= best.1 {
                best = (index + 1, shares[row]);
            }
        }
        best.0
    }
}

/// Rows between two rests.
struct Span {
    first: usize,
    last: usize,
    /// Positions are compared over this many rows, which take this time.
    stride: usize,
    step_s: f64,
}

impl Span {
    /// The row `k` strides from a row, within the span; strides lie about the row.
    fn at(&self, row: usize, k: isize) -> usize {
        let shift = k * self.stride as isize - (self.stride / 2) as isize;
        (row as isize + shift).clamp(self.first as isize, self.last as isize) as usize
    }
}

fn place(machine: &Machine, ticks: [f64; 2]) -> Point {
    machine.forward_from_motors(&MotorPos(ticks))
}
