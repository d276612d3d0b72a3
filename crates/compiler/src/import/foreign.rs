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
    (b"%PDF", PDF),
    (b"%!", POSTSCRIPT),
    (
        b"\xC5\xD0\xD3\xC6",
        Foreign { what: "encapsulated PostScript", help: "pstoedit -f hpgl FILE.eps FILE.hpgl" },
    ),
    (b"\x89PNG", Foreign { what: "a PNG image", help: TRACE }),
    (b"\xFF\xD8\xFF", Foreign { what: "a JPEG image", help: TRACE }),
    (b"GIF8", Foreign { what: "a GIF image", help: TRACE }),
    (b"BM", Foreign { what: "a BMP image", help: TRACE }),
    (b"II*\0", Foreign { what: "a TIFF image", help: TRACE }),
    (b"MM\0*", Foreign { what: "a TIFF image", help: TRACE }),
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
    (b"8BPS", Foreign { what: "a Photoshop image", help: TRACE }),
    (b"gimp xcf", Foreign { what: "a GIMP image", help: TRACE }),
    (b"PK\x05\x06", Foreign { what: "an empty ZIP archive", help: NOT_A_DRAWING }),
    (b"7z\xBC\xAF\x27\x1C", Foreign { what: "a 7z archive", help: "unpack it first" }),
    (b"Rar!\x1A", Foreign { what: "a RAR archive", help: "unpack it first" }),
    (b"BZh", Foreign { what: "a bzip2 archive", help: "unpack it first" }),
    (b"\xFD7zXZ\0", Foreign { what: "an xz archive", help: "unpack it first" }),
    (b"\x28\xB5\x2F\xFD", Foreign { what: "a zstd archive", help: "unpack it first" }),
    (
        b"\xD0\xCF\x11\xE0\xA1\xB1",
        Foreign {
            what: "an old Office, Visio or CAD file (OLE)",
            help: "export the drawing as SVG or HP-GL",
        },
    ),
    (b"\xD7\xCD\xC6\x9A", Foreign { what: "a Windows metafile (WMF)", help: INKSCAPE }),
    (b"\xCA\xFE\xBA\xBE", Foreign { what: "a program", help: NOT_A_DRAWING }),
    (b"\xCF\xFA\xED\xFE", Foreign { what: "a program (macOS)", help: NOT_A_DRAWING }),
    (b"\0asm", Foreign { what: "a program (WebAssembly)", help: NOT_A_DRAWING }),
    (b"SQLite format 3\0", Foreign { what: "a database (SQLite)", help: NOT_A_DRAWING }),
    (b"{\\rtf", Foreign { what: "an RTF document", help: "save its text as plain text" }),
    (b"ISO-10303-21;", Foreign { what: "a STEP model", help: "project it to a drawing in the CAD program" }),
    (b"OTTO", Foreign { what: "a font", help: "pass it with --font, beside an SVG drawing" }),
    (b"\0\x01\0\0\0", Foreign { what: "a font", help: "pass it with --font, beside an SVG drawing" }),
    (b"\xFF\xFE", Foreign { what: "text in UTF-16", help: "save it as ASCII or UTF-8" }),
    (b"\xFE\xFF", Foreign { what: "text in UTF-16", help: "save it as ASCII or UTF-8" }),
    (b"#!", Foreign { what: "a script", help: NOT_A_DRAWING }),
];

/// Bytes at a place, and what they mean.
const MAGIC_AT: &[(usize, &[u8], Foreign)] = &[
    (8, b"WEBP", Foreign { what: "a WebP image", help: TRACE }),
    (8, b"CDR", Foreign { what: "a CorelDRAW drawing", help: "export it as SVG or HP-GL" }),
    (8, b"WAVE", Foreign { what: "a sound", help: NOT_A_DRAWING }),
    (8, b"AVI ", Foreign { what: "a video", help: NOT_A_DRAWING }),
    (4, b"ftyphei", Foreign { what: "a HEIC image", help: TRACE }),
    (4, b"ftypmif1", Foreign { what: "a HEIC image", help: TRACE }),
    (4, b"ftypavif", Foreign { what: "an AVIF image", help: TRACE }),
    (4, b"ftyp", Foreign { what: "a video", help: NOT_A_DRAWING }),
    (40, b" EMF", Foreign { what: "a Windows metafile (EMF)", help: INKSCAPE }),
    (257, b"ustar", Foreign { what: "a TAR archive", help: "unpack it first" }),
];

