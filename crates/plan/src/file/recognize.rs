//! Recognition of the format by the first bytes.

use crate::TickTable;

use super::json::{self, Document};
use super::text::lines;
use super::{ReadError, csv, tick_lines};

/// The formats a plan can be read from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum PlanFormat {
    /// Tick lines.
    Ticks,
    /// Comma-separated values.
    Csv,
    /// A plan document.
    Json,
}

/// A plan as read from a file.
#[derive(Clone, Debug, PartialEq)]
pub struct PlanFile {
    /// The format it was in.
    pub format: PlanFormat,
    /// The plan.
    pub table: TickTable,
    /// The rest of a plan document; `None` for the other formats.
    pub document: Option<Document>,
}

/// Reads a plan of any format.
///
/// # Errors
/// [`ReadError::NotAPlan`] if no format is recognized; otherwise those of the format's reader.
pub fn read(bytes: &[u8]) -> Result<PlanFile, ReadError> {
    let format = format_of(bytes).ok_or(ReadError::NotAPlan)?;
    let (table, document) = match format {
        PlanFormat::Ticks => (tick_lines::read(bytes)?, None),
        PlanFormat::Csv => (csv::read(bytes)?, None),
        PlanFormat::Json => json::read(bytes).map(|(document, table)| (table, Some(document)))?,
    };
    Ok(PlanFile { format, table, document })
}

/// Whether the first bytes are those of a plan, complete or not.
pub fn is_plan(bytes: &[u8]) -> bool {
    format_of(bytes).is_some()
}

/// The format must show within this many bytes.
const HEAD_BYTES: usize = 4096;

fn format_of(bytes: &[u8]) -> Option<PlanFormat> {
    let head = &bytes[..bytes.len().min(HEAD_BYTES)];
    for line in lines(head) {
        let text = line.text;
        if text.starts_with(b"{") {
            // No drawing language begins a file so; what else is JSON names its own format.
            let name = json::FORMAT.as_bytes();
            return head.windows(name.len()).any(|window| window == name).then_some(PlanFormat::Json);
        }
        let key_is_ours = |sign| {
            text.strip_prefix(sign).is_some_and(|rest| rest.trim_ascii_start().starts_with(b"plotplan:"))
        };
        if key_is_ours(b";") || text.starts_with(b"begin 1 ") {
            return Some(PlanFormat::Ticks);
        }
        if key_is_ours(b"#") || text.starts_with(b"t_us,pen,") {
            return Some(PlanFormat::Csv);
        }
        if !(text.is_empty() || text.starts_with(b";") || text.starts_with(b"#")) {
            return None;
        }
    }
    None
}
