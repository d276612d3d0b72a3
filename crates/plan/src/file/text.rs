//! ASCII text out, in blocks of 64 KiB, and numbers in both directions.

use std::io::{self, Write};

/// Blocks of this size go to the writer; larger ones were no faster.
const BLOCK: usize = 64 * 1024;

/// A writer of ASCII that formats numbers into its own block and passes on whole blocks.
///
/// `write!` to a buffered writer reaches a third of its speed.
#[expect(missing_debug_implementations, reason = "the writer need not implement Debug")]
pub struct Text<'w, W: Write + ?Sized> {
    out: &'w mut W,
    block: Vec<u8>,
}

impl<'w, W: Write + ?Sized> Text<'w, W> {
    /// A writer to `out`; nothing is written before the first full block or [`Self::finish`].
    pub fn new(out: &'w mut W) -> Self {
        Self { out, block: Vec::with_capacity(BLOCK + 1024) }
    }

    /// Appends a string.
    pub fn str(&mut self, s: &str) -> &mut Self {
        self.block.extend_from_slice(s.as_bytes());
        self
    }

    /// Appends a byte.
    pub fn byte(&mut self, byte: u8) -> &mut Self {
        self.block.push(byte);
        self
    }

    /// Appends an integer in decimal.
    pub fn int(&mut self, number: impl itoa::Integer) -> &mut Self {
        self.block.extend_from_slice(itoa::Buffer::new().format(number).as_bytes());
        self
    }

    /// Appends the shortest decimal that reads back as the same number, with an exponent where that
    /// is shorter; 0 for -0. At most 24 bytes for finite numbers.
    pub fn float(&mut self, number: f64) -> &mut Self {
        let number = if number == 0.0 { 0.0 } else { number };
        let (plain, scientific) = (format!("{number}"), format!("{number:e}"));
        self.str(if plain.len() <= scientific.len() { &plain } else { &scientific })
    }

    /// Appends the number with three decimals; 0.000 for what rounds to zero and for NaN.
    pub fn fixed(&mut self, number: f64) -> &mut Self {
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

    /// Bytes in the block: the start of a line whose length is to be measured.
    pub fn mark(&self) -> usize {
        self.block.len()
    }

    /// Writes the block if it is full. Invalidates marks.
    ///
    /// # Errors
    /// The writer's.
    pub fn flush_if_full(&mut self) -> io::Result<()> {
        if self.block.len() >= BLOCK {
            self.out.write_all(&self.block)?;
            self.block.clear();
        }
        Ok(())
    }

    /// Writes what is left, and flushes the writer.
    ///
    /// # Errors
    /// The writer's.
    pub fn finish(self) -> io::Result<()> {
        self.out.write_all(&self.block)?;
        self.out.flush()
    }
}

/// Parses decimal digits; `None` for anything else and for numbers beyond `u64`.
pub fn parse_unsigned(digits: &[u8]) -> Option<u64> {
    if digits.is_empty() {
        return None;
    }
    digits.iter().try_fold(0_u64, |number, &digit| {
        let digit = digit.wrapping_sub(b'0');
        (digit <= 9).then(|| number.checked_mul(10)?.checked_add(u64::from(digit))).flatten()
    })
}

/// Parses decimal digits with an optional `-` before them; `None` beyond `i64`.
pub fn parse_signed(digits: &[u8]) -> Option<i64> {
    match digits.strip_prefix(b"-") {
        Some(digits) => 0_i64.checked_sub_unsigned(parse_unsigned(digits)?),
        None => parse_unsigned(digits)?.try_into().ok(),
    }
}

/// Bytes quoted for an error message: escaped, on one line, cut after 40 bytes.
pub fn shown(bytes: &[u8]) -> String {
    const LONGEST: usize = 40;
    if bytes.is_empty() {
        return "nothing".to_owned();
    }
    let ellipsis = if bytes.len() > LONGEST { "..." } else { "" };
    format!("`{}{ellipsis}`", bytes[..bytes.len().min(LONGEST)].escape_ascii())
}

/// One line of a file.
#[derive(Clone, Copy, Debug)]
pub struct Line<'a> {
    /// Line number, from 1.
    pub number: u64,
    /// The text without line end and surrounding white space.
    pub text: &'a [u8],
    /// Whether a line feed ends it, as it does every line of a complete file.
    pub ended: bool,
}

/// The lines of a file. LF and CR LF end a line; a byte order mark at the start is skipped.
pub fn lines(bytes: &[u8]) -> impl Iterator<Item = Line<'_>> {
    let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
    bytes.split_inclusive(|&byte| byte == b'\n').zip(1..).map(|(text, number)| Line {
        number,
        text: text.trim_ascii(),
        ended: text.last() == Some(&b'\n'),
    })
}
