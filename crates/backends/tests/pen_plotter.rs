//! Drawings on pen plotters: what is written, how it reads back, how it is sent.

#![allow(clippy::unwrap_used, reason = "drawings made here are sound")]

use std::f64::consts::PI;
use std::sync::Arc;

use backends::pen_plotter::plotter::{Plotter, Sheet, plotters};
use backends::pen_plotter::{PlotterLimit, encode};
use backends::{Backend, EmulatorOptions, Fault, FaultInjector, Outcome, Program, SessionOptions, simulate};
use drawing::{Affine, Drawing, EllipticArc, Pen, Point, Rect, Span, Stroke, Vec2};
use proptest::prelude::*;
use test_support::Random;

const HOUR_US: u64 = 3_600_000_000;

fn sheets() -> Vec<Sheet<'static>> {
    let mut sheets = Vec::new();
    for plotter in plotters() {
        for paper in &plotter.papers {
            sheets.extend([false, true].map(|turned| Sheet { plotter, paper, turned }));
        }
    }
    sheets
}

fn text(drawing: &Drawing, sheet: &Sheet<'_>) -> Vec<u8> {
    let lines = encode(drawing, sheet).unwrap();
    lines.iter().flat_map(|line| line.text.bytes()).collect()
}

/// What our own reader makes of it, in mm on the sheet.
fn read_back(bytes: &[u8], sheet: &Sheet<'_>) -> Drawing {
    let clip = sheet.paper.hard_clip.map(|units| units as f64);
    let options = hpgl::Options {
        plotter_unit_mm: 1.0,
        hard_clip: Rect::new(clip[0], clip[1], clip[2], clip[3]),
        automatic: false,
        ..hpgl::Options::default()
    };
    let document = hpgl::read(bytes, &options);
    let mut drawing = document.pages.into_iter().next().unwrap().drawing;
    drawing.transform(sheet.to_units().inverse());
    drawing
}

/// The largest distance of points of `a` from `b`, mm.
fn one_way(a: &[Point], b: &[Point]) -> f64 {
    let to_segment = |p: Point, from: Point, to: Point| {
        let (way, arm) = (to - from, p - from);
        let t = if way.hypot2() > 0.0 { (arm.dot(way) / way.hypot2()).clamp(0.0, 1.0) } else { 0.0 };
        (p - (from + t * way)).hypot()
    };
    let nearest = |p: Point| {
        let dot = (p - b[0]).hypot();
        b.windows(2).map(|pair| to_segment(p, pair[0], pair[1])).fold(dot, f64::min)
    };
    a.iter().map(|p| nearest(*p)).fold(0.0, f64::max)
}

fn deviation(a: &Stroke, b: &Stroke) -> f64 {
    let (a, b) = (a.flatten(5e-4), b.flatten(5e-4));
    one_way(&a, &b).max(one_way(&b, &a))
}

/// A stroke within the area: lines, arcs and curves.
fn stroke(random: &mut Random, area: Rect, pens: u16) -> Stroke {
    let inner = area.inflate(-0.3 * area.width().min(area.height()), -0.3 * area.width().min(area.height()));
    let mut point = || Point::new(random.between(inner.x0, inner.x1), random.between(inner.y0, inner.y1));
    let points = [point(), point(), point(), point()];
    let mut stroke = Stroke::new(Pen(1 + random.below(u64::from(pens)) as u16), points[0], Span::default());
    for _ in 0..random.below(5) {
        let end = stroke.end();
        match random.below(4) {
            0 => stroke.line_to(points[random.below(4) as usize]),
            1 => stroke.cubic_to(points[1], points[2], points[3]),
            _ => {
                let radius = random.between(0.2, 0.25 * inner.width().min(inner.height()));
                let start = random.between(-PI, PI);
                let center = end - radius * Vec2::from_angle(start);
                if inner.inflate(radius, radius).contains(center) {
                    let sweep =
                        if random.below(4) == 0 { 2.0 * PI } else { random.between(-2.0 * PI, 2.0 * PI) };
                    stroke.arc(EllipticArc::circular(center, radius, start, sweep));
                }
            }
        }
    }
    // Arcs may lead out: clipped by leaving such strokes as they began.
    if area.union(stroke.bounding_box()) == area {
        stroke
    } else {
        Stroke::new(stroke.pen, points[0], Span::default())
    }
}

