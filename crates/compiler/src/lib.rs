//! The compiler from pen-plotter drawings to motor motion, as a library.
//!
//! [`import`] reads drawings of every recognized format, [`machine_file`] reads machines,
//! [`pipeline`] takes a drawing to a certified plan, [`report`] describes the result. Nothing here
//! knows a command line, a terminal, a port or a clock, so it also builds for
//! `wasm32-unknown-unknown`. The binary `plotplan` is a thin layer on top.
//!
//! From a file to a certified plan:
//!
//! ```
//! use compiler::machine_file::{MachineFile, PRESETS};
//! use compiler::pipeline::{Order, Request, compile};
//! use compiler::{import, report};
//! use planner::{PlacementOptions, Rounding, TimingLaw};
//!
//! let document = import::read(b"IN;SP1;PU400,400;PD1200,400,1200,1000;PU;", &import::Options::default())?;
//! let machine = MachineFile::parse(PRESETS[1].toml)?.machine()?;
//! let request = Request {
//!     tolerance_mm: 0.1,
//!     period_us: 10_000,
//!     order: Order::Optimize(ordering::Options::default()),
//!     placement: PlacementOptions::default(),
//!     search: None,
//!     crop: None,
//!     pen_speeds: Vec::new(),
//!     pen_colors: std::collections::BTreeMap::new(),
//!     lift_overlap_s: 0.0,
//!     timing_law: TimingLaw::TimeOptimal,
//!     rounding: Rounding::Path,
//!     joint_fit: true,
//!     allow_over_limit: false,
//! };
//! let compiled = compile(&document.pages[0].drawing, &machine, &request, &|_step| {})?;
//! assert!(compiled.certificate.holds, "{}", report::text::certificate(&compiled.certificate));
//! let mut bytes = Vec::new();
//! let rows = compiled.trajectory.rows().map(|row| row.row);
//! plan::file::tick_lines::write(&compiled.header, rows, &mut bytes)?;
//! assert!(bytes.starts_with(b"; plotplan: 1\n; machine: corexy\n"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod best_place;
pub mod calibrate;
pub mod diff;
pub mod import;
pub mod layout;
pub mod machine_file;
pub mod new_machine;
pub mod option;
pub mod paper;
pub mod pipeline;
pub mod quantity;
pub mod replay;
pub mod report;
mod restart;
mod same_ink;
pub mod scene;
pub mod settings;
pub mod simulate;
pub mod tune;
pub mod view;
