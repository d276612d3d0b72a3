//! The matrix between joints and motors.

use nalgebra::{Matrix2, Vector2};

/// `m = C q`: which combination of the joints each motor turns. Invertible by construction.
///
/// Examples: the identity for a plain machine; `[[1, 1], [1, -1]]` for CoreXY; for an arm whose elbow is driven through
/// a belt of ratio `k` from a motor on the base, with absolute link angles as joints, `[[1, 0], [1 - 1/k, 1/k]]`, which
/// is the identity for the usual `k = 1`: holding motor 2 keeps the second link's direction in the room, so the fold
/// angle at the elbow follows the shoulder.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coupling {
    matrix: Matrix2<f64>,
    inverse: Matrix2<f64>,
}

/// The rows of the coupling matrix are parallel: some movement of the pen would turn no motor at all.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("the coupling matrix has determinant {determinant}: it cannot be inverted")]
pub struct SingularCoupling {
    /// The determinant of the matrix that was refused.
    pub determinant: f64,
}

impl Coupling {
    /// The coupling with the given rows, one a motor.
    ///
    /// # Errors
    /// When the matrix is singular: its determinant is below 1e-9 of the product of its rows' lengths, or not a number.
    pub fn from_rows(rows: [[f64; 2]; 2]) -> Result<Self, SingularCoupling> {
        let matrix = Matrix2::new(rows[0][0], rows[0][1], rows[1][0], rows[1][1]);
        let determinant = matrix.determinant();
        let scale = matrix.row(0).norm() * matrix.row(1).norm();
        let regular = determinant.abs() > 1e-9 * scale && determinant.is_finite();
        match matrix.try_inverse() {
            Some(inverse) if regular => Ok(Self { matrix, inverse }),
            _ => Err(SingularCoupling { determinant }),
        }
    }

    /// The rows of `C`, one per motor.
    pub fn rows(&self) -> [[f64; 2]; 2] {
        let m = &self.matrix;
        [[m.m11, m.m12], [m.m21, m.m22]]
    }

    /// `diag(ticks_per_unit) C`, from joints to motor ticks, and its inverse.
    pub(crate) fn scaled(&self, ticks_per_unit: [f64; 2]) -> (Matrix2<f64>, Matrix2<f64>) {
        let scale = Vector2::from(ticks_per_unit);
        let to_ticks = Matrix2::from_diagonal(&scale) * self.matrix;
        let from_ticks = self.inverse * Matrix2::from_diagonal(&scale.map(|ticks| 1.0 / ticks));
        (to_ticks, from_ticks)
    }
}