fn random_drawing(seed: u64, sheet: &Sheet<'_>, strokes: u64) -> Drawing {
    let mut random = Random(seed);
    let area = sheet.area_mm();
    Drawing { strokes: (0..strokes).map(|_| stroke(&mut random, area, sheet.plotter.pens)).collect() }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn output_reads_back_within_one_plotter_unit(seed in any::<u64>(), which in any::<prop::sample::Index>()) {
        let sheets = sheets();
        let sheet = *which.get(&sheets);
        let drawing = random_drawing(seed, &sheet, 12);
        let back = read_back(&text(&drawing, &sheet), &sheet);
        prop_assert_eq!(drawing.strokes.len(), back.strokes.len());
        for (wanted, drawn) in drawing.strokes.iter().zip(&back.strokes) {
            prop_assert_eq!(wanted.pen, drawn.pen);
            let off = deviation(&wanted, &drawn) / sheet.plotter.unit_mm;
            let what = || format!("{} {} {:?} {:?}", sheet.plotter.name, sheet.paper.name, wanted, drawn);
            prop_assert!(off <= 1.0, "{} units off: {}", off, what());
        }
    }
}

#[test]
fn instructions_suit_the_plotter() {
    let mut arcs = 0;
    for sheet in sheets() {
        let Sheet { plotter, paper, .. } = sheet;
        let drawing = random_drawing(3, &sheet, 60);
        for line in encode(&drawing, &sheet).unwrap() {
            let what = format!("{} {}: {}", plotter.name, paper.name, line.text.escape_debug());
            if line.text.starts_with('\u{1b}') || line.text.starts_with("PS") {
                continue;
            }
            assert!(plotter.knows(&line.text[..2]), "{what}");
            assert!(line.text.len() <= plotter.line_bytes(), "{what}");
            arcs += u32::from(line.text.starts_with("AA"));
            if line.text.starts_with("PU") || line.text.starts_with("PD") {
                let list = line.text[2..].trim_end_matches(';');
                let numbers: Vec<i64> = list.split(',').filter_map(|number| number.parse().ok()).collect();
                let [left, bottom, right, top] = paper.hard_clip;
                let inside =
                    |pair: &[i64]| (left..=right).contains(&pair[0]) && (bottom..=top).contains(&pair[1]);
                assert!(numbers.chunks(2).all(inside), "{what}");
            }
        }
    }
    assert!(arcs > 100, "{arcs} arcs stay arcs");
}

#[test]
fn ink_off_the_paper_and_missing_pens_are_refused() {
    let plotter = Plotter::named("hp7475a").unwrap();
    let sheet = Sheet::named(plotter, Some("a4")).unwrap();
    let area = sheet.area_mm();
    let at = |x: f64, y: f64, pen: u16| Drawing {
        strokes: vec![Stroke::new(Pen(pen), Point::new(x, y), Span::default())].into(),
    };
    // The corners themselves are reached.
    assert!(encode(&at(0.0, 0.0, 1), &sheet).is_ok());
    assert!(encode(&at(area.x1, area.y1, 6), &sheet).is_ok());
    assert!(matches!(encode(&at(-0.02, 5.0, 1), &sheet), Err(PlotterLimit::OffPaper { stroke: 1, .. })));
    assert!(matches!(encode(&at(5.0, area.y1 + 0.02, 1), &sheet), Err(PlotterLimit::OffPaper { .. })));
    assert!(matches!(encode(&at(f64::NAN, 5.0, 1), &sheet), Err(PlotterLimit::OffPaper { .. })));
    assert_eq!(
        encode(&at(5.0, 5.0, 7), &sheet).unwrap_err().to_string(),
        "the drawing uses pen 7; hp7475a holds pens 1 to 6"
    );
    // An arc that leaves the paper between its ends.
    let mut stroke = Stroke::new(Pen(1), Point::new(20.0, 5.0), Span::default());
    stroke.arc(EllipticArc::circular(Point::new(10.0, 5.0), 10.0, 0.0, PI));
    stroke.transform(Affine::rotate_about(PI, Point::new(15.0, 5.0)));
    assert!(matches!(encode(&Drawing::from(vec![stroke]), &sheet), Err(PlotterLimit::OffPaper { .. })));
}

fn backend() -> &'static dyn Backend {
    backends::find("hpgl").unwrap()
}

fn device() -> Box<dyn backends::Device> {
    backend().emulator(&EmulatorOptions::default()).unwrap()
}

fn named(name: &str) -> SessionOptions {
    SessionOptions {
        plotter: Some(Arc::new(Plotter::named(name).unwrap().clone())),
        ..SessionOptions::default()
    }
}

