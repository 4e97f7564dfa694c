//! Several data sets together, with logs and without, declared otherwise.

use serde_json::Value;
use sim::{Controller, Pattern, Setting};

use crate::support::Scratch;
use crate::trace_input::few_laps;
use crate::tracing::{Robot, holds, rewrite, says, trace, try_trace};
use crate::undeclared::{LIMPING, limping};

/// The same robot with twice the gain, and a data set that says so.
fn reactive(robot: Robot) -> Robot {
    Robot {
        controller: Controller::Braitenberg {
            speed_m_s: 0.05,
            gain_per_count: 0.001,
        },
        declared: "controller.gain_per_count = 0.001",
        ..robot
    }
}

#[test]
fn sets_with_different_declarations_are_traced_together() {
    let scratch = Scratch::new();
    let robot = few_laps(&[4; 2]);
    robot.record(&scratch, "set");
    let reactive = reactive(robot);
    reactive.record(&scratch, "reactive");
    let found = trace(&scratch, "braitenberg", "set", &["--measured", "reactive"]);
    says(&found, "explained", &["wheel-asymmetry"]);
    holds(&found["effects"][0], "ratio", LIMPING, 1.0);
    let held_out = serde_json::json!(["set/a", "set/b", "reactive/a", "reactive/b"]);
    assert_eq!(found["error"]["held_out"], held_out);
}

#[test]
fn what_is_held_out_is_held_against_the_declaration_that_it_has() {
    let scratch = Scratch::new();
    let robot = limping().logged(&[3; 2]);
    robot.record(&scratch, "set");
    let reactive = reactive(robot);
    reactive.record(&scratch, "reactive");
    // The way round is the world's, said or not.
    let longer = Robot {
        laps: vec![5; 2],
        declared: "controller.gain_per_count = 0.001\nrun.direction = \"clockwise\"",
        ..reactive
    };
    longer.record(&scratch, "unseen");
    let held_out = ["--measured", "reactive", "--held-out", "unseen"];
    let found = trace(&scratch, "braitenberg", "set", &held_out);
    assert_eq!(
        found["error"]["held_out"],
        serde_json::json!(["unseen/a", "unseen/b"])
    );
    let [before, after, floor] =
        ["before", "after", "floor"].map(|key| found["error"][key].as_f64().unwrap());
    // The other declaration's laps are elsewhere.
    assert!(after < 1.6 * floor && before > 2.0 * after, "{found:#}");
    let gates = scratch.read("out/gates.csv");
    let rows: Vec<&str> = gates.lines().skip(1).collect();
    assert!(
        rows.len() == 100 && rows.iter().all(|row| row.starts_with("unseen,")),
        "{gates}"
    );
}

#[test]
fn logs_of_sets_with_different_declarations_are_used_together() {
    let scratch = Scratch::new();
    let robot = limping().logged(&[3; 2]);
    robot.record(&scratch, "set");
    let reactive = reactive(robot.clone());
    reactive.record(&scratch, "reactive");
    few_laps(&[4]).record(&scratch, "seen");
    let with = |more: &[&str]| {
        let more: Vec<&str> = more.iter().flat_map(|set| ["--measured", set]).collect();
        let found = trace(&scratch, "braitenberg", "set", &more);
        says(&found, "explained", &["wheel-asymmetry"]);
        holds(&found["effects"][0], "ratio", LIMPING, 1.0);
        let steps = found["logs"]["control_steps"].as_u64().unwrap();
        let [low, high] =
            ["low", "high"].map(|key| found["effects"][0]["parameters"][0][key].as_f64().unwrap());
        (steps, high - low, found["remarks"].clone())
    };
    let (alone, wide, _) = with(&[]);
    let (together, narrow, remarks) = with(&["reactive", "seen"]);
    assert!(
        together > 19 * alone / 10 && narrow < 0.9 * wide,
        "{together} {alone} {narrow} {wide}"
    );
    assert!(!remarks.to_string().contains("not used"), "{remarks}");

    // Other walls are other rays.
    let finer = Robot {
        declared: "controller.gain_per_count = 0.001\nwall.max_error_m = 0.0049",
        ..reactive
    };
    finer.record(&scratch, "finer");
    let (steps, _, remarks) = with(&["finer"]);
    assert_eq!(steps, alone);
    let said = "finer: 2 logs not used; they are declared with other walls, another body";
    assert!(remarks.to_string().contains(said), "{remarks}");
}

