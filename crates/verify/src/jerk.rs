//! One motor's column against its jerk limit, in third differences of whole ticks.

use crate::{JerkPeak, histogram::Histogram, limits::Excess};

/// Checks one motor row by row.
///
/// For four rows at the times `t0` to `t3` the third divided difference of the position is a sixth
/// of the jerk at some time between them. Each tick is off by half a tick at most, so with
/// `w_i = Π 1 / |t_i - t_j|` over the other three rows
///
/// ```text
/// |Σ ± w_i q_i| <= (j + 3 Σ w_i) / 6             times 6 T³:  |third difference| <= j T³ + 4
/// ```
///
/// A step longer than the period replaces omitted rows, between which the motor moves uniformly or
/// rests. The motor is at rest before the first row and after the last one.
#[derive(Clone, Debug)]
pub(crate) struct JerkCheck {
    limit: f64,
    period_s: f64,
    /// Size of a rounding step: 1 tick, or 0 for exact positions.
    rounding_ticks: f64,
    /// The last three rows: time relative to the last one, s, and position, ticks.
    rows: [(f64, f64); 3],
    /// The third difference with the largest share of its bound.
    jerk: f64,
    /// Its bound.
    allowed: f64,
    share: f64,
    shares: Histogram,
}

impl JerkCheck {
    /// For whole ticks.
    pub(crate) fn new(limit: f64, period_us: u64) -> Self {
        let period_s = period_us.max(1) as f64 * 1e-6;
        let rows = [(-2.0 * period_s, 0.0), (-period_s, 0.0), (0.0, 0.0)];
        Self {
            limit,
            period_s,
            rounding_ticks: 1.0,
            rows,
            jerk: 0.0,
            allowed: limit,
            share: 0.0,
            shares: Histogram::new(),
        }
    }

    /// For exact positions.
    pub(crate) fn exact(limit: f64, period_us: u64) -> Self {
        Self { rounding_ticks: 0.0, ..Self::new(limit, period_us) }
    }

    /// The motor moves by `difference` ticks in `dt_us`. Returns the largest excess in this step.
    pub(crate) fn step(&mut self, dt_us: u64, difference: f64) -> Option<Excess> {
        let dt_s = dt_us as f64 * 1e-6;
        let from = self.rows[2].1;
        let mut worst = None;
        // Of the omitted rows, only the first and last two can enter a third difference that is not
        // 0.
        let omitted = (dt_us as f64 / (self.period_s * 1e6)).round().max(1.0) as u64;
        let near = [1, 2, omitted.saturating_sub(2), omitted.saturating_sub(1)];
        let mut last = 0;
        for k in near.into_iter().chain([omitted]) {
            if k > last && k <= omitted {
                let (step, share) = ((k - last) as f64 / omitted as f64, k as f64 / omitted as f64);
                last = k;
                worst = self.add_row(step * dt_s, from + share * difference, worst);
            }
        }
        // Positions relative to this row, so that they stay small.
        let (_, here) = self.rows[2];
        for row in &mut self.rows {
            row.1 -= here;
        }
        worst
    }

    /// The motor is at rest from now on.
    pub(crate) fn stop(&mut self) -> Option<Excess> {
        let mut worst = None;
        for _ in 0..2 {
            let (_, here) = self.rows[2];
            worst = self.add_row(self.period_s, here, worst);
        }
        worst
    }

    fn add_row(&mut self, dt_s: f64, position: f64, worst: Option<Excess>) -> Option<Excess> {
        let rows = [self.rows[0], self.rows[1], self.rows[2], (self.rows[2].0 + dt_s, position)];
        // Times relative to this row.
        self.rows = [rows[1], rows[2], rows[3]].map(|(t, q)| (t - rows[3].0, q));
        if rows.iter().all(|row| row.1 == rows[0].1) {
            return worst;
        }
        let (mut divided, mut allowance) = (0.0, 0.0);
        for (i, (t, q)) in rows.iter().enumerate() {
            let others = rows.iter().enumerate().filter(|(j, _)| *j != i);
            let weight = 1.0 / others.map(|(_, other)| t - other.0).product::<f64>();
            divided += weight * q;
            allowance += weight.abs();
        }
        let rounding = 3.0 * self.rounding_ticks * allowance;
        let (value, allowed) = (6.0 * f64::abs(divided), self.limit + rounding);
        let share = value / allowed;
        if share > self.share {
            (self.jerk, self.allowed, self.share) = (value, allowed, share);
        }
        self.shares.add(share, 1.0);
        // `NaN` as a limit is exceeded by every value. The tolerance covers rounding in the divided
        // difference.
        let within = value <= allowed * (1.0 + 1e-6);
        if within || worst.is_some_and(|worst| worst.share() >= share) {
            return worst;
        }
        Some(Excess { value, allowed })
    }

