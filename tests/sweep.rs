//! `lapwing sweep`: its rows, and going on after it was stopped.

use std::collections::BTreeSet;
use std::process::Stdio;
use std::time::{Duration, Instant};

use crate::support::{Ran, Scratch, differing, files, interrupt, measured};

fn rows(scratch: &Scratch, folder: &str) -> (String, Vec<Vec<String>>) {
    let text = scratch.read(&format!("{folder}/sweep.csv"));
    let mut lines = text.lines();
    let header = lines.next().unwrap().to_owned();
    (
        header,
        lines
            .map(|line| line.split(',').map(str::to_owned).collect())
            .collect(),
    )
}

#[test]
fn there_is_a_row_for_each_point_seed_and_run() {
    let scratch = Scratch::new();
    let vary = [
        "--vary",
        "slip.level=0.1,1",
        "--vary",
        "wall.max_error_m=0.005,0.01",
    ];
    let set = measured("case_braitenberg");
    let rest = [
        "--measured",
        &set,
        "--laps",
        "4",
        "--runs",
        "2",
        "--seeds",
        "3",
        "--seed",
        "5",
        "--out",
        "o",
    ];
    scratch.done([["sweep", "roduit2007"].as_slice(), &vary, &rest].concat());
    let (header, rows) = rows(&scratch, "o");
    assert_eq!(
        header,
        "slip.level,wall.max_error_m,seed,run,distance,t2,p,laps,timed_out"
    );
    assert_eq!(rows.len(), 3 * 4 * 4);
    let distinct: BTreeSet<_> = rows.iter().map(|row| row[..4].to_vec()).collect();
    assert_eq!(distinct.len(), rows.len());
    assert_eq!(rows[0][..4], ["0.1", "0.005", "5", "a"]);
    for row in &rows {
        let [distance, t2, p]: [f64; 3] = std::array::from_fn(|i| row[4 + i].parse().unwrap());
        // Eq. 9 with 8 simulated and 20 measured laps.
        assert!(
            (t2 - 8.0 * 20.0 / 28.0 * distance * distance).abs() < 1e-9 * t2,
            "{row:?}"
        );
        assert!(p > 0.0 && p <= 1.0, "{row:?}");
        assert_eq!(row[7..], ["8", "0"]);
    }
    let document: serde_json::Value = serde_json::from_str(&scratch.read("o/sweep.json")).unwrap();
    let point = &document["points"][3];
    assert_eq!((&point["slip.level"], &point["laps"]), (&1.into(), &24.into()));
    let of_c: Vec<f64> = rows
        .iter()
        .filter(|row| row[..2] == ["1", "0.01"] && row[3] == "c")
        .map(|row| row[4].parse().unwrap())
        .collect();
    let mean = of_c.iter().sum::<f64>() / 3.0;
    let is = point["against"][2]["distance"].as_f64().unwrap();
    assert!(
        (is - mean).abs() < 1e-12,
        "{is} should be the mean {mean} of {of_c:?}"
    );
    // What the runs are from one another, which a simulation as good as the robot would be from them.
    for run in document["measured_runs"].as_array().unwrap() {
        let own = run["distance_from_others"].as_f64().unwrap();
        assert!(own > 0.0 && own < mean, "{run}");
    }
    for name in ["o/distance.svg", "o/modes.svg"] {
        assert!(scratch.read(name).starts_with("<svg "), "{name}");
    }
}

/// A point does not depend on which others stand in the grid, but for the model that all share.
#[test]
fn a_point_is_simulated_as_if_it_stood_alone() {
    let scratch = Scratch::new();
    let set = measured("case_braitenberg");
    let sweep = |vary: &str, out: &str| {
        scratch.done([
            "sweep",
            "roduit2007",
            "--vary",
            vary,
            "--measured",
            &set,
            "--laps",
            "3",
            "--out",
            out,
        ]);
    };
    sweep("slip.level=1", "alone");
    scratch.drive(1, 3, "drive", &["--name", "drive", "--set", "slip.level=1"]);
    let pairs = scratch.json(["compare", &set, "drive", "--permutations", "0", "--json"])["pairs"].clone();
    let with_run_a = pairs
        .as_array()
        .unwrap()
        .iter()
        .find(|pair| pair["b"] == "drive/a")
        .unwrap();
    let (is, should) = (
        &rows(&scratch, "alone").1[0][3],
        with_run_a["distance"].as_f64().unwrap(),
    );
    // The data set on disk is rounded to 0.1 mm.
    assert!(
        (is.parse::<f64>().unwrap() - should).abs() < 0.05 * should,
        "{is} should be {should}"
    );
}

#[test]
fn a_point_whose_runs_time_out_has_no_distance() {
    let scratch = Scratch::new();
    let vary = ["--vary", "controller.kind=braitenberg,rule-based"];
    let set = measured("case_braitenberg");
    // With this sensor the rule-based robot sees walls everywhere and spins for ever.
    let rest = [
        "--set",
        "sensor.kind=original",
        "--measured",
        &set,
        "--runs",
        "2",
        "--laps",
        "3",
        "--out",
        "o",
    ];
    let ran = scratch.done([["sweep", "roduit2007"].as_slice(), &vary, &rest].concat());
    let remark =
        |run| format!("lapwing: seed 1: controller.kind=rule-based/{run}: 0 of 3 laps (the run timed out)\n");
    assert_eq!(ran.stderr, remark("a") + &remark("b"));
    let (_, rows) = rows(&scratch, "o");
    assert_eq!(rows.len(), 8);
    for row in &rows[..4] {
        assert!(
            row[3].parse::<f64>().unwrap() > 0.0 && row[6..] == ["6", "0"],
            "{row:?}"
        );
    }
    for row in &rows[4..] {
        assert_eq!(row[3..], ["", "", "", "0", "2"], "{row:?}");
    }
}

