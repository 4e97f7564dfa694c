//! What benchmarks, tests and the survey of effects stand on: the shipped circuit, the declared e-puck, the poses of a driven lap.

#![allow(dead_code, reason = "each of them uses a part of this file")]

use std::f64::consts::TAU;
use std::sync::Arc;

use sim::{
    Beam, Circuit, Controller, Machine, Model, Mount, Pose, Rays, ReadingNoise, Response, Robot, Run,
    RunRules, Scene, Streams, Vec2, WallRules, Walls,
};
use track::{Course, Way};

/// The shipped circuit with its hundred gates.
pub(crate) fn circuit() -> Arc<Circuit> {
    let course = Course::from_toml(include_str!("../../worlds/roduit2007/world.toml"))
        .expect("a shipped world is sound");
    Arc::new(Circuit::new(course, 100).expect("a shipped world has room for its gates"))
}

/// Controller 2 with the numbers of the shipped model.
pub(crate) fn braitenberg() -> Controller {
    Controller::Braitenberg {
        speed_m_s: 0.05,
        gain_per_count: 0.0005,
    }
}

/// Controller 1 with the numbers of the shipped model.
pub(crate) fn rule_based() -> Controller {
    Controller::RuleBased {
        speed_m_s: 0.05,
        threshold_counts: 500.0,
    }
}

/// The shipped model with these walls.
pub(crate) fn model(controller: Controller, max_error_m: f64) -> Model {
    let mount = |x: f64, y: f64, angle_rad: f64| Mount {
        position: Vec2::new(x, y),
        angle_rad,
    };
    Model {
        machine: Machine {
            robot: Robot {
                body_radius_m: 0.037,
                axle_m: 0.053,
                wheel_speed_limit_m_s: 0.1288,
            },
            mounts: [
                mount(0.030, -0.010, -0.30),
                mount(0.022, -0.025, -0.80),
                mount(0.000, -0.031, -1.57),
                mount(-0.030, -0.015, -2.64),
                mount(-0.030, 0.015, 2.64),
                mount(0.000, 0.031, 1.57),
                mount(0.022, 0.025, 0.80),
                mount(0.030, 0.010, 0.30),
            ],
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
            controller,
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
            max_error_m,
            thickness_m: 0.0,
        },
        effects: Vec::new(),
    }
}

/// The circuit's walls at a maximal error.
pub(crate) fn walls(circuit: &Circuit, max_error_m: f64) -> Walls {
    let cut = |wall: &track::Wall| {
        wall.flatten(max_error_m)
            .expect("a maximal error that was found by cutting")
    };
    Walls::new(&cut(&circuit.course.outer), &cut(&circuit.course.inner), 0.0)
}

/// Centre and eight rays at the poses of two driven laps.
pub(crate) fn driven(circuit: &Arc<Circuit>) -> Vec<(Vec2, Rays)> {
    let model = model(braitenberg(), 0.001);
    let scene =
        Scene::new(Arc::clone(circuit), &model, None).expect("the shipped model fits the shipped world");
    let world = scene.world(&model, 0).expect("no effects, no error");
    let mut run = Run::new(&world, Streams { seed: 1, run: 0 }).expect("no effects, no error");
    let mut pose = || {
        run.step();
        look(run.pose(), &model.machine.mounts)
    };
    (0..2200).map(|_| pose()).collect()
}

/// Centre and eight rays at random places of the arena.
pub(crate) fn random(circuit: &Circuit) -> Vec<(Vec2, Rays)> {
    let mut stream = Streams { seed: 1, run: 0 }.open("poses");
    let [width_m, height_m] = circuit.course.arena_m;
    let mut uniform = || 0.5 + 0.5 * stream.symmetric();
    let mounts = model(braitenberg(), 0.001).machine.mounts;
    (0..2200)
        .map(|_| {
            look(
                Pose::new(width_m * uniform(), height_m * uniform(), TAU * uniform()),
                &mounts,
            )
        })
        .collect()
}

fn look(pose: Pose, mounts: &[Mount; 8]) -> (Vec2, Rays) {
    let ray = |mount: Mount| {
        (
            pose.to_world(mount.position),
            pose.rotate(Vec2::new(mount.angle_rad.cos(), mount.angle_rad.sin())),
        )
    };
    (pose.position, Rays::new(mounts.map(ray)))
}
