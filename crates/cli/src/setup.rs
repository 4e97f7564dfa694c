//! From a configuration to what the simulator takes.

use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, Result, anyhow};
use diagnose::{ObservedRun, Unseen};
use sim::{
    Beam, CasterKind, Circuit, Drive, Machine, Model, Mount, Pattern, ReadingNoise, Response, Robot,
    RunRules, Scene, Setting, Step, Streams, Vec2, WallRules,
};
use toml::Value;
use track::{Course, Lap, Way};

use crate::args::ModelArgs;
use crate::config::{self, Combine, Config, ControllerKind, ModelFile, ModelSource, SensorKind, WorldSource};

/// A checked model on its circuit, ready to drive.
#[derive(Debug, Clone)]
pub(crate) struct Setup {
    pub(crate) model: Model,
    pub(crate) scene: Scene,
}

impl Setup {
    /// The setup of a model file; `world` is that of `--world`.
    pub(crate) fn load(file: &ModelFile, world: Option<&Path>, caster: Option<CasterKind>) -> Result<Self> {
        let source = file.world(world)?;
        let circuit = model_circuit(file, &source)?;
        Self::new(&file.config, circuit, caster).map_err(|error| locate(file, &source, error))
    }

    /// The setup of a configuration on a circuit.
    pub(crate) fn new(
        config: &Config,
        circuit: Arc<Circuit>,
        caster: Option<CasterKind>,
    ) -> Result<Self, sim::Error> {
        let model = model(config, &circuit.course)?;
        let scene = Scene::new(circuit, &model, caster)?;
        Ok(Self { model, scene })
    }

    /// Drives one run; `record` gets every step.
    pub(crate) fn drive(
        &self,
        streams: Streams,
        laps: usize,
        record: impl FnMut(&Step),
    ) -> Result<Drive, sim::Error> {
        let world = self.scene.world(&self.model, streams.run as usize)?;
        sim::drive(&world, streams, laps, record)
    }

    /// Has the camera write positions in multiples of a unit, if one is given: that is noise of it.
    pub(crate) fn see_in_steps(&mut self, unit_m: Option<f64>) {
        if let Some(unit_m) = unit_m {
            let noise_m = &mut self.model.machine.camera_noise_m;
            *noise_m = noise_m.hypot(unit_m / 12.0_f64.sqrt());
        }
    }

    /// Laps on a path of times in s and positions in m as a camera sees them from which parts of them are hidden, and the path
    /// too.
    pub(crate) fn seen_through(
        &self,
        unseen: &Unseen,
        laps: Vec<Lap>,
        path: &mut Vec<(f64, Vec2)>,
    ) -> Vec<Lap> {
        unseen.through(laps, path, &self.scene.circuit().gates, self.model.run.way)
    }

    /// A run with laps that were seen on a path of times in s and positions in m, as a diagnosis takes it.
    pub(crate) fn observed(&self, seen: Vec<Lap>, path: &[(f64, Vec2)]) -> ObservedRun {
        let (gates, speed_m_s) = (
            &self.scene.circuit().gates,
            self.model.machine.controller.speed_m_s(),
        );
        ObservedRun::on_path(seen, path, gates, self.model.run.way, speed_m_s)
    }
}

/// The keys of the model that may be to blame for an error.
pub(crate) fn blamed(error: &sim::Error) -> Vec<&str> {
    match error {
        sim::Error::TooNarrow { .. } => vec!["robot.body_radius_m", "wall.thickness_m"],
        _ => error.key().into_iter().collect(),
    }
}

/// An error of the simulator with the place in the file where its key was set, or else the world.
pub(crate) fn locate(file: &ModelFile, world: &WorldSource, error: sim::Error) -> anyhow::Error {
    match error
        .key()
        .or_else(|| blamed(&error).into_iter().find(|key| file.names(key)))
    {
        Some(key) => file.located(key, &error),
        None => anyhow!("{}: {error}", world.label),
    }
}

/// The circuit of a model; what is wrong with the number of gates is said where that was set.
pub(crate) fn model_circuit(file: &ModelFile, world: &WorldSource) -> Result<Arc<Circuit>> {
    let gates = file.config.run.gates;
    let circuit = Circuit::new(course(world)?, gates).map_err(|error| match file.names("run.gates") {
        true => file.located("run.gates", format!("run.gates = {gates}: {error}")),
        false => anyhow!("{}: {error}", world.label),
    })?;
    Ok(Arc::new(circuit))
}

