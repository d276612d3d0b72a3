//! `plotplan device`: a machine that is not there, on a pseudo-terminal.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use anyhow::Context as _;
use backends::device::{Device as Machine, Ebb, Faulty, Grbl, Ticks, XyPlotter};
use drawing::{Point, Rect};
use kinematics::MotorPos;
use picture::{Ink, Scene};

use crate::cli::{Device, DeviceProtocol};
use crate::failure::Failure;
use crate::input::{self, LoadedMachine};
use crate::pseudo_terminal::PseudoTerminal;
use crate::{output, terminal};

/// It looks at its clock at least so often.
const TICK: Duration = Duration::from_millis(20);

pub(crate) fn run(arguments: &Device) -> Result<(), Failure> {
    if arguments.haste.is_nan() || arguments.haste <= 0.0 {
        return Err(Failure::Usage(anyhow::anyhow!("--haste must be a positive number")));
    }
    let machine = arguments.machine.as_deref().map(input::machine).transpose()?;
    let ended = Arc::new(AtomicBool::new(false));
    let asked = Arc::clone(&ended);
    ctrlc::set_handler(move || asked.store(true, Ordering::Relaxed))
        .context("cannot catch Ctrl-C")
        .map_err(Failure::Io)?;
    let mut faulty = Faulty::new(device(arguments, machine.as_ref()), arguments.fault.clone());
    serve(arguments, &mut faulty, &ended).map_err(Failure::Io)?;
    let lost = faulty.device().lost_bytes();
    if lost > 0 {
        terminal::warning(&format!("{lost} bytes came when the machine's buffer was full, and were lost"));
    }
    if let Some(to) = &arguments.ink {
        output::write(to, |out| write_ink(faulty.device().ink(), out))?;
    }
    if let Some(to) = &arguments.svg {
        let scene = scene(arguments, machine.as_ref(), faulty.device().ink());
        output::write(to, |out| picture::scene::svg(&scene, out))?;
    }
    Ok(())
}

fn device(arguments: &Device, machine: Option<&LoadedMachine>) -> Box<dyn Machine> {
    match arguments.protocol {
        DeviceProtocol::Ticks => Box::new(Ticks::new(machine.map(start))),
        DeviceProtocol::XySerial => Box::new(XyPlotter::new(arguments.homed, 0.0)),
        DeviceProtocol::Gcode => Box::new(Grbl::new()),
        DeviceProtocol::Ebb => Box::new(Ebb::new()),
    }
}

/// Where a machine's motors are when it has been homed.
fn start(machine: &LoadedMachine) -> [i64; 2] {
    let ticks = machine.machine.motor_positions(&machine.machine.start());
    [ticks[0].round() as i64, ticks[1].round() as i64]
}

/// The clock that the machine lives by.
#[allow(clippy::disallowed_methods, reason = "a machine on a wire lives in time")]
fn now() -> Instant {
    Instant::now()
}

fn open(arguments: &Device) -> anyhow::Result<PseudoTerminal> {
    let pty = PseudoTerminal::open().context("cannot open a pseudo-terminal")?;
    if let Some(link) = &arguments.link {
        let _ = std::fs::remove_file(link);
        std::os::unix::fs::symlink(pty.path(), link)
            .with_context(|| format!("cannot make the link {link}"))?;
    }
    Ok(pty)
}

/// Closes it, and takes its link away, unless that is another's by now.
fn close(arguments: &Device, pty: Option<PseudoTerminal>) {
    if let (Some(link), Some(pty)) = (&arguments.link, pty)
        && std::fs::read_link(link).is_ok_and(|path| path == *pty.path())
    {
        let _ = std::fs::remove_file(link);
    }
}

