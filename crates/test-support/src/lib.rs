//! What the tests of several crates share: machines, strategies for random machines, strokes, a
//! small generator of numbers, a temporary directory. Not published.
//!
//! It depends on `drawing` and `kinematics` only, so that every other crate's tests can use it.
//! Unit tests inside those two crates cannot (they would meet their own types twice); their
//! integration tests can.
#![allow(clippy::missing_panics_doc, reason = "helpers of tests panic where a test must fail")]

pub mod band;
mod dir;
pub mod machines;
pub mod mechanisms;
mod program;
mod random;
mod strokes;

pub use dir::TestDir;
pub use program::{Program, stderr, stdout};
pub use random::Random;
pub use strokes::{distance_to_polyline, polyline};
