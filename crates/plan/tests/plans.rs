//! Every plan format, held to the same promises: what is written is read back, what is cut off is noticed, nothing panics.

use std::collections::BTreeMap;

use plan::file::{self, PlanFormat, ReadError, csv, is_plan, json, tick_lines};
use plan::{Header, Limits, Motor, Rounding, Row, TickTable};
use proptest::prelude::*;

const FORMATS: [PlanFormat; 3] = [PlanFormat::Ticks, PlanFormat::Csv, PlanFormat::Json];

fn write(format: PlanFormat, table: &TickTable) -> Vec<u8> {
    let mut bytes = Vec::new();
    let rows = || table.rows.iter().copied();
    match format {
        PlanFormat::Ticks => tick_lines::write(&table.header, rows(), &mut bytes),
        PlanFormat::Csv => csv::write(&table.header, rows(), &mut bytes),
        PlanFormat::Json => json::write(&json::Document::default(), &table.header, rows, &mut bytes),
    }
    .expect("a sound table can be written");
    bytes
}

fn limits() -> impl Strategy<Value = Limits> {
    (0.001..1e6f64, 0.001..1e9f64, proptest::option::of(0.1..1e12f64))
        .prop_map(|(speed, acceleration, jerk)| Limits { speed, acceleration, jerk })
}

fn table() -> impl Strategy<Value = TickTable> {
    let row = (1..5_000_000u64, 0..9u16, -1_000_000_000..1_000_000_000i64, -99..99i64);
    let rows = proptest::collection::vec(row, 1..60);
    let placement = proptest::array::uniform6(-1e4..1e4f64);
    let overlap = prop_oneof![Just(0u64), 1..1_000_000u64];
    let rounding = prop_oneof![Just(Rounding::Nearest), Just(Rounding::Path)];
    let colors = proptest::collection::btree_map(1..9u16, any::<[u8; 3]>(), 0..4);
    (rows, placement, limits(), limits(), 1..10_000_000u64, (overlap, rounding), colors).prop_map(
        |(steps, placement, a, b, period_us, (lift_overlap_us, rounding), pen_colors)| {
            let mut t_us = 0;
            let rows: Vec<Row> = steps
                .into_iter()
                .enumerate()
                .map(|(index, (step, pen, x, y))| {
                    t_us += if index == 0 { 0 } else { step };
                    Row { t_us, pen: if index == 0 { 0 } else { pen }, ticks: [x, y] }
                })
                .collect();
            let motor = |name: &str, limits| Motor { name: name.into(), limits };
            let header = Header {
                machine: "mine".into(),
                motors: [motor("one", a), motor("two", b)],
                placement,
                period_us,
                lift_overlap_us,
                rounding,
                pen_colors,
                rows: rows.len() as u64,
                duration_us: t_us,
            };
            TickTable { header, rows }
        },
    )
}

fn small() -> TickTable {
    let limits = Limits { speed: 533.3, acceleration: 2666.7, jerk: None };
    let rows = [
        (0, 0, [800, 0]),
        (10_000, 0, [801, -1]),
        (20_000, 1, [803, -4]),
        (170_000, 1, [803, -4]),
        (180_000, 1, [804, -4]),
        (190_000, 0, [804, -5]),
        (340_000, 0, [804, -5]),
        (350_000, 0, [800, 0]),
    ]
    .map(|(t_us, pen, ticks)| Row { t_us, pen, ticks });
    let header = Header {
        machine: "coaxial".into(),
        motors: ["arm1", "arm2"].map(|name| Motor { name: name.into(), limits }),
        placement: [1.0, 0.0, 0.0, 1.0, 12.7, 76.2],
        period_us: 10_000,
        lift_overlap_us: 0,
        rounding: Rounding::Nearest,
        pen_colors: BTreeMap::new(),
        rows: rows.len() as u64,
        duration_us: 350_000,
    };
    TickTable { header, rows: rows.to_vec() }
}

