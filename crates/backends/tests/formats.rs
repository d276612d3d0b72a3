//! What every backend writes for a small plan, and that docs/formats.md and docs/sending.md list them all.

use std::sync::Arc;

use backends::{Backend, EncodeOptions, PenActuator, PlanSource, RowIter, Unrepresentable, WriteError};
use drawing::{Drawing, EllipticArc, Pen, Point, Rect, Span, Stroke};
use kinematics::{
    Cartesian, JointKind, JointPos, JointRange, Machine, MachineParts, Mechanism, PenLimits, Polar,
};
use plan::{Header, Limits, Row};

type ExactRow = (Row, [f64; 2]);

/// To a stroke, along it, back: 50 ticks a mm, where the polar robot reaches too.
fn rows() -> Vec<ExactRow> {
    let rows = [
        (0, 0, [0, 5000]),
        (10_000, 0, [3, 4990]),
        (20_000, 0, [10, 4970]),
        (30_000, 1, [13, 4960]),
        (180_000, 1, [13, 4960]),
        (190_000, 1, [20, 4965]),
        (200_000, 1, [34, 4972]),
        (210_000, 0, [41, 4974]),
        (360_000, 0, [41, 4974]),
        (370_000, 0, [0, 5000]),
    ];
    rows.map(|(t_us, pen, ticks)| (Row { t_us, pen, ticks }, ticks.map(|ticks: i64| ticks as f64 + 0.25)))
        .to_vec()
}

/// A Cartesian machine with 50 ticks a mm, or a polar one with 1000 ticks a radian.
fn machine(mechanism: Arc<dyn Mechanism>) -> Machine {
    let first = if mechanism.joint_kinds()[0] == JointKind::Revolute { 1000.0 } else { 50.0 };
    let motor = |name: &str, ticks_per_unit: f64| kinematics::Motor {
        name: name.into(),
        ticks_per_unit,
        offset_ticks: 0.0,
        max_speed_ticks_s: 1e6,
        max_acceleration_ticks_s2: 1e6,
        max_jerk_ticks_s3: None,
        backlash_ticks: 0.0,
    };
    Machine::new(MachineParts {
        name: "small".into(),
        mechanism,
        joints: [JointRange::FREE; 2],
        min_manipulability: 0.0,
        coupling: [[1.0, 0.0], [0.0, 1.0]],
        motors: [motor("a", first), motor("b", 50.0)],
        pen: PenLimits {
            max_speed_mm_s: 25.0,
            max_travel_speed_mm_s: 80.0,
            lift_time_s: 0.15,
            drop_time_s: 0.15,
        },
        pen_servo: None,
        pen_offsets_mm: std::collections::BTreeMap::new(),
        homing: None,
        sheet: Rect::new(0.0, 0.0, 100.0, 100.0),
        start: JointPos::from([0.0, 0.0]),
        period_s: 0.01,
    })
    .expect("a sound machine")
}

fn header(rows: &[ExactRow], period_us: u64) -> Header {
    let limits = Limits { speed: 1e6, acceleration: 1e6, jerk: None };
    let motor = |name: &str| plan::Motor { name: name.into(), limits };
    Header {
        machine: "small".into(),
        motors: [motor("a"), motor("b")],
        placement: [1.0, 0.0, 0.0, 1.0, 0.0, 0.0],
        period_us,
        rows: rows.len() as u64,
        lift_overlap_us: 0,
        rounding: plan::Rounding::Nearest,
        pen_colors: std::collections::BTreeMap::new(),
        duration_us: rows.last().map_or(0, |(row, _)| row.t_us),
    }
}

/// A line and an arc.
fn drawing() -> Drawing {
    let mut stroke = Stroke::new(Pen(1), Point::new(0.0, 0.0), Span::default());
    stroke.line_to(Point::new(20.0, 0.0));
    stroke.arc(EllipticArc::circular(Point::new(10.0, 0.0), 10.0, 0.0, 1.5 * std::f64::consts::PI));
    Drawing::from(vec![stroke])
}

fn write(
    backend: &dyn Backend,
    machine: &Machine,
    rows: &[ExactRow],
    period_us: u64,
    encode: EncodeOptions,
    out: &mut Vec<u8>,
) -> Result<(), WriteError> {
    let (header, drawing) = (header(rows, period_us), drawing());
    let iterate = || -> RowIter<'_> { Box::new(rows.iter().copied()) };
    let source = PlanSource::new(&header, &iterate).on_machine(machine).of_drawing(&drawing);
    backend.write(&source, &encode, out)
}

