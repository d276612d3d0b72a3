//! What `send` knows about the machine's datum: unknown, homed or calibrated; homing before a plan.

use anyhow::anyhow;
use backends::Backend;
use backends::homing::HomingRun;
use kinematics::{HomingMethod, Machine};

use crate::cli::Datum;
use crate::failure::Failure;
use crate::terminal;
use crate::wire::Wire;

/// Makes sure that a machine with `[homing]` knows where it is, or refuses.
pub(super) fn ensure(
    datum: Datum,
    resumes: bool,
    backend: &dyn Backend,
    machine: &Machine,
    wire: &mut Wire,
) -> Result<(), Failure> {
    let Some(homing) = &machine.parts().homing else {
        if datum.home {
            let name = machine.name();
            return Err(Failure::Usage(anyhow!("--home: the machine file of {name} has no [homing]")));
        }
        return Ok(());
    };
    if datum.assume_homed {
        terminal::say("the machine is taken to stand in its start pose\n");
        return Ok(());
    }
    if backend.homes_itself() || (resumes && !backend.knows_datum()) {
        return Ok(());
    }
    let state = if homing.calibrated { "calibrated" } else { "homed" };
    if datum.home {
        match &homing.method {
            HomingMethod::Pose(pose) => {
                terminal::always(&format!("{pose}, then press Enter\n"));
                if !wire.wait_for_enter()? {
                    return Err(Failure::Usage(anyhow!("the pose was not confirmed")));
                }
            }
            HomingMethod::Moves(_) => {
                let steps = backend.homing(machine).ok_or_else(|| {
                    let what = if homing.needs_stop() { "home to a mechanical stop" } else { "home" };
                    Failure::Usage(anyhow!(
                        "--home: this protocol cannot {what}; home the machine by other means and give --assume-homed"
                    ))
                })?;
                terminal::say("homing\n");
                wire.home(HomingRun::new(steps, homing))?;
            }
        }
        terminal::say(&format!("the machine is {state}\n"));
        return Ok(());
    }
    let refuse = |why: &str| {
        let start = match &homing.method {
            HomingMethod::Pose(pose) => format!("--home, which asks for its pose ({pose})"),
            HomingMethod::Moves(_) if backend.homing(machine).is_some() => "--home".to_owned(),
            HomingMethod::Moves(_) => "homing by other means".to_owned(),
        };
        let what =
            format!("{why}: begin with {start}, or give --assume-homed if it stands in its start pose");
        Err(Failure::Usage(anyhow!(what)))
    };
    if !backend.knows_datum() {
        return refuse("this protocol cannot report whether the machine was homed");
    }
    let Some(status) = backend.status() else {
        return refuse("this protocol cannot report whether the machine was homed");
    };
    match wire.ask_position(status)? {
        backends::ReportedPosition::At(_) => {
            terminal::say(&format!("the machine is {state}\n"));
            Ok(())
        }
        backends::ReportedPosition::Unknown => refuse("the machine does not know where it is"),
        backends::ReportedPosition::Alarm(what) => refuse(&what),
        backends::ReportedPosition::Silent => {
            Err(Failure::Io(anyhow!("the machine does not answer the query for its position")))
        }
    }
}
