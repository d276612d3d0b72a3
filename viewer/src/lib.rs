//! The viewer of plans, as one HTML file.
//!
//! `js/` holds the viewer: plain ES modules that draw a plan and its machine on canvases. [`page`] puts
//! them, the style sheet and a plan into one file that opens from `file://`: no request leaves it,
//! and a Content-Security-Policy with the hashes of its scripts forbids all others. [`Columns`] packs
//! the plan's rows.
//!
//! ```
//! use viewer::{Columns, page};
//!
//! let mut columns = Columns::default();
//! columns.numbers("t", &[0, 10_000, 20_000]);
//! let html = page("three rows", "{}", &columns);
//! assert!(html.starts_with("<!doctype html>"));
//! ```

mod columns;
mod linker;
mod page;

pub use columns::{Column, Columns};
pub use page::page;