const PDF: Foreign = Foreign {
    what: "a PDF document",
    help: "pstoedit -f hpgl FILE.pdf FILE.hpgl, or open it in Inkscape and save it as HPGL",
};
const POSTSCRIPT: Foreign = Foreign { what: "PostScript", help: "pstoedit -f hpgl FILE.ps FILE.hpgl" };
const TRACE: &str = "trace it first, in Inkscape or with potrace";
/// What nothing else is known about.
const UNKNOWN: Foreign = Foreign { what: "a file of an unknown kind", help: NOT_A_DRAWING };

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
    if let Some((.., foreign)) =
        MAGIC_AT.iter().find(|(at, magic, _)| bytes.get(*at..).is_some_and(|rest| rest.starts_with(magic)))
    {
        return Some(*foreign);
    }
    let head = &bytes[..bytes.len().min(HEAD_BYTES)];
    if let Some(page) = page_language(head) {
        return Some(page);
    }
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
    if is_dxf(text) {
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
    if let Some(foreign) = text_file(text, bytes.len()) {
        return Some(foreign);
    }
    is_prose(head, text)
        .then_some(Foreign { what: "plain text without any HP-GL command", help: NOT_A_DRAWING })
}

/// PDF and PostScript behind what may precede them: end-of-file marks of serial lines, blanks, commands
/// of PJL that choose the language.
fn page_language(head: &[u8]) -> Option<Foreign> {
    let mut rest = head;
    loop {
        rest = rest.trim_ascii_start();
        if let Some(after) = rest.strip_prefix(b"\x04").or_else(|| rest.strip_prefix(b"\x1B%-12345X")) {
            rest = after;
        } else if rest.starts_with(b"@PJL") {
            let end = rest.iter().position(|byte| *byte == b'\n').map_or(rest.len(), |end| end + 1);
            let line = rest[..end].to_ascii_uppercase();
            let enters = |language: &[u8]| {
                let at = line.windows(8).position(|window| window == b"LANGUAGE");
                at.is_some_and(|at| line[at..].windows(language.len()).any(|window| window == language))
            };
            if enters(b"POSTSCRIPT") {
                return Some(POSTSCRIPT);
            }
            if enters(b"PDF") {
                return Some(PDF);
            }
            if enters(b"PCLXL") {
                let help = "print the drawing with a driver of HP-GL/2 or PCL 5 instead";
                return Some(Foreign { what: "a printer's file (PCL XL)", help });
            }
            rest = &rest[end..];
        } else {
            break;
        }
    }
    let is_pdf = rest.starts_with(b"%PDF-");
    let is_postscript = rest.starts_with(b"%!");
    is_pdf.then_some(PDF).or(is_postscript.then_some(POSTSCRIPT))
}

/// Pairs of a code and a value, with comments (999) before the first section.
fn is_dxf(text: &str) -> bool {
    let mut lines = text.lines().map(str::trim).filter(|line| !line.is_empty());
    loop {
        match (lines.next(), lines.next()) {
            (Some("999"), Some(_)) => {}
            (Some("0"), Some(value)) => return value == "SECTION",
            _ => return false,
        }
    }
}

/// Text files with signs of their own.
fn text_file(text: &str, bytes: usize) -> Option<Foreign> {
    let mut lines = text.lines().map(str::trim_end).filter(|line| !line.is_empty());
    let first = lines.next()?;
    if first.trim() == "M48" {
        let help = "export the board's drill map as HPGL or SVG";
        return Some(Foreign { what: "a drill file (Excellon)", help });
    }
    if first.starts_with("solid") && text.contains("facet") {
        let help = "slice it or project it to a drawing first";
        return Some(Foreign { what: "an STL model", help });
    }
    let header = |line: &str| {
        ["From: ", "Received: ", "Return-Path: ", "Delivered-To: ", "MIME-Version: "]
            .iter()
            .any(|name| line.starts_with(name))
    };
    if header(first) {
        return Some(Foreign { what: "an e-mail", help: "save the attached drawing as a file of its own" });
    }
    if text.starts_with(['{', '[']) && text.contains("\":") && bytes > 4 {
        return Some(Foreign { what: "JSON", help: NOT_A_DRAWING });
    }
    if is_ebb(text) {
        return Some(Foreign {
            what: "commands of an EBB (AxiDraw)",
            help: "it is a program for a machine already; convert the drawing that it was made from",
        });
    }
    is_table(text).then_some(Foreign {
        what: "a table of numbers",
        help: "write its points as <x, y> in mm, one a line",
    })
}

/// Lines `SM,100,10,10`: two letters and a comma, which HP-GL never has.
fn is_ebb(text: &str) -> bool {
    let lines: Vec<&str> =
        text.split(['\r', '\n']).map(str::trim).filter(|line| !line.is_empty()).take(12).collect();
    let command = |line: &&&str| {
        let bytes = line.as_bytes();
        bytes.len() > 3 && bytes[..2].iter().all(u8::is_ascii_uppercase) && bytes[2] == b','
    };
    lines.len() >= 2 && lines.iter().filter(command).count() * 3 >= lines.len() * 2
}

