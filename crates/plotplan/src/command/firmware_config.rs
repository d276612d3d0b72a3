//! The machine header of the firmware (`firmware/src/plotplan_firmware.h`), and the module `config.py`
//! of the firmware in MicroPython, from a machine file.

use std::fmt::Write as _;

use anyhow::anyhow;
use drawing::Point;
use kinematics::{HomingMove, Machine};
use simulation::{Drive, Feedback, MotorPlant};

use crate::cli::FirmwareDrive;
use crate::failure::Failure;
use crate::machines::LoadedMachine;

/// Version of the header's layout, as `PLOTPLAN_CONFIG_VERSION` of the firmware.
const VERSION: u32 = 2;
/// Longest name that `send` puts into the first line of a plan.
const LONGEST_NAME: usize = 24;
/// Steps per second of a motor that an `ATmega328P` makes, all within 16 us of their time.
const MOST_STEPS_S: f64 = 20_000.0;
/// Counts per second of an encoder with both motors and the loop running.
const MOST_COUNTS_S: f64 = 20_000.0;
/// Largest ticks of a motor in a unit of a homing move.
const MOST_TICKS_PER_UNIT: u32 = 127;
/// Largest ticks: the loop holds 1/64 tick in 32 bits.
const MOST_TICKS: f64 = 16_777_215.0;
/// Margin of the largest speed, for rounding to microseconds.
const SPEED_MARGIN: f64 = 1.02;
/// The sheet is sampled at this many points a side to find the range of ticks.
const SAMPLES: u32 = 40;

/// Duty in the firmware: 800 is full.
const DUTY_PER_PERCENT: f64 = 8.0;
/// Gains where the machine file has none that go with feed-forward: % per tick, % per tick and s.
/// With them the arm of report 1 draws zot within 0.13 mm RMS (`cargo xtask firmware`).
const GAINS: [f64; 2] = [1.5, 2.0];
/// Speed per % of duty, time constant and friction of that arm, where the machine file has no motor.
const MODEL: [f64; 3] = [106.67, 0.12, 6.0];
/// An RC servo's pulse at tick 0 and per 256 ticks, us.
const SERVO: &str = "{1500, 256}";
/// Stiction of that arm, %.
const STICTION_PERCENT: f64 = 8.0;
/// On its way to a mechanical stop a motor may use this much more than moves it, %.
const STOP_MARGIN_PERCENT: f64 = 10.0;
/// The firmware takes an encoder that stands still for 0.1 s for a stop; twice that for what the loop needs.
const STALL_S: f64 = 0.2;
/// Error at which the motors stop, counts.
const FOLLOW_COUNTS: u32 = 40;

