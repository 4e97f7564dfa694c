use serde_json::json;

use super::*;
use crate::labels::Level;
use crate::labels::{Controller, Truth};

fn outcome(kind: Kind, effects: &[&str], stages: &[&str], document: Value) -> Outcome {
    Outcome {
        label: Label {
            name: "x".into(),
            level: Level::L1,
            kind,
            controller: Controller::Braitenberg,
            effects: effects.iter().map(|&name| name.into()).collect(),
            by_run: false,
            stages: stages.iter().map(|&name| name.into()).collect(),
            parameters: Vec::new(),
        },
        trace: Trace::new(&document).unwrap(),
        timing: Timing {
            seconds: 1.0,
            build: String::new(),
        },
        truth_m: Some(0.0004),
    }
}

#[test]
fn a_twin_counts_in_its_class_and_not_by_name() {
    let answer = json!({
        "verdict": "explained",
        "residual": {"stage": "sense", "p": 0.0},
        "effects": [{"name": "distance-scale", "stage": "sense", "alternatives": ["reading-gain"]}],
        "alternative_sets": [["distance-scale"], ["reading-gain"]],
    });
    let found = outcome(Kind::Single, &["reading-gain"], &["sense"], answer.clone());
    assert!(found.in_class() && !found.exact() && found.in_reported() && found.stage_right());
    assert_eq!(found.reported().len(), 2);
    let other = outcome(Kind::Single, &["axle-length"], &["act"], answer);
    assert!(!other.in_class() && !other.class_in_reported() && !other.right());
}

#[test]
fn a_faint_effect_is_below_detection_only_if_the_omnibus_misses_it_too() {
    let faithful = |p: f64| {
        outcome(
            Kind::Single,
            &["slip-level"],
            &["act"],
            json!({"verdict": "faithful", "residual": {"stage": null, "p": p}}),
        )
    };
    assert!(faithful(0.4).below_detection() && faithful(0.4).right());
    assert!(!faithful(0.004).below_detection() && !faithful(0.004).right());
}

#[test]
fn outside_effects_are_refused_or_put_in_their_stage() {
    let outside = |answer| outcome(Kind::Outside, &["stalls"], &["act"], answer).refused_or_characterised();
    assert!(outside(json!({"verdict": "unexplained", "effects": []})));
    assert!(outside(
        json!({"verdict": "explained", "effects": [{"name": "unlisted", "stage": "act"}]})
    ));
    assert!(!outside(
        json!({"verdict": "explained", "effects": [{"name": "unlisted", "stage": "sense"}]})
    ));
    assert!(!outside(
        json!({"verdict": "explained", "effects": [{"name": "slip-level", "stage": "act"}]})
    ));
    assert!(!outside(json!({"verdict": "faithful", "effects": []})));
}

#[test]
fn pairs_are_sets() {
    let truth = ["reading-gain", "camera-offset"];
    let pair = |answer| outcome(Kind::Pair, &truth, &["sense", "observe"], answer);
    let both = pair(json!({
        "verdict": "explained", "effects": [{"name": "camera-offset"}, {"name": "distance-scale"}],
    }));
    assert!(both.all_right() && both.all_reported());
    let among = pair(json!({
        "verdict": "explained", "effects": [{"name": "camera-offset"}, {"name": "axle-length"}],
        "alternative_sets": [["camera-offset", "axle-length"], ["camera-offset", "reading-gain"]],
    }));
    assert!(!among.all_right() && among.all_reported());
    let one = pair(json!({"verdict": "explained", "effects": [{"name": "camera-offset"}]}));
    assert!(!one.all_right() && !one.all_reported());
}

#[test]
fn a_pair_hides_one_effect_where_the_other_one_alone_leaves_nothing() {
    let alone = |name: &str, remainder_p: f64| {
        let answer = json!({
            "verdict": "explained", "effects": [{"name": name}], "candidates": [{"remainder_p": remainder_p}],
        });
        let truth = ["reading-gain", "acceleration-limit"];
        outcome(Kind::Pair, &truth, &["sense", "act"], answer).hides_one()
    };
    // A name that counts as one with the true one will do.
    assert!(alone("reading-gain", 0.3) && alone("distance-scale", 0.3));
    assert!(!alone("reading-gain", 1e-4) && !alone("camera-offset", 0.3));
}

#[test]
fn a_pattern_is_recognised_by_its_name_and_its_pattern() {
    let by_run = |answer| {
        let mut set = outcome(Kind::Single, &["reading-gain"], &["sense"], answer);
        set.label.by_run = true;
        set.by_run_right()
    };
    assert!(by_run(
        json!({"verdict": "explained", "effects": [{"name": "reading-gain", "by": "run"}]})
    ));
    assert!(!by_run(
        json!({"verdict": "explained", "effects": [{"name": "reading-gain", "by": null}]})
    ));
}

#[test]
fn sizes_count_only_where_the_name_is_right_and_defined_by_a_formula() {
    let sized = |truth: &str, parameter: &str, name: &str| {
        let answer = json!({"verdict": "explained", "effects": [{"name": name, "parameters": [
            {"name": parameter, "value": 0.2, "low": 0.1, "high": 0.3, "unit": ""},
        ]}]});
        let mut set = outcome(Kind::Single, &[truth], &["sense"], answer);
        set.label.parameters = vec![(parameter.into(), Truth::Number(0.25))];
        set.parameter_errors()
    };
    let found = sized("crosstalk", "fraction", "crosstalk");
    assert!((found[0].error - 0.2).abs() < 1e-9 && found[0].covered);
    assert!(sized("crosstalk", "fraction", "reading-gain").is_empty());
    assert!(sized("cone-of-view", "half_angle_rad", "cone-of-view").is_empty());
}

#[test]
fn a_set_that_could_not_be_traced_is_wrong() {
    let mut set = outcome(Kind::Null, &[], &[], json!({"verdict": "faithful"}));
    assert!(set.right());
    set.trace = Trace::failed("bad file");
    assert!(!set.right() && set.first().is_none() && set.after_over_floor().is_none());
}

#[test]
fn an_error_is_held_against_that_of_the_true_model() {
    let answer =
        json!({"verdict": "explained", "error": {"before": 0.002, "after": 0.0005, "floor": 0.0004}});
    let mut found = outcome(Kind::Single, &["reading-gain"], &["sense"], answer);
    assert_eq!(found.after_over_truth(), Some(1.25));
    found.truth_m = None;
    assert_eq!(found.after_over_truth(), None);
}
