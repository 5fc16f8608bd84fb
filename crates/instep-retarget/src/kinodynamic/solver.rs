//! The solver: augmented Lagrangian, Gauss-Newton steps with Levenberg and Marquardt's damping, banded in time.
//!
//! Source: Nocedal and Wright, Numerical Optimization (2006), algorithm 17.4 and section 10.3. Every row is a square
//! ([`super::terms`]), so the matrix of a step is positive definite whatever rows are redundant. The forces of a node
//! meet nothing but that node's three coefficients: they are eliminated there (Schur complement), and what is left is
//! banded with 3 nv diagonals below the main one ([`crate::banded`]). A step of a three-second clip at 180 nodes a second takes about
//! 0.28 s of a core, where one quadratic program of that size took eight seconds in a general sparse solver
//! (clarabel), and a general interior-point method (POUNCE, Ipopt) 6 to 17 seconds in all at a quarter of the nodes.
//!
//! Rounds: minimise for fixed multipliers, move the multipliers, raise the penalty of the families that break their real
//! limits and have not become twice as good. Stiff penalties that no limit needs were the main cause of slow ends. The places of standing feet follow the motion in the first rounds and then stay.

use std::sync::atomic::{AtomicBool, Ordering};

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::local::{Local, Stencil};
use super::node::{Scratch, rows};
use super::plan::Plan;
use super::terms::{FAMILIES, Family, Pass, Sink, Worst};
use super::transcription::Unknowns;
use super::{Progress, Work, ankle_lock, limits, smoothness};
use crate::banded::Banded;

/// First penalty of each family, in the order of [`Family::ALL`].
const RHO: [f64; FAMILIES] = [1e0, 1e0, 1e3, 1e2, 1e2, 1e2, 1e-1, 1e1, 1e0, 1e1, 1e1];
/// Most that a penalty grows to, as a factor.
const RHO_GROWTH: f64 = 1e4;
/// Rounds in which standing feet still find their place.
const SETTLING: usize = 2;
/// Most steps in one round.
const STEPS: usize = 12;
/// Largest force of the damping on the forces, which keeps their matrix well conditioned.
const FORCE_RIDGE: f64 = 1e-8;
/// Damping of forces, which are about one, over that of coordinates.
const FORCE_DAMPING: f64 = 0.1;
/// Damping values tried for a step before the merit counts as lowest.
const TRIES: usize = 10;

/// How the iterations ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum End {
    Converged,
    Rounds,
    Iterations,
    Stopped,
}

/// Rows on coefficients alone, a few of them.
pub(crate) struct CoefficientSink<'a> {
    system: Option<(&'a mut Banded, &'a mut Vec<f64>)>,
    worst: Option<&'a mut Worst>,
    update: bool,
    rho: &'a [f64; FAMILIES],
    multipliers: &'a mut Vec<f64>,
    cursor: usize,
    merit: f64,
}

impl CoefficientSink<'_> {
    pub(crate) fn equal(&mut self, family: Family, block: usize, value: f64, gradient: &[(usize, f64)]) {
        self.row(family, block, value, gradient, false);
    }

    pub(crate) fn at_most(&mut self, family: Family, block: usize, value: f64, gradient: &[(usize, f64)]) {
        self.row(family, block, value, gradient, true);
    }

    fn row(&mut self, family: Family, block: usize, value: f64, gradient: &[(usize, f64)], one_sided: bool) {
        if self.cursor == self.multipliers.len() {
            self.multipliers.push(0.0);
        }
        let rho = self.rho[family as usize];
        let y = self.multipliers[self.cursor];
        if let Some(worst) = self.worst.as_deref_mut() {
            worst.note(family, if one_sided { value } else { value.abs() }, block.saturating_sub(1));
        }
        if self.update {
            let moved = y + rho * value;
            self.multipliers[self.cursor] = if one_sided { moved.max(0.0) } else { moved };
        }
        self.cursor += 1;
        let residual = value + y / rho;
        if one_sided && residual <= 0.0 {
            return;
        }
        self.cost(rho, residual, gradient);
    }

    /// A cost `weight` `value`^2 / 2, or a row of the augmented Lagrangian.
    pub(crate) fn cost(&mut self, weight: f64, value: f64, gradient: &[(usize, f64)]) {
        self.merit += 0.5 * weight * value * value;
        if let Some((matrix, sums)) = self.system.as_mut() {
            for (at, &(i, g)) in gradient.iter().enumerate() {
                sums[i] += weight * g * value;
                for &(j, other) in &gradient[..=at] {
                    matrix.add(i.max(j), i.min(j), weight * g * other);
                }
            }
        }
    }
}

