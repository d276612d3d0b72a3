//! Eight kinds of HPGL input, of 1 MB and 10 MB each, generated where the generator used for other
//! readers is not available.

use std::f64::consts::TAU;
use std::path::Path;

use anyhow::Result;

use super::Random;

const SIZES: [(&str, usize); 2] = [("1m", 1_000_000), ("10m", 10_000_000)];
const WIDTH: f64 = 10_365.0;
const HEIGHT: f64 = 7962.0;
const LABELS: [&str; 8] =
    ["Plan", "Section A-A", "Elevation", "12.5", "Scale 1:50", "GND +5V", "Oak door", "M8x1.25"];

/// Writes `text-1m.plt` and so on into the folder.
pub(super) fn write(folder: &Path) -> Result<()> {
    for (class, make) in [
        ("text", text as fn(&mut Vec<u8>, &mut Random)),
        ("flow", flow),
        ("hatch", hatch),
        ("arcs", arcs),
        ("labels", labels),
        ("pe", |bytes, random| encoded(bytes, random, 64)),
        ("pe7", |bytes, random| encoded(bytes, random, 32)),
        ("bare", bare),
    ] {
        for (name, size) in SIZES {
            std::fs::write(folder.join(format!("{class}-{name}.plt")), file(size, make))?;
        }
    }
    Ok(())
}

fn file(size: usize, make: impl Fn(&mut Vec<u8>, &mut Random)) -> Vec<u8> {
    let mut random = Random(7);
    let mut bytes = b"IN;SP1;".to_vec();
    while bytes.len() < size {
        make(&mut bytes, &mut random);
    }
    bytes.extend(b"PU0,0;SP0;\n");
    bytes
}

/// Text of that many bytes.
pub(super) fn text_of(size: usize) -> Vec<u8> {
    file(size, text)
}

fn push(bytes: &mut Vec<u8>, text: &str) {
    bytes.extend(text.as_bytes());
}

/// A stroke of a glyph: two to eight points close to one another.
fn glyph(random: &mut Random) -> Vec<(i32, i32)> {
    let (x, y) = (random.up_to(WIDTH - 100.0), random.up_to(HEIGHT - 100.0));
    let count = 2 + random.up_to(7.0) as usize;
    (0..count).map(|_| ((x + random.up_to(100.0)) as i32, (y + random.up_to(100.0)) as i32)).collect()
}

fn text(bytes: &mut Vec<u8>, random: &mut Random) {
    for (index, (x, y)) in glyph(random).into_iter().enumerate() {
        push(bytes, &format!("{}{x},{y};", if index == 0 { "PU" } else { "PD" }));
    }
}

/// The same with the spellings of programs that save separators.
fn bare(bytes: &mut Vec<u8>, random: &mut Random) {
    let points = glyph(random);
    let (x, y) = points[0];
    let rest = &points[1..];
    let list = |separator: &str, pair: &dyn Fn(&(i32, i32)) -> String| {
        rest.iter().map(pair).collect::<Vec<_>>().join(separator)
    };
    let text = match random.up_to(3.0) as u32 {
        0 => format!("PU{x} {y}PD{}", list(" ", &|(x, y)| format!("{x} {y}"))),
        1 => format!("PU;PA{x}.0,{y}.00;PD;PA{};", list(",", &|(x, y)| format!("{x}.0,{y}.00"))),
        _ => {
            let steps = points.windows(2).map(|p| format!("{:+}{:+}", p[1].0 - p[0].0, p[1].1 - p[0].1));
            format!("pu{x},{y};pdpr{}pa;\r\n", steps.collect::<String>())
        }
    };
    push(bytes, &text);
}

/// A long curve of short steps.
fn curve(random: &mut Random) -> Vec<(i32, i32)> {
    let (mut x, mut y) = (random.up_to(WIDTH), random.up_to(HEIGHT));
    let mut heading = random.up_to(TAU);
    (0..300)
        .map(|_| {
            heading += random.up_to(0.2) - 0.1;
            x = (x + 10.0 * heading.cos()).clamp(0.0, WIDTH);
            y = (y + 10.0 * heading.sin()).clamp(0.0, HEIGHT);
            (x as i32, y as i32)
        })
        .collect()
}

