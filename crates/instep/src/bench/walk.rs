//! `instep bench --walk`: robots by walking scenarios, to one table.

use std::process::ExitCode;
use std::sync::Arc;

use instep_bench::BenchError;
use instep_bench::walk_bench::{self, WalkRow, scenarios, text_table};
use instep_report::{Cell, Column, Report, SummaryItem, Table, Verdict};
use instep_sim::settings::{Fidelity, WorldSettings};

use super::Bench;
use crate::failure::Failure;
use crate::output::{self, Output};
use crate::{files, places};

/// Robots that are compared unless some are named.
const ROBOTS: [&str; 6] = ["artemis", "prestoe", "t1", "k1", "nao", "wolfgang"];
/// Seeds unless said otherwise; with `--quick`.
const SEEDS: [u64; 2] = [20, 4];

impl Bench {
    /// Runs the walking bench.
    pub(super) fn run_walk(&self, output: &Output) -> Result<ExitCode, Failure> {
        let mut chosen = scenarios();
        let known: Vec<String> = chosen.iter().map(|scenario| scenario.name.clone()).collect();
        if let Some(wrong) = self.scenario.iter().find(|name| !known.contains(name)) {
            let known = known.join(", ");
            return Err(BenchError::Unknown { kind: "walking scenario", found: wrong.clone(), known }.into());
        }
        chosen.retain(|scenario| self.scenario.is_empty() || self.scenario.contains(&scenario.name));
        let seeds = self.seeds.unwrap_or(SEEDS[usize::from(self.quick)]);
        if !(1..=100_000).contains(&seeds) {
            return Err(Failure::input(format!("--seeds: {seeds}; expected a number from 1 to 100000")));
        }
        let seeds: Vec<u64> = (self.seed..self.seed.saturating_add(seeds)).collect();
        let all = self.robot.join(",") == super::ROBOTS;
        let names = if all { ROBOTS.map(str::to_owned).to_vec() } else { self.robot.clone() };
        let robots =
            names.iter().map(|name| Ok(Arc::new(places::robot(name)?))).collect::<Result<Vec<_>, Failure>>()?;
        let files = ["walk.md", "walk.json", "walk.html"].map(|name| self.out.join(name));
        for file in &files {
            files::check_file(file)?;
        }
        let bar = output::bar((robots.len() * chosen.len() * seeds.len()) as u64, "{wide_bar} {pos}/{len} {msg} {eta}");
        let world = WorldSettings { drives: Fidelity::AsBuilt, senses: Fidelity::AsBuilt, ..WorldSettings::default() };
        let rows = walk_bench::run(&robots, &chosen, &seeds, &world, &|robot, scenario| {
            bar.inc(1);
            bar.set_message(format!("{robot} {scenario}"));
        })?;
        bar.finish_and_clear();

        let note = format!(
            "{} seeds from {} on. In brackets the 95 % interval of a rate (Wilson). Speeds, errors, stops and drifts are of the walks \
             that stayed upright. A scenario beyond what a robot may be asked has no row. Times are those of one thread on its core.",
            seeds.len(),
            self.seed
        );
        let text = table(&rows);
        let object = serde_json::json!({ "seeds": seeds.len(), "seed": self.seed, "rows": rows });
        let mut batch = files::Batch::default();
        let write = |path: std::path::PathBuf, text: &str| {
            std::fs::write(&path, text)
                .map_err(|e| Failure::input(format!("{}: cannot be written: {e}", path.display())))
        };
        let [markdown, json, html] = &files;
        write(batch.stage(markdown)?, &format!("# Walking bench\n\n{note}\n\n{text}"))?;
        write(batch.stage(json)?, &object.to_string())?;
        page(&rows, note).save(batch.stage(html)?)?;
        batch.commit()?;
        output.show(&object, |_| text)?;
        Ok(ExitCode::SUCCESS)
    }
}

fn table(rows: &[WalkRow]) -> String {
    let (head, body) = text_table(rows);
    let mut text = format!("| {} |\n|{}\n", head.join(" | "), "---|".repeat(head.len()));
    for row in body {
        text += &format!("| {} |\n", row.join(" | "));
    }
    text
}

fn page(rows: &[WalkRow], note: String) -> Report {
    let (head, body) = text_table(rows);
    let walks: usize = rows.iter().map(|row| row.trials).sum();
    let upright: f64 = rows.iter().filter_map(|row| Some(row.upright.share()? * row.trials as f64)).sum();
    let columns = head.iter().enumerate().map(|(i, title)| match i {
        0 | 1 => Column::text(*title),
        _ => Column::number(*title),
    });
    let cells = |(row, of): (Vec<String>, &WalkRow)| {
        let verdict = |share: Option<f64>| match share {
            Some(share) if share >= 0.95 => Verdict::Good,
            Some(share) if share < 0.5 => Verdict::Bad,
            _ => Verdict::Neutral,
        };
        row.into_iter()
            .enumerate()
            .map(|(i, text)| match i {
                3 => Cell::judged(text, verdict(of.upright.share())),
                _ => text.into(),
            })
            .collect()
    };
    Report {
        title: "Walking bench".into(),
        subtitle: "robots by scenarios, with drives and senses as built".into(),
        summary: vec![
            SummaryItem::new("Walks", walks.to_string(), Verdict::Neutral, ""),
            SummaryItem::new("Upright", format!("{upright:.0}"), Verdict::Neutral, "of all walks"),
        ],
        tables: vec![Table {
            title: "Robots by scenarios".into(),
            columns: columns.collect(),
            rows: body.into_iter().zip(rows).map(cells).collect(),
        }],
        notes: vec![note],
        ..Report::default()
    }
}
