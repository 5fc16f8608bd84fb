//! `instep robot reach`: measures the reachability grid of the adaptive kick, keeps it beside the robot, and shows it.

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Instant;

use clap::Args;
use instep_bench::reach::measure;
use instep_kick::adaptive::grid::{CELL, CELLS, Grid};
use instep_kick::adaptive::{AdaptiveSettings, GRID_FILE, grid_hash};
use instep_kick::{BallModel, Build, Derive, Settings};
use instep_report::{Axis, Color, Column, Plot, Report, Series, SummaryItem, Table, Verdict};
use instep_robot::Robot;

use crate::failure::Failure;
use crate::output::{self, Output};
use crate::{files, places};

/// The arguments of `instep robot reach`.
#[derive(Debug, Args)]
pub(crate) struct Reach {
    /// A robot's name, or the path of its folder or robot.toml
    robot: String,
    /// Measure again even if the grid that is there fits the robot
    #[arg(long)]
    again: bool,
    /// Write a report with slices of the grid
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
}

impl Reach {
    /// Runs the command.
    ///
    /// # Errors
    /// When robot or settings cannot be read, a file cannot be written, or the simulation diverges.
    pub(crate) fn run(self, output: &Output) -> Result<ExitCode, Failure> {
        let robot = Arc::new(places::robot(&self.robot)?);
        let folder = robot.folder().to_owned();
        let ball = BallModel::load(&folder).map_err(Failure::input)?;
        let settings = AdaptiveSettings::of_folder(&Build::of(&robot, &ball), &folder).map_err(Failure::input)?;
        let file = folder.join(GRID_FILE);
        files::check_file(&file)?;
        if let Some(report) = &self.report {
            files::check_file(report)?;
        }
        let hash = grid_hash(&robot, &settings);
        let kept =
            std::fs::read(&file).ok().and_then(|bytes| Grid::from_bytes(&file.display().to_string(), &bytes).ok());
        let fresh = kept.filter(|grid| grid.hash() == hash && !self.again);
        let (grid, seconds, kinematic) = match fresh {
            Some(grid) => (grid, None, None),
            None => {
                let start = Instant::now();
                let bar = output::bar((CELLS * CELLS) as u64, "{wide_bar} {pos}/{len} rows {eta}");
                let reach = measure(&robot, &settings, &|done, _| bar.set_position(done as u64))?;
                bar.finish_and_clear();
                // Kept at once: the report may still fail.
                let mut batch = files::Batch::default();
                std::fs::write(batch.stage(&file)?, reach.measured.to_bytes())
                    .map_err(|e| Failure::input(format!("{}: cannot be written: {e}", file.display())))?;
                batch.commit()?;
                (reach.measured, Some((start.elapsed().as_secs_f64(), reach.simulated)), Some(reach.kinematic))
            }
        };
        if let Some(path) = &self.report {
            page(&robot, &grid, kinematic.as_ref()).save(path)?;
        }
        let object = serde_json::json!({
            "robot": robot.name,
            "file": file,
            "hash": format!("{hash:016x}"),
            "cells": grid.len(),
            "litres": grid.litres(),
            "kinematic_cells": kinematic.as_ref().map(Grid::len),
            "measured_in_s": seconds.map(|(wall, _)| wall),
            "simulated_s": seconds.map(|(_, simulated)| simulated),
        });
        output.show(&object, |paint| {
            let head = paint.strong(&format!("{}: {} cells, {:.2} l in reach", robot.name, grid.len(), grid.litres()));
            let how = match (seconds, &kinematic) {
                (Some((wall, simulated)), Some(kinematic)) => format!(
                    "measured in {wall:.1} s ({simulated:.0} s of the robot's time); inverse kinematics alone reaches {} cells",
                    kinematic.len()
                ),
                _ => "fits the robot and its settings; --again measures anew".to_owned(),
            };
            format!("{head}\n{how}\n{}", file.display())
        })?;
        Ok(ExitCode::SUCCESS)
    }
}

/// The report: the slice at each height as outline, and the volume.
fn page(robot: &Robot, grid: &Grid, kinematic: Option<&Grid>) -> Report {
    let heights: Vec<usize> = (0..CELLS).filter(|z| slice(grid, *z).next().is_some()).collect();
    let plots = heights.iter().map(|&z| {
        let squares = |grid: &Grid| slice(grid, z).flat_map(square).collect::<Vec<_>>();
        let mut series = Vec::new();
        if let Some(kinematic) = kinematic {
            let only = slice(kinematic, z).filter(|cell| !grid.has(*cell)).flat_map(square).collect();
            series.push(Series::points("by kinematics only", only).colored(Color::ORANGE.with_alpha(0.5)));
        }
        series.push(Series::points("reached", squares(grid)).colored(Color::BLUE));
        Plot {
            title: format!("Height {:.0} to {:.0} mm", z as f64 * CELL * 1e3, (z + 1) as f64 * CELL * 1e3),
            x_label: "forward, m".into(),
            y_label: "left, m".into(),
            axis: Axis::Other,
            series,
            ..Plot::default()
        }
    });
    let rows = heights.iter().map(|&z| {
        let cells: Vec<_> = slice(grid, z).collect();
        let span = |k: usize| {
            let at = |c: Option<usize>| c.map_or(f64::NAN, |c| Grid::centre([c; 3])[k]);
            let all = || cells.iter().map(|cell| cell[k]);
            format!("{:+.3} .. {:+.3}", at(all().min()), at(all().max()))
        };
        vec![
            format!("{:.0}", (z as f64 + 0.5) * CELL * 1e3).into(),
            cells.len().to_string().into(),
            format!("{:.0}", cells.len() as f64 * CELL * CELL * 1e4).into(),
            span(0).into(),
            span(1).into(),
        ]
    });
    let columns = [
        Column::number("height, mm"),
        Column::number("cells"),
        Column::number("area, cm2"),
        Column::number("forward, m"),
        Column::number("left, m"),
    ];
    Report {
        title: format!("Reach of {}", robot.name),
        subtitle: "places of the right sole's centre in the left sole's frame, standing on the left foot".into(),
        summary: vec![
            SummaryItem::new("Cells", grid.len().to_string(), Verdict::Neutral, "10 mm, 64 x 64 x 64"),
            SummaryItem::new("Volume", format!("{:.2} l", grid.litres()), Verdict::Neutral, ""),
        ],
        tables: vec![Table { title: "Slices".into(), columns: columns.into(), rows: rows.collect() }],
        plots: plots.collect(),
        notes: vec![
            "A cell counts when the simulated foot was in it while the robot stood flat on its other sole with its centre \
             of mass over it, parts of the robot apart, and the foot off the ground. The left foot's grid is the mirror image."
                .into(),
        ],
        ..Report::default()
    }
}

/// The cells at one height.
fn slice(grid: &Grid, z: usize) -> impl Iterator<Item = [usize; 3]> {
    (0..CELLS * CELLS).map(move |i| [i % CELLS, i / CELLS, z]).filter(|cell| grid.has(*cell))
}

/// The outline of a cell, then a gap.
fn square(cell: [usize; 3]) -> [[f64; 2]; 6] {
    let c = Grid::centre(cell);
    let h = 0.4 * CELL;
    let corner = |x: f64, y: f64| [c.x + x * h, c.y + y * h];
    [
        corner(-1.0, -1.0),
        corner(1.0, -1.0),
        corner(1.0, 1.0),
        corner(-1.0, 1.0),
        corner(-1.0, -1.0),
        [c.x - h, f64::NAN],
    ]
}
