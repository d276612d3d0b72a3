//! What a drawing and reading it take of memory, as multiples of the file.

use drawing::Drawing;
use hpgl::{Options, read};
use peak_alloc::PeakAlloc;

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// Files of about this size, bytes: fixed costs are 5 % of it.
const SIZE: usize = 500_000;

/// Commands from a counter until the file is large enough.
fn file(command: impl Fn(usize) -> String) -> Vec<u8> {
    let mut bytes = b"IN;SP1;".to_vec();
    for k in 0.. {
        bytes.extend(command(k).as_bytes());
        if bytes.len() > SIZE {
            break;
        }
    }
    bytes
}

/// Peak while a file is read, and what its drawing holds, both in multiples of the file, which is part of
/// the peak.
fn multiples(bytes: &[u8]) -> (f64, f64, Drawing) {
    let before = MEMORY.current_usage();
    MEMORY.reset_peak_usage();
    let document = read(bytes, &Options::default());
    assert_eq!(document.diagnostics, []);
    let of_file = |held: usize| (held - before) as f64 / bytes.len() as f64;
    let (peak, held) = (of_file(MEMORY.peak_usage()), of_file(MEMORY.current_usage()));
    (1.0 + peak, held, document.pages.into_iter().next().expect("a page").drawing)
}

/// One test: the counts are those of the whole program.
#[test]
fn reading_takes_at_most_a_multiple_of_the_file() {
    let (x, y) = (|k: usize| 1500 + 7 * k % 6000, |k: usize| 1500 + 11 * k % 4000);
    let labels = file(|k| {
        let size = 0.1 + 0.01 * (k % 30) as f64;
        let turn = if k % 2 == 0 { "1,0" } else { "0,1" };
        format!("SI{size:.2},{:.2};DI{turn};PU{},{};LBSection A-A 12.5\u{3}\r\n", 1.5 * size, x(k), y(k))
    });
    let arcs = file(|k| match k % 3 {
        0 => format!("PU{},{};CI{};", x(k), y(k), 20 + k % 600),
        _ => format!("PU{},{};PD;AA{},{},{};PU;\n", x(k) + 400, y(k), x(k), y(k), k % 360 + 1),
    });
    let lines = file(|k| format!("PU{},{};PD{},{};PD{},{};", x(k), y(k), y(k), x(k), x(k) + 9, y(k) + 99));
    for (kind, bytes, most) in [("labels", &labels, 8.0), ("arcs", &arcs, 4.0), ("lines", &lines, 3.0)] {
        let (peak, held, drawing) = multiples(bytes);
        println!("{kind}: {peak:.2} times the file at most, {held:.2} after reading");
        assert!(peak <= most, "{kind}: {peak:.2} times the file");
        assert!(drawing.strokes.len() > 10_000, "{kind}");
    }
    // A pass over all strokes holds one label's at a time.
    let (_, held, drawing) = multiples(&labels);
    MEMORY.reset_peak_usage();
    let before = MEMORY.current_usage();
    assert!(drawing.length() > 0.0);
    assert!(MEMORY.peak_usage() - before < 100_000, "{held:.2} times the file");
}
