//! What `compare` says of clusters, and what it writes of them.

use serde_json::Value;

use crate::support::Scratch;

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
        scratch.drive(2, 4, folder, &["--name", "set", "--seed", seed]);
    }
    scratch.drive(1, 4, "other", &["--name", "other"]);
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

#[test]
fn pairs_are_csv_whatever_clusters_are_called() {
    let scratch = Scratch::new();
    let odd = "a \"set\", on\ntwo lines";
    scratch.drive(2, 4, "set", &["--name", "set"]);
    let description = scratch.read("set/dataset.toml");
    let odd_name = format!("name = {}", Value::from(odd));
    scratch.write(
        "set/dataset.toml",
        description.replace("name = \"set\"", &odd_name),
    );
    scratch.done(["compare", "set", "--out", "o"]);
    let pairs = scratch.read("o/pairs.csv");
    let mut pairs = csv::Reader::from_reader(pairs.as_bytes());
    assert_eq!(&pairs.headers().unwrap()[8], "energy_p");
    let rows: Vec<csv::StringRecord> = pairs.records().map(Result::unwrap).collect();
    assert_eq!(rows.len(), 1);
    let names = [&rows[0][0], &rows[0][1]];
    assert_eq!(names, ["a", "b"].map(|run| format!("{odd}/{run}")));
}

#[test]
fn all_modes_are_counted_pair_by_pair() {
    let scratch = Scratch::new();
    for (name, seed, laps) in [("a", 1, 4), ("b", 2, 7), ("c", 3, 7)] {
        scratch.write(&format!("{name}.csv"), table(seed, laps, 30));
    }
    let compare = [
        "compare",
        "--sampled",
        "a.csv",
        "b.csv",
        "c.csv",
        "--modes",
        "all",
    ];
    let document = scratch.json(compare.iter().chain(&["--json"]));
    let pairs = document["pairs"].as_array().unwrap();
    let modes: Vec<_> = pairs.iter().map(|pair| pair["modes"].as_u64().unwrap()).collect();
    assert_eq!((&document["modes"], modes), (&17.into(), vec![9, 9, 12]));
    let said = scratch.done(compare).stdout;
    assert!(
        said.contains("distances in all modes (9 to 12 a pair) (eq. 8)"),
        "{said}"
    );
    assert!(said.contains("are not comparable"), "{said}");
    // Where all are equal, so are their modes.
    let said = scratch
        .done(["compare", "--sampled", "b.csv", "c.csv", "--modes", "all"])
        .stdout;
    assert!(said.contains("distances in all modes (12 a pair)"), "{said}");
    assert!(!said.contains("comparable"), "{said}");
}

#[test]
fn one_column_has_one_mode() {
    let scratch = Scratch::new();
    for (name, seed) in [("a", 1), ("b", 2)] {
        scratch.write(&format!("{name}.csv"), table(seed, 6, 1));
    }
    let ran = scratch.done(["compare", "--sampled", "a.csv", "b.csv", "--out", "o"]);
    let (laps, title) = ("12 laps in 2 clusters, 1 gate;", "distances in 1 mode (eq. 8)");
    assert!(
        ran.stdout.contains(laps) && ran.stdout.contains(title),
        "{}",
        ran.stdout
    );
    let manifest: Value = serde_json::from_str(&scratch.read("o/manifest.json")).unwrap();
    assert_eq!(manifest["configuration"]["modes"], "1");
    scratch.refuses(
        &["compare", "--sampled", "a.csv", "b.csv", "--modes", "2"],
        "2 modes wanted, from 1 to 1 are available",
    );
}

#[test]
fn one_cluster_has_nothing_to_be_compared_with() {
    let scratch = Scratch::new();
    scratch.write("a.csv", table(1, 6, 3));
    let ran = scratch.done(["compare", "--sampled", "a.csv"]);
    assert!(
        ran.stdout.starts_with("6 laps in 1 cluster, 3 gates;"),
        "{}",
        ran.stdout
    );
    let end = "\n\nThere is no other cluster to compare it with.\n";
    assert!(ran.stdout.ends_with(end), "{}", ran.stdout);
}

#[test]
fn sampled_laps_need_no_world() {
    let scratch = Scratch::new();
    scratch.write("a.csv", table(1, 6, 3));
    scratch
        .run(["compare", "--sampled", "a.csv", "--world", "roduit2007"])
        .is_refused_with("'--sampled' cannot be used with '--world <FILE>'");
}

#[test]
fn sampled_laps_have_no_unit() {
    let scratch = Scratch::new();
    scratch.write("a.csv", table(1, 6, 3));
    scratch.done(["compare", "--sampled", "a.csv", "--out", "o"]);
    let modes = scratch.read("o/modes.svg");
    assert!(modes.contains(">mode 1 (") && !modes.contains("mm"), "{modes}");
    // Numbers up to 1, as they stand in the table.
    assert!(modes.contains(">0.5<") && !modes.contains(">500<"), "{modes}");
    scratch.drive(1, 4, "set", &[]);
    scratch.done(["compare", "set", "--out", "o"]);
    assert!(scratch.read("o/modes.svg").contains(">mode 1, mm ("));
}

#[test]
fn laps_that_were_written_are_compared_to_the_same_distances() {
    let scratch = Scratch::new();
    scratch.drive(3, 4, "set", &["--name", "set"]);
    let whole = scratch.json(["compare", "set", "--out", "o", "--json"]);
    let tables = ["a", "b", "c"].map(|run| format!("o/laps/set_{run}.csv"));
    let args = ["compare", "--sampled", "--json"].map(str::to_owned);
    let again = scratch.json(args.iter().chain(&tables));
    let numbers = |document: &Value| {
        let mut pairs = document["pairs"].as_array().unwrap().clone();
        for pair in &mut pairs {
            let pair = pair.as_object_mut().unwrap();
            pair.retain(|key, _| key != "a" && key != "b");
        }
        pairs
    };
    assert_eq!(numbers(&again), numbers(&whole));
    assert_eq!(again["eigenvalues"], whole["eigenvalues"]);
    let header = scratch.read(&tables[0]).lines().next().unwrap().to_owned();
    assert!(
        header.starts_with("gate_0,gate_1,") && header.ends_with(",gate_99"),
        "{header}"
    );

    let scores = scratch.read("o/projections.csv");
    let mut scores = csv::Reader::from_reader(scores.as_bytes());
    assert_eq!(
        scores.headers().unwrap(),
        vec!["cluster", "lap", "mode_1", "mode_2"]
    );
    let rows: Vec<csv::StringRecord> = scores.records().map(Result::unwrap).collect();
    assert_eq!((rows.len(), &rows[5][0], &rows[5][1]), (12, "set/b", "2"));
    // All laps together have the variance of the mode.
    let squares = rows.iter().map(|row| row[2].parse::<f64>().unwrap().powi(2));
    let (is, should) = (
        squares.sum::<f64>() / 11.0,
        whole["eigenvalues"][0].as_f64().unwrap(),
    );
    assert!((is - should).abs() < 1e-9 * should, "{is} should be {should}");

    let manifest: Value = serde_json::from_str(&scratch.read("o/manifest.json")).unwrap();
    let files = manifest["files"].as_array().unwrap();
    assert!(files.contains(&"projections.csv".into()) && files.contains(&"laps/set_c.csv".into()));
    // What is ours is replaced, tables too.
    scratch.done(["compare", "set", "--out", "o"]);
}