/// Long enough to be stopped on the way.
fn long_sweep(scratch: &Scratch, rest: &[&str]) -> Vec<String> {
    scratch.write("measured.txt", measured("case_braitenberg"));
    let set = measured("case_braitenberg");
    let sweep = [
        "sweep",
        "roduit2007",
        "--vary",
        "slip.level=0,0.1,0.3,1",
        "--measured",
        &set,
        "--laps",
        "10",
    ];
    [sweep.as_slice(), &["--seeds", "30", "--quiet"], rest]
        .concat()
        .into_iter()
        .map(str::to_owned)
        .collect()
}

#[cfg(unix)]
#[test]
fn an_interrupted_sweep_goes_on_to_the_same_bytes() {
    let scratch = Scratch::new();
    let args = long_sweep(&scratch, &["--out", "stopped", "--threads", "1"]);
    let mut units = 0;
    for attempt in 0..2 {
        let resume = (attempt > 0).then_some("--resume");
        let ran = interrupted(&scratch, args.iter().map(String::as_str).chain(resume));
        assert_eq!(
            ran.stderr,
            "lapwing: interrupted: run again with --resume to go on\n"
        );
        assert_eq!((ran.status, ran.stdout.as_str()), (Some(2), ""));
        assert!(!scratch.path("stopped").exists());
        let now = files(&scratch.path("stopped.partial/units")).len();
        assert!(now > units && now < 120, "{now} units after {units}");
        units = now;
    }
    scratch.refuses(
        &["sweep", "roduit2007", "--vary", "slip.level=0,0.1", "--measured", &measured("case_braitenberg"), "--out", "stopped", "--resume"],
        "stopped.partial was begun with another configuration, seed or input; run without --resume to begin anew, or \
         name another folder",
    );
    // A unit that is not whole, as after a power cut, is made again.
    let unit = scratch.path("stopped.partial/units/0_1");
    let bytes = std::fs::read(&unit).unwrap();
    std::fs::write(&unit, &bytes[..bytes.len() / 2]).unwrap();
    let resumed = scratch.done(args.iter().map(String::as_str).chain(["--resume"]));

    let whole = scratch.done(long_sweep(&scratch, &["--out", "whole", "--threads", "2"]));
    assert_eq!(resumed.stdout, whole.stdout);
    let differ = differing(&scratch.results("stopped"), &scratch.results("whole"));
    assert!(differ.is_empty(), "{differ:?}");
    assert!(!scratch.path("stopped.partial").exists());
}

/// Runs the program and stops it as Ctrl-C does, once it has stored a few units more than there were.
#[cfg(unix)]
fn interrupted<'a>(scratch: &Scratch, args: impl Iterator<Item = &'a str>) -> Ran {
    let units = || std::fs::read_dir(scratch.path("stopped.partial/units")).map_or(0, Iterator::count);
    let (before, begun) = (units(), Instant::now());
    let child = scratch
        .command(args)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    while units() < before + 3 && begun.elapsed() < Duration::from_secs(60) {
        std::thread::yield_now();
    }
    interrupt(child)
}

#[test]
fn what_cannot_be_swept_is_refused() {
    let scratch = Scratch::new();
    let set = measured("case_braitenberg");
    let narrow = crate::support::world_with("[1.4, 1.2]", "[1.4, 1.3]");
    scratch.write("other/world.toml", narrow);
    scratch.write("model.toml", "[slip]\nlevel = 0.1\n\n[camera]\nnoise_m = 0\n");
    for (vary, rest, message) in [
        (
            "slip.levl=1",
            "",
            "--vary slip.levl=1: unknown key `slip.levl`; nearest known: slip.level",
        ),
        (
            "slip.level=0,1.5",
            "",
            "--vary slip.level=1.5: slip.level = 1.5 is outside [0, 1]",
        ),
        (
            "slip.level=0.1,0.10",
            "",
            "--vary slip.level=0.1,0.10: 0.10 is there twice; remove one",
        ),
        (
            "slip.level=1",
            "slip.level=0.5",
            "slip.level is given by --set and by --vary; leave one out",
        ),
        (
            "slip.level=nan",
            "",
            "--vary slip.level=nan: slip.level = nan is not a finite number",
        ),
        (
            "robot.body_radius_m=0.03,0.3",
            "",
            "--vary robot.body_radius_m=0.3: the corridor is 0.1817 m wide at (0.570, 0.344), too narrow for a robot of \
             0.6000 m; widen it there, or lower robot.body_radius_m or wall.thickness_m",
        ),
        (
            "slip.level=1",
            "world=other/world.toml",
            &format!(
                "{set}: driven in shipped world roduit2007, but the model's world is other/world.toml: laps are compared \
                 gate by gate, so let `world` of the model name the same, or pass --world FILE for both"
            ),
        ),
    ] {
        let mut args = vec![
            "sweep",
            "model.toml",
            "--vary",
            vary,
            "--measured",
            &set,
            "--out",
            "o",
        ];
        if !rest.is_empty() {
            args.extend(["--set", rest]);
        }
        scratch.refuses(&args, message);
    }
}
