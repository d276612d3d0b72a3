//! Campaigns with random machines, random drawings and damaged plans, judged by the independent replay of
//! `independent.rs`. `cargo test` runs a few of each; `cargo xtask trust` sets `PLOTPLAN_CAMPAIGN` (how
//! many) and `PLOTPLAN_SEED`, and prints what they report (docs/trust.md).
#![expect(clippy::disallowed_methods, reason = "campaigns are set by the environment")]

use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};
use std::fmt::Write as _;

use test_support::{Program, Random, TestDir, stderr};

mod independent;

use independent::{Machine, NO_JERK_LIMIT, Plan, Point, TOLERANCE, check_plan, strokes};

const PROGRAM: Program = Program::new(env!("CARGO_BIN_EXE_plotplan"));

/// A number from the environment.
fn setting(name: &str, default: u64) -> u64 {
    std::env::var(name).map_or(default, |text| text.parse().expect("a number"))
}

fn seed() -> u64 {
    setting("PLOTPLAN_SEED", 20_261_126)
}

/// One of these.
fn pick<T: Copy>(random: &mut Random, from: &[T]) -> T {
    from[random.below(from.len() as u64) as usize]
}

/// A geometry: its part of a machine file, its forward kinematics, a point in the middle of a good part of
/// the reach and how far a sheet may extend from there, mm.
struct Geometry {
    toml: String,
    /// Degrees for joints that turn, mm for joints that slide.
    turns: [bool; 2],
    forward: Box<dyn Fn([f64; 2]) -> Point>,
    middle: Point,
    half: f64,
}

/// The unit vector in direction `angle` times `length`.
fn along(angle: f64, length: f64) -> Point {
    let (sin, cos) = libm::sincos(angle);
    [length * cos, length * sin]
}

fn sum(a: Point, b: Point) -> Point {
    [a[0] + b[0], a[1] + b[1]]
}

fn cartesian(random: &mut Random) -> Geometry {
    let size = random.between(60.0, 300.0);
    let toml = if random.below(2) == 0 {
        format!(
            "kind = \"cartesian\"\n[joints]\nx = {{ min = \"0mm\", max = \"{size}mm\" }}\ny = {{ min = \"0mm\", max = \
             \"{size}mm\" }}\n"
        )
    } else {
        "kind = \"cartesian\"\n".to_owned()
    };
    Geometry {
        toml,
        turns: [false, false],
        forward: Box::new(|q| q),
        middle: [size / 2.0, size / 2.0],
        half: size / 2.0,
    }
}

/// p = L1 e(theta) + L2 e(psi).
fn two_link(random: &mut Random) -> Geometry {
    let l1 = random.between(60.0, 250.0);
    let l2 = l1 * libm::pow(10.0, random.between(-0.3, 0.3));
    let elbow = pick(random, &["left", "right"]);
    let (near, far) = ((l1 - l2).abs() + 0.1 * l1, 0.97 * (l1 + l2));
    // A disk in the ring of the reach, in any direction.
    let half = 0.5 * (far - near) * random.between(0.2, 0.7) / std::f64::consts::SQRT_2;
    let radius = 0.5 * (far + near);
    Geometry {
        toml: format!("kind = \"two-link\"\nl1 = \"{l1}mm\"\nl2 = \"{l2}mm\"\nelbow = \"{elbow}\"\n"),
        turns: [true, true],
        forward: Box::new(move |q| sum(along(q[0], l1), along(q[1], l2))),
        middle: along(random.between(0.0, TAU), radius),
        half,
    }
}

/// p = r e(phi) + d t(phi).
fn polar(random: &mut Random) -> Geometry {
    let offset = if random.below(2) == 0 { 0.0 } else { random.between(-15.0, 15.0) };
    let middle = along(random.between(0.0, TAU), random.between(100.0, 200.0));
    Geometry {
        toml: format!("kind = \"polar\"\nrack_offset = \"{offset}mm\"\n"),
        turns: [true, false],
        forward: Box::new(move |q| sum(along(q[0], q[1]), along(q[0] + PI / 2.0, offset))),
        middle,
        half: random.between(15.0, 45.0),
    }
}

