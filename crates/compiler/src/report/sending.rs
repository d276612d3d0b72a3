//! What was sent.

use schemars::JsonSchema;
use serde::Serialize;

/// The end of a transmission.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SendEnd {
    /// Everything was sent and acknowledged, as far as the protocol has answers.
    Done,
    /// Stopped on request.
    Stopped,
    /// Failed; the error states why.
    Failed,
}

/// What a transmission is counted in, and can be resumed at.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SendUnit {
    /// Rows of a plan.
    Row,
    /// Strokes of a drawing for an HP plotter.
    Stroke,
}

/// What was sent.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub struct SendReport {
    /// The protocol.
    pub protocol: String,
    /// The port, as given.
    pub port: String,
    /// How it ended.
    pub end: SendEnd,
    /// Lines acknowledged; lines sent where the protocol has no answers.
    pub lines: u64,
    /// Lines in all.
    pub of_lines: u64,
    /// Lines sent again.
    pub retransmitted: u64,
    /// Whether the machine acknowledged anything.
    pub acknowledged: bool,
    /// What `row` and `last_sent_row` count.
    pub unit: SendUnit,
    /// Row or stroke up to which everything was acknowledged.
    pub row: u64,
    /// Row or stroke that the machine may have reached.
    pub last_sent_row: u64,
    /// The command that resumes; `null` after the end.
    pub resume: Option<String>,
}
