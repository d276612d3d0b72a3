//! What is to be said to a machine, line by line, and how to stop and to go on anywhere in it.

use crate::{Command, Instant, ebb};
use plan::{Header, Row, TickTable};

use crate::retime;

/// One line and what it does.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Step {
    /// The line, without its end.
    pub text: String,
    /// Index of the plan's row (of the file's command) that holds when the line has been done.
    pub row: u64,
    /// How long it takes, microseconds.
    pub lasts_us: u64,
    /// Where the machine says it is after it, in the unit in which it says so; nothing if the line does not move.
    pub place: Option<[i64; 2]>,
}

/// So many lines may have been taken by a machine before it was heard of.
const UNANSWERED: usize = 64;

/// How lines are made of rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dialect {
    /// Tick lines; places are ticks.
    Ticks,
    /// Seed 2's serial lines; it never says where it is.
    XySerial,
    /// G-code as grbl and its kin take it; places are micrometres.
    Gcode,
    /// An EBB's commands; places are steps since the plan's start.
    Ebb(ebb::Moves, ebb::Pen),
    /// Lines whose meaning is not known.
    Unknown,
}

/// What is to be said to a machine.
#[derive(Clone, Debug)]
pub struct Script {
    /// How lines are made.
    pub dialect: Dialect,
    /// The lines.
    pub steps: Vec<Step>,
    /// The plan that the lines were made of, where motors' rows are what is said.
    table: Option<TickTable>,
    /// The index in the whole plan of each row of `table`.
    origin: Vec<u64>,
    /// The lines that lift the pen.
    lift: Vec<String>,
    /// Where the motors of the whole plan start.
    start: [i64; 2],
}

/// Why a script cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ScriptError {
    /// The plan has no such row.
    #[error("the plan has rows 0 to {last}, not {row}")]
    NoRow {
        /// What was asked for.
        row: u64,
        /// The last there is.
        last: u64,
    },
    /// The format cannot say the plan.
    #[error(transparent)]
    Unfit(#[from] crate::Unfit),
    /// The file is not in the dialect.
    #[error("line {line}: {what}")]
    Foreign {
        /// Number of the line, from 1.
        line: usize,
        /// What is wrong with it.
        what: String,
    },
}

/// A plan that goes on with row `row` of `table`, its motors standing at `standing` with the pen up: travel there, the pen
/// down if it was, and the rest of the rows, setting out from rest. With each row's index in `table`.
///
/// # Errors
/// When there is no such row.
pub fn resume(table: &TickTable, row: u64, standing: [i64; 2]) -> Result<(TickTable, Vec<u64>), ScriptError> {
    let rows = &table.rows;
    let last = rows.len() as u64 - 1;
    if row > last {
        return Err(ScriptError::NoRow { row, last });
    }
    let at = row as usize;
    let period_us = table.header.period_us.max(1);
    let mut new = vec![Row { t_us: 0, pen: 0, ticks: standing }];
    let mut origin = vec![row];
    let mut push = |new: &mut Vec<Row>, lasts_us: u64, ticks: [i64; 2], pen: u16, index: u64| {
        let t_us = new.last().map_or(0, |row| row.t_us) + lasts_us;
        new.push(Row { t_us, pen, ticks });
        origin.push(index);
    };
    for ticks in retime::travel(&table.header, standing, rows[at].ticks) {
        push(&mut new, period_us, ticks, 0, row);
    }
    if rows[at].pen != 0 {
        if new.len() == 1 {
            push(&mut new, period_us, rows[at].ticks, 0, row);
        }
        // Where the plan itself lowers the pen, it also waits for it.
        let waits = at > 0 && rows[at - 1].pen == 0;
        if let Some(here) = new.last_mut() {
            here.pen = rows[at].pen;
        }
        if !waits {
            push(&mut new, retime::pen_time(table, true), rows[at].ticks, rows[at].pen, row);
        }
    }
    for (to, lasts_us) in retime::launch(table, at) {
        push(&mut new, lasts_us, rows[to].ticks, rows[to].pen, to as u64);
    }
    let header = Header {
        rows: new.len() as u64,
        duration_us: new.last().map_or(0, |row| row.t_us),
        ..table.header.clone()
    };
    Ok((TickTable { header, rows: new }, origin))
}