/// Lines of the same number of numbers, with a line of names before them at most.
fn is_table(text: &str) -> bool {
    let separators = [',', ';', '\t', ' '];
    let fields = |line: &str| line.split(separators).filter(|field| !field.is_empty()).count();
    let is_numeric = |line: &str| {
        fields(line) >= 2
            && line.split(separators).filter(|f| !f.is_empty()).all(|f| f.trim().parse::<f64>().is_ok())
    };
    let lines: Vec<&str> = text.lines().map(str::trim).filter(|line| !line.is_empty()).take(30).collect();
    let Some((first, rest)) = lines.split_first() else { return false };
    let is_names = || {
        first.contains([',', '\t'])
            && first
                .split([',', '\t'])
                .all(|field| field.trim().starts_with(|c: char| c.is_alphabetic() || c == '"'))
            && !first.contains(';')
    };
    // The last line may be cut.
    let whole = &rest[..rest.len().saturating_sub(usize::from(rest.len() >= 29))];
    let has_numbers =
        whole.iter().filter(|line| line.split([',', '\t']).any(|f| f.trim().parse::<f64>().is_ok()));
    (is_numeric(first) && !whole.is_empty() && whole.iter().all(|line| is_numeric(line)))
        || (is_names() && !whole.is_empty() && has_numbers.count() == whole.len())
}

/// What a file is that was read as HP-GL, if that was in vain: `known` instructions were executed and
/// `junk` findings are about bytes that are none.
pub(super) fn unlikely(known: u64, junk: u64, has_ink: bool) -> Option<Foreign> {
    // Ink may be an accident of letters in a text.
    let is_foreign = if has_ink { junk >= 10 && junk > 3 * known } else { junk > known };
    is_foreign.then_some(UNKNOWN)
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
            (b"\n\n%PDF-1.4\n", "a PDF document"),
            (b"\x04%!PS-Adobe-3.0\n", "PostScript"),
            (b"%!\n/IN {} def\nPU PD 0 0 moveto\n", "PostScript"),
            (b"\x1B%-12345X@PJL JOB\n@PJL ENTER LANGUAGE=POSTSCRIPT\n%!PS", "PostScript"),
            (b"\x1B%-12345X@PJL ENTER LANGUAGE = PCLXL\n) HP-PCL XL;2;0\n", "a printer's file (PCL XL)"),
            (b"999\nmade by x\n  0\nSECTION\n  2\nENTITIES\n", "a DXF file"),
            (b"RIFF\0\0\0\0WEBPVP8 ", "a WebP image"),
            (b"RIFF\0\0\0\0CDRAvrsn", "a CorelDRAW drawing"),
            (b"\0\0\0\x18ftypheic", "a HEIC image"),
            (b"\0\0\0\x20ftypisom", "a video"),
            (b"\xD0\xCF\x11\xE0\xA1\xB1\x1A\xE1", "an old Office, Visio or CAD file (OLE)"),
            (b"{\\rtf1\\ansi IN;SP1;PU0,0;PD100,0;}", "an RTF document"),
            (b"\xFF\xFEI\0N\0;\0", "text in UTF-16"),
            (b"M48\n;DRILL file\nMETRIC,TZ\n", "a drill file (Excellon)"),
            (b"solid cube\n facet normal 0 0 1\n  outer loop\n", "an STL model"),
            (b"ISO-10303-21;\nHEADER;\n", "a STEP model"),
            (b"From: a@b\nSubject: drawing\n\nIN;SP1;PU0,0;PD400,0;\n", "an e-mail"),
            (b"{\"a\": 1, \"b\": [1,2,3]}", "JSON"),
            (b"SM,100,10,10\rSP,1\rEM,1,1\r", "commands of an EBB (AxiDraw)"),
            (b"0,0\n10,0\n10,10\n", "a table of numbers"),
            (b"name,x,y\na,1,2\nb,2,3\n", "a table of numbers"),
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
            b"IN;SP1;PD\n100,200\n300,400\n",
            b"PA\n100,200\n300,400\n",
            b"\x1B%-12345X@PJL JOB\n@PJL ENTER LANGUAGE=PCL\n\x1BE\x1B%0BIN;",
            b"SP1;PU;PA0,0;PD;PA100,100",
            b"CO \"names, of, things\";IN;",
        ] {
            assert_eq!(what(bytes), None, "{}", bytes.escape_ascii());
        }
    }

    #[test]
    fn junk_outweighs_instructions_of_other_files() {
        assert_eq!(unlikely(3, 2, false), None);
        assert_eq!(unlikely(3, 4, false), Some(UNKNOWN));
        assert_eq!(unlikely(5, 15, true), None);
        assert_eq!(unlikely(5, 16, true), Some(UNKNOWN));
        assert_eq!(unlikely(0, 0, false), None);
    }
}
