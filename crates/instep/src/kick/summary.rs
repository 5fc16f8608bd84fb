//! A kick in words and numbers: the text on the terminal, and the sentences that the report shares with it.

use std::fmt::Write as _;

use instep_sim::audit::Rerun;
use instep_sim::trial::{GroupPeak, Trial};
use nalgebra::Vector3;

use super::{Source, Tried};
use crate::output::Paint;

/// Moments worth a mark, in time order: (s, what).
pub(super) fn events(trial: &Trial) -> Vec<(f64, &'static str)> {
    let impact = trial.impact.as_ref().map(|impact| (impact.time, "impact"));
    let fall = trial.fell_at.map(|time| (time, "fall"));
    let mut events: Vec<_> = impact.into_iter().chain(fall).collect();
    events.sort_by(|a, b| a.0.total_cmp(&b.0));
    events
}

/// Where the kick started, and what was therefore not tried.
pub(super) fn start(tried: &Tried) -> String {
    let q_speed = Vector3::new(tried.settings.v[0], tried.settings.v[1], tried.settings.v[2]).norm();
    let followed = match &tried.source {
        Source::Followed(followed) => followed,
        Source::Asked { plan, .. } => {
            let from = if q_speed > 0.0 {
                format!("from a run-up at {q_speed:.2} m/s, whose beginning was not simulated")
            } else {
                "from the stand".into()
            };
            return format!("{from}, contact forecast at {:.2} s with {:.2} m/s", plan.contact, plan.ball_speed);
        }
    };
    let (start, end) = (followed.start, followed.reference.duration());
    if start == 0.0 {
        format!("played from its beginning, with the base already moving at {q_speed:.2} m/s")
    } else {
        format!(
            "started {start:.3} s into the reference's {end:.3} s, in its state there (base moving at \
             {q_speed:.2} m/s); what comes before it, such as a run-up, was not simulated"
        )
    }
}

/// The fall, or that there was none.
pub(super) fn balance(tried: &Tried) -> String {
    let trial = &tried.trial;
    match (trial.fell_at, &trial.impact) {
        (None, _) => format!("upright to the end, {:.2} s", tried.settings.duration),
        (Some(fall), Some(impact)) if fall >= impact.time => {
            format!("fell at {fall:.3} s, {:.3} s after the impact", fall - impact.time)
        }
        (Some(fall), Some(impact)) => format!("fell at {fall:.3} s, {:.3} s before the impact", impact.time - fall),
        (Some(fall), None) => format!("fell at {fall:.3} s"),
    }
}

/// What the whole kick led to at a finer step.
pub(super) fn rerun(rerun: &Rerun) -> String {
    let change = |value: Option<f64>, factor: f64, unit: &str| {
        value.map_or_else(|| "missed the ball".into(), |v| format!("{:+.2}{unit}", v * factor))
    };
    let speed = change(rerun.ball_speed_change, 100.0, " % ball speed");
    let stands = if rerun.upright { "upright" } else { "fell" };
    let direction = rerun.direction_change_deg.map_or_else(String::new, |v| format!(", {v:+.2}\u{b0} direction"));
    format!("{speed}{direction}, {stands}, at steps of {} ms", rerun.step * 1e3)
}

/// Signed angle and the side it leads to.
pub(super) fn direction(angle: f64) -> String {
    let degrees = angle.to_degrees();
    let side = if degrees.abs() < 0.05 {
        "straight"
    } else if degrees > 0.0 {
        "left"
    } else {
        "right"
    };
    format!("{:.1}\u{b0} {side}", degrees.abs())
}

/// The text on the terminal.
pub(super) fn text(tried: &Tried, paint: Paint) -> String {
    let mut text = String::new();
    // Writing into a string cannot fail.
    let _ = write_all(&mut text, tried, paint);
    text
}

