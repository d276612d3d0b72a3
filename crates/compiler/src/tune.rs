//! What each measure on a drive buys, and the gains to use.

use kinematics::{Machine, MachineError, MachineParts};
use schemars::JsonSchema;
use serde::Serialize;
use simulation::tune::{OffCase, Terms, Tuned, Tuner, three_digits};
use simulation::{
    Drive, FeedForward, Feedback, Job, MotorPlant, PidGains, Recorded, SimulationError, Target,
};

use crate::simulate::{Plan, margins, vertices};

/// How much finer the finer encoder is.
pub const FINER: f64 = 4.0;
/// How much faster the faster loop is, and its least period, s.
const FASTER: f64 = 5.0;
const SHORTEST_PERIOD_S: f64 = 1e-3;

/// A drawing for machines without one, 100 mm square: lines in eight directions, corners, and a circle.
pub const TEST_PATTERN: &[u8] = b"IN;SP1;PU0,0;PD4000,0,4000,4000,0,4000,0,0;PU500,500;PD3500,3500;PU500,3500;PD3500,500;PU3000,2000;PA2000,2000;CI1000;PU600,2000;PD800,2300,1000,1700,1200,2300,1400,1700;PU0,0;SP0;";

/// One row of the table.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Measure {
    /// What is changed.
    pub name: &'static str,
    /// Largest distance from ink to drawing, mm.
    pub stray_max_mm: f64,
    /// Root mean square of it, mm.
    pub stray_rms_mm: f64,
    /// Root mean square of the distance from the drawing to ink, mm.
    pub missed_rms_mm: f64,
    /// Period of the loop, s.
    pub period_s: f64,
    /// Proportional gain, % per tick; `null` for other loops.
    pub kp: Option<f64>,
    /// Integral gain, % per tick and s.
    pub ki: Option<f64>,
    /// Derivative gain, % per tick/s.
    pub kd: Option<f64>,
    /// The smaller gain margin of both motors.
    pub gain_margin: Option<f64>,
    /// The smaller phase margin of both motors, degrees.
    pub phase_margin_deg: Option<f64>,
}

/// The result of a search.
#[derive(Clone, Debug, PartialEq)]
pub struct Tuning {
    /// What each measure buys, each on top of the last one.
    pub measures: Vec<Measure>,
    /// The drive to use: with the measures that are software.
    pub drive: Drive,
    /// The ink of the plan's own rounding to ticks, RMS, mm.
    pub rounding_rms_mm: f64,
    /// The tuned drive without friction, RMS, mm.
    pub frictionless_rms_mm: f64,
    /// Share of the loop's calls with the duty at its limit.
    pub saturated_share: f64,
    /// One parameter off at a time.
    pub off: Vec<OffCase>,
    /// Simulations in all.
    pub simulations: usize,
}

/// Why nothing can be tuned.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TuneError {
    /// Not a feedback loop.
    #[error("there is nothing to tune: the motors of this drive follow positions without a feedback loop")]
    NoLoop,
    /// See [`SimulationError`].
    #[error(transparent)]
    Simulation(#[from] SimulationError),
}

/// The same machine with finer ticks.
///
/// # Errors
/// None for machines that exist.
pub fn finer_machine(machine: &Machine) -> Result<Machine, MachineError> {
    let parts = machine.parts().clone();
    let motors = parts.motors.map(|mut motor| {
        motor.ticks_per_unit *= FINER;
        motor.offset_ticks *= FINER;
        motor.max_speed_ticks_s *= FINER;
        motor.max_acceleration_ticks_s2 *= FINER;
        motor.max_jerk_ticks_s3 = motor.max_jerk_ticks_s3.map(|jerk| jerk * FINER);
        motor
    });
    Machine::new(MachineParts { motors, ..parts })
}

/// The same drive in finer ticks.
fn finer_drive(drive: &Drive) -> Drive {
    let mut drive = drive.clone();
    for motor in &mut drive.motors {
        motor.backlash_ticks *= FINER;
        if let MotorPlant::Dc(parameters) = &mut motor.plant {
            parameters.speed_per_duty_ticks_s *= FINER;
        }
    }
    drive
}

fn row(name: &'static str, tuned: &Tuned) -> Measure {
    let gains = match tuned.drive.feedback {
        Feedback::Pid(gains, _) => Some(gains),
        Feedback::Cascade(_) => None,
    };
    let margins = margins(&tuned.drive).into_iter().flatten();
    let smallest = margins.map(|m| (m.gain, m.phase_deg)).reduce(|a, b| (a.0.min(b.0), a.1.min(b.1)));
    Measure {
        name,
        stray_max_mm: tuned.ink.stray.max_mm,
        stray_rms_mm: tuned.ink.stray.rms_mm,
        missed_rms_mm: tuned.ink.missed.rms_mm,
        period_s: tuned.drive.period_s,
        kp: gains.map(|gains| gains.kp),
        ki: gains.map(|gains| gains.ki),
        kd: gains.map(|gains| gains.kd),
        gain_margin: smallest.map(|(gain, _)| gain).filter(|gain| gain.is_finite()),
        phase_margin_deg: smallest.map(|(_, phase)| phase),
    }
}