/// The course of a world file with its gates.
pub(crate) fn circuit(source: &WorldSource, gates: usize) -> Result<Arc<Circuit>> {
    let course = course(source)?;
    let circuit = Circuit::new(course, gates).with_context(|| source.label.clone())?;
    Ok(Arc::new(circuit))
}

/// The course of a world file; an error says which line of it.
pub(crate) fn course(source: &WorldSource) -> Result<Course> {
    Course::from_toml(&source.text).map_err(|error| match error {
        track::Error::At { line, what } => anyhow!("{}:{line}: {what}", source.label),
        other => anyhow!("{}: {other}", source.label),
    })
}

/// The way round that a configuration names, on a course.
pub(crate) fn way(config: &Config, course: &Course) -> Way {
    course.way(config.run.direction.on(course))
}

/// Whether a configuration states a model.
pub(crate) fn check(config: &Config) -> Result<(), sim::Error> {
    model_going(config, Way::Forward).map(|_| ())
}

/// The model that a configuration states.
pub(crate) fn model(config: &Config, course: &Course) -> Result<Model, sim::Error> {
    model_going(config, way(config, course))
}

fn model_going(config: &Config, way: Way) -> Result<Model, sim::Error> {
    let model = Model {
        machine: machine(config)?,
        run: RunRules {
            way,
            control_step_s: config.controller.step_s,
            physics_steps: config.run.physics_steps as u32,
            start_offset_m: config.run.start_offset_m,
            start_heading_rad: config.run.start_heading_rad,
            patience_laps: config.run.patience_laps,
        },
        wall: WallRules {
            max_error_m: config.wall.max_error_m,
            thickness_m: config.wall.thickness_m,
        },
        effects: config
            .effect
            .iter()
            .enumerate()
            .map(|(i, e)| setting(i, e))
            .collect::<Result<_, _>>()?,
    };
    model.check()?;
    Ok(model)
}

fn machine(config: &Config) -> Result<Machine, sim::Error> {
    let config::Config {
        robot,
        sensor,
        controller,
        ..
    } = config;
    let mount = |m: config::Mount| Mount {
        position: Vec2::new(m.x_m, m.y_m),
        angle_rad: m.angle_rad,
    };
    let (response, noise) = match sensor.kind {
        SensorKind::Improved => {
            let config::Improved {
                a_counts,
                d0_m,
                exponent,
                noise_fraction,
                noise_counts,
            } = sensor.improved;
            let noise = ReadingNoise {
                fraction: noise_fraction,
                counts: noise_counts,
            };
            (
                Response::Improved {
                    a_counts,
                    d0_m,
                    exponent,
                },
                noise,
            )
        }
        SensorKind::Original => {
            let noise = ReadingNoise {
                fraction: sensor.original.noise_fraction,
                counts: 0.0,
            };
            (Response::Table(sensor.original.table.clone()), noise)
        }
    };
    let combine = match sensor.combine {
        Combine::Responses => sim::Combine::Responses,
        Combine::Distances => sim::Combine::Distances,
    };
    Ok(Machine {
        robot: Robot {
            body_radius_m: robot.body_radius_m,
            axle_m: robot.axle_m,
            wheel_speed_limit_m_s: robot.wheel_speed_limit_m_s,
        },
        mounts: sensor.mounts.map(mount),
        range_m: sensor.range_m,
        full_scale_counts: sensor.full_scale_counts,
        response,
        noise,
        beam: Beam::cone(sensor.rays, sensor.half_angle_rad, combine)?,
        controller: match controller.kind {
            ControllerKind::Braitenberg => sim::Controller::Braitenberg {
                speed_m_s: controller.speed_m_s,
                gain_per_count: controller.gain_per_count,
            },
            ControllerKind::RuleBased => sim::Controller::RuleBased {
                speed_m_s: controller.speed_m_s,
                threshold_counts: controller.threshold_counts,
            },
        },
        slip_level: config.slip.level,
        camera_noise_m: config.camera.noise_m,
    })
}

