//! Data that are short, broken, or not the model's: a clear error or a clear statement, never a wrong name.

use std::fs;
use std::ops::Range;
use std::path::PathBuf;

use sim::{Pattern, Setting};

use crate::ground;
use crate::support::{Scratch, world_with};
use crate::tracing::{Robot, holds, rewrite, says, share_signatures, trace, try_trace, with_columns};
use crate::undeclared::{LIMP, LIMPING, limping};

/// A robot that limps, of which little is measured.
pub(crate) fn few_laps(laps: &[usize]) -> Robot {
    let laps = laps.to_vec();
    Robot { laps, ..limping() }
}

#[test]
fn one_run_is_traced_and_what_it_cannot_tell_is_said() {
    let scratch = Scratch::new();
    few_laps(&[5]).record(&scratch, "set");
    let found = trace(&scratch, "braitenberg", "set", &[]);
    says(&found, "explained", &["wheel-asymmetry"]);
    holds(&found["effects"][0], "ratio", LIMPING, 1.0);
    let remark = found["remarks"][0].as_str().unwrap();
    assert!(
        remark.starts_with("One run only: whether the robot differs from run to run"),
        "{remark}"
    );
    let report = scratch.read("out/report.html");
    assert!(
        report.contains("One run only") && report.contains("The simulation against the run that was fitted")
    );
    assert_eq!(found["error"]["held_out"], serde_json::json!([]));
}

#[test]
fn runs_of_unequal_length_are_traced() {
    let scratch = Scratch::new();
    limping().logged(&[5, 3, 4]).record(&scratch, "set");
    let found = trace(&scratch, "braitenberg", "set", &[]);
    says(&found, "explained", &["wheel-asymmetry"]);
    let expected = ["Run set/b has 3 of 5 laps.", "Run set/c has 4 of 5 laps."];
    assert_eq!(found["remarks"], serde_json::json!(expected));
}

#[test]
fn two_laps_are_too_few() {
    let scratch = Scratch::new();
    few_laps(&[3, 2]).record(&scratch, "set");
    let description = scratch.read("set/dataset.toml");
    scratch.write(
        "one_lap/dataset.toml",
        description.replace("laps = 3", "laps = 1"),
    );
    for run in ["run_a.csv", "run_b.csv"] {
        scratch.write(&format!("one_lap/{run}"), scratch.read(&format!("set/{run}")));
    }
    let ran = try_trace(&scratch, "braitenberg", "one_lap", &[]);
    assert!(
        ran.stderr.contains("raise `laps` in dataset.toml"),
        "{}",
        ran.stderr
    );
    scratch.refuses(
        &[
            "trace",
            "roduit2007",
            "--measured",
            "set",
            "--out",
            "out",
            "--no-cache",
            "--quiet",
        ],
        "set/run_b.csv: 2 whole laps after the first, which is not analysed: at least 3 in every run are needed to trace anything; leave the \
         run out of `runs` in dataset.toml, or measure it again",
    );
}

#[test]
fn a_delay_of_a_control_step_is_sized_by_the_robots_own_steps() {
    const DELAY_S: f64 = 0.064;
    let scratch = Scratch::new();
    let late = Setting::constant(sim::find("command-delay").unwrap(), [DELAY_S]);
    let robot = Robot {
        controller: ground::rule_based(),
        ..Robot::with(late)
    };
    robot.logged(&[4; 3]).record(&scratch, "set");
    let found = trace(&scratch, "rule-based", "set", &[]);
    says(&found, "explained", &["command-delay"]);
    let size = &found["effects"][0]["parameters"][0];
    assert!((size["value"].as_f64().unwrap() - DELAY_S).abs() < 1e-9, "{size}");
    assert!(size["low"].as_f64().unwrap() < DELAY_S - 0.015, "{size}");
}

