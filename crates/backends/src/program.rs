//! Programs: the lines for one machine, and how to stop and resume anywhere in them.

use std::fmt;
use std::sync::Arc;

use kinematics::{Machine, Play};
use plan::{Header, Row, TickTable};

use crate::{Unrepresentable, retime};

/// One line of a program.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Line {
    /// What is sent, without the line end.
    pub text: String,
    /// Index of the plan's row reached when the line is done; for a file in the machine's own language, the line's number.
    pub row: u64,
    /// How long it takes, microseconds.
    pub duration_us: u64,
    /// Position that the machine reports after it, in the unit of its reports; `None` if the line does not move.
    pub position: Option<[i64; 2]>,
    /// A comment for the operator, shown where the machine pauses at this line.
    pub comment: String,
}

/// Lines that a machine may have executed without an acknowledgement having arrived.
const UNACKNOWLEDGED: usize = 64;
/// How long a line takes that is added on resuming, microseconds.
const RESUME_LINE_US: u64 = 1_000_000;
/// How long the pen has to lift on a stop, microseconds.
const LIFT_US: u64 = 500_000;

/// Encodes rows of motor positions as lines: what a program of rows needs in order to be stopped and resumed.
pub trait RowEncoder: fmt::Debug + Send + Sync {
    /// The lines of a plan that starts at `start` ticks; [`Line::row`] is an index into `table`. A `resumed` program must
    /// not reset what the machine knows about its motors.
    ///
    /// # Errors
    /// A row that the firmware cannot execute.
    fn lines(&self, table: &TickTable, start: [i64; 2], resumed: bool) -> Result<Vec<Line>, Unrepresentable>;

    /// The lines that lift the pen where the machine is, after the lines that are `done`.
    fn lift(&self, done: &[Line]) -> Vec<Line>;

    /// The position that the machine reports at `ticks`, for a plan that starts at `start` ticks.
    fn reported_position(&self, ticks: [i64; 2], _start: [i64; 2]) -> [i64; 2] {
        ticks
    }

    /// The inverse of [`Self::reported_position`].
    fn ticks_at(&self, position: [i64; 2], _start: [i64; 2]) -> [i64; 2] {
        position
    }
}

/// The machine's own language: what a program of its lines needs in order to be stopped and resumed.
pub trait LineLanguage: fmt::Debug + Send + Sync {
    /// The lines that lift the pen.
    fn lift(&self) -> Vec<String>;

    /// The lines that restore the state after `done`: modes, position, pen.
    fn resume(&self, done: &[Line]) -> Vec<Line>;

    /// Largest deviation of a reported position from the commanded one, per axis.
    fn position_tolerance(&self) -> u64 {
        0
    }
}

/// A table of rows, encoded.
#[derive(Clone, Debug)]
struct EncodedTable {
    table: TickTable,
    encoder: Arc<dyn RowEncoder>,
    /// Index in the whole plan of each row of `table`.
    origin: Vec<u64>,
    /// Index in `table` of the row that each line of the program reaches.
    reached: Vec<usize>,
    /// Where the motors of the whole plan start, ticks.
    start: [i64; 2],
    resumed: bool,
    /// The play of the motors of a machine with backlash, at the start of the whole plan.
    play: Option<Play>,
}

#[derive(Clone, Debug)]
enum Source {
    Table(Box<EncodedTable>),
    Language(Arc<dyn LineLanguage>),
    /// Lines of unknown meaning.
    Opaque,
}

/// What is sent to a machine.
#[derive(Clone, Debug)]
pub struct Program {
    /// The lines.
    pub lines: Vec<Line>,
    /// The row where the machine is before the first line: 0, or where the program was resumed.
    first_row: u64,
    source: Source,
}

/// Why a program cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ProgramError {
    /// The plan has no such row.
    #[error("the plan has rows 0 to {last}, not {row}")]
    NoRow {
        /// The row asked for.
        row: u64,
        /// The last row.
        last: u64,
    },
    /// The plan has no rows.
    #[error("the plan has no rows")]
    Empty,
    /// The format cannot represent the plan.
    #[error(transparent)]
    Unrepresentable(#[from] Unrepresentable),
}