fn write_all(out: &mut String, tried: &Tried, paint: Paint) -> std::fmt::Result {
    let (trial, robot) = (&tried.trial, &tried.robot);
    writeln!(out, "{}", paint.strong(&robot.title))?;
    writeln!(out, "{}", tried.steered())?;
    writeln!(out, "{}\n", paint.faint(&start(tried).replacen("; ", ";\n", 1)))?;

    let row = |label: &str, value: String| format!("  {} {value}\n", paint.faint(&format!("{label:<15}")));
    match &trial.impact {
        None => writeln!(out, "{}", paint.bad("  The robot did not touch the ball: there is no ball speed."))?,
        Some(impact) => {
            let speed = format!("{:.2} m/s", trial.ball_speed.unwrap_or(0.0));
            let speed = if trial.audit.faults.is_empty() {
                paint.strong(&speed)
            } else {
                paint.bad(&format!("{speed}, not to be believed: see the audit"))
            };
            out.push_str(&row("ball speed", speed));
            let angle =
                |angle: Option<f64>| angle.map_or_else(|| "none".into(), |a| format!("{:.1}\u{b0}", a.to_degrees()));
            out.push_str(&row("direction", trial.direction_error.map_or_else(|| "none".into(), direction)));
            out.push_str(&row("launch angle", angle(trial.launch_angle)));
            let strike =
                format!("{:.2} m/s, {:.2} m/s of it along the impact", impact.foot_speed, impact.foot_speed_normal);
            out.push_str(&row("foot speed", format!("{strike}; {}", impact.link)));
            out.push_str(&row("effective mass", format!("{:.2} kg", impact.effective_mass)));
            out.push_str(&row("restitution", format!("{:.3}", impact.restitution)));
            let touches = if trial.touches.len() > 1 {
                format!("; touched {} times", trial.touches.len())
            } else {
                String::new()
            };
            let contact = format!("{:.3} s, for {:.1} ms{touches}", impact.time, impact.duration * 1e3);
            out.push_str(&row("impact at", contact));
        }
    }
    let audit = match trial.audit.verdict() {
        "valid" => paint.good("valid"),
        verdict => paint.bad(&format!("{verdict}: {}", trial.audit.reason())),
    };
    out.push_str(&row("audit", audit));
    if let Some(rerun) = &trial.audit.rerun {
        let text = self::rerun(rerun);
        out.push_str(&row("re-run", if trial.audit.converged { text } else { paint.bad(&text) }));
    }
    for change in &tried.world_changes {
        out.push_str(&row("changed world", paint.bad(&change.to_string())));
    }
    let balance = balance(tried);
    out.push_str(&row("balance", if trial.upright() { paint.good(&balance) } else { paint.bad(&balance) }));
    if let Some(slip) = trial.support_slip {
        out.push_str(&row("support slip", format!("{:.0} mm", slip * 1e3)));
    }

    let width = trial.groups.iter().map(|group| group.group.len()).max().unwrap_or(0);
    writeln!(out, "\n  {}", paint.faint(&format!("{:<width$} {:>22}{:>41}", "", "peak torque", "peak speed")))?;
    for group in &trial.groups {
        writeln!(out, "{}", peaks(group, width, paint))?;
    }
    if trial.limit_violations.is_empty() {
        writeln!(out, "  {}", paint.good("no joint beyond its limits"))?;
    }
    for v in &trial.limit_violations {
        let unit = if v.quantity == "torque" { "N m" } else { "rad/s" };
        let found = format!("{:.2} {unit} at {:.3} s, limit {:.1}", v.peak, v.time, v.limit);
        writeln!(out, "  {}", paint.bad(&format!("{} beyond its {} limit: {found}", v.joint, v.quantity)))?;
    }
    if let Some(impact) = trial.impact.as_ref().filter(|_| !trial.segments.is_empty()) {
        writeln!(out, "\n  {}", paint.faint("peak forward speed, from pelvis to toe, and when (0 ms is the impact)"))?;
        for s in &trial.segments {
            let when = (s.time - impact.time) * 1e3;
            writeln!(out, "  {:<width$} {:>7.2} m/s {when:>+7.0} ms", s.segment, s.speed)?;
        }
    }
    writeln!(out, "\nwrote {} and {}", tried.report.display(), tried.recording.display())
}

/// One line of peaks against limits.
fn peaks(g: &GroupPeak, width: usize, paint: Paint) -> String {
    let torque = format!("{:>6.1} / {:<5.4} N m  ", g.torque, number(g.torque_limit));
    let speed = format!("{:>6.1} / {:<5.4} rad/s  ", g.speed, number(g.speed_limit));
    let bar = |share: f64| paint.bar(share);
    let (torque_bar, speed_bar) = (bar(g.torque / g.torque_limit), bar(g.speed / g.speed_limit));
    format!("  {:<width$} {torque}{torque_bar}   {speed}{speed_bar}", g.group)
}

/// A limit as short as it is.
fn number(value: f64) -> String {
    let text = format!("{value:.1}");
    text.strip_suffix(".0").map_or(text.clone(), str::to_owned)
}
