use proptest::prelude::*;
use track::Vec2;

use super::super::testing::{active, declared, moment, silent, steps, with};
use crate::{Model, Pose};

/// Where the camera sees a robot that looks along +y.
fn seen(name: &str, values: &[f64], position: Vec2) -> Vec2 {
    let active = active(name, values);
    let pose = Pose::new(position.x, position.y, std::f64::consts::FRAC_PI_2);
    active
        .effect
        .observed(&active.values, &moment(pose, 0.0, 0.064), position)
}

fn near(a: Vec2, x: f64, y: f64) -> bool {
    (a - Vec2::new(x, y)).length() < 1e-12
}

#[test]
fn maps_by_hand() {
    let p = Vec2::new(0.9, 0.7); // (0.2, 0.1) from the arena's middle
    assert!(near(seen("camera-scale", &[1.5], p), 1.0, 0.75));
    let (sin, cos) = 0.5_f64.sin_cos();
    let turned = seen("camera-rotation", &[0.5], p);
    assert!(near(
        turned,
        0.7 + 0.2 * cos - 0.1 * sin,
        0.6 + 0.2 * sin + 0.1 * cos
    ));
    assert!(near(seen("camera-offset", &[0.01, -0.02], p), 0.91, 0.68));
    let more = 0.1 * (0.2 * 0.2 + 0.1 * 0.1) / 0.85;
    assert!(near(
        seen("camera-distortion", &[0.1], p),
        0.9 + 0.2 * more,
        0.7 + 0.1 * more
    ));
}

#[test]
fn marker_turns_with_the_robot() {
    let p = Vec2::new(0.3, 0.2);
    assert!(near(seen("marker-offset", &[0.008, 0.0, 0.0], p), 0.3, 0.208));
    assert!(near(seen("marker-offset", &[0.0, 0.002, 0.0], p), 0.298, 0.2));
    assert!(near(seen("marker-offset", &[0.0, 0.0, 1.0], p), 0.3, 0.2));
}

/// Marker, lens, scale, rotation, offset: each on the result of the one before, in whatever order they are listed.
#[test]
fn maps_compose_in_their_order() {
    let chain: [(&str, &[f64]); 5] = [
        ("camera-offset", &[0.05, 0.02]),
        ("camera-rotation", &[0.3]),
        ("camera-scale", &[1.2]),
        ("camera-distortion", &[0.2]),
        ("marker-offset", &[0.01, 0.02, 0.0]),
    ];
    let model: Model = chain
        .iter()
        .fold(silent(), |model, (name, values)| with(&model, name, values));
    for (pose, step) in steps(&model, 0, 3, 20) {
        let middle = Vec2::new(0.7, 0.6);
        let marker = pose.to_world(Vec2::new(0.01, 0.02)) - middle;
        let lens = marker * (1.0 + 0.2 * marker.length_squared() / 0.85);
        let turned = Vec2::new(0.3_f64.cos(), 0.3_f64.sin()).rotate(lens * 1.2);
        let expected = middle + turned + Vec2::new(0.05, 0.02);
        assert!(
            (step.observed - expected).length() < 1e-14,
            "{:?} against {expected:?}",
            step.observed
        );
    }
}

#[test]
fn camera_noise_scales_with_its_factor() {
    let (plain, louder) = (
        steps(&declared(), 0, 1, 100),
        steps(&with(&declared(), "camera-noise", &[3.0]), 0, 1, 100),
    );
    for ((pose, step), (_, loud)) in plain.iter().zip(&louder) {
        let (a, b) = (step.observed - pose.position, loud.observed - pose.position);
        assert!((a * 3.0 - b).length() < 1e-15);
    }
}

proptest! {
    #[test]
    fn rotation_keeps_distances_and_undoes_itself(x in 0.0..1.4, y in 0.0..1.2, angle in -1.0..1.0) {
        let p = Vec2::new(x, y);
        let turned = seen("camera-rotation", &[angle], p);
        let middle = Vec2::new(0.7, 0.6);
        prop_assert!(((turned - middle).length() - (p - middle).length()).abs() < 1e-14);
        prop_assert!((seen("camera-rotation", &[-angle], turned) - p).length() < 1e-14);
    }
}
