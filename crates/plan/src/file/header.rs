//! Shared by all plan formats: validity of headers and rows, and `key: value` lines.

use std::collections::BTreeMap;

use crate::{Header, Limits, MOTORS, Motor, Rounding, Row};

use super::text::{Line, shown};
use super::{HeaderError, ReadError, RowsError};

/// Whether a plan with this header can be written in every plan format.
///
/// A machine's name is 1 to 48 ASCII letters, digits, spaces or any of `_ . + - /`, with no space at either end. A
/// motor's name heads a column: an ASCII letter, then up to 19 letters, digits or any of `_ . -`; no two columns
/// share a name, and `t_us` and `pen` are taken. All coefficients and limits are finite. The rules
/// exclude every character that a serial sender may act on, and keep lines short.
pub fn check_header(header: &Header) -> Result<(), HeaderError> {
    if !is_machine_name(&header.machine) {
        return Err(HeaderError::MachineName(header.machine.clone()));
    }
    let mut columns = vec!["t_us", "pen"];
    for Motor { name, limits } in &header.motors {
        if !is_motor_name(name) {
            return Err(HeaderError::MotorName(name.clone()));
        }
        if columns.contains(&name.as_str()) {
            return Err(HeaderError::SameName(name.clone()));
        }
        columns.push(name);
        let Limits { speed, acceleration, jerk } = *limits;
        if !(speed.is_finite() && acceleration.is_finite() && jerk.unwrap_or(0.0).is_finite()) {
            return Err(HeaderError::NotFinite("a motor's limit"));
        }
    }
    if !header.placement.iter().all(|coefficient| coefficient.is_finite()) {
        return Err(HeaderError::NotFinite("a coefficient of the placement"));
    }
    Ok(())
}

fn is_machine_name(name: &str) -> bool {
    (1..=48).contains(&name.len())
        && name.bytes().all(|byte| byte.is_ascii_alphanumeric() || b" _.+-/".contains(&byte))
        && !name.starts_with(' ')
        && !name.ends_with(' ')
}

fn is_motor_name(name: &str) -> bool {
    (1..=20).contains(&name.len())
        && name.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"_.-".contains(&byte))
        && name.starts_with(|first: char| first.is_ascii_alphabetic())
}

/// Counts rows and checks that time starts at 0 and increases.
#[derive(Default)]
pub(crate) struct RowCheck {
    count: u64,
    t_us: u64,
}

impl RowCheck {
    pub(crate) fn count(&self) -> u64 {
        self.count
    }

    pub(crate) fn last_us(&self) -> u64 {
        self.t_us
    }

    /// Checks the next row's time.
    pub(crate) fn accept(&mut self, t_us: u64) -> Result<(), RowsError> {
        if self.count == 0 {
            if t_us != 0 {
                return Err(RowsError::Start { t_us });
            }
        } else if t_us <= self.t_us {
            return Err(RowsError::Order { row: self.count, t_us, before_us: self.t_us });
        }
        self.count += 1;
        self.t_us = t_us;
        Ok(())
    }

    /// Checks the next row of a plan that is written under `header`.
    pub(crate) fn accept_under(&mut self, header: &Header, row: &Row) -> Result<(), RowsError> {
        if self.count == header.rows {
            return Err(RowsError::Count { stated: header.rows, found: self.count + 1 });
        }
        self.accept(row.t_us)
    }

    /// Whether the rows agree with the header.
    pub(crate) fn finish(&self, stated_rows: u64, stated_us: u64) -> Result<(), RowsError> {
        if self.count == 0 {
            return Err(RowsError::None);
        }
        if self.count != stated_rows {
            return Err(RowsError::Count { stated: stated_rows, found: self.count });
        }
        if self.t_us != stated_us {
            return Err(RowsError::Duration { stated_us, found_us: self.t_us });
        }
        Ok(())
    }
}

/// The `key: value` comments before a plan's rows.
#[derive(Default)]
pub(crate) struct Notes<'a> {
    notes: Vec<(u64, &'a str, &'a str)>,
}

impl<'a> Notes<'a> {
    /// Stores a comment of the form `key: value`; ignores others.
    pub(crate) fn add(&mut self, number: u64, comment: &'a [u8]) {
        if let Ok(comment) = std::str::from_utf8(comment)
            && let Some((key, value)) = comment.split_once(':')
        {
            self.notes.push((number, key.trim(), value.trim()));
        }
    }

    fn find(&self, key: &str) -> Option<(u64, &'a str)> {
        self.notes.iter().find(|note| note.1 == key).map(|note| (note.0, note.2))
    }

    /// The value of `key` with its line number; `at` is the line that it must precede.
    pub(crate) fn text(&self, key: &str, at: Line) -> Result<(u64, &'a str), ReadError> {
        self.find(key).ok_or_else(|| ReadError::Unexpected {
            line: at.number,
            expected: format!("a comment `{key}: ...` before this line"),
            found: "none".to_owned(),
        })
    }

