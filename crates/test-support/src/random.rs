//! Reproducible pseudo-random numbers.

/// A linear congruential generator: 64 bits, Knuth's MMIX constants, of which the upper half is used
/// (Knuth, The Art of Computer Programming 2, 3.3.4). The seed is the state.
#[derive(Clone, Debug)]
pub struct Random(pub u64);

impl Random {
    fn step(&mut self) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        self.0
    }

    /// A number below `bound`, which must not be 0.
    pub fn below(&mut self, bound: u64) -> u64 {
        (self.step() >> 33) % bound
    }

    /// A number from 0 to below 1.
    pub fn unit(&mut self) -> f64 {
        (self.step() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// A number from `low` to below `high`.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + self.unit() * (high - low)
    }
}