/// The rows from `row` on, starting at `position` ticks with the pen up: travel, pen down if it was down, and the rest of
/// the rows, accelerating from rest. With each row's index in `table`.
///
/// With `play` the last part of the travel takes up the backlash: the mechanism is then where it is in the plan.
fn resume(table: &TickTable, row: usize, position: [i64; 2], play: Option<Play>) -> (TickTable, Vec<u64>) {
    let rows = &table.rows;
    let index = row as u64;
    let period_us = table.header.period_us.max(1);
    let mut new = vec![Row { t_us: 0, pen: 0, ticks: position }];
    let mut origin = vec![index];
    let mut push = |new: &mut Vec<Row>, duration_us: u64, ticks: [i64; 2], pen: u16, index: u64| {
        let t_us = new.last().map_or(0, |row| row.t_us) + duration_us;
        new.push(Row { t_us, pen, ticks });
        origin.push(index);
    };
    let mut from = position;
    for to in
        play.map_or_else(Vec::new, |play| approach(rows, row, play)).into_iter().chain([rows[row].ticks])
    {
        for ticks in retime::travel(&table.header, from, to) {
            push(&mut new, period_us, ticks, 0, index);
        }
        from = to;
    }
    if rows[row].pen != 0 {
        if new.len() == 1 {
            push(&mut new, period_us, rows[row].ticks, 0, index);
        }
        // Where the plan itself lowers the pen, it also waits for it.
        let waits = row > 0 && rows[row - 1].pen == 0;
        if let Some(here) = new.last_mut() {
            here.pen = rows[row].pen;
        }
        if !waits {
            push(&mut new, retime::pen_time_us(table, true), rows[row].ticks, rows[row].pen, index);
        }
    }
    for (to, duration_us) in retime::accelerate(table, row) {
        push(&mut new, duration_us, rows[to].ticks, rows[to].pen, to as u64);
    }
    (with_rows(&table.header, new), origin)
}

/// Where the motors go before row `row` of a plan so that the mechanism gets to where it is in the plan, whatever the
/// play between them was: beyond it, and back by more than the play to where they move it.
fn approach(rows: &[Row], row: usize, mut play: Play) -> Vec<[i64; 2]> {
    for row in &rows[..=row] {
        play.follow(row.ticks.map(|ticks| ticks as f64));
    }
    let (loads, backlash) = (play.loads(), play.backlash());
    let mut ways = [[0; 2]; 2];
    for motor in 0..2 {
        let ticks = rows[row].ticks[motor];
        // From the side on which the motor leads in the plan.
        let side = if (ticks as f64) < loads[motor] { -1.0 } else { 1.0 };
        let taken_up = loads[motor] + 0.5 * side * backlash[motor];
        let beyond = taken_up - side * 2.0 * backlash[motor];
        ways[0][motor] = if backlash[motor] > 0.0 { beyond.round() as i64 } else { ticks };
        ways[1][motor] = if backlash[motor] > 0.0 { taken_up.round() as i64 } else { ticks };
    }
    ways.into()
}

/// The rows up to `row`, then to rest as soon as the limits allow, pen up. With each row's index in `table`.
fn stop_after(table: &TickTable, row: usize) -> (TickTable, Vec<u64>) {
    let mut rows: Vec<Row> = table.rows[..=row].to_vec();
    let mut origin: Vec<u64> = (0..=row as u64).collect();
    for (to, duration_us) in retime::decelerate(table, row) {
        let t_us = rows.last().map_or(0, |row| row.t_us) + duration_us;
        rows.push(Row { t_us, ..table.rows[to] });
        origin.push(to as u64);
    }
    let lift_us = retime::pen_time_us(table, false);
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
    (with_rows(&table.header, rows), origin)
}

fn with_rows(header: &Header, rows: Vec<Row>) -> TickTable {
    let duration_us = rows.last().map_or(0, |row| row.t_us);
    TickTable { header: Header { rows: rows.len() as u64, duration_us, ..header.clone() }, rows }
}

