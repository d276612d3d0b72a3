//! Independent replay of plans. The CSV reader and the forward kinematics are written here, from
//! the equations of the machine reports (docs/references.md) and of the machine files in
//! tests/machines/, so that the test shares no code with the planner, the machine model or the
//! verifier. For the drawings of the repository and for random ones it checks the deviation in both
//! directions, the limits of speed, acceleration and jerk, the joint ranges, start and end, and the
//! pen times.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use assert_cmd::cargo::cargo_bin;
use tempfile::TempDir;
use test_support::Random;

type Point = [f64; 2];
/// Polylines of each pen, mm; a polyline of one point is a dot.
type Ink = BTreeMap<i64, Vec<Vec<Point>>>;

/// The default of `--tolerance`, mm.
const TOLERANCE: f64 = 0.1;
/// Smallest step between two samples along a line, mm.
const STEP: f64 = 0.02;

/// Largest speed, acceleration and jerk of a motor, ticks/s, ticks/s², ticks/s³; jerk may be
/// infinite.
type Limits = [f64; 3];

/// A machine, described independently of its machine file.
struct Machine {
    name: &'static str,
    /// The machine file; `None` for presets.
    file: Option<&'static str>,
    /// Limits of the motors; `None`: those of the plan's header.
    limits: Option<[Limits; 2]>,
    motors: [&'static str; 2],
    /// Pen position from motor positions.
    forward: fn([f64; 2]) -> Point,
    start: [i64; 2],
    /// Lift time and drop time, us.
    pen_us: i64,
    /// Time between rows, us.
    period_us: i64,
    /// x0, y0, x1, y1.
    sheet: [f64; 4],
    /// Whether the joints are in their range, give or take half a tick of each motor.
    allowed: fn([f64; 2]) -> bool,
}

fn distance(a: Point, b: Point) -> f64 {
    libm::hypot(a[0] - b[0], a[1] - b[1])
}

fn within(value: f64, low: f64, high: f64, slack: f64) -> bool {
    value >= low - slack && value <= high + slack
}

/// Coaxial arm (report 1): x = L1 cos th1 + L2 cos(th1 - th2), y likewise; counts 3200/360 th1 and
/// 3200/360 (th2 - th1 + 90).
fn coaxial_angles([arm1, arm2]: [f64; 2]) -> [f64; 2] {
    let th1 = arm1 * 360.0 / 3200.0;
    [th1, arm2 * 360.0 / 3200.0 + th1 - 90.0]
}

fn coaxial(ticks: [f64; 2]) -> Point {
    let [th1, th2] = coaxial_angles(ticks);
    let (sin1, cos1) = libm::sincos(th1.to_radians());
    let (sin12, cos12) = libm::sincos((th1 - th2).to_radians());
    [206.0 * cos1 + 256.0 * cos12, 206.0 * sin1 + 256.0 * sin12]
}

/// CoreXY worktable (report 3): A = X + Y, B = X - Y, times the encoder ratio.
fn corexy([a, b]: [f64; 2]) -> Point {
    let enc_ratio = 171.79 * 24.0 / (14.26 * std::f64::consts::PI);
    [0.5 * (a + b) / enc_ratio, 0.5 * (a - b) / enc_ratio]
}

/// H-bot plotter (report 2), equations (1) and (2).
fn hbot([l, r]: [f64; 2]) -> Point {
    [(l - r + 3100.0) * 250.0 / 6200.0, (l + r - 3100.0) * 250.0 / 6200.0]
}

/// Polar robot (report 4): 544 to 2400 us are theta = 0 to 180 degrees, 44 mm are a turn of the
/// pinion; theta = atan(x / y) + 90.
fn polar([us, degrees]: [f64; 2]) -> Point {
    let theta = (us - 544.0) * 180.0 / (2400.0 - 544.0);
    let r = 138.0 + degrees * 44.0 / 360.0;
    let (sin, cos) = libm::sincos((theta - 90.0).to_radians());
    [r * sin, r * cos]
}

/// Two links with absolute angles in degrees.
fn links([l1, l2]: [f64; 2], [theta, psi]: [f64; 2]) -> Point {
    let (sin1, cos1) = libm::sincos(theta.to_radians());
    let (sin2, cos2) = libm::sincos(psi.to_radians());
    [l1 * cos1 + l2 * cos2, l1 * sin1 + l2 * sin2]
}

/// tests/machines/corexy-jerk.toml: A = x + y, B = x - y, 80 ticks/mm.
fn corexy_jerk([a, b]: [f64; 2]) -> Point {
    [(a + b) / 160.0, (a - b) / 160.0]
}

/// tests/machines/right-elbow.toml: theta and psi, 4096 ticks a turn.
fn right_elbow_angles(ticks: [f64; 2]) -> [f64; 2] {
    ticks.map(|ticks| ticks * 360.0 / 4096.0)
}

fn right_elbow(ticks: [f64; 2]) -> Point {
    links([150.0, 120.0], right_elbow_angles(ticks))
}

/// tests/machines/belt-ratio.toml: -3000 ticks a turn of theta, -5000 a turn of (theta + psi) / 2.
fn belt_ratio_angles([shoulder, elbow]: [f64; 2]) -> [f64; 2] {
    let theta = (shoulder - 250.0) * 360.0 / -3000.0;
    let mean = (elbow + 100.0) * 360.0 / -5000.0;
    [theta, 2.0 * mean - theta]
}

fn belt_ratio(ticks: [f64; 2]) -> Point {
    links([180.0, 140.0], belt_ratio_angles(ticks))
}

const NO_JERK_LIMIT: f64 = f64::INFINITY;

/// Machines of tests/machines/, for what no preset has: jerk limits, an elbow on the right, a belt
/// ratio other than 1, negative counts.
const FILES: [Machine; 3] = [
    Machine {
        name: "corexy-jerk",
        file: Some("corexy-jerk.toml"),
        limits: Some([[8e3, 8e4, 1.6e6]; 2]),
        motors: ["A", "B"],
        forward: corexy_jerk,
        start: [0, 0],
        pen_us: 100_000,
        period_us: 10_000,
        sheet: [0.0, 0.0, 200.0, 200.0],
        allowed: |ticks| corexy_jerk(ticks).iter().all(|x| within(*x, 0.0, 200.0, 0.007)),
    },
    Machine {
        name: "right-elbow",
        file: Some("right-elbow.toml"),
        limits: Some([[60.0 * 4096.0 / 360.0, 300.0 * 4096.0 / 360.0, NO_JERK_LIMIT]; 2]),
        motors: ["first", "second"],
        forward: right_elbow,
        start: [512, 1536],
        pen_us: 100_000,
        period_us: 10_000,
        sheet: [60.0, 60.0, 180.0, 160.0],
        // The elbow is on the right if the second link is folded counterclockwise.
        allowed: |ticks| {
            let [theta, psi] = right_elbow_angles(ticks);
            within(psi - theta, 0.0, 180.0, 0.09)
        },
    },
    Machine {
        name: "belt-ratio",
        file: Some("belt-ratio.toml"),
        limits: Some([
            [60.0 * 3000.0 / 360.0, 300.0 * 3000.0 / 360.0, NO_JERK_LIMIT],
            [60.0 * 5000.0 / 360.0, 300.0 * 5000.0 / 360.0, NO_JERK_LIMIT],
        ]),
        motors: ["shoulder", "elbow"],
        forward: belt_ratio,
        start: [-750, -1100],
        pen_us: 100_000,
        period_us: 10_000,
        sheet: [-60.0, 140.0, 60.0, 260.0],
        // The elbow is on the left if the second link is folded clockwise.
        allowed: |ticks| {
            let [theta, psi] = belt_ratio_angles(ticks);
            within(theta - psi, 0.0, 180.0, 0.2)
        },
    },
];

/// The presets that come from machine reports.
const PRESETS: [Machine; 4] = [
    Machine {
        name: "coaxial",
        file: None,
        limits: None,
        motors: ["arm1", "arm2"],
        forward: coaxial,
        start: [800, 0],
        pen_us: 150_000,
        period_us: 10_000,
        sheet: [12.7, 76.2, 12.7 + 215.9, 76.2 + 279.4],
        // The elbow stays on its side: the fold is 0 to 180 degrees; a tick of each motor is
        // 0.1125.
        allowed: |ticks| within(coaxial_angles(ticks)[1], 0.0, 180.0, 0.12),
    },
    Machine {
        name: "corexy",
        file: None,
        limits: None,
        motors: ["A", "B"],
        forward: corexy,
        start: [0, 0],
        pen_us: 150_000,
        period_us: 10_000,
        sheet: [0.0, 0.0, 200.0, 200.0],
        allowed: |ticks| corexy(ticks).iter().all(|x| within(*x, 0.0, 200.0, 0.006)),
    },
    Machine {
        name: "hbot",
        file: None,
        limits: None,
        motors: ["L", "R"],
        forward: hbot,
        start: [0, 3100],
        pen_us: 100_000,
        period_us: 10_000,
        sheet: [0.0, 0.0, 250.0, 250.0],
        allowed: |ticks| hbot(ticks).iter().all(|x| within(*x, 0.0, 250.0, 0.041)),
    },
    Machine {
        name: "polar",
        file: None,
        limits: None,
        motors: ["theta", "r"],
        forward: polar,
        start: [1472, 0],
        pen_us: 150_000,
        period_us: 20_000,
        sheet: [-138.0, 0.0, 138.0, 138.0],
        allowed: |[us, degrees]| {
            within(us, 544.0, 2400.0, 0.5) && within(degrees, (48.0 - 138.0) * 360.0 / 44.0, 0.0, 0.5)
        },
    },
];

/// A CSV plan as documented in docs/formats.md.
struct Plan {
    placement: [f64; 6],
    limits: [Limits; 2],
    rows: Vec<Row>,
}

#[derive(Clone, Copy)]
struct Row {
    t_us: i64,
    pen: i64,
    ticks: [i64; 2],
}

fn numbers<const N: usize>(text: &str) -> [f64; N] {
    let parsed: Vec<f64> = text.split_whitespace().map(|word| word.parse().expect("a number")).collect();
    parsed.try_into().expect("the number of values")
}

impl Plan {
    fn parse(csv: &str, machine: &Machine) -> Self {
        let mut lines = csv.lines();
        let comments: BTreeMap<&str, &str> = lines
            .by_ref()
            .map_while(|line| line.strip_prefix("# "))
            .map(|line| line.split_once(": ").expect("a key and a value"))
            .collect();
        assert_eq!((comments["plotplan"], comments["machine"]), ("1", machine.name));
        // The iterator has consumed the line after the comments.
        let head = csv.lines().nth(comments.len()).expect("column names");
        assert_eq!(head, format!("t_us,pen,{},{}", machine.motors[0], machine.motors[1]));
        let row = |line: &str| {
            let fields: Vec<i64> =
                line.split(',').map(|field| field.parse().expect("a whole number")).collect();
            let [t_us, pen, first, second] = fields[..] else { panic!("four columns: {line}") };
            Row { t_us, pen, ticks: [first, second] }
        };
        let stated = machine.motors.map(|motor| {
            let text = comments[format!("limits {motor}").as_str()];
            let count = text.split_whitespace().count();
            assert_eq!(count == 3, machine.limits.is_some_and(|limits| limits[0][2].is_finite()), "{text}");
            if count == 3 {
                numbers(text)
            } else {
                let [speed, acceleration] = numbers(text);
                [speed, acceleration, NO_JERK_LIMIT]
            }
        });
        Self {
            placement: numbers(comments["placement"]),
            limits: machine.limits.unwrap_or(stated),
            rows: lines.map(row).collect(),
        }
    }

