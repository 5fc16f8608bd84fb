//! Results on disk: all of a command's files or none, each whole.
//!
//! Before the work, [`check_folder`] finds out whether the files can be written, and creates nothing. After it, a
//! [`Batch`] takes every file under a temporary name beside its place and renames them at the end. A process that is
//! killed in between leaves at most temporary files, whose names start with a dot and end in `.tmp`.

use std::path::{Path, PathBuf};

use crate::failure::Failure;

fn refused(path: &Path, found: impl std::fmt::Display) -> Failure {
    Failure::input(format!("{}: cannot be written: {found}; expected a folder that can be written", path.display()))
}

/// Whether files can be written into `folder`, which need not exist yet.
///
/// # Errors
/// When `folder` or what stands in its way cannot be written.
pub(crate) fn check_folder(folder: &Path) -> Result<(), Failure> {
    let here = Path::new(".");
    let existing = folder.ancestors().map(|f| if f.as_os_str().is_empty() { here } else { f }).find(|f| f.exists());
    let existing = existing.unwrap_or(here);
    if !existing.is_dir() {
        return Err(refused(folder, format!("{} is a file", existing.display())));
    }
    // Only an attempt tells: permissions, read-only file systems and quotas all have a say.
    let probe = existing.join(format!(".instep-{}.tmp", std::process::id()));
    std::fs::File::create_new(&probe).and_then(|_| std::fs::remove_file(&probe)).map_err(|e| refused(folder, e))
}

/// Whether `file` can be written.
///
/// # Errors
/// When it is a folder, or its own folder cannot be written.
pub(crate) fn check_file(file: &Path) -> Result<(), Failure> {
    if file.is_dir() || file.file_name().is_none() {
        return Err(Failure::input(format!("{}: is a folder; expected the path of a file", file.display())));
    }
    check_folder(parent(file))
}

/// `file`, with `ending` where its name has none; a folder is left for [`check_file`] to refuse.
pub(crate) fn with_ending(file: &Path, ending: &str) -> PathBuf {
    if file.extension().is_some() || file.is_dir() { file.to_owned() } else { file.with_extension(ending) }
}

fn parent(file: &Path) -> &Path {
    file.parent().unwrap_or(Path::new(""))
}

/// Takes `checkpoint` for this process alone, for as long as what it returns lives; its folder exists.
///
/// # Errors
/// When another process works on it, or the lock beside it cannot be written.
pub(crate) fn alone(checkpoint: &Path) -> Result<std::fs::File, Failure> {
    let name = checkpoint.file_name().unwrap_or_default().to_string_lossy();
    let path = checkpoint.with_file_name(format!(".{name}.lock"));
    let lock = std::fs::File::create(&path).map_err(|e| refused(&path, e))?;
    match lock.try_lock() {
        Ok(()) => Ok(lock),
        Err(std::fs::TryLockError::WouldBlock) => Err(Failure::input(format!(
            "{}: another training works on it; wait for it, stop it, or give another --out",
            checkpoint.display()
        ))),
        Err(std::fs::TryLockError::Error(e)) => Err(refused(&path, e)),
    }
}

/// Files that become visible together.
#[derive(Debug, Default)]
pub(crate) struct Batch {
    /// Temporary and final name.
    staged: Vec<(PathBuf, PathBuf)>,
}

impl Batch {
    /// The temporary path of what shall become `file`; its folder is created.
    ///
    /// # Errors
    /// When `file` cannot be.
    pub(crate) fn stage(&mut self, file: &Path) -> Result<PathBuf, Failure> {
        check_file(file)?;
        if !parent(file).as_os_str().is_empty() {
            std::fs::create_dir_all(parent(file)).map_err(|e| refused(parent(file), e))?;
        }
        let name = file.file_name().unwrap_or_default().to_string_lossy();
        let temporary = file.with_file_name(format!(".{name}.{}.tmp", std::process::id()));
        self.staged.push((temporary.clone(), file.to_owned()));
        Ok(temporary)
    }

    /// Gives all files their names.
    ///
    /// # Errors
    /// When one cannot be renamed.
    pub(crate) fn commit(mut self) -> Result<(), Failure> {
        while let Some((temporary, file)) = self.staged.first() {
            std::fs::rename(temporary, file).map_err(|e| refused(file, e))?;
            self.staged.remove(0);
        }
        Ok(())
    }
}

impl Drop for Batch {
    fn drop(&mut self) {
        for (temporary, _) in &self.staged {
            // It may never have been written; and there is nobody to tell that it cannot be removed.
            let _ = std::fs::remove_file(temporary);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_batch_that_is_dropped_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let mut batch = Batch::default();
        for name in ["a", "b"] {
            std::fs::write(batch.stage(&folder.path().join(name)).unwrap(), name).unwrap();
        }
        drop(batch);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }

    #[test]
    fn a_batch_that_is_committed_has_all_files() {
        let folder = tempfile::tempdir().unwrap();
        let mut batch = Batch::default();
        for name in ["a", "deep/b"] {
            std::fs::write(batch.stage(&folder.path().join(name)).unwrap(), name).unwrap();
        }
        batch.commit().unwrap();
        assert_eq!(std::fs::read_to_string(folder.path().join("deep/b")).unwrap(), "deep/b");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2);
    }

    #[test]
    fn names_get_an_ending_where_they_have_none() {
        for (given, wanted) in
            [("out/some", "out/some.json"), ("a.d/name", "a.d/name.json"), ("out/some.txt", "out/some.txt")]
        {
            assert_eq!(with_ending(Path::new(given), "json"), Path::new(wanted));
        }
    }

    #[test]
    fn a_folder_under_a_file_cannot_be() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        std::fs::write(&file, "").unwrap();
        let failure = check_folder(&file.join("out")).unwrap_err();
        assert!(failure.message().contains("is a file"), "{}", failure.message());
        check_folder(&folder.path().join("new/er")).unwrap();
        assert!(!folder.path().join("new").exists());
    }
}
