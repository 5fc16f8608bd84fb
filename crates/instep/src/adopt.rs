//! `instep robot adopt`: from somebody's model to a robot's folder that works, with its first kicks.
//!
//! All of it happens in a folder beside the one asked for, which gets its name when everything is there: nothing half-written stays.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;

use clap::Args;
use instep_bench::Subject;
use instep_bench::adopt::{Kicks, kicks, stands};
use instep_bench::reach::measure;
use instep_bench::scenario::Scenario;
use instep_kick::adaptive::{AdaptiveSettings, GRID_FILE};
use instep_kick::{BallModel, Build, Derive, Settings};
use instep_robot::Robot;
use instep_robot::adopt::{Adoption, adopt};
use serde::Serialize;

use crate::failure::Failure;
use crate::output::{self, Output, Paint};
use crate::{files, places};

/// How long a stand must hold, s.
const HOLD: f64 = 2.0;
/// Bends of the knees that are tried, rad: a moderate one first.
const BENDS: [f64; 9] = [0.45, 0.35, 0.55, 0.25, 0.65, 0.75, 0.15, 0.9, 0.05];
/// The engines that are tried,
const ENGINES: [&str; 2] = ["dynamic", "preview"];
/// and the one that wants a measured grid.
const WITH_GRID: &str = "adaptive";

/// The arguments of `instep robot adopt`.
#[derive(Debug, Args)]
pub(crate) struct Adopt {
    /// The model: an MJCF (.xml) or a URDF
    model: PathBuf,
    /// What the robot is to be called
    #[arg(long, value_name = "NAME", value_parser = name)]
    name: String,
    /// The folder of robots in which its folder is made
    #[arg(long, value_name = "FOLDER", default_value = "robots")]
    out: PathBuf,
    /// Kicks that are tried with each engine
    #[arg(long, value_name = "NUMBER", default_value_t = 50, value_parser = clap::value_parser!(u32).range(1..=1000))]
    trials: u32,
}

/// A name that can be a folder's and stand in tables.
fn name(text: &str) -> Result<String, String> {
    let good = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    let starts = text.starts_with(|c: char| c.is_ascii_alphanumeric());
    if starts && text.len() <= 40 && text.chars().all(good) {
        return Ok(text.to_owned());
    }
    Err("expected letters, digits, - and _, a letter or digit first, at most 40".into())
}

/// What `--json` prints.
#[derive(Debug, Serialize)]
struct Answer {
    folder: PathBuf,
    /// What a person must look at.
    asked: Vec<String>,
    /// What was left out of the model or changed.
    notes: Vec<String>,
    /// Numbers and names that were derived.
    derived: usize,
    /// Engines that kick now, the best first.
    engines: Vec<String>,
    kicks: BTreeMap<String, Kicks>,
    /// Bend of the knees in the stand, rad.
    knee_bend: f64,
}

/// A folder that goes away unless it is kept.
struct Draft(PathBuf);

