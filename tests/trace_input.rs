//! Data that are short, broken, or not the model's: a clear error or a clear statement, never a wrong name.

use std::fs;
use std::ops::Range;
use std::path::PathBuf;

use serde_json::Value;
use sim::{Controller, Pattern, Setting};

use crate::ground;
use crate::support::{Scratch, world_with};
use crate::tracing::{Robot, holds, says, share_signatures, trace, try_trace};
use crate::undeclared::{LIMP, LIMPING, limping};

/// A robot that limps, of which little is measured.
fn few_laps(laps: &[usize]) -> Robot {
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
    assert!(scratch.read("out/report.html").contains("One run only"));
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
        "run set/b has 2 whole laps after its first: at least 3 in every run are needed to trace anything; leave the \
         run out of `runs` in dataset.toml, or measure it again",
    );
}

/// Every row of a run's file, changed or left out.
fn rewrite(scratch: &Scratch, run: &str, change: impl Fn(usize, Vec<String>) -> Option<Vec<String>>) {
    let text = scratch.read(run);
    let mut lines = text.lines();
    let mut rewritten = lines.next().unwrap().to_owned() + "\n";
    for (row, line) in lines.enumerate() {
        let fields = line.split(',').map(str::to_owned).collect();
        if let Some(fields) = change(row, fields) {
            rewritten += &(fields.join(",") + "\n");
        }
    }
    scratch.write(run, rewritten);
}

#[test]
fn a_log_with_gaps_is_traced() {
    let scratch = Scratch::new();
    limping().logged(&[6; 3]).record(&scratch, "set");
    let emptied = |fields: &mut [String]| fields.iter_mut().for_each(String::clear);
    for (run, first) in [("set/run_a.csv", 700), ("set/run_b.csv", 1900)] {
        rewrite(&scratch, run, |row, mut fields| {
            match row.checked_sub(first)? {
                0..30 => emptied(&mut fields[1..3]),
                300..340 => emptied(&mut fields[3..11]),
                600..650 => emptied(&mut fields[11..13]),
                900..910 => return None,
                _ => {}
            }
            Some(fields)
        });
    }
    let found = trace(&scratch, "braitenberg", "set", &[]);
    says(&found, "explained", &["wheel-asymmetry"]);
    holds(&found["effects"][0], "ratio", LIMPING, 1.0);
}

/// The robot that the model declares.
fn as_declared() -> Robot {
    Robot {
        effects: Vec::new(),
        ..limping()
    }
}

/// The remarks of a trace.
fn remarks(found: &Value) -> Vec<&str> {
    let remarks = found["remarks"].as_array().unwrap();
    remarks.iter().map(|remark| remark.as_str().unwrap()).collect()
}

#[test]
fn a_robot_that_was_not_always_seen_is_no_other_robot() {
    let scratch = Scratch::new();
    let not_seen = |fields: &mut [String]| fields[1..3].iter_mut().for_each(String::clear);
    for (folder, robot) in [("faithful", as_declared()), ("limping", limping())] {
        robot.logged(&[5; 3]).record(&scratch, folder);
        for run in ["a", "b", "c"] {
            // A second and more in every eight, elsewhere in each lap, and each run.
            let first = 17 * usize::from(run.as_bytes()[0]);
            rewrite(&scratch, &format!("{folder}/run_{run}.csv"), |row, mut fields| {
                if (row + first) % 127 < 20 && row > 20 {
                    not_seen(&mut fields);
                }
                Some(fields)
            });
        }
    }
    let found = trace(&scratch, "braitenberg", "faithful", &[]);
    says(&found, "faithful", &[]);
    for run in ["a", "b", "c"] {
        let said = format!("Run faithful/{run}: the camera did not see the robot on 1");
        assert!(
            remarks(&found).iter().any(|remark| remark.starts_with(&said)),
            "{found:#}"
        );
    }
    let error = |key: &str| found["error"][key].as_f64().unwrap();
    assert!(error("before") < 1.5 * error("floor"), "{}", found["error"]);
    let found = trace(&scratch, "braitenberg", "limping", &[]);
    says(&found, "explained", &["wheel-asymmetry"]);
    holds(&found["effects"][0], "ratio", LIMPING, 1.0);
}

