use proptest::prelude::*;

use super::super::testing::{active, declared, moment, scene, silent, steps, with};
use crate::{Forecast, Model, Pose, Readings};

const STEP_S: f64 = 0.064;
const READINGS: Readings = [10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0];

/// Readings after one step of an effect, the robot looking along `heading_rad`, at a time since the run began.
fn after(name: &str, values: &[f64], heading_rad: f64, time_s: f64, mut readings: Readings) -> Readings {
    let mut active = active(name, values);
    let now = moment(Pose::new(0.2, 0.3, heading_rad), time_s, STEP_S);
    active
        .effect
        .readings(&active.values, &now, &declared().machine, &mut readings);
    readings
}

#[test]
fn gains_and_offsets_by_hand() {
    assert_eq!(
        after("reading-gain", &[2.0], 0.0, 0.0, READINGS),
        READINGS.map(|r| 2.0 * r)
    );
    assert_eq!(
        after("ambient-offset", &[5.0], 0.0, 0.0, READINGS),
        READINGS.map(|r| r + 5.0)
    );
    assert_eq!(
        after("reading-drift", &[0.001], 0.0, 250.0, READINGS),
        READINGS.map(|r| 1.25 * r)
    );
    let one = after("one-sensor-gain", &[5.0, 0.5], 0.0, 0.0, READINGS);
    assert_eq!(one, [10.0, 20.0, 30.0, 40.0, 50.0, 30.0, 70.0, 80.0]);
    let one = after("one-sensor-offset", &[0.0, 7.0], 0.0, 0.0, READINGS);
    assert_eq!(one, [17.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0]);
}

#[test]
fn crosstalk_by_hand() {
    let mixed = after("crosstalk", &[0.1], 0.0, 0.0, READINGS);
    assert!(
        (mixed[0] - (10.0 + 0.1 * 0.5 * (80.0 + 20.0))).abs() < 1e-12,
        "the ring closes: {mixed:?}"
    );
    assert!(
        (mixed[3] - (40.0 + 0.1 * 0.5 * (30.0 + 50.0))).abs() < 1e-12,
        "{mixed:?}"
    );
}

/// The robot looks along +y; a light far on its right is at azimuth 0.
#[test]
fn light_from_the_right_meets_the_sensors_on_the_right() {
    let lit = after(
        "directional-light",
        &[100.0, 0.0],
        std::f64::consts::FRAC_PI_2,
        0.0,
        [0.0; 8],
    );
    assert!((lit[2] - 100.0).abs() < 1e-3, "S2 looks at it: {lit:?}");
    assert!(
        (lit[0] - 100.0 * (0.3_f64 - std::f64::consts::FRAC_PI_2).cos()).abs() < 1e-10,
        "{lit:?}"
    );
    assert!(
        lit[4..].iter().all(|&counts| counts == 0.0),
        "the left looks away: {lit:?}"
    );
}

#[test]
fn lag_of_a_step_is_an_exponential() {
    let mut lag = active("sensor-lag", &[0.12]);
    let now = moment(Pose::new(0.0, 0.0, 0.0), 0.0, STEP_S);
    for step in 0..40 {
        let mut readings = [if step == 0 { 100.0 } else { 600.0 }; 8];
        lag.effect
            .readings(&lag.values, &now, &declared().machine, &mut readings);
        let expected = 600.0 - 500.0 * (-f64::from(step) * STEP_S / 0.12).exp();
        assert!(
            (readings[3] - expected).abs() < 1e-9,
            "step {step}: {} against {expected}",
            readings[3]
        );
    }
}

#[test]
fn readings_keep_of_the_last_ones_what_a_lag_does() {
    let kept = |model: &Model| {
        let world = scene().world(model, 0).unwrap();
        Forecast::new(&world).unwrap().kept()
    };
    let mixed = with(&declared(), "crosstalk", &[0.2]);
    assert_eq!(kept(&mixed), 0.0);
    let lagging = with(&mixed, "sensor-lag", &[0.12]);
    assert!((kept(&lagging) - (-STEP_S / 0.12).exp()).abs() < 1e-12);
}

#[test]
fn noise_scales_with_its_factor() {
    let plain = declared().machine;
    let mut louder = plain.clone();
    let noise = active("reading-noise", &[3.0]);
    noise.effect.on_machine().unwrap()(&noise.values, &mut louder);
    for reading in [0.0, 10.0, 3000.0] {
        let ratio = louder.noise.deviation(reading) / plain.noise.deviation(reading);
        assert!((ratio - 3.0).abs() < 1e-12);
    }
}

#[test]
fn rounding_comes_after_noise_and_before_the_cut() {
    for (_, step) in steps(&with(&declared(), "reading-step", &[60.0]), 0, 1, 200) {
        assert!(
            step.readings.iter().all(|r| r % 60.0 == 0.0),
            "{:?}",
            step.readings
        );
    }
    let dark = steps(&with(&silent(), "ambient-offset", &[-2000.0]), 0, 1, 50);
    assert!(
        dark.iter()
            .all(|(_, step)| step.readings.iter().all(|&r| r >= 0.0))
    );
}

proptest! {
    #[test]
    fn crosstalk_adds_its_fraction_of_the_sum(readings: [u16; 8], fraction in 0.0..1.0) {
        let readings = readings.map(f64::from);
        let sum: f64 = after("crosstalk", &[fraction], 0.0, 0.0, readings).iter().sum();
        let expected = (1.0 + fraction) * readings.iter().sum::<f64>();
        prop_assert!((sum - expected).abs() <= 1e-9 * expected);
    }

    #[test]
    fn light_turns_with_the_robot(azimuth in -3.0..3.0, heading in -3.0..3.0) {
        let together = after("directional-light", &[10.0, azimuth + heading], heading, 0.0, [0.0; 8]);
        let alone = after("directional-light", &[10.0, azimuth], 0.0, 0.0, [0.0; 8]);
        for (a, b) in together.iter().zip(alone) {
            prop_assert!((a - b).abs() < 1e-9 && (0.0..=10.0).contains(a));
        }
    }
}
