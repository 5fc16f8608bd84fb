//! The unknowns: coefficients of a uniform cubic B-spline for every coordinate, and the contact forces at the nodes.
//!
//! Node k, at k times the step, lies where the coefficients k, k + 1 and k + 2 weigh 1/6, 4/6, 1/6; between the nodes
//! the motion is a cubic with continuous acceleration, which is also what [`instep_motion::reference::Reference`]
//! reads out of the knots' positions and speeds. The integration rows (21)-(24) are exact by construction. Forces are
//! linear between the nodes.

use super::local::Stencil;
use super::plan::Plan;

/// A value of the unknowns.
#[derive(Debug, Clone)]
pub(crate) struct Unknowns {
    /// Blocks of nv coefficients, two more than nodes.
    pub c: Vec<f64>,
    /// For each node three shares of the weight for each pushing point.
    pub f: Vec<Vec<f64>>,
}

impl Unknowns {
    /// The spline through the nodes' postures, with the weight spread evenly over the points that push.
    pub(crate) fn guess(plan: &Plan) -> Self {
        let nv = plan.tree.nv;
        let count = plan.nodes.len();
        let mut c = vec![0.0; (count + 2) * nv];
        for i in 0..nv {
            let values: Vec<f64> = plan.nodes.iter().map(|node| node.posture[i]).collect();
            for (b, value) in through(&values).into_iter().enumerate() {
                c[b * nv + i] = value;
            }
        }
        let f = plan
            .nodes
            .iter()
            .map(|node| {
                let share = 1.0 / node.pushing.len().max(1) as f64;
                node.pushing.iter().flat_map(|_| [0.0, 0.0, share]).collect()
            })
            .collect();
        Self { c, f }
    }

    /// The same motion and forces with the nodes of another plan of the same clip: `old` are these unknowns' plan.
    pub(crate) fn resampled(&self, old: &Plan, plan: &Plan) -> Self {
        let nv = plan.tree.nv;
        let scale = plan.settings.time_scale;
        // In steps of the old plan.
        let at = |k: usize| {
            let t = k as f64 * plan.step + (plan.clip_start - old.clip_start) * scale;
            (t / old.step).clamp(0.0, (old.nodes.len() - 1) as f64)
        };
        let mut x = Self::guess(plan);
        for i in 0..nv {
            let values: Vec<f64> = (0..plan.nodes.len()).map(|k| self.position(at(k), i, nv)).collect();
            for (b, value) in through(&values).into_iter().enumerate() {
                x.c[b * nv + i] = value;
            }
        }
        for (k, (node, forces)) in plan.nodes.iter().zip(&mut x.f).enumerate() {
            let near = at(k).round() as usize;
            for (&point, force) in node.pushing.iter().zip(forces.chunks_mut(3)) {
                let place = old.nodes[near].pushing.iter().position(|&p| p == point);
                match place {
                    Some(place) => force.copy_from_slice(&self.f[near][3 * place..3 * place + 3]),
                    None => force.copy_from_slice(&[0.0, 0.0, 1e-2]),
                }
            }
        }
        x
    }

    /// Coordinate `i` of the spline at `u` steps from the first node.
    fn position(&self, u: f64, i: usize, nv: usize) -> f64 {
        let last = self.c.len() / nv - 3;
        let k = (u.floor() as usize).min(last.saturating_sub(1));
        let s = u - k as f64;
        let weights = [
            (1.0 - s).powi(3),
            3.0 * s.powi(3) - 6.0 * s * s + 4.0,
            -3.0 * s.powi(3) + 3.0 * s * s + 3.0 * s + 1.0,
            s.powi(3),
        ];
        weights.iter().enumerate().map(|(b, w)| w / 6.0 * self.c[(k + b) * nv + i]).sum()
    }

    /// Position, speed and acceleration at a node.
    pub(crate) fn state(&self, k: usize, nv: usize, stencil: &Stencil, out: &mut [Vec<f64>; 3]) {
        for (values, weights) in out.iter_mut().zip([stencil.q, stencil.v, stencil.a]) {
            let (first, rest) = self.c[k * nv..(k + 3) * nv].split_at(nv);
            let (second, third) = rest.split_at(nv);
            values.clear();
            let three = first.iter().zip(second).zip(third);
            values.extend(three.map(|((a, b), c)| weights[0] * a + weights[1] * b + weights[2] * c));
        }
    }
}

/// Coefficients, two more than values, of the cubic B-spline through `values` with no acceleration at its ends.
fn through(values: &[f64]) -> Vec<f64> {
    let n = values.len();
    // Without acceleration the first coefficients lie on a line, so the end value is its own coefficient; the rest is
    // the system (1, 4, 1) / 6, by Thomas's algorithm.
    let mut inner = values.to_vec();
    if n > 2 {
        let mut ratio = vec![0.0; n];
        for i in 1..n - 1 {
            let mut right = 6.0 * values[i];
            if i == 1 {
                right -= values[0];
            }
            if i == n - 2 {
                right -= values[n - 1];
            }
            let before = if i > 1 { ratio[i - 1] } else { 0.0 };
            let pivot = 4.0 - before;
            ratio[i] = 1.0 / pivot;
            inner[i] = (right - if i > 1 { inner[i - 1] } else { 0.0 }) / pivot;
        }
        for i in (1..n - 2).rev() {
            inner[i] -= ratio[i] * inner[i + 1];
        }
    }
    let mut c = Vec::with_capacity(n + 2);
    c.push(2.0 * inner[0] - inner[1]);
    c.extend_from_slice(&inner);
    c.push(2.0 * inner[n - 1] - inner[n - 2]);
    c
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn between_the_nodes_the_spline_is_cubic() {
        let values: Vec<f64> = (0..9).map(|i| (f64::from(i) * 0.3).sin()).collect();
        let x = Unknowns { c: through(&values), f: Vec::new() };
        for (k, value) in values.iter().enumerate() {
            assert!((x.position(k as f64, 0, 1) - value).abs() < 1e-12, "node {k}");
        }
        // Away from the ends, where the spline has no acceleration and the sine has.
        for u in [3.5, 4.25, 5.0 - 1e-9] {
            assert!((x.position(u, 0, 1) - (u * 0.3).sin()).abs() < 1e-3, "at {u}");
        }
    }

    #[test]
    fn the_spline_goes_through_its_values() {
        let values: Vec<f64> = (0..9).map(|i| f64::from(i * i % 7)).collect();
        let c = through(&values);
        for (k, value) in values.iter().enumerate() {
            let at = (c[k] + 4.0 * c[k + 1] + c[k + 2]) / 6.0;
            assert!((at - value).abs() < 1e-12, "node {k}: {at} instead of {value}");
        }
    }
}
