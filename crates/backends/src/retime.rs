//! Retiming: decelerating to rest anywhere in a plan (feed hold), and accelerating again from there (cycle start).
//!
//! At a fraction `u` of the planned speed the motors pass the same positions; their speeds are multiplied by `u`, their
//! accelerations by `u²`, and a change of `u` adds to them. From row to row `u` changes as much as the limits in the
//! plan's header allow:
//!
//! ```text
//! |v_k - v_(k-1)| <= a T_k + 2 / T_k        v = u d / T,  T_k = T / u
//! ```
//!
//! per motor; the last term is the quantization error of whole ticks.

use plan::{Header, Row, TickTable};

/// Fractions of the planned speed that are tried.
const SHARES: u32 = 64;
/// The smallest fraction.
const SLOWEST: f64 = 1.0 / SHARES as f64;

/// How fast the motors were over the interval before, ticks/s.
type Speeds = [f64; 2];

/// Whether motors that were at `before` may take `steps` in `seconds`.
fn allowed(header: &Header, before: Speeds, steps: [i64; 2], seconds: f64) -> bool {
    (0..2).all(|motor| {
        let speed = steps[motor] as f64 / seconds;
        let change = (speed - before[motor]).abs();
        change <= header.motors[motor].limits.acceleration * seconds + 2.0 / seconds
    })
}

fn interval(rows: &[Row], to: usize) -> ([i64; 2], u64) {
    let (a, b) = (rows[to - 1], rows[to]);
    ([0, 1].map(|motor| b.ticks[motor] - a.ticks[motor]), b.t_us - a.t_us)
}

fn stretched(duration_us: u64, share: f64) -> u64 {
    (duration_us as f64 / share).ceil() as u64
}

fn speeds(steps: [i64; 2], duration_us: u64) -> Speeds {
    steps.map(|steps| steps as f64 / (duration_us as f64 * 1e-6))
}

/// Rows after row `at` until the motors rest, each with its index in the plan and how long it takes to get there.
///
/// It ends at rest: at a row from which the motors need not move to keep to their limits.
pub(crate) fn decelerate(table: &TickTable, at: usize) -> Vec<(usize, u64)> {
    let (header, rows) = (&table.header, &table.rows);
    let mut way = Vec::new();
    if at == 0 || at + 1 >= rows.len() {
        return way;
    }
    let (steps, duration_us) = interval(rows, at);
    let mut before = speeds(steps, duration_us);
    let mut share = 1.0;
    for to in at + 1..rows.len() {
        let still = |seconds: f64| allowed(header, before, [0, 0], seconds);
        if still(duration_us as f64 * 1e-6) || rows[to - 1].pen != rows[to - 2].pen {
            // A pen event is a rest already.
            break;
        }
        let (steps, duration_us) = interval(rows, to);
        let candidates = (1..=SHARES).map(|k| f64::from(k) / f64::from(SHARES)).filter(|u| *u <= share);
        let slowest = candidates
            .into_iter()
            .find(|u| allowed(header, before, steps, stretched(duration_us, *u) as f64 * 1e-6));
        share = slowest.unwrap_or(share);
        let duration_us = stretched(duration_us, share);
        before = speeds(steps, duration_us);
        way.push((to, duration_us));
    }
    way
}

/// Rows after row `at` to the plan's end, accelerating from rest, each with its index and how long it takes to get there.
pub(crate) fn accelerate(table: &TickTable, at: usize) -> Vec<(usize, u64)> {
    let (header, rows) = (&table.header, &table.rows);
    let mut before = [0.0; 2];
    let mut share = SLOWEST;
    let mut way = Vec::new();
    for to in at + 1..rows.len() {
        let (steps, duration_us) = interval(rows, to);
        if share < 1.0 {
            let candidates = (1..=SHARES).rev().map(|k| f64::from(k) / f64::from(SHARES));
            let fastest = candidates
                .into_iter()
                .find(|u| allowed(header, before, steps, stretched(duration_us, *u) as f64 * 1e-6));
            share = fastest.unwrap_or(share);
            // A rest in the plan is a rest here: from there on it goes as planned.
            if rows[to - 1].ticks == rows[to].ticks && rows[to - 1].pen != rows[to.saturating_sub(2)].pen {
                share = 1.0;
            }
        }
        let duration_us = stretched(duration_us, share);
        before = speeds(steps, duration_us);
        way.push((to, duration_us));
    }
    way
}

/// Motor positions one period apart from one place to another with the pen up, at rest at both ends; without the first.
///
/// `s = 3 u² - 2 u³` has the peak speed 3/2 and the peak acceleration 6 over its duration: the duration follows from
/// the limits.
pub(crate) fn travel(header: &Header, from: [i64; 2], to: [i64; 2]) -> Vec<[i64; 2]> {
    let way = [0, 1].map(|motor| (to[motor] - from[motor]) as f64);
    let seconds = (0..2)
        .map(|motor| {
            let limits = header.motors[motor].limits;
            let far = way[motor].abs();
            f64::max(1.5 * far / limits.speed, (6.0 * far / limits.acceleration).sqrt())
        })
        .fold(0.0, f64::max);
    let periods = (seconds * 1e6 / header.period_us.max(1) as f64).ceil();
    (1..=periods as u64)
        .map(|k| {
            let u = k as f64 / periods;
            let s = u * u * (3.0 - 2.0 * u);
            [0, 1].map(|motor| from[motor] + (s * way[motor]).round() as i64)
        })
        .collect()
}

/// How long the pen takes to move in this plan, microseconds: the longest rest that begins where it goes up (or down).
pub(crate) fn pen_time_us(table: &TickTable, down: bool) -> u64 {
    let rows = &table.rows;
    let changes = rows.windows(3).filter(|three| (three[1].pen != 0) == down && three[0].pen != three[1].pen);
    let rests = changes.filter(|three| three[1].ticks == three[2].ticks);
    rests.map(|three| three[2].t_us - three[1].t_us).max().unwrap_or(table.header.period_us.max(1))
}
