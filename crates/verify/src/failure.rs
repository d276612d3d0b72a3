//! Failures of a plan: kind, location and count.

use std::fmt;

use drawing::{Point, Span};
use kinematics::Fault;

/// A movement of the pen itself, during which the motors rest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PenMotion {
    /// The pen is lifted.
    Lift,
    /// The pen is lowered.
    Drop,
    /// A pen is exchanged for another.
    Change,
}

impl fmt::Display for PenMotion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Lift => "lifted",
            Self::Drop => "lowered",
            Self::Change => "exchanged",
        })
    }
}

/// A kind of failure. `Display` gives the finding without its location.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Violation {
    /// The table has no rows at all.
    #[error("the plan has no rows")]
    Empty,
    /// Time does not start at 0.
    #[error("time starts at {t_us} us instead of 0")]
    TimeStart {
        /// Time of the first row.
        t_us: u64,
    },
    /// Time does not increase from one row to the next.
    #[error("time does not increase: {before_us} us is followed by {t_us} us")]
    Time {
        /// Time of the row before.
        before_us: u64,
        /// Time of this row.
        t_us: u64,
    },
    /// The motors move from one row to the next in less than the period that the plan states.
    #[error("the motors move within {dt_us} us, less than the stated period of {period_us} us")]
    Period {
        /// Time between the two rows.
        dt_us: u64,
        /// Period stated by the plan.
        period_us: u64,
    },
    /// The pen is down in the first row.
    #[error("the plan starts with pen {pen} down")]
    PenAtStart {
        /// The pen.
        pen: u16,
    },
    /// The pen is down in the last row.
    #[error("the plan ends with pen {pen} down")]
    PenAtEnd {
        /// The pen.
        pen: u16,
    },
    /// The first row is not the machine's start pose.
    #[error("the plan starts at {}, {} ticks instead of the start pose {}, {}", found[0], found[1], expected[0], expected[1])]
    StartPose {
        /// Ticks of the row.
        found: [i64; plan::MOTORS],
        /// The start pose.
        expected: [i64; plan::MOTORS],
    },
    /// The last row is not the machine's start pose.
    #[error("the plan ends at {}, {} ticks instead of the start pose {}, {}", found[0], found[1], expected[0], expected[1])]
    ParkPose {
        /// The last row's ticks.
        found: [i64; plan::MOTORS],
        /// The start pose.
        expected: [i64; plan::MOTORS],
    },
    /// The first step is too fast for a start from rest.
    #[error(
        "motor {motor} does not start from rest: its first step needs {share:.3} times the allowed acceleration"
    )]
    RestAtStart {
        /// The motor.
        motor: String,
        /// Share of the bound; above 1.
        share: f64,
    },
    /// The last step is too fast for a stop.
    #[error(
        "motor {motor} does not end at rest: its last step needs {share:.3} times the allowed acceleration"
    )]
    RestAtEnd {
        /// The motor.
        motor: String,
        /// Share of the bound; above 1.
        share: f64,
    },
    /// A motor exceeds its speed limit.
    #[error(
        "motor {motor}: speed {speed_ticks_s:.1} ticks/s exceeds {allowed_ticks_s:.1} (limit {limit_ticks_s:.1} plus rounding)"
    )]
    Speed {
        /// The motor.
        motor: String,
        /// Its speed, ticks/s.
        speed_ticks_s: f64,
        /// The limit plus the rounding allowance, ticks/s.
        allowed_ticks_s: f64,
        /// The limit itself, ticks/s.
        limit_ticks_s: f64,
    },
    /// A motor exceeds its acceleration limit.
    #[error(
        "motor {motor}: acceleration {acceleration_ticks_s2:.1} ticks/s^2 exceeds {allowed_ticks_s2:.1} (limit {limit_ticks_s2:.1} plus rounding)"
    )]
    Acceleration {
        /// The motor.
        motor: String,
        /// Its acceleration, ticks/s².
        acceleration_ticks_s2: f64,
        /// The limit plus the rounding allowance, ticks/s².
        allowed_ticks_s2: f64,
        /// The limit itself, ticks/s².
        limit_ticks_s2: f64,
    },
    /// A motor exceeds its jerk limit.
    #[error(
        "motor {motor}: jerk {jerk_ticks_s3:.1} ticks/s^3 exceeds {allowed_ticks_s3:.1} (limit {limit_ticks_s3:.1} plus rounding)"
    )]
    Jerk {
        /// The motor.
        motor: String,
        /// Its jerk, ticks/s³.
        jerk_ticks_s3: f64,
        /// The limit plus the rounding allowance, ticks/s³.
        allowed_ticks_s3: f64,
        /// The limit itself, ticks/s³.
        limit_ticks_s3: f64,
    },
    /// The motors move before the pen has finished its movement.
    #[error("the motors move {early_us} us before pen {pen} has been {motion}")]
    MovesDuringPen {
        /// The movement of the pen.
        motion: PenMotion,
        /// The pen.
        pen: u16,
        /// Time left until the movement ends.
        early_us: u64,
    },
    /// A joint leaves its range by more than the rounding allowance.
    #[error("{fault}")]
    Joint {
        /// The joint and its position.
        fault: Fault,
    },
    /// Ink of a pen that has no stroke in the drawing.
    #[error("pen {pen} draws, but the drawing has no stroke of this pen")]
    ForeignPen {
        /// The pen.
        pen: u16,
    },
    /// Ink is too far from the drawing.
    #[error(
        "ink of pen {pen} deviates from the drawing by {distance_mm:.4} mm {} (allowed {allowed_mm:.4} mm)",
        stage(*.rounded)
    )]
    Deviates {
        /// The pen.
        pen: u16,
        /// Whether the path is that of the whole ticks, not the one before rounding.
        rounded: bool,
        /// The distance.
        distance_mm: f64,
        /// The allowed distance.
        allowed_mm: f64,
    },
    /// A part of the drawing is too far from all ink.
    #[error(
        "{uncovered_mm:.2} mm of pen {pen} in {strokes} stroke{} are not drawn: the ink is {} \
         {distance_mm:.4} mm away {} (allowed {allowed_mm:.4} mm)",
        if *.strokes == 1 { "" } else { "s" },
        if *.is_lower_bound { "more than" } else { "up to" },
        stage(*.rounded)
    )]
    Uncovered {
        /// The pen.
        pen: u16,
        /// Whether the path is that of the whole ticks, not the one before rounding.
        rounded: bool,
        /// The largest distance from the ink.
        distance_mm: f64,
        /// Whether the distance is only a lower bound.
        is_lower_bound: bool,
        /// The allowed distance.
        allowed_mm: f64,
        /// Length of the part of the drawing that is too far; 0 for a dot.
        uncovered_mm: f64,
        /// Number of strokes with such a part.
        strokes: u64,
    },
    /// A row's ticks are not the rounded exact motor position.
    #[error(
        "motor {motor} is {by_ticks:.3} ticks from its exact position; rounding accounts for {allowed_ticks}"
    )]
    Drift {
        /// The motor.
        motor: String,
        /// The difference, ticks.
        by_ticks: f64,
        /// The difference that the plan's rounding may have, ticks.
        allowed_ticks: f64,
    },
    /// A position or distance is not a finite number.
    #[error("a position is not a finite number")]
    NotFinite,
}

