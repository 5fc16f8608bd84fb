//! One node's state with all that its rows need: positions, forces, generalised forces and their derivatives.

use nalgebra::Vector3;

use super::inverse_dynamics::Dynamics;
use super::plan::{Node, Plan};
use super::terms::{Row, Sink};
use super::{approach, base_dynamics, collision, contact, friction, ground, regularisation, strike, torque, tracking};

/// Scratch space for one node at a time.
#[derive(Debug)]
pub(crate) struct Scratch {
    pub dynamics: Dynamics,
    /// Generalised forces with the contact forces taken off, (33): N and N m.
    pub generalised: Vec<f64>,
    /// For each pushing point its place and its Jacobian's columns along [`super::tree::Tree::chain`].
    pub contacts: Vec<(Vector3<f64>, Vec<Vector3<f64>>)>,
}

impl Scratch {
    pub(crate) fn new(plan: &Plan) -> Self {
        Self { dynamics: Dynamics::new(&plan.tree), generalised: vec![0.0; plan.tree.nv], contacts: Vec::new() }
    }
}

/// A node in one state.
pub(crate) struct View<'a> {
    pub plan: &'a Plan<'a>,
    pub k: usize,
    pub node: &'a Node,
    pub q: &'a [f64],
    pub v: &'a [f64],
    /// Contact forces as shares of the weight, three for each of [`Node::pushing`].
    pub f: &'a [f64],
    pub a: &'a [f64],
    pub s: &'a Scratch,
}

/// Hands all rows of a node to `sink`.
pub(crate) fn rows(
    plan: &Plan,
    k: usize,
    [q, v, a, f]: [&[f64]; 4],
    derivatives: bool,
    scratch: &mut Scratch,
    sink: &mut Sink,
) {
    let node = &plan.nodes[k];
    scratch.dynamics.compute(&plan.tree, q, v, a, derivatives);
    push(plan, node, f, derivatives, scratch);
    let view = View { plan, k, node, q, v, f, a, s: scratch };
    tracking::rows(&view, sink);
    strike::rows(&view, sink);
    regularisation::rows(&view, sink);
    base_dynamics::rows(&view, sink);
    torque::rows(&view, sink);
    friction::rows(&view, sink);
    contact::rows(&view, sink);
    ground::rows(&view, sink);
    collision::rows(&view, sink);
    approach::rows(&view, sink);
}

/// Takes the contact forces off the generalised forces, and what they do off the derivative by position.
fn push(plan: &Plan, node: &Node, f: &[f64], derivatives: bool, s: &mut Scratch) {
    let tree = &plan.tree;
    s.generalised.copy_from_slice(&s.dynamics.force);
    s.contacts.clear();
    for (&point, share) in node.pushing.iter().zip(f.chunks(3)) {
        let contact = &plan.robot.contacts[point];
        let at = s.dynamics.pose.point(&contact.at);
        let force = Vector3::new(share[0], share[1], share[2]) * plan.weight;
        let chain = tree.chain(contact.at.link);
        let columns: Vec<Vector3<f64>> = chain.iter().map(|&i| tree.column(&s.dynamics.pose, i, &at)).collect();
        for (&i, column) in chain.iter().zip(&columns) {
            s.generalised[i] -= column.dot(&force);
            if derivatives {
                for &j in chain {
                    let changed = tree.column_derivative(&s.dynamics.pose, i, j, &at);
                    s.dynamics.by_position[i * tree.nv + j] -= changed.dot(&force);
                }
            }
        }
        s.contacts.push((at, columns));
    }
}

impl View<'_> {
    /// Gradient of generalised force `i` times `scale`.
    pub(crate) fn generalised_row(&self, i: usize, scale: f64, row: &mut Row) {
        let nv = self.plan.tree.nv;
        let d = &self.s.dynamics;
        let span = i * nv..(i + 1) * nv;
        let add = |to: &mut [f64], from: &[f64]| to.iter_mut().zip(from).for_each(|(t, g)| *t += scale * g);
        add(&mut row.q, &d.by_position[span.clone()]);
        add(&mut row.v, &d.by_speed[span.clone()]);
        add(&mut row.a, &d.by_acceleration[span]);
        for ((&point, (_, columns)), f) in self.node.pushing.iter().zip(&self.s.contacts).zip(row.f.chunks_mut(3)) {
            let chain = self.plan.tree.chain(self.plan.robot.contacts[point].at.link);
            if let Ok(place) = chain.binary_search(&i) {
                for (g, c) in f.iter_mut().zip(columns[place].iter()) {
                    *g -= scale * self.plan.weight * c;
                }
            }
        }
    }

    /// Adds the gradient of the world place of a link's point along `direction`, times `scale`.
    pub(crate) fn point_row(&self, link: usize, at: &Vector3<f64>, direction: &Vector3<f64>, row: &mut [f64]) {
        let tree = &self.plan.tree;
        for &i in tree.chain(link) {
            row[i] += tree.column(&self.s.dynamics.pose, i, at).dot(direction);
        }
    }

    /// Velocity of a link's point, m/s.
    pub(crate) fn velocity(&self, link: usize, at: &Vector3<f64>) -> Vector3<f64> {
        let tree = &self.plan.tree;
        tree.chain(link).iter().map(|&i| tree.column(&self.s.dynamics.pose, i, at) * self.v[i]).sum()
    }

    /// Gradient of the velocity of a link's point along `direction`.
    pub(crate) fn velocity_row(&self, link: usize, at: &Vector3<f64>, direction: &Vector3<f64>, row: &mut Row) {
        let tree = &self.plan.tree;
        let pose = &self.s.dynamics.pose;
        let chain = tree.chain(link);
        for &i in chain {
            row.v[i] += tree.column(pose, i, at).dot(direction);
            for &j in chain {
                row.q[j] += tree.column_derivative(pose, i, j, at).dot(direction) * self.v[i];
            }
        }
    }
}
