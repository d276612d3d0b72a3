//! The machine header of the firmware (`firmware/src/plotplan_firmware.h`), from a machine file.

use std::fmt::Write as _;

use anyhow::anyhow;
use drawing::Point;
use kinematics::Machine;

use crate::cli::FirmwareDrive;
use crate::failure::Failure;

/// Version of the header's layout, as `PLOTPLAN_CONFIG_VERSION` of the firmware.
const VERSION: u32 = 1;
/// Longest name that `send` puts into the first line of a plan.
const LONGEST_NAME: usize = 24;
/// Steps per second of a motor that an ATmega328P makes, all within 16 us of their time.
const MOST_STEPS_S: f64 = 20_000.0;
/// Counts per second of an encoder with both motors and the loop running.
const MOST_COUNTS_S: f64 = 20_000.0;
/// Largest ticks: the loop holds 1/64 tick in 32 bits.
const MOST_TICKS: f64 = 16_777_215.0;
/// Margin of the largest speed, for rounding to microseconds.
const SPEED_MARGIN: f64 = 1.02;
/// The sheet is sampled at this many points a side to find the range of ticks.
const SAMPLES: u32 = 40;

/// The header, C.
pub(super) fn header(machine: &Machine, drive: FirmwareDrive) -> Result<String, Failure> {
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
    let mut text = format!(
        "/* Machine header of the plotplan firmware: plotplan machine show {name} --firmware-config {drive}\n   \
         Wiring and the values to adjust: docs/firmware.md */\n#include \"plotplan_firmware.h\"\n\n\
         #if PLOTPLAN_CONFIG_VERSION != {VERSION}\n#error \"this header was written for another version of the firmware\"\n\
         #endif\n\nstatic const struct plotplan_machine plotplan_machine = {{\n    \
         /* .name */ \"{name}\", /* a plan for another machine is refused */\n    /* .drive */ &{drive}_drive,\n    \
         {{ /* .motor */\n"
    );
    for (motor, [lowest, highest]) in machine.motors().iter().zip(ranges) {
        let shortest = (1e6 / (motor.max_speed_ticks_s * SPEED_MARGIN)).floor().clamp(1.0, 65_535.0);
        let _ = write!(
            text,
            "        {{ /* {}: {:.3} ticks per rad or mm, at most {:.1} ticks/s */\n            \
             /* .shortest_tick_us */ {shortest}, /* .reversed, .encoder_reversed */ false, false,\n            \
             /* .lowest, .highest */ {lowest}, {highest},\n            /* .loop */ {}, /* .servo */ {},\n        }},\n",
            motor.name.replace("*/", ""),
            motor.ticks_per_unit,
            motor.max_speed_ticks_s,
            "{3072, 262, 3840, 1440, 48, 40}",
            "{1500, 256}",
        );
    }
    text.push_str(
        "    },\n    /* .pen: kind, up, down (us) */ {PEN_SERVO, 1000, 1500},\n    \
         /* .homing */ {{false, 0, {0, 0}, 0, 0, 0, 0}, {false, 0, {0, 0}, 0, 0, 0, 0}},\n    \
         /* .home */ {0, 0}, /* .must_home */ false,\n    /* .limits_used, .stop_used */ false, false,\n};\n",
    );
    Ok(text)
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
