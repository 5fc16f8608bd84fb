//! A small dense quadratic program, solved exactly by a dual active-set method:
//!
//! ```text
//! minimise 1/2 x^T H x + g^T x   subject to   lower <= A x <= upper,   A x = b in the first rows
//! ```
//!
//! Source: D. Goldfarb, A. Idnani, A numerically stable dual method for solving strictly convex quadratic programs,
//! Mathematical Programming 27 (1983), section 4; L, J, R, z, r, d, u as there. Rows enter by a Householder reflection of J
//! instead of Givens rotations. It starts from the unconstrained minimum and takes in one violated row after the other, so it
//! needs no feasible start; rows that were active at the last solution are looked at first.
//!
//! H must be positive definite. Nothing is allocated once the sizes have been seen. Not for large or sparse problems.

/// How far a row may be violated, relative to its bound (plus 1): what rounding leaves.
const VIOLATION: f64 = 1e-9;
/// A row whose part outside the active rows is smaller than this share of it depends on them.
const DEPENDENT: f64 = 1e-10;

/// What came of a problem.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum QpStatus {
    /// Solved.
    Optimal,
    /// No x keeps all rows.
    Infeasible,
    /// H is not positive definite, or a number is not finite.
    NotConvex,
    /// More changes of the active rows than allowed.
    IterationLimit,
}

/// The problem; filled by the caller, tick after tick.
#[derive(Debug, Clone, Default)]
pub struct Qp {
    n: usize,
    equalities: usize,
    /// H, n x n, row-major; only the lower triangle is read.
    pub hessian: Vec<f64>,
    /// g, n.
    pub gradient: Vec<f64>,
    rows: Vec<f64>,
    lower: Vec<f64>,
    upper: Vec<f64>,
}

impl Qp {
    /// An empty problem with room for `n` unknowns and `m` rows.
    #[must_use]
    pub fn with_capacity(n: usize, m: usize) -> Self {
        Self {
            n: 0,
            equalities: 0,
            hessian: Vec::with_capacity(n * n),
            gradient: Vec::with_capacity(n),
            rows: Vec::with_capacity(n * m),
            lower: Vec::with_capacity(m),
            upper: Vec::with_capacity(m),
        }
    }

    /// Starts again with `n` unknowns, zero cost and no rows.
    pub fn reset(&mut self, n: usize) {
        self.n = n;
        self.equalities = 0;
        self.hessian.clear();
        self.hessian.resize(n * n, 0.0);
        self.gradient.clear();
        self.gradient.resize(n, 0.0);
        self.rows.clear();
        self.lower.clear();
        self.upper.clear();
    }

    /// Number of unknowns.
    #[must_use]
    pub fn len(&self) -> usize {
        self.n
    }

    /// Whether there is nothing to solve.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.n == 0
    }

    /// Number of rows.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.lower.len()
    }

    /// Row `i` and its bounds.
    #[must_use]
    pub fn row(&self, i: usize) -> (&[f64], [f64; 2]) {
        (&self.rows[i * self.n..(i + 1) * self.n], [self.lower[i], self.upper[i]])
    }

    /// Adds a row with `lower <= row x <= upper` and gives its entries, all zero, to be filled. Equalities
    /// (`lower == upper`) come first.
    pub fn add_row(&mut self, lower: f64, upper: f64) -> &mut [f64] {
        if lower == upper && self.equalities == self.lower.len() {
            self.equalities += 1;
        }
        self.lower.push(lower);
        self.upper.push(upper);
        let start = self.rows.len();
        self.rows.resize(start + self.n, 0.0);
        &mut self.rows[start..]
    }

    /// Drops all rows from `row` on.
    pub fn truncate(&mut self, row: usize) {
        self.rows.truncate(row * self.n);
        self.lower.truncate(row);
        self.upper.truncate(row);
        self.equalities = self.equalities.min(row);
    }

    /// Adds `weight * (row x[start..] - target)^2 / 2` to the cost.
    pub fn add_cost(&mut self, weight: f64, start: usize, row: &[f64], target: f64) {
        for (i, &a) in row.iter().enumerate() {
            if a == 0.0 {
                continue;
            }
            let scaled = weight * a;
            let at = (start + i) * self.n + start;
            for (h, b) in self.hessian[at..=at + i].iter_mut().zip(row) {
                *h += scaled * b;
            }
            self.gradient[start + i] -= scaled * target;
        }
    }

    /// Adds `weight * (x[i] - target)^2 / 2` to the cost.
    pub fn add_cost_at(&mut self, weight: f64, i: usize, target: f64) {
        self.hessian[i * self.n + i] += weight;
        self.gradient[i] -= weight * target;
    }
}