    /// Drawing mm to machine mm.
    fn place(&self, [x, y]: Point) -> Point {
        let [a, b, c, d, e, f] = self.placement;
        [a * x + c * y + e, b * x + d * y + f]
    }

    fn scale(&self) -> f64 {
        libm::hypot(self.placement[0], self.placement[1])
    }

    /// The ink: motors move linearly from row to row; chords of at most 0.2 mm.
    fn ink(&self, machine: &Machine) -> Ink {
        let mut ink = Ink::new();
        let mut pen = 0;
        for pair in self.rows.windows(2) {
            let [from, to] = [pair[0], pair[1]].map(|row| row.ticks.map(|ticks| ticks as f64));
            if pair[0].pen == 0 {
                pen = 0;
                continue;
            }
            let lines = ink.entry(pair[0].pen).or_default();
            if pen != pair[0].pen {
                pen = pair[0].pen;
                lines.push(vec![(machine.forward)(from)]);
            }
            let parts = (distance((machine.forward)(from), (machine.forward)(to)) / 0.2).ceil();
            for part in 1..=parts as i64 {
                let share = part as f64 / parts;
                let ticks = [0, 1].map(|motor| from[motor] + share * (to[motor] - from[motor]));
                lines.last_mut().expect("just begun").push((machine.forward)(ticks));
            }
        }
        ink
    }