/// The point at these distances from two points, on the left of the way from `a` to `b` for `side` = 1.
fn tip(a: Point, b: Point, [from_a, from_b]: [f64; 2], side: f64) -> Point {
    let d = independent::distance(a, b);
    let x = (d * d + from_a * from_a - from_b * from_b) / (2.0 * d);
    let y = side * (from_a * from_a - x * x).max(0.0).sqrt();
    let unit = [(b[0] - a[0]) / d, (b[1] - a[1]) / d];
    [a[0] + x * unit[0] - y * unit[1], a[1] + x * unit[1] + y * unit[0]]
}

/// Two arms, elbows outside, the pen above.
fn five_bar(random: &mut Random) -> Geometry {
    let base = random.between(20.0, 50.0);
    let (proximal, distal) = (random.between(80.0, 120.0), random.between(120.0, 160.0));
    let toml = format!(
        "kind = \"five-bar\"\nbase1 = [\"-{base}mm\", \"0mm\"]\nbase2 = [\"{base}mm\", \"0mm\"]\nproximal1 = \
         \"{proximal}mm\"\nproximal2 = \"{proximal}mm\"\ndistal1 = \"{distal}mm\"\ndistal2 = \"{distal}mm\"\nelbow1 = \
         \"left\"\nelbow2 = \"right\"\npen = \"left\"\n"
    );
    let forward = move |q: [f64; 2]| {
        let elbow = |x: f64, angle: f64| sum([x, 0.0], along(angle, proximal));
        tip(elbow(-base, q[0]), elbow(base, q[1]), [distal, distal], 1.0)
    };
    Geometry {
        toml,
        turns: [true, true],
        forward: Box::new(forward),
        middle: [0.0, 0.8 * (proximal + distal) * 0.9],
        half: random.between(10.0, 25.0),
    }
}

/// |p - left|, |p - right|, the pen below.
fn polargraph(random: &mut Random) -> Geometry {
    let width = random.between(300.0, 900.0);
    Geometry {
        toml: format!("kind = \"polargraph\"\nleft = [\"0mm\", \"0mm\"]\nright = [\"{width}mm\", \"0mm\"]\n"),
        turns: [false, false],
        // On the right of the way from the left anchor to the right one: below.
        forward: Box::new(move |q| tip([0.0, 0.0], [width, 0.0], q, -1.0)),
        middle: [0.5 * width, -0.6 * width],
        half: width * random.between(0.05, 0.18),
    }
}

