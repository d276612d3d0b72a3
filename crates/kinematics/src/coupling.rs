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

    /// `C`.
    pub fn matrix(&self) -> &Matrix2<f64> {
        &self.matrix
    }

    /// The inverse of `C`.
    pub fn inverse(&self) -> &Matrix2<f64> {
        &self.inverse
    }

    /// `C q`.
    pub fn motors(&self, joints: Vector2<f64>) -> Vector2<f64> {
        self.matrix * joints
    }

    /// The joints at which `C q` equals `motors`.
    pub fn joints(&self, motors: Vector2<f64>) -> Vector2<f64> {
        self.inverse * motors
    }
}
