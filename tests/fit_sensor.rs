//! `lapwing fit-sensor`.

use std::fmt::Write as _;

use crate::support::Scratch;

/// The ten pairs of the shipped model's sensor.
const PAIRS: &str = "0,4095\n0.005,2133.33\n0.01,1465.73\n0.015,601.46\n0.02,383.84\n0.03,234.93\n0.04,158.03\n0.05,120\n\
                     0.06,104.09\n0.07,67.19\n";

/// Eight pairs from 10 to 80 mm, in these units of a metre.
fn pairs(unit_m: f64, reading: impl Fn(f64) -> f64) -> String {
    let mut text = String::from("distance,reading\n");
    for i in 1..=8 {
        let distance_m = f64::from(i) * 0.01;
        writeln!(text, "{},{}", distance_m / unit_m, reading(distance_m)).unwrap();
    }
    text
}

#[test]
fn what_it_prints_in_the_end_is_what_drive_takes() {
    let scratch = Scratch::new();
    scratch.write("pairs.csv", format!("d,r\n{PAIRS}"));
    let said = scratch.done(["fit-sensor", "pairs.csv"]).stdout;
    let settings = said.lines().last().unwrap().strip_prefix("in a model: ").unwrap();
    assert_eq!(
        settings,
        "--set sensor.improved.a_counts=4202.93 --set sensor.improved.d0_m=0.00521953 --set sensor.improved.exponent=1.57282"
    );
    let drive = "drive roduit2007 --runs 1 --laps 1 --out laps ".to_owned() + settings;
    scratch.done(drive.split(' '));
    assert!(scratch.read("laps/model.toml").contains("exponent = 1.57282\n"));
}

#[test]
fn pairs_that_determine_no_response_are_refused() {
    let scratch = Scratch::new();
    let falls = "the readings do not fall as the distance grows; measure farther away too, and look whether the first column \
                 holds the distances and the second the readings, or name them with --columns";
    let near = "the pairs do not determine d0; measure more of them nearer than 0.01 m";
    let response = |d: f64| 4000.0 / (1.0 + (d / 0.005).powf(1.5));
    let sees = "an infra-red sensor sees no wall; give distances in m, in the first column or in the one that --columns names \
                first";
    for (text, message) in [
        (pairs(1.0, |_| 100.0), format!("pairs.csv: {falls}")),
        (pairs(1.0, |d| 1e4 * d), format!("pairs.csv: {falls}")),
        (pairs(1.0, |d| 0.5 * d.powf(-1.5)), format!("pairs.csv: {near}")),
        (
            pairs(0.001, response),
            format!("pairs.csv:3: distance: at 20 m {sees}"),
        ),
        (
            PAIRS.to_owned(),
            "pairs.csv:1: a row of numbers; a line with the names of the columns must come first".to_owned(),
        ),
    ] {
        scratch.write("pairs.csv", text);
        scratch.refuses(&["fit-sensor", "pairs.csv", "--out", "o"], &message);
    }
    // In cm they could be those of another sensor.
    scratch.write("pairs.csv", pairs(0.01, response));
    assert_eq!(
        scratch.done(["fit-sensor", "pairs.csv"]).stderr,
        "lapwing: pairs.csv: distances up to 8 m are taken to be in m; few infra-red sensors see so far\n"
    );
}
