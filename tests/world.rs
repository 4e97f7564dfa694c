//! `lapwing world`.

use serde_json::json;

use crate::support::{Scratch, repository};

/// The numbers that the paper gives for its circuit, section IV-B.
#[test]
fn the_circuit_needs_the_papers_numbers_of_segments() {
    let world = repository("worlds/roduit2007/world.toml");
    let errors = "0.001,0.005,0.01,0.05";
    let document = Scratch::new().json(["world", "segments", &world, "--max-error", errors, "--json"]);
    assert_eq!(document["world"], "roduit2007");
    let rows = document["approximations"].as_array().unwrap();
    let counts = |key: &str| {
        rows.iter()
            .map(|row| row["per_wall"][key].as_u64().unwrap())
            .collect::<Vec<_>>()
    };
    assert_eq!(
        json!(rows.iter().map(|row| &row["segments"]).collect::<Vec<_>>()),
        json!([105, 47, 33, 15])
    );
    assert_eq!(counts("outer"), [61, 27, 20, 9]);
    assert_eq!(counts("inner"), [44, 20, 13, 6]);
    for row in rows {
        let [bound, error] = ["max_error_m", "measured_error_m"].map(|key| row[key].as_f64().unwrap());
        assert!(
            error <= bound && error > 0.5 * bound,
            "{error} m for at most {bound} m"
        );
    }
}

#[test]
fn a_shipped_world_goes_by_its_name_and_is_sound() {
    let scratch = Scratch::new();
    let document = scratch.json(["world", "check", "roduit2007", "--json"]);
    let midline_m = document["midline_m"].as_f64().unwrap();
    assert!((midline_m - 3.2480).abs() < 1e-4, "{midline_m} m");
    assert_eq!(document["gates"], 100);
    let file = repository("worlds/roduit2007/world.toml");
    assert_eq!(scratch.json(["world", "check", &file, "--json"]), document);
}

#[test]
fn pictures_are_written_where_they_are_asked_for() {
    let scratch = Scratch::new();
    scratch.done(["world", "check", "roduit2007", "--out", "course"]);
    scratch.done([
        "world",
        "segments",
        "roduit2007",
        "--max-error",
        "0.005",
        "--out",
        "segments",
    ]);
    for name in ["course/course.svg", "segments/segments.svg"] {
        assert!(scratch.read(name).starts_with("<svg "), "{name}");
    }
    let course = scratch.read("course/course.svg");
    assert!(course.contains(">gate 0<") && course.contains(">driving direction<"));
}
