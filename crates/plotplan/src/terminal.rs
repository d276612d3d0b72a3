//! Standard error: diagnostics with an excerpt of the file, progress, reports.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::io::{IsTerminal as _, Write as _};
use std::time::Duration;

use annotate_snippets::{AnnotationKind, Group, Level, Origin, Renderer, Snippet};
use compiler::import::{Diagnostic, Severity};
use compiler::pipeline::Step;
use compiler::report::{Code, ErrorReport, Finding, Place};
use drawing::Span;
use indicatif::{HumanDuration, ProgressBar, ProgressState, ProgressStyle};

use crate::cli::MessageFormat;
use crate::input::Input;
use crate::session;

/// Bytes shown on either side of a place: files of a single line of 10 MB are common.
const WINDOW: usize = 48;

/// Diagnostics of one kind that are shown, unless all are asked for.
const SHOWN_OF_A_KIND: usize = 5;

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
pub(crate) fn always(text: &str) {
    let is_captured = CAPTURED
        .with_borrow_mut(|captured| captured.as_mut().map(|captured| captured.push_str(text)).is_some());
    if is_captured {
        return;
    }
    let mut out = anstream::AutoStream::auto(std::io::stderr());
    let _ = out.write_all(text.as_bytes());
    let _ = out.flush();
}

/// The same for information, which `--quiet` leaves out.
pub(crate) fn say(text: &str) {
    if !session::style().quiet {
        always(text);
    }
}

/// Prints the report of a command that writes its result elsewhere, unless it is wanted as JSON.
pub(crate) fn report(text: &str) {
    if !session::is_json() {
        say(&printable(text));
    }
}

/// Longest line of a message, in characters. Parsers quote the line that they stop at, which may be a
/// whole file.
const LONGEST_LINE: usize = 2000;

/// Text that may contain names and excerpts of files: control characters as escapes, so that no file sends
/// commands to the terminal, and long lines cut.
pub(crate) fn printable(text: &str) -> String {
    let mut printable = String::with_capacity(text.len());
    let mut column = 0;
    for character in text.chars() {
        column = if character == '\n' { 0 } else { column + 1 };
        match character {
            '\n' | '\t' => printable.push(character),
            _ if column > LONGEST_LINE => {
                if column == LONGEST_LINE + 1 {
                    printable.push_str("...");
                }
            }
            _ if character.is_control() => printable.extend(character.escape_default()),
            _ => printable.push(character),
        }
    }
    printable
}

/// Prints an error and records it as the cause of the failure.
pub(crate) fn error(code: Code, message: &str) {
    error_at(code, message, None);
}

/// Prints an error about one of several outputs and records it: the command goes on with the others.
pub(crate) fn error_of_one(code: Code, message: &str) {
    print_error(code, message);
    session::found(Finding { severity: "error".to_owned(), ..Finding::warning(code, message) });
}

/// Prints an error with its place and records it as the cause of the failure.
pub(crate) fn error_at(code: Code, message: &str, place: Option<Place>) {
    let message = printable(message);
    print_error(code, &message);
    session::failed(ErrorReport { code, message, help: None, place });
}

fn print_error(code: Code, message: &str) {
    if session::style().message_format == MessageFormat::Json {
        let finding = Finding { severity: "error".to_owned(), ..Finding::warning(code, message) };
        always(&line_of(&finding));
    } else {
        render(&[Group::with_title(Level::ERROR.primary_title(printable(message)))]);
    }
}

/// Prints a warning and records it.
pub(crate) fn warning(code: Code, message: &str) {
    found(Level::WARNING, Finding::warning(code, message));
}

/// Prints a note and records it.
pub(crate) fn note(code: Code, message: &str) {
    found(Level::NOTE, Finding { severity: "note".to_owned(), ..Finding::warning(code, message) });
}

fn found(level: Level<'_>, finding: Finding) {
    let style = session::style();
    if !style.quiet {
        match style.message_format {
            MessageFormat::Json => always(&line_of(&finding)),
            _ => render(&[Group::with_title(level.primary_title(printable(&finding.message)))]),
        }
    }
    session::found(finding);
}

/// A finding as a line of JSON.
fn line_of(finding: &Finding) -> String {
    format!("{}\n", serde_json::to_string(finding).unwrap_or_default())
}

