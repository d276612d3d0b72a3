//! The report of a simulation.

use std::fmt::Write as _;

use drawing::Span;
use kinematics::Machine;
use schemars::JsonSchema;
use serde::Serialize;
use simulation::{Drive, SetpointKind, Worst};

use super::{round, text};
use crate::simulate::Simulated;

/// The report of a simulation. Lengths are mm, times s.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct SimulationReport {
    /// Name of the machine.
    pub machine: String,
    /// How the plan becomes setpoints.
    pub setpoints: &'static str,
    /// Simulated time, s.
    pub duration_s: f64,
    /// The distances between ink and drawing: a part of the report of its own.
    #[serde(skip)]
    pub ink: InkReport,
    /// Tails drawn because the pen moved while the machine still moved.
    pub tails: TailsReport,
    /// The largest overshoot at a corner.
    pub overshoot: OvershootReport,
    /// The motors.
    pub motors: Vec<SimulatedMotor>,
    /// With setpoints `vertices`: vertices that were given up.
    pub unreached_vertices: usize,
    /// The limit of `--within`; `null` without one.
    pub within_mm: Option<f64>,
    /// Whether stray and missed ink stay within it; `true` without one.
    pub holds: bool,
}

/// Distances between ink and drawing.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct InkReport {
    /// Length of the ink.
    pub length_mm: f64,
    /// The largest distance from ink to the drawing.
    pub stray_max_mm: f64,
    /// 99 % of the time with the pen down, ink is nearer than this.
    pub stray_p99_mm: f64,
    /// Root mean square over the time with the pen down.
    pub stray_rms_mm: f64,
    /// The largest distance from the drawing to ink.
    pub missed_max_mm: f64,
    /// 99 % of the drawing's length are nearer to ink than this.
    pub missed_p99_mm: f64,
    /// Root mean square over the drawing's length.
    pub missed_rms_mm: f64,
    /// Where ink strays furthest.
    pub worst_stray: Option<InkPlace>,
    /// Where the drawing is missed most.
    pub worst_missed: Option<InkPlace>,
}

/// A place in drawing, file and time.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct InkPlace {
    /// Machine coordinates.
    pub x_mm: f64,
    /// Machine coordinates.
    pub y_mm: f64,
    /// The stroke, from 1, in the order drawn.
    pub stroke: usize,
    /// First byte of the stroke in the drawing's file; `null` where the file is not known.
    pub byte: Option<usize>,
    /// When the ink was drawn; `null` for missing ink.
    pub at_s: Option<f64>,
}

impl InkPlace {
    fn of(worst: &Worst) -> Self {
        Self {
            x_mm: round::mm(worst.point_mm.x),
            y_mm: round::mm(worst.point_mm.y),
            stroke: worst.stroke + 1,
            byte: (worst.source != Span::default()).then_some(worst.source.start),
            at_s: worst.at_s.map(round::s),
        }
    }
}

/// Tails at pen downs and pen ups.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct TailsReport {
    /// How many.
    pub count: usize,
    /// The longest.
    pub longest_mm: f64,
    /// All together.
    pub total_mm: f64,
}

/// Overshoot at corners.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct OvershootReport {
    /// The largest.
    pub max_mm: f64,
    /// At which corner.
    pub place: Option<InkPlace>,
}

/// One motor.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct SimulatedMotor {
    /// Its name.
    pub name: String,
    /// The largest distance from the setpoint.
    pub error_max_ticks: f64,
    /// Root mean square of it.
    pub error_rms_ticks: f64,
    /// Share of the loop's calls with the duty at its limit.
    pub saturated_share: f64,
    /// Distance from the setpoint at the end.
    pub rest_error_ticks: f64,
    /// From lowest to highest position after the end of the plan.
    pub swing_ticks: f64,
    /// Steps lost.
    pub lost_ticks: f64,
    /// Steppers: the largest share of the pull-out torque that was needed.
    pub torque_share: Option<f64>,
    /// Steppers: the largest speed beyond the data, ticks/s.
    pub beyond_data_ticks_s: Option<f64>,
    /// PID loops: whether the loop is stable.
    pub stable: Option<bool>,
    /// The factor by which the loop's gain may grow; `null` where no gain makes it unstable.
    pub gain_margin: Option<f64>,
    /// The phase that the loop may lose, degrees.
    pub phase_margin_deg: Option<f64>,
}

