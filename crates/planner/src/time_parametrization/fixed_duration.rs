//! Profiles that take the same time for every piece, whatever the motors' limits are.
//!
//! With x from 0 to 1 over the duration T of a piece of length L, the position is L y(x). The sine
//! and quadratic easings are those of the CoreXY worktable's firmware (report 3 in
//! docs/references.md).

use std::f64::consts::FRAC_PI_2;

use super::profile::{Phase, Profile};

/// Position against time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Easing {
    /// y = x: constant speed, with speed jumps at both ends.
    Linear,
    /// y = sin(pi x / 2): starts with a jump to pi/2 times the mean speed and decelerates to rest.
    SineOut,
    /// y = 2 x² for x < 1/2, then 1 - 2 (1 - x)²: from rest to rest, at most twice the mean speed.
    QuadraticInOut,
}

/// Over a piece of this length (in the path's parameter) in `time` s.
pub(crate) fn fixed_duration(easing: Easing, length: f64, time: f64) -> Profile {
    let mean = length / time;
    let mut profile = Profile::new();
    match easing {
        Easing::Linear => profile.push(Phase::even(0, 0.0, mean, 0.0, time)),
        Easing::SineOut => {
            // s'' = -omega² s with omega = pi / (2 T).
            let omega = FRAC_PI_2 / time;
            let acceleration_slope = -omega * omega;
            profile.push(Phase { acceleration_slope, ..Phase::even(0, 0.0, length * omega, 0.0, time) });
        }
        Easing::QuadraticInOut => {
            let acceleration = 4.0 * mean / time;
            profile.push(Phase::even(0, 0.0, 0.0, acceleration, 0.5 * time));
            profile.push(Phase::even(0, 0.5 * length, 2.0 * mean, -acceleration, 0.5 * time));
        }
    }
    profile
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The position at time t.
    fn at(profile: &Profile, t: f64) -> f64 {
        let mut since = t;
        for phase in &profile.phases {
            if since <= phase.duration_s {
                return phase.position_at(since);
            }
            since -= phase.duration_s;
        }
        f64::NAN
    }

    #[test]
    fn easings_match_their_definition() {
        for (easing, y) in [
            (Easing::Linear, (|x| x) as fn(f64) -> f64),
            (Easing::SineOut, |x| libm::sin(FRAC_PI_2 * x)),
            (Easing::QuadraticInOut, |x| {
                if x < 0.5 { 2.0 * x * x } else { 1.0 - 0.5 * (2.0 - 2.0 * x) * (2.0 - 2.0 * x) }
            }),
        ] {
            let profile = fixed_duration(easing, 7.0, 1.5);
            assert!((profile.duration_s - 1.5).abs() < 1e-12);
            for k in 0..=100 {
                let x = f64::from(k) / 100.0;
                let off = at(&profile, (1.5 * x).min(profile.duration_s)) - 7.0 * y(x);
                assert!(off.abs() < 1e-11, "{easing:?} at {x}: off by {off}");
            }
        }
    }
}