/// The header, C, or the module, Python.
pub(super) fn header(loaded: &LoadedMachine, drive: Option<FirmwareDrive>) -> Result<String, Failure> {
    let machine = &loaded.machine;
    let described = loaded.file.drive(machine).map_err(|error| Failure::Usage(error.into()))?;
    let drive = drive.unwrap_or_else(|| match described.as_ref().map(|drive| &drive.motors[0].plant) {
        Some(MotorPlant::Dc(_)) => FirmwareDrive::Dc,
        Some(MotorPlant::RcServo(_)) => FirmwareDrive::Servo,
        _ => FirmwareDrive::Step,
    });
    let name = machine.name();
    let plain = |byte: u8| byte.is_ascii_alphanumeric() || b"-_.".contains(&byte);
    if name.is_empty() || name.len() > LONGEST_NAME || !name.bytes().all(plain) {
        return Err(Failure::Usage(anyhow!(
            "the firmware compares the machine's name: it must have 1 to {LONGEST_NAME} letters, digits, '-', '_' or '.', \
             not \"{name}\""
        )));
    }
    let most = if drive == FirmwareDrive::Step { MOST_STEPS_S } else { MOST_COUNTS_S };
    if let Some(motor) = machine.motors().iter().find(|motor| motor.max_speed_ticks_s > most) {
        return Err(Failure::Usage(anyhow!(
            "motor {} may make {:.0} ticks/s, but the firmware follows at most {most:.0}: lower max_speed, or the \
             microsteps",
            motor.name,
            motor.max_speed_ticks_s
        )));
    }
    let ranges = ranges(machine)?;
    if drive == FirmwareDrive::Micropython {
        return Ok(module(machine, described.as_ref(), ranges));
    }
    let mut text = format!(
        "/* Machine header of the plotplan firmware: plotplan machine show {name} --firmware-config {drive}\n   \
         Wiring and the values to adjust: docs/firmware.md */\n#include \"plotplan_firmware.h\"\n\n\
         #if PLOTPLAN_CONFIG_VERSION != {VERSION}\n#error \"this header was written for another version of the firmware\"\n\
         #endif\n\nstatic const struct plotplan_machine plotplan_machine = {{\n    \
         /* .name */ \"{name}\", /* a plan for another machine is refused */\n    /* .drive */ &{drive}_drive,\n    \
         {{ /* .motor */\n"
    );
    for (index, (motor, [lowest, highest])) in machine.motors().iter().zip(ranges).enumerate() {
        let shortest = (1e6 / (motor.max_speed_ticks_s * SPEED_MARGIN)).floor().clamp(1.0, 65_535.0);
        let _ = write!(
            text,
            "        {{ /* {}: {:.3} ticks per rad or mm, at most {:.1} ticks/s */\n            \
             /* .shortest_tick_us */ {shortest}, /* .reversed, .encoder_reversed */ false, false,\n            \
             /* .lowest, .highest */ {lowest}, {highest},\n            /* .loop */ {}, /* .servo */ {SERVO},\n        }},\n",
            motor.name.replace("*/", ""),
            motor.ticks_per_unit,
            motor.max_speed_ticks_s,
            feedback(described.as_ref(), index),
        );
    }
    let [up, down] = pen_pulses(machine);
    let _ = write!(text, "    }},\n    /* .pen: kind, up, down (us) */ {{PEN_SERVO, {up}, {down}}},\n    ");
    let moves = homing(machine, described.as_ref(), drive)?;
    let list = machine.parts().homing.as_ref().map_or(&[][..], kinematics::Homing::moves);
    let used = !list.is_empty();
    let switches = list.iter().any(|mv| mv.switch.is_some());
    let home = if used { machine.motor_positions(&machine.start()).0.map(f64::round) } else { [0.0; 2] };
    let _ = write!(
        text,
        "/* .homing */ {{{}, {}}},\n    /* .home */ {{{}, {}}}, /* .must_home */ {used},\n    \
         /* .limits_used, .stop_used */ {switches}, false,\n}};\n",
        moves[0], moves[1], home[0], home[1]
    );
    Ok(text)
}

/// Homing moves as the firmware has them: used, switch, ticks of each motor per unit in the direction of the
/// switch, us per unit fast and slow, units to back off, units after which it fails, duty at a stop.
fn homing(
    machine: &Machine,
    described: Option<&Drive>,
    drive: FirmwareDrive,
) -> Result<[String; 2], Failure> {
    let mut texts = ["{false, 0, {0, 0}, 0, 0, 0, 0, 0}"; 2].map(str::to_owned);
    let Some(homing) = &machine.parts().homing else { return Ok(texts) };
    if homing.needs_stop() && drive == FirmwareDrive::Servo {
        return Err(Failure::Usage(anyhow!(
            "an RC servo goes where its pulse says and finds nothing at a mechanical stop: state a pose in [homing]"
        )));
    }
    let mut switches: Vec<&str> = Vec::new();
    for (text, mv) in texts.iter_mut().zip(homing.moves()) {
        if let Some(switch) = mv.switch.as_deref()
            && !switches.contains(&switch)
        {
            switches.push(switch);
        }
        let number = switches.iter().position(|other| mv.switch.as_deref() == Some(*other));
        let contact = number.map_or_else(|| "PLOTPLAN_STOP".to_owned(), |number| number.to_string());
        let ticks = mv.ticks_per_unit(machine);
        let most = ticks[0].abs().max(ticks[1].abs());
        // A stepper does not feel a stop: it makes the whole way in any case.
        let longest = match (number, drive) {
            (None, FirmwareDrive::Step) => mv.travel + mv.back_off,
            _ => mv.timeout_s * mv.speed.abs(),
        };
        let Some(n) = unit_ticks(ticks, longest) else {
            let what = mv.switch.as_deref().map_or("the stop".to_owned(), |name| format!("switch {name}"));
            return Err(Failure::Usage(anyhow!("the way to {what} is too long for the firmware's counter")));
        };
        let unit = f64::from(n) / most;
        // Adding 0 makes 0 of -0.
        let [a, b] = ticks.map(|ticks| (ticks / most * f64::from(n) * mv.speed.signum()).round() + 0.0);
        let us = |speed: f64| (unit / speed * 1e6).round().clamp(1.0, f64::from(u16::MAX));
        let mut duty = 0.0;
        if number.is_none() && drive == FirmwareDrive::Dc {
            duty = stop_duty(described, ticks.map(|ticks| ticks * mv.speed));
            check_back_off(mv, described, ticks, duty)?;
        }
        *text = format!(
            "{{true, {contact}, {{{a}, {b}}}, {}, {}, {}, {}, {duty}}}",
            us(mv.speed.abs()),
            us(mv.slow_speed),
            (mv.back_off / unit).ceil(),
            (longest / unit).ceil()
        );
    }
    Ok(texts)
}