/// A row at one of its bounds: `sign` +1 at the lower, -1 at the upper.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Side {
    row: usize,
    sign: f64,
}

/// The solver with its solution; reused from tick to tick.
#[derive(Debug, Clone, Default)]
pub struct QpSolver {
    /// The solution, n; of the last problem that was [`QpStatus::Optimal`] or ended on the way.
    pub x: Vec<f64>,
    /// Changes of the active rows in the last solve.
    pub iterations: usize,
    /// Transpose of J = L^-T Q, n x n, row-major.
    j: Vec<f64>,
    /// R, upper triangular, column k at k n.
    r: Vec<f64>,
    /// J^T times the row at hand.
    d: Vec<f64>,
    /// Primal direction.
    z: Vec<f64>,
    /// Dual direction.
    dual: Vec<f64>,
    /// Multipliers of the active rows, and one for the row that enters.
    u: Vec<f64>,
    active: Vec<Side>,
    last: Vec<Side>,
    work: Vec<f64>,
    is_active: Vec<bool>,
}

impl QpSolver {
    /// A solver with room for `n` unknowns and `m` rows.
    #[must_use]
    pub fn with_capacity(n: usize, m: usize) -> Self {
        let mut solver = Self::default();
        solver.resize(n, m);
        let (active, last) = (Vec::with_capacity(n + 1), Vec::with_capacity(n + 1));
        Self { active, last, ..solver }
    }

    fn resize(&mut self, n: usize, m: usize) {
        for (vector, length) in [
            (&mut self.x, n),
            (&mut self.j, n * n),
            (&mut self.r, n * n),
            (&mut self.d, n),
            (&mut self.z, n),
            (&mut self.dual, n),
            (&mut self.work, n),
            (&mut self.u, n + 1),
        ] {
            vector.clear();
            vector.resize(length, 0.0);
        }
        self.is_active.clear();
        self.is_active.resize(m, false);
    }

    /// Multiplier of each active row, as (row, multiplier): positive at a lower bound, negative at an upper one; equalities
    /// have either sign. At the solution `H x + g = sum multiplier * row`.
    pub fn multipliers(&self) -> impl Iterator<Item = (usize, f64)> {
        self.active.iter().zip(&self.u).map(|(side, u)| (side.row, side.sign * u))
    }

    /// Solves `qp`.
    pub fn solve(&mut self, qp: &Qp) -> QpStatus {
        let (n, m) = (qp.n, qp.rows());
        std::mem::swap(&mut self.last, &mut self.active);
        self.active.clear();
        self.resize(n, m);
        self.iterations = 0;
        if !self.factor(qp) {
            return QpStatus::NotConvex;
        }
        for row in 0..qp.equalities {
            let value = dot(qp.row(row).0, &self.x) - qp.lower[row];
            // An equality is entered from the side on which it is violated, so that its multiplier starts at zero.
            let side = Side { row, sign: if value > 0.0 { -1.0 } else { 1.0 } };
            self.project(qp, side);
            if !self.step_equality(side, -value.abs(), qp.lower[row]) {
                return QpStatus::Infeasible;
            }
        }
        let limit = 10 * (n + m);
        while let Some((side, slack)) = self.violated(qp) {
            match self.enter(qp, side, slack, limit) {
                QpStatus::Optimal => {}
                status => return status,
            }
        }
        if self.x.iter().all(|x| x.is_finite()) { QpStatus::Optimal } else { QpStatus::NotConvex }
    }

