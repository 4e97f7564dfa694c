//! Help, exit status, and where things are printed.

use serde_json::Value;

use crate::support::{Scratch, measured};

const COMMANDS: [&str; 9] = [
    "reproduce",
    "drive",
    "compare",
    "sweep",
    "world",
    "fit-sensor",
    "effects",
    "trace",
    "bench",
];

#[test]
fn every_command_teaches_itself() {
    let scratch = Scratch::new();
    let overview = scratch.done(["--help"]).stdout;
    for command in COMMANDS {
        assert!(
            overview.contains(&format!("  {command} ")),
            "{command} is not listed"
        );
        explains(&scratch, &[command]);
    }
    for command in [["world", "check"], ["world", "segments"], ["bench", "rays"]] {
        explains(&scratch, &command);
    }
}

/// `lapwing help COMMAND` and `lapwing COMMAND --help` say the same, with an example.
fn explains(scratch: &Scratch, command: &[&str]) {
    let help = scratch.done([&["help"], command].concat()).stdout;
    let example = format!("Example: lapwing {}", command.join(" "));
    assert!(
        help.contains(&example) && help.contains("Usage: lapwing"),
        "{help}"
    );
    assert_eq!(scratch.done([command, &["--help"]].concat()).stdout, help);
}

#[test]
fn bad_arguments_end_with_status_2() {
    let scratch = Scratch::new();
    for (args, expected) in [
        (vec!["driv"], "a similar subcommand exists: 'drive'"),
        (vec!["drive", "roduit2007"], "--out <DIR>"),
        (
            vec!["drive", "roduit2007", "--out", "o", "--runs", "0"],
            "0 is not in 1..",
        ),
        (
            vec!["drive", "roduit2007", "--out", "o", "--threads", "0"],
            "0 is not in 1..",
        ),
        (
            vec!["sweep", "roduit2007", "--measured", "m", "--out", "o"],
            "--vary <KEY=V1,V2,...>",
        ),
        (
            vec!["world", "segments", "roduit2007", "--max-error", "5mm"],
            "invalid float literal",
        ),
        (vec!["compare"], "<DATA>..."),
        (
            vec!["bench", "rays", "--segments", "15,0", "--out", "o"],
            "0 is not in 1..",
        ),
    ] {
        let ran = scratch.run(&args);
        assert_eq!((ran.status, ran.stdout.as_str()), (Some(2), ""), "{args:?}");
        assert!(ran.stderr.contains(expected), "{args:?}: {}", ran.stderr);
    }
    assert!(crate::support::files(&scratch.path("")).is_empty());
}

#[test]
fn json_is_one_document_and_nothing_else() {
    let scratch = Scratch::new();
    scratch.write(
        "pairs.csv",
        "d,r\n0,4000\n0.01,1500\n0.02,400\n0.03,230\n0.05,120\n0.07,70\n",
    );
    scratch.json([
        "drive",
        "roduit2007",
        "--runs",
        "1",
        "--laps",
        "3",
        "--out",
        "laps",
        "--json",
    ]);
    let [rule_based, laps] = [measured("case_rule_based"), "laps".to_owned()];
    scratch.json(["compare", &rule_based, &laps, "--permutations", "9", "--json"]);
    scratch.json(["fit-sensor", "pairs.csv", "--json"]);
    let sweep = [
        "sweep",
        "roduit2007",
        "--vary",
        "slip.level=1",
        "--measured",
        &rule_based,
        "--laps",
        "3",
    ];
    let document = scratch.json(sweep.into_iter().chain(["--out", "sweep", "--json"]));
    assert_eq!(document["rows"].as_array().unwrap().len(), 4);
    assert!(matches!(scratch.json(["effects", "--json"]), Value::Array(effects) if !effects.is_empty()));
}

#[test]
fn numbers_of_segments_that_come_out_equal_stand_once() {
    let document = Scratch::new().json(["bench", "rays", "--segments", "1,2,15", "--json"]);
    let rows = document["rows"].as_array().unwrap();
    let segments: Vec<_> = rows.iter().map(|row| &row["segments"]).collect();
    assert_eq!(segments, [6, 15]);
    assert!(document["slopes"]["brute"]["exponent"].is_number());
    let document = Scratch::new().json(["bench", "rays", "--segments", "1,2", "--json"]);
    assert_eq!(document["slopes"], serde_json::json!({}));
}

