//! Independent replay of plans, for `replay.rs` and `campaigns.rs`: a CSV reader, the checks of motion and
//! ink, and a machine as a closure from ticks to the pen. It shares no code with the planner, the machine
//! model or the verifier.
#![allow(dead_code, reason = "each test binary uses its part")]

use std::collections::BTreeMap;

pub(crate) type Point = [f64; 2];
/// Polylines of each pen, mm; a polyline of one point is a dot.
pub(crate) type Ink = BTreeMap<i64, Vec<Vec<Point>>>;

/// The default of `--tolerance`, mm.
pub(crate) const TOLERANCE: f64 = 0.1;
/// Smallest step between two samples along a line, mm.
pub(crate) const STEP: f64 = 0.02;

/// Largest speed, acceleration and jerk of a motor, ticks/s, ticks/s², ticks/s³; jerk may be
/// infinite.
pub(crate) type Limits = [f64; 3];

pub(crate) const NO_JERK_LIMIT: f64 = f64::INFINITY;

/// A machine, described independently of its machine file.
#[derive(Clone, Copy)]
pub(crate) struct Machine {
    pub(crate) name: &'static str,
    /// The machine file; `None` for presets.
    pub(crate) file: Option<&'static str>,
    /// Limits of the motors; `None`: those of the plan's header.
    pub(crate) limits: Option<[Limits; 2]>,
    pub(crate) motors: [&'static str; 2],
    /// Pen position from motor positions.
    pub(crate) forward: &'static dyn Fn([f64; 2]) -> Point,
    pub(crate) start: [i64; 2],
    /// Play between each motor and its joint, ticks.
    pub(crate) backlash: [f64; 2],
    /// Lift time and drop time, us.
    pub(crate) pen_us: i64,
    /// Time between rows, us.
    pub(crate) period_us: i64,
    /// Whether rows must be one period apart while motors move, as planned. Otherwise a longer row is as
    /// many equal steps, and rests last as long as they like: what a controller makes of a damaged plan.
    pub(crate) every_period: bool,
    /// x0, y0, x1, y1.
    pub(crate) sheet: [f64; 4],
    /// Whether the joints are in their range, give or take half a tick of each motor.
    pub(crate) allowed: &'static dyn Fn([f64; 2]) -> bool,
}

pub(crate) fn distance(a: Point, b: Point) -> f64 {
    libm::hypot(a[0] - b[0], a[1] - b[1])
}

pub(crate) fn within(value: f64, low: f64, high: f64, slack: f64) -> bool {
    value >= low - slack && value <= high + slack
}

/// A CSV plan as documented in docs/formats.md.
#[derive(Clone, Debug)]
pub(crate) struct Plan {
    pub(crate) placement: [f64; 6],
    pub(crate) limits: [Limits; 2],
    pub(crate) rows: Vec<Row>,
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct Row {
    pub(crate) t_us: i64,
    pub(crate) pen: i64,
    pub(crate) ticks: [i64; 2],
}

impl Plan {
    pub(crate) fn parse(csv: &str, machine: &Machine) -> Self {
        Self::read(csv, machine).unwrap_or_else(|error| panic!("{error}"))
    }

    /// Reads a plan of the machine, which need not be sound.
    pub(crate) fn read(csv: &str, machine: &Machine) -> Result<Self, String> {
        let mut comments: BTreeMap<&str, &str> = BTreeMap::new();
        for line in csv.lines().map_while(|line| line.strip_prefix("# ")) {
            let (key, value) = line.split_once(": ").ok_or("a comment is a key and a value")?;
            comments.insert(key, value);
        }
        let comment = |key: &str| comments.get(key).copied().ok_or(format!("no {key}"));
        if (comment("plotplan")?, comment("machine")?) != ("1", machine.name) {
            return Err("the plan of another machine".to_owned());
        }
        let mut lines = csv.lines().skip_while(|line| line.starts_with('#'));
        let head = format!("t_us,pen,{},{}", machine.motors[0], machine.motors[1]);
        if lines.next() != Some(&head) {
            return Err(format!("no line {head}"));
        }
        let row = |line: &str| {
            let fields: Option<Vec<i64>> = line.split(',').map(|field| field.parse().ok()).collect();
            let Some([t_us, pen, first, second]) = fields.as_deref() else {
                return Err(format!("four whole numbers: {line}"));
            };
            Ok(Row { t_us: *t_us, pen: *pen, ticks: [*first, *second] })
        };
        let mut stated = [[NO_JERK_LIMIT; 3]; 2];
        for (limits, motor) in stated.iter_mut().zip(machine.motors) {
            let text = comment(&format!("limits {motor}"))?;
            let found: Vec<f64> = text.split_whitespace().filter_map(|word| word.parse().ok()).collect();
            let has_jerk = machine.limits.is_some_and(|limits| limits[0][2].is_finite());
            if found.len() != if has_jerk { 3 } else { 2 } {
                return Err(format!("limits {text}"));
            }
            limits[..found.len()].copy_from_slice(&found);
        }
        let placement: Option<Vec<f64>> =
            comment("placement")?.split_whitespace().map(|word| word.parse().ok()).collect();
        let placement = placement.and_then(|values| values.try_into().ok()).ok_or("placement")?;
        let rows = lines.map(row).collect::<Result<Vec<Row>, String>>()?;
        Ok(Self { placement, limits: machine.limits.unwrap_or(stated), rows })
    }

