//! From bytes to text: gzip, byte order marks and encodings.

use std::io::Read as _;

use crate::codes;
use crate::diagnostics::{Findings, Place};
use crate::limits;

const GZIP: &[u8] = &[0x1f, 0x8b];

/// Whether the bytes look like SVG, plain or gzipped: markup whose first 64 KiB have an `svg`
/// element.
pub fn looks_like_svg(bytes: &[u8]) -> bool {
    let mut head = Vec::new();
    let window = 64 << 10;
    if bytes.starts_with(GZIP) {
        // A damaged end does not matter here.
        let _ = flate2::read::GzDecoder::new(bytes).take(window).read_to_end(&mut head);
    } else {
        head.extend(bytes.iter().take(window as usize));
    }
    let text = decode(&head).unwrap_or_else(|| latin1(&head));
    let text = text.trim_start_matches('\u{feff}').trim_start();
    let starts = |tag: &str| text.get(..tag.len()).is_some_and(|head| head.eq_ignore_ascii_case(tag));
    // A page may have drawings in it, but is none.
    if !text.starts_with('<') || starts("<!doctype html") || starts("<html") {
        return false;
    }
    text.match_indices("svg").any(|(at, _)| {
        let before = &text[..at];
        let opens = before.ends_with('<')
            || before.ends_with(':')
                && before.rfind('<').is_some_and(|open| !before[open..].contains([' ', '>', '"']));
        opens && text[at + 3..].starts_with([' ', '\t', '\r', '\n', '>', '/'])
    })
}

/// The text of a file; `None` (and a finding) where there is none.
pub(crate) fn text(bytes: &[u8], findings: &mut Findings) -> Option<String> {
    let mut fail = |code, message: &str| {
        findings.report(code, "", Place::default, || (message.to_owned(), None));
    };
    let mut unpacked = Vec::new();
    let bytes = if bytes.starts_with(GZIP) {
        let mut decoder = flate2::read::MultiGzDecoder::new(bytes).take(limits::TEXT_BYTES as u64 + 1);
        if let Err(error) = decoder.read_to_end(&mut unpacked) {
            fail(codes::DAMAGED_GZIP, &format!("the compressed data are damaged: {error}"));
            return None;
        }
        &unpacked[..]
    } else {
        bytes
    };
    if bytes.len() > limits::TEXT_BYTES {
        fail(codes::TOO_COMPLEX, "the file has more than 256 MB of text");
        return None;
    }
    if let Some(text) = decode(bytes) {
        return Some(text);
    }
    let declared = declared_encoding(bytes);
    let known = declared.as_deref().is_some_and(|name| {
        ["iso-8859-1", "latin1", "windows-1252", "us-ascii"].contains(&name.to_ascii_lowercase().as_str())
    });
    if !known {
        let name = declared.unwrap_or_else(|| "UTF-8".into());
        fail(codes::ENCODING, &format!("the text is not {name} that can be read: ISO 8859-1 is assumed"));
    }
    Some(latin1(bytes))
}

/// UTF-8 (a byte order mark stays, so that places remain those of the file) or, by its mark,
/// UTF-16.
fn decode(bytes: &[u8]) -> Option<String> {
    let utf16 = |unit: fn([u8; 2]) -> u16| {
        let units = bytes[2..].chunks_exact(2).map(|pair| unit([pair[0], pair[1]]));
        Some(char::decode_utf16(units).map(|unit| unit.unwrap_or(char::REPLACEMENT_CHARACTER)).collect())
    };
    match bytes {
        [0xff, 0xfe, ..] => utf16(u16::from_le_bytes),
        [0xfe, 0xff, ..] => utf16(u16::from_be_bytes),
        _ => std::str::from_utf8(bytes).ok().map(str::to_owned),
    }
}

fn latin1(bytes: &[u8]) -> String {
    bytes.iter().map(|&byte| char::from(byte)).collect()
}

/// The encoding that the XML declaration names.
fn declared_encoding(bytes: &[u8]) -> Option<String> {
    let head = latin1(&bytes[..bytes.len().min(200)]);
    let declaration = head.trim_start().strip_prefix("<?xml")?.split("?>").next()?;
    let value = declaration.split("encoding").nth(1)?.trim_start().strip_prefix('=')?.trim_start();
    let quote = value.chars().next().filter(|quote| "\"'".contains(*quote))?;
    value[1..].split(quote).next().map(str::to_owned)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pages_with_drawings_are_no_drawings() {
        for (text, expected) in [
            ("<svg/>", true),
            ("\u{feff} <!-- x --><svg >", true),
            ("<?xml version='1.0'?><s:svg\n>", true),
            ("<!DOCTYPE svg><svg>", true),
            ("<!doctype HTML><svg >", false),
            ("<html><body><svg >", false),
            ("svg <svg>", false),
        ] {
            assert_eq!(looks_like_svg(text.as_bytes()), expected, "{text}");
        }
    }
}
