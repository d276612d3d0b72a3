//! Plan files: one file a format, out and in.
//!
//! | module | format |
//! |---|---|
//! | [`tick_lines`] | tick lines, for any serial sender (the default) |
//! | [`csv`] | comma-separated values, for spreadsheets and scripts |
//! | [`json`] | plan document, with machine, settings and certificate |
//!
//! Writers stream: they take rows one at a time and hold a block of text, so that memory does not
//! grow with plot time. Readers take the whole file and hold the whole table. They never panic,
//! whatever the bytes are, and refuse a file that was cut off. [`read()`] recognizes the format by
//! its first bytes.

pub mod csv;
mod error;
mod header;
pub mod json;
mod recognize;
pub mod text;
pub mod tick_lines;

pub use error::{HeaderError, ReadError, RowsError, WriteError};
pub use header::check_header;
pub use recognize::{PlanFile, PlanFormat, is_plan, read};
