//! Length, strokes and findings of SVG files: `cargo run --release --example lengths --
//! [--outlines] FILE...`

#![expect(clippy::print_stdout, reason = "an example prints")]

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let outline_fills = arguments.iter().any(|argument| argument == "--outlines");
    for file in arguments.iter().filter(|argument| !argument.starts_with("--")) {
        let Ok(bytes) = std::fs::read(file) else {
            println!("{file}: cannot be read");
            continue;
        };
        let options = svg::Options { outline_fills, ..svg::Options::default() };
        let document = svg::read(&bytes, &options);
        let [width, height] = document.page_mm;
        let (length, strokes) = (document.drawing.length(), document.drawing.strokes.len());
        println!("{file}\t{length:.3} mm\t{strokes} strokes\t{width:.2} x {height:.2} mm");
        for diagnostic in &document.diagnostics {
            println!("  {diagnostic}");
        }
    }
}
