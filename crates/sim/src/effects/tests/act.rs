use proptest::prelude::*;
use track::Vec2;

use super::super::testing::{active, declared, moment, silent, steps, with};
use crate::{Pose, Robot, Streams, Twist, WheelSpeeds};

const STEP_S: f64 = 0.032;
const ORIGIN: fn() -> Pose = || Pose::new(0.0, 0.0, 0.0);

/// Speeds of the left wheel while it is commanded these, one per physics step; the right one goes the other way.
fn driven(name: &str, values: &[f64], commands: &[f64]) -> Vec<f64> {
    let mut active = active(name, values);
    let now = moment(ORIGIN(), 0.0, STEP_S);
    let mut drive = |&speed: &f64| {
        let wheels = WheelSpeeds {
            left_m_s: speed,
            right_m_s: -speed,
        };
        let driven = active.effect.drive(&active.values, &now, wheels);
        assert_eq!(driven.left_m_s, -driven.right_m_s);
        driven.left_m_s
    };
    commands.iter().map(&mut drive).collect()
}

/// Speeds over the ground at a time since the run began.
fn over_ground(name: &str, value: f64, time_s: f64, wheels: WheelSpeeds) -> WheelSpeeds {
    let mut active = active(name, &[value]);
    active
        .effect
        .ground(&active.values, &moment(ORIGIN(), time_s, STEP_S), wheels)
}

#[test]
fn motor_lag_is_an_exponential_from_rest() {
    for (step, speed) in driven("motor-lag", &[0.12], &[0.05; 40]).into_iter().enumerate() {
        let expected = 0.05 * (1.0 - (-(step as f64 + 1.0) * STEP_S / 0.12).exp());
        assert!(
            (speed - expected).abs() < 1e-15,
            "step {step}: {speed} against {expected}"
        );
    }
}

#[test]
fn delay_is_whole_physics_steps_after_rest() {
    let commands = [1.0, 2.0, 3.0, 4.0, 5.0].map(|speed| 0.01 * speed);
    assert_eq!(
        driven("command-delay", &[0.07], &commands),
        [0.0, 0.0, 0.01, 0.02, 0.03]
    );
    assert_eq!(driven("command-delay", &[0.015], &commands), commands);
    let late = driven("command-delay", &[5.0], &[0.05; 160]);
    assert_eq!(
        late.iter().filter(|&&speed| speed == 0.0).count(),
        156,
        "5 s are 156.25 steps"
    );
}

#[test]
fn dead_band_and_rounding_by_hand() {
    let commands = [0.0, 0.009, -0.009, 0.01, -0.02, 0.026];
    assert_eq!(
        driven("dead-band", &[0.01], &commands),
        [0.0, 0.0, 0.0, 0.01, -0.02, 0.026]
    );
    let rounded = driven("speed-step", &[0.02], &commands);
    for (speed, expected) in rounded.iter().zip([0.0, 0.0, 0.0, 0.02, -0.02, 0.02]) {
        assert!((speed - expected).abs() < 1e-15, "{rounded:?}");
    }
}

#[test]
fn acceleration_is_limited_from_rest() {
    let speeds = driven("acceleration-limit", &[0.5], &[0.04, 0.04, 0.04, 0.04, -0.01]);
    for (speed, expected) in speeds.iter().zip([0.016, 0.032, 0.04, 0.04, 0.024]) {
        assert!((speed - expected).abs() < 1e-15, "{speeds:?}");
    }
}

/// Two wheels told the same: a circle of radius axle / 2 (1 + ratio) / (1 - ratio).
#[test]
fn an_asymmetric_robot_drives_a_circle() {
    let robot = declared().machine.robot;
    let wheels = WheelSpeeds {
        left_m_s: 0.05,
        right_m_s: 0.05,
    };
    let twist = robot.twist(over_ground("wheel-asymmetry", 1.009, 0.0, wheels));
    let radius_m = twist.speed_m_s / twist.yaw_rad_s;
    let expected_m = 0.5 * 0.053 * (1.0 + 1.009) / (1.0 - 1.009);
    assert!(
        (radius_m / expected_m - 1.0).abs() < 1e-12,
        "{radius_m} against {expected_m}"
    );
    let half = ORIGIN().advance(twist, std::f64::consts::PI / twist.yaw_rad_s.abs());
    assert!(
        (half.position - Vec2::new(0.0, 2.0 * radius_m)).length() < 1e-12,
        "{half:?}"
    );
}

#[test]
fn scale_and_sag_by_hand() {
    let wheels = WheelSpeeds {
        left_m_s: 0.04,
        right_m_s: -0.02,
    };
    assert_eq!(
        over_ground("wheel-scale", 1.5, 0.0, wheels),
        wheels.map(|speed| 1.5 * speed)
    );
    assert_eq!(
        over_ground("battery-sag", 0.0005, 500.0, wheels),
        wheels.map(|speed| 0.75 * speed)
    );
    assert_eq!(
        over_ground("battery-sag", 0.001, 2000.0, wheels),
        WheelSpeeds {
            left_m_s: 0.0,
            right_m_s: -0.0
        }
    );
}

#[test]
fn a_longer_axle_turns_slower() {
    let mut machine = declared().machine;
    let axle = active("axle-length", &[1.25]);
    axle.effect.on_machine().unwrap()(&axle.values, &mut machine);
    let wheels = WheelSpeeds {
        left_m_s: 0.03,
        right_m_s: 0.05,
    };
    let ratio = machine.robot.twist(wheels).yaw_rad_s / declared().machine.robot.twist(wheels).yaw_rad_s;
    assert!((ratio - 0.8).abs() < 1e-12, "{ratio}");
}