fn flow(bytes: &mut Vec<u8>, random: &mut Random) {
    let points = curve(random);
    let list: Vec<String> = points[1..].iter().map(|(x, y)| format!("{x},{y}")).collect();
    push(bytes, &format!("PU{},{};PD{};\n", points[0].0, points[0].1, list.join(",")));
}

fn hatch(bytes: &mut Vec<u8>, random: &mut Random) {
    let (x, y) = (random.up_to(WIDTH - 800.0) as i32, random.up_to(HEIGHT - 800.0) as i32);
    for line in 0..40 {
        let (from, to) = if line % 2 == 0 { (x, x + 800) } else { (x + 800, x) };
        let y = y + 20 * line;
        push(bytes, &format!("PU {from},{y};\nPD {to},{y};\n"));
    }
}

fn arcs(bytes: &mut Vec<u8>, random: &mut Random) {
    let radius = 20.0 + random.up_to(600.0);
    let (x, y) = (radius + random.up_to(WIDTH - 2.0 * radius), radius + random.up_to(HEIGHT - 2.0 * radius));
    let sweep = random.up_to(690.0) as i32 - 345;
    if sweep.abs() < 115 {
        push(bytes, &format!("PU{x:.0},{y:.0};CI{radius:.0};"));
    } else {
        push(bytes, &format!("PU{:.0},{y:.0};PD;AA{x:.0},{y:.0},{sweep};PU;\n", x + radius));
    }
}

fn labels(bytes: &mut Vec<u8>, random: &mut Random) {
    let size = 0.1 + random.up_to(0.3);
    let turn = if random.up_to(2.0) < 1.0 { "1,0" } else { "0,1" };
    let (x, y) = (random.up_to(WIDTH - 3000.0) as i32, random.up_to(HEIGHT - 3000.0) as i32);
    push(bytes, &format!("SI{size:.2},{:.2};DI{turn};PU{x},{y};LB", 1.5 * size));
    for _ in 0..=random.up_to(3.0) as usize {
        push(bytes, LABELS[random.up_to(8.0) as usize]);
    }
    push(bytes, "\x03\r\n");
}

/// The curve of `flow` as an encoded polyline: its first point absolute with the pen up, then
/// relative steps.
fn encoded(bytes: &mut Vec<u8>, random: &mut Random, base: u32) {
    let points = curve(random);
    push(bytes, if base == 64 { "PE<=" } else { "PE7<=" });
    number(bytes, points[0].0, base);
    number(bytes, points[0].1, base);
    for pair in points.windows(2) {
        number(bytes, pair[1].0 - pair[0].0, base);
        number(bytes, pair[1].1 - pair[0].1, base);
    }
    push(bytes, ";\n");
}

fn number(bytes: &mut Vec<u8>, value: i32, base: u32) {
    let mut rest = (value.unsigned_abs() << 1) | u32::from(value < 0);
    while rest >= base {
        bytes.push(63 + (rest % base) as u8);
        rest /= base;
    }
    bytes.push(if base == 64 { 191 } else { 95 } + rest as u8);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn generated_inputs_have_no_diagnostics() {
        for make in
            [text, flow, hatch, arcs, labels, bare, |b, c| encoded(b, c, 64), |b, c| encoded(b, c, 32)]
                as [fn(&mut Vec<u8>, &mut Random); 8]
        {
            let mut bytes = b"IN;SP1;".to_vec();
            let mut random = Random(7);
            (0..20).for_each(|_| make(&mut bytes, &mut random));
            let document = hpgl::read(&bytes, &hpgl::Options::default());
            assert_eq!(document.diagnostics, []);
            assert!(document.pages[0].drawing.strokes.len() >= 20);
        }
    }
}
