//! The program that wrote a file, recognised by the beginning of the file.

/// How far into the file a beginning goes.
const BEGINNING: usize = 600;

/// A program, and the byte strings that the beginnings of its files contain, the first of them at
/// the very start where `starts` is set.
struct Producer {
    name: &'static str,
    starts: bool,
    marks: &'static [&'static [u8]],
}

const PRODUCERS: &[Producer] = &[
    Producer { name: "gnuplot", starts: true, marks: &[b"\x1b.Y\n\x1b.I81;;17:\x1b.N;19:\x1b.M500:"] },
    Producer { name: "gnuplot (PCL)", starts: false, marks: &[b"\x1b%0BIN", b"NP8", b"SP1SD1,277,2,1"] },
    Producer { name: "Inkscape", starts: true, marks: &[b"IN;PU;SP1;PU"] },
    Producer { name: "vpype", starts: true, marks: &[b"IN;DF;PS"] },
    Producer { name: "vpype", starts: true, marks: &[b"IN;DF;SP"] },
    Producer { name: "plotutils", starts: false, marks: &[b"BP;IN;PS", b";SC0,10000,0,10000;", b"SP1;"] },
    Producer { name: "plotutils", starts: true, marks: &[b"IN;", b"IP0,0,8128,8128;SC0,10000,0,10000;"] },
    Producer { name: "fig2dev", starts: false, marks: &[b"BP;IN;\n", b"\nIW0,0,", b";\nLT"] },
    Producer { name: "pstoedit", starts: false, marks: &[b"IN;SC;PU;SP1;LT;\nPW"] },
    Producer { name: "CorelDRAW", starts: false, marks: &[b"VS32,1;", b"WU0;"] },
    Producer { name: "AutoCAD", starts: false, marks: &[b"\x1b.I81;;17:\x1b.N;19:IN;SC;PU;PU;SP1;LT;VS"] },
    Producer { name: "AutoCAD", starts: false, marks: &[b"BPINPS", b"LA1,4,2,4"] },
    Producer { name: "KiCad", starts: true, marks: &[b"IN;VS", b";PU;PA;SP1;"] },
    Producer { name: "an HP printer driver", starts: false, marks: &[b"@PJL", b"BPIN"] },
    Producer { name: "an instrument on its bus", starts: true, marks: &[b"OP;"] },
];

/// The program that the file looks like; `None` if it matches none of those known.
///
/// This is a hint for people: nothing is read differently because of it.
pub fn producer(bytes: &[u8]) -> Option<&'static str> {
    let beginning = &bytes[..bytes.len().min(BEGINNING)];
    let has = |mark: &[u8]| beginning.windows(mark.len()).any(|piece| piece == mark);
    let fits = |producer: &&Producer| match producer.marks {
        [first, rest @ ..] if producer.starts => beginning.starts_with(first) && rest.iter().all(|m| has(m)),
        marks => marks.iter().all(|mark| has(mark)),
    };
    PRODUCERS.iter().find(fits).map(|producer| producer.name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn producer_recognition() {
        let begins = |text: &str| producer(text.as_bytes());
        assert_eq!(begins("IN;DF;PS4;SP1;PU100,100;"), Some("vpype"));
        assert_eq!(begins("IN;PU;SP1;PU0,0;PD0,90;"), Some("Inkscape"));
        assert_eq!(
            begins("\x1bE\x1b%0BBP;IN;PS11379;IP0,0,9,9;SC0,10000,0,10000;WU1;SP1;"),
            Some("plotutils")
        );
        assert_eq!(begins("IN;\nVS32,1;\nVS32,2;\nWU0;\n"), Some("CorelDRAW"));
        assert_eq!(begins("IN;VS40;PU;PA;SP1;\n"), Some("KiCad"));
        assert_eq!(begins("IN;SP1;PU0,0;PD400,0;"), None);
        assert_eq!(begins(""), None);
    }
}