proptest! {
    #[test]
    fn what_is_written_is_read_back(table in table()) {
        for format in FORMATS {
            let bytes = write(format, &table);
            prop_assert!(is_plan(&bytes));
            let file = file::read(&bytes).unwrap();
            prop_assert_eq!(file.format, format);
            prop_assert_eq!(&file.table, &table);
        }
    }

    #[test]
    fn lines_of_tick_plans_are_short_and_plain(table in table()) {
        let bytes = write(PlanFormat::Ticks, &table);
        for line in bytes.split(|byte| *byte == b'\n') {
            prop_assert!(line.len() <= tick_lines::LINE_BYTES);
            let command = line.split(|byte| *byte == b';').next().unwrap_or_default();
            prop_assert!(command.iter().all(|b| b.is_ascii_alphanumeric() || b" -".contains(b)));
            prop_assert!(line.iter().all(|b| (0x20..0x7F).contains(b)));
        }
    }

    #[test]
    fn any_bytes_are_read_without_panic(bytes in proptest::collection::vec(any::<u8>(), 0..300)) {
        let _ = (file::read(&bytes), csv::read(&bytes), tick_lines::read(&bytes), json::read(&bytes));
    }

    #[test]
    fn a_changed_byte_never_panics(at in 0..2000usize, byte: u8) {
        for format in FORMATS {
            let mut bytes = write(format, &small());
            let at = at % bytes.len();
            bytes[at] = byte;
            let _ = file::read(&bytes);
        }
    }
}

#[test]
fn a_plan_that_was_cut_off_is_never_taken_for_whole() {
    for format in FORMATS {
        let bytes = write(format, &small());
        let whole = bytes.iter().rposition(|byte| !byte.is_ascii_whitespace()).unwrap() + 1;
        for cut in 0..whole {
            assert!(file::read(&bytes[..cut]).is_err(), "{format:?} cut at byte {cut} of {whole}");
        }
    }
}

#[test]
fn carriage_returns_do_not_matter() {
    for format in FORMATS {
        let text = String::from_utf8(write(format, &small())).unwrap().replace('\n', "\r\n");
        assert_eq!(file::read(text.as_bytes()).unwrap().table, small(), "{format:?}");
    }
}

#[test]
fn drawings_are_no_plans() {
    for drawing in [&b"IN;SP1;PU0,0;PD400,0;"[..], b"", b"# a comment\nIN;", b"{\"format\": \"other\"}"] {
        assert!(!is_plan(drawing));
        assert!(matches!(file::read(drawing), Err(ReadError::NotAPlan)));
    }
}

#[test]
fn a_small_plan_in_every_format() {
    for (format, name) in FORMATS.into_iter().zip(["ticks", "csv", "json"]) {
        insta::assert_snapshot!(name, String::from_utf8(write(format, &small())).unwrap());
    }
}

/// The reference reader of docs/tick-lines.md, word for word in Rust: gives the instants it drives the motors to.
fn reference_reader(text: &str) -> Option<Vec<Row>> {
    let mut rows = Vec::new();
    let (mut moves, mut clock) = (0, 0);
    for line in text.lines() {
        let command = line.split(';').next().unwrap_or_default().trim();
        if command.is_empty() {
            continue;
        }
        let mut words = command.split(' ');
        let letter = words.next()?;
        let n: Vec<i64> = words.map(str::parse).collect::<Result<_, _>>().ok()?;
        match (letter, &n[..]) {
            ("begin", [1, _, _]) => (moves, clock) = (0, 0),
            ("s", [row, time, x, y]) => {
                if *row != moves || *time != clock {
                    return None;
                }
                if *row == 0 {
                    rows.push(Row { t_us: 0, pen: 0, ticks: [*x, *y] });
                }
            }
            ("m", [pen, duration, x, y]) => {
                rows.last_mut()?.pen = *pen as u16;
                moves += 1;
                clock += duration;
                rows.push(Row { t_us: clock as u64, pen: 0, ticks: [*x, *y] });
            }
            ("end", [pen, all, time]) => {
                rows.last_mut()?.pen = *pen as u16;
                return (*all == moves && *time == clock).then_some(rows);
            }
            _ => return None,
        }
    }
    None
}

proptest! {
    #[test]
    fn the_reference_reader_drives_every_row(table in table()) {
        let text = String::from_utf8(write(PlanFormat::Ticks, &table)).unwrap();
        prop_assert_eq!(reference_reader(&text).unwrap(), table.rows);
        let cut = &text[..text.rfind("end").unwrap()];
        prop_assert!(reference_reader(cut).is_none());
    }
}

#[test]
fn the_example_of_the_specification_is_what_is_written() {
    let specification = include_str!("../../../docs/tick-lines.md");
    let text = String::from_utf8(write(PlanFormat::Ticks, &small())).unwrap();
    assert!(
        specification.contains(&format!("```text\n{text}```")),
        "put this into docs/tick-lines.md:\n{text}"
    );
}