/// What each format writes, by its name.
fn written() -> Vec<(&'static str, String)> {
    let encode = EncodeOptions {
        pen_actuator: Some(PenActuator::Servo),
        pen_positions: Some((40.0, 90.0)),
        legacy_moves: false,
        spare_mm: 0.0,
    };
    let formats = backends::ALL.iter().filter(|backend| backend.format_help().is_some());
    formats
        .map(|backend| {
            let polar = backend.name() == "joint-trajectory";
            let mechanism: Arc<dyn Mechanism> =
                if polar { Arc::new(Polar::default()) } else { Arc::new(Cartesian) };
            // The board's own pen setting in place of a servo's.
            let encode = if backend.name().starts_with("ebb") { EncodeOptions::default() } else { encode };
            let mut bytes = Vec::new();
            write(*backend, &machine(mechanism), &rows(), 10_000, encode, &mut bytes)
                .expect("a sound plan can be written");
            (backend.name(), String::from_utf8(bytes).expect("text").replace('\r', "\r\n"))
        })
        .collect()
}

#[test]
fn small_plan_in_every_format() {
    let all: Vec<String> = written()
        .into_iter()
        .filter(|(name, _)| *name != "ticks")
        .map(|(name, text)| format!("== {name}\n{}", text.replace("\r\n", "\n")))
        .collect();
    insta::assert_snapshot!(all.join("\n"));
}

/// The first cells of a page's table rows.
fn first_cells(page: &str) -> Vec<&str> {
    let cells = page.lines().filter_map(|line| line.strip_prefix("| `")?.split_once("` |"));
    cells.map(|(name, _)| name).filter(|name| !name.starts_with('-')).collect()
}

#[test]
fn formats_page_lists_every_backend_in_order() {
    let page = include_str!("../../../docs/formats.md");
    let (page, _) = page.split_once("## ").expect("a first chapter");
    let names = backends::ALL.iter().filter(|backend| backend.format_help().is_some());
    let names: Vec<&str> = names.map(|backend| backend.name()).collect();
    let listed: Vec<&str> = first_cells(page).into_iter().filter(|name| names.contains(name)).collect();
    assert_eq!(listed, names);
}

#[test]
fn formats_page_shows_lines_that_are_written() {
    let page = include_str!("../../../docs/formats.md");
    for (name, text) in written().into_iter().filter(|(name, _)| *name != "ticks") {
        let row = page.lines().find(|line| line.starts_with(&format!("| `{name}`")));
        let row = row.unwrap_or_else(|| panic!("docs/formats.md does not list {name}"));
        let example = row.trim_end_matches(['|', ' ']).rsplit(" | ").next().unwrap_or_default();
        let example = example.trim().trim_matches('`');
        assert!(
            text.lines().any(|line| line == example),
            "docs/formats.md: {name} does not write `{example}`:\n{text}"
        );
    }
}

#[test]
fn sending_page_lists_every_protocol() {
    let page = include_str!("../../../docs/sending.md");
    let (page, _) = page.split_once("## ").expect("a first chapter");
    let mut names: Vec<&str> =
        backends::ALL.iter().filter_map(|backend| backend.protocol()).map(|(name, _)| name).collect();
    let mut listed = first_cells(page);
    names.sort_unstable();
    listed.sort_unstable();
    assert_eq!(listed, names);
}

#[test]
fn unrepresentable_plans_are_refused_before_anything_is_written() {
    let mut out = Vec::new();
    let cartesian = machine(Arc::new(Cartesian));
    let mut refused = |name: &str, rows: &[ExactRow], period_us: u64| {
        let backend = backends::find(name).expect(name);
        match write(backend, &cartesian, rows, period_us, EncodeOptions::default(), &mut out) {
            Err(WriteError::Unrepresentable(why)) => why,
            other => panic!("{name}: {other:?}"),
        }
    };
    let mut far = rows();
    far[3].1[1] = 12_500.0;
    assert!(matches!(refused("xy-serial", &far, 10_000), Unrepresentable::Range { row: 3, .. }));
    let near: Vec<ExactRow> = rows().into_iter().map(|(row, _)| (row, [50.0, 1000.0])).collect();
    assert!(matches!(refused("c-arrays", &near, 10_000), Unrepresentable::Range { .. }));
    let mut twice = rows();
    twice.extend(
        rows().into_iter().skip(1).map(|(row, exact)| (Row { t_us: row.t_us + 370_000, ..row }, exact)),
    );
    assert!(matches!(refused("polar-csv", &twice, 10_000), Unrepresentable::NoPenLift { strokes: 2, .. }));
    let fast = [(0, [0, 0]), (10_000, [250, 0])];
    let fast = fast.map(|(t_us, ticks)| (Row { t_us, pen: 0, ticks }, ticks.map(|ticks| ticks as f64)));
    assert!(matches!(refused("ebb", &fast, 10_000), Unrepresentable::TooFast { steps: 250, .. }));
    let faster = [(0, [0, 0]), (100, [1600, 0])];
    let faster = faster.map(|(t_us, ticks)| (Row { t_us, pen: 0, ticks }, ticks.map(|ticks| ticks as f64)));
    assert!(matches!(
        refused("klipper-steps", &faster, 10_000),
        Unrepresentable::TooFast { steps: 1600, .. }
    ));
    assert!(matches!(refused("halstreamer", &rows(), 7000), Unrepresentable::Uneven { row: 1, .. }));
    assert!(out.is_empty(), "nothing is written of what is refused");
}
