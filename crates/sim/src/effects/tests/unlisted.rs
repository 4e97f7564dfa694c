use track::Vec2;

use super::super::testing::{active, declared, moment, scene, silent, steps, with};
use super::super::{EFFECTS, Setting, UNLISTED, find, unlisted_at};
use crate::{Error, Pose, WheelSpeeds};

/// Value of a word of one of the three choices.
fn choice(param: usize, word: &str) -> f64 {
    UNLISTED.params[param]
        .choices
        .iter()
        .position(|name| *name == word)
        .unwrap() as f64
}

fn values(words: [&str; 3], coefficients: &[f64]) -> Vec<f64> {
    let words = words.iter().enumerate().map(|(i, word)| choice(i, word));
    words.chain(coefficients.iter().copied()).collect()
}

#[test]
fn it_is_known_but_no_candidate() {
    assert_eq!(find("unlisted").unwrap().name, "unlisted");
    assert!(EFFECTS.iter().all(|spec| spec.name != "unlisted"));
    let check = |values: Vec<f64>| Setting::constant(&UNLISTED, values).check(0);
    assert!(check(values(["reading", "time", "polynomial"], &[0.1; 9])).is_ok());
    let no_word = UNLISTED.params[0].choices.len() as f64;
    assert!(check(vec![no_word, 0.0, 0.0]).is_err() && check(vec![0.0]).is_err());
    let broken = check(values(["reading", "time", "polynomial"], &[0.0, f64::NAN])).unwrap_err();
    assert!(matches!(broken, Error::OutOfRange { key, .. } if key == "effect.0.coefficients"));
}

#[test]
fn wheel_speed_by_the_heading_twice_per_turn() {
    let mut wheels = active(
        "unlisted",
        &values(["wheel speed", "heading", "harmonics"], &[0.0, 0.0, 0.06, 0.03]),
    );
    for heading_rad in [-3.0, -1.0, 0.0, 0.5, 2.0_f64] {
        let now = moment(Pose::new(0.0, 0.0, heading_rad), 0.0, 0.032);
        let ground = wheels.effect.ground(
            &wheels.values,
            &now,
            WheelSpeeds {
                left_m_s: 0.05,
                right_m_s: 0.02,
            },
        );
        let factor = 1.0 + 0.06 * (2.0 * heading_rad).cos() + 0.03 * (2.0 * heading_rad).sin();
        assert!(
            (ground.left_m_s - 0.05 * factor).abs() < 1e-15
                && (ground.right_m_s - 0.02 * factor).abs() < 1e-15
        );
    }
}

/// Each wheel by its own angle: a quarter of a turn of the left one is `PI / 2 * 20.5 mm`.
#[test]
fn a_wheel_out_of_round_by_its_own_angle() {
    let speeds = |left_m_s, right_m_s| WheelSpeeds { left_m_s, right_m_s };
    let now = moment(Pose::new(0.0, 0.0, 0.0), 0.0, 0.5);
    let quarter_m_s = std::f64::consts::FRAC_PI_2 * 0.0205 / 0.5;
    let after_a_quarter = |target: &str| {
        let words = [target, "wheel angle", "harmonics"];
        let mut wheel = active("unlisted", &values(words, &[0.1, 0.03]));
        let mut ground = |wheels| wheel.effect.ground(&wheel.values, &now, wheels);
        let first = ground(speeds(quarter_m_s, 0.0));
        let of_left = if target == "right wheel" { 1.0 } else { 1.1 };
        assert!((first.left_m_s - of_left * quarter_m_s).abs() < 1e-15);
        ground(speeds(1.0, 1.0))
    };
    let both = after_a_quarter("wheel speed");
    assert!((both.left_m_s - 1.03).abs() < 1e-15 && (both.right_m_s - 1.1).abs() < 1e-15);
    let left = after_a_quarter("left wheel");
    assert!((left.left_m_s - 1.03).abs() < 1e-15 && left.right_m_s == 1.0);
    let right = after_a_quarter("right wheel");
    assert!(right.left_m_s == 1.0 && (right.right_m_s - 1.1).abs() < 1e-15);
}

#[test]
fn camera_polynomial_over_the_floor() {
    let camera = active(
        "unlisted",
        &values(
            ["camera y", "place", "polynomial"],
            &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0],
        ),
    );
    let (pose, p) = (Pose::new(0.9, 0.7, 0.0), Vec2::new(0.9, 0.7));
    let seen = camera
        .effect
        .observed(&camera.values, &moment(pose, 0.0, 0.064), p);
    let (x, y) = (0.2, 0.1);
    let expected = 0.7 + 1.0 + 2.0 * x + 3.0 * y + 4.0 * x * x + 5.0 * x * y + 6.0 * y * y;
    assert!((seen - Vec2::new(0.9, expected)).length() < 1e-12, "{seen:?}");
}

