//! Standard error: diagnostics with an excerpt of the file, progress, reports.

use std::cell::RefCell;
use std::io::{IsTerminal as _, Write as _};
use std::time::Duration;

use annotate_snippets::{AnnotationKind, Group, Level, Origin, Renderer, Snippet};
use compiler::import::{Diagnostic, Severity};
use compiler::pipeline::Step;
use drawing::Span;
use indicatif::{ProgressBar, ProgressStyle};

use crate::cli::MessageFormat;
use crate::input::Input;

/// Bytes shown on either side of a place: files of a single line of 10 MB are common.
const WINDOW: usize = 48;

thread_local! {
    /// What this thread prints, while it is captured.
    static CAPTURED: RefCell<Option<String>> = const { RefCell::new(None) };
}

/// Runs `work` and returns what it printed to standard error instead of printing it. Threads that
/// `work` starts are not captured.
pub(crate) fn captured<T>(work: impl FnOnce() -> T) -> (T, String) {
    CAPTURED.with_borrow_mut(|text| *text = Some(String::new()));
    let result = work();
    (result, CAPTURED.take().unwrap_or_default())
}

/// Prints text to standard error, in colour where the terminal supports it. Ignores a closed
/// standard error.
pub(crate) fn say(text: &str) {
    let is_captured = CAPTURED
        .with_borrow_mut(|captured| captured.as_mut().map(|captured| captured.push_str(text)).is_some());
    if is_captured {
        return;
    }
    let mut out = anstream::AutoStream::auto(std::io::stderr());
    let _ = out.write_all(text.as_bytes());
    let _ = out.flush();
}

/// Prints an error.
pub(crate) fn error(message: &str) {
    render(&[Group::with_title(Level::ERROR.primary_title(message))]);
}

/// Prints a warning.
pub(crate) fn warning(message: &str) {
    render(&[Group::with_title(Level::WARNING.primary_title(message))]);
}

