//! The preview controller against SciPy: tools/riccati_scipy.py made these values (scipy 1.17.1).

use instep_kick::preview::regulator::{Regulator, cart_table};
use instep_kick::preview::riccati;
use instep_kick::preview::zmp::{Filter, Trust};
use nalgebra::{SMatrix, Vector3};

struct Case {
    /// Sample, height, Q, R, N.
    of: (f64, f64, f64, f64, usize),
    p: [f64; 9],
    k: [f64; 3],
    /// f_1, f_2, f_10, f_50, f_N.
    f: [f64; 5],
    /// Zero-moment point and centre of mass 0.3, 0.5, 0.6, 0.7, 1.0, 1.4 s after the start, for a step of 5 cm at 0.6 s.
    zmp: [f64; 6],
    com: [f64; 6],
}

#[rustfmt::skip]
const CASES: [Case; 3] = [
    Case {
        of: (0.012, 0.26, 1.0, 1e-6, 134),
        p: [30.400366311907188, 5.362691433517539, 0.07148837672587723, 5.362691433517539, 1.0469507133061675, 0.03042030053253058, 0.07148837672587723, 0.03042030053253058, 0.003545963554007043],
        k: [798.2568564508, 291.20761016518054, 31.960253423863023],
        f: [-202.4778185200978, -119.42991288274459, 57.91901696234041, 3.692901326733117, 0.00822933980724582],
        zmp: [-0.0008911687169218752, 0.0019778276822474, 0.034938215799241466, 0.04972452764141093, 0.050077277440895025, 0.04998727105658624],
        com: [0.0037749446362615006, 0.015656156338477834, 0.027109557635438108, 0.03714049002614107, 0.04804831677414711, 0.049831877996134075],
    },
    Case {
        of: (0.005, 0.814, 1.0, 1e-6, 320),
        p: [118.11402977190895, 34.58202499796636, 0.16301483279415308, 34.58202499796636, 10.372946522765385, 0.1202938491842192, 0.16301483279415308, 0.1202938491842192, 0.021812638852834406],
        k: [800.1214997967902, 472.52787324043294, 73.13910295645046],
        f: [-265.5922963321495, -166.81318625372168, 17.399094413207823, 12.302200429575445, 0.11285141687758904],
        zmp: [-0.004877709895923299, -0.002669994353490346, 0.0348566149237685, 0.04854071290990839, 0.049220263325562535, 0.049501275713155914],
        com: [0.005359412930605827, 0.01533643843518497, 0.02324054080867823, 0.03077057502644921, 0.042756382994971615, 0.04782455344722521],
    },
    Case {
        of: (0.01, 0.35, 2.0, 1e-8, 200),
        p: [77.63583712339545, 14.680128829008854, 0.003347023266688439, 14.680128829008854, 2.8518907277560963, 0.015009585534849513, 0.003347023266688439, 0.015009585534849513, 0.0027212725669538912],
        k: [2562.7358363557873, 994.8007099093945, 101.64748380212221],
        f: [-2342.0911655379728, 162.64924541795187, 168.95676765593728, 20.31751317999598, 0.007222786068934838],
        zmp: [-0.0008808480373775328, -0.0003100149359768439, 0.049758892857567405, 0.049894418443661964, 0.04997613030856539, 0.049994809450372206],
        com: [0.004599383147855413, 0.015457546096406724, 0.02656947535528127, 0.036173125348693144, 0.04715703109415104, 0.04965302438106529],
    },
];

/// Equal to 1e-9 of the largest number.
fn equal<'a>(what: &str, mine: impl IntoIterator<Item = &'a f64>, theirs: &[f64]) {
    let scale = theirs.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    for (mine, theirs) in mine.into_iter().zip(theirs) {
        assert!((mine - theirs).abs() <= 1e-9 * scale, "{what}: {mine} for {theirs}");
    }
}

#[test]
fn the_solution_and_the_gains_are_scipys() {
    for Case { of: (dt, z, q, r, n), p, k, f, .. } in CASES {
        let (a, b, c) = cart_table(dt, z);
        let solution = riccati::solve(&a, &b, &(c.transpose() * q * c), &SMatrix::<f64, 1, 1>::new(r)).unwrap();
        equal("P", solution.as_slice(), &p);
        let regulator = Regulator::new(dt, z, (q, r), n).unwrap();
        equal("K", regulator.gain().as_slice(), &k);
        let mine = [1, 2, 10, 50, n].map(|i| regulator.preview()[i - 1]);
        equal("f", &mine, &f);
    }
}

#[test]
fn the_response_to_a_step_is_the_reference_simulations() {
    for Case { of: (dt, z, q, r, n), zmp, com, .. } in CASES {
        let regulator = Regulator::new(dt, z, (q, r), n).unwrap();
        let step = (0.6 / dt).round() as usize;
        let at = [0.3, 0.5, 0.6, 0.7, 1.0, 1.4].map(|time: f64| (time / dt).round() as usize);
        let mut state = Vector3::zeros();
        let (mut zmps, mut coms) = (Vec::new(), Vec::new());
        for i in 0..(1.5 / dt).round() as usize {
            let jerk = regulator.jerk(&state, |ahead| if i + ahead >= step { 0.05 } else { 0.0 });
            state = regulator.advance(&state, jerk);
            zmps.push(regulator.zmp(&state));
            coms.push(state.x);
        }
        equal("zmp", &at.map(|i| zmps[i]), &zmp);
        equal("com", &at.map(|i| coms[i]), &com);
    }
}

#[test]
fn the_filters_gains_are_scipys_and_it_finds_a_shifted_body() {
    let trust = Trust { jerk: 20.0, com: 0.002, zmp: 0.01 };
    let mut filter = Filter::new(0.012, 0.26, &trust, 0.0).unwrap();
    // From the state zero a measurement of one metre shows the gains' columns.
    let theirs = [
        [0.22568369614454148, 2.4064698075069755, 11.09649392659733],
        [-0.002736519313913777, -0.305095223601064, -17.484658055814023],
    ];
    for (column, theirs) in theirs.iter().enumerate() {
        let mut fresh = filter;
        fresh.step(0.0, (column == 0).then_some(1.0), (column == 1).then_some(1.0));
        equal("gain", fresh.state().as_slice(), theirs);
    }
    for _ in 0..200 {
        filter.step(0.0, Some(0.01), Some(0.01));
    }
    assert!((filter.state().x - 0.01).abs() < 1e-6 && (filter.zmp() - 0.01).abs() < 1e-5);
    filter.step(0.0, Some(f64::NAN), None);
    assert!(filter.zmp().is_finite());
}

#[test]
fn a_system_that_cannot_be_stabilised_has_no_solution() {
    let a = SMatrix::<f64, 2, 2>::new(2.0, 0.0, 0.0, 0.5);
    let b = SMatrix::<f64, 2, 1>::new(0.0, 1.0);
    assert!(riccati::solve(&a, &b, &SMatrix::identity(), &SMatrix::<f64, 1, 1>::new(1.0)).is_none());
    assert!(Regulator::new(0.01, 0.3, (1.0, f64::NAN), 10).is_err());
    assert!(Regulator::new(0.01, 0.3, (0.0, 1.0), 10).is_err());
}
