//! What can be wrong with a plan, and where.

use std::fmt;

use drawing::{Point, Span};
use kinematics::Fault;

/// Which way the pen itself moves while the motors stand still.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PenMotion {
    /// Off the paper.
    Lift,
    /// Onto the paper.
    Drop,
    /// One pen is exchanged for another.
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

/// One way in which a plan breaks its promise. Its `Display` is half a sentence, without the location.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Violation {
    /// The table has no rows at all.
    #[error("the plan has no rows")]
    Empty,
    /// Time does not begin at 0.
    #[error("time begins at {t_us} us instead of 0")]
    TimeStart {
        /// Where it begins.
        t_us: u64,
    },
    /// Time does not increase from one row to the next.
    #[error("time goes from {before_us} us to {t_us} us")]
    Time {
        /// The row before.
        before_us: u64,
        /// This row.
        t_us: u64,
    },
    /// The pen is down in the first row.
    #[error("the plan begins with pen {pen} down")]
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
    #[error("the plan begins at {}, {} ticks instead of the start pose {}, {}", found[0], found[1], expected[0], expected[1])]
    StartPose {
        /// The first row's ticks.
        found: [i64; plan::MOTORS],
        /// The start pose.
        expected: [i64; plan::MOTORS],
    },
    /// The last row is not the pose in which the plan should park.
    #[error("the plan ends at {}, {} ticks instead of parking at {}, {}", found[0], found[1], expected[0], expected[1])]
    ParkPose {
        /// The last row's ticks.
        found: [i64; plan::MOTORS],
        /// Where it should park.
        expected: [i64; plan::MOTORS],
    },
    /// The first step is faster than a start from rest allows.
    #[error(
        "motor {motor} does not start from rest: its first step is {share:.3} times what its acceleration allows"
    )]
    RestAtStart {
        /// The motor.
        motor: String,
        /// Share of the limit with its allowance; above 1.
        share: f64,
    },
    /// The last step is faster than a stop afterwards allows.
    #[error(
        "motor {motor} does not end at rest: its last step is {share:.3} times what its acceleration allows"
    )]
    RestAtEnd {
        /// The motor.
        motor: String,
        /// Share of the limit with its allowance; above 1.
        share: f64,
    },
    /// A motor is too fast.
    #[error(
        "motor {motor} runs at {speed_ticks_s:.1} ticks/s where {allowed_ticks_s:.1} are allowed (limit {limit_ticks_s:.1})"
    )]
    Speed {
        /// The motor.
        motor: String,
        /// Its speed, ticks/s.
        speed_ticks_s: f64,
        /// The limit with the rounding allowance, ticks/s.
        allowed_ticks_s: f64,
        /// The limit itself, ticks/s.
        limit_ticks_s: f64,
    },
    /// A motor accelerates too hard.
    #[error(
        "motor {motor} accelerates at {acceleration_ticks_s2:.1} ticks/s^2 where {allowed_ticks_s2:.1} are allowed (limit {limit_ticks_s2:.1})"
    )]
    Acceleration {
        /// The motor.
        motor: String,
        /// Its acceleration, ticks/s².
        acceleration_ticks_s2: f64,
        /// The limit with the rounding allowance, ticks/s².
        allowed_ticks_s2: f64,
        /// The limit itself, ticks/s².
        limit_ticks_s2: f64,
    },
    /// A third difference is larger than the jerk limit allows.
    #[error(
        "motor {motor} jerks at {jerk_ticks_s3:.1} ticks/s^3 where {allowed_ticks_s3:.1} are allowed (limit {limit_ticks_s3:.1})"
    )]
    Jerk {
        /// The motor.
        motor: String,
        /// Its jerk, ticks/s³.
        jerk_ticks_s3: f64,
        /// The limit with the rounding allowance, ticks/s³.
        allowed_ticks_s3: f64,
        /// The limit itself, ticks/s³.
        limit_ticks_s3: f64,
    },
    /// The motors move before the pen has finished its own movement.
    #[error("the motors move {early_us} us before pen {pen} has been {motion}")]
    MovesDuringPen {
        /// What the pen is doing.
        motion: PenMotion,
        /// The pen.
        pen: u16,
        /// How much of its time is left.
        early_us: u64,
    },
    /// A joint leaves its range by more than rounding can explain.
    #[error("{fault}")]
    Joint {
        /// Which, and by how much.
        fault: Fault,
    },
    /// Ink of a pen that the drawing does not use.
    #[error("pen {pen} draws, and the drawing has no stroke of it")]
    ForeignPen {
        /// The pen.
        pen: u16,
    },
    /// Ink too far from the drawing.
    #[error(
        "ink of pen {pen} strays {distance_mm:.4} mm from the drawing {} where {allowed_mm:.4} mm are allowed",
        stage(*.rounded)
    )]
    Deviates {
        /// The pen.
        pen: u16,
        /// Whether it is the path of the whole ticks, rather than the one before rounding.
        rounded: bool,
        /// How far.
        distance_mm: f64,
        /// How far it may be.
        allowed_mm: f64,
    },
    /// A part of the drawing too far from any ink.
    #[error(
        "{uncovered_mm:.2} mm of pen {pen} in {strokes} stroke{} are missed, by {} {distance_mm:.4} mm {} \
         where {allowed_mm:.4} mm are allowed",
        if *.strokes == 1 { "" } else { "s" },
        if *.is_lower_bound { "more than" } else { "up to" },
        stage(*.rounded)
    )]
    Uncovered {
        /// The pen.
        pen: u16,
        /// Whether it is the path of the whole ticks, rather than the one before rounding.
        rounded: bool,
        /// How far the worst place is from ink.
        distance_mm: f64,
        /// Whether it is only known to be more than that.
        is_lower_bound: bool,
        /// How far it may be.
        allowed_mm: f64,
        /// How much of the drawing is too far; 0 for a dot.
        uncovered_mm: f64,
        /// In how many strokes.
        strokes: u64,
    },
    /// A row's ticks are not the exact motor position rounded: an error that adds up.
    #[error("motor {motor} stands {by_ticks:.3} ticks from its exact position, rounding explains 0.5")]
    Drift {
        /// The motor.
        motor: String,
        /// The difference, ticks.
        by_ticks: f64,
    },
    /// A position or distance that is no finite number.
    #[error("a position is not a finite number")]
    NotFinite,
}

