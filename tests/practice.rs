//! Robots of a separate program, whose departures from the declared model are known: `data/practice`.

use std::path::Path;
use std::sync::OnceLock;

use serde_json::Value;

use crate::support::Scratch;
use crate::tracing::{
    GAINS, holds, names, never_a_listed_name, practice, says, share_signatures, trace, try_trace,
};

/// A trace of a camera-only data set, all of which share their signatures.
fn laps(controller: &str, name: &str) -> Value {
    share_signatures(controller);
    trace(&Scratch::new(), controller, &practice(name), &[])
}

/// A trace of a data set with the robot's log.
fn logged(name: &str) -> Value {
    trace(&Scratch::new(), "braitenberg", &practice(name), &[])
}

/// The error is below what it was and near what chance leaves.
fn helps(trace: &Value) {
    let [before, after, floor] =
        ["before", "after", "floor"].map(|key| trace["error"][key].as_f64().unwrap());
    println!("{before:.5} m before, {after:.5} after, {floor:.5} floor");
    assert!(
        after < before && after < 1.4 * floor,
        "{before} m before, {after} after, {floor} floor"
    );
}

#[test]
fn robots_as_declared_are_faithful() {
    for trace in [
        laps("braitenberg", "faithful"),
        laps("rule-based", "faithful_rule_based"),
        logged("logged_faithful"),
    ] {
        says(&trace, "faithful", &[]);
        assert_eq!(trace["residual"]["significant"], false);
        assert_eq!(trace["error"]["before"], trace["error"]["after"]);
        // It says how large an effect would have had to be.
        let detectable = trace["detectable"].as_array().unwrap();
        let gain = detectable.iter().find(|d| d["name"] == "reading-gain").unwrap();
        let [below, above] = ["below", "above"].map(|side| gain[side].as_f64().unwrap());
        assert!(
            0.95 < below && below < 1.0 && 1.0 < above && above < 1.05,
            "{gain}"
        );
    }
}

#[test]
fn turned_sensors_are_named() {
    let trace = laps("braitenberg", "turned_sensors");
    says(&trace, "explained", &["sensor-rotation"]);
    holds(&trace["effects"][0], "angle_rad", -0.078_727_5, 0.0);
    helps(&trace);
}

#[test]
fn a_stretched_picture_is_named() {
    let trace = laps("braitenberg", "stretched_picture");
    says(&trace, "explained", &["camera-scale"]);
    holds(&trace["effects"][0], "factor", 1.012_07, 1.0);
    helps(&trace);
    // The camera does not change how fast the robot is, but where it is seen.
    let laps = &trace["error"]["laps"][0];
    println!("{laps}");
    let [measured_s, before_s, after_s] =
        ["measured", "before", "after"].map(|key| laps["lap_time_s"][key].as_f64().unwrap());
    assert!((before_s - after_s).abs() < 0.1 && (after_s - measured_s).abs() < 1.0);
    let eq_8 = laps["eq_8"].as_array().unwrap();
    assert_eq!(eq_8.len(), 2);
    for in_modes in eq_8 {
        let [before, after] = ["before", "after"].map(|key| in_modes[key].as_f64().unwrap());
        assert!(after < 0.2 * before, "{laps}");
    }
}

#[test]
fn a_larger_wheel_of_the_rule_based_robot_is_named() {
    let trace = laps("rule-based", "larger_wheel_rule_based");
    says(&trace, "explained", &["wheel-asymmetry"]);
    holds(&trace["effects"][0], "ratio", 1.023_03, 1.0);
}

#[test]
fn a_gain_that_differs_by_run_is_seen_to_and_then_nothing_is_left() {
    share_signatures("braitenberg");
    let (scratch, measured) = (Scratch::new(), practice("gain_by_run"));
    let trace = trace(&scratch, "braitenberg", &measured, &[]);
    assert_eq!(trace["verdict"], "explained", "{trace:#}");
    let claimed = names(&trace);
    assert!(claimed.len() == 1 && GAINS.contains(&claimed[0]), "{claimed:?}");
    assert_eq!(trace["effects"][0]["by"], "run");
    let parameter = &trace["effects"][0]["parameters"][0];
    assert_eq!(parameter["value"].as_array().unwrap().len(), 4, "{parameter}");
    let model = scratch.path("out/model.after.toml");
    let model = model.to_str().unwrap();
    let args = [
        "trace",
        model,
        "--measured",
        &measured,
        "--out",
        "again",
        "--no-cache",
        "--quiet",
    ];
    scratch.done(args);
    let again: Value = serde_json::from_str(&scratch.read("again/trace.json")).unwrap();
    says(&again, "faithful", &[]);
}

