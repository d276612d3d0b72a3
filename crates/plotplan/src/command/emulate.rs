//! `plotplan emulate`: an emulated controller on a pseudo-terminal.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use anyhow::Context as _;
use backends::homing::EmulatedHoming;
use backends::{Device, EmulatorOptions, Fault, FaultInjector, InkFrame};
use compiler::report::Code;
use drawing::{Point, Rect};
use kinematics::{MotorPos, Play};
use picture::{Ink, InkLine, Scene};

use crate::cli::Emulate;
use crate::failure::Failure;
use crate::machines::{self, LoadedMachine};
use crate::pseudo_terminal::PseudoTerminal;
use crate::{output, terminal};

/// The longest time between two looks at the clock.
const TICK: Duration = Duration::from_millis(20);

pub(crate) fn run(arguments: &Emulate) -> Result<(), Failure> {
    if arguments.speedup.is_nan() || arguments.speedup <= 0.0 {
        return Err(Failure::Usage(anyhow::anyhow!("--speedup must be a positive number")));
    }
    let machine = arguments.machine.as_deref().map(machines::machine).transpose()?;
    let interrupted = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&interrupted);
    ctrlc::set_handler(move || flag.store(true, Ordering::Relaxed))
        .context("cannot catch Ctrl-C")
        .map_err(Failure::Io)?;
    let mut injector = FaultInjector::new(device(arguments, machine.as_ref())?, arguments.fault.clone());
    serve(arguments, &mut injector, &interrupted).map_err(Failure::Io)?;
    let lost = injector.device().lost_bytes();
    if lost > 0 {
        let what = format!("{lost} bytes were lost because the machine's receive buffer was full");
        terminal::warning(Code::LostBytes, &what);
    }
    if let Some(to) = &arguments.ink {
        output::write(to, |out| write_ink(injector.device().ink(), out))?;
    }
    if let Some(to) = &arguments.svg {
        let scene = scene(arguments, machine.as_ref(), injector.device().ink());
        output::write(to, |out| picture::scene::svg(&scene, out))?;
    }
    Ok(())
}

fn device(arguments: &Emulate, machine: Option<&LoadedMachine>) -> Result<Box<dyn Device>, Failure> {
    let options = EmulatorOptions {
        start: machine.map(start_ticks),
        play: machine.and_then(|machine| play(arguments, machine)),
        homed: arguments.homed,
        homing: machine.and_then(|machine| machine.machine.parts().homing.as_ref()).map(|homing| {
            let switch = arguments.fault.iter().find_map(|fault| match fault {
                Fault::Switch(switch) => Some(*switch),
                _ => None,
            });
            EmulatedHoming::of(homing, switch)
        }),
        answers_within_mm: 0.0,
        buffer: arguments.buffer,
        announces_room: arguments.announce_room,
    };
    let device = arguments.protocol.0.emulator(&options);
    device.ok_or_else(|| Failure::Usage(anyhow::anyhow!("there is no emulator for this protocol")))
}

/// Motor positions of a homed machine, ticks.
fn start_ticks(machine: &LoadedMachine) -> [i64; 2] {
    let ticks = machine.machine.motor_positions(&machine.machine.start());
    [ticks[0].round() as i64, ticks[1].round() as i64]
}

/// The play of the motors of a machine with backlash, in the frame of its ink.
fn play(arguments: &Emulate, machine: &LoadedMachine) -> Option<Play> {
    let at = match arguments.protocol.0.ink_frame() {
        InkFrame::Ticks => start_ticks(machine).map(|ticks| ticks as f64),
        InkFrame::TicksFromStart => [0.0; 2],
        InkFrame::Millimetres(_) | InkFrame::PlotterUnits => return None,
    };
    machine.machine.has_backlash().then(|| Play::new(&machine.machine, at))
}

/// The clock that the emulated machine runs by.
#[allow(clippy::disallowed_methods, reason = "an emulated machine runs in real time")]
fn now() -> Instant {
    Instant::now()
}

fn open(arguments: &Emulate) -> anyhow::Result<PseudoTerminal> {
    let pty = PseudoTerminal::open().context("cannot open a pseudo-terminal")?;
    if let Some(link) = &arguments.link {
        let _ = std::fs::remove_file(link);
        std::os::unix::fs::symlink(pty.path(), link)
            .with_context(|| format!("cannot create the link {link}"))?;
    }
    Ok(pty)
}

/// Closes it and removes its link, unless the link points elsewhere by now.
fn close(arguments: &Emulate, pty: Option<PseudoTerminal>) {
    if let (Some(link), Some(pty)) = (&arguments.link, pty)
        && std::fs::read_link(link).is_ok_and(|path| path == *pty.path())
    {
        let _ = std::fs::remove_file(link);
    }
}