#[test]
fn the_time_of_day_on_a_robots_clock_is_no_time_since_its_start() {
    let (start, per_s) = (0.9, 2e-4);
    let drifting = Setting {
        spec: sim::find("reading-gain").unwrap(),
        pattern: Pattern::ByTime {
            start: vec![start],
            per_s: vec![per_s],
        },
    };
    let scratch = Scratch::new();
    Robot::with(drifting).logged(&[5; 4]).record(&scratch, "set");
    for run in ["a", "b", "c", "d"] {
        rewrite(&scratch, &format!("set/run_{run}.csv"), |_, mut fields| {
            let time_s: f64 = fields[0].parse().unwrap();
            fields[0] = format!("{:.3}", 1.7e9 + time_s);
            Some(fields)
        });
    }
    let found = trace(&scratch, "braitenberg", "set", &[]);
    says(&found, "explained", &["reading-gain"]);
    assert_eq!(found["effects"][0]["by"], "time");
    holds(&found["effects"][0], "gain", start, 1.0);
    holds(&found["effects"][0], "gain_per_s", per_s, 0.0);
    // Of a change in time, laps are compared that lie as far from the start.
    let error = |key: &str| found["error"][key].as_f64().unwrap();
    assert!(error("after") < error("before"), "{}", found["error"]);
}

#[test]
fn a_run_whose_log_has_no_readings_has_the_mean_size_of_the_others() {
    const GAINS: [f64; 3] = [0.9, 1.05, 1.2];
    let by_run = Setting {
        spec: sim::find("reading-gain").unwrap(),
        pattern: Pattern::ByRun(GAINS.map(|gain| vec![gain]).to_vec()),
    };
    let scratch = Scratch::new();
    Robot::with(by_run).logged(&[4; 3]).record(&scratch, "set");
    rewrite(&scratch, "set/run_b.csv", |_, mut fields| {
        fields[3..11].iter_mut().for_each(String::clear);
        Some(fields)
    });
    let found = trace(&scratch, "braitenberg", "set", &[]);
    says(&found, "explained", &["reading-gain"]);
    let effect = &found["effects"][0];
    assert_eq!(effect["by"], "run");
    let of = |key: &str, run: usize| effect["parameters"][0][key][run].as_f64().unwrap();
    for (run, gain) in GAINS.into_iter().enumerate() {
        let (value, low, high) = (of("value", run), of("low", run), of("high", run));
        assert!((value - gain).abs() < 0.01, "run {run}: {value}");
        assert!(low < value && value < high, "run {run}: {low} {value} {high}");
    }
    // How far the others are apart is how little is known of it.
    assert!(of("low", 1) < GAINS[0] && of("high", 1) > GAINS[2], "{effect}");
    let remark = found["remarks"][0].as_str().unwrap();
    assert!(
        remark.starts_with("The log of run set/b has no readings"),
        "{remark}"
    );
}

/// The report on a log of which some columns are multiplied: no controller gives those commands, and nothing is named.
fn in_other_units(columns: Range<usize>, factor: f64) -> String {
    let scratch = Scratch::new();
    limping().logged(&[3; 2]).record(&scratch, "set");
    for run in ["set/run_a.csv", "set/run_b.csv"] {
        with_columns(&scratch, run, columns.clone(), |value| {
            format!("{:.5}", factor * value)
        });
    }
    let found = trace(&scratch, "braitenberg", "set", &[]);
    says(&found, "unexplained", &[]);
    assert_eq!(found["residual"]["stage"], "decide", "{found:#}");
    let decide = &found["logs"]["decide"];
    assert_eq!(decide["verdict"], "no controller of this kind", "{decide}");
    assert!(decide["commands_unexplained"].as_f64().unwrap() > 0.5, "{decide}");
    let report = scratch.read("out/report.html");
    assert!(report.contains("Look at the units"));
    report
}

#[test]
fn speeds_in_millimetres_are_no_controllers() {
    let report = in_other_units(11..13, 1000.0);
    assert!(report.contains("m/s, and the declared wheels reach 0.129 m/s"));
}

#[test]
fn readings_as_shares_of_full_scale_are_no_controllers() {
    let report = in_other_units(3..11, 1.0 / 4095.0);
    assert!(!report.contains("the declared wheels reach"));
}