/// A machine file and the same machine, described independently; leaked, because a campaign is one process.
fn machine(random: &mut Random, dir: &TestDir) -> Machine {
    let geometry = match random.below(5) {
        0 => cartesian(random),
        1 => two_link(random),
        2 => polar(random),
        3 => five_bar(random),
        _ => polargraph(random),
    };
    let matrix = coupling(random, geometry.turns[0] == geometry.turns[1]);
    let has_jerk = random.below(3) == 0;
    let jerk_s = random.between(0.01, 0.1);
    let pen_us = 10_000 * (5 + random.below(20)) as i64;
    let period_us = pick(random, &[5_000, 10_000, 20_000]);
    let mut limits = [[NO_JERK_LIMIT; 3]; 2];
    // Random numbers of their own, so that machines without play are those of earlier campaigns.
    let mut play = Random(random.0 ^ 0x9e37_79b9_7f4a_7c15);
    let has_backlash = play.below(3) == 0;
    let mut backlash = [0.0; 2];
    let mut counts = [0.0; 2];
    let mut offsets = [0.0; 2];
    let mut motors = String::new();
    for k in 0..2 {
        // Rows of mixed units do not occur: the coupling is diagonal there.
        let (unit, size) = if geometry.turns[k] { ("rev", TAU) } else { ("mm", 1.0) };
        let sign = if random.below(2) == 0 { -1.0 } else { 1.0 };
        let per_unit = sign
            * if geometry.turns[k] { random.between(2000.0, 20_000.0) } else { random.between(20.0, 200.0) };
        counts[k] = per_unit / size;
        offsets[k] = random.between(-3000.0, 3000.0).round();
        // Units a second: 0.5 to 2 rad/s, 40 to 150 mm/s.
        let speed = counts[k].abs()
            * if geometry.turns[k] { random.between(0.5, 2.0) } else { random.between(40.0, 150.0) };
        let acceleration = speed * random.between(3.0, 20.0);
        limits[k][0] = speed;
        limits[k][1] = acceleration;
        write!(
            motors,
            "[[motor]]\nname = \"m{k}\"\ncounts = \"{per_unit}/{unit}\"\noffset = {}\nmax_speed = \
             \"{speed}ticks/s\"\nmax_acceleration = \"{acceleration}ticks/s2\"\n",
            offsets[k]
        )
        .expect("text");
        if has_jerk {
            limits[k][2] = acceleration / jerk_s;
            writeln!(motors, "max_jerk = \"{}ticks/s3\"", limits[k][2]).expect("text");
        }
        // One motor of three has none: up to 1 degree or 0.4 mm otherwise.
        if has_backlash && play.below(3) > 0 {
            let most = counts[k].abs() * if geometry.turns[k] { PI / 180.0 } else { 0.4 };
            backlash[k] = most * play.between(0.05, 1.0);
            writeln!(motors, "backlash = {}", backlash[k]).expect("text");
        }
    }
    let Geometry { toml, forward, middle: [x, y], half, .. } = geometry;
    let (x0, y0, size) = (x - half, y - half, 2.0 * half);
    let text = format!(
        "name = \"random\"\n[geometry]\n{toml}[coupling]\nmatrix = {matrix:?}\n{motors}[pen]\nmax_speed = \
         \"{}mm/s\"\nlift_time = \"{pen_us}us\"\ndrop_time = \"{pen_us}us\"\n[sheet]\nx = \"{x0}mm\"\ny = \
         \"{y0}mm\"\nwidth = \"{size}mm\"\nheight = \"{size}mm\"\n[start]\nx = \"{x}mm\"\ny = \"{y}mm\"\n[plan]\nperiod = \
         \"{period_us}us\"\n",
        random.between(20.0, 120.0)
    );
    dir.write("m.toml", text);
    let inverse = inverse(matrix);
    let motion = move |ticks: [f64; 2]| {
        let m = [0, 1].map(|k: usize| (ticks[k] - offsets[k]) / counts[k]);
        forward([0, 1].map(|k: usize| inverse[k][0] * m[0] + inverse[k][1] * m[1]))
    };
    Machine {
        name: "random",
        file: Some("m.toml"),
        limits: Some(limits),
        motors: ["m0", "m1"],
        forward: Box::leak(Box::new(motion)),
        start: [0, 0],
        backlash,
        pen_us,
        period_us,
        every_period: true,
        sheet: [x0, y0, x0 + size, y0 + size],
        allowed: &|_| true,
    }
}

/// A coupling matrix: any of the usual ones where both joints have one unit, else the identity.
fn coupling(random: &mut Random, one_unit: bool) -> [[f64; 2]; 2] {
    let ratio = random.between(0.4, 3.0);
    let gear = random.between(-3.0, -0.4);
    let all = [
        [[1.0, 0.0], [0.0, 1.0]],
        [[1.0, 0.0], [0.0, -1.0]],
        [[1.0, 1.0], [1.0, -1.0]],
        [[1.0, 0.0], [-1.0, 1.0]],
        [[1.0, 0.0], [-gear, gear]],
        [[1.0, 0.0], [1.0 - 1.0 / ratio, 1.0 / ratio]],
    ];
    pick(random, if one_unit { &all } else { &all[..2] })
}

