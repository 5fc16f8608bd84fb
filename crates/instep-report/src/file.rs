//! Writing a file in one step: a neighbour with a temporary name, then a rename.

use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use crate::ReportError;

/// Writes `bytes` to `path` so that a reader sees the old file or the new one, never half of it.
///
/// # Errors
/// [`ReportError::Write`] naming `path`; the temporary file is removed.
pub(crate) fn write_atomically(path: &Path, bytes: &[u8]) -> Result<(), ReportError> {
    let write_error = |source| ReportError::Write { path: path.to_path_buf(), source };
    let temporary = neighbour(path).map_err(write_error)?;
    let written = write_and_flush(&temporary, bytes).and_then(|()| fs::rename(&temporary, path));
    if written.is_err() {
        // The first error is the one worth telling; the neighbour may never have come to be.
        let _ = fs::remove_file(&temporary);
    }
    written.map_err(write_error)
}

/// A name in the same folder, so that the rename stays on one file system; other processes use other names.
fn neighbour(path: &Path) -> std::io::Result<PathBuf> {
    use std::sync::atomic::{AtomicU32, Ordering};
    static CALLS: AtomicU32 = AtomicU32::new(0);

    let Some(name) = path.file_name() else {
        return Err(std::io::Error::new(std::io::ErrorKind::InvalidInput, "the path names no file"));
    };
    let call = CALLS.fetch_add(1, Ordering::Relaxed);
    let mut temporary = std::ffi::OsString::from(".");
    temporary.push(name);
    temporary.push(format!(".{}.{call}.tmp", std::process::id()));
    Ok(path.with_file_name(temporary))
}

fn write_and_flush(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    let mut file = fs::OpenOptions::new().write(true).create_new(true).open(path)?;
    file.write_all(bytes)?;
    file.sync_all()
}
