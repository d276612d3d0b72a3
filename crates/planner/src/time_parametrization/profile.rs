//! Velocity profiles: phases of closed-form motion along a joint path, and what limits them.

/// A part of a profile: a polynomial of degree 5 in time, or a motion whose acceleration changes
/// linearly with position.
///
/// With `t` from its beginning:
/// `s = start + speed S + acceleration C + jerk t³ / 6 + fourth t⁴ + fifth t⁵`, where `S = t` and
/// `C = t²/2`. If the acceleration changes with position,
/// `d²s/dt² = acceleration + acceleration_slope (s - start)`: then, with k² that slope,
/// `S = sinh(k t) / k` and `C = (cosh(k t) - 1) / k²` (sin and cos where the slope is negative), and
/// the further terms are 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Phase {
    /// Index of the piece it lies on.
    pub piece: usize,
    /// Position on the piece at its start, in units of the path's parameter.
    pub start: f64,
    /// Speed at its start, units/s.
    pub speed: f64,
    /// Acceleration at its start, units/s².
    pub acceleration: f64,
    /// Change of the acceleration with position, 1/s².
    pub acceleration_slope: f64,
    /// Change of the acceleration with time, units/s³.
    pub jerk: f64,
    /// Coefficient of t⁴, units/s⁴.
    pub fourth: f64,
    /// Coefficient of t⁵, units/s⁵.
    pub fifth: f64,
    /// Its duration, s; positive.
    pub duration_s: f64,
}

impl Phase {
    /// With constant acceleration.
    pub(super) fn even(piece: usize, start: f64, speed: f64, acceleration: f64, duration_s: f64) -> Self {
        Self {
            piece,
            start,
            speed,
            acceleration,
            acceleration_slope: 0.0,
            jerk: 0.0,
            fourth: 0.0,
            fifth: 0.0,
            duration_s,
        }
    }

    /// Position on the piece, speed and acceleration, `t` s after a phase began whose acceleration
    /// does not depend on the position.
    pub(super) fn motion_at(&self, t: f64) -> (f64, f64, f64) {
        let speed = self.speed
            + t * (self.acceleration
                + t * (0.5 * self.jerk + t * (4.0 * self.fourth + t * 5.0 * self.fifth)));
        let acceleration =
            self.acceleration + t * (self.jerk + t * (12.0 * self.fourth + t * 20.0 * self.fifth));
        (self.position_at(t), speed, acceleration)
    }

    /// Position on the piece, `t` s after the phase began.
    pub fn position_at(&self, t: f64) -> f64 {
        if self.acceleration_slope == 0.0 {
            let higher = self.jerk / 6.0 + t * (self.fourth + t * self.fifth);
            return self.start + t * (self.speed + t * (0.5 * self.acceleration + t * higher));
        }
        let square = self.acceleration_slope * t * t;
        let (first, second) = if square.abs() < 1e-4 {
            // Taylor series; the relative truncation error is below 1e-12.
            (
                t * (1.0 + square / 6.0 * (1.0 + square / 20.0)),
                0.5 * t * t * (1.0 + square / 12.0 * (1.0 + square / 30.0)),
            )
        } else {
            let k = self.acceleration_slope.abs().sqrt();
            if self.acceleration_slope > 0.0 {
                (libm::sinh(k * t) / k, (libm::cosh(k * t) - 1.0) / self.acceleration_slope)
            } else {
                (libm::sin(k * t) / k, (libm::cos(k * t) - 1.0) / self.acceleration_slope)
            }
        };
        self.start + self.speed * first + self.acceleration * second
    }
}

/// A velocity profile along a joint path, from rest to rest.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    /// The phases, in order; at least one.
    pub phases: Vec<Phase>,
    /// The sum of their durations, s.
    pub duration_s: f64,
    /// The constraints that prevent it from being faster.
    pub limiting: LimitingConstraints,
}

/// Speed limits other than those of the motors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpeedCap {
    /// Largest speed of the pen, mm/s; infinite for travel.
    pub pen_mm_s: f64,
    /// Largest distance by which linear motion between rows may leave the path, mm.
    pub row_deviation_mm: f64,
    /// Time between rows, s.
    pub period_s: f64,
}

/// For how long each constraint was active, that is, kept the motion from being faster, s.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LimitingConstraints {
    /// Each motor's speed.
    pub speed_s: [f64; 2],
    /// Each motor's acceleration, where most of it changes the speed along the path.
    pub acceleration_s: [f64; 2],
    /// Each motor's acceleration, where most of it follows the path's curvature.
    pub turning_s: [f64; 2],
    /// Each motor's jerk.
    pub jerk_s: [f64; 2],
    /// The pen's speed.
    pub pen_s: f64,
    /// Linear motion between rows, which would leave the path by more than its tolerance.
    pub rows_s: f64,
}

impl Profile {
    pub(super) fn new() -> Self {
        Self { phases: Vec::new(), duration_s: 0.0, limiting: LimitingConstraints::default() }
    }

    /// The same motion with its duration multiplied by `factor`.
    pub(super) fn slowed(mut self, factor: f64) -> Self {
        let slower = 1.0 / factor;
        for phase in &mut self.phases {
            phase.speed *= slower;
            phase.acceleration *= slower * slower;
            phase.acceleration_slope *= slower * slower;
            phase.jerk *= slower * slower * slower;
            phase.fourth *= slower * slower * slower * slower;
            phase.fifth *= slower * slower * slower * slower * slower;
            phase.duration_s *= factor;
        }
        self.duration_s *= factor;
        let limiting = std::mem::take(&mut self.limiting);
        self.limiting.add(&limiting, factor);
        self
    }

    pub(super) fn push(&mut self, phase: Phase) {
        self.duration_s += phase.duration_s;
        self.phases.push(phase);
    }
}

impl LimitingConstraints {
    /// The sum over all constraints, s.
    pub fn total_s(&self) -> f64 {
        let of = |pair: [f64; 2]| pair[0] + pair[1];
        of(self.speed_s)
            + of(self.acceleration_s)
            + of(self.turning_s)
            + of(self.jerk_s)
            + self.pen_s
            + self.rows_s
    }

    /// Adds the times of another motion, each multiplied by `scale`.
    pub fn add(&mut self, other: &Self, scale: f64) {
        for k in 0..2 {
            self.speed_s[k] += scale * other.speed_s[k];
            self.acceleration_s[k] += scale * other.acceleration_s[k];
            self.turning_s[k] += scale * other.turning_s[k];
            self.jerk_s[k] += scale * other.jerk_s[k];
        }
        self.pen_s += scale * other.pen_s;
        self.rows_s += scale * other.rows_s;
    }
}