impl SimulationReport {
    /// The report of a simulation on this machine.
    pub fn of(machine: &Machine, drive: &Drive, simulated: &Simulated, within_mm: Option<f64>) -> Self {
        let ink = &simulated.ink;
        let motors = simulated.outcome.motors.iter().zip(&simulated.margins).zip(machine.motors());
        let motors = motors.map(|((motor, margins), named)| SimulatedMotor {
            name: named.name.clone(),
            error_max_ticks: round::ticks(motor.error_max_ticks),
            error_rms_ticks: round::ticks(motor.error_rms_ticks),
            saturated_share: round::share(motor.saturated_share),
            rest_error_ticks: round::ticks(motor.rest_error_ticks),
            swing_ticks: round::ticks(motor.swing_ticks),
            lost_ticks: round::ticks(motor.lost_ticks),
            torque_share: motor.torque.map(|(share, _)| round::share(share)),
            beyond_data_ticks_s: motor.torque.map(|(_, beyond)| round::ticks(beyond)),
            stable: margins.map(|margins| margins.stable),
            gain_margin: margins.map(|margins| round::ticks(margins.gain)).filter(|gain| gain.is_finite()),
            phase_margin_deg: margins.map(|margins| round::ticks(margins.phase_deg)),
        });
        let larger = ink.stray.max_mm.max(ink.missed.max_mm);
        Self {
            machine: machine.name().to_owned(),
            setpoints: match drive.setpoints {
                SetpointKind::Vertices => "vertices",
                SetpointKind::Held => "held",
                SetpointKind::Interpolated => "interpolated",
            },
            duration_s: round::s(simulated.outcome.duration_s),
            ink: InkReport {
                length_mm: round::mm(ink.ink_mm),
                stray_max_mm: round::mm(ink.stray.max_mm),
                stray_p99_mm: round::mm(ink.stray.p99_mm),
                stray_rms_mm: round::mm(ink.stray.rms_mm),
                missed_max_mm: round::mm(ink.missed.max_mm),
                missed_p99_mm: round::mm(ink.missed.p99_mm),
                missed_rms_mm: round::mm(ink.missed.rms_mm),
                worst_stray: ink.worst_stray.as_ref().map(InkPlace::of),
                worst_missed: ink.worst_missed.as_ref().map(InkPlace::of),
            },
            tails: TailsReport {
                count: ink.tails.count,
                longest_mm: round::mm(ink.tails.longest_mm),
                total_mm: round::mm(ink.tails.total_mm),
            },
            overshoot: OvershootReport {
                max_mm: round::mm(ink.overshoot_max_mm),
                place: ink.overshoot.as_ref().map(InkPlace::of),
            },
            motors: motors.collect(),
            unreached_vertices: simulated.outcome.unreached,
            within_mm,
            holds: within_mm.is_none_or(|within| larger <= within),
        }
    }

    /// The report as text.
    pub fn text(&self) -> String {
        let mut out = String::new();
        let _ = writeln!(
            out,
            "{}: {} of ink in {}, setpoints {}",
            self.machine,
            text::length(self.ink.length_mm),
            text::duration(self.duration_s),
            self.setpoints
        );
        let _ = writeln!(out, "{:<18} {:>9} {:>9} {:>9}", "distance, mm", "max", "99 %", "RMS");
        let ink = &self.ink;
        for (name, values) in [
            ("ink to drawing", [ink.stray_max_mm, ink.stray_p99_mm, ink.stray_rms_mm]),
            ("drawing to ink", [ink.missed_max_mm, ink.missed_p99_mm, ink.missed_rms_mm]),
        ] {
            let [max, p99, rms] = values;
            let _ = writeln!(out, "{name:<18} {max:>9.3} {p99:>9.3} {rms:>9.3}");
        }
        for (what, place) in [("stray", &ink.worst_stray), ("missed", &ink.worst_missed)] {
            if let Some(place) = place {
                let _ = writeln!(out, "worst {what:<12} {}", place.text());
            }
        }
        if self.overshoot.max_mm > 0.0 {
            let place = self.overshoot.place.as_ref().map(InkPlace::text).unwrap_or_default();
            let _ = writeln!(out, "corner overshoot   {:.3} mm at most, {place}", self.overshoot.max_mm);
        }
        let tails = &self.tails;
        if tails.count > 0 {
            let _ = writeln!(
                out,
                "tails              {}, the longest {:.2} mm: the machine still moves while the pen goes up or down",
                tails.count, tails.longest_mm
            );
        }
        for motor in &self.motors {
            let _ = writeln!(out, "motor {:<12} {}", motor.name, motor.text());
        }
        if self.unreached_vertices > 0 {
            let _ = writeln!(
                out,
                "{} not reached: given up at rest or after 5 s",
                text::pluralize(self.unreached_vertices, "vertex").replace("vertexs", "vertices")
            );
        }
        if let Some(within) = self.within_mm {
            let verdict = if self.holds { "holds" } else { "exceeded" };
            let _ = writeln!(out, "within {within} mm: {verdict}");
        }
        out
    }
}