/// The forces' part of one node's step.
struct Eliminated {
    factor: Cholesky<f64, Dyn>,
    /// (L^-1 H_fc)^T.
    coupling: DMatrix<f64>,
    /// L^-1 g_f.
    right: DVector<f64>,
}

pub(crate) struct Solver<'a, 'b> {
    pub plan: &'a mut Plan<'b>,
    pub x: Unknowns,
    pub rho: [f64; FAMILIES],
    node_multipliers: Vec<Vec<f64>>,
    coefficient_multipliers: Vec<f64>,
    stencil: Stencil,
    scratch: Scratch,
    locals: Vec<Local>,
    matrix: Banded,
    gradient: Vec<f64>,
    eliminated: Vec<Option<Eliminated>>,
    damping: f64,
    pub iterations: usize,
    pub cost: f64,
    pub round: usize,
}

impl<'a, 'b> Solver<'a, 'b> {
    /// Starts at `x`.
    pub(crate) fn new(plan: &'a mut Plan<'b>, x: Unknowns) -> Self {
        let nv = plan.tree.nv;
        let count = plan.nodes.len();
        let size = x.c.len();
        let matrix = Banded::zeros(size, 3 * nv);
        Self {
            rho: RHO,
            node_multipliers: vec![Vec::new(); count],
            coefficient_multipliers: Vec::new(),
            stencil: Stencil::new(plan.step),
            scratch: Scratch::new(plan),
            locals: x.f.iter().map(|f| Local::new(nv, f.len(), Stencil::new(plan.step))).collect(),
            matrix,
            gradient: vec![0.0; size],
            eliminated: Vec::new(),
            damping: 1e-3,
            iterations: 0,
            cost: 0.0,
            round: 0,
            x,
            plan,
        }
    }

    /// Sums the augmented Lagrangian at `x`; NaN where the motion is no motion.
    fn merit(&mut self, x: &Unknowns) -> f64 {
        let mut state = Default::default();
        let mut merit = 0.0;
        let mut cost = 0.0;
        for k in 0..self.plan.nodes.len() {
            x.state(k, self.plan.tree.nv, &self.stencil, &mut state);
            let mut sink = Sink::new(Pass::Value, k, &self.rho, &mut self.node_multipliers[k]);
            let [q, v, a] = &state;
            rows(self.plan, k, [q, v, a, &x.f[k]], false, &mut self.scratch, &mut sink);
            merit += sink.merit;
            cost += sink.cost;
        }
        self.cost = cost;
        merit + self.coefficient_rows(x, false, None)
    }

    fn coefficient_rows(&mut self, x: &Unknowns, update: bool, worst: Option<&mut Worst>) -> f64 {
        let mut sink = CoefficientSink {
            system: None,
            worst,
            update,
            rho: &self.rho,
            multipliers: &mut self.coefficient_multipliers,
            cursor: 0,
            merit: 0.0,
        };
        limits::rows(self.plan, &x.c, &mut sink);
        ankle_lock::rows(self.plan, &x.c, &mut sink);
        smoothness::rows(self.plan, &x.c, &mut sink);
        sink.merit
    }

    /// Violations at the present unknowns; with `update`, the multipliers move too.
    pub(crate) fn violations(&mut self, update: bool) -> Worst {
        let mut worst = Worst::default();
        let x = std::mem::replace(&mut self.x, Unknowns { c: Vec::new(), f: Vec::new() });
        let mut state = Default::default();
        for k in 0..self.plan.nodes.len() {
            x.state(k, self.plan.tree.nv, &self.stencil, &mut state);
            let pass = if update { Pass::Update(&mut worst) } else { Pass::Report(&mut worst) };
            let mut sink = Sink::new(pass, k, &self.rho, &mut self.node_multipliers[k]);
            let [q, v, a] = &state;
            rows(self.plan, k, [q, v, a, &x.f[k]], false, &mut self.scratch, &mut sink);
        }
        self.coefficient_rows(&x, update, Some(&mut worst));
        self.x = x;
        worst
    }