    /// The largest displacement of the pen by half a tick of both motors, where it draws, mm.
    fn quantization_error(&self, machine: &Machine) -> f64 {
        let off = |row: &Row, by: [f64; 2]| {
            let ticks = row.ticks.map(|ticks| ticks as f64);
            distance((machine.forward)(ticks), (machine.forward)([ticks[0] + by[0], ticks[1] + by[1]]))
        };
        let corners = [[0.5, 0.5], [0.5, -0.5], [-0.5, 0.5], [-0.5, -0.5]];
        let drawn = self.rows.iter().filter(|row| row.pen > 0);
        drawn.flat_map(|row| corners.map(|by| off(row, by))).fold(0.0, f64::max)
    }
}

/// Reads HP-GL with only IN, SP, and PU and PD with absolute integer coordinates, 40 units/mm.
fn strokes(hpgl: &str) -> Ink {
    let mut ink = Ink::new();
    let (mut pen, mut down) = (0, false);
    let mut here = [0.0, 0.0];
    for command in hpgl.split(';').map(str::trim).filter(|command| !command.is_empty()) {
        let (name, parameters) = command.split_at(2);
        let values: Vec<f64> = parameters.split(',').filter_map(|value| value.parse().ok()).collect();
        match name {
            "IN" => {}
            "SP" => pen = parameters.parse().expect("a pen"),
            "PU" | "PD" => {
                let lowered = name == "PD" && !down;
                down = name == "PD";
                let lines = ink.entry(pen).or_default();
                if lowered {
                    lines.push(vec![here]);
                }
                for pair in values.chunks_exact(2) {
                    here = [pair[0] / 40.0, pair[1] / 40.0];
                    if down {
                        lines.last_mut().expect("lowered before").push(here);
                    }
                }
            }
            other => panic!("{other} is not plain HP-GL"),
        }
    }
    ink.retain(|_, lines| !lines.is_empty());
    ink
}

/// Straight pieces in a grid of 1 mm, for finding near ones.
struct Pieces {
    all: Vec<[Point; 2]>,
    /// Lower left corner of the grid, and its size in cells.
    origin: Point,
    size: [usize; 2],
    cells: Vec<Vec<u32>>,
}

impl Pieces {
    fn new(lines: &[Vec<Point>]) -> Self {
        let bound = |axis: usize, better: fn(f64, f64) -> f64, worst: f64| {
            lines.iter().flatten().map(|p| p[axis]).fold(worst, better)
        };
        let low = [0, 1].map(|axis| bound(axis, f64::min, f64::INFINITY).floor() - 1.0);
        let high = [0, 1].map(|axis| bound(axis, f64::max, f64::NEG_INFINITY).floor() + 2.0);
        let size = [0, 1].map(|axis| (high[axis] - low[axis]) as usize);
        let cells = vec![Vec::new(); size[0] * size[1]];
        let mut all = Self { all: Vec::new(), origin: low, size, cells };
        for line in lines {
            for piece in pieces(line) {
                all.add(piece);
            }
        }
        all
    }

