//! The Point Distribution Model against another implementation's numbers, through `compare --sampled`.

use serde_json::Value;

use crate::support::{ROOT, Scratch};

/// Relative to the number, or absolute for numbers below 1.
const ACCURACY: f64 = 1e-9;

fn assert_close(name: &str, is: &Value, should: &Value) {
    let (is, should) = (is.as_f64().unwrap(), should.as_f64().unwrap());
    assert!(
        (is - should).abs() <= ACCURACY * should.abs().max(1.0),
        "{name}: {is} should be {should}"
    );
}

fn compare(modes: &str) -> Value {
    let table = |species: &str| format!("{ROOT}/tests/data/iris/{species}.csv");
    let [a, b, c] = ["setosa", "versicolor", "virginica"].map(table);
    Scratch::new().json(["compare", "--sampled", &a, &b, &c, "--modes", modes, "--json"])
}

fn expected() -> Value {
    let text = std::fs::read_to_string(format!("{ROOT}/tests/data/iris/expected.json")).unwrap();
    serde_json::from_str(&text).unwrap()
}

#[test]
fn eigenvalues_and_explained_variance() {
    let (document, expected) = (compare("2"), expected());
    for key in ["eigenvalues", "explained"] {
        let should = expected[key].as_array().unwrap();
        assert_eq!(document[key].as_array().unwrap().len(), should.len());
        for (mode, should) in should.iter().enumerate() {
            assert_close(&format!("{key} {mode}"), &document[key][mode], should);
        }
    }
}

#[test]
fn distances_tests_and_the_energy_statistic() {
    let (expected, two, all) = (expected(), compare("2"), compare("all"));
    let pairs = expected["pairs"].as_array().unwrap();
    assert_eq!(pairs.len(), 6);
    for should in pairs {
        let document = if should["modes"] == 2 { &two } else { &all };
        let same = |pair: &&Value| pair["a"] == should["a"] && pair["b"] == should["b"];
        let pair = document["pairs"].as_array().unwrap().iter().find(same).unwrap();
        for key in ["distance", "t2", "f", "df1", "df2", "p"] {
            assert_close(
                &format!("{key} of {} and {}", should["a"], should["b"]),
                &pair[key],
                &should[key],
            );
        }
        // An absolute bound says nothing of a tiny probability: its logarithm must agree too.
        let [is, should] = [&pair["p"], &should["p"]].map(|p| p.as_f64().unwrap().ln());
        assert!(
            (is - should).abs() < ACCURACY * should.abs(),
            "ln p {is} should be {should}"
        );
    }
    for should in expected["energy"].as_array().into_iter().flatten() {
        let same = |pair: &&Value| pair["a"] == should["a"] && pair["b"] == should["b"];
        let pair = two["pairs"].as_array().unwrap().iter().find(same).unwrap();
        assert_close("energy", &pair["energy"]["statistic"], &should["statistic"]);
    }
}
