//! Laws that give every piece the same time, whatever the motors can: those of a drawing machine's own firmware.
//!
//! With x from 0 to 1 over the time T of a piece of length L, the way is L y(x). Source: seed 3's report.

use std::f64::consts::FRAC_PI_2;

use super::profile::{Phase, Profile};

/// How the way goes with time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Easing {
    /// y = x: evenly, from a jump in speed to another.
    Linear,
    /// y = sin(pi x / 2): from a jump in speed, pi/2 of the mean, slower and slower to rest.
    SineOut,
    /// y = 2 x² below one half, then 1 - 2 (1 - x)²: from rest to rest, at most twice the mean speed.
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

    /// Where a law is at time t.
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
    fn laws_go_as_they_are_defined() {
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
