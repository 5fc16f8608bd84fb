//! `instep kick --engine`: one request, or a file of them, planned by an engine and tried in the world.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use instep_bench::Subject;
use instep_bench::cell::{Kicked, Ran, run_case};
use instep_bench::scenario::Case;
use instep_kick::{KickRequest, Standing};
use instep_motion::text;
use instep_sim::World;
use instep_sim::audit::{Audit, Rerun};
use instep_sim::settings::{Change, WorldSettings};
use serde::Serialize;

use super::{Source, Tried, steps, summary};
use crate::failure::Failure;
use crate::files;
use crate::output::Output;

/// What `--json` prints for each request.
#[derive(Debug, Serialize)]
struct Answer {
    request: KickRequest,
    /// The refusal, or null.
    refused: Option<Refused>,
    /// What came of an accepted request.
    kicked: Option<Kicked>,
    /// How the audit found it, and why; its keys are those of `instep kick` without an engine.
    audit: Option<&'static str>,
    audit_reason: Option<String>,
    converged: Option<bool>,
    rerun: Option<Rerun>,
    touches: usize,
    world_changes: Vec<Change>,
    direction_error_deg: Option<f64>,
    plan_s: f64,
    /// Report and recording, where there was one request and it was not refused.
    report: Option<PathBuf>,
    recording: Option<PathBuf>,
}

#[derive(Debug, Serialize)]
struct Refused {
    cause: &'static str,
    message: String,
    /// Where the robot could stand for this kick: `position` in metres in its present footprint frame, `heading` in radians to the
    /// left; null where no place near will do.
    stand: Option<Standing>,
}

/// Where files go.
pub(super) struct Folders<'a> {
    /// Report and recording.
    pub(super) out: &'a Path,
    /// Physics steps.
    pub(super) steps: Option<&'a Path>,
    /// The small picture.
    pub(super) picture: Option<&'a Path>,
}

/// Runs `requests` one after the other, each from where the engine starts; a single one is shown in a report under `out`, and its
/// physics steps are kept where that is asked for.
///
/// # Errors
/// When engine or world cannot be made, or a simulation diverges. A refusal is an answer.
pub(super) fn run(
    subject: &Subject,
    engine: &str,
    requests: &[KickRequest],
    settings: WorldSettings,
    seed: u64,
    folders: Folders,
    output: &Output,
) -> Result<ExitCode, Failure> {
    let Folders { out, steps: kept, picture } = folders;
    let (report, recording) = (out.join("report.html"), out.join("kick.mcap"));
    if requests.len() == 1 {
        for file in [report.as_path(), &recording].into_iter().chain(picture) {
            files::check_file(file)?;
        }
    }
    let world_changes = settings.changes(&subject.default_world());
    let mut world = World::new(subject.robot.clone(), &settings)?;
    if let Some(folder) = kept {
        steps::prepare(folder, &mut world)?;
    }
    let mut answers = Vec::with_capacity(requests.len());
    let mut shown = None;
    for request in requests {
        let case = Case::of(request, seed);
        let (outcome, plan_s, ran) = run_case(subject, engine, &case, &mut world, &mut Vec::new())?;
        let refused = match &outcome {
            Ok(_) => None,
            Err(refusal) => {
                let stand = subject.engine(engine)?.where_to_stand(request);
                let mut message = refusal.explain(&subject.robot);
                if let Some(stand) = &stand {
                    message = format!("{message}; {}", stand.text());
                }
                Some(Refused { cause: refusal.name(), message, stand })
            }
        };
        let kicked = outcome.ok();
        let direction_error_deg = kicked.and_then(|k| k.direction_error).map(f64::to_degrees);
        if let (Some(folder), Some(ran)) = (kept, &ran) {
            steps::write(folder, &mut world, &ran.trial)?;
        }
        let audit = ran.as_ref().map(|ran| ran.trial.audit.clone());
        let touches = ran.as_ref().map_or(0, |ran| ran.trial.touches.len());
        let ran = ran.filter(|_| requests.len() == 1);
        let files = ran.as_ref().map(|_| (report.clone(), recording.clone())).unzip();
        let (report, recording) = files.clone();
        answers.push(Answer {
            request: *request,
            refused,
            kicked,
            audit: audit.as_ref().map(Audit::verdict),
            audit_reason: audit.as_ref().map(Audit::reason),
            converged: audit.as_ref().map(|audit| audit.converged),
            rerun: audit.as_ref().and_then(|audit| audit.rerun),
            touches,
            world_changes: world_changes.clone(),
            direction_error_deg,
            plan_s,
            report,
            recording,
        });
        if let (Some(Ran { plan, settings, trial, .. }), (Some(report), Some(recording))) = (ran, files) {
            let source = Source::Asked { engine: engine.to_owned(), request: *request, plan };
            let (robot, world_changes) = (subject.robot.clone(), world_changes.clone());
            let picture = picture.map(Path::to_owned);
            let tried = Tried { robot, source, settings, world_changes, trial, report, recording, picture };
            tried.write()?;
            shown = Some(tried);
        }
    }
    output.show(&serde_json::json!({ "requests": answers, "world_changes": world_changes }), |paint| {
        shown.as_ref().map_or_else(|| answers.iter().map(line).collect(), |tried| summary::text(tried, paint))
    })?;
    Ok(ExitCode::SUCCESS)
}

fn line(answer: &Answer) -> String {
    let [x, y] = answer.request.ball;
    let place = format!("ball ({x:.3}, {y:.3}) m, {:.1} deg: ", answer.request.direction.to_degrees());
    let Some(kicked) = &answer.kicked else {
        let message = answer.refused.as_ref().map_or("", |refused| refused.message.as_str());
        return format!("{place}refused: {message}\n");
    };
    let speed = kicked.ball_speed.map_or_else(
        || if kicked.audit_invalid { "touched, but not to be believed".into() } else { "missed".to_owned() },
        |v| format!("{v:.2} m/s"),
    );
    let error = answer.direction_error_deg.map_or_else(String::new, |e| format!(", {e:+.1} deg off"));
    let stands = if kicked.upright { "stands" } else { "fell" };
    format!("{place}{speed}{error}, rolls {:.2} m, {stands}\n", kicked.distance)
}

/// The requests of a file: a JSON array of requests, or one a line.
///
/// # Errors
/// When the file cannot be read as such.
pub(super) fn load(path: &Path) -> Result<Vec<KickRequest>, Failure> {
    let wrong = |detail: String| Failure::input(format!("{}: {detail} (--requests)", path.display()));
    let bytes = std::fs::read(path).map_err(|e| wrong(format!("cannot be read: {e}; expected JSON")))?;
    let text = text::decode(&bytes);
    if text.trim().is_empty() {
        return Err(wrong("holds no request; expected a JSON array of requests, or one request a line".into()));
    }
    if text.trim_start().starts_with('[') {
        return serde_json::from_str(&text).map_err(|e| wrong(e.to_string()));
    }
    let lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
    let expected = "expected a JSON array of requests, or one request a line";
    lines
        .map(|(i, line)| serde_json::from_str(line).map_err(|e| wrong(format!("line {}: {e}; {expected}", i + 1))))
        .collect()
}