impl EncodedTable {
    /// Encodes it: the lines, with rows of the whole plan.
    fn encode(mut self) -> Result<Program, ProgramError> {
        let mut lines = self.encoder.lines(&self.table, self.start, self.resumed)?;
        self.reached = lines.iter().map(|line| line.row as usize).collect();
        for line in &mut lines {
            line.row = self.origin[line.row as usize];
        }
        let first_row = self.origin.first().copied().unwrap_or(0);
        Ok(Program { lines, first_row, source: Source::Table(Box::new(self)) })
    }

    fn resumed_at(&self, row: u64, position: Option<[i64; 2]>) -> Result<Program, ProgramError> {
        let last = self.table.rows.len() as u64 - 1;
        if row > last {
            return Err(ProgramError::NoRow { row, last });
        }
        let position =
            position.map_or(self.table.rows[row as usize].ticks, |at| self.encoder.ticks_at(at, self.start));
        let (table, origin) = resume(&self.table, row as usize, position, self.play);
        Self {
            table,
            origin,
            encoder: Arc::clone(&self.encoder),
            reached: Vec::new(),
            start: self.start,
            resumed: true,
            play: None,
        }
        .encode()
    }

    fn row_at_position(&self, from: u64, position: [i64; 2]) -> Option<u64> {
        let rows = self.table.rows.iter().zip(0..).skip(from as usize).take(UNACKNOWLEDGED);
        let at = |row: &Row| self.encoder.reported_position(row.ticks, self.start);
        rows.into_iter().find(|(row, _)| at(row) == position).map(|(_, index)| index)
    }

    /// Whether the first `lines` lines end with the rest in which the pen is lifted.
    fn is_lifted_after(&self, lines: usize) -> bool {
        let Some(&row) = self.reached.get(lines - 1) else { return false };
        let rows = &self.table.rows;
        row >= 2
            && [rows[row - 2].pen != 0, rows[row - 1].pen == 0, rows[row].pen == 0] == [true; 3]
            && rows[row - 1].ticks == rows[row].ticks
    }

    /// As [`Program::stop_sequence`]; `sent` is not empty.
    fn stop_sequence(&self, sent: &[Line]) -> Result<(Vec<Line>, u64), ProgramError> {
        let last = self.reached.get(sent.len() - 1).or(self.reached.last()).copied().unwrap_or(0);
        let (table, stopped) = stop_after(&self.table, last);
        let origin: Vec<u64> = stopped.iter().map(|index| self.origin[*index as usize]).collect();
        let row = origin.last().copied().unwrap_or(0);
        let encoder = Arc::clone(&self.encoder);
        let (start, resumed) = (self.start, self.resumed);
        let cut = Self { table, origin, encoder, reached: Vec::new(), start, resumed, play: None };
        let mut lines = cut.encode()?.lines;
        // What was sent is the same up to here, but for the counts in a first line.
        let mut tail = lines.split_off(sent.len().min(lines.len()));
        if tail.is_empty() {
            tail = self.encoder.lift(sent);
        }
        Ok((tail, row))
    }
}

impl Program {
    /// A plan's rows in the encoder's lines.
    ///
    /// # Errors
    /// A plan without rows, or a row that the firmware cannot execute.
    pub fn of_table(table: TickTable, encoder: Arc<dyn RowEncoder>) -> Result<Self, ProgramError> {
        let start = table.rows.first().ok_or(ProgramError::Empty)?.ticks;
        let origin = (0..table.rows.len() as u64).collect();
        EncodedTable { table, encoder, origin, reached: Vec::new(), start, resumed: false, play: None }
            .encode()
    }

    /// The same for rows that go on from where the machine stands. `start` is where the motors of the machine's
    /// first plan started, ticks: what positions that it reports count from.
    ///
    /// # Errors
    /// As [`Self::of_table`].
    pub fn continuing(
        table: TickTable,
        encoder: Arc<dyn RowEncoder>,
        start: [i64; 2],
    ) -> Result<Self, ProgramError> {
        if table.rows.is_empty() {
            return Err(ProgramError::Empty);
        }
        let origin = (0..table.rows.len() as u64).collect();
        EncodedTable { table, encoder, origin, reached: Vec::new(), start, resumed: true, play: None }
            .encode()
    }

