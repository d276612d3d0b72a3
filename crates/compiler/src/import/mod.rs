//! Importers: bytes in, drawing and diagnostics out.

pub mod points;

use std::fmt::Write as _;

use sha2::Digest as _;

/// SHA-256 of a file's bytes, in lowercase hexadecimal.
pub fn sha256(bytes: &[u8]) -> String {
    sha2::Sha256::digest(bytes).iter().fold(String::with_capacity(64), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    })
}