/// Sends a program with faults: how it ended, and the machine.
fn send(
    program: &Program,
    options: &SessionOptions,
    faults: Vec<Fault>,
    stop_us: Option<u64>,
) -> (Option<Outcome>, FaultInjector, u64) {
    let mut machine = FaultInjector::new(device(), faults);
    let mut session = backend().session(program.clone(), options).unwrap();
    let ended = simulate::run(&mut *session, &mut machine, 0, stop_us, 10 * HOUR_US);
    (ended.outcome, machine, ended.at_us)
}

fn failure(outcome: Option<Outcome>) -> String {
    match outcome {
        Some(Outcome::Failed { why, .. }) => why,
        other => panic!("{other:?}"),
    }
}

/// Arcs, curves, dots, six pens.
fn job() -> (Drawing, Sheet<'static>, Program) {
    let sheet = Sheet::named(Plotter::named("hp7475a").unwrap(), Some("a4")).unwrap();
    let mut drawing = random_drawing(11, &sheet, 14);
    let mut strokes = drawing.strokes.to_vec();
    strokes.sort_by_key(|stroke| stroke.pen);
    drawing.strokes = strokes.into();
    let program = backend().parse_program(&text(&drawing, &sheet)).unwrap();
    (drawing, sheet, program)
}

/// Whether the ink is the drawing, once, within one plotter unit.
fn assert_drawn(machine: &FaultInjector, drawing: &Drawing, sheet: &Sheet<'_>, what: &str) {
    let ink = machine.device().ink().lines();
    // Strokes that meet with the same pen are one line of ink.
    let strokes = drawing.strokes.iter().fold(Vec::<Stroke>::new(), |mut all, stroke| {
        all.push(stroke.clone());
        all
    });
    assert_eq!(ink.len(), strokes.len(), "{what}");
    for ((pen, points), stroke) in ink.iter().zip(&strokes) {
        assert_eq!(*pen, stroke.pen.0, "{what}");
        let points: Vec<Point> = points.iter().map(|[x, y]| Point::new(*x, *y)).collect();
        let mut drawn = Stroke::polyline(stroke.pen, points, Span::default()).unwrap();
        drawn.transform(sheet.to_units().inverse());
        let off = deviation(stroke, &drawn) / sheet.plotter.unit_mm;
        assert!(off <= 1.0, "{what}: {off} units off");
        let (wanted, length) = (stroke.length(), drawn.length());
        assert!(length <= wanted * 1.01 + 0.2, "{what}: {length} mm of ink for {wanted} mm");
    }
}

#[test]
fn emulated_ink_is_the_drawing_in_all_faults() {
    let (drawing, sheet, program) = job();
    let (outcome, machine, whole_us) = send(&program, &SessionOptions::default(), Vec::new(), None);
    assert_eq!(outcome, Some(Outcome::Done));
    assert_drawn(&machine, &drawing, &sheet, "no fault");
    let mut random = Random(5);
    for k in 0..60 {
        let at = random.below(whole_us);
        let fault = match k % 6 {
            0 => Fault::LostAnswer(random.below(300)),
            1 => Fault::LateAnswer(random.below(300), random.below(5_300_000)),
            2 => Fault::GarbledAnswer(random.below(300)),
            3 => Fault::FullBuffer(at, random.below(6_000_000)),
            // VIEW for minutes.
            4 => Fault::Held(at, random.below(300_000_000)),
            _ => Fault::Unplugged(at, random.below(20_000_000)),
        };
        let what = format!("{fault:?}");
        let (outcome, machine, _) = send(&program, &SessionOptions::default(), vec![fault], None);
        assert_eq!(outcome, Some(Outcome::Done), "{what}");
        assert_eq!(machine.device().lost_bytes(), 0, "{what}");
        assert_drawn(&machine, &drawing, &sheet, &what);
    }
}

#[test]
fn stopped_at_a_stroke_and_resumed() {
    let (drawing, sheet, program) = job();
    let (_, _, whole_us) = send(&program, &SessionOptions::default(), Vec::new(), None);
    let mut cut = 0;
    for k in 1..20 {
        let what = format!("stopped at {k}/20");
        let (outcome, machine, _) =
            send(&program, &SessionOptions::default(), Vec::new(), Some(whole_us * k / 20));
        let Some(Outcome::Stopped { row }) = outcome else { panic!("{what}: {outcome:?}") };
        assert!(!machine.device().pen_is_down(), "{what}");
        let drawn = machine.device().ink().clone();
        // A long stroke is cut, and drawn again.
        let lines = drawn.lines().len() as u64;
        assert!(lines == row || lines == row + 1, "{what}: {lines} lines, {row} strokes");
        cut += u32::from(lines > row);
        let rest = program.from_row(row, None).unwrap();
        let (outcome, machine, _) = send(&rest, &SessionOptions::default(), Vec::new(), None);
        assert_eq!(outcome, Some(Outcome::Done), "{what}");
        let rest = Drawing { strokes: drawing.strokes.iter().skip(row as usize).collect() };
        assert_drawn(&machine, &rest, &sheet, &what);
    }
    assert!(cut < 19, "all strokes are cut");
}

