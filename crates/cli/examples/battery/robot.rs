//! The declared robot with an effect that no model file can name, and its data sets.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, Result};
use sim::{
    Beam, Circuit, Machine, Model, Mount, ReadingNoise, Response, Robot, RunRules, Scene, Setting, Step,
    Streams, Vec2, WallRules, drive,
};
use toml::Table;
use track::{Course, Way};

use crate::labels::{Controller, Label, Level};

const MODEL: &str = include_str!("../../../../worlds/roduit2007/model.toml");
const WORLD: &str = include_str!("../../../../worlds/roduit2007/world.toml");

/// How a data set is driven.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Recording {
    pub(crate) laps: usize,
    pub(crate) seed: u64,
}

/// The shipped circuit.
///
/// # Errors
/// A shipped world that cannot be cut.
pub(crate) fn scene() -> Result<Scene> {
    let circuit = Circuit::new(Course::from_toml(WORLD)?, 100)?;
    Ok(Scene::new(
        Arc::new(circuit),
        &declared(Controller::Braitenberg)?,
        None,
    )?)
}

/// Drives a data set with an effect and writes it; whether the robot finished its laps.
///
/// # Errors
/// A file that cannot be written.
pub(crate) fn record(
    scene: &Scene,
    effect: &Setting,
    label: &Label,
    recording: Recording,
    to: &Path,
) -> Result<bool> {
    let mut model = declared(label.controller)?;
    model.effects.push(effect.clone());
    let logged = label.level == Level::L2;
    fs::create_dir_all(to)?;
    for (run, name) in RUNS.iter().enumerate() {
        let world = scene.world(&model, run)?;
        let streams = Streams {
            seed: recording.seed,
            run: run as u64,
        };
        let mut text = header(logged);
        let drive = drive(&world, streams, recording.laps, |step| {
            push_row(&mut text, step, logged);
        })?;
        if drive.timed_out || drive.laps.iter().any(|lap| !lap.missed.is_empty()) {
            return Ok(false);
        }
        fs::write(to.join(format!("run_{name}.csv")), text)?;
    }
    let mut set = Table::new();
    set.insert("name".into(), label.name.clone().into());
    set.insert("world".into(), "roduit2007".into());
    set.insert("controller".into(), label.controller.name().into());
    set.insert("runs".into(), RUNS.map(str::to_owned).to_vec().into());
    set.insert("laps".into(), (recording.laps as i64).into());
    set.insert("note".into(), "simulated".into());
    fs::write(to.join("dataset.toml"), toml::to_string(&set)?)?;
    Ok(true)
}

const RUNS: [&str; 4] = ["a", "b", "c", "d"];

fn header(logged: bool) -> String {
    let readings: String = (0..8).map(|sensor| format!(",ps{sensor}")).collect();
    let log = if logged {
        readings + ",left_m_s,right_m_s"
    } else {
        String::new()
    };
    format!("t_s,x_m,y_m{log}\n")
}

/// Numbers are rounded here and nowhere else.
fn push_row(text: &mut String, step: &Step, logged: bool) {
    let Step {
        time_s,
        observed,
        readings,
        command,
    } = step;
    let mut row = format!("{time_s:.3},{:.4},{:.4}", observed.x, observed.y);
    if logged {
        readings
            .iter()
            .for_each(|reading| row += &format!(",{reading:.1}"));
        row += &format!(",{:.5},{:.5}", command.left_m_s, command.right_m_s);
    }
    writeln!(text, "{row}").expect("a string takes any text");
}

/// The shipped model.
///
/// # Errors
/// A number that it lacks.
pub(crate) fn declared(controller: Controller) -> Result<Model> {
    let file: Table = toml::from_str(MODEL)?;
    let number = |table: &toml::Value, key: &str| {
        let value = table.get(key).and_then(toml::Value::as_float);
        value.with_context(|| format!("the shipped model has no {key}"))
    };
    let table = |key: &str| {
        file.get(key)
            .with_context(|| format!("the shipped model has no {key}"))
    };
    let (sensor, robot, control) = (table("sensor")?, table("robot")?, table("controller")?);
    let improved = sensor.get("improved").context("the sensor has a response")?;
    let mounts: Vec<Mount> = (sensor.get("mounts").and_then(toml::Value::as_array))
        .context("the sensors have mounts")?
        .iter()
        .map(|mount| {
            Ok(Mount {
                position: Vec2::new(number(mount, "x_m")?, number(mount, "y_m")?),
                angle_rad: number(mount, "angle_rad")?,
            })
        })
        .collect::<Result<_>>()?;
    let speed_m_s = number(control, "speed_m_s")?;
    let run = table("run")?;
    Ok(Model {
        machine: Machine {
            robot: Robot {
                body_radius_m: number(robot, "body_radius_m")?,
                axle_m: number(robot, "axle_m")?,
                wheel_speed_limit_m_s: number(robot, "wheel_speed_limit_m_s")?,
            },
            mounts: mounts.try_into().ok().context("there are eight mounts")?,
            range_m: number(sensor, "range_m")?,
            full_scale_counts: number(sensor, "full_scale_counts")?,
            response: Response::Improved {
                a_counts: number(improved, "a_counts")?,
                d0_m: number(improved, "d0_m")?,
                exponent: number(improved, "exponent")?,
            },
            noise: ReadingNoise {
                fraction: number(improved, "noise_fraction")?,
                counts: number(improved, "noise_counts")?,
            },
            beam: Beam::single(),
            controller: match controller {
                Controller::Braitenberg => sim::Controller::Braitenberg {
                    speed_m_s,
                    gain_per_count: number(control, "gain_per_count")?,
                },
                Controller::RuleBased => sim::Controller::RuleBased {
                    speed_m_s,
                    threshold_counts: number(control, "threshold_counts")?,
                },
            },
            slip_level: number(table("slip")?, "level")?,
            camera_noise_m: number(table("camera")?, "noise_m")?,
        },
        run: RunRules {
            way: Way::Forward,
            control_step_s: number(control, "step_s")?,
            physics_steps: 2,
            start_offset_m: number(run, "start_offset_m")?,
            start_heading_rad: number(run, "start_heading_rad")?,
            patience_laps: number(run, "patience_laps")?,
        },
        wall: WallRules {
            max_error_m: number(table("wall")?, "max_error_m")?,
            thickness_m: number(table("wall")?, "thickness_m")?,
        },
        effects: Vec::new(),
    })
}