    /// Lines in the machine's own language.
    pub fn of_lines(lines: Vec<Line>, language: Arc<dyn LineLanguage>) -> Self {
        Self { lines, first_row: 0, source: Source::Language(language) }
    }

    /// Bytes of a file that are sent line by line as they are, line ends included. It can be stopped after any line;
    /// what lifts the pen is not known.
    pub fn opaque(text: &str) -> Self {
        let line = |(row, text): (u64, &str)| Line { text: text.to_owned(), row, ..Line::default() };
        let lines = (1..).zip(text.split_inclusive('\n')).map(line).collect();
        Self { lines, first_row: 0, source: Source::Opaque }
    }

    /// On this machine: where its motors have backlash, a program of rows takes it up when it is resumed.
    pub fn on_machine(mut self, machine: &Machine) -> Self {
        if let Source::Table(table) = &mut self.source {
            let start = table.start.map(|ticks| ticks as f64);
            table.play = machine.has_backlash().then(|| Play::new(machine, start));
        }
        self
    }

    /// The same from row `row` on. `position` is where the machine reports to be, where the program depends on it.
    ///
    /// # Errors
    /// When there is no such row, or its rows cannot be encoded.
    pub fn from_row(&self, row: u64, position: Option<[i64; 2]>) -> Result<Self, ProgramError> {
        let language = match &self.source {
            Source::Table(table) => return table.resumed_at(row, position),
            Source::Language(language) => Some(language),
            Source::Opaque => None,
        };
        let last = self.lines.last().map_or(0, |line| line.row);
        if row > last {
            return Err(ProgramError::NoRow { row, last });
        }
        let (done, rest) = self.lines.split_at(self.lines.partition_point(|line| line.row <= row));
        let mut lines = language.map_or_else(Vec::new, |language| language.resume(done));
        for line in &mut lines {
            (line.row, line.duration_us) = (row, RESUME_LINE_US);
        }
        lines.extend_from_slice(rest);
        Ok(Self { lines, first_row: row, source: self.source.clone() })
    }

    /// The row of a machine that reports `position`: row `from`, or one of those that it may have reached after it without
    /// an acknowledgement. `None` if it is none of them.
    pub fn row_at_position(&self, from: u64, position: [i64; 2]) -> Option<u64> {
        let language = match &self.source {
            Source::Table(table) => return table.row_at_position(from, position),
            Source::Language(language) => language,
            Source::Opaque => return None,
        };
        let tolerance = language.position_tolerance();
        let near = |at: [i64; 2]| (0..2).all(|axis| at[axis].abs_diff(position[axis]) <= tolerance);
        let mut here = None;
        let mut found: Option<u64> = None;
        for line in self.lines.iter().take_while(|line| line.row <= from + UNACKNOWLEDGED as u64) {
            here = line.position.or(here);
            if line.row >= from && here.is_some_and(near) {
                found = found.or(Some(line.row));
            }
        }
        found
    }

    /// The lines that lift the pen where the machine is, after the lines that are `done`.
    pub fn lift(&self, done: &[Line]) -> Vec<Line> {
        let row = done.last().map_or(0, |last| last.row);
        match &self.source {
            Source::Table(table) => {
                let lift = table.encoder.lift(done).into_iter();
                lift.map(|line| Line { row, ..line }).collect()
            }
            Source::Language(language) => {
                let line = |text| Line { text, row, duration_us: LIFT_US, ..Line::default() };
                language.lift().into_iter().map(line).collect()
            }
            Source::Opaque => Vec::new(),
        }
    }

    /// What follows the first `sent` lines so that the machine comes to rest with the pen up, and the row where it then
    /// is: the row for [`Self::from_row`].
    pub fn stop_sequence(&self, sent: usize) -> (Vec<Line>, u64) {
        let sent = &self.lines[..sent];
        let Some(last) = sent.last() else { return (Vec::new(), self.first_row) };
        let stop = match &self.source {
            Source::Table(table) => table.stop_sequence(sent).ok(),
            Source::Language(_) | Source::Opaque => None,
        };
        // Rows stretched in time may no longer fit the firmware's clock: then the pen at least goes up.
        stop.unwrap_or_else(|| (self.lift(sent), last.row))
    }

