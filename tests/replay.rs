//! Plans, replayed by somebody else: the CSV is read here, and forward kinematics are written down from the four reports'
//! equations, so that nothing is shared with the planner, the kinematics or the verifier. For every drawing at hand, and
//! for made-up ones: what the motors draw is the drawing, both ways; limits, start, end and pen keep to the documents.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use assert_cmd::cargo::cargo_bin;
use tempfile::TempDir;

type Point = [f64; 2];
/// Lines of ink of each pen; a line of one point is a dot. mm.
type Ink = BTreeMap<i64, Vec<Vec<Point>>>;

/// The default of `--tolerance`, mm.
const TOLERANCE: f64 = 0.1;
/// Distances are looked at no closer than this along a line, mm.
const STEP: f64 = 0.02;

/// A machine as its report tells it.
struct Machine {
    name: &'static str,
    motors: [&'static str; 2],
    /// Pen position from motor positions.
    forward: fn([f64; 2]) -> Point,
    start: [i64; 2],
    /// How long the pen takes to move, microseconds.
    pen_us: i64,
    /// Time between rows, microseconds.
    period_us: i64,
    /// x0, y0, x1, y1.
    sheet: [f64; 4],
    /// Whether the motors may be there, give or take half a tick.
    allowed: fn([f64; 2]) -> bool,
}

fn distance(a: Point, b: Point) -> f64 {
    libm::hypot(a[0] - b[0], a[1] - b[1])
}

fn within(value: f64, low: f64, high: f64, slack: f64) -> bool {
    value >= low - slack && value <= high + slack
}

/// Seed 1: x = L1 cos th1 + L2 cos(th1 - th2), y alike; counts 3200/360 th1 and 3200/360 (th2 - th1 + 90).
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

/// Seed 3: A = X + Y, B = X - Y, times the encoder ratio.
fn corexy([a, b]: [f64; 2]) -> Point {
    let enc_ratio = 171.79 * 24.0 / (14.26 * std::f64::consts::PI);
    [0.5 * (a + b) / enc_ratio, 0.5 * (a - b) / enc_ratio]
}

/// Seed 2, equations (1) and (2).
fn hbot([l, r]: [f64; 2]) -> Point {
    [(l - r + 3100.0) * 250.0 / 6200.0, (l + r - 3100.0) * 250.0 / 6200.0]
}

/// Seed 4: 544 to 2400 microseconds are theta = 0 to 180 degrees, 44 mm are a turn of the pinion; theta = atan(x / y) + 90.
fn polar([us, degrees]: [f64; 2]) -> Point {
    let theta = (us - 544.0) * 180.0 / (2400.0 - 544.0);
    let r = 138.0 + degrees * 44.0 / 360.0;
    let (sin, cos) = libm::sincos((theta - 90.0).to_radians());
    [r * sin, r * cos]
}

const MACHINES: [Machine; 4] = [
    Machine {
        name: "coaxial",
        motors: ["arm1", "arm2"],
        forward: coaxial,
        start: [800, 0],
        pen_us: 150_000,
        period_us: 10_000,
        sheet: [12.7, 76.2, 12.7 + 215.9, 76.2 + 279.4],
        // The elbow stays on its side: 0 to 180 degrees of fold, a tick of each motor being 0.1125.
        allowed: |ticks| within(coaxial_angles(ticks)[1], 0.0, 180.0, 0.12),
    },
    Machine {
        name: "corexy",
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

/// A CSV plan, as docs and headers tell it.
struct Plan {
    placement: [f64; 6],
    /// Speed and acceleration of each motor, ticks/s and ticks/s².
    limits: [[f64; 2]; 2],
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
    parsed.try_into().expect("so many numbers")
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
        // The line after the comments was taken with them.
        let head = csv.lines().nth(comments.len()).expect("column names");
        assert_eq!(head, format!("t_us,pen,{},{}", machine.motors[0], machine.motors[1]));
        let row = |line: &str| {
            let fields: Vec<i64> =
                line.split(',').map(|field| field.parse().expect("a whole number")).collect();
            let [t_us, pen, first, second] = fields[..] else { panic!("four columns: {line}") };
            Row { t_us, pen, ticks: [first, second] }
        };
        Self {
            placement: numbers(comments["placement"]),
            limits: machine.motors.map(|motor| numbers(comments[format!("limits {motor}").as_str()])),
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

    /// What the machine draws: motors move linearly from row to row; in chords of a fifth of a mm at the most.
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

    /// How far half a tick of both motors moves the pen, at the worst, where it draws.
    fn tick_floor(&self, machine: &Machine) -> f64 {
        let off = |row: &Row, by: [f64; 2]| {
            let ticks = row.ticks.map(|ticks| ticks as f64);
            distance((machine.forward)(ticks), (machine.forward)([ticks[0] + by[0], ticks[1] + by[1]]))
        };
        let corners = [[0.5, 0.5], [0.5, -0.5], [-0.5, 0.5], [-0.5, -0.5]];
        let drawn = self.rows.iter().filter(|row| row.pen > 0);
        drawn.flat_map(|row| corners.map(|by| off(row, by))).fold(0.0, f64::max)
    }
}

/// Reads HP-GL that has only IN, SP, and PU and PD with absolute whole numbers in it, 40 a mm.
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

/// Straight pieces in a grid of 1 mm, to find those that are near.
struct Pieces {
    all: Vec<[Point; 2]>,
    /// The grid's lower left corner and how many cells it is wide and high.
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

    /// Into every cell that it passes through, and perhaps some others.
    fn add(&mut self, piece: [Point; 2]) {
        let steps = (4.0 * distance(piece[0], piece[1])).ceil().max(1.0);
        let index = self.all.len() as u32;
        for step in 0..=steps as i32 {
            let [x, y] = self.cell(between(piece, f64::from(step) / steps));
            // Between two of these points, a quarter of a mm apart, it may cut the corner of another cell.
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

    /// Distance to the nearest piece where that is at most 0.8 mm; where it is more, more than that.
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

    /// A point of `lines` that is farther than `allowed`, with its distance. What is between two points that are looked
    /// at may be farther by half of [`STEP`].
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
                // No point nearer than this can be beyond: a distance changes by no more than the way gone.
                along += f64::max(allowed - off, STEP);
            }
        }
        None
    }
}

/// The pieces of a line; one of no length for a dot.
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

/// Everything that has to be true of a plan of this drawing; `blur` is what the drawing is not known better than, mm.
fn hold(what: &str, plan: &Plan, machine: &Machine, drawing: &Ink, blur: f64) {
    motion(what, plan, machine);
    let ink = plan.ink(machine);
    let pens = |ink: &Ink| ink.keys().copied().collect::<Vec<_>>();
    assert_eq!(pens(&ink), pens(drawing), "{what}: pens");
    let allowed = TOLERANCE + plan.tick_floor(machine) + STEP / 2.0 + blur * plan.scale() + 1e-3;
    for (pen, lines) in drawing {
        let placed: Vec<Vec<Point>> =
            lines.iter().map(|line| line.iter().map(|p| plan.place(*p)).collect()).collect();
        let drawn = &ink[pen];
        let strays = Pieces::new(&placed).beyond(drawn, allowed);
        assert_eq!(strays, None, "{what}: pen {pen} strays by more than {allowed} mm");
        let missed = Pieces::new(drawn).beyond(&placed, allowed);
        assert_eq!(missed, None, "{what}: pen {pen} misses by more than {allowed} mm");
    }
}

/// What is true of a plan's rows, whatever they draw.
fn motion(what: &str, plan: &Plan, machine: &Machine) {
    let rows = &plan.rows;
    let [first, last] = [rows[0], rows[rows.len() - 1]];
    assert_eq!((first.t_us, first.pen, first.ticks), (0, 0, machine.start), "{what}: the first row");
    assert_eq!((last.pen, last.ticks), (0, machine.start), "{what}: the last row");
    let period = machine.period_us as f64 * 1e-6;
    let mut before = [0, 0];
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
            // From one pen to another it goes up and down again.
            let moves = if from.pen != 0 && pen_before != 0 { 2 } else { 1 };
            pen_until = from.t_us + moves * machine.pen_us;
        }
        assert!(step == [0, 0] || from.t_us >= pen_until, "{what}: row {index} moves while the pen does");
        for motor in 0..2 {
            let [speed, acceleration] = plan.limits[motor];
            let (d1, d2) = (step[motor] as f64, (step[motor] - before[motor]) as f64);
            let most = [speed * period + 1.0, acceleration * period * period + 2.0];
            assert!(d1.abs() <= most[0], "{what}: row {index}, motor {motor}: {d1} ticks of {}", most[0]);
            assert!(d2.abs() <= most[1], "{what}: row {index}, motor {motor}: {d2} ticks of {}", most[1]);
        }
        before = step;
        assert!((machine.allowed)(to.ticks.map(|ticks| ticks as f64)), "{what}: row {index} is out of range");
    }
    for (step, [_, acceleration]) in before.into_iter().zip(plan.limits) {
        let most = acceleration * period * period + 2.0;
        assert!((step as f64).abs() <= most, "{what}: the last row comes at {step} ticks a row");
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

/// Converts with `options` and holds the plan against the drawing; says whether the machine can draw it so.
fn replay(machine: &Machine, file: &Path, drawing: &Ink, blur: f64, options: &[&str]) -> bool {
    let name = file.to_str().expect("a plain path");
    let mut arguments = vec![name, "--machine", machine.name];
    arguments.extend(options);
    if plotplan(&[&["check"], &arguments[..]].concat()).is_none() {
        return false;
    }
    let what = format!("{} on {} {}", name, machine.name, options.join(" "));
    let csv = plotplan(&[&["convert"], &arguments[..], &["--format", "csv"]].concat());
    let plan = Plan::parse(&csv.unwrap_or_else(|| panic!("{what}: no plan")), machine);
    hold(&what, &plan, machine, drawing, blur);
    if options.contains(&"--fit") {
        let lines = drawing.values().flatten().flatten().map(|p| plan.place(*p));
        let [x0, y0, x1, y1] = machine.sheet;
        let mut on_sheet = lines.map(|[x, y]| within(x, x0, x1, 0.05) && within(y, y0, y1, 0.05));
        assert!(on_sheet.all(|on_sheet| on_sheet), "{what}: off the sheet");
    }
    true
}

/// The drawings of examples/ and tests/drawings/, in the order of their names.
fn bundled() -> Vec<PathBuf> {
    let top = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let mut files: Vec<PathBuf> = ["examples", "tests/drawings"]
        .iter()
        .flat_map(|folder| fs::read_dir(top.join(folder)).expect("the folder"))
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "hpgl" || extension == "plt"))
        .collect();
    files.sort();
    files
}

/// Larger drawings are replayed on one machine each, in turn: all of them on all machines take too long for every day.
const LARGE_BYTES: u64 = 20_000;

fn bundled_drawings(on: usize) {
    let files = bundled();
    assert!(!files.is_empty());
    let machine = &MACHINES[on];
    for (index, file) in files.iter().enumerate() {
        if fs::metadata(file).expect("its size").len() > LARGE_BYTES && index % MACHINES.len() != on {
            continue;
        }
        let plain = plotplan(&["convert", file.to_str().expect("a plain path"), "--format", "hpgl"]);
        let drawing = strokes(&plain.expect("a drawing"));
        // Written in whole plotter units, curves as chords within a quarter of one.
        let blur = 0.0125 * std::f64::consts::SQRT_2 + 0.025 / 4.0;
        assert!(replay(machine, file, &drawing, blur, &["--fit"]), "{} does not fit", file.display());
        replay(machine, file, &drawing, blur, &[]);
    }
}

/// Numbers that look random and are always the same (Knuth's 64-bit linear congruential generator, upper half).
struct Random(u64);

impl Random {
    fn below(&mut self, n: i32) -> i32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) % n as u64) as i32
    }
}

