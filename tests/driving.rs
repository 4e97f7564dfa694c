//! What `drive` says and draws of its runs.

use serde_json::Value;

use crate::support::Scratch;

/// Simulates this into the folder `o`: what is printed, and the first run's summary.
fn drive(scratch: &Scratch, args: &[&str]) -> (String, Value) {
    let said = scratch.done(["drive", "--out", "o"].iter().chain(args)).stdout;
    let summary: Value = serde_json::from_str(&scratch.read("o/summary.json")).unwrap();
    (said, summary["runs"][0].clone())
}

#[test]
fn a_drive_says_what_compare_will_call_it() {
    let scratch = Scratch::new();
    let said = scratch.drive(2, 3, "slippery", &[]).stdout;
    let (_, name) = said.trim_end().rsplit_once("written to slippery, as ").unwrap();
    let compared = scratch.done(["compare", "slippery"]).stdout;
    assert!(compared.contains(&format!("{name}/a  ")), "{said}{compared}");
    let said = scratch.drive(2, 3, "slippery", &["--name", "mine"]).stdout;
    assert!(said.ends_with("\nwritten to slippery, as mine\n"), "{said}");
}

#[test]
fn a_run_that_gets_stuck_is_drawn_to_where_it_stopped() {
    let scratch = Scratch::new();
    // It does not see the walls.
    let blind = [
        "roduit2007",
        "--set",
        "sensor.range_m=0.001",
        "--set",
        "slip.level=1",
        "--runs",
        "1",
    ];
    let (said, run) = drive(&scratch, &blind);
    assert_eq!((&run["laps"], &run["timed_out"]), (&0.into(), &true.into()));
    assert_eq!(
        [&run["lap_time_s"], &run["lap_time_deviation_s"]],
        [&Value::Null; 2]
    );
    let row = said.lines().nth(2).unwrap();
    let cells: Vec<&str> = row
        .split("  ")
        .map(str::trim)
        .filter(|cell| !cell.is_empty())
        .collect();
    let contacts = run["contact_steps"].to_string();
    assert_eq!(cells, ["a", "0 of 20", "-", "-", &contacts, "timed out"]);
    let laps = scratch.read("o/laps.svg");
    assert!(
        laps.contains(">run a, no lap kept: to where it stopped<"),
        "{laps}"
    );
    assert!(
        laps.contains("stroke-dasharray") && !laps.contains(">run a<"),
        "{laps}"
    );
}

#[test]
fn a_run_that_gets_stuck_after_some_laps_is_drawn_on() {
    let scratch = Scratch::new();
    // Its readings grow until it sees walls everywhere.
    let text = "controller.kind = \"rule-based\"\n[[effect]]\nkind = \"reading-gain\"\nby = \"time\"\ngain = 1.0\ngain_per_s = 0.005\n";
    scratch.write("grows.toml", text);
    let (_, run) = drive(&scratch, &["grows.toml", "--runs", "1"]);
    assert_eq!((&run["laps"], &run["timed_out"]), (&6.into(), &true.into()));
    let laps = scratch.read("o/laps.svg");
    let both = [">run a<", ">run a, on to where it stopped<"];
    assert!(both.iter().all(|label| laps.contains(label)), "{laps}");
}

#[test]
fn laps_that_miss_a_gate_are_no_laps_closed() {
    let scratch = Scratch::new();
    let astray = "[[effect]]\nkind = \"camera-offset\"\ndx_m = 0.09\n";
    scratch.write("astray.toml", astray);
    let (said, run) = drive(&scratch, &["astray.toml", "--runs", "1", "--laps", "3"]);
    assert_eq!((&run["laps"], &run["timed_out"]), (&0.into(), &false.into()));
    assert!(said.contains("  3 laps missed a gate\n"), "{said}");
    assert!(
        scratch
            .read("o/laps.svg")
            .contains(">run a, no lap kept: to where it stopped<")
    );
}

#[test]
fn one_lap_has_no_deviation() {
    let scratch = Scratch::new();
    let (said, run) = drive(&scratch, &["roduit2007", "--runs", "1", "--laps", "1"]);
    assert!(
        run["lap_time_s"].is_f64() && run["lap_time_deviation_s"].is_null(),
        "{run}"
    );
    assert!(said.contains("  -         0  closed\n"), "{said}");
    let laps = scratch.read("o/laps.svg");
    assert!(laps.contains(">run a<") && !laps.contains("stopped"), "{laps}");
}
