//! Fisher's Iris data (1936), his three species as clusters, against numbers computed elsewhere: eigenvalues, distances
//! and tails with mpmath in 50 digits from the printed values, checked with scikit-learn's PCA and scipy's F
//! distribution; energy statistics with scipy's `cdist`. `tests/data/iris/README.md` says more.

use crate::samples::close;
use crate::{Cluster, Modes, Pdm, energy_test, hotelling};

const EIGENVALUES: [f64; 4] = [
    4.228241706034863,
    0.2426707479286334,
    0.07820950004291938,
    0.023835092973449434,
];
const EXPLAINED: [f64; 4] = [
    0.924618723201727,
    0.05306648311706783,
    0.017102609807929763,
    0.005212183873275374,
];
const FIRST_MODE: [f64; 4] = [
    0.36138659178536864,
    -0.08452251406456868,
    0.8566706059498349,
    0.3582891971515507,
];

/// Modes, the two species, distance, t^2, F, df2, p.
type Row = (usize, usize, usize, f64, f64, f64, usize, f64);
const PAIRS: [Row; 6] = [
    (
        2,
        0,
        1,
        9.942642356504173,
        2471.403425733771,
        1223.0925117151828,
        97,
        1.5761522932149742e-69,
    ),
    (
        2,
        0,
        2,
        12.467371943370734,
        3885.8840793586937,
        1923.1161004989453,
        97,
        9.11150369906195e-79,
    ),
    (
        2,
        1,
        2,
        3.179205974143686,
        252.6837656507726,
        125.05267993941298,
        97,
        1.39976488530776e-27,
    ),
    (
        4,
        0,
        1,
        10.160390830795485,
        2580.838545862824,
        625.4583210636946,
        95,
        2.6648569442322508e-67,
    ),
    (
        4,
        0,
        2,
        13.970881226301037,
        4879.638055985269,
        1182.5653452005115,
        95,
        4.4865964571440725e-80,
    ),
    (
        4,
        1,
        2,
        3.7707937901670276,
        355.4721451990555,
        86.14758620895478,
        95,
        9.539876264780465e-31,
    ),
];

fn species() -> [Cluster; 3] {
    [
        ("setosa", include_str!("../../../tests/data/iris/setosa.csv")),
        (
            "versicolor",
            include_str!("../../../tests/data/iris/versicolor.csv"),
        ),
        (
            "virginica",
            include_str!("../../../tests/data/iris/virginica.csv"),
        ),
    ]
    .map(|(name, table)| {
        let row = |line: &str| line.split(',').map(|cell| cell.parse().unwrap()).collect();
        let flowers: Vec<Vec<f64>> = table.lines().skip(1).map(row).collect();
        assert_eq!(flowers.len(), 50);
        Cluster::new(name, &flowers).unwrap()
    })
}

#[track_caller]
fn assert_close(is: f64, should: f64) {
    assert!(close(is, should, 1e-9), "{is:e} should be {should:e}");
}

#[test]
fn the_modes_of_iris_are_those_computed_elsewhere() {
    let pdm = Pdm::fit(&species()).unwrap();
    assert_eq!(pdm.degrees_of_freedom(), 4);
    for mode in 0..4 {
        assert_close(pdm.eigenvalues()[mode], EIGENVALUES[mode]);
        assert_close(pdm.explained()[mode], EXPLAINED[mode]);
        assert_close(pdm.modes()[(mode, 0)], FIRST_MODE[mode]);
    }
}

#[test]
fn the_distances_of_iris_are_those_computed_elsewhere() {
    let species = species();
    let pdm = Pdm::fit(&species).unwrap();
    for (modes, a, b, distance, t2, f, df2, p) in PAIRS {
        let asked = if modes == 4 {
            Modes::All
        } else {
            Modes::First(modes)
        };
        let [x, y] = [a, b].map(|index| pdm.project(&species[index], asked).unwrap());
        let test = hotelling(&x, &y).unwrap();
        assert_eq!((test.df1, test.df2), (modes, df2));
        let should = [distance, t2, f, p];
        [test.distance, test.t2, test.f, test.p]
            .iter()
            .zip(should)
            .for_each(|(&is, should)| assert_close(is, should));
    }
}

#[test]
fn the_energy_statistics_of_iris_are_those_computed_elsewhere() {
    let species = species();
    for (a, b, statistic) in [
        (0, 1, 123.55381498390659),
        (0, 2, 195.3039604308554),
        (1, 2, 38.85415319411552),
    ] {
        let test = energy_test(&species[a], &species[b], 99, 1).unwrap();
        assert_close(test.statistic, statistic);
        assert_eq!(test.p, 0.01);
    }
}