fn serve(arguments: &Device, faulty: &mut Faulty, ended: &AtomicBool) -> anyhow::Result<()> {
    let begun = now();
    let now_us = || (now().duration_since(begun).as_secs_f64() * arguments.haste * 1e6) as u64;
    let mut pty = Some(open(arguments)?);
    if let Some(pty) = &pty {
        let name = arguments.link.as_deref().map_or(pty.path().as_path(), Path::new);
        // Whoever started it may wait for this line.
        output::write("-", |out| writeln!(out, "{}", name.display()))
            .map_err(|_| anyhow::anyhow!("cannot say where"))?;
    }
    let mut heard_us: Option<u64> = None;
    while !ended.load(Ordering::Relaxed) {
        let time_us = now_us();
        faulty.advance(time_us);
        match (faulty.plugged(time_us), &pty) {
            (false, Some(_)) => close(arguments, pty.take()),
            (true, None) => pty = Some(open(arguments)?),
            _ => {}
        }
        let answers = faulty.heard(time_us);
        let wake_us = faulty.wake_us(time_us).map(|wake_us| wake_us.saturating_sub(time_us));
        let within =
            wake_us.map_or(TICK, |us| Duration::from_micros((us as f64 / arguments.haste) as u64).min(TICK));
        let Some(pty) = &pty else {
            std::thread::sleep(within);
            continue;
        };
        pty.write(&answers).context("cannot write to the pseudo-terminal")?;
        let bytes =
            pty.read(faulty.device().room(), within).context("cannot read from the pseudo-terminal")?;
        if !bytes.is_empty() {
            let time_us = now_us();
            faulty.receive(&bytes, time_us);
            heard_us = Some(time_us);
        }
        let busy = faulty.device().wake_us().is_some();
        if let (Some(rest), Some(heard_us), false) = (arguments.rest, heard_us, busy)
            && now_us().saturating_sub(heard_us) as f64 > rest * 1e6
        {
            break;
        }
    }
    faulty.advance(now_us());
    close(arguments, pty);
    Ok(())
}

/// One line a place: number of the line of ink, pen, place.
fn write_ink(ink: &backends::Ink, out: &mut dyn std::io::Write) -> std::io::Result<()> {
    writeln!(out, "line,pen,x,y")?;
    for (line, (pen, places)) in ink.lines().iter().enumerate() {
        for [x, y] in places {
            writeln!(out, "{line},{pen},{x},{y}")?;
        }
    }
    Ok(())
}

/// The ink as a picture. Motors' positions are led through the machine's kinematics where it is known.
fn scene(arguments: &Device, machine: Option<&LoadedMachine>, ink: &backends::Ink) -> Scene {
    let in_ticks = matches!(arguments.protocol, DeviceProtocol::Ticks | DeviceProtocol::Ebb);
    let machine = machine.filter(|_| in_ticks);
    // An EBB counts from where its motors were switched on.
    let from = match (arguments.protocol, machine) {
        (DeviceProtocol::Ebb, Some(machine)) => start(machine).map(|ticks| ticks as f64),
        _ => [0.0; 2],
    };
    let place = |place: &[f64; 2]| match machine {
        Some(machine) => {
            machine.machine.forward_from_motors(&MotorPos::new(place[0] + from[0], place[1] + from[1]))
        }
        None => Point::new(place[0], place[1]),
    };
    let lines = ink.lines();
    let ink: Vec<Ink> = lines
        .iter()
        .map(|(pen, places)| Ink { pen: *pen, points: places.iter().map(place).collect() })
        .collect();
    let bounds = ink.iter().flat_map(|ink| &ink.points).fold(None, |bounds: Option<Rect>, point| {
        let here = Rect::from_points(*point, *point);
        Some(bounds.map_or(here, |bounds| bounds.union(here)))
    });
    let sheet = machine.map(|machine| machine.machine.sheet()).or(bounds).unwrap_or(Rect::ZERO);
    let reach = machine.map_or_else(Vec::new, |machine| kinematics::reach_outlines(&machine.machine));
    let title = "what the machine drew".to_owned();
    Scene { title, sheet, reach, ink, travel: Vec::new(), start: None }
}
