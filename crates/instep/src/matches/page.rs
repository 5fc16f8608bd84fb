//! A recorded game as one HTML page: the field from above, with what each player believes and decides.

use std::path::Path;
use std::process::{Command, Stdio};

use instep_field::Field;
use instep_match::Recording;
use serde::Serialize;

/// The page; its script is ours and asks nothing of a network.
const TEMPLATE: &str = include_str!("replay.html");

#[derive(Serialize)]
struct Data<'a> {
    field: &'a Field,
    lines: Vec<instep_field::Line>,
    names: [&'a str; 2],
    recording: &'a Recording,
}

/// The page of a recording; `names` are Home's and Away's strategies.
///
/// # Errors
/// When the recording cannot be written as JSON.
pub(crate) fn page(recording: &Recording, field: &Field, names: [&str; 2]) -> Result<String, serde_json::Error> {
    let data = Data { field, lines: field.lines(), names, recording };
    // A strategy's name must not end the script.
    let json = serde_json::to_string(&data)?.replace("</", "<\\/");
    Ok(TEMPLATE.replacen("/*DATA*/", &json, 1))
}

/// Opens a page in the browser; where there is none, the path that was told must do.
pub(crate) fn open(file: &Path) {
    let _ = Command::new("xdg-open").arg(file).stdout(Stdio::null()).stderr(Stdio::null()).spawn();
}
