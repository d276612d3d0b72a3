//! What formats for machines share: an instant of a plan with all that is known of it, and a command with what it does.

use drawing::Point;
use plan::Row;

/// One instant of a plan, with what formats for other machinery want to know beside the row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instant {
    /// The row.
    pub row: Row,
    /// Motor positions in ticks before rounding; the row's own ticks where nothing else is known.
    pub exact: [f64; 2],
    /// The geometric joints, rad or mm.
    pub joints: [f64; 2],
    /// Where the pen is, machine mm.
    pub at: Point,
}

/// A line for a machine, without its line end.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Command {
    /// What is sent.
    pub text: String,
    /// Index of the plan's row that holds when the line has been done; for a drawing, the number of the line itself.
    pub row: u64,
    /// How long it takes, microseconds.
    pub lasts_us: u64,
}

/// Whether the motors stand still from one instant to the next; a pose that was computed twice may differ in its last bit.
pub(crate) fn rests(from: &Instant, to: &Instant) -> bool {
    (0..2).all(|motor| (from.exact[motor] - to.exact[motor]).abs() < 1e-6)
}

/// The speed of each motor at each instant, ticks/s: central differences of the exact positions, 0 where the motors rest.
pub(crate) fn speeds(instants: &[Instant]) -> Vec<[f64; 2]> {
    let at = |k: usize| &instants[k];
    let seconds = |a: usize, b: usize| (at(b).row.t_us - at(a).row.t_us) as f64 * 1e-6;
    let rests = |a: usize, b: usize| rests(at(a), at(b));
    (0..instants.len())
        .map(|k| {
            // A plan begins and ends at rest, and rests on both sides of every stretch without motion.
            if k == 0 || k + 1 == instants.len() || rests(k - 1, k) || rests(k, k + 1) {
                return [0.0; 2];
            }
            [0, 1].map(|motor| (at(k + 1).exact[motor] - at(k - 1).exact[motor]) / seconds(k - 1, k + 1))
        })
        .collect()
}