fn inverse([[a, b], [c, d]]: [[f64; 2]; 2]) -> [[f64; 2]; 2] {
    let det = a * d - b * c;
    [[d / det, -b / det], [-c / det, a / det]]
}

/// Polylines of two pens with 1 to 60 vertices in all, some of them dots, within 190 x 190 mm.
fn scribble(random: &mut Random) -> String {
    let mut hpgl = "IN;".to_owned();
    let reach = pick(random, &[40, 400, 3000]);
    for _ in 0..=random.below(5) {
        let mut at = [0, 1].map(|_| 200 + random.below(7600) as i64);
        write!(hpgl, "SP{};PU{},{};PD", 1 + random.below(2), at[0], at[1]).expect("text");
        for vertex in 0..random.below(12) {
            at = at.map(|x| (x + random.below(2 * reach + 1) as i64 - reach as i64).clamp(200, 7800));
            write!(hpgl, "{}{},{}", if vertex == 0 { "" } else { "," }, at[0], at[1]).expect("text");
        }
        hpgl += ";PU;";
    }
    hpgl + "SP0;"
}

/// Options that change how a plan is made. Motors with play cannot keep to a fixed time for a segment.
fn options(random: &mut Random, has_backlash: bool) -> String {
    let law = match random.below(8) {
        1..=3 if has_backlash => "",
        0 => "--law trapezoid",
        1 => "--law linear --segment-time 1s --allow-over-limit",
        2 => "--law sine --segment-time 2s --allow-over-limit",
        3 => "--law quadratic --segment-time 2s --allow-over-limit",
        _ => "",
    };
    let rounding = pick(random, &["", "--rounding nearest"]);
    let order = pick(random, &["", "--order file", "--effort 0"]);
    let rotate = pick(random, &["", "--rotate 30", "--mirror x"]);
    format!("--fit {law} {rounding} {order} {rotate}")
}

/// Random machines of every kind with random drawings, laws, roundings, orders, jerk limits and backlash: what is
/// planned draws the drawing, by kinematics that are written here.
#[test]
fn random_machines_draw_random_drawings() {
    let count = setting("PLOTPLAN_CAMPAIGN", 12);
    let dir = TestDir::new();
    let mut outcomes: BTreeMap<String, u64> = BTreeMap::new();
    for case in 0..count {
        let mut random = Random(seed().wrapping_mul(1_000_003).wrapping_add(case));
        let mut machine = machine(&mut random, &dir);
        let hpgl = scribble(&mut random);
        dir.write("d.hpgl", &hpgl);
        let has_backlash = machine.backlash != [0.0; 2];
        let options = options(&mut random, has_backlash);
        let arguments = format!("convert d.hpgl -m m.toml {options} -f csv -o p.csv --report json");
        let output = PROGRAM.run(&dir, &arguments);
        let said = stderr(&output);
        let what =
            || format!("case {case} of seed {}: {arguments}\n{hpgl}\n{}\n{said}", seed(), dir.text("m.toml"));
        match output.status.code() {
            Some(0) => {
                let within_limits = !options.contains("--allow-over-limit");
                let result = replayed(&dir, &mut machine, &hpgl, within_limits);
                assert_eq!(result, Ok(()), "{}", what());
                let outcome = if has_backlash { "drawn with backlash" } else { "drawn" };
                *outcomes.entry(outcome.to_owned()).or_default() += 1;
                // The judge notices the play: without it, most of these plans deviate.
                let mut rigid = Machine { backlash: [0.0; 2], ..machine };
                if replayed(&dir, &mut rigid, &hpgl, within_limits).is_err() {
                    *outcomes.entry("deviating without backlash".to_owned()).or_default() += 1;
                }
            }
            Some(1) => {
                let report: serde_json::Value =
                    serde_json::from_str(said.lines().last().unwrap_or_default()).expect("a report");
                let code = report["error"]["code"].as_str().unwrap_or_default().to_owned();
                // Off the reach of a small machine, or ticks as coarse as the drawing.
                assert!(["out-of-reach", "no-placement", "verification"].contains(&&*code), "{}", what());
                if code == "verification" {
                    println!("not certified: {}", what());
                }
                *outcomes.entry(format!("refused: {code}")).or_default() += 1;
            }
            _ => panic!("{}", what()),
        }
    }
    println!("campaign of {count} random machines, seed {}: {outcomes:?}", seed());
    let drawn =
        outcomes.iter().filter(|(outcome, _)| outcome.starts_with("drawn")).map(|(_, n)| n).sum::<u64>();
    assert!(10 * drawn > 7 * count, "{outcomes:?}");
    let of = |outcome: &str| outcomes.get(outcome).copied().unwrap_or_default();
    assert!(2 * of("deviating without backlash") >= of("drawn with backlash"), "{outcomes:?}");
}