fn serve(arguments: &Emulate, injector: &mut FaultInjector, interrupted: &AtomicBool) -> anyhow::Result<()> {
    let begun = now();
    let now_us = || (now().duration_since(begun).as_secs_f64() * arguments.speedup * 1e6) as u64;
    let mut pty = Some(open(arguments)?);
    if let Some(pty) = &pty {
        let name = arguments.link.as_deref().map_or(pty.path().as_path(), Path::new);
        // Scripts wait for this line before they open the port.
        output::write("-", |out| writeln!(out, "{}", name.display()))
            .map_err(|_| anyhow::anyhow!("cannot write the name of the pseudo-terminal"))?;
    }
    let mut received_us: Option<u64> = None;
    while !interrupted.load(Ordering::Relaxed) {
        let time_us = now_us();
        injector.advance(time_us);
        match (injector.plugged(time_us), &pty) {
            (false, Some(_)) => close(arguments, pty.take()),
            (true, None) => pty = Some(open(arguments)?),
            _ => {}
        }
        let answers = injector.heard(time_us);
        let wake_us = injector.wake_us(time_us).map(|wake_us| wake_us.saturating_sub(time_us));
        let within = wake_us
            .map_or(TICK, |us| Duration::from_micros((us as f64 / arguments.speedup) as u64).min(TICK));
        let Some(pty) = &pty else {
            std::thread::sleep(within);
            continue;
        };
        pty.write(&answers).context("cannot write to the pseudo-terminal")?;
        let bytes =
            pty.read(injector.device().room(), within).context("cannot read from the pseudo-terminal")?;
        if !bytes.is_empty() {
            let time_us = now_us();
            injector.receive(&bytes, time_us);
            received_us = Some(time_us);
        }
        let busy = injector.device().wake_us().is_some();
        if let (Some(idle_s), Some(received_us), false) = (arguments.idle_timeout, received_us, busy)
            && now_us().saturating_sub(received_us) as f64 > idle_s * 1e6
        {
            break;
        }
    }
    injector.advance(now_us());
    close(arguments, pty);
    Ok(())
}

/// One line a position: number of the line of ink, pen, position.
fn write_ink(ink: &backends::Ink, out: &mut dyn std::io::Write) -> std::io::Result<()> {
    writeln!(out, "line,pen,x,y")?;
    for (line, (pen, places)) in ink.lines().iter().enumerate() {
        for [x, y] in places {
            writeln!(out, "{line},{pen},{x},{y}")?;
        }
    }
    Ok(())
}

/// The ink as a picture. Motor positions go through the machine's kinematics where it is known.
fn scene(arguments: &Emulate, machine: Option<&LoadedMachine>, ink: &backends::Ink) -> Scene {
    let frame = arguments.protocol.0.ink_frame();
    let machine = machine.filter(|_| !matches!(frame, InkFrame::Millimetres(_) | InkFrame::PlotterUnits));
    let origin = match (frame, machine) {
        (InkFrame::TicksFromStart, Some(machine)) => start_ticks(machine).map(|ticks| ticks as f64),
        _ => [0.0; 2],
    };
    let unit_mm = if frame == InkFrame::PlotterUnits { hpgl::PLOTTER_UNIT_7475A_MM } else { 1.0 };
    let place = |place: &[f64; 2]| match machine {
        Some(machine) => {
            machine.machine.forward_from_motors(&MotorPos::from([place[0] + origin[0], place[1] + origin[1]]))
        }
        None => Point::new(place[0] * unit_mm, place[1] * unit_mm),
    };
    let lines = ink.lines();
    let ink: Vec<Ink> = lines
        .iter()
        .map(|(pen, places)| Ink { pen: *pen, line: InkLine::Points(places.iter().map(place).collect()) })
        .collect();
    let points = lines.iter().flat_map(|(_, places)| places.iter().map(place));
    let bounds = points.fold(None, |bounds: Option<Rect>, point| {
        let here = Rect::from_points(point, point);
        Some(bounds.map_or(here, |bounds| bounds.union(here)))
    });
    let sheet = machine.map(|machine| machine.machine.sheet()).or(bounds).unwrap_or(Rect::ZERO);
    let reach = machine.map_or_else(Vec::new, |machine| kinematics::reach_outlines(&machine.machine));
    let title = "what the machine drew".to_owned();
    let colors = picture::PenColors::new();
    Scene {
        title,
        sheet,
        reach,
        shades: None,
        reference: Vec::new(),
        ink,
        colors,
        travel: Vec::new(),
        start: None,
        overlay: picture::Overlay::default(),
    }
}