impl InkPlace {
    fn text(&self) -> String {
        let mut out = format!("({:.2}, {:.2}) mm, stroke {}", self.x_mm, self.y_mm, self.stroke);
        if let Some(byte) = self.byte {
            let _ = write!(out, ", byte {byte}");
        }
        if let Some(at) = self.at_s {
            let _ = write!(out, ", at {at:.3} s");
        }
        out
    }
}

impl SimulatedMotor {
    fn text(&self) -> String {
        let mut out = format!(
            "tracking error {:.2} ticks max, {:.2} RMS; at its limit {:.1} % of the time",
            self.error_max_ticks,
            self.error_rms_ticks,
            100.0 * self.saturated_share
        );
        if self.lost_ticks != 0.0 {
            let _ = write!(out, "; {} ticks lost", self.lost_ticks);
        }
        if let Some(share) = self.torque_share {
            let _ = write!(out, "; up to {:.0} % of the pull-out torque", 100.0 * share);
        }
        if let Some(beyond) = self.beyond_data_ticks_s.filter(|beyond| *beyond > 0.0) {
            let _ = write!(out, "; {beyond:.0} ticks/s faster than its torque is given for");
        }
        match (self.stable, self.gain_margin, self.phase_margin_deg) {
            (Some(true), gain, Some(phase)) => {
                let gain = gain.map_or_else(|| "no limit".to_owned(), |gain| format!("{gain:.2}"));
                let _ = write!(out, "; gain margin {gain}, phase margin {phase:.0} deg");
            }
            (Some(false), gain, _) => {
                let gain = gain.map_or_else(String::new, |gain| format!(" (gain margin {gain:.2})"));
                let _ =
                    write!(out, "; the loop is UNSTABLE{gain}, it swings by {:.0} ticks", self.swing_ticks);
            }
            _ => {}
        }
        out
    }
}

/// A step response.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct StepReport {
    /// The motor.
    pub motor: String,
    /// The step, ticks.
    pub step_ticks: f64,
    /// The largest position beyond the setpoint, ticks; 0 without overshoot.
    pub overshoot_ticks: f64,
    /// From when on the motor stays within 2 % of the step of its last position, s; `null` while it moves on.
    pub settling_s: Option<f64>,
    /// The last position, ticks.
    pub rest_ticks: f64,
    /// From lowest to highest position in the last quarter of the time, ticks.
    pub swing_ticks: f64,
}

impl StepReport {
    /// The report of a step response.
    pub fn of(motor: &str, ticks: f64, response: &simulation::StepResponse) -> Self {
        Self {
            motor: motor.to_owned(),
            step_ticks: ticks,
            overshoot_ticks: round::ticks(response.overshoot_ticks),
            settling_s: response.settling_s.map(round::s),
            rest_ticks: round::ticks(response.rest_ticks),
            swing_ticks: round::ticks(response.swing_ticks),
        }
    }

    /// The report as text.
    pub fn text(&self) -> String {
        let mut out = format!("motor {}, step of {} ticks\n", self.motor, self.step_ticks);
        let _ = writeln!(out, "overshoot   {:.0} ticks", self.overshoot_ticks);
        let _ = match self.settling_s {
            Some(time) => writeln!(out, "settling    {time:.3} s (within 2 % of the step)"),
            None => writeln!(out, "settling    not within the simulated time"),
        };
        let off = self.step_ticks - self.rest_ticks;
        let _ = writeln!(out, "rest        {:.0} ticks, {off:.0} from the setpoint", self.rest_ticks);
        if self.swing_ticks >= 1.0 {
            let _ =
                writeln!(out, "still moves by {:.0} ticks in the last quarter of the time", self.swing_ticks);
        }
        out
    }
}
