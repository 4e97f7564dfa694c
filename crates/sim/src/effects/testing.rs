//! The declared e-puck on the shipped circuit, for tests.

use std::sync::{Arc, OnceLock};

use track::{Course, Vec2, Way};

use super::{Active, Setting, find};
use crate::{
    Beam, Circuit, Controller, Machine, Model, Mount, Pose, ReadingNoise, Response, Robot, Run, RunRules,
    Scene, Step, Streams, WallRules, WheelSpeeds,
};

/// Controller 2 with the numbers of the shipped model.
pub(crate) fn declared() -> Model {
    let mount = |x: f64, y: f64, angle_rad: f64| Mount {
        position: Vec2::new(x, y),
        angle_rad,
    };
    let right = [
        mount(0.030, -0.010, -0.30),
        mount(0.022, -0.025, -0.80),
        mount(0.000, -0.031, -1.57),
        mount(-0.030, -0.015, -2.64),
    ];
    let left = |m: Mount| mount(m.position.x, -m.position.y, -m.angle_rad);
    let mounts = std::array::from_fn(|i| if i < 4 { right[i] } else { left(right[7 - i]) });
    Model {
        machine: Machine {
            robot: Robot {
                body_radius_m: 0.037,
                axle_m: 0.053,
                wheel_speed_limit_m_s: 0.1288,
            },
            mounts,
            range_m: 0.1,
            full_scale_counts: 4095.0,
            response: Response::Improved {
                a_counts: 4202.93,
                d0_m: 0.005_219_53,
                exponent: 1.572_816_92,
            },
            noise: ReadingNoise {
                fraction: 0.05,
                counts: 8.0,
            },
            beam: Beam::single(),
            controller: Controller::Braitenberg {
                speed_m_s: 0.05,
                gain_per_count: 0.0005,
            },
            slip_level: 0.1,
            camera_noise_m: 0.001,
        },
        run: RunRules {
            way: Way::Forward,
            control_step_s: 0.064,
            physics_steps: 2,
            start_offset_m: 0.02,
            start_heading_rad: 0.2,
            patience_laps: 10.0,
        },
        wall: WallRules {
            max_error_m: 0.005,
            thickness_m: 0.0,
        },
        effects: Vec::new(),
    }
}

/// The declared model without any noise.
pub(crate) fn silent() -> Model {
    let mut model = declared();
    model.machine.noise = ReadingNoise {
        fraction: 0.0,
        counts: 0.0,
    };
    model.machine.slip_level = 0.0;
    model.machine.camera_noise_m = 0.0;
    model
}

/// A model with one effect more.
pub(crate) fn with(model: &Model, name: &str, values: &[f64]) -> Model {
    let mut model = model.clone();
    model.effects.push(Setting::constant(find(name).unwrap(), values));
    model
}

/// The shipped circuit with 100 gates.
pub(crate) fn scene() -> &'static Scene {
    static SCENE: OnceLock<Scene> = OnceLock::new();
    SCENE.get_or_init(|| {
        let text = include_str!("../../../../worlds/roduit2007/world.toml");
        let circuit = Circuit::new(Course::from_toml(text).unwrap(), 100).unwrap();
        Scene::new(Arc::new(circuit), &declared(), None).unwrap()
    })
}

/// The first control steps of a run, each with the pose at its beginning.
pub(crate) fn steps(model: &Model, run: usize, seed: u64, count: usize) -> Vec<(Pose, Step)> {
    let world = scene().world(model, run).unwrap();
    let mut drive = Run::new(&world, Streams { seed, run: 0 }).unwrap();
    (0..count).map(|_| (drive.pose(), drive.step())).collect()
}

/// One effect at work.
pub(super) fn active(name: &str, values: &[f64]) -> Active {
    let setting = Setting::constant(find(name).unwrap(), values);
    setting.check(0).unwrap();
    Active::all(&[setting], 0).unwrap().remove(0)
}

/// A moment with the robot at a pose.
pub(super) fn moment(pose: Pose, time_s: f64, step_s: f64) -> super::Moment {
    super::Moment {
        time_s,
        step_s,
        pose,
        command: WheelSpeeds::default(),
        gate: 25,
        gate_count: 100,
        arena_middle: Vec2::new(0.7, 0.6),
    }
}
