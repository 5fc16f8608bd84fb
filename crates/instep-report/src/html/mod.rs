//! The HTML page: text that stands without script (summary, tables, notes), and the data for the scripts.

mod check;
mod data;
mod text;

pub(crate) use check::check;
use text::{escape, fill, json_in_script};

use crate::{Align, Report, SummaryItem, Table, Verdict};

const PAGE: &str = include_str!("../assets/page.html");
const STAGE_REPLAY: &str = include_str!("../assets/stage_replay.html");
const MATRIX: &str = "<section class=\"matrix card\" id=\"matrix\" aria-label=\"Comparison\"></section>";
const STYLE: &str = include_str!("../assets/style.css");
/// In the order they use each other.
const SCRIPTS: [&str; 7] = [
    include_str!("../assets/math.js"),
    include_str!("../assets/meshes.js"),
    include_str!("../assets/shaders.js"),
    include_str!("../assets/view.js"),
    include_str!("../assets/plots.js"),
    include_str!("../assets/matrix.js"),
    include_str!("../assets/page.js"),
];

/// The page as one text.
pub(crate) fn page(report: &Report) -> String {
    let title = escape(&report.title);
    let subtitle =
        if report.subtitle.is_empty() { String::new() } else { format!("<p>{}</p>", escape(&report.subtitle)) };
    let script = SCRIPTS.join("\n");
    fill(PAGE, |slot| match slot {
        "version" => env!("CARGO_PKG_VERSION").into(),
        "title" => title.clone(),
        "subtitle" => subtitle.clone(),
        "style" => STYLE.into(),
        "script" => script.clone(),
        "summary" => summary(&report.summary),
        "stage" => stage(report),
        "matrix" if report.matrix.is_some() => MATRIX.into(),
        "tables" => tables(&report.tables),
        "notes" => notes(&report.notes),
        "data" => json_in_script(&data::json(report)),
        _ => String::new(),
    })
}

/// The class that colours a verdict.
fn class(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Good => "good",
        Verdict::Bad => "bad",
        Verdict::Neutral => "neutral",
    }
}

fn summary(items: &[SummaryItem]) -> String {
    if items.is_empty() {
        return String::new();
    }
    let mut html = String::from("<dl class=\"summary card\">\n");
    for item in items {
        // A sign as well as a colour: not everyone sees red and green apart.
        let mark = match item.verdict {
            Verdict::Good => "<span class=\"mark\" role=\"img\" aria-label=\"good\">\u{2713}</span>",
            Verdict::Bad => "<span class=\"mark\" role=\"img\" aria-label=\"bad\">\u{2715}</span>",
            Verdict::Neutral => "",
        };
        html += &format!(
            "<div class=\"{}\"><dt>{mark}{}</dt><dd class=\"value\">{}</dd><dd class=\"note\">{}</dd></div>\n",
            class(item.verdict),
            escape(&item.label),
            escape(&item.value),
            escape(&item.note),
        );
    }
    html + "</dl>"
}

fn stage(report: &Report) -> String {
    let replay = if report.replay.is_some() { STAGE_REPLAY } else { "" };
    let plots = if report.plots.is_empty() {
        ""
    } else {
        "<section class=\"plots\" id=\"plots\" aria-label=\"Plots\"></section>"
    };
    match (replay, plots) {
        ("", "") => String::new(),
        (_, "") | ("", _) => format!("<div class=\"stage\">\n{replay}{plots}\n</div>"),
        _ => format!("<div class=\"stage both\">\n{replay}{plots}\n</div>"),
    }
}

fn tables(tables: &[Table]) -> String {
    if tables.is_empty() {
        return String::new();
    }
    let mut html = String::from("<div class=\"tables\">\n");
    for table in tables {
        html += &format!("<section class=\"table card\"><h2>{}</h2>\n<table><thead><tr>", escape(&table.title));
        let side = |index: usize| match table.columns.get(index).map(|column| column.align) {
            Some(Align::Right) => "right",
            _ => "",
        };
        for (index, column) in table.columns.iter().enumerate() {
            html += &format!("<th scope=\"col\" class=\"{}\">{}</th>", side(index), escape(&column.title));
        }
        html += "</tr></thead><tbody>\n";
        for row in &table.rows {
            html += "<tr>";
            for (index, cell) in row.iter().enumerate() {
                html += &format!("<td class=\"{} {}\">{}</td>", side(index), class(cell.verdict), escape(&cell.text));
            }
            html += "</tr>\n";
        }
        html += "</tbody></table></section>\n";
    }
    html + "</div>"
}

fn notes(notes: &[String]) -> String {
    if notes.is_empty() {
        return String::new();
    }
    let paragraphs: String = notes.iter().map(|note| format!("<p>{}</p>\n", escape(note))).collect();
    format!("<section class=\"notes card\"><h2>Notes</h2>\n{paragraphs}</section>")
}