/// One `[[effect]]` table; `index` is its place in the file.
fn setting(index: usize, effect: &config::Effect) -> Result<Setting, sim::Error> {
    let invalid = |key: &str, reason: String| sim::Error::Invalid {
        key: format!("effect.{index}.{key}"),
        reason,
    };
    let spec = sim::find(&effect.kind).map_err(|error| invalid("kind", error.to_string()))?;
    let by_time = effect.by == Some(config::Pattern::Time);
    let slope_key = |param: &sim::Param| format!("{}_per_s", param.name);
    for key in effect.parameters.keys() {
        if !by_time && spec.params.iter().any(|p| slope_key(p) == *key) {
            return Err(invalid(
                key,
                "is a change in time, which needs by = \"time\"".into(),
            ));
        }
        let known = |p: &sim::Param| p.name == key || by_time && slope_key(p) == *key;
        // A list has no pattern.
        let list = spec.list.iter().filter(|_| effect.by.is_none());
        if !spec.params.iter().chain(list).any(known) {
            let names: Vec<&str> = spec.params.iter().chain(&spec.list).map(|p| p.name).collect();
            return Err(invalid(
                key,
                format!("is no parameter of {}, which has {}", spec.name, names.join(", ")),
            ));
        }
    }
    let sized: Vec<&sim::Param> = spec.params.iter().filter(|p| p.neutral.is_some()).collect();
    let given = |name: &str| effect.parameters.contains_key(name);
    if !sized.is_empty() && !sized.iter().any(|p| given(p.name) || given(&slope_key(p))) {
        let names: Vec<&str> = sized.iter().map(|p| p.name).collect();
        let reason = format!("{} without `{}` does nothing", spec.name, names.join("` or `"));
        return Err(invalid("kind", reason));
    }
    let value = |param: &sim::Param, value: &Value| {
        number(param, value)
            .map_err(|expected| invalid(param.name, format!("{value} given, {expected} expected")))
    };
    let get = |param: &sim::Param| match (effect.parameters.get(param.name), param.neutral) {
        (Some(given), _) => Ok(given.clone()),
        (None, Some(neutral)) => Ok(Value::Float(neutral)),
        (None, None) => Err(invalid("kind", format!("{} needs `{}`", spec.name, param.name))),
    };
    let pattern = match effect.by {
        None => {
            let own = spec.params.iter().map(|p| value(p, &get(p)?));
            let mut values = own.collect::<Result<Vec<f64>, _>>()?;
            if let Some(param) = &spec.list
                && let Some(given) = effect.parameters.get(param.name)
            {
                let Value::Array(numbers) = given else {
                    let reason = format!("{given} given, an array of numbers expected");
                    return Err(invalid(param.name, reason));
                };
                for number in numbers {
                    values.push(value(param, number)?);
                }
            }
            Pattern::Constant(values)
        }
        Some(config::Pattern::Time) => Pattern::ByTime {
            start: spec
                .params
                .iter()
                .map(|p| value(p, &get(p)?))
                .collect::<Result<_, _>>()?,
            per_s: spec
                .params
                .iter()
                .map(|p| {
                    effect
                        .parameters
                        .get(&slope_key(p))
                        .map_or(Ok(0.0), |v| value(p, v))
                })
                .collect::<Result<_, _>>()?,
        },
        Some(config::Pattern::Run) => {
            let given: Vec<Value> = spec.params.iter().map(get).collect::<Result<_, _>>()?;
            let lengths = given.iter().filter_map(|v| v.as_array().map(Vec::len));
            let runs = lengths
                .max()
                .filter(|&runs| runs > 0)
                .ok_or_else(|| invalid("by", "by run needs an array with a value for each run".into()))?;
            let of_run = |run: usize| -> Result<Vec<f64>, sim::Error> {
                spec.params
                    .iter()
                    .zip(&given)
                    .map(|(p, v)| match v.as_array() {
                        None => value(p, v),
                        Some(list) => list.get(run).map_or_else(
                            || Err(invalid(p.name, format!("has {} of {runs} values", list.len()))),
                            |v| value(p, v),
                        ),
                    })
                    .collect()
            };
            Pattern::ByRun((0..runs).map(of_run).collect::<Result<_, _>>()?)
        }
    };
    Ok(Setting { spec, pattern })
}

/// A parameter's value as the number that the simulator takes, or what was expected.
fn number(param: &sim::Param, value: &Value) -> Result<f64, String> {
    match value {
        Value::String(word) if !param.choices.is_empty() => param
            .choices
            .iter()
            .position(|choice| choice == word)
            .map(|index| index as f64)
            .ok_or_else(|| format!("one of {}", param.choices.join(", "))),
        Value::Integer(whole) if param.choices.is_empty() => Ok(*whole as f64),
        Value::Float(number) if param.choices.is_empty() || param.neutral == Some(*number) => Ok(*number),
        _ if param.choices.is_empty() => Err("a number".into()),
        _ => Err(format!("one of {}", param.choices.join(", "))),
    }
}

