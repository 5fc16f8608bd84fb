//! A retargeted clip in words: the text on the terminal, and the sentences that the report shares with it.

use std::fmt::Write as _;

use instep_retarget::kinematic;
use instep_retarget::kinodynamic::{Binding, Kinodynamic, Status};

use super::Done;
use super::measures::FailureOf;
use crate::output::Paint;

/// How the last stage ended, as a key.
pub(super) fn status(done: &Done) -> &'static str {
    match done.kinodynamic.as_ref().map(|k| &k.status) {
        None => match done.retargeted.status {
            kinematic::Status::Solved => "solved",
            kinematic::Status::OutOfIterations => "out_of_iterations",
        },
        Some(Status::Solved) => "solved",
        Some(Status::SolvedLoosely { .. }) => "solved_loosely",
        Some(Status::Infeasible { .. }) => "infeasible",
        Some(Status::OutOfIterations { .. }) => "out_of_iterations",
        Some(Status::Unverified { .. }) => "unverified",
        Some(Status::Stopped) => "stopped",
    }
}

/// Why a motion is not feasible.
pub(super) fn failure(status: &Status) -> Option<FailureOf> {
    let (stage, family, knots, by) = match status {
        Status::Solved | Status::SolvedLoosely { .. } => return None,
        Status::Infeasible { family, knots, by } => ("kinodynamic", Some(*family), knots.clone(), Some(*by)),
        Status::OutOfIterations { family, by } => ("kinodynamic", Some(*family), Vec::new(), Some(*by)),
        Status::Unverified { family, by } => ("verification", Some(*family), Vec::new(), Some(*by)),
        Status::Stopped => ("kinodynamic", None, Vec::new(), None),
    };
    Some(FailureOf { stage, family, knots, by, message: ending(status) })
}

/// How the kinodynamic stage ended, as a sentence.
pub(super) fn ending(status: &Status) -> String {
    match status {
        Status::Solved => "solved".into(),
        Status::SolvedLoosely { family, by } => {
            format!("solved, to a looser tolerance: {}", violation(family, *by))
        }
        Status::Infeasible { family, knots, by } => {
            let knots = knots.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ");
            format!("infeasible: {} at knots {knots}", violation(family, *by))
        }
        Status::OutOfIterations { family, by } => format!("out of iterations: {}", violation(family, *by)),
        Status::Unverified { family, by } => {
            format!("fails the inverse-dynamics check: {} {by:.2e}", family.replace('_', " "))
        }
        Status::Stopped => "stopped; the best motion until then is kept".into(),
    }
}

/// What might help, where the robot cannot follow the clip.
pub(super) fn advice(k: &Kinodynamic) -> Option<String> {
    let family = failure(&k.status)?.family?;
    let hard = ["base_dynamics", "torque", "torque_violations", "joint_speed", "friction", "contact", "joint_limit"];
    hard.contains(&family).then(|| {
        format!(
            "The clip's timing (time scale {}) is beyond this robot as far as the solver can tell. A larger --time-scale \
             asks for less speed, but for higher jumps where the human leaves the ground.",
            k.time_scale
        )
    })
}

/// What the foot's speed ends at.
pub(super) fn speed_limits(k: &Kinodynamic) -> String {
    if k.swing_binding.is_empty() {
        return "no motor's limit; the costs".into();
    }
    k.swing_binding.iter().take(4).map(bound).collect::<Vec<_>>().join(", ")
}

fn bound(binding: &Binding) -> String {
    format!("{} of the {} ({:.0} %)", binding.limit, binding.joint.replace('_', " "), binding.share * 100.0)
}

/// A family's worst violation with its unit.
fn violation(family: &str, worst: f64) -> String {
    format!("{} {}", family.replace('_', " "), amount(family, worst))
}

/// How much that is.
pub(super) fn amount(family: &str, worst: f64) -> String {
    match family {
        _ if worst <= 0.0 => "none".to_owned(),
        "base_dynamics" | "friction" => format!("{worst:.1e} of m g"),
        "torque" | "joint_speed" | "ankle_lock" => format!("{:.1e} % beyond the limit", worst * 100.0),
        "joint_limit" | "approach_angle" => format!("{worst:.1e} rad beyond the range"),
        "contact_speed" => format!("{:.1e} m/s", worst * 10.0),
        _ => format!("{:.1e} mm", worst * 1e3),
    }
}

/// A family's worst violation after the kinematic stage.
pub(super) fn kinematic_violation(family: &str, worst: f64) -> String {
    match family {
        _ if worst <= 0.0 => "none".to_owned(),
        "joint_limit" => format!("{worst:.4} rad beyond the range"),
        "joint_speed" => format!("{:.0} % beyond the limit", worst * 100.0),
        _ => format!("{:.2} mm", worst * 1e3),
    }
}

impl Done {
    /// The text on the terminal.
    pub(super) fn text(&self, paint: Paint) -> String {
        let mut out = String::new();
        // Writing into a string cannot fail.
        let _ = self.write_text(&mut out, paint);
        out
    }

