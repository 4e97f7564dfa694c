//! What laps do not tell apart is told apart by the experiment that the trace names.

use serde_json::Value;
use sim::{Setting, find};

use crate::support::Scratch;
use crate::tracing::{Robot, names, says, share_signatures, trace};

fn alternatives(trace: &Value) -> Vec<&str> {
    let list = trace["effects"][0]["alternatives"].as_array().unwrap();
    list.iter().map(|name| name.as_str().unwrap()).collect()
}

#[test]
fn the_experiment_that_is_named_tells_the_alternatives_apart() {
    let scratch = Scratch::new();
    share_signatures("braitenberg");
    let robot = Robot::with(Setting::constant(find("reading-gain").unwrap(), [1.15]));
    robot.record(&scratch, "laps");

    let before = trace(&scratch, "braitenberg", "laps", &[]);
    let rivals = alternatives(&before);
    assert!(!rivals.is_empty(), "{before:#}");
    let experiments = before["separate_with"].as_array().unwrap();
    let logged = |e: &&Value| e["experiment"].as_str().unwrap().contains("log");
    let next = experiments.iter().find(logged).unwrap();
    // Gain and distance scale stay nearly one in a log too; the controller's gain does not.
    let against = next["against"].as_array().unwrap();
    assert!(
        against.iter().any(|rival| rival["sigma"].as_f64().unwrap() > 5.0),
        "{next:#}"
    );

    robot.logged(&[3; 2]).record(&scratch, "logged");
    let after = trace(&scratch, "braitenberg", "laps", &["--measured", "logged"]);
    assert!(names(&after).len() == 1, "{after:#}");
    // With a log the controller's gain is known exactly; gain and distance scale stay nearly one.
    assert!(!alternatives(&after).contains(&"controller-gain"), "{after:#}");
    assert!(
        ["reading-gain", "distance-scale"].contains(&names(&after)[0]),
        "{after:#}"
    );
    assert_eq!(after["logs"]["confirmed_by_laps"], true);
}

#[test]
fn what_may_be_there_besides_is_listed_with_the_laps_that_would_tell() {
    share_signatures("braitenberg");
    let scratch = Scratch::new();
    let mut robot = Robot::with(Setting::constant(find("camera-offset").unwrap(), [0.0029, 0.0]));
    // Commands reach it as runs begin, and then no more.
    let limit = Setting::constant(find("acceleration-limit").unwrap(), [0.25]);
    robot.effects.push(limit);
    robot.record(&scratch, "set");

    let found = trace(&scratch, "braitenberg", "set", &[]);
    says(&found, "explained", &["camera-offset"]);
    let sets = serde_json::json!([["camera-offset"], ["camera-offset", "acceleration-limit"]]);
    assert_eq!(found["alternative_sets"], sets, "{found:#}");
    assert_eq!(found["effects"][0]["alternatives"], serde_json::json!([]));
    let next = &found["separate_with"][0];
    assert_eq!(next["against"][0]["name"], "camera-offset + acceleration-limit");
    assert!(next["sigma"].as_f64().unwrap() > 1.0, "{next:#}");
}