#[test]
fn two_effects_at_once_are_both_seen() {
    let trace = laps("braitenberg", "gain_and_shifted_picture");
    assert_eq!(trace["verdict"], "explained", "{trace:#}");
    let effects = trace["effects"].as_array().unwrap();
    assert_eq!(effects.len(), 2, "{trace:#}");
    let shift = effects.iter().position(|e| e["name"] == "camera-offset").unwrap();
    let parameters = effects[shift]["parameters"].as_array().unwrap();
    let dx = parameters.iter().find(|p| p["name"] == "dx_m").unwrap();
    assert!((dx["value"].as_f64().unwrap() - 0.001_04).abs() < 2.5e-4, "{dx}");
    // These laps do not tell a gain from another axle: either comes first, by less than chance, with the other beside it.
    let second = &effects[1 - shift];
    let name = second["name"].as_str().unwrap();
    assert!(name == "axle-length" || GAINS.contains(&name), "{trace:#}");
    let mut said = second["alternatives"].as_array().unwrap().clone();
    said.push(second["name"].clone());
    assert!(said.contains(&"reading-gain".into()), "{trace:#}");
    helps(&trace);
}

#[test]
fn another_gain_of_the_controller_is_read_from_the_log() {
    let trace = logged("logged_low_gain");
    says(&trace, "explained", &["controller-gain"]);
    holds(&trace["effects"][0], "factor", 0.758_462, 1.0);
    assert_eq!(trace["logs"]["decide"]["verdict"], "changed");
    helps(&trace);
}

#[test]
fn a_slippery_area_has_no_name() {
    never_a_listed_name(&logged("logged_slippery_area"), "act");
}

/// The folder of one trace that several tests look at.
fn larger_wheel() -> &'static (Scratch, Value) {
    static TRACED: OnceLock<(Scratch, Value)> = OnceLock::new();
    TRACED.get_or_init(|| {
        let scratch = Scratch::new();
        let set = practice("logged_larger_wheel");
        let found = trace(&scratch, "braitenberg", &set, &["--threads", "2"]);
        (scratch, found)
    })
}

#[test]
fn a_larger_wheel_is_named_from_the_log() {
    let (_, trace) = larger_wheel();
    says(trace, "explained", &["wheel-asymmetry"]);
    holds(&trace["effects"][0], "ratio", 1.007_28, 1.0);
    assert_eq!(trace["logs"]["decide"]["verdict"], "as declared");
    helps(trace);
}

#[test]
fn a_trace_does_not_depend_on_the_threads() {
    let (two, _) = larger_wheel();
    let one = Scratch::new();
    let set = practice("logged_larger_wheel");
    trace(&one, "braitenberg", &set, &["--threads", "1"]);
    let differing = crate::support::differing(&one.results("out"), &two.results("out"));
    assert!(differing.is_empty(), "{differing:?}");
}

#[test]
fn the_model_with_the_effects_drives() {
    let (scratch, _) = larger_wheel();
    let model = scratch.path("out/model.after.toml");
    let drive = [
        "drive",
        model.to_str().unwrap(),
        "--runs",
        "1",
        "--laps",
        "2",
        "--out",
        "laps",
    ];
    let elsewhere = Scratch::new();
    elsewhere.done(drive);
    assert!(elsewhere.path("laps/run_a.csv").exists());
    assert!(
        elsewhere
            .read("laps/model.toml")
            .contains("kind = \"wheel-asymmetry\"")
    );
}

#[test]
fn laps_of_another_controller_are_refused() {
    let scratch = Scratch::new();
    let set = practice("faithful_rule_based");
    let ran = try_trace(&scratch, "braitenberg", &set, &[]);
    let expected = format!(
        "lapwing: {set}: driven by the rule-based controller, and the model's is braitenberg; add --set \
         controller.kind=rule-based\n"
    );
    assert_eq!((ran.status, ran.stderr), (Some(2), expected));
    assert!(!Path::new(&scratch.path("out")).exists());
}
