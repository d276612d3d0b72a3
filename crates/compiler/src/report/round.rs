//! Numbers of reports, rounded to what they mean.

/// Rounds to a number of decimals. Without a negative zero; values that are not finite stay as they
/// are.
fn to(value: f64, per_unit: f64) -> f64 {
    let rounded = (value * per_unit).round() / per_unit;
    if rounded.is_finite() { rounded + 0.0 } else { value }
}

/// A length, mm: to 0.1 micrometres, a hundredth of the finest tick in use.
pub(super) fn mm(value: f64) -> f64 {
    to(value, 1e4)
}

/// A time, s: to microseconds, the unit of plans.
pub(super) fn s(value: f64) -> f64 {
    to(value, 1e6)
}

/// A share of a limit: to 0.01 %.
pub(super) fn share(value: f64) -> f64 {
    to(value, 1e4)
}

/// Ticks, ticks/s, ticks/s² or ticks/s³: to a thousandth.
pub(super) fn ticks(value: f64) -> f64 {
    to(value, 1e3)
}

/// A gain margin, or a phase margin in degrees: to a thousandth.
pub(super) fn margin(value: f64) -> f64 {
    to(value, 1e3)
}

/// A coefficient of a map: to 1e-9.
pub(super) fn coefficient(value: f64) -> f64 {
    to(value, 1e9)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_no_noise_digits() {
        assert_eq!(mm(169.269_999_999_999_98).to_string(), "169.27");
        assert_eq!(mm(1.4e-14).to_string(), "0");
        assert_eq!(mm(-1e-9).to_string(), "0");
        assert_eq!(share(0.909_090_9).to_string(), "0.9091");
        assert_eq!(ticks(1600.0 / 3.0).to_string(), "533.333");
        assert!(mm(f64::NAN).is_nan());
    }
}