#[test]
fn laps_in_which_the_robot_was_out_of_sight_are_set_aside() {
    let scratch = Scratch::new();
    as_declared().logged(&[6; 3]).record(&scratch, "set");
    let description = scratch.read("set/dataset.toml").replace("laps = 6", "laps = 5");
    scratch.write("set/dataset.toml", description);
    rewrite(&scratch, "set/run_b.csv", |row, mut fields| {
        if (3000..3500).contains(&row) {
            fields[1..3].iter_mut().for_each(String::clear);
        }
        Some(fields)
    });
    let found = trace(&scratch, "braitenberg", "set", &[]);
    says(&found, "faithful", &[]);
    let said = "set/run_b.csv:3001: from here on the robot is not seen for 32.1 s: lap ";
    assert!(remarks(&found)[0].starts_with(said), "{found:#}");
}

#[test]
fn values_that_no_robot_writes_are_taken_as_missing_and_said() {
    let scratch = Scratch::new();
    as_declared().logged(&[5; 2]).record(&scratch, "set");
    // Columns 3 to 10 are the readings, 11 and 12 the commands.
    let spoilt = [
        (1000, 5, "99999", "ps2 is 99999, which this robot cannot write"),
        (1500, 5, "-50", "ps2 is -50, which this robot cannot write"),
        (2500, 11, "5.0", "left_m_s is 5, which this robot cannot write"),
        (
            2000,
            7,
            "3000",
            "ps4 is 3000, far from what it is in the rows before and after",
        ),
        (
            3000,
            12,
            "-0.1",
            "the command does not follow from the readings as those of the other rows do",
        ),
    ];
    rewrite(&scratch, "set/run_b.csv", |row, mut fields| {
        for (_, column, value, _) in spoilt.iter().filter(|(at, ..)| *at == row) {
            fields[*column] = (*value).to_owned();
        }
        Some(fields)
    });
    let found = trace(&scratch, "braitenberg", "set", &[]);
    says(&found, "faithful", &[]);
    let expected: Vec<String> = (spoilt.iter())
        .map(|(row, _, _, why)| format!("set/run_b.csv:{}: {why}; taken as missing", row + 2))
        .collect();
    assert_eq!(remarks(&found), expected);
}

/// A log as a robot with a bad radio, a cheap clock and a camera that has bad moments leaves it.
fn damage(scratch: &Scratch, folder: &str) {
    // Times that jitter by up to 9 ms.
    rewrite(scratch, &format!("{folder}/run_a.csv"), |row, mut fields| {
        let time_s: f64 = fields[0].parse().unwrap();
        let jitter_s = 1e-3 * ((row * 7919) % 19) as f64 - 9e-3;
        fields[0] = format!("{:.3}", 1.0 + time_s + jitter_s);
        Some(fields)
    });
    // One row in 75 is missing.
    rewrite(scratch, &format!("{folder}/run_b.csv"), |row, fields| {
        (row % 75 != 74).then_some(fields)
    });
    // Columns 1 and 2 are the position, 3 to 10 the readings, 11 and 12 the commands.
    let mut frozen = Vec::new();
    let mut frozen_at = |row: usize, fields: &mut [String]| match row {
        2000 => frozen = fields[1..3].to_vec(),
        2001..2020 => fields[1..3].clone_from_slice(&frozen),
        _ => {}
    };
    let text = scratch.read(&format!("{folder}/run_c.csv"));
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    for (row, line) in lines.iter_mut().skip(1).enumerate() {
        let mut fields: Vec<String> = line.split(',').map(str::to_owned).collect();
        frozen_at(row, &mut fields);
        match row {
            1000..=1002 => fields[6] = "4095".to_owned(),
            _ if row % 400 == 399 => fields[11] = "0.01234".to_owned(),
            _ if row % 1000 == 500 => {
                fields[1] = format!("{:.4}", fields[1].parse::<f64>().unwrap() + 0.03);
            }
            _ => {}
        }
        *line = fields.join(",");
    }
    scratch.write(&format!("{folder}/run_c.csv"), lines.join("\n") + "\n");
}

