//! Columns of whole numbers as text: differences, zigzag, LEB128, deflate, base64.

use std::io::Write as _;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::ZlibEncoder;

/// Differences are taken at most this often.
const MOST_ORDER: u32 = 3;
/// How hard the columns are deflated, of 9.
const LEVEL: u32 = 6;
/// The order of differences is chosen on this many values.
const SAMPLED: usize = 1 << 16;

/// Columns of numbers and texts, to be unpacked by `js/columns.js`.
#[derive(Clone, Debug, Default)]
pub struct Columns {
    bytes: Vec<u8>,
    list: Vec<Column>,
    /// The order of differences is fixed instead of chosen for the least size.
    is_quick: bool,
}

/// Where a column lies and how it is read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Column {
    /// Its name.
    pub name: &'static str,
    /// Number of values; `None` for a text.
    pub count: Option<usize>,
    /// How often differences were taken.
    pub order: u32,
    /// Length of its bytes before deflation.
    pub bytes: usize,
}

impl Columns {
    /// For columns that are not stored: the order of differences is not searched.
    pub fn quick() -> Self {
        Self { is_quick: true, ..Self::default() }
    }

    /// Adds a column of numbers. Their differences, up to the third ones, must be below 2^53.
    pub fn numbers(&mut self, name: &'static str, values: &[i64]) {
        let sample = &values[..values.len().min(SAMPLED)];
        let size = |order: &u32| deflated(&varints(sample, *order)).len();
        let order = if self.is_quick { 1 } else { (0..=MOST_ORDER).min_by_key(size).unwrap_or_default() };
        let bytes = varints(values, order);
        self.list.push(Column { name, count: Some(values.len()), order, bytes: bytes.len() });
        self.bytes.extend(bytes);
    }

    /// Adds a text.
    pub fn text(&mut self, name: &'static str, text: &[u8]) {
        self.list.push(Column { name, count: None, order: 0, bytes: text.len() });
        self.bytes.extend_from_slice(text);
    }

    /// The columns in their order.
    pub fn list(&self) -> &[Column] {
        &self.list
    }

    /// All columns, not deflated.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// All columns, deflated, in base64.
    pub fn base64(&self) -> String {
        STANDARD.encode(deflated(&self.bytes))
    }
}

/// The varints of the differences of this order.
fn varints(values: &[i64], order: u32) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(2 * values.len());
    let mut before = [0; MOST_ORDER as usize];
    for &value in values {
        let mut difference = value;
        for last in before.iter_mut().take(order as usize) {
            let next = difference - *last;
            *last = difference;
            difference = next;
        }
        let mut rest = ((difference << 1) ^ (difference >> 63)) as u64;
        while rest > 127 {
            bytes.push(rest as u8 | 128);
            rest >>= 7;
        }
        bytes.push(rest as u8);
    }
    bytes
}

fn deflated(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::new(LEVEL));
    // Writing to memory does not fail.
    let written = encoder.write_all(bytes).and_then(|()| encoder.finish());
    written.unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use std::io::Read as _;

    use super::*;

    /// What `js/columns.js` does.
    fn unpacked(columns: &Columns) -> Vec<Vec<i64>> {
        let packed = STANDARD.decode(columns.base64()).unwrap();
        let mut bytes = Vec::new();
        flate2::read::ZlibDecoder::new(&packed[..]).read_to_end(&mut bytes).unwrap();
        let mut rest = bytes.iter().copied();
        let mut number = || {
            let (mut value, mut shift) = (0u64, 0);
            loop {
                let byte = rest.next().unwrap();
                value |= u64::from(byte & 127) << shift;
                shift += 7;
                if byte < 128 {
                    return (value >> 1) as i64 ^ -((value & 1) as i64);
                }
            }
        };
        let columns = columns.list().iter().filter(|column| column.count.is_some());
        columns
            .map(|column| {
                let mut values: Vec<i64> = (0..column.count.unwrap()).map(|_| number()).collect();
                for _ in 0..column.order {
                    for k in 1..values.len() {
                        values[k] += values[k - 1];
                    }
                }
                values
            })
            .collect()
    }

    #[test]
    fn columns_come_back() {
        let lists: [&[i64]; 4] = [
            &[],
            &[-7],
            &[0, 10_000, 20_000, 30_000, 180_000, 190_000],
            &[1 << 40, -(1 << 40), 3, -2, 0, 5, 127, 128, -129],
        ];
        let mut columns = Columns::default();
        for list in lists {
            columns.numbers("list", list);
        }
        assert_eq!(unpacked(&columns), lists);
    }

    #[test]
    fn quick_columns_come_back() {
        let mut columns = Columns::quick();
        columns.numbers("list", &[5, 7, -1_000_000]);
        assert_eq!(unpacked(&columns), [[5, 7, -1_000_000]]);
        assert_eq!(columns.bytes().len(), columns.list()[0].bytes);
    }

    #[test]
    fn smooth_motion_packs_into_little_more_than_a_byte_a_row() {
        let values: Vec<i64> = (0..100_000).map(|k: i64| k * k / 64).collect();
        let mut columns = Columns::default();
        columns.numbers("smooth", &values);
        assert!(columns.list()[0].order >= 2);
        assert!(columns.base64().len() < 20_000, "{}", columns.base64().len());
        assert_eq!(unpacked(&columns), [values]);
    }
}