    /// The violation of one family at each node.
    pub(crate) fn by_node(&mut self, family: Family) -> Vec<f64> {
        let mut values = vec![Worst::default(); self.plan.nodes.len()];
        let mut state = Default::default();
        for (k, worst) in values.iter_mut().enumerate() {
            self.x.state(k, self.plan.tree.nv, &self.stencil, &mut state);
            let mut sink = Sink::new(Pass::Report(worst), k, &self.rho, &mut self.node_multipliers[k]);
            let [q, v, a] = &state;
            rows(self.plan, k, [q, v, a, &self.x.f[k]], false, &mut self.scratch, &mut sink);
        }
        let mut all: Vec<f64> = values.iter().map(|worst| worst.values[family as usize]).collect();
        let x = self.x.clone();
        let mut worst = Worst::default();
        self.coefficient_rows(&x, false, Some(&mut worst));
        if let Some(value) = all.get_mut(worst.nodes[family as usize]) {
            *value = value.max(worst.values[family as usize]);
        }
        all
    }

    /// Builds every node's matrix and gradient at the present unknowns.
    fn linearise(&mut self) {
        let nv = self.plan.tree.nv;
        let mut state = Default::default();
        for k in 0..self.plan.nodes.len() {
            self.x.state(k, nv, &self.stencil, &mut state);
            let local = &mut self.locals[k];
            local.clear();
            let mut sink = Sink::new(Pass::Derivatives(local), k, &self.rho, &mut self.node_multipliers[k]);
            let [q, v, a] = &state;
            rows(self.plan, k, [q, v, a, &self.x.f[k]], true, &mut self.scratch, &mut sink);
            local.finish();
        }
    }

    /// Eliminates the forces and sums up the banded system, both damped. False where that cannot be.
    fn assemble(&mut self) -> bool {
        let nv = self.plan.tree.nv;
        self.matrix.clear();
        self.gradient.fill(0.0);
        self.eliminated.clear();
        for (k, local) in self.locals.iter().enumerate() {
            let forces = self.x.f[k].len();
            let wide = 3 * nv;
            let size = wide + forces;
            let whole = local.matrix.as_slice();
            for j in 0..wide {
                let target = self.matrix.column_mut(k * nv + j);
                for (entry, value) in target.iter_mut().zip(&whole[j * size + j..j * size + wide]) {
                    *entry += value;
                }
                self.gradient[k * nv + j] += local.gradient[j];
            }
            if forces == 0 {
                self.eliminated.push(None);
                continue;
            }
            let mut own = local.matrix.view((wide, wide), (forces, forces)).into_owned();
            own.fill_upper_triangle_with_lower_triangle();
            (0..forces).for_each(|i| own[(i, i)] += FORCE_RIDGE + FORCE_DAMPING * self.damping);
            let Some(factor) = own.cholesky() else { return false };
            // L^-1 H_fc, row by row, by forward substitution of whole rows.
            let mut coupling = DMatrix::from_fn(wide, forces, |j, i| local.matrix[(wide + i, j)]);
            let mut right = DVector::from_column_slice(&local.gradient[wide..]);
            let l = factor.l_dirty();
            for i in 0..forces {
                for before in 0..i {
                    let share = l[(i, before)];
                    let (done, rest) = coupling.as_mut_slice().split_at_mut(i * wide);
                    let done = &done[before * wide..(before + 1) * wide];
                    rest[..wide].iter_mut().zip(done).for_each(|(entry, value)| *entry -= share * value);
                    right[i] -= share * right[before];
                }
                let pivot = 1.0 / l[(i, i)];
                coupling.column_mut(i).scale_mut(pivot);
                right[i] *= pivot;
            }
            let rows = coupling.as_slice();
            for j in 0..wide {
                let target = &mut self.matrix.column_mut(k * nv + j)[..wide - j];
                let mut fall = 0.0;
                for (row, r) in rows.chunks_exact(wide).zip(right.iter()) {
                    let share = row[j];
                    fall += share * r;
                    target.iter_mut().zip(&row[j..]).for_each(|(entry, value)| *entry -= share * value);
                }
                self.gradient[k * nv + j] -= fall;
            }
            self.eliminated.push(Some(Eliminated { factor, coupling, right }));
        }
        let mut sink = CoefficientSink {
            system: Some((&mut self.matrix, &mut self.gradient)),
            worst: None,
            update: false,
            rho: &self.rho,
            multipliers: &mut self.coefficient_multipliers,
            cursor: 0,
            merit: 0.0,
        };
        limits::rows(self.plan, &self.x.c, &mut sink);
        ankle_lock::rows(self.plan, &self.x.c, &mut sink);
        smoothness::rows(self.plan, &self.x.c, &mut sink);
        (0..self.gradient.len()).for_each(|i| self.matrix.add(i, i, self.damping));
        self.gradient.iter().all(|g| g.is_finite())
    }