    /// Adds a piece to the cells that it passes through.
    fn add(&mut self, piece: [Point; 2]) {
        let steps = (4.0 * distance(piece[0], piece[1])).ceil().max(1.0);
        let index = self.all.len() as u32;
        for step in 0..=steps as i32 {
            let [x, y] = self.cell(between(piece, f64::from(step) / steps));
            // Between two of these points, 0.25 mm apart, it may cross the corner of another cell.
            let cell = &mut self.cells[y as usize * self.size[0] + x as usize];
            if cell.last() != Some(&index) {
                cell.push(index);
            }
        }
        self.all.push(piece);
    }

    fn cell(&self, p: Point) -> [i32; 2] {
        [0, 1].map(|axis| (p[axis] - self.origin[axis]).floor() as i32)
    }

    /// Distance to the nearest piece, if that is at most 0.8 mm; otherwise a larger value.
    fn distance(&self, p: Point) -> f64 {
        let [x, y] = self.cell(p);
        let inside = |x: &i32, size: usize| *x >= 0 && (*x as usize) < size;
        let mut nearest = f64::INFINITY;
        for y in (y - 1..=y + 1).filter(|y| inside(y, self.size[1])) {
            for x in (x - 1..=x + 1).filter(|x| inside(x, self.size[0])) {
                for index in &self.cells[y as usize * self.size[0] + x as usize] {
                    nearest = nearest.min(to_piece(p, self.all[*index as usize]));
                }
            }
        }
        nearest
    }