#[test]
fn an_area_of_the_floor_fades_as_softly_as_it_is_told() {
    // A slower robot within 0.15 m of (0.9, 0.7), seen from the middle of a 1.4 m by 1.2 m arena.
    let slower_at = |words: [&str; 3], coefficients: &[f64], x: f64, y: f64| {
        let mut area = active("unlisted", &values(words, coefficients));
        let now = moment(Pose::new(x, y, 0.0), 0.0, 0.032);
        let wheels = WheelSpeeds {
            left_m_s: 1.0,
            right_m_s: 1.0,
        };
        1.0 - area.effect.ground(&area.values, &now, wheels).left_m_s
    };
    let words = ["wheel speed", "place", "area"];
    let of = |x: f64, y: f64| slower_at(words, &[-0.2, 0.2, 0.1, 0.15], x, y);
    assert!((of(0.9, 0.7) - 0.2).abs() < 1e-15);
    for (x, y) in [(1.05, 0.7), (0.9, 0.55)] {
        assert!((of(x, y) - 0.2 * (-0.5_f64).exp()).abs() < 1e-15);
    }
    assert!(of(0.9, 1.6) < 1e-8);
    for (softness, off) in [(1.0, 0.5), (0.25, 0.0625), (0.0, 0.5_f64.powi(20))] {
        let half_way = slower_at(
            words,
            &[-0.2, 0.2, 0.1, 0.15, softness],
            0.9 + 0.15 * 0.5_f64.sqrt(),
            0.7,
        );
        assert!((half_way - 0.2 * (-0.5 * off).exp()).abs() < 1e-15, "{softness}");
    }
    // Without a radius there is no area, and on a line neither.
    for no_radius in [&[-0.2, 0.2, 0.1][..], &[-0.2, 0.2, 0.1, 0.0]] {
        assert_eq!(slower_at(words, no_radius, 0.9, 0.7), 0.0);
    }
    assert_eq!(
        unlisted_at(&values(["reading", "time", "area"], &[1.0; 4]), 1.0),
        0.0
    );
}

/// A camera that looks at the floor at an angle sees what is nearer to it larger.
#[test]
fn a_tilted_camera_scales_by_the_place() {
    let words = ["camera scale", "place", "polynomial"];
    let camera = active("unlisted", &values(words, &[0.0, 0.3, -0.1]));
    let (pose, p) = (Pose::new(0.9, 0.7, 0.0), Vec2::new(0.9, 0.7));
    let now = moment(pose, 0.0, 0.064);
    let seen = camera.effect.observed(&camera.values, &now, p);
    let (x, y) = (0.2, 0.1);
    let share = 0.3 * x - 0.1 * y;
    let expected = Vec2::new(0.9 + share * x, 0.7 + share * y);
    assert!((seen - expected).length() < 1e-12, "{seen:?}");
}

#[test]
fn what_settles_has_decayed_to_a_share_of_e_after_its_time() {
    let at = |coefficients: &[f64], time_s| {
        unlisted_at(&values(["reading", "time", "settling"], coefficients), time_s)
    };
    assert_eq!(at(&[0.1, -0.3, 150.0], 0.0), 0.1 - 0.3);
    assert!((at(&[0.1, -0.3, 150.0], 150.0) - (0.1 - 0.3 / std::f64::consts::E)).abs() < 1e-15);
    assert!((at(&[0.1, -0.3, 150.0], 1e6) - 0.1).abs() < 1e-15);
    // Without a scale there is no decay.
    assert_eq!(
        [at(&[], 1.0), at(&[0.1], 1.0), at(&[0.1, -0.3, 0.0], 1.0)],
        [0.0, 0.1, 0.1]
    );
}

#[test]
fn polynomial_of_time_and_harmonics_of_the_gate() {
    let of = |words, coefficients: &[f64]| {
        let yaw = active("unlisted", &values(words, coefficients));
        let now = moment(Pose::new(0.0, 0.0, 0.0), 10.0, 0.032); // next is gate 25 of 100: a quarter of a turn
        yaw.effect.drift_m_s(&yaw.values, &now)
    };
    assert_eq!(
        of(["side slip", "time", "polynomial"], &[1.0, 2.0, 3.0]),
        Vec2::new(0.0, 321.0)
    );
    let quarter = of(["side slip", "gate", "harmonics"], &[7.0, 0.5]);
    assert!((quarter - Vec2::new(0.0, 0.5)).length() < 1e-14, "{quarter:?}");
    assert_eq!(
        of(["yaw rate", "constant", "polynomial"], &[1.0]),
        Vec2::ZERO,
        "it acts on nothing else"
    );
}

/// Constant shares on both wheels are the wheel scale, a constant share on the readings their gain.
#[test]
fn constants_are_the_listed_effects() {
    let same = |words: [&str; 3], share: f64, name: &str, value: f64| {
        let unlisted = steps(&with(&silent(), "unlisted", &values(words, &[share])), 0, 1, 200);
        assert_eq!(
            unlisted,
            steps(&with(&silent(), name, &[value]), 0, 1, 200),
            "{name}"
        );
    };
    same(
        ["wheel speed", "constant", "polynomial"],
        0.25,
        "wheel-scale",
        1.25,
    );
    same(
        ["left wheel", "constant", "polynomial"],
        0.25,
        "wheel-asymmetry",
        1.25,
    );
    same(["reading", "constant", "harmonics"], 0.25, "reading-gain", 1.25);
    same(
        ["camera scale", "constant", "polynomial"],
        0.25,
        "camera-scale",
        1.25,
    );
}

#[test]
fn no_coefficients_change_nothing() {
    let plain = steps(&declared(), 0, 1, 100);
    assert_eq!(scene().walls().len(), 47);
    for target in UNLISTED.params[0].choices {
        for zeros in [&[] as &[f64], &[0.0; 4]] {
            let model = with(
                &declared(),
                "unlisted",
                &values([target, "heading", "harmonics"], zeros),
            );
            assert!(steps(&model, 0, 1, 100) == plain, "{target}");
            let model = with(
                &declared(),
                "unlisted",
                &values([target, "turn", "polynomial"], zeros),
            );
            assert!(steps(&model, 0, 1, 100) == plain, "{target}");
            let model = with(
                &declared(),
                "unlisted",
                &values([target, "wheel angle", "harmonics"], zeros),
            );
            assert!(steps(&model, 0, 1, 100) == plain, "{target}");
        }
    }
}
