//! What must not be found: nothing in a robot as declared, and nothing that the model has already.

use std::fs;

use serde_json::Value;

use crate::support::Scratch;
use crate::tracing::{NAMES, names, practice, says, share_signatures, signatures, trace};
use crate::undeclared::limping;

/// `lapwing trace` with a model of one's own.
fn trace_with(scratch: &Scratch, model: &str, measured: &str) -> Value {
    let cache = signatures().to_str().unwrap();
    let args = [
        "trace",
        model,
        "--measured",
        measured,
        "--out",
        "again",
        "--cache",
        cache,
        "--json",
    ];
    scratch.json(args)
}

/// A data set of four runs, by turns of two others.
fn shuffled(scratch: &Scratch, folder: &str, first: &str, second: &str) {
    for (place, name) in NAMES.iter().enumerate().take(4) {
        let from = practice(if place % 2 == 0 { first } else { second });
        let text = fs::read(format!("{from}/run_{name}.csv.gz")).unwrap();
        scratch.write(&format!("{folder}/run_{name}.csv.gz"), text);
    }
    let description = fs::read(practice(first) + "/dataset.toml").unwrap();
    scratch.write(&format!("{folder}/dataset.toml"), description);
}

#[test]
fn shuffled_runs_of_faithful_robots_are_faithful() {
    share_signatures("braitenberg");
    for [first, second] in [["faithful", "faithful_too"], ["faithful_too", "faithful"]] {
        let scratch = Scratch::new();
        shuffled(&scratch, "set", first, second);
        says(&trace(&scratch, "braitenberg", "set", &[]), "faithful", &[]);
    }
}

/// Runs that do not agree among themselves have no one effect that is the same in all of them.
#[test]
fn runs_of_two_robots_are_not_one_robot() {
    share_signatures("braitenberg");
    let scratch = Scratch::new();
    shuffled(&scratch, "set", "faithful", "stretched_picture");
    let found = trace(&scratch, "braitenberg", "set", &[]);
    assert_ne!(found["verdict"], "faithful", "{found:#}");
    let by = found["effects"].as_array().unwrap().iter().map(|e| &e["by"]);
    assert!(
        by.clone().all(|by| by == "run"),
        "{:?}: {:?}",
        names(&found),
        by.collect::<Vec<_>>()
    );
}

const LIMPING_MODEL: &str = "[[effect]]\nkind = \"wheel-asymmetry\"\nratio = 1.02\n";

#[test]
fn nothing_is_found_in_laps_of_a_robot_whose_effect_the_model_has() {
    let scratch = Scratch::new();
    let mut robot = limping();
    robot.laps = vec![4; 2];
    robot.record(&scratch, "set");
    scratch.write("model.toml", LIMPING_MODEL);
    says(&trace_with(&scratch, "model.toml", "set"), "faithful", &[]);
}

#[test]
fn nothing_is_found_in_logs_of_a_robot_whose_effect_the_model_has() {
    let scratch = Scratch::new();
    limping().logged(&[3; 3]).record(&scratch, "set");
    scratch.write("model.toml", LIMPING_MODEL);
    says(&trace_with(&scratch, "model.toml", "set"), "faithful", &[]);
}

/// The filter, linear about its pose, finds slip in this robot's logs 5 % off, and by its likelihood 24 units better so.
#[test]
fn slip_that_the_filter_finds_a_little_off_is_no_departure() {
    share_signatures("braitenberg");
    let scratch = Scratch::new();
    let kind = "controller.kind=braitenberg";
    scratch.done([
        "drive",
        "roduit2007",
        "--set",
        kind,
        "--laps",
        "5",
        "--log",
        "--seed",
        "777022",
        "--out",
        "set",
        "--quiet",
    ]);
    says(&trace(&scratch, "braitenberg", "set", &[]), "faithful", &[]);
}

/// What is found in one half of a robot's runs is all that is to be found in the other half.
#[test]
fn the_halves_of_one_robot_agree() {
    let scratch = Scratch::new();
    limping().logged(&[3; 6]).record(&scratch, "whole");
    for (half, runs) in [("first", &NAMES[..3]), ("second", &NAMES[3..6])] {
        for run in runs {
            let name = format!("run_{run}.csv");
            scratch.write(&format!("{half}/{name}"), scratch.read(&format!("whole/{name}")));
        }
        let of_all = format!("{:?}", &NAMES[..6]);
        let description = scratch
            .read("whole/dataset.toml")
            .replace(&of_all, &format!("{runs:?}"));
        scratch.write(&format!("{half}/dataset.toml"), description);
    }
    let first = trace(&scratch, "braitenberg", "first", &[]);
    says(&first, "explained", &["wheel-asymmetry"]);
    says(
        &trace_with(&scratch, "out/model.after.toml", "second"),
        "faithful",
        &[],
    );
}
