//! Differences between a plan's header and the machine that the plan is verified for.

use kinematics::Machine;
use plan::Header;

/// A statement of a plan's header that differs from the machine. `Display` is one sentence.
///
/// A mismatch is not a failure: the verifier uses the machine's values.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Mismatch {
    /// The plan was made for a machine of another name.
    #[error("the plan was made for machine {plan}, not for {machine}")]
    MachineName {
        /// Name in the plan.
        plan: String,
        /// Name of the machine.
        machine: String,
    },
    /// A motor has another name.
    #[error("column {column} of the plan is motor {plan}, of the machine {machine}")]
    MotorName {
        /// Number of the column, from 1.
        column: usize,
        /// Name in the plan.
        plan: String,
        /// Name in the machine.
        machine: String,
    },
    /// A limit of a motor has another value.
    #[error(
        "motor {motor}: {quantity} limit of {} in the plan, of {} in the machine",
        shown(*.plan, .unit), shown(*.machine, .unit)
    )]
    Limit {
        /// Name of the machine's motor.
        motor: String,
        /// `speed`, `acceleration` or `jerk`.
        quantity: &'static str,
        /// Unit of both values.
        unit: &'static str,
        /// The limit in the plan; `None` if it states none.
        plan: Option<f64>,
        /// The limit of the machine; `None` if it has none.
        machine: Option<f64>,
    },
}

fn shown(limit: Option<f64>, unit: &str) -> String {
    limit.map_or_else(|| "none".to_owned(), |limit| format!("{limit} {unit}"))
}

/// Compares a plan's header with a machine: names and limits. Plans written by plotplan for this
/// machine have no mismatch.
///
/// Limits are equal to a relative difference of 1e-9.
pub fn mismatches(machine: &Machine, header: &Header) -> Vec<Mismatch> {
    let mut found = Vec::new();
    if header.machine != machine.name() {
        let (plan, machine) = (header.machine.clone(), machine.name().to_owned());
        found.push(Mismatch::MachineName { plan, machine });
    }
    for (column, (stated, motor)) in header.motors.iter().zip(machine.motors()).enumerate() {
        if stated.name != motor.name {
            let (plan, machine) = (stated.name.clone(), motor.name.clone());
            found.push(Mismatch::MotorName { column: column + 1, plan, machine });
        }
        let limits = stated.limits;
        let pairs = [
            ("speed", "ticks/s", Some(limits.speed), Some(motor.max_speed_ticks_s)),
            ("acceleration", "ticks/s^2", Some(limits.acceleration), Some(motor.max_acceleration_ticks_s2)),
            ("jerk", "ticks/s^3", limits.jerk, motor.max_jerk_ticks_s3),
        ];
        for (quantity, unit, plan, machine) in pairs {
            let equal = match (plan, machine) {
                (Some(plan), Some(machine)) => (plan - machine).abs() <= 1e-9 * machine.abs(),
                (plan, machine) => plan == machine,
            };
            if !equal {
                // Beyond a thousandth of a tick digits say nothing.
                let [plan, machine] =
                    [plan, machine].map(|limit| limit.map(|limit| (limit * 1e3).round() / 1e3));
                found.push(Mismatch::Limit { motor: motor.name.clone(), quantity, unit, plan, machine });
            }
        }
    }
    found
}