    /// H = L L^T; J = L^-T; x = -H^-1 g.
    fn factor(&mut self, qp: &Qp) -> bool {
        let n = qp.n;
        // L in the place of R, row by row.
        for i in 0..n {
            for k in 0..=i {
                let sum = qp.hessian[i * n + k] - dot(&self.r[i * n..i * n + k], &self.r[k * n..k * n + k]);
                if i == k {
                    if !(sum > 0.0 && sum.is_finite()) {
                        return false;
                    }
                    self.r[i * n + i] = sum.sqrt();
                } else {
                    self.r[i * n + k] = sum / self.r[k * n + k];
                }
            }
        }
        // Row i of L^-1 from the rows before it: L^-1[i] = (e_i - sum_k L[i][k] L^-1[k]) / L[i][i].
        for i in 0..n {
            let (done, rest) = self.j.split_at_mut(i * n);
            let row = &mut rest[..n];
            row[i] = 1.0;
            for k in 0..i {
                let factor = self.r[i * n + k];
                for (value, known) in row[..=k].iter_mut().zip(&done[k * n..=k * n + k]) {
                    *value -= factor * known;
                }
            }
            let scale = 1.0 / self.r[i * n + i];
            row[..=i].iter_mut().for_each(|value| *value *= scale);
        }
        for i in 0..n {
            let row = &self.j[i * n..=i * n + i];
            let share = dot(row, &qp.gradient[..=i]);
            for (x, value) in self.x.iter_mut().zip(row) {
                *x -= share * value;
            }
        }
        true
    }

    /// d = J^T n, z = J_2 d_2 and r = R^-1 d_1 for the row at `side`.
    fn project(&mut self, qp: &Qp, side: Side) {
        let (n, q) = (qp.n, self.active.len());
        let row = qp.row(side.row).0;
        for (d, j) in self.d.iter_mut().zip(self.j.chunks_exact(n)) {
            *d = side.sign * dot(j, row);
        }
        self.z.fill(0.0);
        for (d, j) in self.d.iter().zip(self.j.chunks_exact(n)).skip(q) {
            for (z, j) in self.z.iter_mut().zip(j) {
                *z += d * j;
            }
        }
        self.dual[..q].copy_from_slice(&self.d[..q]);
        for k in (0..q).rev() {
            let value = self.dual[k] / self.r[k * n + k];
            self.dual[k] = value;
            for (rest, r) in self.dual[..k].iter_mut().zip(&self.r[k * n..k * n + k]) {
                *rest -= value * r;
            }
        }
    }

    /// z^T n, zero when the row depends on the active ones.
    fn curvature(&self) -> f64 {
        let q = self.active.len();
        let outside = dot(&self.d[q..], &self.d[q..]);
        let whole = outside + dot(&self.d[..q], &self.d[..q]);
        if outside <= DEPENDENT * DEPENDENT * whole { 0.0 } else { outside }
    }

    /// A full step onto an equality whose slack is `slack`; false when no x keeps it together with those before.
    fn step_equality(&mut self, side: Side, slack: f64, bound: f64) -> bool {
        let curvature = self.curvature();
        if curvature == 0.0 {
            // It follows from the others, or contradicts them.
            return slack.abs() <= 1e-6 * (1.0 + bound.abs());
        }
        let step = -slack / curvature;
        for (x, z) in self.x.iter_mut().zip(&self.z) {
            *x += step * z;
        }
        for (u, dual) in self.u.iter_mut().zip(&self.dual[..self.active.len()]) {
            *u -= step * dual;
        }
        self.add(side, step);
        true
    }