fn render(report: &[Group<'_>]) {
    let text = Renderer::styled().render(report);
    // The renderer marks an excerpt with an origin as a second, unnamed file: that line is removed.
    let is_mark = |line: &&str| anstream::adapter::strip_str(line).to_string().trim() == ":::";
    let lines: Vec<&str> = text.lines().filter(|line| !is_mark(line)).collect();
    say(&format!("{}\n", lines.join("\n")));
}

/// Prints diagnostics, each with its place in the file.
pub(crate) fn diagnostics(input: &Input, diagnostics: &[Diagnostic], format: MessageFormat) {
    // Places in compressed or recoded files are not bytes of the file.
    let is_plain = std::str::from_utf8(&input.bytes).is_ok();
    for diagnostic in diagnostics {
        match format {
            MessageFormat::Human => {}
            MessageFormat::Short => {
                say(&format!("{}\n", short(input, diagnostic)));
                continue;
            }
            MessageFormat::Json => {
                say(&format!("{}\n", object(input, diagnostic)));
                continue;
            }
        }
        let level = match diagnostic.severity {
            Severity::Note => Level::NOTE,
            Severity::Warning => Level::WARNING,
            Severity::Error => Level::ERROR,
        };
        let mut title = diagnostic.message.clone();
        if diagnostic.count > 1 {
            title = format!("{title} (and {} more like it)", diagnostic.count - 1);
        }
        if let Some([line, column]) = diagnostic.line_column.filter(|_| !is_plain) {
            let mut group = Group::with_title(level.primary_title(title).id(diagnostic.code))
                .element(Origin::path(&input.name).line(line).char_column(column))
                .element(Level::NOTE.message(&diagnostic.place));
            if let Some(help) = &diagnostic.help {
                group = group.element(Level::HELP.message(help));
            }
            render(&[group]);
            continue;
        }
        let place = format!("byte {}, {}", diagnostic.span.start, diagnostic.place);
        at_place(
            input,
            diagnostic.span,
            level,
            Some(diagnostic.code),
            &title,
            &place,
            diagnostic.help.as_deref(),
        );
    }
}

/// A diagnostic on one line, for grep.
fn short(input: &Input, diagnostic: &Diagnostic) -> String {
    let Diagnostic { code, severity, span, message, count, .. } = diagnostic;
    let times = if *count > 1 { format!(" ({count} times)") } else { String::new() };
    let place = match diagnostic.line_column {
        Some([line, column]) => format!("{line}:{column}"),
        None => span.start.to_string(),
    };
    format!("{}:{place}: {severity}[{code}]: {message}{times}", input.name)
}

/// A diagnostic as JSON.
fn object(input: &Input, diagnostic: &Diagnostic) -> serde_json::Value {
    let mut object = serde_json::json!({
        "file": input.name,
        "code": diagnostic.code,
        "severity": diagnostic.severity.to_string(),
        "message": diagnostic.message,
        "help": diagnostic.help,
        "count": diagnostic.count,
        "byte": diagnostic.span.start,
        "end": diagnostic.span.end,
        "command": diagnostic.command,
        "pen_mm": diagnostic.pen_mm,
    });
    if let Some([line, column]) = diagnostic.line_column {
        object["line"] = line.into();
        object["column"] = column.into();
    }
    object
}

/// Prints a message with the excerpt of the file that it is about.
pub(crate) fn at_place(
    input: &Input,
    span: Span,
    level: Level<'_>,
    id: Option<&str>,
    title: &str,
    place: &str,
    help: Option<&str>,
) {
    let window = Window::around(&input.bytes, span);
    let title = level.primary_title(title.to_owned());
    let title = match id {
        Some(id) => title.id(id.to_owned()),
        None => title,
    };
    let mut group = Group::with_title(title)
        .element(Origin::path(&input.name).line(window.line).char_column(window.column))
        .element(
            Snippet::source(window.text)
                .line_start(window.line)
                .annotation(AnnotationKind::Primary.span(window.marked)),
        )
        .element(Level::NOTE.message(place));
    if let Some(help) = help {
        group = group.element(Level::HELP.message(help));
    }
    render(&[group]);
}

/// A printable excerpt of a line around a place.
struct Window {
    text: String,
    /// What to mark, in bytes of `text`.
    marked: std::ops::Range<usize>,
    /// Line and column of the place in the file, from 1.
    line: usize,
    column: usize,
}

impl Window {
    fn around(bytes: &[u8], span: Span) -> Self {
        let start = span.start.min(bytes.len());
        let is_break = |b: &u8| *b == b'\n' || *b == b'\r';
        let line_start = bytes[..start].iter().rposition(is_break).map_or(0, |at| at + 1);
        let line_end = bytes[start..].iter().position(is_break).map_or(bytes.len(), |at| start + at);
        let from = line_start.max(start.saturating_sub(WINDOW));
        let marked_end = span.end.clamp(start, line_end);
        let to = line_end.min(start + WINDOW);
        let mut text = String::new();
        if from > line_start {
            text.push_str("...");
        }
        let mut marked = text.len()..text.len();
        for (offset, byte) in bytes[from..to].iter().enumerate() {
            if from + offset == start {
                marked = text.len()..text.len();
            }
            // Control codes as their pictures, bytes beyond ASCII as a dot: one column each.
            match byte {
                0x20..=0x7E => text.push(char::from(*byte)),
                0x00..=0x1F => text.push(char::from_u32(0x2400 + u32::from(*byte)).unwrap_or('.')),
                _ => text.push('\u{b7}'),
            }
            if from + offset < marked_end {
                marked.end = text.len();
            }
        }
        if start >= to {
            marked = text.len()..text.len();
        }
        if to < line_end {
            text.push_str("...");
        }
        let line = bytes[..line_start].split(|b| *b == b'\n').count();
        Self { text, marked, line, column: start - line_start + 1 }
    }
}

/// Progress of planning; on a terminal only, and not during the first half second.
pub(crate) struct Progress {
    bar: ProgressBar,
}

impl Progress {
    pub(crate) fn new() -> Self {
        let is_captured = CAPTURED.with_borrow(Option::is_some);
        let bar = if std::io::stderr().is_terminal() && !is_captured {
            let bar = ProgressBar::new_spinner();
            if let Ok(style) = ProgressStyle::with_template("{spinner} {msg} {elapsed}") {
                bar.set_style(style);
            }
            bar.enable_steady_tick(Duration::from_millis(500));
            bar
        } else {
            ProgressBar::hidden()
        };
        Self { bar }
    }

    pub(crate) fn step(&self, step: Step) {
        self.bar.set_message(match step {
            Step::Placing => "placing the drawing".to_owned(),
            Step::Ordering => "ordering strokes".to_owned(),
            Step::Planning => "planning motion".to_owned(),
            Step::Verifying(done, all) => {
                format!("verifying {} %", (100 * done).checked_div(all).unwrap_or(100))
            }
        });
    }

    pub(crate) fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

/// Progress of sending with the time left; on a terminal only.
pub(crate) struct SendingProgress {
    bar: ProgressBar,
}

impl SendingProgress {
    pub(crate) fn new(of_us: u64) -> Self {
        let bar = if std::io::stderr().is_terminal() {
            let bar = ProgressBar::new(of_us / 1000);
            if let Ok(style) = ProgressStyle::with_template("{bar:30} {percent}% {msg}") {
                bar.set_style(style);
            }
            bar
        } else {
            ProgressBar::hidden()
        };
        Self { bar }
    }

    pub(crate) fn show(&self, progress: &backends::Progress) {
        if self.bar.is_hidden() {
            return;
        }
        let left = progress.of_us.saturating_sub(progress.done_us) as f64 * 1e-6;
        self.bar.set_length(progress.of_us / 1000);
        self.bar.set_position(progress.done_us / 1000);
        let left = compiler::report::text::duration(left);
        let done = match progress.ink_mm {
            Some([drawn, all]) => {
                format!("{:.2} of {:.2} m of ink", drawn as f64 / 1000.0, all as f64 / 1000.0)
            }
            None => format!("line {} of {}", progress.lines, progress.of_lines),
        };
        let note = progress.note.map(|note| format!(" ({note})")).unwrap_or_default();
        self.bar.set_message(format!("{done}, {left} left{note}"));
    }

    pub(crate) fn finish(&self) {
        self.bar.finish_and_clear();
    }
}
