//! `instep locate`: one stream of odometry and sights, simulated or a team's own, through every method of localisation:
//! tracks, clusters, errors.

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;

use clap::Args;
use instep_bench::cpu::thread_seconds;
use instep_field::Field;
use instep_localisation::evaluate::{Measures, Track, follow};
use instep_localisation::scenario::{Event, Scenario};
use instep_localisation::stream::Stream;
use instep_localisation::{Map, Settings, methods};
use rayon::prelude::*;
use serde::Serialize;

use crate::failure::Failure;
use crate::files;
use crate::output::{self, Output, Paint};

pub(crate) mod page;
mod recording;

/// The arguments of `instep locate`.
#[derive(Debug, Args)]
pub(crate) struct Locate {
    /// What is simulated: star, star-white, star-bound, false-30, false-60, missed-60, few, slow, late, lasting, slipping,
    /// lines, large, carried, start-error, own-half
    #[arg(long, value_name = "NAME", default_value = "star")]
    scenario: String,
    /// A recording in place of a scenario: JSON lines, or MCAP by the ending .mcap (docs/locate.md)
    #[arg(long, value_name = "FILE", conflicts_with_all = ["scenario", "seeds", "seed"])]
    recording: Option<PathBuf>,
    /// The field of the recording: a name, or the path of a TOML file [default: what it says, else adult-2024]
    #[arg(long, value_name = "FIELD", requires = "recording")]
    field: Option<String>,
    /// Number of seeds
    #[arg(long, value_name = "K", default_value_t = 3)]
    seeds: u64,
    /// The first seed
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Settings of all methods, as TOML; what is absent keeps its default
    #[arg(long, value_name = "FILE")]
    settings: Option<PathBuf>,
    /// Folder for report.html and stream.jsonl, the first seed's stream
    #[arg(long, value_name = "FOLDER", default_value = "out/locate")]
    out: PathBuf,
}

/// One method's line of the table.
#[derive(Debug, Serialize)]
struct Row {
    name: &'static str,
    default: bool,
    /// m; null where the truth is not known.
    mae: f64,
    /// m^2
    mse: f64,
    /// m
    std: f64,
    /// m
    worst: f64,
    heading_mae_deg: f64,
    /// Share of the time in the truth's twin.
    wrong_half_rate: f64,
    /// Share of the time more than 1 m off, or without a pose.
    astray_rate: f64,
    false_resets: usize,
    resets: usize,
    /// Mean normalised squared error over its degrees of freedom; null without a covariance.
    nees: Option<f64>,
    /// Share of runs that were right within 6 s of the event and stayed so; null where nothing happened.
    recovered_rate: Option<f64>,
    recovery_median_s: Option<f64>,
    recovery_worst_s: Option<f64>,
    twin_rate: Option<f64>,
    /// Time of one core.
    update_p99_s: f64,
    check_p99_s: f64,
}

/// The whole result.
#[derive(Debug, Serialize)]
struct Table {
    scenario: String,
    seeds: u64,
    seed: u64,
    methods: Vec<Row>,
}