/// Checks that a motor that has backed off from a stop feels it again. The setpoint passes the stop by the error at
/// which the duty is at its limit, and then for the time in which the encoder must stand still; the second approach
/// ends one `back_off` behind the stop.
fn check_back_off(mv: &HomingMove, drive: Option<&Drive>, ticks: [f64; 2], duty: f64) -> Result<(), Failure> {
    for (motor, ticks) in ticks.into_iter().enumerate().filter(|(_, ticks)| *ticks != 0.0) {
        let ([kp, _], _) = gains(drive, motor);
        let least = duty / DUTY_PER_PERCENT / kp + STALL_S * mv.slow_speed * ticks.abs();
        let counts = mv.back_off * ticks.abs();
        if counts < least {
            return Err(Failure::Usage(anyhow!(
                "back_off of a homing move to a stop is {counts:.0} counts of its motor, but the loop feels the stop \
                 {least:.0} counts behind it: state a longer way, or a larger kp in [drive]"
            )));
        }
    }
    Ok(())
}

/// Ticks of the faster motor in a unit of a homing move with these ticks per mm or rad: whole ticks of both in
/// their ratio, few enough for the firmware's bytes, enough that its counter holds the longest way.
fn unit_ticks(ticks: [f64; 2], longest: f64) -> Option<u32> {
    let most = ticks[0].abs().max(ticks[1].abs());
    let fewest = (longest * most / f64::from(u16::MAX)).ceil().max(1.0) as u32;
    let error = |n: u32| {
        let off = |ticks: f64| {
            let wanted = ticks / most * f64::from(n);
            (wanted - wanted.round()).abs() / f64::from(n)
        };
        off(ticks[0]).max(off(ticks[1]))
    };
    (fewest..=MOST_TICKS_PER_UNIT)
        .find(|n| error(*n) < 0.002)
        .or_else(|| (fewest..=MOST_TICKS_PER_UNIT).min_by(|a, b| error(*a).total_cmp(&error(*b))))
}

/// The largest duty of motors on their way to a mechanical stop at this speed, ticks/s: what moves the stiffer of
/// them, and a margin.
fn stop_duty(drive: Option<&Drive>, ticks_s: [f64; 2]) -> f64 {
    let percent = |motor: usize| {
        let (_, [g, ..]) = gains(drive, motor);
        let stiction = match drive.map(|drive| &drive.motors[motor].plant) {
            Some(MotorPlant::Dc(plant)) => plant.stiction_percent,
            _ => STICTION_PERCENT,
        };
        if ticks_s[motor] == 0.0 { 0.0 } else { stiction + ticks_s[motor].abs() / g + STOP_MARGIN_PERCENT }
    };
    (percent(0).max(percent(1)).min(100.0) * DUTY_PER_PERCENT).round()
}

/// Pulses of the pen's servo with the pen up and down, us: those of the machine file, or two to adjust.
fn pen_pulses(machine: &Machine) -> [u16; 2] {
    let pulses_us = machine.parts().pen_servo.map_or([1000.0, 1500.0], |servo| servo.pulses_us);
    pulses_us.map(|us| us.round() as u16)
}