    /// Drawing mm to machine mm.
    pub(crate) fn place(&self, [x, y]: Point) -> Point {
        let [a, b, c, d, e, f] = self.placement;
        [a * x + c * y + e, b * x + d * y + f]
    }

    pub(crate) fn scale(&self) -> f64 {
        libm::hypot(self.placement[0], self.placement[1])
    }

    /// The ink: motors move linearly from row to row, and drag the mechanism behind them where they have
    /// play; chords of at most 0.2 mm, of 0.02 mm where a motor crosses its play.
    pub(crate) fn ink(&self, machine: &Machine) -> Ink {
        let mut ink = Ink::new();
        let mut pen = 0;
        let Some(first) = self.rows.first() else { return ink };
        // Where the mechanism is, in ticks: in the middle of the play at the start.
        let mut dragged = first.ticks.map(|ticks| ticks as f64);
        let drag = |at: [f64; 2], motors: [f64; 2]| {
            [0, 1].map(|k: usize| {
                let half = 0.5 * machine.backlash[k];
                at[k].max(motors[k] - half).min(motors[k] + half)
            })
        };
        for pair in self.rows.windows(2) {
            let [from, to] = [pair[0], pair[1]].map(|row| row.ticks.map(|ticks| ticks as f64));
            let (begin, end) = (dragged, drag(dragged, to));
            dragged = end;
            if pair[0].pen == 0 {
                pen = 0;
                continue;
            }
            let lines = ink.entry(pair[0].pen).or_default();
            if pen != pair[0].pen {
                pen = pair[0].pen;
                lines.push(vec![(machine.forward)(begin)]);
            }
            let crosses = (0..2).any(|k| ((end[k] - begin[k]) - (to[k] - from[k])).abs() > 1e-9);
            let chord = if crosses { STEP } else { 0.2 };
            // At most 2 m between two rows, for plans that are not sound.
            let parts = (distance((machine.forward)(begin), (machine.forward)(end)) / chord).ceil().min(1e4);
            let mut at = begin;
            for part in 1..=parts as i64 {
                let share = part as f64 / parts;
                at = drag(at, [0, 1].map(|motor| from[motor] + share * (to[motor] - from[motor])));
                lines.last_mut().expect("just begun").push((machine.forward)(at));
            }
        }
        ink
    }

