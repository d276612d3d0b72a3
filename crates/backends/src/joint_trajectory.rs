//! A ROS `trajectory_msgs/JointTrajectory` as JSON: positions, velocities and accelerations of the joints at each row.
//!
//! A controller interpolates with quintics when it has all three. Angles are rad, lengths metres (REP 103); the pen is a third
//! joint that is 0 up and 1 down. Velocities and accelerations are central differences of the positions before
//! rounding, and 0 where the joints rest.

use std::io::Write;

use crate::setpoint::{Setpoint, at_rest};
use kinematics::JointKind;
use plan::file::text::Text;

use crate::WriteError;
use crate::backend::{Backend, EncodeOptions, PenNumbers, PlanSource};

/// A ROS message.
#[derive(Clone, Copy, Debug)]
pub(crate) struct JointTrajectory;

impl Backend for JointTrajectory {
    fn name(&self) -> &'static str {
        "joint-trajectory"
    }

    fn format_help(&self) -> Option<&'static str> {
        Some("ROS JointTrajectory, as JSON")
    }

    fn pens(&self) -> PenNumbers {
        PenNumbers::Dropped
    }

    fn needs_machine(&self) -> bool {
        true
    }

    fn write(
        &self,
        plan: &PlanSource<'_>,
        _options: &EncodeOptions,
        out: &mut dyn Write,
    ) -> Result<(), WriteError> {
        let setpoints: Vec<Setpoint> = plan.setpoints(self.name())?.collect();
        let mechanism = plan.machine(self.name())?.mechanism();
        write(
            &setpoints,
            mechanism.joint_names(),
            mechanism.joint_kinds().map(|kind| kind == JointKind::Revolute),
            out,
        )
    }
}

/// Writes a plan. `names` are the joints', `angles` tells which of them are angles.
///
/// # Errors
/// An error of the writer.
fn write<W: Write + ?Sized>(
    setpoints: &[Setpoint],
    names: [&str; 2],
    angles: [bool; 2],
    out: &mut W,
) -> Result<(), WriteError> {
    let mut text = Text::new(out);
    text.str(
        "{\"header\": {\"stamp\": {\"sec\": 0, \"nanosec\": 0}, \"frame_id\": \"\"},\n\"joint_names\": [\"",
    );
    text.str(names[0]).str("\", \"").str(names[1]).str("\", \"pen\"],\n\"points\": [");
    let unit = angles.map(|angle| if angle { 1.0 } else { 1e-3 });
    let at = |k: usize, joint: usize| setpoints[k].joints[joint] * unit[joint];
    for (k, setpoint) in setpoints.iter().enumerate() {
        let (mut velocity, mut acceleration) = ([0.0; 2], [0.0; 2]);
        if k > 0 && k + 1 < setpoints.len() {
            let gap = |a: usize, b: usize| (setpoints[b].row.t_us - setpoints[a].row.t_us) as f64 * 1e-6;
            let (before, after) = (gap(k - 1, k), gap(k, k + 1));
            for joint in 0..2 {
                let slopes =
                    [(at(k, joint) - at(k - 1, joint)) / before, (at(k + 1, joint) - at(k, joint)) / after];
                if !at_rest(&setpoints[k - 1], setpoint) && !at_rest(setpoint, &setpoints[k + 1]) {
                    velocity[joint] = (before * slopes[1] + after * slopes[0]) / (before + after);
                    acceleration[joint] = 2.0 * (slopes[1] - slopes[0]) / (before + after);
                }
            }
        }
        text.str(if k == 0 { "\n" } else { ",\n" }).str("{\"positions\": [");
        let down = f64::from(u8::from(setpoint.row.pen != 0));
        triple(&mut text, [at(k, 0), at(k, 1), down]);
        text.str("], \"velocities\": [");
        triple(&mut text, [velocity[0], velocity[1], 0.0]);
        text.str("], \"accelerations\": [");
        triple(&mut text, [acceleration[0], acceleration[1], 0.0]);
        text.str("], \"time_from_start\": {\"sec\": ").int(setpoint.row.t_us / 1_000_000);
        text.str(", \"nanosec\": ").int(setpoint.row.t_us % 1_000_000 * 1000).str("}}").flush_if_full()?;
    }
    text.str("\n]}\n");
    Ok(text.finish()?)
}

/// To a nanometre or a nanoradian.
fn triple<W: Write + ?Sized>(text: &mut Text<'_, W>, values: [f64; 3]) {
    for (index, value) in values.into_iter().enumerate() {
        text.str(if index == 0 { "" } else { ", " }).float((value * 1e9).round() / 1e9);
    }
}