/// The plan up to row `at`, and then to rest as soon as the limits allow, pen up. With each row's index in `table`.
fn cut(table: &TickTable, at: usize) -> (TickTable, Vec<u64>) {
    let mut rows: Vec<Row> = table.rows[..=at].to_vec();
    let mut origin: Vec<u64> = (0..=at as u64).collect();
    for (to, lasts_us) in retime::brake(table, at) {
        let t_us = rows.last().map_or(0, |row| row.t_us) + lasts_us;
        rows.push(Row { t_us, ..table.rows[to] });
        origin.push(to as u64);
    }
    let lift_us = retime::pen_time(table, false);
    let was_down = rows.len() > 1 && rows[rows.len() - 2].pen != 0;
    let here = origin.last().copied().unwrap_or(0);
    if let Some(last) = rows.last_mut() {
        last.pen = 0;
        let rest = Row { t_us: last.t_us + lift_us, ..*last };
        if was_down {
            rows.push(rest);
            origin.push(here);
        }
    }
    let header = Header {
        rows: rows.len() as u64,
        duration_us: rows.last().map_or(0, |row| row.t_us),
        ..table.header.clone()
    };
    (TickTable { header, rows }, origin)
}

impl Script {
    /// A plan as tick lines.
    pub fn ticks(table: TickTable) -> Self {
        let origin = (0..table.rows.len() as u64).collect();
        Self::of_table(Dialect::Ticks, table, origin, None).unwrap_or_else(|_| Self::empty(Dialect::Ticks))
    }

    /// A plan as an EBB's commands.
    ///
    /// # Errors
    /// When the board cannot be told so.
    pub fn ebb(table: TickTable, moves: ebb::Moves, pen: ebb::Pen) -> Result<Self, ScriptError> {
        let origin = (0..table.rows.len() as u64).collect();
        Self::of_table(Dialect::Ebb(moves, pen), table, origin, None)
    }

    fn empty(dialect: Dialect) -> Self {
        Self { dialect, steps: Vec::new(), table: None, origin: Vec::new(), lift: Vec::new(), start: [0; 2] }
    }

    fn of_table(
        dialect: Dialect,
        table: TickTable,
        origin: Vec<u64>,
        start: Option<[i64; 2]>,
    ) -> Result<Self, ScriptError> {
        let start = start.unwrap_or_else(|| table.rows.first().map_or([0; 2], |row| row.ticks));
        let (steps, lift) = match dialect {
            Dialect::Ebb(moves, pen) => {
                let commands = ebb::commands(table.rows.iter().copied(), moves, pen)?;
                let place =
                    |row: u64| [0, 1].map(|motor| table.rows[row as usize].ticks[motor] - start[motor]);
                let step = |command: Command| Step {
                    place: Some(place(command.row)),
                    row: origin[command.row as usize],
                    text: command.text,
                    lasts_us: command.lasts_us,
                };
                (commands.into_iter().map(step).collect(), vec![ebb::Encoder::new(moves, pen).pen(false, 0)])
            }
            _ => (tick_steps(&table, &origin), Vec::new()),
        };
        Ok(Self { dialect, steps, table: Some(table), origin, lift, start })
    }

    /// A plan as seed 2's lines.
    ///
    /// # Errors
    /// When a point is out of the plotter's range.
    pub fn xy_serial(instants: impl IntoIterator<Item = Instant>) -> Result<Self, ScriptError> {
        let commands = crate::xy_serial::commands(instants)?;
        let steps = commands.into_iter().map(|command| Step {
            place: None,
            text: command.text,
            row: command.row,
            lasts_us: command.lasts_us,
        });
        Ok(Self { steps: steps.collect(), lift: vec!["p".to_owned()], ..Self::empty(Dialect::XySerial) })
    }

    /// Commands of G-code, as [`crate::gcode`] makes them.
    pub fn gcode(commands: impl IntoIterator<Item = Command>) -> Self {
        let mut state = GcodeState::default();
        let mut lift: Vec<String> = Vec::new();
        let mut steps = Vec::new();
        for mut command in commands {
            let words = command.text.split(';').next().unwrap_or_default().trim_end().len();
            command.text.truncate(words);
            let moved = state.accept(&command.text);
            // A program begins by lifting the pen: what stands before its first travel, mode words apart.
            let mode = ["G2", "G9", "G1"].iter().any(|word| command.text.starts_with(word));
            if steps.iter().all(|step: &Step| step.place.is_none()) && !moved && !mode {
                lift.push(command.text.clone());
            }
            steps.push(Step {
                place: moved.then_some(state.place),
                text: command.text,
                row: command.row,
                lasts_us: command.lasts_us,
            });
        }
        Self { steps, lift, ..Self::empty(Dialect::Gcode) }
    }

