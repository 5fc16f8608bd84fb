//! Every command of README and docs: those in blocks marked `sh` are run, in order, in a folder of their own; those marked `sh long` (minutes,
//! or files that only their reader has) must be commands of ours with flags that they know.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::support::{instep, project};

/// A fenced block: where it stands, whether it is run, and its lines.
struct Block {
    place: String,
    long: bool,
    lines: Vec<String>,
}

fn blocks() -> Vec<Block> {
    let mut files: Vec<PathBuf> =
        std::fs::read_dir(project().join("docs")).unwrap().map(|e| e.unwrap().path()).collect();
    files.push(project().join("README.md"));
    files.sort();
    let mut blocks = Vec::new();
    for file in files.iter().filter(|file| file.extension().is_some_and(|e| e == "md")) {
        let text = std::fs::read_to_string(file).unwrap();
        let mut open: Option<Block> = None;
        for (i, line) in text.lines().enumerate() {
            match (&mut open, line.trim_end()) {
                (None, "```sh" | "```sh long") => {
                    let place = format!("{}:{}", file.file_name().unwrap().to_string_lossy(), i + 1);
                    open = Some(Block { place, long: line.ends_with("long"), lines: Vec::new() });
                }
                (Some(_), "```") => blocks.extend(open.take()),
                (Some(block), line) => block.lines.push(line.to_owned()),
                (None, _) => {}
            }
        }
        assert!(open.is_none(), "{}: a block without an end", file.display());
    }
    blocks
}

/// The words of a command of ours, without what a shell adds.
fn ours(line: &str) -> Option<Vec<&str>> {
    let words: Vec<&str> = line.split('#').next()?.split_whitespace().collect();
    (words.first() == Some(&"instep")).then(|| words[1..].to_vec())
}

#[test]
fn commands_in_docs_run() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir_all(folder.path().join("out")).unwrap();
    let program = Path::new(env!("CARGO_BIN_EXE_instep")).parent().unwrap();
    let path = format!("{}:{}", program.display(), std::env::var("PATH").unwrap_or_default());
    let mut run = 0;
    for block in blocks().iter().filter(|block| !block.long) {
        for line in &block.lines {
            let started = std::time::Instant::now();
            let output =
                Command::new("sh").arg("-c").arg(line).current_dir(folder.path()).env("PATH", &path).output().unwrap();
            println!("{:6.1} s  {line}", started.elapsed().as_secs_f64());
            let code = output.status.code();
            assert_eq!(code, Some(0), "{}: {line}\n{}", block.place, String::from_utf8_lossy(&output.stderr));
            run += usize::from(ours(line).is_some());
        }
    }
    assert!(run >= 10, "only {run} commands were run");
}

#[test]
fn long_commands_in_docs_have_flags_that_exist() {
    let folder = tempfile::tempdir().unwrap();
    for block in blocks().iter().filter(|block| block.long) {
        for words in block.lines.iter().filter_map(|line| ours(line)) {
            let mut command: Vec<&str> =
                words.iter().copied().take_while(|word| !word.starts_with('-')).take(1).collect();
            if matches!(command.first(), Some(&"robot" | &"see")) {
                command.extend(words.get(1).filter(|word| !word.starts_with('-')));
            }
            command.push("--help");
            let output = instep(folder.path(), &command);
            assert_eq!(output.status.code(), Some(0), "{}: instep {}", block.place, words.join(" "));
            let help = String::from_utf8(output.stdout).unwrap();
            for flag in words.iter().filter(|word| word.starts_with("--")) {
                let known = help.split_whitespace().any(|word| word.trim_end_matches([',', '.']) == *flag);
                assert!(known, "{}: {flag} is no flag of instep {}", block.place, command[0]);
            }
        }
    }
}