    /// A point of `lines` that is farther than `allowed`, with its distance. Points between two
    /// samples may be farther by half of [`STEP`].
    fn beyond(&self, lines: &[Vec<Point>], allowed: f64) -> Option<(Point, f64)> {
        for piece in lines.iter().flat_map(|line| pieces(line)) {
            let length = distance(piece[0], piece[1]);
            let mut along = 0.0;
            loop {
                let share = if length > 0.0 { f64::min(along / length, 1.0) } else { 0.0 };
                let off = self.distance(between(piece, share));
                if off > allowed {
                    return Some((between(piece, share), off));
                }
                if along >= length {
                    break;
                }
                // The distance is 1-Lipschitz along the line.
                along += f64::max(allowed - off, STEP);
            }
        }
        None
    }
}

/// The pieces of a polyline; one of length 0 for a dot.
fn pieces(line: &[Point]) -> impl Iterator<Item = [Point; 2]> + '_ {
    let dot = (line.len() == 1).then(|| [line[0], line[0]]);
    line.windows(2).map(|ends| [ends[0], ends[1]]).chain(dot)
}

fn between([from, to]: [Point; 2], share: f64) -> Point {
    [from[0] + share * (to[0] - from[0]), from[1] + share * (to[1] - from[1])]
}

fn to_piece(p: Point, [from, to]: [Point; 2]) -> f64 {
    let (v, w) = ([to[0] - from[0], to[1] - from[1]], [p[0] - from[0], p[1] - from[1]]);
    let square = v[0] * v[0] + v[1] * v[1];
    let along = if square > 0.0 { ((w[0] * v[0] + w[1] * v[1]) / square).clamp(0.0, 1.0) } else { 0.0 };
    distance(p, between([from, to], along))
}

/// Checks a plan of this drawing; `drawing_error` is the error of the drawing itself, mm.
fn check_plan(what: &str, plan: &Plan, machine: &Machine, drawing: &Ink, drawing_error: f64) {
    check_motion(what, plan, machine);
    let ink = plan.ink(machine);
    let pens = |ink: &Ink| ink.keys().copied().collect::<Vec<_>>();
    assert_eq!(pens(&ink), pens(drawing), "{what}: pens");
    let allowed =
        TOLERANCE + plan.quantization_error(machine) + STEP / 2.0 + drawing_error * plan.scale() + 1e-3;
    for (pen, lines) in drawing {
        let placed: Vec<Vec<Point>> =
            lines.iter().map(|line| line.iter().map(|p| plan.place(*p)).collect()).collect();
        let drawn = &ink[pen];
        let deviating = Pieces::new(&placed).beyond(drawn, allowed);
        assert_eq!(deviating, None, "{what}: ink of pen {pen} deviates by more than {allowed} mm");
        let uncovered = Pieces::new(drawn).beyond(&placed, allowed);
        assert_eq!(uncovered, None, "{what}: pen {pen} leaves a part uncovered by more than {allowed} mm");
    }
}

/// Checks the rows of a plan: start, end, time, pen, joint ranges, and the limits by
/// [`Differences`].
fn check_motion(what: &str, plan: &Plan, machine: &Machine) {
    let rows = &plan.rows;
    let [first, last] = [rows[0], rows[rows.len() - 1]];
    assert_eq!((first.t_us, first.pen, first.ticks), (0, 0, machine.start), "{what}: the first row");
    assert_eq!((last.pen, last.ticks), (0, machine.start), "{what}: the last row");
    let mut differences = [Differences::default(); 2];
    let mut check = |row: usize, step: [i64; 2]| {
        for motor in 0..2 {
            if let Err(excess) = differences[motor].step(step[motor], plan.limits[motor], machine.period_us) {
                panic!("{what}: row {row}, motor {motor}: {excess}");
            }
        }
    };
    let mut pen_until = 0;
    for (index, pair) in rows.windows(2).enumerate() {
        let (from, to) = (pair[0], pair[1]);
        let step = [to.ticks[0] - from.ticks[0], to.ticks[1] - from.ticks[1]];
        let lasts = to.t_us - from.t_us;
        assert!(
            lasts == machine.period_us || step == [0, 0] && lasts > machine.period_us,
            "{what}: row {index} lasts {lasts} us"
        );
        let pen_before = index.checked_sub(1).map_or(0, |index| rows[index].pen);
        if from.pen != pen_before {
            // From one pen to another the pen goes up and down.
            let moves = if from.pen != 0 && pen_before != 0 { 2 } else { 1 };
            pen_until = from.t_us + moves * machine.pen_us;
        }
        assert!(step == [0, 0] || from.t_us >= pen_until, "{what}: row {index} moves while the pen does");
        // Rows at rest are omitted; three of them end all differences.
        for _ in 0..(lasts / machine.period_us).clamp(1, 3) {
            check(index, step);
        }
        assert!((machine.allowed)(to.ticks.map(|ticks| ticks as f64)), "{what}: row {index} is out of range");
    }
    // At rest after the last row.
    (0..3).for_each(|_| check(rows.len() - 1, [0, 0]));
}

