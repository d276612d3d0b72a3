//! Files that are no drawings we read, recognized by their content, so that none of them is taken
//! for HP-GL: HP-GL has no signature.

/// What a file is, and how to make a drawing of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Foreign {
    /// What it is, with its article: `a PDF document`.
    pub(super) what: &'static str,
    /// A command or a step that makes a readable drawing of it.
    pub(super) help: &'static str,
}

const INKSCAPE: &str = "open it in Inkscape and save it as HPGL";
const NOT_A_DRAWING: &str = "plotplan reads HP-GL (.hpgl, .plt), SVG and lists of points";

/// First bytes, at the start of the file, and what they mean.
const MAGIC: &[(&[u8], Foreign)] = &[
    (
        b"%PDF",
        Foreign {
            what: "a PDF document",
            help: "pstoedit -f hpgl FILE.pdf FILE.hpgl, or open it in Inkscape and save it as HPGL",
        },
    ),
    (b"%!PS", Foreign { what: "PostScript", help: "pstoedit -f hpgl FILE.ps FILE.hpgl" }),
    (
        b"\xC5\xD0\xD3\xC6",
        Foreign { what: "encapsulated PostScript", help: "pstoedit -f hpgl FILE.eps FILE.hpgl" },
    ),
    (b"\x89PNG", Foreign { what: "a PNG image", help: "trace it first, in Inkscape or with potrace" }),
    (b"\xFF\xD8\xFF", Foreign { what: "a JPEG image", help: "trace it first, in Inkscape or with potrace" }),
    (b"GIF8", Foreign { what: "a GIF image", help: "trace it first, in Inkscape or with potrace" }),
    (b"BM", Foreign { what: "a BMP image", help: "trace it first, in Inkscape or with potrace" }),
    (b"II*\0", Foreign { what: "a TIFF image", help: "trace it first, in Inkscape or with potrace" }),
    (b"MM\0*", Foreign { what: "a TIFF image", help: "trace it first, in Inkscape or with potrace" }),
    (b"PK\x03\x04", Foreign { what: "a ZIP archive", help: "unpack it first" }),
    (b"\x1F\x8B", Foreign { what: "a gzip archive", help: "unpack it first" }),
    (b"\x7FELF", Foreign { what: "a program (ELF)", help: NOT_A_DRAWING }),
    (b"MZ", Foreign { what: "a Windows program", help: NOT_A_DRAWING }),
    (
        b"AC10",
        Foreign {
            what: "an AutoCAD DWG file",
            help: "plot it to HP-GL, or save it as DXF and open that in Inkscape",
        },
    ),
    (b"AutoCAD Binary DXF", Foreign { what: "a DXF file", help: INKSCAPE }),
];

/// How far into a file the other signs are looked for.
const HEAD_BYTES: usize = 4096;

/// What the file is, if it is certainly something else than HP-GL.
pub(super) fn recognize(bytes: &[u8]) -> Option<Foreign> {
    let is_image_like = |what: &Foreign| what.what.contains("BMP") || what.what.contains("Windows");
    if let Some((_, foreign)) = MAGIC.iter().find(|(magic, foreign)| {
        // Two letters could begin a text: the binary formats behind them hold zeros.
        bytes.starts_with(magic) && (!is_image_like(foreign) || bytes[..bytes.len().min(64)].contains(&0))
    }) {
        return Some(*foreign);
    }
    let head = &bytes[..bytes.len().min(HEAD_BYTES)];
    let text = String::from_utf8_lossy(head);
    let text = text.trim_start_matches('\u{feff}').trim_start();
    let lower = text.get(..256.min(text.len())).unwrap_or(text).to_ascii_lowercase();
    let lines = || text.lines().map(str::trim).filter(|line| !line.is_empty());
    if lower.starts_with("<!doctype html") || lower.starts_with("<html") {
        let has_svg = head.windows(4).any(|window| window.eq_ignore_ascii_case(b"<svg"));
        return Some(Foreign {
            what: "an HTML page",
            help: if has_svg {
                "save its svg element as a file of its own"
            } else {
                "download the drawing itself, not the page around it"
            },
        });
    }
    if text.starts_with("<?xml") {
        return Some(Foreign { what: "an XML document", help: NOT_A_DRAWING });
    }
    let mut pair = lines();
    if pair.next() == Some("0") && pair.next() == Some("SECTION") {
        return Some(Foreign { what: "a DXF file", help: INKSCAPE });
    }
    if text.starts_with("%FS")
        || text.starts_with("%MO")
        || lines().take(5).any(|line| line.starts_with("%FSLA"))
    {
        return Some(Foreign {
            what: "a Gerber file",
            help: "export the layer as HPGL from the board editor",
        });
    }
    if is_cutter(text) {
        return Some(Foreign {
            what: "a cutting machine's file (RS-274-D, as garment cutters use)",
            help: NOT_A_DRAWING,
        });
    }
    if is_gcode(text) {
        return Some(Foreign {
            what: "G-code",
            help: "it is a program for a machine already; convert the drawing that it was made from",
        });
    }
    if is_machine_file(text) {
        return Some(Foreign { what: "a machine file", help: "pass it with --machine, beside a drawing" });
    }
    is_prose(head, text)
        .then_some(Foreign { what: "plain text without any HP-GL command", help: NOT_A_DRAWING })
}

