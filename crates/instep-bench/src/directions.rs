//! How the direction of the ball depends on the one that was asked: paper 3's figures 4 and 5 as numbers. For each asked
//! direction the mean error (the systematic offset), its standard deviation and the worst; over all kicks the rank
//! correlation of what the engine forecast with what came.

use serde::Serialize;

use crate::cell::{CellResult, Kicked};

/// One asked direction.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Direction {
    /// As asked, deg: positive toward the middle line, as seen from the ball's side.
    pub asked_deg: f64,
    /// Requests.
    pub requests: usize,
    /// Hits.
    pub hits: usize,
    /// Mean error in the sense of the asked direction, deg.
    pub offset_deg: Option<f64>,
    /// Standard deviation of the error, deg.
    pub spread_deg: Option<f64>,
    /// Largest error, deg.
    pub worst_deg: Option<f64>,
    /// Mean way of the ball, m.
    pub rolled: Option<f64>,
    /// Mean of the forecast g.
    pub forecast: Option<f64>,
}

/// All directions of one engine, robot and scenario, over all seeds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Directions {
    /// Engine.
    pub engine: String,
    /// Robot.
    pub robot: String,
    /// Scenario.
    pub scenario: String,
    /// Each asked direction, least first; a whole degree each.
    pub directions: Vec<Direction>,
    /// Mean error over all hits, deg.
    pub offset_deg: Option<f64>,
    /// Standard deviation of the error over all hits, deg.
    pub spread_deg: Option<f64>,
    /// Spearman's rank correlation of -g, the engine's forecast of the direction (paper 3, equation 1: 1 is straight), with the
    /// absolute error; `None` for engines without a forecast and where either is the same for all.
    pub rank_correlation: Option<f64>,
}

/// For each engine, robot and scenario of `cells` with a kick, in the cells' order.
#[must_use]
pub fn directions(cells: &[CellResult]) -> Vec<Directions> {
    let mut groups: Vec<Vec<&CellResult>> = Vec::new();
    let same = |a: &CellResult, b: &CellResult| {
        (&a.key.engine, &a.key.robot, &a.key.scenario) == (&b.key.engine, &b.key.robot, &b.key.scenario)
    };
    for cell in cells {
        match groups.iter_mut().find(|group| same(group[0], cell)) {
            Some(group) => group.push(cell),
            None => groups.push(vec![cell]),
        }
    }
    groups.iter().map(|group| of(group)).collect()
}

fn of(cells: &[&CellResult]) -> Directions {
    let kicked: Vec<&Kicked> = cells.iter().flat_map(|cell| &cell.outcomes).filter_map(|o| o.as_ref().ok()).collect();
    let whole = |kick: &Kicked| kick.turn.to_degrees().round() as i64;
    let mut asked: Vec<i64> = kicked.iter().map(|kick| whole(kick)).collect();
    asked.sort_unstable();
    asked.dedup();
    let errors = |kicks: &[&Kicked]| -> Vec<f64> {
        kicks.iter().filter_map(|kick| kick.turn_error).map(f64::to_degrees).collect()
    };
    let one = |deg: i64| {
        let kicks: Vec<&Kicked> = kicked.iter().filter(|kick| whole(kick) == deg).copied().collect();
        let off = errors(&kicks);
        let rolled: Vec<f64> = kicks.iter().filter(|kick| kick.hit).map(|kick| kick.distance).collect();
        let forecasts: Vec<f64> = kicks.iter().filter_map(|kick| kick.forecast).collect();
        Direction {
            asked_deg: deg as f64,
            requests: kicks.len(),
            hits: kicks.iter().filter(|kick| kick.hit).count(),
            offset_deg: mean(&off),
            spread_deg: spread(&off),
            worst_deg: off.iter().map(|e| e.abs()).reduce(f64::max),
            rolled: mean(&rolled),
            forecast: mean(&forecasts),
        }
    };
    let off = errors(&kicked);
    let (forecast, came): (Vec<f64>, Vec<f64>) =
        kicked.iter().filter_map(|kick| Some((-kick.forecast?, kick.turn_error?.abs()))).unzip();
    let key = &cells[0].key;
    Directions {
        engine: key.engine.clone(),
        robot: key.robot.clone(),
        scenario: key.scenario.clone(),
        directions: asked.into_iter().map(one).collect(),
        offset_deg: mean(&off),
        spread_deg: spread(&off),
        rank_correlation: rank_correlation(&forecast, &came),
    }
}

fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

fn spread(values: &[f64]) -> Option<f64> {
    let middle = mean(values)?;
    let squares: f64 = values.iter().map(|v| (v - middle).powi(2)).sum();
    (values.len() > 1).then(|| (squares / (values.len() - 1) as f64).sqrt())
}

/// Spearman's rank correlation, ties sharing their mean rank; `None` for fewer than three pairs or where one side does
/// not vary.
#[must_use]
pub fn rank_correlation(a: &[f64], b: &[f64]) -> Option<f64> {
    if a.len() != b.len() || a.len() < 3 {
        return None;
    }
    let (a, b) = (ranks(a), ranks(b));
    let middle = 0.5 * (a.len() as f64 + 1.0);
    let product: f64 = a.iter().zip(&b).map(|(x, y)| (x - middle) * (y - middle)).sum();
    let square = |r: &[f64]| r.iter().map(|x| (x - middle).powi(2)).sum::<f64>();
    let scale = (square(&a) * square(&b)).sqrt();
    (scale > 0.0).then(|| product / scale)
}

fn ranks(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|i, j| values[*i].total_cmp(&values[*j]));
    let mut ranks = vec![0.0; values.len()];
    let mut start = 0;
    while start < order.len() {
        let same = order[start..].iter().take_while(|i| values[**i] == values[order[start]]).count();
        for i in &order[start..start + same] {
            ranks[*i] = start as f64 + 0.5 * (same as f64 + 1.0);
        }
        start += same;
    }
    ranks
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rank_correlation_is_spearmans() {
        assert_eq!(rank_correlation(&[1.0, 2.0, 3.0], &[10.0, 40.0, 90.0]), Some(1.0));
        assert_eq!(rank_correlation(&[1.0, 2.0, 3.0], &[9.0, 4.0, 1.0]), Some(-1.0));
        assert_eq!(rank_correlation(&[1.0, 1.0, 1.0], &[9.0, 4.0, 1.0]), None);
        // scipy.stats.spearmanr([1, 2, 2, 4, 5], [2, 1, 3, 3, 8]).
        let tied = rank_correlation(&[1.0, 2.0, 2.0, 4.0, 5.0], &[2.0, 1.0, 3.0, 3.0, 8.0]).unwrap();
        assert!((tied - 0.763_157_894_736_842).abs() < 1e-12, "{tied}");
    }
}
