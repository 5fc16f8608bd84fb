//! Where every cost and constraint hands in its rows: a value and, where wanted, its gradient.
//!
//! A row belongs to one node and depends on that node's coordinates q, their speed v and acceleration a, and the
//! contact forces f there. A cost row adds w r^2 / 2; an equality c = 0 and an inequality g <= 0 enter the augmented
//! Lagrangian (J. Nocedal, S. Wright, Numerical Optimization, 2006, section 17.4) as rho/2 (c + y/rho)^2 and
//! rho/2 max(0, g + y/rho)^2 with the multiplier y: least squares all of them, which is what the Gauss-Newton step of
//! [`super::solver`] wants. Rows must be handed in in the same order at every evaluation of a node.

use super::local::Local;

/// What a row is about; the answer tells the worst violation by these.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Family {
    BaseDynamics,
    Friction,
    Contact,
    ContactSpeed,
    Ground,
    SelfCollision,
    Torque,
    JointLimit,
    JointSpeed,
    AnkleLock,
    ApproachAngle,
}

pub(crate) const FAMILIES: usize = 11;

impl Family {
    pub(crate) const ALL: [Self; FAMILIES] = [
        Self::BaseDynamics,
        Self::Friction,
        Self::Contact,
        Self::ContactSpeed,
        Self::Ground,
        Self::SelfCollision,
        Self::Torque,
        Self::JointLimit,
        Self::JointSpeed,
        Self::AnkleLock,
        Self::ApproachAngle,
    ];

    /// Its name in answers.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::BaseDynamics => "base_dynamics",
            Self::Friction => "friction",
            Self::Contact => "contact",
            Self::ContactSpeed => "contact_speed",
            Self::Ground => "penetration",
            Self::SelfCollision => "self_collision",
            Self::Torque => "torque",
            Self::JointLimit => "joint_limit",
            Self::JointSpeed => "joint_speed",
            Self::AnkleLock => "ankle_lock",
            Self::ApproachAngle => "approach_angle",
        }
    }
}

/// A row's gradient, zero except where a closure wrote.
#[derive(Debug, Clone, Default)]
pub(crate) struct Row {
    pub q: Vec<f64>,
    pub v: Vec<f64>,
    pub a: Vec<f64>,
    pub f: Vec<f64>,
}

impl Row {
    pub(crate) fn new(nv: usize, forces: usize) -> Self {
        Self { q: vec![0.0; nv], v: vec![0.0; nv], a: vec![0.0; nv], f: vec![0.0; forces] }
    }

    /// Zero, for `forces` force components.
    pub(crate) fn clear(&mut self, forces: usize) {
        self.q.fill(0.0);
        self.v.fill(0.0);
        self.a.fill(0.0);
        self.f.clear();
        self.f.resize(forces, 0.0);
    }
}

/// The worst violation of each family and the node where it is.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Worst {
    pub values: [f64; FAMILIES],
    pub nodes: [usize; FAMILIES],
}

impl Worst {
    pub(crate) fn note(&mut self, family: Family, value: f64, node: usize) {
        // Written so that a NaN counts as the worst.
        if !(value <= self.values[family as usize]) {
            (self.values[family as usize], self.nodes[family as usize]) = (value, node);
        }
    }

    /// The worst of all.
    pub(crate) fn most(&self) -> (Family, f64) {
        Family::ALL
            .into_iter()
            .map(|f| (f, self.values[f as usize]))
            .fold((Family::ALL[0], -1.0), |a, b| if b.1 > a.1 || b.1.is_nan() { b } else { a })
    }
}