#[test]
fn a_bad_radio_clock_and_camera_are_no_effects() {
    let scratch = Scratch::new();
    for (folder, robot) in [("faithful", as_declared()), ("limping", limping())] {
        robot.logged(&[5; 3]).record(&scratch, folder);
        damage(&scratch, folder);
    }
    let found = trace(&scratch, "braitenberg", "faithful", &[]);
    says(&found, "faithful", &[]);
    for said in [
        "run_c.csv:1002: ps3 is 4095, far from what it is in the rows before and after; taken as missing",
        "run_c.csv:401: the command does not follow from the readings as those of the other rows do; taken as missing, as ",
        "run_c.csv:2003: the camera sees the robot where it saw it in the row before, to the last digit; taken as not seen, as \
         18 more of this run",
        "run_c.csv:502: the robot is seen at ",
    ] {
        let said = format!("faithful/{said}");
        assert!(
            remarks(&found).iter().any(|remark| remark.starts_with(&said)),
            "{said}: {:#}",
            found["remarks"]
        );
    }
    let found = trace(&scratch, "braitenberg", "limping", &[]);
    says(&found, "explained", &["wheel-asymmetry"]);
    holds(&found["effects"][0], "ratio", LIMPING, 1.0);
}

#[test]
fn positions_in_millimetres_are_no_noise_of_the_robot() {
    let scratch = Scratch::new();
    as_declared().logged(&[5; 3]).record(&scratch, "set");
    for run in ["a", "b", "c"] {
        with_columns(&scratch, &format!("set/run_{run}.csv"), 1..3, |x_m| {
            format!("{x_m:.3}")
        });
    }
    let found = trace(&scratch, "braitenberg", "set", &[]);
    says(&found, "faithful", &[]);
    assert_eq!(
        remarks(&found),
        ["set: positions are written to 1 mm: the simulated camera is as much noisier."]
    );
}

#[test]
fn what_is_held_out_is_seen_through_its_own_holes() {
    let scratch = Scratch::new();
    let robot = as_declared().logged(&[8; 3]);
    robot.record(&scratch, "all");
    let description = scratch.read("all/dataset.toml");
    for (set, runs) in [("set", ["a", "b"].as_slice()), ("held_out", &["c"])] {
        let description = description.replace("[\"a\", \"b\", \"c\"]", &format!("{runs:?}"));
        scratch.write(&format!("{set}/dataset.toml"), description);
        for run in runs {
            let run = format!("run_{run}.csv");
            scratch.write(&format!("{set}/{run}"), scratch.read(&format!("all/{run}")));
        }
    }
    rewrite(&scratch, "held_out/run_c.csv", |row, mut fields| {
        if row % 150 < 40 && row > 40 {
            fields[1..3].iter_mut().for_each(String::clear);
        }
        Some(fields)
    });
    let found = trace(&scratch, "braitenberg", "set", &["--held-out", "held_out"]);
    says(&found, "faithful", &[]);
    let error = |key: &str| found["error"][key].as_f64().unwrap();
    // Without the holes it would be more than twice as far.
    assert!(error("before") < 1.6 * error("floor"), "{}", found["error"]);
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

/// A log whose columns from `first` on are multiplied: no controller gives those commands, and nothing is named.
fn in_other_units(columns: Range<usize>, factor: f64) -> Value {
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
    assert!(scratch.read("out/report.html").contains("look at the units"));
    found
}

#[test]
fn speeds_in_millimetres_are_no_controllers() {
    in_other_units(11..13, 1000.0);
}

#[test]
fn readings_as_shares_of_full_scale_are_no_controllers() {
    in_other_units(3..11, 1.0 / 4095.0);
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
        "set/run_a.csv: 0 whole laps, and the first is not analysed: at least two are needed; check the world, the \
         driving direction ([declared] run.direction in dataset.toml) and the unit of x_m and y_m",
    );
}