impl Drop for Draft {
    fn drop(&mut self) {
        // It may have got its name; and there is nobody to tell that it cannot be removed.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

impl Adopt {
    /// Runs the command.
    ///
    /// # Errors
    /// When the model is no humanoid that can stand on one foot, its folder is there already or cannot be written.
    pub(crate) fn run(self, output: &Output) -> Result<ExitCode, Failure> {
        places::existing_file("MODEL", &self.model, "a model (MJCF or URDF)")?;
        let folder = self.out.join(&self.name);
        if folder.exists() {
            let message =
                format!("{}: is there already; expected another --name, or the old folder gone", folder.display());
            return Err(Failure::input(message));
        }
        files::check_folder(&folder)?;
        let scenario = Scenario::load(&places::scenarios()?.join("straight.toml"))?;
        let mut adoption = adopt(&self.model, &self.name)?;
        let cannot = |e: std::io::Error| Failure::input(format!("{}: cannot be written: {e}", folder.display()));
        let draft = Draft(self.out.join(format!(".{}.{}.tmp", self.name, std::process::id())));
        std::fs::create_dir_all(&draft.0).map_err(cannot)?;
        std::fs::write(draft.0.join(BallModel::FILE), ball(adoption.height)).map_err(cannot)?;

        let (subject, knee_bend) = self.standing(&mut adoption, &draft.0)?;
        let mut able = Vec::new();
        for engine in ENGINES {
            match subject.engine(engine) {
                Ok(_) => able.push(engine),
                Err(why) => adoption.notes.push(format!("engine {engine}: {}", Failure::from(why).message())),
            }
        }
        let mut kicks = self.kicks(&subject, &able, &scenario)?;
        // The grid that this engine wants takes a minute: only where no other kicks.
        if !able.is_empty() && !kicks.values().any(Kicks::kicks) {
            match self.reach(&subject, &draft.0) {
                Ok(()) => kicks.extend(self.kicks(&subject, &[WITH_GRID], &scenario)?),
                Err(why) => {
                    adoption.notes.push(format!("no reachability grid for the engine {WITH_GRID}: {}", why.message()))
                }
            }
        }
        let mut good: Vec<(&String, &Kicks)> = kicks.iter().filter(|(_, kicks)| kicks.kicks()).collect();
        good.sort_by(|a, b| b.1.rank().total_cmp(&a.1.rank()));
        let engines: Vec<String> = good.into_iter().map(|(engine, _)| engine.clone()).collect();
        adoption.file.engine = engines.first().cloned();
        adoption.write(&draft.0)?;
        std::fs::rename(&draft.0, &folder).map_err(cannot)?;

        let Adoption { asked, notes, derived, .. } = adoption;
        let answer = Answer { folder, asked, notes, derived, engines, kicks, knee_bend };
        output.show(&answer, |paint| text(&answer, &self.name, paint))?;
        Ok(ExitCode::SUCCESS)
    }

    /// Bends the knees until the world stays up.
    fn standing(&self, adoption: &mut Adoption, folder: &Path) -> Result<(Subject, f64), Failure> {
        let mut fell = Vec::new();
        for bend in BENDS {
            if !adoption.bend_knees(bend)? {
                continue;
            }
            adoption.write(folder)?;
            let subject = Subject::of(Robot::load(folder)?)?;
            if stands(&subject, HOLD)? {
                return Ok((subject, bend));
            }
            fell.push(format!("{bend:.2}"));
        }
        let found = if fell.is_empty() {
            "no pose with level soles and the centre of mass over them, whatever the bend of the knees".to_owned()
        } else {
            format!("it falls within {HOLD} s with knees bent by {} rad", fell.join(", "))
        };
        let expected =
            "a robot that can stand: look at the ranges and torque limits of its legs, its masses and its soles";
        Err(Failure::input(format!("{}: {found}; expected {expected}", self.model.display())))
    }

    /// Kicks with those of `engines` that know the robot.
    fn kicks(
        &self,
        subject: &Subject,
        engines: &[&str],
        scenario: &Scenario,
    ) -> Result<BTreeMap<String, Kicks>, Failure> {
        let engines: Vec<&str> = engines.iter().copied().filter(|engine| subject.knows(engine)).collect();
        let bar = output::bar(1, "kicks {wide_bar} {pos}/{len} {eta}");
        let kicks = kicks(subject, &engines, scenario, self.trials as usize, &|done, all| {
            bar.set_length(all as u64);
            bar.set_position(done as u64);
        })?;
        bar.finish_and_clear();
        Ok(kicks)
    }

    /// Measures the grid that the adaptive engine looks its strokes up in.
    fn reach(&self, subject: &Subject, folder: &Path) -> Result<(), Failure> {
        let settings = AdaptiveSettings::of_folder(&Build::of(&subject.robot, &subject.ball), folder)?;
        let bar = output::bar(1, "reach {wide_bar} {pos}/{len} rows {eta}");
        let reach = measure(&Arc::clone(&subject.robot), &settings, &|done, all| {
            bar.set_length(all as u64);
            bar.set_position(done as u64);
        })?;
        bar.finish_and_clear();
        let file = folder.join(GRID_FILE);
        std::fs::write(&file, reach.measured.to_bytes())
            .map_err(|e| Failure::input(format!("{}: cannot be written: {e}", file.display())))
    }
}

/// The ball that robots of this height (m) play: SPL's up to NAO's size, a size 1 up to a metre, a size 5 above.
fn ball(height: f64) -> String {
    let (words, radius, mass) = match height {
        h if h < 0.65 => ("The Standard Platform League's ball", 0.05, 0.044),
        h if h < 1.0 => ("A FIFA size 1 ball, as kid-size plays", 0.07, 0.2),
        _ => ("A FIFA size 5 ball, as adult-size plays", 0.11, 0.43),
    };
    format!(
        "# {words}, by the robot's height ({height:.2} m): look at it. Fields: radius (m), mass (kg), restitution of foot on ball,\n# deceleration \
         of the rolling ball (m/s^2).\nradius = {radius:?}\nmass = {mass:?}\nrestitution = 0.65\ndeceleration = 0.4\n"
    )
}

fn text(answer: &Answer, name: &str, paint: Paint) -> String {
    let mut lines = vec![paint.strong(&format!("{name}: {}", answer.folder.display())), String::new()];
    for (engine, kicks) in &answer.kicks {
        let share = |rate: f64| format!("{:.0}", rate * kicks.trials as f64);
        let speed = kicks.ball_speed_median.map_or_else(|| "-".into(), |speed| format!("{speed:.2} m/s"));
        let line = format!(
            "{engine:<9} {} kicks: {} upright, {} hit, {} refused, ball {speed}",
            kicks.trials,
            share(kicks.upright_rate),
            share(kicks.hit_rate),
            kicks.refused
        );
        lines.push(if kicks.kicks() { paint.good(&line) } else { paint.warn(&line) });
    }
    lines.extend([String::new(), paint.strong("Look at these, in robot.toml and ball.toml:")]);
    lines.extend(answer.asked.iter().map(|item| format!("  - {item}")));
    if !answer.notes.is_empty() {
        lines.push(paint.strong("What is not as in the model:"));
        lines.extend(answer.notes.iter().map(|item| format!("  - {item}")));
    }
    lines.push(format!(
        "{} numbers and names were derived: instep robot show {}",
        answer.derived,
        answer.folder.display()
    ));
    lines.push(match answer.engines.first() {
        Some(_) => format!("Now: instep kick --robot {}", answer.folder.display()),
        None => paint.bad("No engine kicks with it yet: what is asked above may be why."),
    });
    lines.join("\n")
}