    /// The smallest number of lines, at least `sent`, after which the pen is up and the motors are at rest: where a sender
    /// may pause. `None` if only the end of the program is such a place.
    pub fn next_pen_up(&self, sent: usize) -> Option<usize> {
        (sent.max(1)..self.lines.len()).find(|lines| self.is_pen_up_after(*lines))
    }

    fn is_pen_up_after(&self, lines: usize) -> bool {
        match &self.source {
            Source::Table(table) => table.is_lifted_after(lines),
            Source::Language(language) => {
                let lift = language.lift();
                let last = &self.lines[lines.saturating_sub(lift.len())..lines];
                !lift.is_empty() && last.iter().map(|line| &line.text).eq(&lift)
            }
            Source::Opaque => false,
        }
    }

    /// Replaces everything after the first `sent` lines by the stop sequence; the row where the machine then is.
    pub(crate) fn stop_after(&mut self, sent: usize) -> u64 {
        let (tail, row) = self.stop_sequence(sent);
        self.lines.truncate(sent);
        self.lines.extend(tail);
        row
    }

    /// The row reached once the first `lines` lines are done.
    pub(crate) fn row(&self, lines: usize) -> u64 {
        lines.checked_sub(1).map_or(self.first_row, |last| self.lines[last].row)
    }

    /// How long all of it takes, microseconds.
    pub fn duration_us(&self) -> u64 {
        self.lines.iter().map(|line| line.duration_us).sum()
    }

    /// The rows, where the program is made of motor positions.
    pub fn table(&self) -> Option<&TickTable> {
        match &self.source {
            Source::Table(table) => Some(&table.table),
            _ => None,
        }
    }