fn render(report: &[Group<'_>]) {
    let text = Renderer::styled().render(report);
    // The renderer marks an excerpt with an origin as a second, unnamed file: that line is removed.
    let is_mark = |line: &&str| anstream::adapter::strip_str(line).to_string().trim() == ":::";
    let lines: Vec<&str> = text.lines().filter(|line| !is_mark(line)).collect();
    always(&format!("{}\n", lines.join("\n")));
}

/// Prints diagnostics, each with its place in the file, and records them. Of each kind the first few,
/// then their number.
pub(crate) fn diagnostics(input: &Input, diagnostics: &[Diagnostic]) {
    let style = session::style();
    let mut shown: BTreeMap<&str, usize> = BTreeMap::new();
    for diagnostic in diagnostics {
        session::found(Finding::of(&input.path, diagnostic));
        if style.quiet && diagnostic.severity < Severity::Error {
            continue;
        }
        let of_its_kind = shown.entry(diagnostic.code).or_default();
        *of_its_kind += 1;
        match style.message_format {
            MessageFormat::Json => always(&line_of(&Finding::of(&input.path, diagnostic))),
            _ if *of_its_kind > SHOWN_OF_A_KIND && !style.all => {}
            MessageFormat::Short => always(&format!("{}\n", printable(&short(input, diagnostic)))),
            MessageFormat::Human => long(input, diagnostic),
        }
    }
    if style.all || style.message_format == MessageFormat::Json {
        return;
    }
    for (code, count) in shown.into_iter().filter(|(_, count)| *count > SHOWN_OF_A_KIND) {
        let more = count - SHOWN_OF_A_KIND;
        let title = format!("{more} more diagnostics of the kind {code} are not shown (--all shows them)");
        render(&[Group::with_title(Level::NOTE.primary_title(title))]);
    }
}

/// Prints a diagnostic with a window of the file.
fn long(input: &Input, diagnostic: &Diagnostic) {
    let level = match diagnostic.severity {
        Severity::Note => Level::NOTE,
        Severity::Warning => Level::WARNING,
        Severity::Error => Level::ERROR,
    };
    let mut title = printable(&diagnostic.message);
    if diagnostic.count > 1 {
        title = format!("{title} (and {} more like it)", diagnostic.count - 1);
    }
    // Places in compressed or recoded files are not bytes of the file.
    let is_plain = std::str::from_utf8(&input.bytes).is_ok();
    if let Some([line, column]) = diagnostic.line_column.filter(|_| !is_plain) {
        let mut group = Group::with_title(level.primary_title(title).id(diagnostic.code))
            .element(Origin::path(&input.path).line(line).char_column(column))
            .element(Level::NOTE.message(printable(&diagnostic.place)));
        if let Some(help) = &diagnostic.help {
            group = group.element(Level::HELP.message(printable(help)));
        }
        render(&[group]);
        return;
    }
    let place = format!("byte {}, {}", diagnostic.span.start, diagnostic.place);
    let help = diagnostic.help.as_deref();
    excerpt(input, diagnostic.span, level, Some(diagnostic.code), &title, &place, help);
}

/// A diagnostic on one line, for grep.
fn short(input: &Input, diagnostic: &Diagnostic) -> String {
    let Diagnostic { code, severity, span, message, count, .. } = diagnostic;
    let times = if *count > 1 { format!(" ({count} times)") } else { String::new() };
    let place = match diagnostic.line_column {
        Some([line, column]) => format!("{line}:{column}"),
        None => span.start.to_string(),
    };
    format!("{}:{place}: {severity}[{code}]: {message}{times}", input.path)
}

/// Prints an error about a stroke, with the excerpt of the file that draws it, and records it.
pub(crate) fn error_in_file(
    input: &Input,
    span: Span,
    code: Code,
    title: &str,
    note: &str,
    help: &str,
    place: Place,
) {
    if session::style().message_format == MessageFormat::Json {
        let finding = Finding {
            file: Some(input.path.clone()),
            severity: "error".to_owned(),
            help: Some(help.to_owned()),
            byte: Some(span.start),
            end: Some(span.end),
            ..Finding::warning(code, title)
        };
        always(&line_of(&finding));
    } else {
        excerpt(input, span, Level::ERROR, None, title, note, Some(help));
    }
    let help = Some(help.to_owned());
    session::failed(ErrorReport { code, message: title.to_owned(), help, place: Some(place) });
}

/// Prints a message with the excerpt of the file that it is about.
fn excerpt(
    input: &Input,
    span: Span,
    level: Level<'_>,
    id: Option<&str>,
    title: &str,
    place: &str,
    help: Option<&str>,
) {
    let window = Window::around(&input.bytes, span);
    let title = level.primary_title(printable(title));
    let title = match id {
        Some(id) => title.id(id.to_owned()),
        None => title,
    };
    let mut group = Group::with_title(title)
        .element(Origin::path(&input.path).line(window.line).char_column(window.column))
        .element(
            Snippet::source(window.text)
                .line_start(window.line)
                .annotation(AnnotationKind::Primary.span(window.marked)),
        )
        .element(Level::NOTE.message(printable(place)));
    if let Some(help) = help {
        group = group.element(Level::HELP.message(printable(help)));
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

/// Columns and lines of the terminal on standard output; 80 and 40 where there is none.
pub(crate) fn size() -> (u32, u32) {
    #[cfg(unix)]
    if let Ok(size) = rustix::termios::tcgetwinsize(std::io::stdout())
        && size.ws_col > 0
        && size.ws_row > 0
    {
        return (size.ws_col.into(), size.ws_row.into());
    }
    (80, 40)
}

/// Progress of planning: step, percentage, time left. On a terminal only.
pub(crate) struct Progress {
    bar: ProgressBar,
    step: RefCell<&'static str>,
}

impl Progress {
    pub(crate) fn new() -> Self {
        let is_captured = CAPTURED.with_borrow(Option::is_some);
        let bar = if std::io::stderr().is_terminal() && !is_captured && !session::style().quiet {
            let bar = ProgressBar::new(1);
            bar.enable_steady_tick(Duration::from_millis(500));
            bar
        } else {
            ProgressBar::hidden()
        };
        Self { bar, step: RefCell::new("") }
    }

    pub(crate) fn step(&self, step: Step) {
        let (name, done, all) = match step {
            Step::Placing => ("placing the drawing", 0, 0),
            Step::Ordering(done, all) => ("ordering strokes", done, all),
            Step::Planning(done, all) => ("planning motion", done as u64, all as u64),
            Step::Verifying(done, all) => ("verifying", done, all),
        };
        if self.step.replace(name) != name {
            // Steps without a count of their own show the time that they take.
            let template =
                if all > 0 { "{spinner} {msg} {percent} %{left}" } else { "{spinner} {msg} {elapsed}" };
            if let Ok(style) = ProgressStyle::with_template(template) {
                self.bar.set_style(style.with_key("left", time_left));
            }
            self.bar.set_message(name);
            self.bar.reset_elapsed();
            self.bar.reset_eta();
        }
        self.bar.set_length(all.max(1));
        self.bar.set_position(done);
    }

    pub(crate) fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

/// Progress of several outputs; on a terminal only.
pub(crate) struct Counter {
    bar: ProgressBar,
}

impl Counter {
    pub(crate) fn new(of: usize) -> Self {
        let bar = if std::io::stderr().is_terminal() && !session::style().quiet && of > 0 {
            let bar = ProgressBar::new(of as u64);
            if let Ok(style) = ProgressStyle::with_template("{bar:30} {pos} of {len}{left}") {
                bar.set_style(style.with_key("left", time_left));
            }
            bar.enable_steady_tick(Duration::from_millis(500));
            bar
        } else {
            ProgressBar::hidden()
        };
        Self { bar }
    }

    /// Prints without the bar in the way.
    pub(crate) fn suspend(&self, print: impl FnOnce()) {
        self.bar.suspend(print);
    }

    pub(crate) fn step(&self) {
        self.bar.inc(1);
    }

    pub(crate) fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

/// The time left, once there is something to estimate it from.
fn time_left(state: &ProgressState, text: &mut dyn std::fmt::Write) {
    let eta = state.eta();
    if state.pos() > 0 && !eta.is_zero() {
        let _ = write!(text, ", {:#} left", HumanDuration(eta));
    }
}

/// Progress of sending with the time left; on a terminal only.
pub(crate) struct SendingProgress {
    bar: ProgressBar,
}

impl SendingProgress {
    pub(crate) fn new(of_us: u64) -> Self {
        let bar = if std::io::stderr().is_terminal() && !session::style().quiet {
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