fn stage(rounded: bool) -> &'static str {
    if rounded { "after rounding to ticks" } else { "before rounding to ticks" }
}

impl Violation {
    /// Whether it concerns a motor limit (speed, acceleration, jerk), which a caller may allow to
    /// exceed.
    pub fn is_limit(&self) -> bool {
        matches!(
            self,
            Self::Speed { .. }
                | Self::Acceleration { .. }
                | Self::Jerk { .. }
                | Self::RestAtStart { .. }
                | Self::RestAtEnd { .. }
        )
    }
}

/// The location of a failure, as far as it is known.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Location {
    /// Row of the table, from 0.
    pub row: Option<u64>,
    /// Time of that row, us.
    pub t_us: Option<u64>,
    /// Point in the machine frame, mm.
    pub point_mm: Option<Point>,
    /// Index of the stroke in the drawing.
    pub stroke: Option<usize>,
    /// Byte range of that stroke in the drawing's source.
    pub source: Option<Span>,
}

/// A failure of a plan: kind, worst or first location, count. `Display` is one sentence.
#[derive(Clone, Debug, PartialEq)]
pub struct Failure {
    /// The kind.
    pub violation: Violation,
    /// The worst location, or the first one.
    pub location: Location,
    /// Number of rows or parts of the path; at least 1.
    pub count: u64,
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.violation)?;
        let location = &self.location;
        if let Some(t_us) = location.t_us {
            write!(f, ", at {}.{:06} s", t_us / 1_000_000, t_us % 1_000_000)?;
        }
        if let Some(row) = location.row {
            write!(f, ", row {row}")?;
        }
        if let Some(point) = location.point_mm {
            write!(f, ", at {:.2}, {:.2} mm", point.x, point.y)?;
        }
        if let Some(stroke) = location.stroke {
            write!(f, ", stroke {stroke}")?;
        }
        if let Some(source) = location.source {
            write!(f, " (bytes {} to {})", source.start, source.end)?;
        }
        if self.count > 1 {
            write!(f, "; {} times in total", self.count)?;
        }
        Ok(())
    }
}

/// Collects failures: each kind is kept once, with its worst or first location.
#[derive(Clone, Debug, Default)]
pub(crate) struct Failures {
    kept: Vec<(Failure, usize, f64)>,
}

impl Failures {
    /// Adds a failure. Failures of the same kind and `which` (a motor or pen) are counted, and the
    /// one with the largest `severity` is kept; of equal ones, the first.
    pub(crate) fn note(&mut self, violation: Violation, which: usize, severity: f64, location: Location) {
        let kind = std::mem::discriminant(&violation);
        let known = self
            .kept
            .iter_mut()
            .find(|(failure, of, _)| *of == which && std::mem::discriminant(&failure.violation) == kind);
        match known {
            None => self.kept.push((Failure { violation, location, count: 1 }, which, severity)),
            Some((failure, _, worst)) => {
                failure.count += 1;
                if severity > *worst {
                    (failure.violation, failure.location, *worst) = (violation, location, severity);
                }
            }
        }
    }

    pub(crate) fn into_vec(self) -> Vec<Failure> {
        self.kept.into_iter().map(|(failure, ..)| failure).collect()
    }
}