    /// Lines of a file in a machine's own words. `dialect` [`Dialect::Gcode`] and [`Dialect::XySerial`] are understood so far
    /// that a sender can stop and go on; comments and empty lines are left out.
    pub fn of_lines(dialect: Dialect, text: &str) -> Self {
        let separators = if matches!(dialect, Dialect::Ebb(..)) { &['\r', '\n'][..] } else { &['\n'][..] };
        let lines = text.split(separators).map(|line| line.split(';').next().unwrap_or_default().trim());
        let commands = (1..).zip(lines.filter(|line| !line.is_empty()));
        let commands = commands.map(|(row, line)| Command { text: line.to_owned(), row, lasts_us: 0 });
        if dialect == Dialect::Gcode {
            let mut state = GcodeState::default();
            return Self::gcode(
                commands.map(|command| Command { lasts_us: state.time(&command.text), ..command }),
            );
        }
        let steps = commands.map(|Command { text, row, lasts_us }| Step { text, row, lasts_us, place: None });
        let lift = if dialect == Dialect::XySerial { vec!["p".to_owned()] } else { Vec::new() };
        Self { steps: steps.collect(), lift, ..Self::empty(dialect) }
    }

    /// Bytes of a file that are sent line by line as they are.
    pub fn raw(text: &str) -> Self {
        let steps = (1..).zip(text.split_inclusive('\n')).map(|(row, line)| Step {
            text: line.to_owned(),
            row,
            lasts_us: 0,
            place: None,
        });
        Self { steps: steps.collect(), ..Self::empty(Dialect::Unknown) }
    }

    /// The same from row `row` on. `standing` is where the motors are, where the dialect counts from there.
    ///
    /// # Errors
    /// When there is no such row.
    pub fn from_row(&self, row: u64, standing: Option<[i64; 2]>) -> Result<Self, ScriptError> {
        if let Some(table) = &self.table {
            let last = table.rows.len() as u64 - 1;
            if row > last {
                return Err(ScriptError::NoRow { row, last });
            }
            let standing = standing.unwrap_or(table.rows[row as usize].ticks);
            let (resumed, origin) = resume(table, row, standing)?;
            let mut script = Self::of_table(self.dialect, resumed, origin, Some(self.start))?;
            if matches!(self.dialect, Dialect::Ebb(..)) {
                // `EM` would forget where the motors are.
                script.steps.retain(|step| !step.text.starts_with("EM"));
            }
            return Ok(script);
        }
        let last = self.steps.last().map_or(0, |step| step.row);
        if row > last {
            return Err(ScriptError::NoRow { row, last });
        }
        let done = self.steps.partition_point(|step| step.row <= row);
        let mut steps: Vec<Step> = Vec::new();
        let mut say = |text: String, place: Option<[i64; 2]>| {
            steps.push(Step { text, row, lasts_us: 1_000_000, place });
        };
        match self.dialect {
            Dialect::XySerial => {
                say("p".to_owned(), None);
                let is_pen = |step: &&Step| step.text.eq_ignore_ascii_case("p");
                if let Some(step) = self.steps[..done].iter().rev().find(|step| !is_pen(step)) {
                    say(step.text.clone(), None);
                }
                if self.steps[..done].iter().rev().find(is_pen).is_some_and(|step| step.text == "P") {
                    say("P".to_owned(), None);
                }
            }
            Dialect::Gcode => {
                let mut state = GcodeState::default();
                for step in &self.steps[..done] {
                    state.accept(&step.text);
                }
                for text in &self.lift {
                    say(text.clone(), None);
                }
                say("G21".to_owned(), None);
                say("G90".to_owned(), None);
                say("G17".to_owned(), None);
                say("G94".to_owned(), None);
                let place = self.steps[..done].iter().rev().find_map(|step| step.place);
                if let Some([x, y]) = place {
                    say(format!("G0 X{} Y{}", millimetres(x), millimetres(y)), place);
                }
                for text in GcodeState::lowering(&self.steps[..done], &self.lift) {
                    say(text, None);
                }
                if let Some(feed) = &state.feed {
                    say(feed.clone(), None);
                }
            }
            _ => {}
        }
        steps.extend_from_slice(&self.steps[done..]);
        Ok(Self { steps, ..self.clone() })
    }