/// What is done with the rows.
pub(crate) enum Pass<'a> {
    /// Sums the augmented Lagrangian.
    Value,
    /// And its gradient and Gauss-Newton matrix.
    Derivatives(&'a mut Local),
    /// Moves the multipliers, and notes violations.
    Update(&'a mut Worst),
    /// Notes violations only.
    Report(&'a mut Worst),
    /// Keeps value and gradient of every row, for tests.
    #[cfg(test)]
    Collect(&'a mut Vec<(String, f64, Row)>),
}

/// Takes the rows of one node.
pub(crate) struct Sink<'a> {
    pub pass: Pass<'a>,
    pub node: usize,
    pub rho: &'a [f64; FAMILIES],
    pub multipliers: &'a mut Vec<f64>,
    pub cursor: usize,
    /// Of the augmented Lagrangian.
    pub merit: f64,
    /// Of the costs alone.
    pub cost: f64,
}

impl<'a> Sink<'a> {
    pub(crate) fn new(pass: Pass<'a>, node: usize, rho: &'a [f64; FAMILIES], multipliers: &'a mut Vec<f64>) -> Self {
        Self { pass, node, rho, multipliers, cursor: 0, merit: 0.0, cost: 0.0 }
    }

    /// A cost `weight` `value`^2 / 2.
    pub(crate) fn cost(&mut self, weight: f64, value: f64, fill: impl FnOnce(&mut Row)) {
        self.cost += 0.5 * weight * value * value;
        self.square(weight, value, fill, "cost");
    }

    /// A cost that may be negative: its gradient counts, its curvature does not.
    pub(crate) fn gradient_only(&mut self, value: f64, fill: impl FnOnce(&mut Row)) {
        self.cost += value;
        self.merit += value;
        match &mut self.pass {
            Pass::Derivatives(local) => local.gradient_only(fill),
            #[cfg(test)]
            Pass::Collect(rows) => collect(rows, "gradient_only", value, fill),
            _ => {}
        }
    }

    /// An equality: `value` = 0.
    pub(crate) fn equal(&mut self, family: Family, value: f64, fill: impl FnOnce(&mut Row)) {
        let rho = self.rho[family as usize];
        let y = self.multiplier();
        match &mut self.pass {
            Pass::Update(worst) => {
                worst.note(family, value.abs(), self.node);
                self.multipliers[self.cursor - 1] = y + rho * value;
            }
            Pass::Report(worst) => worst.note(family, value.abs(), self.node),
            _ => self.square(rho, value + y / rho, fill, family.name()),
        }
    }

    /// An inequality: `value` <= 0.
    pub(crate) fn at_most(&mut self, family: Family, value: f64, fill: impl FnOnce(&mut Row)) {
        let rho = self.rho[family as usize];
        let y = self.multiplier();
        match &mut self.pass {
            Pass::Update(worst) => {
                worst.note(family, value, self.node);
                self.multipliers[self.cursor - 1] = (y + rho * value).max(0.0);
            }
            Pass::Report(worst) => worst.note(family, value, self.node),
            #[cfg(test)]
            Pass::Collect(rows) => collect(rows, family.name(), value, fill),
            _ => {
                let residual = value + y / rho;
                // Written so that a NaN is not taken for a satisfied row.
                if !(residual <= 0.0) {
                    self.square(rho, residual, fill, family.name());
                }
            }
        }
    }

    fn multiplier(&mut self) -> f64 {
        if self.cursor == self.multipliers.len() {
            self.multipliers.push(0.0);
        }
        self.cursor += 1;
        self.multipliers[self.cursor - 1]
    }

    fn square(&mut self, weight: f64, residual: f64, fill: impl FnOnce(&mut Row), _name: &str) {
        self.merit += 0.5 * weight * residual * residual;
        match &mut self.pass {
            Pass::Derivatives(local) => local.add(weight, residual, fill),
            #[cfg(test)]
            Pass::Collect(rows) => collect(rows, _name, residual, fill),
            _ => {}
        }
    }
}

#[cfg(test)]
fn collect(rows: &mut Vec<(String, f64, Row)>, name: &str, value: f64, fill: impl FnOnce(&mut Row)) {
    let (nv, forces) = rows.first().map_or((0, 0), |(_, _, row)| (row.q.len(), row.f.len()));
    let mut row = Row::new(nv, forces);
    fill(&mut row);
    rows.push((name.to_owned(), value, row));
}