/// Replays the plan in `p.csv`, which starts where the machine file says.
fn replayed(dir: &TestDir, machine: &mut Machine, hpgl: &str, within_limits: bool) -> Result<(), String> {
    let mut plan = Plan::read(&dir.text("p.csv"), machine)?;
    if !within_limits {
        plan.limits = [[f64::INFINITY; 3]; 2];
    }
    let first = plan.rows.first().ok_or("no rows")?.ticks;
    machine.start = first;
    let [x0, y0, x1, y1] = machine.sheet;
    let start = (machine.forward)(first.map(|ticks| ticks as f64));
    let off = independent::distance(start, [f64::midpoint(x0, x1), f64::midpoint(y0, y1)]);
    let tick = plan.quantization_error(machine);
    if off > tick + 0.1 {
        return Err(format!("the plan starts {off} mm from the start pose"));
    }
    check_plan(&plan, machine, &strokes(hpgl), 0.0, TOLERANCE)
}

/// What damages a plan: the name and the change of its rows, or of its text.
type Mutation = (&'static str, fn(&mut Random, &mut Table));

/// A CSV plan as lines.
#[derive(Clone)]
struct Table {
    head: Vec<String>,
    rows: Vec<[i64; 4]>,
}

impl Table {
    fn of(csv: &str) -> Self {
        let is_row = |line: &&str| line.starts_with(|c: char| c.is_ascii_digit());
        let rows = csv.lines().filter(is_row).map(|line| {
            let fields: Vec<i64> = line.split(',').map(|field| field.parse().expect("a number")).collect();
            fields.try_into().expect("four fields")
        });
        let head = csv.lines().filter(|line| !is_row(line)).map(str::to_owned);
        Self { head: head.collect(), rows: rows.collect() }
    }

    fn text(&self) -> String {
        let mut text = self.head.iter().flat_map(|line| [line, "\n"]).collect::<String>();
        for [t_us, pen, first, second] in &self.rows {
            writeln!(text, "{t_us},{pen},{first},{second}").expect("text");
        }
        text
    }

    /// Makes the counts of the head those of the rows, so that the damage is not found by them.
    fn recount(&mut self) {
        let rows = self.rows.len();
        let duration = self.rows.last().map_or(0, |row| row[0]);
        for line in &mut self.head {
            if line.starts_with("# rows: ") {
                *line = format!("# rows: {rows}");
            } else if line.starts_with("# duration_us: ") {
                *line = format!("# duration_us: {duration}");
            }
        }
    }

    /// A row that is not the first one.
    fn some_row(&self, random: &mut Random) -> usize {
        1 + random.below(self.rows.len() as u64 - 1) as usize
    }

    /// A stretch of rows, from one to the other.
    fn stretch(&self, random: &mut Random, most: u64) -> std::ops::Range<usize> {
        let from = self.some_row(random);
        from..(from + 1 + random.below(most) as usize).min(self.rows.len())
    }
}

const MUTATIONS: &[Mutation] = &[
    ("ticks of a row by 1 to 3", |random, table| {
        let (row, motor) = (table.some_row(random), 2 + random.below(2) as usize);
        table.rows[row][motor] += 1 + random.below(3) as i64;
    }),
    ("ticks of a row by 4 to 1000", |random, table| {
        let (row, motor) = (table.some_row(random), 2 + random.below(2) as usize);
        table.rows[row][motor] -= 4 + random.below(997) as i64;
    }),
    ("steps lost from a row on", |random, table| {
        let (row, motor) = (table.some_row(random), 2 + random.below(2) as usize);
        let lost = 1 + random.below(200) as i64;
        table.rows[row..].iter_mut().for_each(|row| row[motor] -= lost);
    }),
    ("stretch moved aside", |random, table| {
        let (stretch, motor) = (table.stretch(random, 200), 2 + random.below(2) as usize);
        let by = 1 + random.below(100) as i64;
        table.rows[stretch].iter_mut().for_each(|row| row[motor] += by);
    }),
    ("row left out", |random, table| {
        let row = table.some_row(random);
        table.rows.remove(row);
    }),
    ("stretch left out, time closed", |random, table| {
        let stretch = table.stretch(random, 30);
        let gone = table.rows[stretch.end - 1][0] - table.rows[stretch.start - 1][0];
        table.rows.drain(stretch.clone());
        table.rows[stretch.start..].iter_mut().for_each(|row| row[0] -= gone);
    }),
    ("row twice", |random, table| {
        let row = table.some_row(random);
        table.rows.insert(row, table.rows[row]);
    }),
    ("two rows exchanged", |random, table| {
        let (a, b) = (table.some_row(random), table.some_row(random));
        let times = [table.rows[a][0], table.rows[b][0]];
        table.rows.swap(a, b);
        (table.rows[a][0], table.rows[b][0]) = (times[0], times[1]);
    }),
    ("stretch backwards", |random, table| {
        let stretch = table.stretch(random, 60);
        let times: Vec<i64> = table.rows[stretch.clone()].iter().map(|row| row[0]).collect();
        table.rows[stretch.clone()].reverse();
        table.rows[stretch].iter_mut().zip(times).for_each(|(row, time)| row[0] = time);
    }),
    ("stretch faster", |random, table| {
        let stretch = table.stretch(random, 100);
        let period = table.rows[1][0] - table.rows[0][0];
        let (from, by) = (stretch.start, 1 + random.below(period.max(2) as u64 - 1) as i64);
        let count = stretch.len() as i64;
        table.rows[stretch].iter_mut().enumerate().for_each(|(k, row)| row[0] -= by * (k as i64 + 1));
        table.rows[from + count as usize..].iter_mut().for_each(|row| row[0] -= by * count);
    }),
    ("pen of a row", |random, table| {
        let row = table.some_row(random);
        table.rows[row][1] = pick(random, &[0, 1, 2, 7]);
    }),
    ("pen of a stretch", |random, table| {
        let (stretch, pen) = (table.stretch(random, 400), pick(random, &[0, 1, 2, 3]));
        table.rows[stretch].iter_mut().for_each(|row| row[1] = pen);
    }),
    ("end cut off", |random, table| {
        let row = table.some_row(random);
        table.rows.truncate(row);
    }),
    ("motors exchanged", |_, table| table.rows.iter_mut().for_each(|row| row.swap(2, 3))),
    ("a number of the head", |random, table| {
        let lines: Vec<usize> =
            (0..table.head.len()).filter(|k| table.head[*k].contains(|c: char| c.is_ascii_digit())).collect();
        let line = &mut table.head[pick(random, &lines)];
        let digits: Vec<usize> =
            line.char_indices().filter(|(_, c)| c.is_ascii_digit()).map(|(at, _)| at).collect();
        let at = pick(random, &digits);
        line.replace_range(at..=at, pick(random, &["0", "1", "9", "99", "-", ""]));
    }),
    ("a line of the head left out", |random, table| {
        let line = random.below(table.head.len() as u64) as usize;
        table.head.remove(line);
    }),
    ("another placement", |random, table| {
        let line = table.head.iter_mut().find(|line| line.starts_with("# placement: ")).expect("a placement");
        let by = random.between(-20.0, 20.0);
        let mut values: Vec<f64> =
            line["# placement: ".len()..].split(' ').map(|value| value.parse().expect("a number")).collect();
        values[4 + random.below(2) as usize] += by;
        let values: Vec<String> = values.iter().map(f64::to_string).collect();
        *line = format!("# placement: {}", values.join(" "));
    }),
];

/// Damaged plans of random machines: every plan that the independent judge calls harmful is refused by
/// `verify`, and so is every file that is no plan any more.
#[test]
fn damaged_plans_are_refused() {
    const FOR_EACH_PLAN: u64 = 50;
    let count = setting("PLOTPLAN_CAMPAIGN_PLANS", 100);
    let dir = TestDir::new();
    let mut tried = 0;
    // Refused as no plan, refused as harmful, harmless and accepted, harmless and refused.
    let mut outcomes: BTreeMap<&str, [u64; 4]> = BTreeMap::new();
    for case in 0.. {
        if tried >= count {
            break;
        }
        let mut random = Random(seed().wrapping_mul(7_000_003).wrapping_add(case));
        let mut machine = machine(&mut random, &dir);
        let hpgl = scribble(&mut random);
        dir.write("d.hpgl", &hpgl);
        let made = PROGRAM.run(&dir, "convert d.hpgl -m m.toml --fit -f csv -o p.csv");
        if !made.status.success() {
            continue;
        }
        assert_eq!(replayed(&dir, &mut machine, &hpgl, true), Ok(()), "case {case} of seed {}", seed());
        PROGRAM.succeed(&dir, "verify p.csv --drawing d.hpgl -m m.toml");
        machine.every_period = false;
        let sound = Table::of(&dir.text("p.csv"));
        for _ in 0..FOR_EACH_PLAN {
            let (name, mutate) = pick(&mut random, MUTATIONS);
            let mut damaged = sound.clone();
            mutate(&mut random, &mut damaged);
            if random.below(4) > 0 {
                damaged.recount();
            }
            let text = damaged.text();
            if text == sound.text() {
                continue;
            }
            dir.write("bad.csv", &text);
            tried += 1;
            let output = PROGRAM.run(&dir, "verify bad.csv --drawing d.hpgl -m m.toml --quiet");
            let code = output.status.code();
            let said = stderr(&output);
            assert!(matches!(code, Some(0 | 1)), "case {case} of seed {}: {name}\n{said}", seed());
            let judged = Plan::read(&text, &machine)
                .and_then(|plan| check_plan(&plan, &machine, &strokes(&hpgl), 0.0, TOLERANCE));
            let counts = outcomes.entry(name).or_default();
            match (judged, code == Some(0)) {
                (Err(why), true) => {
                    let place = std::env::temp_dir().join("plotplan-accepted");
                    std::fs::create_dir_all(&place).expect("a folder");
                    for file in ["bad.csv", "p.csv", "d.hpgl", "m.toml"] {
                        std::fs::write(place.join(file), dir.bytes(file)).expect("a file");
                    }
                    panic!("case {case} of seed {}: {name}: accepted, but {why}; files in {place:?}", seed());
                }
                (Err(_), false) if said.contains("not a plan that can be used") => counts[0] += 1,
                (Err(_), false) => counts[1] += 1,
                (Ok(()), true) => counts[2] += 1,
                (Ok(()), false) => counts[3] += 1,
            }
        }
    }
    println!("campaign of {tried} damaged plans, seed {}", seed());
    println!("{:30} no plan, harmful, harmless accepted, harmless refused", "damage");
    for (name, counts) in &outcomes {
        println!("{name:30} {counts:?}");
    }
    let total = |k: usize| outcomes.values().map(|counts| counts[k]).sum::<u64>();
    println!("{:30} {:?}", "all", [total(0), total(1), total(2), total(3)]);
    // The judge is worth something: most damage is harm, and some is not.
    assert!(2 * (total(0) + total(1)) > tried, "{outcomes:?}");
}