    /// The present unknowns moved by the damped step, and by how much the merit should fall; none where the system
    /// cannot be solved.
    fn trial(&mut self) -> Option<(Unknowns, f64)> {
        if !self.assemble() {
            return None;
        }
        let nv = self.plan.tree.nv;
        let mut d: Vec<f64> = self.gradient.iter().map(|g| -g).collect();
        if !self.matrix.factor_and_solve(&mut d) {
            return None;
        }
        let mut trial = self.x.clone();
        trial.c.iter_mut().zip(&d).for_each(|(c, d)| *c += d);
        // Of the damped model, which is what the step minimises: half of minus gradient times step.
        let mut predicted: f64 = -0.5 * d.iter().zip(&self.gradient).map(|(d, g)| d * g).sum::<f64>();
        for (k, part) in self.eliminated.iter().enumerate() {
            let Some(part) = part else { continue };
            let moved = DVector::from_column_slice(&d[k * nv..(k + 3) * nv]);
            let mut step = -(part.coupling.tr_mul(&moved) + &part.right);
            predicted += 0.5 * part.right.norm_squared();
            if !part.factor.l_dirty().tr_solve_lower_triangular_mut(&mut step) {
                return None;
            }
            trial.f[k].iter_mut().zip(step.iter()).for_each(|(f, d)| *f += d);
        }
        Some((trial, predicted))
    }

    /// One damped step; returns the merit after it, `None` where no damping lowers it.
    fn step(&mut self, before: f64) -> Option<f64> {
        self.linearise();
        for _ in 0..TRIES {
            if let Some((trial, predicted)) = self.trial() {
                let after = self.merit(&trial);
                if after < before {
                    self.x = trial;
                    // Nielsen's rule: the better the prediction, the less damping.
                    let ratio = (before - after) / predicted.max(f64::MIN_POSITIVE);
                    let factor = (1.0 - (2.0 * ratio - 1.0).powi(3)).clamp(0.1, 4.0);
                    self.damping = (self.damping * factor).clamp(1e-9, 1e9);
                    return Some(after);
                }
                if predicted < 1e-12 * before.abs() {
                    return None;
                }
            }
            self.damping = (self.damping * 6.0).max(1e-9);
        }
        self.damping = self.damping.min(1e3);
        None
    }