fn stage(rounded: bool) -> &'static str {
    if rounded { "after rounding to ticks" } else { "before rounding to ticks" }
}

impl Violation {
    /// Whether it is about a motor's speed, acceleration or jerk, which a plan may be allowed to break on purpose.
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

/// Where something is wrong, as far as that is known.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Location {
    /// Row of the table, from 0.
    pub row: Option<u64>,
    /// Time of that row, microseconds.
    pub t_us: Option<u64>,
    /// Point of the machine's plane, mm.
    pub point_mm: Option<Point>,
    /// Index of the stroke in the drawing.
    pub stroke: Option<usize>,
    /// Where the drawing's source says that stroke.
    pub source: Option<Span>,
}

/// Something wrong with a plan: what, where it is worst (or first), and how often. `Display` is one sentence.
#[derive(Clone, Debug, PartialEq)]
pub struct Failure {
    /// What.
    pub violation: Violation,
    /// Where.
    pub location: Location,
    /// In how many rows, or pieces of path, of this plan; at least 1.
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
            write!(f, "; {} times in all", self.count)?;
        }
        Ok(())
    }
}

/// Failures as they come in: each kind kept once, with its worst or first location.
#[derive(Clone, Debug, Default)]
pub(crate) struct Failures {
    kept: Vec<(Failure, usize, f64)>,
}

impl Failures {
    /// Notes a failure. `which` tells motors apart; of several alike the one of the largest `severity` stays, the
    /// first of equals.
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
