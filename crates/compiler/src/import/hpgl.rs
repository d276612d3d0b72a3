//! HP-GL and HP-GL/2, bare or wrapped in PCL or PJL.

use drawing::Pen;
use hpgl::{Generation, Profile, ProfileReason, Wrappers};

use super::foreign::{self, Foreign};
use super::{Diagnostic, Document, Fact, ImportError, Importer, Options, Page, PenSettings, Severity};

/// HP-GL has no signature: what no other importer recognizes is read as HP-GL.
pub(super) const IMPORTER: Importer = Importer { name: "HP-GL", recognizes: |_| true, read };

/// All codes with their titles.
pub(super) fn codes() -> impl Iterator<Item = (&'static str, &'static str)> {
    hpgl::Code::all().map(|code| (code.name(), code.title()))
}

/// The title with severity, and the explanation of a code.
pub(super) fn explain(code: &str) -> Option<(String, &'static str)> {
    let code = hpgl::Code::from_name(code)?;
    Some((format!("{code}: {} ({})", code.title(), code.severity()), code.explanation()))
}

fn read(bytes: &[u8], options: &Options) -> Result<Document, ImportError> {
    let document = hpgl::read(bytes, &reader_options(options)?);
    let has_ink = document.pages.iter().any(|page| !page.drawing.strokes.is_empty());
    let known = document.summary.used.iter().map(|(_, count)| *count).sum();
    let is_junk = |found: &&hpgl::Diagnostic| {
        JUNK.contains(&found.code.name()) && !(has_ink && found.code.name() == CONTROL_BYTE)
    };
    let junk = document.diagnostics.iter().filter(is_junk).map(|found| found.count).sum();
    if let Some(Foreign { what, help }) = foreign::unlikely(known, junk, has_ink) {
        return Err(ImportError::Foreign { what, help });
    }
    let facts = facts(bytes, &document.summary);
    let white = &document.summary.white_pens;
    let is_skipped = |pen: &Pen| options.skip_white_pens && white.contains(pen);
    let pages = document.pages.into_iter().map(|mut page| {
        page.drawing.strokes.change_pens(|pen| (!is_skipped(&pen)).then_some(pen));
        page.pens.retain(|pen, _| !is_skipped(pen));
        Page {
            drawing: page.drawing,
            pens: page.pens.into_iter().map(|(pen, settings)| (pen, pen_settings(settings))).collect(),
        }
    });
    Ok(Document {
        format: IMPORTER.name,
        pages: pages.collect(),
        diagnostics: document
            .diagnostics
            .into_iter()
            .map(|found| white_pen(diagnostic(found), white, options.skip_white_pens))
            .collect(),
        size: format!("{} commands", document.summary.commands),
        facts,
    })
}

fn reader_options(options: &Options) -> Result<hpgl::Options, ImportError> {
    let Some(plotter) = &options.plotter else {
        return Ok(hpgl::Options::default());
    };
    hpgl::Options::for_plotter(plotter, options.paper.as_deref()).ok_or_else(|| {
        let known = hpgl::plotters().iter().find(|known| known.name == plotter);
        match (known, &options.paper) {
            (Some(known), Some(paper)) => ImportError::Paper {
                plotter: plotter.clone(),
                name: paper.clone(),
                known: known.papers.iter().map(|paper| paper.name).collect(),
            },
            _ => ImportError::Plotter {
                name: plotter.clone(),
                known: hpgl::plotters().iter().map(|known| known.name).collect(),
            },
        }
    })
}

fn pen_settings(settings: hpgl::PenSettings) -> PenSettings {
    let hpgl::PenSettings { speed_mm_s, width_mm, color, .. } = settings;
    PenSettings { speed_mm_s, width_mm, color, name: None }
}

fn diagnostic(found: hpgl::Diagnostic) -> Diagnostic {
    let [x, y] = [found.pen_position.x, found.pen_position.y];
    Diagnostic {
        code: found.code.name(),
        title: found.code.title(),
        severity: match found.severity {
            hpgl::Severity::Note => Severity::Note,
            hpgl::Severity::Warning => Severity::Warning,
            hpgl::Severity::Error => Severity::Error,
        },
        message: found.message,
        help: found.help,
        count: found.count,
        span: found.span,
        place: format!("command {}, pen at {x:.2}, {y:.2} mm", found.command),
        line_column: None,
        command: Some(found.command),
        pen_mm: Some([x, y]),
    }
}

/// Codes of findings about bytes that are no HP-GL: unknown commands, stray characters, control
/// bytes, numbers and text between commands.
const JUNK: &[&str] = &["H0101", "H0102", CONTROL_BYTE, "H0104", "H0105"];
/// Captures of serial lines have many of them beside their drawing.
const CONTROL_BYTE: &str = "H0103";

/// The code of white pens.
const WHITE_PEN: &str = "H0229";

/// Says of the finding about white pens what was done with their ink.
fn white_pen(found: Diagnostic, white: &[Pen], is_skipped: bool) -> Diagnostic {
    if found.code != WHITE_PEN {
        return found;
    }
    if !is_skipped {
        return Diagnostic { help: Some("--white-pens skip leaves it out".to_owned()), ..found };
    }
    let pens: Vec<String> = white.iter().map(|pen| pen.0.to_string()).collect();
    let message = format!("ink of white pens is left out (PC; --white-pens skip): pen {}", pens.join(", "));
    Diagnostic { severity: Severity::Note, message, ..found }
}

/// Dialect, producer, plotter and commands.
fn facts(bytes: &[u8], summary: &hpgl::Summary) -> Vec<Fact> {
    let dialect = format!("{}{}", generation(summary.generation()), wrappers(summary.wrappers));
    let producer = hpgl::producer(bytes).map_or("not known".into(), |name| format!("looks like {name}"));
    let used = summary.used.iter().map(|(mnemonic, count)| format!("{mnemonic} {count}"));
    vec![
        Fact { key: "dialect", value: dialect },
        Fact { key: "producer", value: producer },
        Fact { key: "plotter", value: plotter(&summary.profile) },
        Fact { key: "commands", value: summary.commands.to_string() },
        Fact { key: "used", value: used.collect::<Vec<_>>().join(", ") },
    ]
}

fn generation(generation: Generation) -> &'static str {
    match generation {
        Generation::HpGl => "HP-GL",
        Generation::HpGl2 => "HP-GL/2",
    }
}

/// The wrappers around the commands, as the end of a sentence.
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

/// The plotter and paper that the file was read for, and why.
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
        "{reason}; unit {} mm\nreach {:.0}, {:.0} to {:.0}, {:.0}, scaling points {:.0}, {:.0} and {:.0}, {:.0}",
        profile.unit_mm, clip.x0, clip.y0, clip.x1, clip.y1, p1.x, p1.y, p2.x, p2.y
    )
}
