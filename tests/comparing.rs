//! What `compare` says of clusters, and what it writes of them.

use serde_json::Value;

use crate::support::Scratch;

/// Simulates a small data set into a folder.
fn drive(scratch: &Scratch, folder: &str, more: &[&str]) {
    let args = ["drive", "roduit2007", "--laps", "4", "--out", folder];
    scratch.done(args.iter().chain(more));
}

/// Laps that are sampled already, each at so many coordinates.
fn table(seed: u32, laps: u32, coordinates: u32) -> String {
    let names: Vec<String> = (0..coordinates).map(|gate| format!("c{gate}")).collect();
    let lap = |lap: u32| {
        let number = |gate: u32| f64::from((seed + 7 * lap + 11 * gate).pow(2) % 97) / 97.0;
        let numbers: Vec<String> = (0..coordinates).map(|gate| number(gate).to_string()).collect();
        numbers.join(",")
    };
    let laps: Vec<String> = (0..laps).map(lap).collect();
    format!("{}\n{}\n", names.join(","), laps.join("\n"))
}

fn names(document: &Value) -> Vec<&str> {
    let clusters = document["clusters"].as_array().unwrap();
    clusters
        .iter()
        .map(|cluster| cluster["name"].as_str().unwrap())
        .collect()
}

#[test]
fn names_that_repeat_give_way_to_paths() {
    let scratch = Scratch::new();
    for (folder, seed) in [("one", "1"), ("two", "2")] {
        drive(
            &scratch,
            folder,
            &["--name", "set", "--runs", "2", "--seed", seed],
        );
    }
    drive(&scratch, "other", &["--name", "other", "--runs", "1"]);
    let document = scratch.json(["compare", "one/", "two", "other", "--json", "--out", "o"]);
    assert_eq!(names(&document), ["one/a", "one/b", "two/a", "two/b", "other/a"]);
    assert_eq!(
        [&document["pairs"][1]["a"], &document["pairs"][1]["b"]],
        ["one/a", "two/a"]
    );
    // The legend tells the runs apart too.
    let laps = scratch.read("o/laps.svg");
    assert!(
        names(&document)
            .iter()
            .all(|name| laps.contains(&format!(">{name}<")))
    );
    let document = scratch.json(["compare", "one/run_a.csv", "two/run_a.csv", "--json"]);
    assert_eq!(names(&document), ["one/run_a.csv", "two/run_a.csv"]);

    scratch.refuses(
        &["compare", "one", "other", "one"],
        "one/a is given twice, and nothing tells the two apart; leave one out",
    );
    scratch.done(["compare", "one", "--out", "o"]);
    assert!(scratch.read("o/laps.svg").contains(">run b<"));
}

#[test]
fn gate_tables_of_one_name_are_told_apart() {
    let scratch = Scratch::new();
    for (place, seed) in [("g.csv", 1), ("x/g.csv", 2), ("h.csv", 3)] {
        scratch.write(place, table(seed, 6, 3));
    }
    let document = scratch.json(["compare", "--sampled", "g.csv", "x/g.csv", "h.csv", "--json"]);
    assert_eq!(names(&document), ["g.csv", "x/g.csv", "h"]);
    scratch.refuses(
        &["compare", "--sampled", "g.csv", "g.csv"],
        "g.csv is given twice, and nothing tells the two apart; leave one out",
    );
}