#[test]
fn power_cut_is_reported() {
    let (_, _, program) = job();
    let faults = vec![Fault::Unplugged(20_000_000, 5_000_000), Fault::PowerCut(22_000_000)];
    let why = failure(send(&program, &SessionOptions::default(), faults, None).0);
    assert!(why.contains("switched off or reset"), "{why}");
}

#[test]
fn disagreeing_limits_models_and_instructions_are_refused() {
    let program = |text: &str| backend().parse_program(text.as_bytes()).unwrap();
    let a3 = program("IN;SP1;PU100,100;PD15000,100;PU;SP0;");
    let (outcome, machine, _) = send(&a3, &SessionOptions::default(), Vec::new(), None);
    let why = failure(outcome);
    assert!(
        why.contains(
            "needs 100,100 to 15000,100 plotter units, and it reports the limits (OH) 0,0 to 11040,7721"
        ),
        "{why}"
    );
    assert!(machine.device().ink().lines().is_empty());
    // With the paper selected it fits the plotter, whose answer was that of before.
    let why = failure(send(&a3, &named("hp7550a"), Vec::new(), None).0);
    assert!(why.contains("the plotter calls itself 7475A; hp7550a is 7550A"), "{why}");
    let why =
        failure(send(&program("IN;SP1;PM0;PD1,1;PM2;"), &SessionOptions::default(), Vec::new(), None).0);
    assert!(why.contains("HP 7475A does not know the instruction PM (stroke 0)"), "{why}");
    // Scaled: P1 and P2 are asked for.
    let scaled = program("IN;SC0,100,0,100;SP1;PU10,10;PD90,90;PU;");
    assert_eq!(send(&scaled, &named("hp7475a"), Vec::new(), None).0, Some(Outcome::Done));
    let scaled = program("IN;SC0,100,0,100;SP1;PU10,10;PD190,90;PU;");
    assert!(failure(send(&scaled, &named("hp7475a"), Vec::new(), None).0).contains("(OH)"));
}

#[test]
fn errors_of_instructions_are_explained_at_the_end() {
    let program = backend().parse_program(b"IN;SP1;PU100,100;PD200,100;VS200;PU;").unwrap();
    let why = failure(send(&program, &SessionOptions::default(), Vec::new(), None).0);
    assert!(why.contains("reports error 3 (OE): parameter out of range"), "{why}");
}

#[test]
fn resumed_file_restores_pen_speed_scaling_and_position() {
    let file = b"IN;SP2;VS10;IP1000,1000,5000,5000;SC0,10,0,10;PU1,1;PD9,1;PU;PU1,2;PD9,2;PU;PR;PU0,1;PD-8,0;PU;SP1;PA;PU5,5;PD6,6;PU;SP0;";
    let program = backend().parse_program(file).unwrap();
    let whole = read_units(&program);
    assert_eq!(whole.strokes.len(), 4);
    for row in 0..4 {
        let rest = program.from_row(row, None).unwrap();
        let texts: Vec<&str> = rest.lines.iter().map(|line| line.text.as_str()).collect();
        let back = read_units(&rest);
        assert_eq!(back.strokes.len(), 4 - row as usize, "{texts:?}");
        for (wanted, drawn) in whole.strokes.iter().skip(row as usize).zip(&back.strokes) {
            assert_eq!(
                (wanted.pen, wanted.start(), wanted.end()),
                (drawn.pen, drawn.start(), drawn.end()),
                "{texts:?}"
            );
        }
        assert!(row == 0 || texts.contains(&"VS10;"), "{texts:?}");
    }
    assert!(program.from_row(9, None).is_err());
}

/// The program's drawing in plotter units.
fn read_units(program: &Program) -> Drawing {
    let bytes: Vec<u8> = program.lines.iter().flat_map(|line| line.text.bytes()).collect();
    let options = hpgl::Options { plotter_unit_mm: 1.0, ..hpgl::Options::default() };
    hpgl::read(&bytes, &options).pages.into_iter().next().unwrap().drawing
}