#[test]
fn scrub_loses_yaw_and_grows_with_it() {
    let mut scrub = active("turn-scrub", &[0.2]);
    let now = moment(ORIGIN(), 0.0, STEP_S);
    let mut kept = |yaw_rad_s: f64| {
        let twist = scrub.effect.twist(
            &scrub.values,
            &now,
            Twist {
                speed_m_s: 0.05,
                yaw_rad_s,
            },
        );
        assert_eq!(twist.speed_m_s, 0.05);
        twist.yaw_rad_s / yaw_rad_s
    };
    for (yaw_rad_s, expected) in [(1.0, 0.9), (-1.0, 0.9), (3.0, 0.85), (1e-9, 1.0), (1e9, 0.8)] {
        assert!((kept(yaw_rad_s) - expected).abs() < 1e-9, "{yaw_rad_s}");
    }
}

/// From one start, with and without: the first control step ends apart by velocity times time, the same way round.
#[test]
fn tilt_drifts_the_robot() {
    let (plain, tilted) = (
        steps(&silent(), 0, 1, 2),
        steps(&with(&silent(), "floor-tilt", &[0.02, 2.0]), 0, 1, 2),
    );
    let apart = tilted[1].0.position - plain[1].0.position;
    assert!(
        (apart - Vec2::new(2.0_f64.cos(), 2.0_f64.sin()) * (0.02 * 0.064)).length() < 1e-15,
        "{apart:?}"
    );
    assert_eq!(tilted[1].0.heading, plain[1].0.heading);
}

#[test]
fn a_delayed_robot_waits() {
    let late = steps(&with(&silent(), "command-delay", &[0.064]), 0, 1, 3);
    assert_eq!(late[1].0, late[0].0);
    assert_ne!(late[2].0, late[1].0);
}

#[test]
fn slip_level_is_a_factor_on_the_declared_slip() {
    let mut slippery = declared();
    slippery.machine.slip_level *= 3.0;
    assert_eq!(
        steps(&with(&declared(), "slip-level", &[3.0]), 0, 1, 100),
        steps(&slippery, 0, 1, 100)
    );
}

/// An autoregressive process of order one: variance 1/3 as that of its draws, correlation c^k at lag k.
#[test]
fn slip_memory_keeps_the_variance_and_has_its_correlation() {
    let mut memory = active("slip-memory", &[0.6]);
    let mut stream = Streams { seed: 5, run: 0 }.open("test");
    let mut next = || {
        let draws = [stream.symmetric(), stream.symmetric()];
        (
            draws,
            <[f64; 2]>::from(memory.effect.slip(&memory.values, draws.into())),
        )
    };
    let (draws, first) = next();
    assert_eq!(first, draws, "the first slip is the plain draw");
    let count = 200_000;
    let slips: Vec<f64> = (0..count).map(|_| next().1[1]).collect();
    let lagged = |k: usize| slips.windows(k + 1).map(|w| w[0] * w[k]).sum::<f64>() / (count - k) as f64;
    // Four standard errors (Bartlett; normal draws, uniform ones vary less): a false alarm in 1 of 16 000 seeds.
    let error = 4.0 / 3.0 * (2.0 * (1.0 + 0.36) / (1.0 - 0.36) / count as f64).sqrt();
    for (k, expected) in [(0, 1.0 / 3.0), (1, 0.6 / 3.0), (2, 0.36 / 3.0)] {
        assert!(
            (lagged(k) - expected).abs() < error,
            "lag {k}: {} against {expected} +- {error}",
            lagged(k)
        );
    }
}

proptest! {
    #[test]
    fn rounding_moves_by_half_a_step_at_most(speed in -0.13..0.13, step in 1e-4..0.2) {
        let rounded = driven("speed-step", &[step], &[speed])[0];
        prop_assert!((rounded - speed).abs() <= 0.5 * step * (1.0 + 1e-9));
        prop_assert!((rounded / step - (rounded / step).round()).abs() < 1e-9);
    }

    #[test]
    fn lag_and_limit_never_overshoot(commands in prop::collection::vec(-0.13..0.13, 1..50), value in 0.01..2.0) {
        for name in ["motor-lag", "acceleration-limit"] {
            let mut before = 0.0_f64;
            for (speed, &target) in driven(name, &[value], &commands).into_iter().zip(&commands) {
                let (low, high) = (before.min(target), before.max(target));
                prop_assert!((low - 1e-15..=high + 1e-15).contains(&speed), "{} {} {} {}", name, before, speed, target);
                before = speed;
            }
        }
    }

    #[test]
    fn wheel_scale_scales_the_twist(left in -0.13..0.13, right in -0.13..0.13, factor in 0.1..5.0) {
        let robot: Robot = declared().machine.robot;
        let wheels = WheelSpeeds { left_m_s: left, right_m_s: right };
        let (plain, scaled) = (robot.twist(wheels), robot.twist(over_ground("wheel-scale", factor, 0.0, wheels)));
        prop_assert!((scaled.yaw_rad_s - factor * plain.yaw_rad_s).abs() < 1e-12);
        prop_assert!((scaled.speed_m_s - factor * plain.speed_m_s).abs() < 1e-12);
    }
}
