//! The declared e-puck on the shipped circuit, for tests.

use std::sync::OnceLock;

use track::Vec2;

use super::{Active, Setting, find};
use crate::{Model, Pose, ReadingNoise, Run, Scene, Step, Streams, WheelSpeeds};

#[path = "../../../../benches/ground/mod.rs"]
mod ground;

/// Controller 2 with the numbers of the shipped model.
pub(crate) fn declared() -> Model {
    ground::model(ground::braitenberg(), 0.005)
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
    SCENE.get_or_init(|| Scene::new(ground::circuit(), &declared(), None).unwrap())
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