/// Polylines of 2,000 vertices altogether, in plotter units, within 190 mm each way: steps of up to `reach`, a new line
/// of the other pen after every `vertices`.
fn scribble(seed: u64, reach: i32, vertices: usize) -> String {
    let mut random = Random(seed);
    let mut hpgl = "IN;".to_owned();
    let mut at = [4000, 4000];
    for vertex in 0..2000 {
        if vertex % vertices == 0 {
            hpgl.extend([format!(";PU;SP{};PU{},{};PD", 1 + (vertex / vertices) % 2, at[0], at[1])]);
        } else {
            let comma = if vertex % vertices == 1 { "" } else { "," };
            hpgl.extend([format!("{comma}{},{}", at[0], at[1])]);
        }
        at = at.map(|x: i32| (x + random.below(2 * reach + 1) - reach).clamp(200, 7800));
    }
    hpgl + ";PU;SP0;"
}

fn scribbles(on: usize) {
    let folder = TempDir::new().expect("a folder");
    let machine = &MACHINES[on];
    for (seed, reach, vertices) in [(1, 200, 2000), (2, 60, 400), (3, 8, 2000), (4, 400, 10)] {
        let hpgl = scribble(seed, reach, vertices);
        let file = folder.path().join(format!("scribble{seed}.hpgl"));
        fs::write(&file, &hpgl).expect("a file can be written");
        let drawing = strokes(&hpgl);
        assert!(replay(machine, &file, &drawing, 0.0, &["--fit"]), "it fits every machine");
        let life_size = replay(machine, &file, &drawing, 0.0, &[]);
        assert!(life_size || machine.name == "polar", "scribble {seed} on {}", machine.name);
    }
}

macro_rules! on_each_machine {
    ($($name:ident $on:literal)*) => { $(
        mod $name {
            #[test]
            fn draws_what_is_bundled() {
                super::bundled_drawings($on);
            }

            #[test]
            fn draws_scribbles() {
                super::scribbles($on);
            }
        }
    )* };
}

on_each_machine! { on_coaxial 0 on_corexy 1 on_hbot 2 on_polar 3 }
