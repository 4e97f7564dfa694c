//! Recordings of which parts are missing or spoilt: the same answer as without, and a word on what was not used.

use serde_json::Value;

use crate::support::Scratch;
use crate::tracing::{Robot, holds, rewrite, says, share_signatures, trace, with_columns};
use crate::undeclared::{LIMPING, limping};

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
    let missing = ": 10 control steps of this run have no row, 10 of them after this one.";
    assert_eq!(
        remarks(&found)
            .iter()
            .filter(|remark| remark.ends_with(missing))
            .count(),
        2
    );
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
        robot.logged(&[4; 3]).record(&scratch, folder);
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
fn how_a_run_starts_is_not_compared_where_its_file_begins_before_it() {
    const ROWS: usize = 20;
    let scratch = Scratch::new();
    as_declared().logged(&[4; 3]).record(&scratch, "set");
    for run in ["a", "b", "c"] {
        let file = format!("set/run_{run}.csv");
        let text = scratch.read(&file);
        let (header, rows) = text.split_once('\n').unwrap();
        let time_and_rest = |row: &str| {
            let (time, rest) = row.split_once(',').unwrap();
            (time.parse::<f64>().unwrap(), rest.to_owned())
        };
        let (_, first) = time_and_rest(rows);
        let seen: Vec<f64> = first
            .split(',')
            .take(2)
            .map(|field| field.parse().unwrap())
            .collect();
        let mut waiting = format!("{header}\n");
        for row in 0..ROWS {
            let noise_m = 1e-3 * ((row * 7919) % 5) as f64 - 2e-3;
            let position = format!("{:.4},{:.4}", seen[0] + noise_m, seen[1] - noise_m);
            waiting += &format!("{:.3},{position}{}\n", 0.064 * row as f64, ",".repeat(10));
        }
        for row in rows.lines() {
            let (time_s, rest) = time_and_rest(row);
            waiting += &format!("{:.3},{rest}\n", time_s + 0.064 * ROWS as f64);
        }
        scratch.write(&file, waiting);
    }
    let found = trace(&scratch, "braitenberg", "set", &[]);
    says(&found, "faithful", &[]);
    let said = "Runs set/a, set/b, set/c: the robot still stands where the file begins";
    assert!(
        remarks(&found).iter().any(|remark| remark.starts_with(said)),
        "{found:#}"
    );
    assert!(found["residual"]["numbers"]["start"].is_null(), "{found:#}");
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
        robot.logged(&[4; 3]).record(&scratch, folder);
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
    as_declared().logged(&[4; 3]).record(&scratch, "set");
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
    let robot = as_declared().logged(&[5; 3]);
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