    /// The violated row to take in next, with its slack (negative): one that was active at the last solution, else that
    /// which is violated most.
    fn violated(&self, qp: &Qp) -> Option<(Side, f64)> {
        let slack = |side: Side| {
            let (row, [lower, upper]) = qp.row(side.row);
            let bound = if side.sign > 0.0 { lower } else { upper };
            let slack = side.sign * (dot(row, &self.x) - bound);
            (slack < -VIOLATION * (1.0 + bound.abs())).then_some(slack)
        };
        for &side in &self.last {
            if side.row >= qp.equalities
                && side.row < qp.rows()
                && !self.is_active[side.row]
                && let Some(slack) = slack(side)
            {
                return Some((side, slack));
            }
        }
        let mut worst: Option<(Side, f64)> = None;
        for i in (qp.equalities..qp.rows()).filter(|&i| !self.is_active[i]) {
            let (row, [lower, upper]) = qp.row(i);
            let value = dot(row, &self.x);
            let (sign, bound, slack) =
                if value - lower < upper - value { (1.0, lower, value - lower) } else { (-1.0, upper, upper - value) };
            if slack < -VIOLATION * (1.0 + bound.abs()) && worst.is_none_or(|(_, most)| slack < most) {
                worst = Some((Side { row: i, sign }, slack));
            }
        }
        worst
    }

    /// Takes the row at `side` in, and drops those whose multiplier would change its sign (step 2 of the method).
    fn enter(&mut self, qp: &Qp, side: Side, mut slack: f64, limit: usize) -> QpStatus {
        let mut multiplier = 0.0;
        loop {
            self.iterations += 1;
            if self.iterations > limit {
                return QpStatus::IterationLimit;
            }
            self.project(qp, side);
            let curvature = self.curvature();
            let full = if curvature > 0.0 { -slack / curvature } else { f64::INFINITY };
            let mut partial = f64::INFINITY;
            let mut leaving = None;
            for k in qp.equalities_active(&self.active)..self.active.len() {
                if self.dual[k] > 0.0 {
                    let step = self.u[k] / self.dual[k];
                    if step < partial {
                        (partial, leaving) = (step, Some(k));
                    }
                }
            }
            let step = full.min(partial);
            if step == f64::INFINITY {
                return QpStatus::Infeasible;
            }
            for (u, dual) in self.u.iter_mut().zip(&self.dual[..self.active.len()]) {
                *u -= step * dual;
            }
            multiplier += step;
            if curvature > 0.0 {
                for (x, z) in self.x.iter_mut().zip(&self.z) {
                    *x += step * z;
                }
                slack += step * curvature;
            }
            if full <= partial {
                self.add(side, multiplier);
                return QpStatus::Optimal;
            }
            if let Some(k) = leaving {
                self.drop(k, qp.n);
            }
        }
    }

    /// Adds the row of the last [`Self::project`]: a Householder reflection turns d_2 into its first axis.
    fn add(&mut self, side: Side, multiplier: f64) {
        let (n, q) = (self.x.len(), self.active.len());
        let length = dot(&self.d[q..], &self.d[q..]).sqrt();
        let head = self.d[q];
        let image = if head > 0.0 { -length } else { length };
        // v = d_2 - image e_1; I - 2 v v^T / v^T v.
        self.d[q] = head - image;
        let scale = 2.0 / dot(&self.d[q..], &self.d[q..]);
        if scale.is_finite() {
            self.work.fill(0.0);
            for (v, row) in self.d[q..].iter().zip(self.j[q * n..].chunks_exact(n)) {
                for (sum, j) in self.work.iter_mut().zip(row) {
                    *sum += v * j;
                }
            }
            for (v, row) in self.d[q..].iter().zip(self.j[q * n..].chunks_exact_mut(n)) {
                let factor = scale * v;
                for (j, sum) in row.iter_mut().zip(&self.work) {
                    *j -= factor * sum;
                }
            }
        }
        self.r[q * n..q * n + q].copy_from_slice(&self.d[..q]);
        self.r[q * n + q] = image;
        self.u[q] = multiplier;
        self.active.push(side);
        self.is_active[side.row] = true;
    }