    /// Runs to the end, keeping the best unknowns.
    pub(crate) fn run(&mut self, stop: &AtomicBool, progress: &mut dyn FnMut(Progress)) -> End {
        let settings = self.plan.settings;
        let mut last = [f64::INFINITY; FAMILIES];
        let mut best: Option<(f64, Unknowns)> = None;
        let mut end = End::Rounds;
        'rounds: for round in 0..settings.rounds {
            self.round = round;
            if round < SETTLING {
                let positions = self.positions();
                self.plan.settle(&positions);
            }
            let x = self.x.clone();
            let mut merit = self.merit(&x);
            for _ in 0..STEPS {
                if stop.load(Ordering::Relaxed) {
                    end = End::Stopped;
                    break 'rounds;
                }
                if self.iterations >= settings.iterations {
                    end = End::Iterations;
                    break 'rounds;
                }
                let Some(after) = self.step(merit) else { break };
                self.iterations += 1;
                let worst = self.violations(false);
                let (family, by) = worst.most();
                progress(Progress {
                    work: Work::Optimisation,
                    iteration: self.iterations,
                    iterations: settings.iterations,
                    round,
                    cost: self.cost,
                    violation: by,
                    family: family.name(),
                });
                let fall = merit - after;
                merit = after;
                if fall < 1e-3 * merit.abs() {
                    break;
                }
            }
            let worst = self.violations(true);
            let by = self.real(&worst);
            if best.as_ref().is_none_or(|(least, _)| by < *least) {
                best = Some((by, self.x.clone()));
            }
            if by <= settings.tolerance && round >= SETTLING {
                end = End::Converged;
                break;
            }
            // Only what the real limits mind: within its margin a family needs no stiffer penalty.
            let real = super::assemble::violations(self, &worst);
            for (i, before) in last.iter_mut().enumerate() {
                let now = real.get(Family::ALL[i].name()).copied().unwrap_or(0.0);
                if now > settings.tolerance && now > 0.5 * *before {
                    let most = RHO[i] * RHO_GROWTH;
                    self.rho[i] = (self.rho[i] * 3.0).min(most);
                }
                *before = now;
            }
        }
        // What was best after a round, unless the present is better still.
        let worst = self.violations(false);
        let now = self.real(&worst);
        if let Some((_, unknowns)) = best.filter(|(least, _)| now.is_nan() || now > *least) {
            self.x = unknowns;
        }
        end
    }

    /// The worst violation of the real limits, margins not counted.
    fn real(&self, worst: &Worst) -> f64 {
        super::assemble::violations(self, worst).values().fold(0.0, |most, v| v.max(most))
    }

    /// Coordinates at all nodes.
    pub(crate) fn positions(&self) -> Vec<Vec<f64>> {
        let mut state: [Vec<f64>; 3] = Default::default();
        (0..self.plan.nodes.len())
            .map(|k| {
                self.x.state(k, self.plan.tree.nv, &self.stencil, &mut state);
                state[0].clone()
            })
            .collect()
    }

    /// Position, speed and acceleration at a node.
    pub(crate) fn state(&self, k: usize) -> [Vec<f64>; 3] {
        let mut state = Default::default();
        self.x.state(k, self.plan.tree.nv, &self.stencil, &mut state);
        state
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "tests stop at the first surprise")]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::kinematic::Weights;
    use crate::kinodynamic::KinodynamicSettings;
    use crate::kinodynamic::tests::{noise, started};

    /// One family of rows on coefficients.
    type Rows = fn(&Plan, &[f64], &mut CoefficientSink);

    /// (16), (17), (19) and the jerk: their gradient is the difference of what they add.
    #[test]
    fn gradients_of_rows_on_coefficients_are_differences() {
        let robots = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots");
        let robot = instep_robot::Robot::load(&robots.join("prestoe")).unwrap();
        let start = started(&robot);
        let settings = KinodynamicSettings { rate: 60.0, ..KinodynamicSettings::default() };
        let plan = Plan::new(&robot, &start, &Weights::default(), &settings).unwrap();
        let nv = plan.tree.nv;
        let mut c = Unknowns::guess(&plan).c;
        // Far enough that limits of angle and speed are broken.
        let wild = noise(3, c.len());
        c.iter_mut().zip(&wild).for_each(|(c, w)| *c += 1.5 * w);
        let rho = [2.0; FAMILIES];
        let families: [(&str, Rows); 3] =
            [("limits", limits::rows), ("ankle_lock", ankle_lock::rows), ("smoothness", smoothness::rows)];
        for (name, rows) in families {
            let sum = |c: &[f64], system: Option<(&mut Banded, &mut Vec<f64>)>| {
                let mut multipliers = Vec::new();
                let (worst, cursor, merit) = (None, 0, 0.0);
                let mut sink = CoefficientSink {
                    system,
                    worst,
                    update: false,
                    rho: &rho,
                    multipliers: &mut multipliers,
                    cursor,
                    merit,
                };
                rows(&plan, c, &mut sink);
                sink.merit
            };
            let mut gradient = vec![0.0; c.len()];
            sum(&c, Some((&mut Banded::zeros(c.len(), 3 * nv), &mut gradient)));
            let mut moved = 0;
            for i in (0..c.len()).step_by(7) {
                let e = 1e-6;
                let mut sides = [e, -e].map(|step| {
                    let mut moved = c.clone();
                    moved[i] += step;
                    sum(&moved, None)
                });
                sides.iter_mut().for_each(|side| *side /= 2.0 * e);
                let (difference, own) = (sides[0] - sides[1], gradient[i]);
                assert!((difference - own).abs() < 1e-3 * (1.0 + own.abs()), "{name} {i}: {difference} {own}");
                moved += usize::from(difference != 0.0);
            }
            assert!(moved > 0, "{name}: no row was tried");
        }
    }
}