    /// The position that the machine reports at the start of the plan, where the program is made of motor positions.
    pub fn start_position(&self) -> Option<[i64; 2]> {
        match &self.source {
            Source::Table(table) => Some(table.encoder.reported_position(table.start, table.start)),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use plan::{Limits, Motor};

    use super::*;

    /// Takes rows of exactly one period: retimed rows are not representable.
    #[derive(Debug)]
    struct OnePeriod;

    impl RowEncoder for OnePeriod {
        fn lines(
            &self,
            table: &TickTable,
            _start: [i64; 2],
            _resumed: bool,
        ) -> Result<Vec<Line>, Unrepresentable> {
            let line = |row: usize| Line { text: format!("move {row}"), row: row as u64, ..Line::default() };
            (1..table.rows.len())
                .map(|row| match table.rows[row].t_us - table.rows[row - 1].t_us {
                    10_000 => Ok(line(row)),
                    _ => Err(Unrepresentable::Uneven { row: row as u64, period_us: 10_000 }),
                })
                .collect()
        }

        fn lift(&self, _done: &[Line]) -> Vec<Line> {
            vec![Line { text: "lift".to_owned(), ..Line::default() }]
        }
    }

    fn table(rows: usize) -> TickTable {
        let limits = Limits { speed: 4000.0, acceleration: 40_000.0, jerk: None };
        let motor = |name: &str| Motor { name: name.to_owned(), limits };
        let row = |k: usize| Row { t_us: 10_000 * k as u64, pen: 1, ticks: [40 * k as i64, 0] };
        TickTable {
            header: Header {
                machine: "made up".to_owned(),
                motors: [motor("a"), motor("b")],
                placement: [1.0, 0.0, 0.0, 1.0, 0.0, 0.0],
                period_us: 10_000,
                rows: rows as u64,
                lift_overlap_us: 0,
                rounding: plan::Rounding::Nearest,
                pen_colors: std::collections::BTreeMap::new(),
                duration_us: 10_000 * (rows as u64 - 1),
            },
            rows: (0..rows).map(row).collect(),
        }
    }

    #[test]
    fn stop_lifts_the_pen_although_retimed_rows_are_not_representable() -> Result<(), ProgramError> {
        let program = Program::of_table(table(50), Arc::new(OnePeriod))?;
        let (tail, row) = program.stop_sequence(20);
        assert_eq!((tail.len(), tail[0].text.as_str(), row), (1, "lift", 20));
        Ok(())
    }

    /// Any rows.
    #[derive(Debug)]
    struct AnyRows;

    impl RowEncoder for AnyRows {
        fn lines(
            &self,
            table: &TickTable,
            _start: [i64; 2],
            _resumed: bool,
        ) -> Result<Vec<Line>, Unrepresentable> {
            let lines = 1..table.rows.len() as u64;
            Ok(lines.map(|row| Line { row, ..Line::default() }).collect())
        }

        fn lift(&self, _done: &[Line]) -> Vec<Line> {
            Vec::new()
        }
    }

    /// Wherever the motors stopped, and wherever the mechanism is in their play.
    #[test]
    fn resumed_plan_takes_up_the_backlash() -> Result<(), ProgramError> {
        use drawing::Rect;
        use kinematics::{Cartesian, MachineParts, Motor as MachineMotor};

        let mut motors = ["a", "b"].map(|name| MachineMotor::new(name, 10.0, 400.0, 4000.0));
        (motors[0].backlash_ticks, motors[1].backlash_ticks) = (30.0, 11.0);
        let parts = MachineParts::new("loose", Cartesian, motors, Rect::new(0.0, 0.0, 100.0, 100.0));
        let machine = Machine::new(parts).expect("a machine");
        let mut table = table(200);
        for (k, row) in table.rows.iter_mut().enumerate() {
            // There and back, with the pen up now and then.
            let k = k as i64;
            row.ticks = [10 * (100 - (k - 100).abs()), 7 * (40 - (k % 80 - 40).abs())];
            row.pen = u16::from(k % 50 > 5);
        }
        table.rows[0].ticks = [0, 0];
        let start = [0.0, 0.0];
        let mut loads = Vec::new();
        let mut play = Play::new(&machine, start);
        for row in &table.rows {
            play.follow(row.ticks.map(|ticks| ticks as f64));
            loads.push(play.loads());
        }
        let last = table.rows.len() - 1;
        let program = Program::of_table(table, Arc::new(AnyRows))?.on_machine(&machine);
        for row in [0, 1, 40, 90, 101, 103, 120, 160, 180] {
            for position in [[0, 0], [700, 90], [-50, 300]] {
                let resumed = program.from_row(row as u64, Some(position))?;
                let rows = &resumed.table().expect("rows").rows;
                for stood in [-0.5, 0.0, 0.5] {
                    // The mechanism stands somewhere within the play.
                    let at = position.map(|ticks| ticks as f64);
                    let mut play = Play::new(&machine, [at[0] + stood * 30.0, at[1] + stood * 11.0]);
                    let mut inked = false;
                    for step in rows {
                        play.follow(step.ticks.map(|ticks| ticks as f64));
                        if step.pen != 0 && !inked {
                            inked = true;
                            let near = loads[row..].iter().any(|load| {
                                (0..2).all(|motor| (load[motor] - play.loads()[motor]).abs() <= 0.51)
                            });
                            assert!(near, "row {row} from {position:?}, {stood}: {:?}", play.loads());
                        }
                    }
                    assert!(inked, "there is ink after row {row}");
                    let end = play.loads();
                    assert!((0..2).all(|motor| (end[motor] - loads[last][motor]).abs() <= 0.51), "{end:?}");
                }
            }
        }
        Ok(())
    }

    #[test]
    fn unrepresentable_and_empty_plans_are_errors() {
        let mut uneven = table(5);
        uneven.rows[3].t_us += 1;
        let refused = Program::of_table(uneven, Arc::new(OnePeriod));
        assert!(matches!(refused, Err(ProgramError::Unrepresentable(_))), "{refused:?}");
        let empty = TickTable { rows: Vec::new(), ..table(5) };
        assert!(matches!(Program::of_table(empty, Arc::new(OnePeriod)), Err(ProgramError::Empty)));
    }
}
