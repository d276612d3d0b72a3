//! Positions in joint space and in motor space: two types, so that one cannot stand in for the other.

use std::ops::{Add, AddAssign, Div, Index, IndexMut, Mul, Neg, Sub};

macro_rules! position {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq)]
        pub struct $name(pub [f64; 2]);

        impl $name {
            /// Both components 0.
            pub const ZERO: Self = Self([0.0; 2]);

            /// The vector of two components.
            pub const fn new(first: f64, second: f64) -> Self {
                Self([first, second])
            }

            /// Whether both components are finite.
            pub fn is_finite(&self) -> bool {
                self.0.iter().all(|component| component.is_finite())
            }

            /// The Euclidean norm. The components may have different units; their numbers are taken as they are.
            pub fn norm(&self) -> f64 {
                let [a, b] = self.0;
                (a * a + b * b).sqrt()
            }

            /// The vector of the components' absolute values.
            pub fn abs(&self) -> Self {
                Self([self.0[0].abs(), self.0[1].abs()])
            }

            /// The larger of the components' absolute values.
            pub fn max_abs(&self) -> f64 {
                self.0[0].abs().max(self.0[1].abs())
            }
        }

        impl From<[f64; 2]> for $name {
            #[inline]
            fn from(components: [f64; 2]) -> Self {
                Self(components)
            }
        }

        impl From<$name> for [f64; 2] {
            #[inline]
            fn from(vector: $name) -> Self {
                vector.0
            }
        }

        impl Index<usize> for $name {
            type Output = f64;

            #[inline]
            fn index(&self, index: usize) -> &f64 {
                &self.0[index]
            }
        }

        impl IndexMut<usize> for $name {
            #[inline]
            fn index_mut(&mut self, index: usize) -> &mut f64 {
                &mut self.0[index]
            }
        }

        impl Add for $name {
            type Output = Self;

            #[inline]
            fn add(self, other: Self) -> Self {
                Self([self.0[0] + other.0[0], self.0[1] + other.0[1]])
            }
        }

        impl AddAssign for $name {
            #[inline]
            fn add_assign(&mut self, other: Self) {
                *self = *self + other;
            }
        }

        impl Sub for $name {
            type Output = Self;

            #[inline]
            fn sub(self, other: Self) -> Self {
                Self([self.0[0] - other.0[0], self.0[1] - other.0[1]])
            }
        }

        impl Neg for $name {
            type Output = Self;

            #[inline]
            fn neg(self) -> Self {
                Self([-self.0[0], -self.0[1]])
            }
        }

        impl Mul<f64> for $name {
            type Output = Self;

            #[inline]
            fn mul(self, factor: f64) -> Self {
                Self([self.0[0] * factor, self.0[1] * factor])
            }
        }

        impl Div<f64> for $name {
            type Output = Self;

            #[inline]
            fn div(self, divisor: f64) -> Self {
                Self([self.0[0] / divisor, self.0[1] / divisor])
            }
        }

        impl Mul<$name> for f64 {
            type Output = $name;

            #[inline]
            fn mul(self, vector: $name) -> $name {
                vector * self
            }
        }
    };
}

position! {
    /// A pose: the positions of the two joints, rad or mm as the mechanism defines them. Differences of poses and
    /// derivatives of the joints (rad/s, mm/s, ...) have this type too.
    JointPos
}

position! {
    /// The positions of the two motors, ticks that need not be whole. Differences and derivatives (ticks/s,
    /// ticks/s², ...) have this type too.
    MotorPos
}