impl Locate {
    /// Runs the command.
    ///
    /// # Errors
    /// When a name is not known, a file cannot be used, or a stream holds what cannot be.
    pub(crate) fn run(self, output: &Output) -> Result<ExitCode, Failure> {
        let settings = self.read_settings()?;
        let [report, kept] = ["report.html", "stream.jsonl"].map(|name| self.out.join(name));
        files::check_file(&report)?;
        files::check_file(&kept)?;
        if !(1..=10_000).contains(&self.seeds) {
            return Err(Failure::input(format!("--seeds: {}; expected a number from 1 to 10000", self.seeds)));
        }
        let (streams, eventful, name) = self.streams()?;
        let first = streams.first().ok_or_else(|| Failure::other("no stream"))?;
        let map = Arc::new(Map::new(&first.field, true)?);
        let count = methods(&map, &settings, 0).len();
        let bar = output::bar((count * streams.len()) as u64, "{wide_bar} {pos}/{len} runs {eta}");
        // Every run is a job of its own: methods cost very different times.
        let jobs: Vec<(usize, usize)> = (0..count).flat_map(|m| (0..streams.len()).map(move |s| (m, s))).collect();
        let runs = jobs.par_iter().map(|&(m, s)| {
            let method = methods(&map, &settings, self.seed.wrapping_add(s as u64)).swap_remove(m);
            let name = method.name();
            let track = follow(method, &streams[s], &thread_seconds);
            bar.inc(1);
            track.map(|track| (name, track))
        });
        let runs: Vec<(&'static str, Track)> = runs.collect::<Result<_, _>>()?;
        bar.finish_and_clear();

        let groups: Vec<(&'static str, Vec<Track>)> = runs
            .chunks(streams.len())
            .map(|chunk| (chunk[0].0, chunk.iter().map(|(_, track)| track.clone()).collect()))
            .collect();
        let rows = groups.iter().enumerate().map(|(k, (name, tracks))| row(name, k == 0, tracks, eventful));
        let table = Table { scenario: name, seeds: streams.len() as u64, seed: self.seed, methods: rows.collect() };
        let mut batch = files::Batch::default();
        page::page(&table, first, &groups).save(batch.stage(&report)?)?;
        let staged = batch.stage(&kept)?.clone();
        let unusable = |e: std::io::Error| Failure::input(format!("{}: cannot be written: {e}", kept.display()));
        let mut file = std::io::BufWriter::new(std::fs::File::create(staged).map_err(unusable)?);
        first.write(&mut file).and_then(|()| std::io::Write::flush(&mut file)).map_err(unusable)?;
        batch.commit()?;
        output.show(&table, |paint| text(&table, &report, paint))?;
        Ok(ExitCode::SUCCESS)
    }

    /// The streams, whether something happens in them, and what they are called.
    fn streams(&self) -> Result<(Vec<Stream>, bool, String), Failure> {
        if let Some(file) = &self.recording {
            let is_mcap = file.extension().is_some_and(|e| e.eq_ignore_ascii_case("mcap"));
            let mut stream = if is_mcap { recording::load(file)? } else { Stream::load(file)? };
            if let Some(name) = &self.field {
                stream.field = Field::named_or_load(name)?;
            }
            return Ok((vec![stream], false, file.display().to_string()));
        }
        let scenario = Scenario::named(&self.scenario).map_err(|e| Failure::from(e).about("--scenario"))?;
        let seeds = (0..self.seeds).into_par_iter().map(|k| self.seed.wrapping_add(k));
        let streams = seeds.map(|seed| Stream::simulate(scenario, seed)).collect::<Result<_, _>>()?;
        Ok((streams, scenario.event != Event::None, self.scenario.clone()))
    }

    fn read_settings(&self) -> Result<Settings, Failure> {
        let Some(file) = &self.settings else { return Ok(Settings::default()) };
        let unusable = |e: &dyn std::fmt::Display| Failure::input(e).about(file.display());
        let text = std::fs::read_to_string(file).map_err(|e| unusable(&e))?;
        let settings: Settings = toml::from_str(&text).map_err(|e| unusable(&e))?;
        settings.validate().map_err(|e| unusable(&e))?;
        Ok(settings)
    }
}

fn row(name: &'static str, default: bool, tracks: &[Track], eventful: bool) -> Row {
    let m = Measures::of(tracks);
    let known = |value: f64| if tracks.iter().any(|t| !t.samples.is_empty()) { value } else { f64::NAN };
    Row {
        name,
        default,
        mae: known(m.mae),
        mse: known(m.mse),
        std: known(m.std),
        worst: known(m.worst),
        heading_mae_deg: known(m.heading_mae.to_degrees()),
        wrong_half_rate: known(m.wrong_half_rate),
        astray_rate: known(m.astray_rate),
        false_resets: m.false_resets,
        resets: m.resets,
        nees: m.nees,
        recovered_rate: eventful.then_some(m.recovered_rate),
        recovery_median_s: m.recovery_median.filter(|_| eventful),
        recovery_worst_s: m.recovery_worst.filter(|_| eventful),
        twin_rate: eventful.then_some(m.twin_rate),
        update_p99_s: m.update_p99,
        check_p99_s: m.check_p99,
    }
}

/// Column heads and cells of the table, for people.
fn cells(row: &Row) -> Vec<(&'static str, String)> {
    let or_dash = |value: Option<f64>, digits: usize| value.map_or("\u{2013}".to_owned(), |v| format!("{v:.digits$}"));
    let mut cells = vec![
        ("method", row.name.to_owned()),
        ("MAE m", format!("{:.3}", row.mae)),
        ("MSE m\u{b2}", format!("{:.4}", row.mse)),
        ("STD m", format!("{:.3}", row.std)),
        ("heading \u{b0}", format!("{:.2}", row.heading_mae_deg)),
        ("wrong half %", format!("{:.1}", 100.0 * row.wrong_half_rate)),
        (">1 m %", format!("{:.1}", 100.0 * row.astray_rate)),
        ("resets false/all", format!("{}/{}", row.false_resets, row.resets)),
        ("NEES", or_dash(row.nees, 2)),
    ];
    if let Some(rate) = row.recovered_rate {
        cells.push(("right in 6 s %", format!("{:.0}", 100.0 * rate)));
        cells.push(("median s", or_dash(row.recovery_median_s, 2)));
        cells.push(("longest s", or_dash(row.recovery_worst_s, 2)));
        cells.push(("twin %", or_dash(row.twin_rate.map(|r| 100.0 * r), 0)));
    }
    cells.push(("update p99 ms", format!("{:.3}", 1e3 * row.update_p99_s)));
    cells.push(("check p99 ms", format!("{:.2}", 1e3 * row.check_p99_s)));
    cells
}

fn text(table: &Table, report: &std::path::Path, paint: Paint) -> String {
    let rows: Vec<_> = table.methods.iter().map(cells).collect();
    let width = |column: usize| {
        let cells = rows.iter().flat_map(|r| [r[column].0.chars().count(), r[column].1.chars().count()]);
        cells.max().unwrap_or(0)
    };
    let line = |texts: Vec<&str>| {
        let padded = texts.iter().enumerate().map(|(k, text)| {
            let w = width(k);
            if k == 0 { format!("{text:<w$}") } else { format!("{text:>w$}") }
        });
        padded.collect::<Vec<_>>().join("  ")
    };
    let mut text = format!("{} \u{b7} {} seeds from {}\n", paint.strong(&table.scenario), table.seeds, table.seed);
    for (k, row) in rows.iter().enumerate() {
        if k == 0 {
            text += &paint.faint(&line(row.iter().map(|c| c.0).collect()));
            text.push('\n');
        }
        let cells = line(row.iter().map(|c| c.1.as_str()).collect());
        text += &if k == 0 { paint.good(&cells) } else { cells };
        text.push('\n');
    }
    text + &paint.faint(&format!("report: {}", report.display()))
}