#[test]
fn positions_in_millimetres_are_refused() {
    let scratch = Scratch::new();
    few_laps(&[3]).record(&scratch, "set");
    rewrite(&scratch, "set/run_a.csv", |_, mut fields| {
        for field in &mut fields[1..3] {
            *field = format!("{:.1}", 1000.0 * field.parse::<f64>().unwrap());
        }
        Some(fields)
    });
    scratch.refuses(
        &["trace", "roduit2007", "--measured", "set", "--out", "out", "--no-cache", "--quiet"],
        "set/run_a.csv: 0 whole laps, and the first is not analysed: at least two are needed, and four to trace; check the world, the \
         driving direction (clockwise; [declared] run.direction in dataset.toml) and the unit of x_m and y_m",
    );
}

#[test]
fn laps_that_declare_no_direction_were_driven_as_the_model_says() {
    let scratch = Scratch::new();
    let backward = ["--set", "run.direction=\"counter-clockwise\""];
    scratch.drive(1, 2, "set", &backward);
    let description = scratch.read("set/dataset.toml");
    let (undeclared, _) = description.split_once("[declared").unwrap();
    scratch.write("set/dataset.toml", undeclared);
    let sweep = [
        "sweep",
        "roduit2007",
        "--vary",
        "slip.level=0.1",
        "--runs",
        "1",
        "--measured",
        "set",
        "--out",
        "out",
        "--quiet",
    ];
    scratch.done([&sweep[..], &backward].concat());
    let refused = "set/run_a.csv: 0 whole laps, and the first is not analysed: at least two are needed, and four to trace; check the \
                   world, the driving direction (clockwise; [declared] run.direction in dataset.toml) and the unit of x_m and y_m";
    scratch.refuses(&sweep, refused);
    // What a data set declares comes before what the model says.
    let declared = "[declared]\nrun.direction = \"clockwise\"\n";
    scratch.write("set/dataset.toml", format!("{undeclared}{declared}"));
    let ran = scratch.run([&sweep[..], &backward].concat());
    assert!(
        ran.stderr.contains("the driving direction (clockwise;"),
        "{}",
        ran.stderr
    );
}

#[test]
fn times_in_milliseconds_are_refused() {
    let scratch = Scratch::new();
    few_laps(&[3]).record(&scratch, "set");
    with_columns(&scratch, "set/run_a.csv", 0..1, |time_s| {
        format!("{:.0}", 1000.0 * time_s)
    });
    let ran = try_trace(&scratch, "braitenberg", "set", &[]);
    assert_eq!(ran.status, Some(2), "{}", ran.stderr);
    let said = "the declared robot needs about 65 s at its speed: is t_s in seconds";
    assert!(ran.stderr.contains(said), "{}", ran.stderr);
}

#[test]
fn rows_between_control_steps_are_refused() {
    let scratch = Scratch::new();
    few_laps(&[4]).record(&scratch, "set");
    with_columns(&scratch, "set/run_a.csv", 0..1, |time_s| {
        format!("{:.3}", 0.5 * time_s)
    });
    let ran = try_trace(&scratch, "braitenberg", "set", &[]);
    let said = "set/run_a.csv: a row every 0.032 s, and the declared robot's control step is 0.064 s";
    ran.is_refused_with(said);
}

#[test]
fn a_run_that_is_given_twice_is_refused() {
    let scratch = Scratch::new();
    few_laps(&[3; 2]).record(&scratch, "set");
    for again in ["--measured", "--held-out"] {
        let ran = try_trace(&scratch, "braitenberg", "set", &[again, "set"]);
        assert_eq!(ran.status, Some(2), "{}", ran.stderr);
        let said = "set/run_a.csv: the same run as set/run_a.csv; give each run once";
        assert!(ran.stderr.contains(said), "{}", ran.stderr);
    }
    // Written otherwise, and by another clock, it is the same run.
    few_laps(&[3; 2]).record(&scratch, "again");
    rewrite(&scratch, "again/run_a.csv", |_, mut fields| {
        fields[0] = format!("{:.4}", fields[0].parse::<f64>().unwrap() + 100.0);
        Some(fields)
    });
    let ran = try_trace(&scratch, "braitenberg", "set", &["--held-out", "again"]);
    let said = "again/run_a.csv: the same run as set/run_a.csv; give each run once";
    ran.is_refused_with(said);
}

