//! Symmetric positive definite systems with a narrow band.

/// A system with `W` stored diagonals: `rows[i][k]` is the coefficient (i, i + k).
#[derive(Default)]
pub(super) struct Banded<const W: usize> {
    rows: Vec<[f64; W]>,
    /// The right side; after [`Self::solve`] the solution.
    pub(super) right: Vec<f64>,
}

impl<const W: usize> Banded<W> {
    /// Sets all coefficients of a system of `count` unknowns to 0.
    pub(super) fn reset(&mut self, count: usize) {
        self.rows.clear();
        self.rows.resize(count, [0.0; W]);
        self.right.clear();
        self.right.resize(count, 0.0);
    }

    /// Adds to the coefficients (i, j) and (j, i).
    #[inline]
    pub(super) fn add(&mut self, i: usize, j: usize, value: f64) {
        self.rows[i.min(j)][i.abs_diff(j)] += value;
    }

    /// Solves by L D Lᵀ in place; false if the matrix is not positive definite.
    ///
    /// The relative 1e-9 on the diagonal keeps the pivots of nearly singular systems positive: it
    /// shortens the step along directions that the objective does not determine.
    pub(super) fn solve(&mut self) -> bool {
        let count = self.rows.len();
        for i in 0..count {
            let mut pivot = self.rows[i];
            pivot[0] *= 1.0 + 1e-9;
            if !(pivot[0] > 0.0 && pivot[0].is_finite()) {
                return false;
            }
            let right = self.right[i];
            let inverse = 1.0 / pivot[0];
            let below = (W - 1).min(count - 1 - i);
            for q in 1..=below {
                let factor = pivot[q] * inverse;
                let row = &mut self.rows[i + q];
                for (x, p) in row[..W - q].iter_mut().zip(&pivot[q..]) {
                    *x -= factor * p;
                }
                self.right[i + q] -= factor * right;
                self.rows[i][q] = factor;
            }
            self.rows[i][0] = inverse;
        }
        for i in (0..count).rev() {
            let row = &self.rows[i];
            let after = &self.right[i + 1..];
            let known: f64 = row[1..].iter().zip(after).map(|(l, x)| l * x).sum();
            self.right[i] = self.right[i] * row[0] - known;
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn solution_satisfies_the_system(
            entries in proptest::collection::vec([-1.0..1.0f64, -1.0..1.0, -1.0..1.0, -1.0..1.0], 1..30),
        ) {
            // Diagonally dominant, so positive definite.
            let count = entries.len();
            let mut dense = vec![vec![0.0; count]; count];
            let mut system = Banded::<4>::default();
            system.reset(count);
            for (i, row) in entries.iter().enumerate() {
                for k in 0..4.min(count - i) {
                    let value = if k == 0 { 8.0 + row[0] } else { row[k] };
                    system.add(i, i + k, value);
                    dense[i][i + k] = value;
                    dense[i + k][i] = value;
                }
                system.right[i] = row[0] - row[3];
            }
            let right = system.right.clone();
            prop_assert!(system.solve());
            for (row, right) in dense.iter().zip(&right) {
                let product: f64 = row.iter().zip(&system.right).map(|(a, x)| a * x).sum();
                prop_assert!((product - right).abs() < 1e-6);
            }
        }
    }
}