#[test]
fn remarks_go_to_stderr_and_quiet_silences_them() {
    let scratch = Scratch::new();
    // With this sensor the rule-based robot sees walls everywhere and spins for ever.
    let spinning = [
        "--set",
        "sensor.kind=original",
        "--set",
        "controller.kind=rule-based",
        "--set",
        "run.patience_laps=1",
    ];
    let named = [&["--name", "laps"], &spinning[..]].concat();
    let ran = scratch.drive(1, 2, "laps", &named);
    assert_eq!(ran.stderr, "lapwing: laps/a: 0 of 2 laps (the run timed out)\n");
    assert!(ran.stdout.contains("0 of 2"), "{}", ran.stdout);
    let quiet = scratch.drive(1, 2, "laps", &[&named[..], &["--quiet"]].concat());
    assert_eq!(quiet.stderr, "");
}

#[test]
fn effects_are_listed_with_the_ranges_of_their_parameters() {
    let said = Scratch::new().done(["effects"]).stdout;
    for effect in [
        "wheel-asymmetry (act)\n  the left wheel's speed times ratio\n    ratio [0.5, 2], neutral 1\n",
        "    counts [0, 4000] counts, neutral 0\n    azimuth_rad [-6.283, 6.283] rad\n",
        "    wall outer or inner\n    position [0, 1] fraction of the wall\n",
    ] {
        assert!(said.contains(effect), "{said}");
    }
    assert!(said.lines().all(|line| line.chars().count() <= 110), "{said}");
}

#[test]
fn a_reader_that_closes_the_pipe_is_no_error() {
    let mut child = Scratch::new()
        .command(["effects"])
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_eq!(
        (output.status.code(), output.stderr.as_slice()),
        (Some(0), b"".as_slice())
    );
}

#[test]
fn what_a_report_says_is_well_set() {
    let scratch = Scratch::new();
    let ran = scratch.done(["reproduce", "--seeds", "2", "--no-trace", "--out", "report"]);
    assert!(ran.stdout.contains("; 4 of 4 runs differ"), "{}", ran.stdout);
    let report = scratch.read("report/report.html");
    assert!(report.contains("lies beside this page as figures/rays_timing.svg"));
    for text in [report, scratch.read("report/figures/rays_timing.svg")] {
        let blanks = text.lines().find(|line| line.trim_start().contains("   "));
        assert_eq!(blanks, None);
    }
}

#[test]
fn compare_names_runs_after_their_data_set() {
    let document = Scratch::new().json([
        "compare",
        &measured("case_braitenberg"),
        "--permutations",
        "0",
        "--json",
    ]);
    let clusters = document["clusters"].as_array().unwrap();
    let names: Vec<_> = clusters
        .iter()
        .map(|cluster| cluster["name"].as_str().unwrap())
        .collect();
    assert_eq!(
        names,
        ["a", "b", "c", "d"].map(|run| format!("case_braitenberg/{run}"))
    );
    assert!(
        clusters.iter().all(|cluster| cluster["laps"] == 20),
        "{clusters:?}"
    );
}

#[test]
fn a_drive_is_a_data_set_that_compare_reads() {
    let scratch = Scratch::new();
    scratch.drive(27, 2, "laps", &["--name", "laps", "--log"]);
    let document = scratch.json(["compare", "laps", "--permutations", "0", "--json"]);
    let clusters = document["clusters"].as_array().unwrap();
    assert_eq!(
        (clusters.len(), &clusters[26]["name"]),
        (27, &Value::from("laps/aa"))
    );
    let header = scratch.read("laps/run_a.csv").lines().next().unwrap().to_owned();
    assert_eq!(
        header,
        "t_s,x_m,y_m,ps0,ps1,ps2,ps3,ps4,ps5,ps6,ps7,left_m_s,right_m_s"
    );
    let again = scratch.done([
        "drive",
        "laps/model.toml",
        "--runs",
        "27",
        "--laps",
        "2",
        "--log",
        "--out",
        "again",
    ]);
    assert!(again.stdout.contains("written to again"));
    assert_eq!(scratch.read("again/run_z.csv"), scratch.read("laps/run_z.csv"));
}