/// Pins of the board of report 1 (docs/references.md): driver and encoder of each motor.
const PYTHON_PINS: [[&str; 2]; 2] = [
    [r#"(3, "PA10", ("PB4", "PB5"))"#, r#"(8, ("PC6", "PC7"))"#],
    [r#"(5, "PC1", ("PA0", "PA1"))"#, r#"(4, ("PB6", "PB7"))"#],
];

/// The module `config.py`.
fn module(machine: &Machine, drive: Option<&Drive>, ranges: [[i64; 2]; 2]) -> String {
    let name = machine.name();
    let home = machine.motor_positions(&machine.start());
    let mut text = format!(
        "\"\"\"Machine of plotplan's firmware in MicroPython: plotplan machine show {name} --firmware-config \
         micropython\n\nWiring and the values to adjust: docs/firmware.md\n\"\"\"\n\n\
         NAME = \"{name}\"  # a plan for another machine is refused\n\
         PERIOD_US = 5_000  # of the loop\n\
         HOME = ({:.0}, {:.0})  # ticks of the pose in which it is started\n\
         MUST_HOME = False\nMOTORS = (\n",
        home[0], home[1]
    );
    for (index, (motor, [lowest, highest])) in machine.motors().iter().zip(ranges).enumerate() {
        let ([kp, ki], [g, tau, friction]) = gains(drive, index);
        let [driver, encoder] = PYTHON_PINS[index];
        let _ = write!(
            text,
            "    {{  # {}\n        \"driver\": {driver},\n        \"reversed\": False,\n        \
             \"encoder\": {encoder},\n        \"encoder_reversed\": False,\n        \
             \"ticks_s\": {:.0},\n        \"lowest\": {lowest},\n        \"highest\": {highest},\n        \
             \"loop\": {{\"kp\": {kp}, \"ki\": {ki}, \"ticks_s_percent\": {g}, \"time_constant_s\": {tau}, \
             \"friction\": {friction}}},\n    }},\n",
            motor.name.replace(['\n', '\r'], " "),
            (motor.max_speed_ticks_s * SPEED_MARGIN).ceil(),
        );
    }
    let [up, down] = pen_pulses(machine);
    let _ = write!(text, ")\nSERVO = (2, 1, \"PA5\")\nPEN_UP_US = {up}\nPEN_DOWN_US = {down}\n");
    text
}

/// `[kp, ki]` (% per tick, % per tick and s) and `[speed per duty, time constant, friction]` of a motor.
/// Gains of a loop without feed-forward, as in report 1, are not taken: such a loop is tuned for
/// another task.
fn gains(drive: Option<&Drive>, motor: usize) -> ([f64; 2], [f64; 3]) {
    let (mut gains, mut model) = (GAINS, MODEL);
    if let Some(drive) = drive {
        if let MotorPlant::Dc(plant) = &drive.motors[motor].plant {
            model = [plant.speed_per_duty_ticks_s, plant.time_constant_s, plant.friction_percent];
        }
        if let (Feedback::Pid(pid, _), true) = (&drive.feedback, drive.feed_forward.speed > 0.0) {
            gains = [pid.kp, pid.ki];
        }
    }
    (gains, model)
}

/// The loop of a DC motor, in the firmware's units (`dc_control.h`). Speed, acceleration and friction are
/// fed forward in full.
fn feedback(drive: Option<&Drive>, motor: usize) -> String {
    let ([kp, ki], [g, tau, friction]) = gains(drive, motor);
    // Setpoints are in 1/64 tick; the window is 20 ms for the speed and twice 10 ms for the acceleration.
    let values = [
        kp * DUTY_PER_PERCENT * 256.0,
        ki * DUTY_PER_PERCENT * 1e-3 * 16384.0,
        1e3 * DUTY_PER_PERCENT / g * 65536.0 / (20.0 * 64.0),
        1e6 * DUTY_PER_PERCENT * tau / g * 1024.0 / (100.0 * 64.0),
        friction * DUTY_PER_PERCENT,
    ];
    let values = values.map(|value| value.round().clamp(0.0, f64::from(i16::MAX)).to_string());
    format!("{{{}, {FOLLOW_COUNTS}}}", values.join(", "))
}

/// The ticks that lines may ask for: those of the sheet and the start, and as much on either side, so
/// that a resumed plan or a travel is never refused, but a wrong unit is.
fn ranges(machine: &Machine) -> Result<[[i64; 2]; 2], Failure> {
    let start = machine.start();
    let at = machine.motor_positions(&start);
    let mut ranges = [0, 1].map(|motor: usize| [at[motor], at[motor]]);
    let sheet = machine.sheet();
    for i in 0..=SAMPLES {
        for j in 0..=SAMPLES {
            let share = |k: u32| f64::from(k) / f64::from(SAMPLES);
            let point = Point::new(sheet.x0 + sheet.width() * share(i), sheet.y0 + sheet.height() * share(j));
            let Ok(pose) = machine.pose_near(point, &start) else { continue };
            let ticks = machine.motor_positions(&pose);
            for (motor, [lowest, highest]) in ranges.iter_mut().enumerate() {
                *lowest = lowest.min(ticks[motor]);
                *highest = highest.max(ticks[motor]);
            }
        }
    }
    for [lowest, highest] in &mut ranges {
        let span = *highest - *lowest;
        *lowest = (*lowest - span).floor();
        *highest = (*highest + span).ceil();
        if *lowest < -MOST_TICKS || *highest > MOST_TICKS {
            return Err(Failure::Usage(anyhow!(
                "the sheet needs ticks from {lowest} to {highest}, but the firmware counts to {MOST_TICKS:.0}"
            )));
        }
    }
    Ok(ranges.map(|range| range.map(|ticks| ticks as i64)))
}
