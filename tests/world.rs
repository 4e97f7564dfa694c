//! `lapwing world`.

use std::fs;

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

/// The shipped circuit in a mirror, where it is driven counter-clockwise.
fn mirrored_world() -> String {
    let text = fs::read_to_string(repository("worlds/roduit2007/world.toml")).unwrap();
    let mut world: toml::Table = text.parse().unwrap();
    world["direction"] = "counter-clockwise".into();
    let width_m = world["arena"][0].as_float().unwrap();
    for wall in world["wall"].as_array_mut().unwrap() {
        for spline in wall["spline"].as_array_mut().unwrap() {
            for point in spline["control_points"].as_array_mut().unwrap() {
                point[0] = (width_m - point[0].as_float().unwrap()).into();
            }
        }
    }
    world.to_string()
}

/// Twice the area that a run's path goes round, positive counter-clockwise.
fn area_gone_round(csv: &str) -> f64 {
    let points: Vec<[f64; 2]> = csv
        .lines()
        .skip(1)
        .map(|row| {
            let numbers: Vec<f64> = row.split(',').map(|cell| cell.parse().unwrap()).collect();
            [numbers[1], numbers[2]]
        })
        .collect();
    points
        .windows(2)
        .map(|w| w[0][0] * w[1][1] - w[1][0] * w[0][1])
        .sum()
}

#[test]
fn a_robot_drives_round_as_its_world_says_unless_the_model_does() {
    let scratch = Scratch::new();
    scratch.write("mirrored.toml", mirrored_world());
    let mirrored = ["--world", "mirrored.toml"];
    scratch.drive(1, 2, "as_the_world", &mirrored);
    assert!(area_gone_round(&scratch.read("as_the_world/run_a.csv")) > 0.0);
    let clockwise = [&mirrored[..], &["--set", "run.direction=clockwise"]].concat();
    scratch.drive(1, 2, "clockwise", &clockwise);
    assert!(area_gone_round(&scratch.read("clockwise/run_a.csv")) < 0.0);
    // Both are read back as they were driven.
    let compared = scratch.json(["compare", "as_the_world", "clockwise", "--json"]);
    for cluster in compared["clusters"].as_array().unwrap() {
        assert_eq!(cluster["laps"], 2, "{cluster}");
    }
}

#[test]
fn a_folder_is_not_taken_for_the_shipped_world_of_its_name() {
    let scratch = Scratch::new();
    scratch.drive(1, 2, "roduit2007", &[]);
    scratch.drive(1, 2, "again", &[]);
    scratch.done(["world", "check", "roduit2007"]);
}
