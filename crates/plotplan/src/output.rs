//! Writing to a file or standard output, whole or not at all.

use std::io::{BufWriter, Write};
use std::path::Path;

use crate::failure::Failure;

/// Writes the text of a command whose result is its report, unless that is wanted as JSON.
pub(crate) fn report(text: &str) -> Result<(), Failure> {
    if crate::session::is_json() {
        return Ok(());
    }
    write("-", |out| out.write_all(crate::terminal::printable(text).as_bytes()))
}

/// Writes to standard output for `-`, otherwise to a temporary file beside `to` that is renamed
/// once it is complete. Refuses to replace an input.
pub(crate) fn write(
    to: &str,
    write: impl FnOnce(&mut dyn Write) -> std::io::Result<()>,
) -> Result<(), Failure> {
    if to == "-" {
        let mut out = BufWriter::with_capacity(1 << 16, std::io::stdout().lock());
        return write(&mut out)
            .and_then(|()| out.flush())
            .map_err(|error| Failure::writing(error, "standard output"));
    }
    if let Some(input) = crate::input::same_as(Path::new(to)) {
        let what = format!("{to} is the input {input}: an output does not replace an input");
        return Err(Failure::Usage(anyhow::anyhow!(what)));
    }
    // Through a link: the link stays, its target is written.
    let resolved = std::fs::canonicalize(to);
    let path = resolved.as_deref().unwrap_or(Path::new(to));
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let failed = |error: std::io::Error| Failure::writing(error, to);
    // A device or a pipe cannot be replaced by another file: it is written as it is.
    if path.exists() && !path.is_file() {
        let mut out = BufWriter::new(std::fs::OpenOptions::new().write(true).open(path).map_err(failed)?);
        return write(&mut out).and_then(|()| out.flush()).map_err(failed);
    }
    let mut temporary = tempfile::Builder::new();
    temporary.prefix(".plotplan-");
    #[cfg(unix)]
    {
        // Permissions of a new file: the umask of the process applies.
        use std::os::unix::fs::PermissionsExt as _;
        temporary.permissions(std::fs::Permissions::from_mode(0o666));
    }
    let mut file = temporary.tempfile_in(folder).map_err(|error| failed(without_path(&error)))?;
    // The file itself: errors of `NamedTempFile` name the temporary path.
    let mut out = BufWriter::with_capacity(1 << 16, file.as_file_mut());
    write(&mut out).and_then(|()| out.flush()).map_err(failed)?;
    drop(out);
    file.persist(path).map_err(|error| failed(error.error))?;
    Ok(())
}

/// The system's own error: the text around it names the temporary file.
fn without_path(error: &std::io::Error) -> std::io::Error {
    use std::error::Error as _;
    let inner = error.source().and_then(|source| source.downcast_ref::<std::io::Error>());
    match error.raw_os_error().or_else(|| inner.and_then(std::io::Error::raw_os_error)) {
        Some(code) => std::io::Error::from_raw_os_error(code),
        None => error.kind().into(),
    }
}