/// Words ended by `*`, such as `M15*X5668Y1730*`: garment cutters.
fn is_cutter(text: &str) -> bool {
    let words: Vec<&str> = text.split('*').take(12).map(str::trim).filter(|word| !word.is_empty()).collect();
    let code = |word: &&&str| {
        let mut bytes = word.bytes();
        bytes.next().is_some_and(|first| b"HGMDNXY".contains(&first))
            && bytes.next().is_some_and(|second| second.is_ascii_digit() || second == b'-')
    };
    words.len() >= 4 && !text.contains(';') && words.iter().filter(code).count() * 4 >= words.len() * 3
}

/// Lines that begin with G or M and a number, or with comments of G-code around such lines.
fn is_gcode(text: &str) -> bool {
    let lines: Vec<&str> = text
        .lines()
        .map(str::trim)
        .filter(|line| !line.is_empty() && !line.starts_with([';', '(', '%']))
        .take(12)
        .collect();
    let word = |line: &&&str| {
        let line = line.trim_start_matches(|c: char| c == 'N' || c.is_ascii_digit()).trim_start();
        let mut bytes = line.bytes();
        bytes.next().is_some_and(|first| b"GMTSFgm".contains(&first))
            && bytes.next().is_some_and(|second| second.is_ascii_digit())
    };
    lines.len() >= 2 && !text.contains("IN;") && lines.iter().filter(word).count() * 2 > lines.len()
}

/// TOML with the tables that every machine file has.
fn is_machine_file(text: &str) -> bool {
    ["[geometry]", "[[motor]]"].iter().all(|table| text.lines().any(|line| line.trim_end() == *table))
}

/// Text of words and spaces, where no known mnemonic is followed by a number or a semicolon.
fn is_prose(head: &[u8], text: &str) -> bool {
    let printable = |byte: &u8| byte.is_ascii_graphic() || byte.is_ascii_whitespace() || *byte >= 0x80;
    if head.len() < 16 || !head.iter().all(printable) || text.contains([';', '\u{3}']) {
        return false;
    }
    let words: Vec<&str> = text.split_whitespace().collect();
    let word =
        |word: &&&str| word.chars().filter(|c| c.is_alphabetic()).count() * 4 >= word.chars().count() * 3;
    words.len() >= 4 && words.iter().filter(word).count() * 5 >= words.len() * 4
}

#[cfg(test)]
mod tests {
    use super::*;

    fn what(bytes: &[u8]) -> Option<&'static str> {
        recognize(bytes).map(|foreign| foreign.what)
    }

    #[test]
    fn foreign_files_are_named() {
        for (bytes, expected) in [
            (&b"%PDF-1.4\n%\xE2\xE3"[..], "a PDF document"),
            (b"%!PS-Adobe-3.0\n", "PostScript"),
            (b"\x89PNG\r\n\x1a\n", "a PNG image"),
            (b"\xFF\xD8\xFF\xE0", "a JPEG image"),
            (b"PK\x03\x04\x14", "a ZIP archive"),
            (b"\x7FELF\x02\x01", "a program (ELF)"),
            (b"  0\nSECTION\n  2\nHEADER\n", "a DXF file"),
            (b"%FSLAX24Y24*%\n%MOIN*%\n", "a Gerber file"),
            (
                b"H1*G71*M70*D2*M15*X5668Y1730M31*S:XL-AN:ARKA*D2*M15*",
                "a cutting machine's file (RS-274-D, as garment cutters use)",
            ),
            (b"; made by hand\nG21\nG90\nG0 X10 Y10\nM3 S90\nG1 X20\n", "G-code"),
            (b"(header)\nN10 G21\nN20 G0X1\nN30 G1X2\n", "G-code"),
            (b"<!DOCTYPE html><html><body>404</body>", "an HTML page"),
            (b"<HTML><svg><path/></svg>", "an HTML page"),
            (b"name = \"x\"\n[geometry]\nkind = \"polar\"\n[[motor]]\n", "a machine file"),
            (
                b"Dear all, please find the drawing attached to this letter.",
                "plain text without any HP-GL command",
            ),
        ] {
            assert_eq!(what(bytes), Some(expected), "{}", bytes.escape_ascii());
        }
    }

    #[test]
    fn drawings_are_not_foreign() {
        for bytes in [
            &b"IN;SP1;PU0,0;PD400,400;"[..],
            b"PU0,0 PD 400,400 PU",
            b"\x1B.(;\x1B.I81;;17:IN;SP1;",
            b"\x1B%-12345X@PJL JOB\n@PJL ENTER LANGUAGE=HPGL2\nIN;SP1;",
            b"BP;IN;SP1;PU;PA0,0;PD;PA10,10;",
            b"SP1\nPA100,100\nPD\nPA200,200\nPU\nSP0\n",
            b"",
            b"\n",
            b"LBHello world, this is a label\x03",
        ] {
            assert_eq!(what(bytes), None, "{}", bytes.escape_ascii());
        }
    }
}
