//! The image for DC motors.

use super::Bench;

pub(super) fn run(_bench: &mut Bench) {}