    /// Checks `plotplan: 1`.
    pub(crate) fn version(&self, at: Line) -> Result<(), ReadError> {
        match self.text("plotplan", at)? {
            (_, "1") => Ok(()),
            (line, found) => Err(ReadError::Version { line, found: shown(found.as_bytes()) }),
        }
    }

    /// An optional integer.
    pub(crate) fn count(&self, key: &str) -> Result<Option<u64>, ReadError> {
        let Some((line, value)) = self.find(key) else { return Ok(None) };
        match super::text::parse_unsigned(value.as_bytes()) {
            Some(count) => Ok(Some(count)),
            None => Err(ReadError::Unexpected {
                line,
                expected: format!("a whole number after `{key}:`"),
                found: shown(value.as_bytes()),
            }),
        }
    }

    /// How rows take whole ticks: to the nearest, unless it is stated.
    pub(crate) fn rounding(&self) -> Result<Rounding, ReadError> {
        let Some((line, value)) = self.find("rounding") else { return Ok(Rounding::Nearest) };
        Rounding::of_name(value).ok_or_else(|| ReadError::Unexpected {
            line,
            expected: "`nearest` or `path` after `rounding:`".to_owned(),
            found: shown(value.as_bytes()),
        })
    }

    /// `least` to `most` finite numbers.
    pub(crate) fn numbers(
        &self,
        key: &str,
        least: usize,
        most: usize,
        at: Line,
    ) -> Result<Vec<f64>, ReadError> {
        let (line, value) = self.text(key, at)?;
        let numbers: Option<Vec<f64>> = value
            .split_ascii_whitespace()
            .map(|word| word.parse().ok().filter(|number: &f64| number.is_finite()))
            .collect();
        match numbers {
            Some(numbers) if (least..=most).contains(&numbers.len()) => Ok(numbers),
            _ => {
                let count = if least == most { least.to_string() } else { format!("{least} to {most}") };
                Err(ReadError::Unexpected {
                    line,
                    expected: format!("{count} numbers after `{key}:`"),
                    found: shown(value.as_bytes()),
                })
            }
        }
    }

    /// The colours of pens: `pen 2 color: #cc0000`. Others mean nothing.
    pub(crate) fn pen_colors(&self) -> BTreeMap<u16, [u8; 3]> {
        let color = |&(_, key, value): &(u64, &str, &str)| {
            let pen = key.strip_prefix("pen ")?.strip_suffix(" color")?;
            Some((pen.parse().ok()?, color(value)?))
        };
        self.notes.iter().filter_map(color).collect()
    }

    /// Exactly `N` finite numbers.
    pub(crate) fn array<const N: usize>(&self, key: &str, at: Line) -> Result<[f64; N], ReadError> {
        let mut array = [0.0; N];
        array.copy_from_slice(&self.numbers(key, N, N, at)?);
        Ok(array)
    }

    /// One finite number.
    pub(crate) fn number(&self, key: &str, at: Line) -> Result<f64, ReadError> {
        self.numbers(key, 1, 1, at).map(|numbers| numbers[0])
    }

    /// One optional finite number.
    pub(crate) fn number_if_given(&self, key: &str, at: Line) -> Result<Option<f64>, ReadError> {
        if self.find(key).is_some() { self.number(key, at).map(Some) } else { Ok(None) }
    }
}

/// A colour as `#rrggbb`.
pub(crate) fn hex([red, green, blue]: [u8; 3]) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}

/// The colour of `#rrggbb`.
pub(crate) fn color(text: &str) -> Option<[u8; 3]> {
    let digits = text.strip_prefix('#').filter(|digits| digits.len() == 6 && digits.is_ascii())?;
    let part = |at: usize| u8::from_str_radix(&digits[at..at + 2], 16).ok();
    Some([part(0)?, part(2)?, part(4)?])
}

/// A header from its parts and the rows. A missing period is the shortest time between rows.
pub(crate) fn assemble(
    machine: &str,
    motors: [Motor; MOTORS],
    placement: [f64; 6],
    [period_us, lift_overlap_us]: [Option<u64>; 2],
    rounding: Rounding,
    pen_colors: BTreeMap<u16, [u8; 3]>,
    rows: &[Row],
) -> Result<Header, HeaderError> {
    let shortest = || rows.windows(2).map(|pair| pair[1].t_us - pair[0].t_us).min().unwrap_or(0);
    let header = Header {
        machine: machine.to_owned(),
        motors,
        placement,
        period_us: period_us.unwrap_or_else(shortest),
        lift_overlap_us: lift_overlap_us.unwrap_or(0),
        rounding,
        pen_colors,
        rows: rows.len() as u64,
        duration_us: rows.last().map_or(0, |row| row.t_us),
    };
    check_header(&header)?;
    Ok(header)
}