#[test]
fn sets_with_other_gates_are_refused() {
    let scratch = Scratch::new();
    few_laps(&[3]).record(&scratch, "set");
    let reactive = Robot {
        declared: "controller.gain_per_count = 0.001\nrun.gates = 50",
        ..reactive(few_laps(&[3]))
    };
    reactive.record(&scratch, "reactive");
    let ran = try_trace(&scratch, "braitenberg", "set", &["--measured", "reactive"]);
    let said =
        "reactive: declares 50 gates (run.gates), and set has 100: laps are compared at the same gates";
    ran.is_refused_with(said);
}

#[test]
fn a_size_of_a_log_is_not_that_of_the_run_that_it_is_judged_by() {
    let scratch = Scratch::new();
    let gains = Setting {
        spec: sim::find("controller-gain").unwrap(),
        pattern: Pattern::ByRun(vec![vec![0.8], vec![1.3]]),
    };
    Robot::with(gains).logged(&[4; 2]).record(&scratch, "set");
    let found = trace(&scratch, "braitenberg", "set", &[]);
    says(&found, "explained", &["controller-gain"]);
    assert_eq!(found["effects"][0]["by"], "run");
    // Each run has the other one's gain then.
    let [after, floor] = ["after", "floor"].map(|key| found["error"][key].as_f64().unwrap());
    assert!(after > 1.5 * floor, "{after} {floor}");

    // Of one log among several runs it is.
    few_laps(&[4]).record(&scratch, "seen");
    limping().logged(&[4]).record(&scratch, "logged");
    let first = scratch.read("seen/run_a.csv");
    let later: Vec<&str> = first.lines().filter(|line| !line.starts_with("0.000,")).collect();
    scratch.write("seen/run_a.csv", later.join("\n"));
    let found = trace(&scratch, "braitenberg", "logged", &["--measured", "seen"]);
    let said = "One log only: the error after on run logged/a is that of the very run that was fitted.";
    assert!(
        found["remarks"].as_array().unwrap().contains(&said.into()),
        "{found:#}"
    );
}

fn by_run(name: &str, values: &[&[f64]]) -> Setting {
    Setting {
        spec: sim::find(name).unwrap(),
        pattern: Pattern::ByRun(values.iter().map(|values| values.to_vec()).collect()),
    }
}

/// The value of an effect's first parameter in each run.
fn sizes(found: &Value) -> Vec<f64> {
    let values = found["effects"][0]["parameters"][0]["value"].as_array().unwrap();
    values.iter().map(|value| value.as_f64().unwrap()).collect()
}

#[test]
fn a_size_by_run_is_known_where_there_are_logs_and_judged_by_their_laps() {
    let scratch = Scratch::new();
    // Of a light that is out its direction is not known.
    let lit = by_run("directional-light", &[&[20.0, 1.0], &[0.0, 1.0]]);
    Robot::with(lit).logged(&[4; 2]).record(&scratch, "set");
    let near = |found: &Value, expected: &[f64]| {
        says(found, "explained", &["directional-light"]);
        assert_eq!(found["effects"][0]["by"], "run");
        let off = sizes(found)
            .into_iter()
            .zip(expected)
            .map(|(size, expected)| (size - expected).abs());
        assert!(off.fold(0.0, f64::max) < 0.5, "{found:#}");
    };
    near(&trace(&scratch, "braitenberg", "set", &[]), &[20.0, 0.0]);

    // Of runs without a log no size is known: their laps, with other ones, do not contradict.
    let more = by_run("directional-light", &[&[35.0, 1.0], &[5.0, 1.0]]);
    let more = Robot {
        laps: vec![5; 2],
        ..Robot::with(more)
    };
    more.record(&scratch, "seen");
    let found = trace(&scratch, "braitenberg", "set", &["--measured", "seen"]);
    near(&found, &[20.0, 0.0, 10.0, 10.0]);
    let said = "seen has no logs: its laps judge what the other data sets' logs say, unless sizes go by run.";
    let by_run = "The size of directional-light differs from run to run: that of a run which is held out is not known, and the mean of \
                  the others stands for it. The error after is that of such a run and may be larger than before; model.after.toml has \
                  each run's own size.";
    assert_eq!(found["remarks"], serde_json::json!([said, by_run]));
}

