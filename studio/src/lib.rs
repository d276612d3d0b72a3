//! The compiler behind the studio page.
//!
//! The page's worker holds one [`Studio`]: it opens a drawing, plans it as a [`Job`] asks, and writes
//! outputs. A job carries the options of `plotplan convert` as text, so that each output is known by
//! a command line ([`Output::words`]) with which the program writes the same bytes; `tests/studio.rs`
//! compares them. [`Studio::call`] is the interface of the page: requests and answers as bytes.
//!
//! ```
//! use studio::{Job, Kind, Studio};
//!
//! let mut studio = Studio::default();
//! studio.open("line.hpgl", b"IN;SP1;PU400,400;PD1200,400;PU;");
//! let job: Job = serde_json::from_str(r#"{"machine": {"name": "corexy"}, "options": {"fit": true}}"#)?;
//! let output = studio.output(&job, Kind::Format("ticks"), &|_| {})?;
//! assert!(output.bytes.starts_with(b"; plotplan: 1\n"));
//! assert_eq!(output.words.join(" "), "plotplan convert line.hpgl --machine=corexy --fit --output=line.ticks");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod emulated;
mod job;
mod output;
mod problem;
mod protocol;
mod sending;
mod session;

pub use compiler::pipeline::Step;
pub use emulated::{EmulateJob, Emulated};
pub use job::{Job, MachineChoice, Options};
pub use output::{Kind, Output, formats};
pub use problem::{About, Problem, Problems};
pub use sending::{Datum, Event, Phase, ProtocolInfo, SendJob, Sending, Step as SendStep, protocols};
pub use session::{Reply, Studio};