    /// Drops active row `k`: Givens rotations make R triangular again.
    fn drop(&mut self, k: usize, n: usize) {
        let side = self.active.remove(k);
        self.is_active[side.row] = false;
        let q = self.active.len();
        self.u.copy_within(k + 1..=q, k);
        for column in k..q {
            self.r.copy_within((column + 1) * n..(column + 1) * n + column + 2, column * n);
        }
        for i in k..q {
            let (a, b) = (self.r[i * n + i], self.r[i * n + i + 1]);
            let length = a.hypot(b);
            let (c, s) = if length > 0.0 { (a / length, b / length) } else { (1.0, 0.0) };
            for column in i..q {
                let (a, b) = (self.r[column * n + i], self.r[column * n + i + 1]);
                self.r[column * n + i] = c * a + s * b;
                self.r[column * n + i + 1] = c * b - s * a;
            }
            let (upper, lower) = self.j.split_at_mut((i + 1) * n);
            for (a, b) in upper[i * n..].iter_mut().zip(&mut lower[..n]) {
                (*a, *b) = (c * *a + s * *b, c * *b - s * *a);
            }
        }
    }
}

impl Qp {
    /// How many of the active rows, which start with them, are equalities.
    fn equalities_active(&self, active: &[Side]) -> usize {
        active.iter().take_while(|side| side.row < self.equalities).count()
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    // Four sums side by side: what a processor can add at once.
    let mut sums = [0.0; 4];
    let (a4, b4) = (a.chunks_exact(4), b.chunks_exact(4));
    let rest: f64 = a4.remainder().iter().zip(b4.remainder()).map(|(a, b)| a * b).sum();
    for (a, b) in a4.zip(b4) {
        for k in 0..4 {
            sums[k] += a[k] * b[k];
        }
    }
    (sums[0] + sums[2]) + (sums[1] + sums[3]) + rest
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    /// A feasible problem: `point` keeps all rows; about half of them are tight there.
    fn problem(rng: &mut ChaCha8Rng, n: usize, equalities: usize, inequalities: usize) -> Qp {
        let mut draw = |spread: f64| rng.random_range(-spread..spread);
        let mut qp = Qp::with_capacity(n, equalities + inequalities);
        qp.reset(n);
        for _ in 0..n {
            let row: Vec<f64> = (0..n).map(|_| draw(1.0)).collect();
            qp.add_cost(1.0, 0, &row, draw(5.0));
        }
        for i in 0..n {
            qp.add_cost_at(1e-3, i, 0.0);
        }
        let point: Vec<f64> = (0..n).map(|_| draw(1.0)).collect();
        for i in 0..equalities + inequalities {
            let row: Vec<f64> = (0..n).map(|_| draw(1.0)).collect();
            let value: f64 = row.iter().zip(&point).map(|(a, b)| a * b).sum();
            let [lower, upper] = if i < equalities {
                [value; 2]
            } else {
                [value - draw(0.3).max(0.0), if i % 3 == 0 { f64::INFINITY } else { value + draw(0.5).max(1e-3) }]
            };
            qp.add_row(lower, upper).copy_from_slice(&row);
        }
        qp
    }

    /// The largest breach of the Karush-Kuhn-Tucker conditions: they hold at the minimum and nowhere else.
    fn breach(qp: &Qp, solver: &QpSolver) -> f64 {
        let n = qp.len();
        let mut gradient = qp.gradient.clone();
        for (i, entry) in gradient.iter_mut().enumerate() {
            *entry += (0..n).map(|k| qp.hessian[i.max(k) * n + i.min(k)] * solver.x[k]).sum::<f64>();
        }
        let mut worst: f64 = 0.0;
        for (row, multiplier) in solver.multipliers() {
            let (entries, [lower, upper]) = qp.row(row);
            let value: f64 = entries.iter().zip(&solver.x).map(|(a, b)| a * b).sum();
            let at = if multiplier >= 0.0 { lower } else { upper };
            if lower < upper {
                worst = worst.max((value - at).abs() * multiplier.abs().min(1.0));
            }
            for (g, a) in gradient.iter_mut().zip(entries) {
                *g -= multiplier * a;
            }
        }
        for i in 0..qp.rows() {
            let (entries, [lower, upper]) = qp.row(i);
            let value: f64 = entries.iter().zip(&solver.x).map(|(a, b)| a * b).sum();
            worst = worst.max(lower - value).max(value - upper);
        }
        gradient.iter().fold(worst, |worst, g| worst.max(g.abs()))
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(1500))]
        #[test]
        fn the_solution_keeps_the_kkt_conditions(seed in any::<u64>(), n in 1_usize..24, m in 0_usize..40) {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let equalities = rng.random_range(0..=n.min(6) / 2);
            let qp = problem(&mut rng, n, equalities, m);
            let mut solver = QpSolver::with_capacity(n, m + equalities);
            prop_assert_eq!(solver.solve(&qp), QpStatus::Optimal);
            prop_assert!(breach(&qp, &solver) < 1e-6, "breach {}", breach(&qp, &solver));
            // Again from what was active: the same solution.
            let first = solver.x.clone();
            prop_assert_eq!(solver.solve(&qp), QpStatus::Optimal);
            let apart = first.iter().zip(&solver.x).fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
            prop_assert!(apart < 1e-7, "apart {apart}");
        }
    }

    #[test]
    fn no_feasible_point_close_by_is_better() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let qp = problem(&mut rng, 8, 0, 20);
        let mut solver = QpSolver::with_capacity(8, 20);
        assert_eq!(solver.solve(&qp), QpStatus::Optimal);
        let cost = |x: &[f64]| -> f64 {
            let quadratic = |i: usize, k: usize| qp.hessian[i.max(k) * 8 + i.min(k)] * x[i] * x[k];
            (0..8).map(|i| qp.gradient[i] * x[i] + (0..8).map(|k| 0.5 * quadratic(i, k)).sum::<f64>()).sum()
        };
        let best = cost(&solver.x);
        for _ in 0..20_000 {
            let x: Vec<f64> = solver.x.iter().map(|x| x + 0.2 * (rng.random::<f64>() - 0.5)).collect();
            let keeps = (0..20).all(|i| {
                let (row, [lower, upper]) = qp.row(i);
                let value = dot(row, &x);
                lower <= value && value <= upper
            });
            assert!(!keeps || cost(&x) >= best - 1e-9);
        }
    }

    #[test]
    fn rows_that_contradict_each_other_are_infeasible() {
        let mut qp = Qp::with_capacity(2, 3);
        qp.reset(2);
        qp.add_cost_at(1.0, 0, 0.0);
        qp.add_cost_at(1.0, 1, 0.0);
        qp.add_row(1.0, f64::INFINITY)[0] = 1.0;
        qp.add_row(f64::NEG_INFINITY, 0.5)[0] = 1.0;
        let mut solver = QpSolver::with_capacity(2, 3);
        assert_eq!(solver.solve(&qp), QpStatus::Infeasible);
        qp.truncate(1);
        assert_eq!(solver.solve(&qp), QpStatus::Optimal);
        assert!((solver.x[0] - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_repeated_equality_is_taken_and_a_flat_cost_refused() {
        let mut qp = Qp::with_capacity(2, 3);
        qp.reset(2);
        qp.add_cost_at(1.0, 0, 3.0);
        let mut solver = QpSolver::with_capacity(2, 3);
        assert_eq!(solver.solve(&qp), QpStatus::NotConvex);
        qp.add_cost_at(1.0, 1, 0.0);
        for _ in 0..2 {
            qp.add_row(1.0, 1.0).fill(1.0);
        }
        assert_eq!(solver.solve(&qp), QpStatus::Optimal);
        assert!((solver.x[0] + solver.x[1] - 1.0).abs() < 1e-12);
        qp.add_row(2.0, 2.0).fill(1.0);
        assert_eq!(solver.solve(&qp), QpStatus::Infeasible);
    }
}