/// Every position, reading or time of a file in these columns, changed.
fn with_columns(scratch: &Scratch, run: &str, columns: Range<usize>, change: impl Fn(f64) -> String) {
    rewrite(scratch, run, |_, mut fields| {
        for field in &mut fields[columns.clone()] {
            *field = change(field.parse().unwrap());
        }
        Some(fields)
    });
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
    assert!(
        ran.status == Some(2) && ran.stderr.contains(said),
        "{}",
        ran.stderr
    );
}

#[test]
fn a_camera_that_sees_every_other_control_step_is_enough() {
    let scratch = Scratch::new();
    limping().logged(&[4; 3]).record(&scratch, "set");
    for run in ["a", "b", "c"] {
        rewrite(&scratch, &format!("set/run_{run}.csv"), |row, mut fields| {
            if row % 2 == 1 {
                fields[1..3].iter_mut().for_each(String::clear);
            }
            Some(fields)
        });
    }
    let found = trace(&scratch, "braitenberg", "set", &[]);
    says(&found, "explained", &["wheel-asymmetry"]);
    holds(&found["effects"][0], "ratio", LIMPING, 1.0);
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
    assert!(
        ran.status == Some(2) && ran.stderr.contains(said),
        "{}",
        ran.stderr
    );
}

#[test]
fn a_sighting_where_no_robot_gets_is_set_aside_and_said() {
    share_signatures("braitenberg");
    let scratch = Scratch::new();
    limping().record(&scratch, "set");
    rewrite(&scratch, "set/run_b.csv", |row, mut fields| {
        if row == 3000 {
            fields[1] = "57.3".to_owned();
        }
        Some(fields)
    });
    let found = trace(&scratch, "braitenberg", "set", &[]);
    says(&found, "explained", &["wheel-asymmetry"]);
    holds(&found["effects"][0], "ratio", LIMPING, 1.0);
    let remark = found["remarks"][0].as_str().unwrap();
    assert!(
        remark.contains("set/run_b.csv:3002: the robot is seen at (57.3, ")
            && remark.ends_with("taken as not seen"),
        "{remark}"
    );
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
fn sets_with_different_declarations_are_traced_together() {
    let scratch = Scratch::new();
    let robot = few_laps(&[4; 2]);
    robot.record(&scratch, "set");
    let reactive = Robot {
        controller: Controller::Braitenberg {
            speed_m_s: 0.05,
            gain_per_count: 0.001,
        },
        declared: "controller.gain_per_count = 0.001",
        ..robot
    };
    reactive.record(&scratch, "reactive");
    let found = trace(&scratch, "braitenberg", "set", &["--measured", "reactive"]);
    says(&found, "explained", &["wheel-asymmetry"]);
    holds(&found["effects"][0], "ratio", LIMPING, 1.0);
    let held_out = serde_json::json!(["set/a", "set/b", "reactive/a", "reactive/b"]);
    assert_eq!(found["error"]["held_out"], held_out);

    // What is held out of the second set is held against simulations of the second declaration.
    let longer = Robot {
        laps: vec![5; 2],
        ..reactive
    };
    longer.record(&scratch, "unseen");
    let held_out = ["--measured", "reactive", "--held-out", "unseen"];
    let found = trace(&scratch, "braitenberg", "set", &held_out);
    assert_eq!(
        found["error"]["held_out"],
        serde_json::json!(["unseen/a", "unseen/b"])
    );
    let gates = scratch.read("out/gates.csv");
    let rows: Vec<&str> = gates.lines().skip(1).collect();
    assert!(
        rows.len() == 100 && rows.iter().all(|row| row.starts_with("reactive,")),
        "{gates}"
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
    few_laps(&[3]).record(&scratch, "set");
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
    for broken in [&flipped, &whole[..whole.len() / 2], &[]] {
        fs::write(&file, broken).unwrap();
        assert_eq!(traced(), first);
        assert!(
            fs::read(&file).unwrap() == whole,
            "{} is not mended",
            file.display()
        );
    }
}