    /// The largest displacement of the pen by half a tick of both motors, where it draws, mm.
    pub(crate) fn quantization_error(&self, machine: &Machine) -> f64 {
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
pub(crate) fn strokes(hpgl: &str) -> Ink {
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
pub(crate) struct Pieces {
    all: Vec<[Point; 2]>,
    /// Lower left corner of the grid, and its size in cells.
    origin: Point,
    size: [usize; 2],
    cells: Vec<Vec<u32>>,
}

impl Pieces {
    pub(crate) fn new(lines: &[Vec<Point>]) -> Self {
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
    pub(crate) fn add(&mut self, piece: [Point; 2]) {
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

    pub(crate) fn cell(&self, p: Point) -> [i32; 2] {
        [0, 1].map(|axis| (p[axis] - self.origin[axis]).floor() as i32)
    }

    /// Distance to the nearest piece, if that is at most 0.8 mm; otherwise a larger value.
    pub(crate) fn distance(&self, p: Point) -> f64 {
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
    pub(crate) fn beyond(&self, lines: &[Vec<Point>], allowed: f64) -> Option<(Point, f64)> {
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
pub(crate) fn pieces(line: &[Point]) -> impl Iterator<Item = [Point; 2]> + '_ {
    let dot = (line.len() == 1).then(|| [line[0], line[0]]);
    line.windows(2).map(|ends| [ends[0], ends[1]]).chain(dot)
}

pub(crate) fn between([from, to]: [Point; 2], share: f64) -> Point {
    [from[0] + share * (to[0] - from[0]), from[1] + share * (to[1] - from[1])]
}

pub(crate) fn to_piece(p: Point, [from, to]: [Point; 2]) -> f64 {
    let (v, w) = ([to[0] - from[0], to[1] - from[1]], [p[0] - from[0], p[1] - from[1]]);
    let square = v[0] * v[0] + v[1] * v[1];
    let along = if square > 0.0 { ((w[0] * v[0] + w[1] * v[1]) / square).clamp(0.0, 1.0) } else { 0.0 };
    distance(p, between([from, to], along))
}

/// Checks a plan of this drawing; `drawing_error` is the error of the drawing itself, mm.
pub(crate) fn check_plan(
    plan: &Plan,
    machine: &Machine,
    drawing: &Ink,
    drawing_error: f64,
    tolerance: f64,
) -> Result<(), String> {
    check_motion(plan, machine)?;
    let ink = plan.ink(machine);
    let pens = |ink: &Ink| ink.keys().copied().collect::<Vec<_>>();
    if pens(&ink) != pens(drawing) {
        return Err(format!("pens {:?} instead of {:?}", pens(&ink), pens(drawing)));
    }
    let allowed =
        tolerance + plan.quantization_error(machine) + STEP / 2.0 + drawing_error * plan.scale() + 1e-3;
    for (pen, lines) in drawing {
        let placed: Vec<Vec<Point>> =
            lines.iter().map(|line| line.iter().map(|p| plan.place(*p)).collect()).collect();
        let drawn = &ink[pen];
        if let Some(deviating) = Pieces::new(&placed).beyond(drawn, allowed) {
            return Err(format!("ink of pen {pen} deviates by more than {allowed} mm: {deviating:?}"));
        }
        if let Some(uncovered) = Pieces::new(drawn).beyond(&placed, allowed) {
            return Err(format!(
                "pen {pen} leaves a part uncovered by more than {allowed} mm: {uncovered:?}"
            ));
        }
    }
    Ok(())
}

/// Checks the rows of a plan: start, end, time, pen, joint ranges, and the limits by
/// [`Differences`].
pub(crate) fn check_motion(plan: &Plan, machine: &Machine) -> Result<(), String> {
    let rows = &plan.rows;
    let (Some(first), Some(last)) = (rows.first(), rows.last()) else { return Err("no rows".to_owned()) };
    if (first.t_us, first.pen, first.ticks) != (0, 0, machine.start) {
        return Err(format!("the first row is {first:?}"));
    }
    if (last.pen, last.ticks) != (0, machine.start) {
        return Err(format!("the last row is {last:?}"));
    }
    let mut differences = [Differences::default(); 2];
    let mut check = |row: usize, step: [f64; 2]| {
        (0..2).try_for_each(|motor| {
            let result = differences[motor].step(step[motor], plan.limits[motor], machine.period_us);
            result.map_err(|excess| format!("row {row}, motor {motor}: {excess}"))
        })
    };
    let mut pen_until = 0;
    for (index, pair) in rows.windows(2).enumerate() {
        let (from, to) = (pair[0], pair[1]);
        let step = [to.ticks[0] - from.ticks[0], to.ticks[1] - from.ticks[1]];
        let lasts = to.t_us - from.t_us;
        let periods = (lasts as f64 / machine.period_us as f64).round().max(1.0);
        let as_planned = lasts == machine.period_us || step == [0, 0] && lasts > machine.period_us;
        let any_time = lasts > 0 && (step == [0, 0] || lasts >= machine.period_us);
        if !(as_planned || any_time && !machine.every_period) {
            return Err(format!("row {index} lasts {lasts} us"));
        }
        let pen_before = index.checked_sub(1).map_or(0, |index| rows[index].pen);
        if from.pen != pen_before {
            // From one pen to another the pen goes up and down.
            let moves = if from.pen != 0 && pen_before != 0 { 2 } else { 1 };
            pen_until = from.t_us + moves * machine.pen_us;
        }
        if step != [0, 0] && from.t_us < pen_until {
            return Err(format!("row {index} moves while the pen does"));
        }
        // Rows at rest are omitted; three of them end all differences.
        let steps = if step == [0, 0] { periods.min(3.0) } else { periods };
        for _ in 0..steps as i64 {
            check(index, step.map(|step| step as f64 / steps))?;
        }
        if !(machine.allowed)(to.ticks.map(|ticks| ticks as f64)) {
            return Err(format!("row {index} is out of range"));
        }
    }
    // At rest after the last row.
    (0..3).try_for_each(|_| check(rows.len() - 1, [0.0, 0.0]))
}

/// The last step and the last second difference of a motor, ticks. A plan starts at rest.
#[derive(Clone, Copy, Default)]
pub(crate) struct Differences {
    step: f64,
    second: f64,
}

impl Differences {
    /// Checks the differences of a step of one period `T` against `v T + 1`, `a T² + 2` and
    /// `j T³ + 4`.
    pub(crate) fn step(&mut self, step: f64, [v, a, j]: Limits, period_us: i64) -> Result<(), String> {
        let second = step - self.step;
        let third = second - self.second;
        *self = Self { step, second };
        let t = period_us as f64 * 1e-6;
        for (found, most) in [(step, v * t + 1.0), (second, a * t * t + 2.0), (third, j * t * t * t + 4.0)] {
            if found.abs() > most + 1e-9 {
                return Err(format!(
                    "{found} ticks, allowed {most} (step {step}, second {second}, third {third})"
                ));
            }
        }
        Ok(())
    }
}