    /// The peak of whole ticks; that of the motion from `exact`, where its positions are known.
    pub(crate) fn peak(&self, exact: Option<&Self>) -> JerkPeak {
        let motion = exact.unwrap_or(self);
        JerkPeak {
            jerk_ticks_s3: exact.map(|exact| exact.jerk),
            limit_ticks_s3: self.limit,
            whole_tick_jerk_ticks_s3: self.jerk,
            whole_tick_jerk_allowed_ticks_s3: self.allowed,
            share_p999: motion.shares.percentile(0.999, motion.share),
            share: motion.share,
        }
    }

    pub(crate) fn limit(&self) -> f64 {
        self.limit
    }
}

#[cfg(test)]
mod tests {
    use super::JerkCheck;

    const PERIOD_US: u64 = 10_000;

    /// 10^7 ticks/s³: at 10 ms 10 + 4 ticks a third difference. The index of the first step in
    /// excess.
    fn first_excess(steps: &[(u64, i64)]) -> Option<usize> {
        let mut check = JerkCheck::new(1e7, PERIOD_US);
        for (index, (periods, step)) in steps.iter().enumerate() {
            if check.step(periods * PERIOD_US, *step as f64).is_some() {
                return Some(index);
            }
        }
        check.stop().map(|_| steps.len())
    }

    #[test]
    fn third_difference_limit_is_14_ticks() {
        // Steps of 14, 42, 70, ... have second differences of 14, 28, 28, ... and third ones of 14,
        // 14, 0.
        assert_eq!(
            first_excess(&[(1, 14), (1, 42), (1, 70), (1, 84), (1, 84), (1, 70), (1, 42), (1, 14)]),
            None
        );
        assert_eq!(first_excess(&[(1, 15)]), Some(0));
        assert_eq!(first_excess(&[(1, 14), (1, 43)]), Some(1));
        // A sudden stop: second differences 7, 7, 1, -15.
        assert_eq!(first_excess(&[(1, 7), (1, 14), (1, 15)]), Some(3));
    }

    #[test]
    fn omitted_rows_count_as_rest_or_uniform_motion() {
        for gap in [1, 2, 3, 4, 5, 500] {
            assert_eq!(
                first_excess(&[(gap, 0), (1, 14), (1, 28), (1, 28), (1, 14), (gap, 0)]),
                None,
                "{gap}"
            );
            assert_eq!(first_excess(&[(gap, 0), (1, 15)]), Some(1), "{gap}");
            let even = 28 * gap as i64;
            assert_eq!(first_excess(&[(1, 14), (1, 28), (gap, even), (1, 28), (1, 14)]), None, "{gap}");
            // 28, then 13: second difference -15, after uniform motion.
            assert_eq!(first_excess(&[(1, 14), (1, 28), (gap, even), (1, 28), (1, 13)]), Some(4), "{gap}");
        }
    }

    #[test]
    fn exact_positions_have_no_allowance() {
        // 10^7 ticks/s³ are 10 ticks a third difference.
        assert!(JerkCheck::exact(1e7, PERIOD_US).step(PERIOD_US, 10.0).is_none());
        let excess = JerkCheck::exact(1e7, PERIOD_US).step(PERIOD_US, 10.1).expect("above the limit");
        assert!((excess.value - 1.01e7).abs() < 1.0 && excess.allowed == 1e7, "{excess:?}");
    }

    #[test]
    fn nan_limit_is_exceeded() {
        assert!(JerkCheck::new(f64::NAN, 0).step(1, 1.0).is_some());
    }
}
