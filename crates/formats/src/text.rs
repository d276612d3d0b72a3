//! Text out through a block of our own, and numbers in both directions.

use std::io::{self, Write};

/// Blocks of this size go to the writer; larger ones were no faster.
const BLOCK: usize = 64 * 1024;

/// A writer of ASCII that formats numbers into its own block and hands whole blocks on.
///
/// `write!` to a buffered writer reaches a third of the speed of this.
pub(crate) struct Text<'w, W: Write + ?Sized> {
    out: &'w mut W,
    block: Vec<u8>,
}

impl<'w, W: Write + ?Sized> Text<'w, W> {
    pub(crate) fn new(out: &'w mut W) -> Self {
        Self { out, block: Vec::with_capacity(BLOCK + 1024) }
    }

    pub(crate) fn str(&mut self, s: &str) -> &mut Self {
        self.block.extend_from_slice(s.as_bytes());
        self
    }

    pub(crate) fn byte(&mut self, byte: u8) -> &mut Self {
        self.block.push(byte);
        self
    }

    pub(crate) fn int(&mut self, number: impl itoa::Integer) -> &mut Self {
        self.block.extend_from_slice(itoa::Buffer::new().format(number).as_bytes());
        self
    }

    /// The shortest decimal that reads back as the same number, with an exponent where that is shorter; 0 for -0.
    /// Up to 24 bytes for finite numbers.
    pub(crate) fn float(&mut self, number: f64) -> &mut Self {
        let number = if number == 0.0 { 0.0 } else { number };
        let (plain, scientific) = (format!("{number}"), format!("{number:e}"));
        self.str(if plain.len() <= scientific.len() { &plain } else { &scientific })
    }

    /// The number with exactly three decimals, 0.000 for everything that rounds to it and for what is no number.
    pub(crate) fn fixed(&mut self, number: f64) -> &mut Self {
        let thousandths = (number * 1000.0).round() as i64;
        if thousandths < 0 {
            self.byte(b'-');
        }
        let thousandths = thousandths.unsigned_abs();
        self.int(thousandths / 1000).byte(b'.');
        let decimals = (thousandths % 1000) as u16;
        self.byte(b'0' + (decimals / 100) as u8).byte(b'0' + (decimals / 10 % 10) as u8);
        self.byte(b'0' + (decimals % 10) as u8)
    }

    /// How much stands in the block: a mark to measure a line's length from.
    pub(crate) fn mark(&self) -> usize {
        self.block.len()
    }

    /// Hands the block on if it is full. Marks do not outlive this.
    pub(crate) fn settle(&mut self) -> io::Result<()> {
        if self.block.len() >= BLOCK {
            self.out.write_all(&self.block)?;
            self.block.clear();
        }
        Ok(())
    }

    /// Hands on what is left.
    pub(crate) fn finish(self) -> io::Result<()> {
        self.out.write_all(&self.block)?;
        self.out.flush()
    }
}

/// A whole number of decimal digits alone; nothing where there is anything else, or where it is too large.
pub(crate) fn parse_unsigned(digits: &[u8]) -> Option<u64> {
    if digits.is_empty() {
        return None;
    }
    digits.iter().try_fold(0_u64, |number, &digit| {
        let digit = digit.wrapping_sub(b'0');
        (digit <= 9).then(|| number.checked_mul(10)?.checked_add(u64::from(digit))).flatten()
    })
}

/// The same with an optional `-` before it.
pub(crate) fn parse_signed(digits: &[u8]) -> Option<i64> {
    match digits.strip_prefix(b"-") {
        Some(digits) => 0_i64.checked_sub_unsigned(parse_unsigned(digits)?),
        None => parse_unsigned(digits)?.try_into().ok(),
    }
}

/// What stands in the file, for an error message: short, and on one line.
pub(crate) fn shown(bytes: &[u8]) -> String {
    const LONGEST: usize = 40;
    if bytes.is_empty() {
        return "nothing".to_owned();
    }
    let ellipsis = if bytes.len() > LONGEST { "..." } else { "" };
    format!("`{}{ellipsis}`", bytes[..bytes.len().min(LONGEST)].escape_ascii())
}

/// One line of a file.
#[derive(Clone, Copy)]
pub(crate) struct Line<'a> {
    /// The first is 1.
    pub(crate) number: u64,
    /// Without its end, and without white space around it.
    pub(crate) text: &'a [u8],
    /// Whether it has an end, as every line of a whole file does.
    pub(crate) ended: bool,
}

/// The lines of a file. LF and CR LF end a line; a byte order mark before the first is passed over.
pub(crate) fn lines(bytes: &[u8]) -> impl Iterator<Item = Line<'_>> {
    let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
    bytes.split_inclusive(|&byte| byte == b'\n').zip(1..).map(|(text, number)| Line {
        number,
        text: text.trim_ascii(),
        ended: text.last() == Some(&b'\n'),
    })
}
