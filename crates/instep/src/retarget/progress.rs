//! The line on standard error that tells how far retargeting has come, where that is a terminal; and how long each
//! stage took.

use std::collections::BTreeMap;
use std::time::Instant;

use indicatif::ProgressBar;
use instep_retarget::{kinematic, kinodynamic};

use crate::output;

/// The live line.
pub(super) struct Line {
    bar: ProgressBar,
    stage: &'static str,
    begin: Instant,
    seconds: BTreeMap<&'static str, f64>,
}

impl Line {
    /// A line that says that files are being read.
    pub(super) fn new() -> Self {
        let bar = output::bar(0, "{prefix:12} {bar:24} {pos:>3} of at most {len}, {wide_msg}");
        Self { bar, stage: "reading", begin: Instant::now(), seconds: BTreeMap::new() }
    }

    /// A new stage begins, and the last one ends.
    pub(super) fn at(&mut self, stage: &'static str) {
        if stage != self.stage {
            let now = Instant::now();
            *self.seconds.entry(self.stage).or_insert(0.0) += (now - self.begin).as_secs_f64();
            (self.stage, self.begin) = (stage, now);
        }
        self.bar.set_prefix(stage);
    }

    /// The stage that runs.
    pub(super) fn stage(&self) -> &'static str {
        self.stage
    }

    pub(super) fn kinematic(&mut self, at: &kinematic::Progress) {
        self.at("kinematic");
        self.bar.set_length(at.iterations as u64);
        self.bar.set_position(at.iteration as u64);
        if at.cost.is_finite() {
            self.bar.set_message(format!("cost {:.4e}", at.cost));
        }
    }

    pub(super) fn kinodynamic(&mut self, at: &kinodynamic::Progress) {
        self.at(match at.work {
            kinodynamic::Work::Optimisation => "kinodynamic",
            kinodynamic::Work::Verification => "verification",
        });
        self.bar.set_length(at.iterations as u64);
        self.bar.set_position(at.iteration as u64);
        let family = at.family.replace('_', " ");
        self.bar.set_message(format!("cost {:.4e}, worst violation {:.1e} ({family})", at.cost, at.violation));
    }

    /// Takes the line away.
    pub(super) fn clear(&mut self) {
        self.bar.finish_and_clear();
    }

    /// Takes the line away; the time of each stage, s.
    pub(super) fn finish(mut self) -> BTreeMap<&'static str, f64> {
        self.at("writing");
        self.clear();
        self.seconds
    }
}
