//! Logs of robots with several listed effects at once, or with one whose size is hard to find.

use serde_json::Value;
use sim::{Controller, Pattern, Setting, find};

use crate::ground;
use crate::support::Scratch;
use crate::tracing::{Robot, explained_in_logs, holds, says, trace};

fn effect(name: &str, values: &[f64]) -> Setting {
    Setting::constant(find(name).unwrap(), values)
}

/// The answer to the logs of a reactive robot with these effects, which has to be these and nothing else.
fn named(effects: Vec<Setting>, expected: &[&str]) -> Value {
    named_with(ground::braitenberg(), effects, expected)
}

/// The same of a robot with any controller.
fn named_with(controller: Controller, effects: Vec<Setting>, expected: &[&str]) -> Value {
    let first = effects[0].clone();
    let robot = Robot {
        controller,
        effects,
        ..Robot::with(first).logged(&[3; 3])
    };
    explained_in_logs(&robot, expected)
}

#[test]
fn a_light_that_goes_by_run_beside_a_lower_gain() {
    let counts = [20.0, 8.0, 14.0];
    let azimuths_rad = [0.3, 1.2, -2.0];
    let light = Setting {
        spec: find("directional-light").unwrap(),
        pattern: Pattern::ByRun(
            (counts.iter().zip(azimuths_rad))
                .map(|(&c, a)| vec![c, a])
                .collect(),
        ),
    };
    let effects = vec![light, effect("reading-gain", &[0.9])];
    let found = named(effects, &["directional-light", "reading-gain"]);
    let light = &found["effects"][0];
    assert_eq!(light["by"], "run", "{found:#}");
    let values = light["parameters"][0]["value"].as_array().unwrap().iter();
    for (value, truth) in values.zip(counts) {
        assert!((value.as_f64().unwrap() - truth).abs() < 0.5, "{found:#}");
    }
    holds(&found["effects"][1], "gain", 0.9, 1.0);
}

/// Between walls that are cut to suit the first of them alone, each of these has another size, and a bump is left.
#[test]
fn a_wall_that_reflects_more_beside_sensors_that_lag() {
    let effects = vec![
        effect("outer-wall-reflectance", &[1.42]),
        effect("sensor-lag", &[0.2]),
    ];
    let found = named(effects, &["outer-wall-reflectance", "sensor-lag"]);
    holds(&found["effects"][0], "factor", 1.42, 1.0);
    holds(&found["effects"][1], "time_s", 0.2, 0.0);
}

/// The second gains a fiftieth of what the first does, and the third less than a hundredth.
#[test]
fn three_effects_of_different_weight() {
    let effects = vec![
        effect("reading-gain", &[0.85]),
        effect("axle-length", &[1.04]),
        effect("camera-offset", &[0.001, 0.0]),
    ];
    let found = named(effects, &["reading-gain", "camera-offset", "axle-length"]);
    holds(&found["effects"][0], "gain", 0.85, 1.0);
    holds(&found["effects"][1], "dx_m", 0.001, 0.0);
    holds(&found["effects"][2], "factor", 1.04, 1.0);
}

#[test]
fn less_noise_beside_a_reading_that_falls_with_incidence() {
    let effects = vec![
        effect("incidence-falloff", &[0.75]),
        effect("reading-noise", &[0.56]),
    ];
    let found = named(effects, &["incidence-falloff", "reading-noise"]);
    let noise = found["effects"][1]["parameters"][0]["value"].as_f64().unwrap();
    assert!((noise - 0.56).abs() < 0.02, "{found:#}");
}

/// Of 10.76 mm/s the robot's usual speed is four and a half: with .25 mm/s more or less nearly all speeds are rounded otherwise.
#[test]
fn speeds_in_steps_that_leave_the_usual_one_between_two() {
    let found = named(vec![effect("speed-step", &[0.010_764_5])], &["speed-step"]);
    holds(&found["effects"][0], "speed_m_s", 0.010_764_5, 0.0);
}

/// Beside the scale of the wheels a wall that reflects less stands for the distances, and leaves most of what one sensor does.
#[test]
fn three_effects_of_which_another_stood_for_one() {
    let effects = vec![
        effect("distance-scale", &[0.93]),
        effect("wheel-scale", &[1.05]),
        effect("one-sensor-gain", &[2.0, 0.8]),
    ];
    let found = named(effects, &["wheel-scale", "one-sensor-gain", "distance-scale"]);
    holds(&found["effects"][0], "factor", 1.05, 1.0);
    holds(&found["effects"][1], "gain", 0.8, 1.0);
    holds(&found["effects"][2], "scale", 0.93, 1.0);
}

/// A wall that reflects more is found second, and does nothing beside the third: that leaves room for one more.
#[test]
fn an_effect_that_another_makes_needless() {
    let effects = vec![
        effect("ambient-offset", &[25.0]),
        effect("crosstalk", &[0.15]),
        effect("turn-scrub", &[0.06]),
    ];
    let found = named(effects, &["ambient-offset", "crosstalk", "turn-scrub"]);
    holds(&found["effects"][0], "counts", 25.0, 0.0);
    holds(&found["effects"][1], "fraction", 0.15, 0.0);
    holds(&found["effects"][2], "fraction", 0.06, 0.0);
}

/// Beside the first, more slip is more likely than either of the others alone.
#[test]
fn wheels_that_are_off_in_two_ways_do_not_slip_more() {
    let effects = vec![
        effect("response-exponent", &[1.0231]),
        effect("wheel-asymmetry", &[0.9794]),
        effect("wheel-scale", &[1.0154]),
    ];
    let expected = ["response-exponent", "wheel-asymmetry", "wheel-scale"];
    let found = named_with(ground::rule_based(), effects, &expected);
    holds(&found["effects"][1], "ratio", 0.9794, 1.0);
    holds(&found["effects"][2], "factor", 1.0154, 1.0);
}

/// The logs find a bump five units more likely, by readings that no edge spoils; the laps contradict it.
#[test]
fn laps_tell_a_patch_from_a_bump_that_logs_do_not() {
    let scratch = Scratch::new();
    let patch = "world = \"roduit2007\"\n[[effect]]\nkind = \"reflectance-patch\"\nwall = \"inner\"\nposition = 0.224331\n\
                 length_m = 0.0925242\nfactor = 1.1957\n";
    scratch.write("patch.toml", patch);
    let drive = "drive patch.toml --runs 4 --laps 5 --log --seed 3 --quiet --out set";
    scratch.done(drive.split(' '));
    let found = trace(&scratch, "braitenberg", "set", &[]);
    says(&found, "explained", &["reflectance-patch"]);
    assert_eq!(found["logs"]["confirmed_by_laps"], true, "{found:#}");
    let told = serde_json::json!([["reflectance-patch"], ["wall-bump"]]);
    assert_eq!(found["alternative_sets"], told, "{found:#}");
    holds(&found["effects"][0], "factor", 1.1957, 1.0);
}
