//! `plotplan info`: what a file is and was read for, lengths, pens, bounds, and with a machine the time a drawing takes.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use compiler::report::{self, clock, counted, metres};
use hpgl::{Code, Generation, Profile, ProfileReason, Wrappers};

use crate::cli::Info;
use crate::failure::Failure;
use crate::input::{self, Input};
use crate::output;

/// Lengths are measured along the plan's own ink: any tolerance does.
const TOLERANCE_MM: f64 = 1.0;

pub(crate) fn run(arguments: &Info) -> Result<(), Failure> {
    let input = input::read(&arguments.file)?;
    let text = if plan::file::is_plan(&input.bytes) {
        of_plan(&input, arguments.machine.as_deref())?
    } else {
        of_drawing(&input, arguments)?
    };
    output::write("-", |out| out.write_all(text.as_bytes()))
}

/// What there is to say about a file of HP-GL, but for its drawing.
fn language(input: &Input, reading: &hpgl::Document) -> String {
    let wrappers = wrappers(reading.summary.wrappers);
    let mut text = format!("dialect  {}{wrappers}\n", generation(reading.summary.generation()));
    let producer =
        hpgl::producer(&input.bytes).map_or("not known".into(), |name| format!("looks like {name}"));
    let _ = writeln!(text, "producer {producer}");
    text.push_str(&plotter(&reading.summary.profile));
    let used = reading.summary.used.iter().map(|(mnemonic, count)| format!("{mnemonic} {count}"));
    let _ = writeln!(text, "commands {}", reading.summary.commands);
    let _ = writeln!(text, "used     {}", used.collect::<Vec<_>>().join(", "));
    text
}

fn of_drawing(input: &Input, arguments: &Info) -> Result<String, Failure> {
    let machine = arguments.machine.as_deref().map(input::machine).transpose()?;
    let drawn = input::drawing(input, &arguments.reading)?;
    let reading = &drawn.reading;
    let mut text = format!("drawing  {}\n", input.name);
    if compiler::import::points::looks_like_points(&input.bytes) {
        text.push_str("dialect  points <x, y>, mm\n");
    } else {
        text.push_str(&language(input, reading));
    }
    for (number, page) in reading.pages.iter().enumerate() {
        let drawing = &page.drawing;
        if reading.pages.len() > 1 {
            let _ = writeln!(text, "page     {}", number + 1);
        }
        let Some(bounds) = drawing.bounding_box() else {
            text.push_str("ink      none\n");
            continue;
        };
        let dots = drawing.strokes.iter().filter(|stroke| stroke.is_dot()).count();
        let _ = writeln!(text, "strokes  {} ({})", drawing.strokes.len(), counted(dots, "dot"));
        let _ = writeln!(text, "ink      {}", metres(drawing.length()));
        let _ = writeln!(
            text,
            "bounds   {:.2}, {:.2} to {:.2}, {:.2} mm ({:.2} x {:.2})",
            bounds.x0,
            bounds.y0,
            bounds.x1,
            bounds.y1,
            bounds.width(),
            bounds.height()
        );
        for pen in drawing.pens() {
            let mine = drawing.strokes.iter().filter(|stroke| stroke.pen == pen);
            let (count, length) = mine.fold((0, 0.0), |(n, l), stroke| (n + 1, l + stroke.length()));
            let settings = page.pens.get(&pen).copied().unwrap_or_default();
            let mut own = String::new();
            if let Some(speed) = settings.speed_mm_s {
                let _ = write!(own, ", {speed:.0} mm/s");
            }
            if let Some(width) = settings.width_mm {
                let _ = write!(own, ", {width:.2} mm wide");
            }
            let _ = writeln!(text, "pen {:<4} {}, {}{own}", pen.0, counted(count, "stroke"), metres(length));
        }
    }
    text.push_str(&told(&reading.diagnostics));
    if let Some(machine) = machine {
        let request = super::request(&arguments.planning, drawn.page(), &machine.machine);
        let compiled = super::convert::compile(input, drawn.drawing(), &machine.machine, &request)?;
        text.push('\n');
        text.push_str(&report::summary_text(&machine.machine, &compiled));
        text.push_str(&report::certificate_text(&compiled.certificate));
    }
    Ok(text)
}

fn generation(generation: Generation) -> &'static str {
    match generation {
        Generation::HpGl => "HP-GL",
        Generation::HpGl2 => "HP-GL/2",
    }
}

/// What stands around the commands, as the end of a sentence.
fn wrappers(found: Wrappers) -> String {
    let names = [
        (found.device_control, "device control"),
        (found.pcl, "PCL or RTL"),
        (found.job_control, "job control (PJL)"),
    ];
    let names: Vec<&str> =
        names.into_iter().filter(|(is_there, _)| *is_there).map(|(_, name)| name).collect();
    if names.is_empty() { String::new() } else { format!(", with {}", names.join(", ")) }
}

/// What plotter and paper the file was read for, and why.
fn plotter(profile: &Profile) -> String {
    let reason = match profile.reason {
        ProfileReason::Assumed => "the file names none: HP 7475A with A4",
        ProfileReason::Options => "as --plotter says",
        ProfileReason::PaperCode => "HP 7475A: PS names the paper by its code",
        ProfileReason::HpGl2 => {
            "HP-GL/2 without the size of its page: HP 7475A with A4, scaling points in its corners"
        }
        ProfileReason::PageSize => "PS gives the size of the page",
        ProfileReason::PictureFrame => "PCL gives the size of the picture frame",
    };
    let (p1, p2) = profile.scaling_points;
    let clip = profile.hard_clip;
    format!(
        "plotter  {reason}; unit {} mm\n         reach {:.0}, {:.0} to {:.0}, {:.0}, scaling points {:.0}, {:.0} and {:.0}, {:.0}\n",
        profile.unit_mm, clip.x0, clip.y0, clip.x1, clip.y1, p1.x, p1.y, p2.x, p2.y
    )
}

/// What was passed over or interpreted, one line a kind.
fn told(diagnostics: &[hpgl::Diagnostic]) -> String {
    let mut counts: BTreeMap<Code, u64> = BTreeMap::new();
    for diagnostic in diagnostics {
        *counts.entry(diagnostic.code).or_default() += diagnostic.count;
    }
    let line = |(code, count): (&Code, &u64)| {
        format!("{:<8} {count} x {code} {}\n", code.severity().to_string(), code.title())
    };
    counts.iter().map(line).collect()
}

fn of_plan(input: &Input, machine: Option<&str>) -> Result<String, Failure> {
    let (plan, machine) = super::verify::plan(input, machine)?;
    let header = &plan.table.header;
    let mut text = format!("plan     {}\n", input.name);
    let _ = writeln!(text, "machine  {}", header.machine);
    let _ = writeln!(text, "time     {}", clock(header.duration_us as f64 * 1e-6));
    let _ = writeln!(text, "rows     {} every {} us", header.rows, header.period_us);
    for motor in &header.motors {
        let limits = &motor.limits;
        let _ = writeln!(
            text,
            "motor    {}: at most {:.1} ticks/s, {:.1} ticks/s2",
            motor.name, limits.speed, limits.acceleration
        );
    }
    let certificate = super::verify::replay(&plan, &machine.machine, None, TOLERANCE_MM);
    let _ = writeln!(text, "ink      {}", metres(certificate.ink_mm));
    let _ = writeln!(text, "travel   {}", metres(certificate.travel_mm));
    let _ = writeln!(text, "pens     {:?}, down {} times", certificate.pens, certificate.pen_downs);
    Ok(text)
}