/// The model file of a command: the shipped one where its name is given and no such file is there.
pub(crate) fn model_file(args: &ModelArgs) -> Result<ModelFile> {
    let shipped = config::WORLDS
        .iter()
        .any(|(name, _)| args.model == Path::new(name))
        && !args.model.is_file();
    let source = if shipped {
        ModelSource::Embedded
    } else {
        ModelSource::Path(&args.model)
    };
    ModelFile::load(source, &args.settings.set)
}

/// The `[[effect]]` table of a setting: what [`Setup`] reads back to the same.
pub(crate) fn effect_table(setting: &Setting) -> config::Effect {
    let params = setting.spec.params;
    let value = |param: &sim::Param, number: f64| match param.choices.get(number as usize) {
        Some(choice) => Value::String((*choice).to_owned()),
        None => Value::Float(number),
    };
    let mut parameters = toml::Table::new();
    let by = match &setting.pattern {
        Pattern::Constant(values) => {
            parameters.extend(
                params
                    .iter()
                    .zip(values)
                    .map(|(p, v)| (p.name.to_owned(), value(p, *v))),
            );
            if let Some(list) = &setting.spec.list {
                let numbers = values.iter().skip(params.len());
                let numbers = numbers.map(|number| Value::Float(*number)).collect();
                parameters.insert(list.name.to_owned(), Value::Array(numbers));
            }
            None
        }
        Pattern::ByTime { start, per_s } => {
            parameters.extend(
                params
                    .iter()
                    .zip(start)
                    .map(|(p, v)| (p.name.to_owned(), value(p, *v))),
            );
            let slopes = params.iter().zip(per_s).filter(|(_, slope)| **slope != 0.0);
            parameters.extend(slopes.map(|(p, slope)| (format!("{}_per_s", p.name), Value::Float(*slope))));
            Some(config::Pattern::Time)
        }
        Pattern::ByRun(runs) => {
            parameters.extend(params.iter().enumerate().map(|(i, p)| {
                (
                    p.name.to_owned(),
                    Value::Array(runs.iter().map(|values| value(p, values[i])).collect()),
                )
            }));
            Some(config::Pattern::Run)
        }
    };
    config::Effect {
        kind: setting.spec.name.to_owned(),
        by,
        parameters,
    }
}

#[cfg(test)]
mod tests {
    use sim::UNLISTED;

    use super::*;

    fn read_back(setting_given: &Setting) -> Setting {
        let text = toml::to_string(&effect_table(setting_given)).unwrap();
        setting(0, &toml::from_str(&text).unwrap()).unwrap()
    }

    #[test]
    fn settings_are_read_back_as_they_were_written() {
        let find = |name| sim::find(name).unwrap();
        let of = |name, pattern| Setting {
            spec: find(name),
            pattern,
        };
        let settings = [
            of("wall-bump", Pattern::Constant(vec![1.0, 0.3, 0.004, 0.1])),
            of("reading-gain", Pattern::ByRun(vec![vec![0.9], vec![1.1]])),
            of(
                "reading-gain",
                Pattern::ByTime {
                    start: vec![0.9],
                    per_s: vec![1e-4],
                },
            ),
            // Acts on, depends on, basis, and as many coefficients as there are.
            Setting::constant(&UNLISTED, [5.0, 6.0, 2.0, 0.1, -0.2, 150.0]),
            Setting::constant(&UNLISTED, [0.0, 1.0, 1.0]),
        ];
        for setting in settings {
            assert_eq!(read_back(&setting), setting);
        }
    }

    #[test]
    fn coefficients_are_numbers_without_a_pattern() {
        let read = |text: &str| setting(0, &toml::from_str(text).unwrap());
        let words =
            "kind = \"unlisted\"\nacts_on = \"reading\"\ndepends_on = \"time\"\nbasis = \"polynomial\"\n";
        let given = |more: &str| read(&format!("{words}{more}"));
        assert_eq!(given("").unwrap(), Setting::constant(&UNLISTED, [5.0, 6.0, 0.0]));
        for broken in [
            "coefficients = 0.1",
            "coefficients = [\"a\"]",
            "by = \"time\"\ncoefficients = [0.1]",
        ] {
            let error = given(broken).unwrap_err().to_string();
            assert!(error.contains("effect.0.coefficients"), "{error}");
        }
        assert!(read("kind = \"reading-gain\"\ncoefficients = [1]").is_err());
    }
}