    fn write_text(&self, out: &mut String, paint: Paint) -> std::fmt::Result {
        let r = &self.retargeted;
        let row = |label: &str, value: String| format!("  {} {value}\n", paint.faint(&format!("{label:<15}")));
        let clip = self.clip_file.file_name().unwrap_or_default().to_string_lossy();
        writeln!(out, "{}", paint.strong(&format!("{clip} on {}", self.robot.title)))?;
        writeln!(out, "{}\n", paint.faint(self.stage()))?;
        out.push_str(&row(
            "clip",
            format!("{} frames at {:.0} Hz, {:.2} s", self.clip.frames.len(), self.clip.rate, self.clip.duration()),
        ));
        for mended in &self.mended {
            out.push_str(&row("", paint.warn(&mended.to_string())));
        }
        let p = &r.phases;
        let phases = format!(
            "planted {:.3} s, swing {:.3} s, lock {:.3} s, impact {:.3} s",
            p.t_plant, p.t_swing, p.t_lock, p.t_impact
        );
        out.push_str(&row("kick", format!("{} foot; {phases} (clip's time)", p.kick_foot)));
        let result = self.result();
        let knots = format!("{} knots at {} Hz, {:.2} s", result.knots.len(), result.rate, result.duration());
        out.push_str(&row("reference", knots));
        let (status, solved) = match r.status {
            kinematic::Status::Solved => ("solved", true),
            kinematic::Status::OutOfIterations => ("out of iterations: the best found is used", false),
        };
        let status = if solved { paint.good(status) } else { paint.warn(status) };
        out.push_str(&row(
            "kinematic",
            format!(
                "{status}, {} iterations, {:.2} s, {:.0} frames/s",
                r.iterations,
                self.kinematic_seconds(),
                self.frames_per_second()
            ),
        ));
        out.push_str(&row("keypoint error", format!("{:.1} mm on average", r.keypoint_error_mean() * 1e3)));
        match &self.kinodynamic {
            Some(k) => self.write_kinodynamic(k, out, paint)?,
            None => {
                out.push_str(&row("stance slip", format!("{:.1} mm at most", r.max_stance_slip * 1e3)));
                writeln!(out, "\n  {}", paint.faint("mean distance from the scaled human, mm"))?;
                for line in r.keypoint_errors.chunks(4) {
                    let cells =
                        line.iter().map(|(name, error)| format!("{:<15}{:>6.1}", name.replace('_', " "), error * 1e3));
                    writeln!(out, "  {}", cells.collect::<Vec<_>>().join("    "))?;
                }
                writeln!(out, "\n  {}", paint.faint("worst violation by family"))?;
                for (family, worst) in &r.violations {
                    let text = format!("{:<18}{}", family.replace('_', " "), kinematic_violation(family, *worst));
                    writeln!(out, "  {}", if *worst > 0.0 { paint.warn(&text) } else { paint.good(&text) })?;
                }
            }
        }
        writeln!(out, "\nwrote {} and {}", self.reference.display(), self.report.display())
    }

    fn write_kinodynamic(&self, k: &Kinodynamic, out: &mut String, paint: Paint) -> std::fmt::Result {
        let row = |label: &str, value: String| format!("  {} {value}\n", paint.faint(&format!("{label:<15}")));
        let ending = ending(&k.status);
        let status = if k.status.feasible() { paint.good(&ending) } else { paint.bad(&ending) };
        let seconds = self.seconds.get("kinodynamic").copied().unwrap_or(0.0);
        out.push_str(&row("kinodynamic", format!("{status}, {} iterations, {seconds:.1} s", k.iterations)));
        out.push_str(&row("time scale", format!("{}", k.time_scale)));
        let speed = format!(
            "{} at the impact (kinematic {:.2} m/s)",
            paint.strong(&format!("{:.2} m/s", k.foot_speed_at_impact)),
            k.kinematic_foot_speed
        );
        out.push_str(&row("foot speed", speed));
        out.push_str(&row("limited by", speed_limits(k)));
        out.push_str(&row("ball", format!("met {:.1} mm from where it is wanted", k.ball_miss * 1e3)));
        let turned = match k.aim_turn.to_degrees() {
            turn if turn.abs() > 0.05 => format!("; the motion was turned by {turn:.1}\u{b0} for it"),
            _ => String::new(),
        };
        out.push_str(&row("approach", format!("{:.1}\u{b0}{turned}", k.approach_angle.to_degrees())));
        let v = &k.verification;
        writeln!(out, "\n  {}", paint.faint(&format!("full inverse dynamics at {} instants", v.samples)))?;
        let checks = [
            (format!("{} torques beyond the drives'", v.torque_violations), v.torque_violations == 0),
            (format!("{} speeds, {} angles beyond", v.speed_violations, v.joint_violations), {
                v.speed_violations + v.joint_violations == 0
            }),
            (format!("wrench on the base {:.2} % of m g", v.root_wrench_residual * 100.0), {
                v.root_wrench_residual <= instep_retarget::kinodynamic::verify::MAX_ROOT_WRENCH
            }),
            (format!("stance slip {:.2} mm, lift {:.2} mm", v.stance_slip * 1e3, v.stance_lift * 1e3), {
                v.stance_slip.max(v.stance_lift) <= instep_retarget::kinodynamic::verify::MAX_SLIP
            }),
        ];
        for (text, good) in checks {
            writeln!(out, "  {}", if good { paint.good(&text) } else { paint.bad(&text) })?;
        }
        writeln!(out, "\n  {}", paint.faint("worst violation by family"))?;
        for (family, worst) in &k.violations {
            let text = format!("{:<18}{}", family.replace('_', " "), amount(family, *worst));
            writeln!(out, "  {}", if *worst > 1e-4 { paint.warn(&text) } else { paint.good(&text) })?;
        }
        if !k.status.feasible() {
            writeln!(
                out,
                "\n  {}",
                paint.bad("NOT FEASIBLE: the best motion that was found is written, and marked so.")
            )?;
        }
        if let Some(advice) = advice(k) {
            writeln!(out, "  {}", paint.warn(&advice))?;
        }
        Ok(())
    }
}