#[test]
fn a_log_that_no_controller_gives_is_named() {
    let scratch = Scratch::new();
    limping().logged(&[4; 2]).record(&scratch, "set");
    rewrite(&scratch, "set/run_b.csv", |_, mut fields| {
        fields[3..11].reverse();
        Some(fields)
    });
    let found = trace(&scratch, "braitenberg", "set", &[]);
    says(&found, "unexplained", &[]);
    let said = found["remarks"][0].as_str().unwrap();
    assert!(
        said.starts_with("No controller of this kind gives the logged commands of run set/b from the logged readings: 100.0 %"),
        "{said}"
    );
}

#[test]
fn sensors_that_leap_at_their_range_and_have_no_noise_there_are_traced_by_logs() {
    let scratch = Scratch::new();
    let kind = ["--set", "sensor.kind=original"];
    scratch.drive(2, 3, "set", &[&kind[..], &["--log"]].concat());
    let found = trace(&scratch, "braitenberg", "set", &kind);
    says(&found, "faithful", &[]);
    assert!(
        found["logs"]["control_steps"].as_u64().unwrap() > 5000,
        "{found:#}"
    );
}

#[test]
fn data_sets_of_one_name_are_told_apart() {
    let scratch = Scratch::new();
    limping().logged(&[3; 2]).record(&scratch, "set");
    limping().logged(&[4; 2]).record(&scratch, "other/set");
    let description = scratch.read("other/set/dataset.toml").replace("other/set", "set");
    scratch.write("other/set/dataset.toml", description);
    let found = trace(&scratch, "braitenberg", "set", &["--measured", "other/set"]);
    let held_out = serde_json::json!(["set/a", "set/b", "set (2)/a", "set (2)/b"]);
    assert_eq!(found["error"]["held_out"], held_out);
}

#[test]
fn a_model_whose_effect_goes_by_run_has_a_size_for_each_run_of_all_sets() {
    let scratch = Scratch::new();
    let lit = by_run("directional-light", &[&[30.0, 1.0], &[0.0, 1.0]]);
    Robot::with(lit).logged(&[4; 2]).record(&scratch, "set");
    let model = "world = \"roduit2007\"\n[[effect]]\nkind = \"directional-light\"\nby = \"run\"\ncounts = [30, 0]\n\
                 azimuth_rad = [1, 1]\n";
    scratch.write("lit.toml", model);
    let args = [
        "trace",
        "lit.toml",
        "--measured",
        "set",
        "--no-cache",
        "--quiet",
        "--out",
    ];
    scratch.done([args.as_slice(), &["out"]].concat());
    let found: Value = serde_json::from_str(&scratch.read("out/trace.json")).unwrap();
    says(&found, "faithful", &[]);
    let [before, floor] = ["before", "floor"].map(|key| found["error"][key].as_f64().unwrap());
    assert!((0.6..1.6).contains(&(before / floor)), "{before} {floor}");

    // It is driven as often as it has sizes.
    scratch.done(["drive", "lit.toml", "--laps", "1", "--out", "driven"]);
    assert!(scratch.path("driven/run_b.csv").exists() && !scratch.path("driven/run_c.csv").exists());

    let other = by_run("directional-light", &[&[10.0, 1.0], &[5.0, 1.0]]);
    Robot::with(other).logged(&[5; 2]).record(&scratch, "more");
    scratch.refuses(
        &[args.as_slice(), &["out2", "--measured", "more"]].concat(),
        "lit.toml:4: effect.0.by: directional-light has values by run for 2 of them, and there are more; give as many values, or drive 2",
    );
}
