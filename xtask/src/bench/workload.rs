//! The planner's workload: one stroke of circles, zigzags, long lines and roses.
//!
//! The points are those that other planners were measured on, so the heights of the zigzags come
//! from the same random number generator (MT19937, Matsumoto & Nishimura 1998, seeded with 7). The
//! polyline of 10,000 points is 11,649.942 mm long.

use std::f64::consts::{PI, TAU};
use std::fmt::Write as _;

use drawing::Point;

/// The first `count` points of the workload without repetitions, mm.
pub(super) fn points(count: usize) -> Vec<Point> {
    let mut chance = MersenneTwister::new(7);
    let mut points: Vec<Point> = Vec::new();
    let mut row: u32 = 0;
    while points.len() < count {
        let kind = row % 4;
        row += 1;
        let x = f64::from(20 + row * 23 % 240);
        let y = f64::from(20 + row * 23 / 240 * 17 % 160);
        let mut add = |dx: f64, dy: f64| points.push(Point::new(x + dx, y + dy));
        match kind {
            0 => {
                let r = 1.0 + (f64::from(row) * 1.37) % 19.0;
                let n = ((TAU * r / 0.35) as u32).max(24);
                for angle in (0..=n).map(|i| TAU * f64::from(i) / f64::from(n)) {
                    add(r * angle.cos(), r * angle.sin());
                }
            }
            1 => {
                let height = 1.5 + f64::from(row % 5) * 0.4;
                for i in 0..80 {
                    let base = if i % 2 == 1 { height } else { 0.0 };
                    add(f64::from(i) * 0.35, base + 0.3 * chance.fraction());
                }
            }
            2 => [(0.0, 0.0), (60.0, 5.0), (62.0, 40.0)].iter().for_each(|&(dx, dy)| add(dx, dy)),
            _ => {
                for angle in (0..=400).map(|i| 4.0 * PI * f64::from(i) / 400.0) {
                    let r = 12.0 * (2.5 * angle).cos();
                    add(r * angle.cos(), r * angle.sin());
                }
            }
        }
    }
    points.truncate(count);
    points.dedup_by(|next, kept| (*next - *kept).hypot() <= 1e-6);
    points
}

/// The points as one stroke of HPGL, with fractions of a plotter unit far below a motor step.
pub(super) fn hpgl(points: &[Point]) -> String {
    let mut text = String::from("IN;SP1;");
    for (index, point) in points.iter().enumerate() {
        let verb = ["PU", ";PD", ","][index.min(2)];
        // Writing to a string cannot fail.
        let _ = write!(text, "{verb}{:.6},{:.6}", point.x * 40.0, point.y * 40.0);
    }
    text.push_str(";PU;SP0;\n");
    text
}

/// MT19937.
struct MersenneTwister {
    state: [u32; Self::N],
    next: usize,
}

impl MersenneTwister {
    const N: usize = 624;
    const M: usize = 397;

    /// Initialized by an array of one word, the key.
    fn new(key: u32) -> Self {
        let mut state = [19_650_218_u32; Self::N];
        let mix = |state: &[u32; Self::N], i: usize, factor: u32| {
            (state[i - 1] ^ (state[i - 1] >> 30)).wrapping_mul(factor)
        };
        for i in 1..Self::N {
            state[i] = mix(&state, i, 1_812_433_253).wrapping_add(i as u32);
        }
        let mut i = 1;
        let mut advance = |state: &mut [u32; Self::N], factor: u32, add: &dyn Fn(usize) -> u32| {
            state[i] = (state[i] ^ mix(state, i, factor)).wrapping_add(add(i));
            i += 1;
            if i == Self::N {
                state[0] = state[Self::N - 1];
                i = 1;
            }
        };
        for _ in 0..Self::N {
            advance(&mut state, 1_664_525, &|_| key);
        }
        for _ in 1..Self::N {
            advance(&mut state, 1_566_083_941, &|i| (i as u32).wrapping_neg());
        }
        state[0] = 0x8000_0000;
        Self { state, next: Self::N }
    }

    fn word(&mut self) -> u32 {
        if self.next == Self::N {
            for i in 0..Self::N {
                let joined = (self.state[i] & 0x8000_0000) | (self.state[(i + 1) % Self::N] & 0x7fff_ffff);
                let odd = if joined & 1 == 1 { 0x9908_b0df } else { 0 };
                self.state[i] = self.state[(i + Self::M) % Self::N] ^ (joined >> 1) ^ odd;
            }
            self.next = 0;
        }
        let mut word = self.state[self.next];
        self.next += 1;
        word ^= word >> 11;
        word ^= (word << 7) & 0x9d2c_5680;
        word ^= (word << 15) & 0xefc6_0000;
        word ^ (word >> 18)
    }

    /// A number in [0, 1) with 53 bits.
    fn fraction(&mut self) -> f64 {
        let (high, low) = (self.word() >> 5, self.word() >> 6);
        (f64::from(high) * 67_108_864.0 + f64::from(low)) / 9_007_199_254_740_992.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn workload_length_matches_reference() {
        let points = points(10_000);
        let length: f64 = points.windows(2).map(|w| (w[1] - w[0]).hypot()).sum();
        assert!((length - 11_649.942).abs() < 0.0005, "{length}");
    }
}
