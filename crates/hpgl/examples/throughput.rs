//! How fast files are read: `cargo run --release -p plotplan-hpgl --example throughput -- FILE...`
//!
//! Prints megabytes of input a second, the best of five runs each, for parsing alone and for
//! reading to strokes.
#![expect(clippy::disallowed_methods, reason = "a measurement needs the clock and its arguments")]
#![expect(clippy::print_stdout, clippy::print_stderr, reason = "the result of a measurement is printed")]

use std::time::Instant;

fn best_of_five(bytes: usize, mut work: impl FnMut() -> usize) -> (f64, usize) {
    let mut best = f64::INFINITY;
    let mut result = 0;
    for _ in 0..5 {
        let start = Instant::now();
        result = work();
        best = best.min(start.elapsed().as_secs_f64());
    }
    (bytes as f64 / 1e6 / best, result)
}

fn main() {
    let options = hpgl::Options::default();
    for path in std::env::args().skip(1) {
        let bytes = match std::fs::read(&path) {
            Ok(bytes) => bytes,
            Err(error) => {
                eprintln!("{path}: {error}");
                continue;
            }
        };
        let (parse, commands) = best_of_five(bytes.len(), || hpgl::parse(&bytes, &options).len());
        let (read, strokes) = best_of_five(bytes.len(), || {
            hpgl::read(&bytes, &options).pages.iter().map(|page| page.drawing.strokes.len()).sum()
        });
        println!(
            "{path}: parse {parse:.0} MB/s, {commands} commands; read {read:.0} MB/s, {strokes} strokes"
        );
    }
}