#[test]
fn readings_in_whole_counts_are_those_that_the_controller_saw() {
    let scratch = Scratch::new();
    limping().logged(&[4; 2]).record(&scratch, "set");
    for run in ["set/run_a.csv", "set/run_b.csv"] {
        with_columns(&scratch, run, 3..11, |counts| format!("{counts:.0}"));
    }
    let found = trace(&scratch, "braitenberg", "set", &[]);
    says(&found, "explained", &["wheel-asymmetry"]);
    assert_eq!(found["logs"]["decide"]["verdict"], "as declared", "{found:#}");
}

#[test]
fn laps_of_another_world_are_refused() {
    let scratch = Scratch::new();
    few_laps(&[3]).record(&scratch, "set");
    scratch.write(
        "set/other.toml",
        world_with("name = \"roduit2007\"", "name = \"other\""),
    );
    let description = scratch
        .read("set/dataset.toml")
        .replace("\"roduit2007\"", "\"other.toml\"");
    scratch.write("set/dataset.toml", description);
    scratch.refuses(
        &[
            "trace",
            "roduit2007",
            "--measured",
            "set",
            "--out",
            "out",
            "--no-cache",
            "--quiet",
        ],
        "set: driven in another world (set/other.toml) than the model's",
    );
}

#[test]
fn the_error_is_that_of_the_set_that_is_held_out() {
    share_signatures("braitenberg");
    let scratch = Scratch::new();
    limping().record(&scratch, "set");
    few_laps(&[6, 4]).record(&scratch, "unseen");
    let found = trace(&scratch, "braitenberg", "set", &["--held-out", "unseen"]);
    says(&found, "explained", &["wheel-asymmetry"]);
    assert_eq!(
        found["error"]["held_out"],
        serde_json::json!(["unseen/a", "unseen/b"])
    );
    let [before, after, floor] =
        ["before", "after", "floor"].map(|key| found["error"][key].as_f64().unwrap());
    assert!(
        after < 0.5 * before && after < 1.5 * floor,
        "{before} {after} {floor}"
    );

    let other = Robot::with(Setting::constant(&LIMP, [LIMPING]));
    let rule_based = Robot {
        controller: ground::rule_based(),
        laps: vec![3],
        ..other
    };
    rule_based.record(&scratch, "others");
    let ran = try_trace(&scratch, "braitenberg", "set", &["--held-out", "others"]);
    assert_eq!(ran.status, Some(2), "{}", ran.stderr);
    let said = "others: driven by the rule-based controller, and the model's is braitenberg";
    assert!(ran.stderr.contains(said), "{}", ran.stderr);
}

/// The files of signatures in a folder.
fn kept(scratch: &Scratch, folder: &str) -> Vec<PathBuf> {
    let entries = fs::read_dir(scratch.path(folder)).unwrap();
    entries.map(|entry| entry.unwrap().path()).collect()
}

#[test]
fn a_broken_file_of_signatures_is_made_anew() {
    let scratch = Scratch::new();
    // Where a log names the effect, those of the declared model are all that is kept.
    limping().logged(&[3; 2]).record(&scratch, "set");
    let traced = || {
        let args = [
            "trace",
            "roduit2007",
            "--measured",
            "set",
            "--out",
            "out",
            "--cache",
            "kept",
            "--json",
        ];
        scratch.json(args)
    };
    let first = traced();
    let [file] = kept(&scratch, "kept").try_into().unwrap();
    let whole = fs::read(&file).unwrap();
    let mut flipped = whole.clone();
    flipped[whole.len() / 2] ^= 1;
    fs::write(&file, flipped).unwrap();
    assert_eq!(traced(), first);
    let mended = fs::read(&file).unwrap();
    assert!(mended == whole, "{} is not mended", file.display());
}