/// The last step and the last second difference of a motor, ticks. A plan starts at rest.
#[derive(Clone, Copy, Default)]
struct Differences {
    step: i64,
    second: i64,
}

impl Differences {
    /// Checks the differences of a step of one period `T` against `v T + 1`, `a T² + 2` and
    /// `j T³ + 4`.
    fn step(&mut self, step: i64, [v, a, j]: Limits, period_us: i64) -> Result<(), String> {
        let second = step - self.step;
        let third = second - self.second;
        *self = Self { step, second };
        let t = period_us as f64 * 1e-6;
        for (found, most) in [(step, v * t + 1.0), (second, a * t * t + 2.0), (third, j * t * t * t + 4.0)] {
            if found.abs() as f64 > most {
                return Err(format!(
                    "{found} ticks, allowed {most} (step {step}, second {second}, third {third})"
                ));
            }
        }
        Ok(())
    }
}

fn plotplan(arguments: &[&str]) -> Option<String> {
    let output = Command::new(cargo_bin!("plotplan")).args(arguments).output().expect("the program runs");
    match output.status.code() {
        Some(0) => Some(String::from_utf8(output.stdout).expect("text")),
        Some(1) => None,
        _ => panic!("plotplan {arguments:?}\n{}", String::from_utf8_lossy(&output.stderr)),
    }
}

/// Converts with `options` and checks the plan; returns whether the machine can draw the drawing
/// so.
fn replay(machine: &Machine, file: &Path, drawing: &Ink, drawing_error: f64, options: &[&str]) -> bool {
    let name = file.to_str().expect("a UTF-8 path");
    let machine_file = machine.file.map(|file| top().join("tests/machines").join(file));
    let named = machine_file.as_ref().map_or(machine.name, |file| file.to_str().expect("a UTF-8 path"));
    let mut arguments = vec![name, "--machine", named];
    arguments.extend(options);
    if plotplan(&[&["check"], &arguments[..]].concat()).is_none() {
        return false;
    }
    let what = format!("{} on {} {}", name, machine.name, options.join(" "));
    let csv = plotplan(&[&["convert"], &arguments[..], &["--format", "csv"]].concat());
    let plan = Plan::parse(&csv.unwrap_or_else(|| panic!("{what}: no plan")), machine);
    check_plan(&what, &plan, machine, drawing, drawing_error);
    if options.contains(&"--fit") {
        let lines = drawing.values().flatten().flatten().map(|p| plan.place(*p));
        let [x0, y0, x1, y1] = machine.sheet;
        let mut on_sheet = lines.map(|[x, y]| within(x, x0, x1, 0.05) && within(y, y0, y1, 0.05));
        assert!(on_sheet.all(|on_sheet| on_sheet), "{what}: off the sheet");
    }
    true
}

/// The top directory of the repository.
fn top() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// The drawings of examples/ and tests/drawings/, sorted by name.
fn bundled() -> Vec<PathBuf> {
    let top = top();
    let mut files: Vec<PathBuf> = ["examples", "tests/drawings"]
        .iter()
        .flat_map(|folder| fs::read_dir(top.join(folder)).expect("the folder"))
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "hpgl" || extension == "plt"))
        .collect();
    files.sort();
    files
}

/// Larger drawings are replayed on one machine each, in turn: all of them on all machines take too
/// long.
const LARGE_BYTES: u64 = 20_000;