    /// The row at which a machine is that says it stands at `place`, if that is row `from` or one of those that may have been
    /// done after it without an answer. The place is in the unit in which the dialect says it.
    pub fn standing_row(&self, from: u64, place: [i64; 2]) -> Option<u64> {
        if let Some(table) = &self.table {
            let start = if matches!(self.dialect, Dialect::Ebb(..)) { self.start } else { [0; 2] };
            let rows = table.rows.iter().zip(0..).skip(from as usize).take(UNANSWERED);
            let at = |row: &Row| [0, 1].map(|motor| row.ticks[motor] - start[motor]);
            return rows.into_iter().find(|(row, _)| at(row) == place).map(|(_, index)| index);
        }
        let mut here = None;
        let near = |at: [i64; 2]| (0..2).all(|axis| at[axis].abs_diff(place[axis]) <= crate::asking::BLUR_UM);
        let mut found: Option<u64> = None;
        for step in self.steps.iter().take_while(|step| step.row <= from + UNANSWERED as u64) {
            here = step.place.or(here);
            if step.row >= from && here.is_some_and(near) {
                found = found.or(Some(step.row));
            }
        }
        found
    }

    /// What follows instead after the lines that were `said`, the first of this script's, so that the machine comes to rest
    /// with the pen up; and the row where it then is, from which [`Self::from_row`] goes on.
    pub fn stopping(&self, said: &[Step]) -> (Vec<Step>, u64) {
        let row = said.last().map_or(0, |last| last.row);
        let Some(table) = &self.table else {
            let lift =
                self.lift.iter().map(|text| Step { text: text.clone(), row, lasts_us: 500_000, place: None });
            return (lift.collect(), row);
        };
        // The row within this table: what was sent last leads there.
        let moves = match self.dialect {
            Dialect::Ebb(..) => None,
            _ => Some(said.iter().filter(|step| step.text.starts_with("m ")).count()),
        };
        let at = moves.unwrap_or_else(|| self.ebb_row(said));
        let (cut_table, cut_origin) = cut(table, at);
        let origin: Vec<u64> = cut_origin.iter().map(|index| self.origin[*index as usize]).collect();
        let stop_row = origin.last().copied().unwrap_or(row);
        let Ok(script) = Self::of_table(self.dialect, cut_table, origin, Some(self.start)) else {
            return (Vec::new(), row);
        };
        // What was sent is the same up to here, but for the first line of tick lines and `EM`.
        let skipped = said.first().map_or(0, |first| {
            let begins = |steps: &[Step]| steps.first().is_some_and(|step| step.text.starts_with("EM"));
            usize::from(begins(&script.steps) && !first.text.starts_with("EM"))
        });
        let mut tail: Vec<Step> = script.steps.get(said.len() + skipped..).unwrap_or_default().to_vec();
        if let (Dialect::Ebb(..), Some(lift)) = (self.dialect, self.lift.first())
            && tail.is_empty()
        {
            tail.push(Step { text: lift.clone(), row: stop_row, lasts_us: 500_000, place: None });
        }
        (tail, stop_row)
    }

    /// The row of the table to which the commands that were `said` lead.
    fn ebb_row(&self, said: &[Step]) -> usize {
        let (Some(table), Dialect::Ebb(moves, pen)) = (&self.table, self.dialect) else { return 0 };
        let Ok(mut commands) = ebb::commands(table.rows.iter().copied(), moves, pen) else { return 0 };
        if said.first().is_some_and(|step| !step.text.starts_with("EM")) {
            commands.retain(|command| !command.text.starts_with("EM"));
        }
        said.len().checked_sub(1).map_or(0, |last| commands[last].row as usize)
    }

    /// How long all of it takes, microseconds.
    pub fn duration_us(&self) -> u64 {
        self.steps.iter().map(|step| step.lasts_us).sum()
    }

