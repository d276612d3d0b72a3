//! Symmetric positive definite systems with a narrow band.

/// A system with `W` stored diagonals: `rows[i][k]` is the coefficient (i, i + k).
#[derive(Default)]
pub(super) struct Banded<const W: usize> {
    rows: Vec<[f64; W]>,
    /// The number of unknowns.
    count: usize,
    /// The right side; after [`Self::solve`] the solution.
    pub(super) right: Vec<f64>,
}

impl<const W: usize> Banded<W> {
    /// Sets all coefficients of a system of `count` unknowns to 0.
    pub(super) fn reset(&mut self, count: usize) {
        // With rows of 0 behind the last one, so that each has W - 1 after it.
        self.count = count;
        self.rows.clear();
        self.rows.resize(count + W - 1, [0.0; W]);
        self.right.clear();
        self.right.resize(count + W - 1, 0.0);
    }

    /// Adds to the coefficients (i, j) and (j, i), where i is at most j.
    #[inline]
    pub(super) fn add(&mut self, i: usize, j: usize, value: f64) {
        self.rows[i][j - i] += value;
    }

    /// Adds a symmetric matrix, given on and above its diagonal, to the W unknowns from `base` on and
    /// subtracts a gradient from the right side; without unknowns outside of the system.
    pub(super) fn add_block(&mut self, base: isize, gradient: &[f64; W], matrix: &[[f64; W]; W]) {
        let inside = |k: usize| usize::try_from(base + k as isize).ok().filter(|index| *index < self.count);
        // Columns behind the end get no value: their rows are not part of the system.
        let end = (self.count as isize - base).clamp(0, W as isize) as usize;
        for k in 0..W {
            let Some(index) = inside(k) else { continue };
            self.right[index] -= gradient[k];
            let row = &mut self.rows[index];
            for (value, add) in row.iter_mut().zip(&matrix[k][k..end]) {
                *value += add;
            }
        }
    }

    /// The solution after [`Self::solve`].
    pub(super) fn solution(&self) -> &[f64] {
        &self.right[..self.count]
    }

    /// Solves by L D Lᵀ in place; false if the matrix is not positive definite.
    ///
    /// The relative 1e-9 on the diagonal keeps the pivots of nearly singular systems positive: it
    /// shortens the step along directions that the objective does not determine.
    pub(super) fn solve(&mut self) -> bool {
        for i in 0..self.count {
            let (eliminated, after) = self.rows.split_at_mut(i + 1);
            let (row, Some(after)) = (&mut eliminated[i], after.get_mut(..W - 1)) else { return false };
            let mut pivot = *row;
            pivot[0] *= 1.0 + 1e-9;
            if !(pivot[0] > 0.0 && pivot[0].is_finite()) {
                return false;
            }
            let (solved, rights) = self.right.split_at_mut(i + 1);
            let (right, Some(rights)) = (solved[i], rights.get_mut(..W - 1)) else { return false };
            let inverse = 1.0 / pivot[0];
            row[0] = inverse;
            for q in 1..W {
                let factor = pivot[q] * inverse;
                row[q] = factor;
                rights[q - 1] -= factor * right;
                let target = &mut after[q - 1];
                for k in 0..W - q {
                    target[k] -= factor * pivot[q + k];
                }
            }
        }
        for i in (0..self.count).rev() {
            let row = &self.rows[i];
            let Some(after) = self.right.get(i + 1..i + W) else { return false };
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
            let right = system.solution().to_vec();
            prop_assert!(system.solve());
            for (row, right) in dense.iter().zip(&right) {
                let product: f64 = row.iter().zip(system.solution()).map(|(a, x)| a * x).sum();
                prop_assert!((product - right).abs() < 1e-6);
            }
        }
    }
}
