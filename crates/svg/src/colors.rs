//! Colours.

use std::str::FromStr as _;

use svgtypes::Color;

/// Red, green, blue and whether it is opaque at all.
///
/// svgtypes reads CSS 3; this adds blanks instead of commas, and `color()` with the numbers of sRGB
/// and Display P3, which are taken as equal: a pen's colour is a label.
pub(crate) fn parse(value: &str) -> Option<([u8; 3], bool)> {
    let value = value.split("icc-color").next()?.trim();
    if value.eq_ignore_ascii_case("rebeccapurple") {
        return Some(([0x66, 0x33, 0x99], true));
    }
    if let Ok(color) = Color::from_str(value) {
        return Some(([color.red, color.green, color.blue], color.alpha > 0));
    }
    let (name, arguments) = value.strip_suffix(')')?.split_once('(')?;
    let words = arguments.split(|c: char| c.is_whitespace() || matches!(c, ',' | '/'));
    let mut words: Vec<&str> = words.filter(|word| !word.is_empty()).collect();
    let is_opaque = |alpha: Option<&&str>| Some(alpha.map_or(Some(1.0), |word| share(word, 1.0))? > 0.0);
    match &name.to_ascii_lowercase()[..] {
        "rgb" | "rgba" if (3..=4).contains(&words.len()) => {
            Some((channels(&words, 255.0)?, is_opaque(words.get(3))?))
        }
        "hsl" | "hsla" if (3..=4).contains(&words.len()) => {
            let opaque = is_opaque(words.get(3))?;
            words.truncate(3);
            let color = Color::from_str(&format!("hsl({})", words.join(","))).ok()?;
            Some(([color.red, color.green, color.blue], opaque))
        }
        "color" if (4..=5).contains(&words.len()) && matches!(words[0], "srgb" | "display-p3") => {
            Some((channels(&words[1..], 1.0)?, is_opaque(words.get(4))?))
        }
        _ => None,
    }
}

/// A number, or a percentage, as a share of the number that stands for everything.
fn share(word: &str, whole: f64) -> Option<f64> {
    match word.strip_suffix('%') {
        Some(percent) => Some(percent.parse::<f64>().ok()? / 100.0),
        None if word == "none" => Some(0.0),
        None => Some(word.parse::<f64>().ok()? / whole),
    }
}

fn channels(words: &[&str], whole: f64) -> Option<[u8; 3]> {
    let channel = |word: &str| Some((share(word, whole)?.clamp(0.0, 1.0) * 255.0).round() as u8);
    Some([channel(words.first()?)?, channel(words.get(1)?)?, channel(words.get(2)?)?])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_of_css_4() {
        for (text, expected) in [
            ("rgb(255 0 127.5 / 50%)", Some(([255, 0, 128], true))),
            ("rgb(100% 0% 50%)", Some(([255, 0, 128], true))),
            ("rgb(1 2 3 / 0)", Some(([1, 2, 3], false))),
            ("rgba(1, 2, 3, 0.5)", Some(([1, 2, 3], true))),
            ("hsl(120 100% 50% / .5)", Some(([0, 255, 0], true))),
            ("color(display-p3 1 0 0)", Some(([255, 0, 0], true))),
            ("color(srgb 0.5 50% none / 0%)", Some(([128, 128, 0], false))),
            ("transparent", Some(([0, 0, 0], false))),
            ("RED icc-color(x, 1)", Some(([255, 0, 0], true))),
            ("RebeccaPurple", Some(([102, 51, 153], true))),
            ("color(rec2020 1 0 0)", None),
            ("rgb(1 2)", None),
            ("lab(50% 1 2)", None),
        ] {
            assert_eq!(parse(text), expected, "{text}");
        }
    }
}
