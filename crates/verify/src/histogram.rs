//! Percentiles of a stream in constant memory.

/// A histogram with 64 bins a power of two: a relative resolution of 1/64.
#[derive(Clone, Debug)]
pub(crate) struct Histogram {
    weights: Vec<f64>,
}

/// Mantissa bits of the bin number.
const BITS: u32 = 6;
/// Smallest value distinguished from 0: 2^-40.
const LOWEST: u64 = (1023 - 40) << BITS;
/// Bins up to 2^24.
const BINS: u64 = 64 << BITS;

impl Histogram {
    pub(crate) fn new() -> Self {
        Self { weights: vec![0.0; BINS as usize] }
    }

    /// Counts `value` (0 or more) with `weight`.
    pub(crate) fn add(&mut self, value: f64, weight: f64) {
        // The bits of a positive `f64` increase with it: exponent, then mantissa.
        let bin = (value.to_bits() >> (52 - BITS)).saturating_sub(LOWEST).min(BINS - 1);
        self.weights[bin as usize] += weight;
    }

    /// An upper bound for at least `share` of the weight: the upper edge of a bin, at most
    /// `largest`.
    pub(crate) fn percentile(&self, share: f64, largest: f64) -> f64 {
        let total: f64 = self.weights.iter().sum();
        let mut sum = 0.0;
        for (bin, weight) in (0..BINS).zip(&self.weights) {
            sum += weight;
            if total > 0.0 && sum >= share * total {
                return f64::from_bits((bin + LOWEST + 1) << (52 - BITS)).min(largest);
            }
        }
        largest
    }
}

#[cfg(test)]
mod tests {
    use super::Histogram;

    #[test]
    fn percentiles_are_bounds_to_one_sixty_fourth() {
        let mut histogram = Histogram::new();
        (1..=1000).for_each(|k| histogram.add(f64::from(k) * 1e-3, 1.0));
        let p99 = histogram.percentile(0.99, 1.0);
        assert!((0.99..=0.99 * (1.0 + 1.0 / 64.0)).contains(&p99), "{p99}");
        assert_eq!(histogram.percentile(1.0, 1.0), 1.0);
    }

    #[test]
    fn empty_histogram_and_extreme_values() {
        assert_eq!(Histogram::new().percentile(0.99, 7.0), 7.0);
        let mut histogram = Histogram::new();
        histogram.add(0.0, 99.0);
        histogram.add(f64::INFINITY, 1.0);
        assert!(histogram.percentile(0.99, f64::INFINITY) < 1e-11);
        assert_eq!(histogram.percentile(1.0, 3.0), 3.0);
    }
}