/// The drive with gains of three digits, as a machine file shows them.
fn rounded(drive: &Drive) -> Drive {
    let mut drive = drive.clone();
    if let Feedback::Pid(gains, _) = &mut drive.feedback {
        *gains = PidGains {
            kp: three_digits(gains.kp),
            ki: three_digits(gains.ki),
            kd: three_digits(gains.kd),
            kd_filter_s: if gains.kd > 0.0 { gains.kd_filter_s } else { 0.0 },
        };
    }
    drive
}

/// Searches gains for a plan. `finer` is the plan of the same drawing for [`finer_machine`].
///
/// # Errors
/// When there is no loop, or a simulation fails.
pub fn tune(plan: &Plan<'_>, finer: &Plan<'_>, drive: &Drive) -> Result<Tuning, TuneError> {
    if !drive.motors.iter().any(|motor| matches!(motor.plant, MotorPlant::Dc(_))) {
        return Err(TuneError::NoLoop);
    }
    let target = Target::new(plan.drawing);
    let vertices = vertices(plan);
    let job = Job { machine: plan.machine, rows: plan.rows, period_us: plan.period_us, vertices: &vertices };
    let tuner = Tuner { job, target: &target };
    let none = FeedForward::default();
    let motion = FeedForward { speed: 1.0, acceleration: 1.0, friction: 0.0 };
    let all = FeedForward { friction: 1.0, ..motion };

    let as_is = tuner.measure(drive)?;
    let mut simulations = 1;
    let mut measures = vec![row("as is", &as_is)];
    for (name, forward) in
        [("best P", none), ("speed and acceleration fed forward", motion), ("friction made up for", all)]
    {
        let found = tuner.tune(drive, Terms::P, forward)?;
        simulations += found.simulations;
        measures.push(row(name, &found));
    }
    let found = tuner.tune(drive, Terms::Pid, all)?;
    simulations += found.simulations;
    let tuned = tuner.measure(&rounded(&found.drive))?;
    measures.push(row("I and D", &tuned));

    let period_s = (drive.period_s / FASTER).max(SHORTEST_PERIOD_S).min(drive.period_s);
    let faster = Drive { period_s, ..drive.clone() };
    if period_s < drive.period_s {
        let found = tuner.tune(&faster, Terms::Pid, all)?;
        simulations += found.simulations;
        measures.push(row("faster loop", &found));
    }
    let finer_target = Target::new(finer.drawing);
    let finer_job =
        Job { machine: finer.machine, rows: finer.rows, period_us: finer.period_us, vertices: &[] };
    let finer_tuner = Tuner { job: finer_job, target: &finer_target };
    let found = finer_tuner.tune(&finer_drive(&faster), Terms::Pid, all)?;
    simulations += found.simulations;
    measures.push(row("finer encoder (4 times)", &found));

    let ideal = Drive {
        motors: drive.motors.clone().map(|mut motor| {
            motor.plant = MotorPlant::Ideal;
            motor
        }),
        arm: None,
        ..tuned.drive.clone()
    };
    let mut frictionless = tuned.drive.clone();
    for motor in &mut frictionless.motors {
        if let MotorPlant::Dc(parameters) = &mut motor.plant {
            *parameters = parameters.with_friction(0.0, 0.0);
        }
    }
    let off = tuner.off_cases(&tuned.drive)?;
    Ok(Tuning {
        measures,
        rounding_rms_mm: tuner.measure(&ideal)?.ink.stray.rms_mm,
        frictionless_rms_mm: tuner.measure(&frictionless)?.ink.stray.rms_mm,
        saturated_share: tuned.saturated_share,
        simulations: simulations + off.len() + 3,
        off,
        drive: tuned.drive,
    })
}

/// Reads a record of time (s), position (ticks) and duty (%): CSV with or without a heading; lines that
/// begin with `#` are comments.
///
/// # Errors
/// Names the line that is no row.
pub fn read_record(text: &str) -> Result<Vec<Recorded>, String> {
    let mut record = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let numbers: Vec<Option<f64>> =
            line.split([',', ';', '\t']).map(|cell| cell.trim().parse::<f64>().ok()).collect();
        match numbers.as_slice() {
            [Some(t_s), Some(position), Some(duty)] => {
                record.push(Recorded { t_s: *t_s, position: *position, duty: *duty });
            }
            // A heading.
            _ if record.is_empty() && numbers.iter().all(Option::is_none) => {}
            _ => {
                return Err(format!(
                    "line {}: `{}` is not a row of time in s, position in ticks and duty in percent",
                    index + 1,
                    line.chars().take(60).collect::<String>()
                ));
            }
        }
    }
    Ok(record)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn records_are_read_with_and_without_heading() {
        let rows = "0.00,0,100\n0.01,5.5,-20\n";
        for text in [rows.to_owned(), format!("# made by hand\ntime,position,duty\n{rows}")] {
            let record = read_record(&text).unwrap();
            assert_eq!(record[1], Recorded { t_s: 0.01, position: 5.5, duty: -20.0 });
        }
        assert!(read_record("0,0,1\n0.1,x,1\n").unwrap_err().starts_with("line 2:"));
        assert!(read_record("0,0\n").is_err());
    }
}
