//! The coupling matrix between joints and motors.

use nalgebra::{Matrix2, Vector2};

/// `m = C q`: the combination of the joints that each motor drives. Always invertible.
///
/// Examples: the identity where each motor drives one joint; `[[1, 1], [1, -1]]` for CoreXY; for an arm
/// whose elbow is driven through a belt of ratio `k` by a motor on the base, with absolute link angles
/// as joints, `[[1, 0], [1 - 1/k, 1/k]]`. With the usual `k = 1` this is the identity: motor 2 sets the
/// absolute direction of the second link.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coupling {
    matrix: Matrix2<f64>,
    inverse: Matrix2<f64>,
}

/// The coupling matrix is singular: some motion of the pen would move no motor.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("the coupling matrix has determinant {determinant}: it is not invertible")]
pub struct SingularCoupling {
    /// The determinant of the refused matrix.
    pub determinant: f64,
}

impl Coupling {
    /// The coupling with the given rows, one per motor.
    ///
    /// # Errors
    /// When the matrix is singular: its determinant is at most 1e-9 of the product of its rows' lengths,
    /// infinite or NaN.
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
