//! The state of one run of the program: how it reports, and the report so far.
//!
//! It is global because every message of the program belongs to the report, also those that are
//! written while another failure unwinds.

use std::cell::Cell;
use std::sync::Mutex;

use compiler::report::{Code, ErrorReport, Finding, Report, SCHEMA_VERSION};

use crate::cli::{Color, MessageFormat, Messages, ReportForm};

/// How the program reports.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Style {
    /// Errors only.
    pub(crate) quiet: bool,
    /// Every finding, however many there are.
    pub(crate) all: bool,
    /// The form of messages.
    pub(crate) message_format: MessageFormat,
    /// The form of the report.
    pub(crate) report: ReportForm,
}

impl Style {
    /// Options that give another run of the program the same messages.
    pub(crate) fn as_arguments(self) -> Vec<String> {
        let form = clap::ValueEnum::to_possible_value(&self.message_format);
        let form = form.map(|form| format!("--message-format={}", form.get_name()));
        let flags = [(self.quiet, "--quiet"), (self.all, "--all")];
        let flags = flags.iter().filter(|(is_given, _)| *is_given).map(|(_, flag)| (*flag).to_owned());
        form.into_iter().chain(flags).collect()
    }
}

struct Session {
    style: Style,
    report: Option<Report>,
}

static SESSION: Mutex<Session> = Mutex::new(Session {
    style: Style { quiet: false, all: false, message_format: MessageFormat::Human, report: ReportForm::Text },
    report: None,
});

/// Sets how the program reports, before its first message.
pub(crate) fn begin(options: &Messages, command: &str) {
    set_color(options.color);
    if let Ok(mut session) = SESSION.lock() {
        session.style = Style {
            quiet: options.quiet,
            all: options.all,
            message_format: options.message_format,
            report: options.report,
        };
        session.report = Some(Report {
            schema_version: SCHEMA_VERSION,
            program: concat!("plotplan ", env!("CARGO_PKG_VERSION")).to_owned(),
            command: command.to_owned(),
            ..Report::default()
        });
    }
}

/// Sets the colour of messages. `auto` is colour on terminals, unless `NO_COLOR` is set.
pub(crate) fn set_color(color: Color) {
    let choice = match color {
        Color::Auto => anstream::ColorChoice::Auto,
        Color::Always => anstream::ColorChoice::Always,
        Color::Never => anstream::ColorChoice::Never,
    };
    choice.write_global();
}

/// How the program reports.
pub(crate) fn style() -> Style {
    SESSION.lock().map_or_else(|poisoned| poisoned.into_inner().style, |session| session.style)
}

/// Whether the report is a JSON object.
pub(crate) fn is_json() -> bool {
    style().report == ReportForm::Json
}

/// Changes the report.
pub(crate) fn report(change: impl FnOnce(&mut Report)) {
    if let Ok(mut session) = SESSION.lock()
        && let Some(report) = &mut session.report
    {
        change(report);
    }
}

thread_local! {
    /// Whether this thread found anything more severe than a note in its present drawing.
    static WARNED: Cell<bool> = const { Cell::new(false) };
}

/// Adds a finding to the report.
pub(crate) fn found(finding: Finding) {
    WARNED.set(WARNED.get() || finding.severity != "note");
    report(|report| report.diagnostics.push(finding));
}

/// Whether anything more severe than a note was found in the present drawing: several drawings are
/// converted at the same time.
pub(crate) fn has_warning() -> bool {
    WARNED.get()
}

/// Begins with another drawing.
pub(crate) fn next_drawing() {
    WARNED.set(false);
}

/// Records why the command fails. The first cause stays: what follows results from it.
pub(crate) fn failed(error: ErrorReport) {
    report(|report| {
        report.error.get_or_insert(error);
    });
}

/// The kind of the recorded failure.
pub(crate) fn failure() -> Option<Code> {
    let session = SESSION.lock().ok()?;
    session.report.as_ref()?.error.as_ref().map(|error| error.code)
}

/// The report, complete with the exit code, as a line of JSON.
pub(crate) fn end(exit_code: u8) -> Option<(String, String)> {
    let mut session = SESSION.lock().ok()?;
    let report = session.report.as_mut()?;
    report.exit_code = exit_code;
    report.outputs.sort_by(|a, b| a.file.cmp(&b.file));
    if let [output] = &report.outputs[..] {
        report.summary = output.summary.clone();
        report.certificate = output.certificate.clone();
    }
    Some((report.command.clone(), serde_json::to_string(report).ok()?))
}