    /// The plan's limits and motors, where it is one of motors' rows.
    pub fn table(&self) -> Option<&TickTable> {
        self.table.as_ref()
    }

    /// Where the motors of the whole plan start, in ticks.
    pub fn start(&self) -> [i64; 2] {
        self.start
    }
}

/// Tick lines without comments, as [`plan::file::tick_lines`] writes them.
fn tick_steps(table: &TickTable, origin: &[u64]) -> Vec<Step> {
    let mut bytes = Vec::new();
    if plan::file::tick_lines::write(&table.header, table.rows.iter().copied(), &mut bytes).is_err() {
        return Vec::new();
    }
    let text = String::from_utf8_lossy(&bytes);
    let mut row = 0;
    let mut steps = Vec::new();
    for line in text.lines().filter(|line| !line.starts_with(';')) {
        let mut lasts_us = 0;
        let mut place = None;
        if line.starts_with("m ") {
            row += 1;
            lasts_us = table.rows[row].t_us - table.rows[row - 1].t_us;
            place = Some(table.rows[row].ticks);
        }
        steps.push(Step { text: line.to_owned(), row: origin[row], lasts_us, place });
    }
    steps
}

/// Micrometres as millimetres.
fn millimetres(micrometres: i64) -> String {
    let sign = if micrometres < 0 { "-" } else { "" };
    let size = micrometres.unsigned_abs();
    format!("{sign}{}.{:03}", size / 1000, size % 1000)
}

/// What G-code of our own leaves behind: place, feed.
#[derive(Clone, Debug, Default)]
struct GcodeState {
    place: [i64; 2],
    feed: Option<String>,
}

impl GcodeState {
    /// Takes a line in; whether it moves in x or y.
    fn accept(&mut self, text: &str) -> bool {
        let mut moved = false;
        if !text.starts_with('G') {
            return false;
        }
        for word in text.split_ascii_whitespace() {
            let Some((letter, number)) = word.split_at_checked(1) else { continue };
            let axis = match letter {
                "X" => 0,
                "Y" => 1,
                "F" if !text.contains("G93") && !text.contains('Z') => {
                    self.feed = Some(word.to_owned());
                    continue;
                }
                _ => continue,
            };
            if let Ok(mm) = number.parse::<f64>()
                && mm.abs() < 1e9
            {
                self.place[axis] = (mm * 1000.0).round() as i64;
                moved = true;
            }
        }
        moved
    }

    /// How long a line takes from here, microseconds: straight ways at their feed, dwells; accelerations left out.
    fn time(&mut self, text: &str) -> u64 {
        let from = self.place;
        let value = |letter: &str| {
            text.split_ascii_whitespace().find_map(|word| word.strip_prefix(letter)?.parse::<f64>().ok())
        };
        let seconds = if text.starts_with("G4") {
            value("P").unwrap_or(0.0)
        } else if !self.accept(text) {
            0.0
        } else if text.contains("G93") {
            60.0 / value("F").unwrap_or(60.0)
        } else {
            let way = [0, 1].map(|axis| (self.place[axis] - from[axis]) as f64 * 1e-3);
            let feed = if text.starts_with("G0") { None } else { self.feed.as_deref() };
            let feed = feed.and_then(|feed| feed.strip_prefix('F')?.parse().ok()).unwrap_or(3000.0);
            // A quarter of a circle is 1.11 times its chord.
            1.2 * libm::hypot(way[0], way[1]) * 60.0 / feed
        };
        (seconds * 1e6).clamp(0.0, 1e10) as u64
    }

    /// The lines that lower the pen again, if it is down after `done`: those that last moved it, unless `lift` has them.
    fn lowering(done: &[Step], lift: &[String]) -> Vec<String> {
        let mut lowering: Vec<String> = Vec::new();
        for Step { text, .. } in done {
            let sets =
                ["M3", "M280", "SET_SERVO"].iter().any(|word| text.starts_with(word)) || text.contains('Z');
            if sets {
                lowering.clear();
                if !lift.contains(text) {
                    lowering.extend(lift.iter().filter(|line| *line == "M400").cloned());
                    lowering.push(text.clone());
                }
            } else if text.starts_with("G4") && !lowering.is_empty() {
                lowering.push(text.clone());
            }
        }
        lowering
    }
}
