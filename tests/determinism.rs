//! The same bytes whatever `--threads` says, but for the manifest and timings.

use crate::support::{Scratch, differing, measured};

/// Runs a command with one thread and with two; the folders and what is printed must be the same.
fn assert_same(args: &[&str]) {
    let scratch = Scratch::new();
    let ran = [("1", "one_thread"), ("2", "two_threads")].map(|(threads, folder)| {
        let more = ["--threads", threads, "--quiet", "--out", folder];
        let ran = scratch.done(args.iter().chain(&more));
        (ran.stdout.replace(folder, "out"), scratch.results(folder))
    });
    let [(one, one_files), (two, two_files)] = ran;
    assert_eq!(
        differing(&one_files, &two_files),
        Vec::<std::path::PathBuf>::new(),
        "lapwing {args:?}"
    );
    assert_eq!(one, two, "lapwing {args:?}");
}

#[test]
fn drive() {
    assert_same(&[
        "drive",
        "roduit2007",
        "--runs",
        "4",
        "--laps",
        "3",
        "--seed",
        "7",
        "--log",
    ]);
}

#[test]
fn compare() {
    assert_same(&[
        "compare",
        &measured("case_braitenberg"),
        &measured("case_rule_based"),
        "--permutations",
        "99",
    ]);
}

#[test]
fn sweep() {
    let vary = [
        "--vary",
        "wall.max_error_m=0.001,0.05",
        "--vary",
        "controller.kind=braitenberg,rule-based",
    ];
    let rest = [
        "--measured",
        &measured("case_braitenberg"),
        "--runs",
        "2",
        "--laps",
        "3",
        "--seeds",
        "2",
    ];
    assert_same(&[["sweep", "roduit2007"].as_slice(), &vary, &rest].concat());
}

#[test]
fn reproduce() {
    assert_same(&["reproduce", "--seeds", "2", "--no-trace"]);
}

#[test]
fn another_seed_is_another_result() {
    let scratch = Scratch::new();
    let drive = |seed: &str| {
        let folder = format!("{seed}/out");
        std::fs::create_dir(scratch.path(seed)).unwrap();
        scratch.drive(1, 1, &folder, &["--seed", seed]);
        scratch.read(&format!("{folder}/run_a.csv"))
    };
    assert_ne!(drive("1"), drive("2"));
}