fn bundled_drawings(on: usize) {
    let files = bundled();
    assert!(!files.is_empty());
    let machine = &PRESETS[on];
    for (index, file) in files.iter().enumerate() {
        if fs::metadata(file).expect("its size").len() > LARGE_BYTES && index % PRESETS.len() != on {
            continue;
        }
        let plain = plotplan(&["convert", file.to_str().expect("a plain path"), "--format", "hpgl"]);
        let drawing = strokes(&plain.expect("a drawing"));
        // Integer plotter units, and curves as chords with an error of a quarter of a unit.
        let error = 0.0125 * std::f64::consts::SQRT_2 + 0.025 / 4.0;
        assert!(replay(machine, file, &drawing, error, &["--fit"]), "{} does not fit", file.display());
        replay(machine, file, &drawing, error, &[]);
    }
}

/// Polylines of `count` vertices in total, in plotter units, within 190 x 190 mm: random steps of up to
/// `reach`, a new polyline of the other pen after every `vertices`.
fn scribble(seed: u64, reach: i32, vertices: usize, count: usize) -> String {
    let mut random = Random(seed);
    let mut hpgl = "IN;".to_owned();
    let mut at = [4000, 4000];
    for vertex in 0..count {
        if vertex % vertices == 0 {
            hpgl.extend([format!(";PU;SP{};PU{},{};PD", 1 + (vertex / vertices) % 2, at[0], at[1])]);
        } else {
            let comma = if vertex % vertices == 1 { "" } else { "," };
            hpgl.extend([format!("{comma}{},{}", at[0], at[1])]);
        }
        at = at.map(|x: i32| (x + random.below(2 * reach as u64 + 1) as i32 - reach).clamp(200, 7800));
    }
    hpgl + ";PU;SP0;"
}

fn random_drawings(machine: &Machine) {
    let folder = TempDir::new().expect("a folder");
    let count = if machine.file.is_none() { 2000 } else { 500 };
    for (seed, reach, vertices) in [(1, 200, 2000), (2, 60, 400), (3, 8, 2000), (4, 400, 10)] {
        let hpgl = scribble(seed, reach, vertices, count);
        let file = folder.path().join(format!("scribble{seed}.hpgl"));
        fs::write(&file, &hpgl).expect("a file can be written");
        let drawing = strokes(&hpgl);
        assert!(replay(machine, &file, &drawing, 0.0, &["--fit"]), "scribble {seed} on {}", machine.name);
        // At life size a scribble fits the presets, except polar.
        if machine.file.is_none() {
            let life_size = replay(machine, &file, &drawing, 0.0, &[]);
            assert!(life_size || machine.name == "polar", "scribble {seed} on {}", machine.name);
        }
    }
}

/// A module for each preset: bundled drawings and random drawings.
macro_rules! on_each_preset {
    ($($name:ident $on:literal)*) => { $(
        mod $name {
            #[test]
            fn bundled_drawings() {
                super::bundled_drawings($on);
            }

            #[test]
            fn random_drawings() {
                super::random_drawings(&super::PRESETS[$on]);
            }
        }
    )* };
}

on_each_preset! { coaxial_arm 0 corexy_table 1 hbot_table 2 polar_robot 3 }

/// With jerk limits, from the drawing to the rows.
#[test]
fn random_drawings_on_a_corexy_with_jerk_limits() {
    random_drawings(&FILES[0]);
}

#[test]
fn random_drawings_on_an_arm_with_a_right_elbow() {
    random_drawings(&FILES[1]);
}

#[test]
fn random_drawings_on_an_arm_with_belt_ratio_2_and_negative_counts() {
    random_drawings(&FILES[2]);
}

/// The checks of this file find a step, a second and a third difference that is one tick too large.
#[test]
fn differences_beyond_the_limits_are_found() {
    let limits = [1e4, 1e5, 1e7]; // 100 + 1, 10 + 2 and 10 + 4 ticks at 10 ms
    let first_error = |limits: Limits, steps: &[i64]| {
        let mut differences = Differences::default();
        steps.iter().position(|step| differences.step(*step, limits, 10_000).is_err())
    };
    assert_eq!(first_error(limits, &[6, 18, 24, 24, 18, 6, 0]), None);
    assert_eq!(first_error(limits, &[6, 19]), Some(1));
    assert_eq!(first_error([1e4, 1e9, 1e7], &[14, 43]), Some(1));
    assert_eq!(first_error([1e4, 1e9, 1e12], &[101, 102]), Some(1));
}
