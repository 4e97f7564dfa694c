//! The grid: every combination of the values that `--vary` names.

use std::collections::BTreeMap;
use std::sync::Arc;

use anyhow::{Context, Result, anyhow, ensure};
use serde_json::{Value, json};
use sim::{Circuit, Scene};

use crate::config::{Config, ModelFile, WorldSource};
use crate::setup::{self, Setup};

/// What all points of a grid have in common.
#[derive(Debug, Clone, Copy)]
pub(super) struct Base<'a> {
    pub(super) file: &'a ModelFile,
    pub(super) world: &'a WorldSource,
    pub(super) circuit: &'a Arc<Circuit>,
    /// Runs to be simulated at each point.
    pub(super) runs: usize,
}

/// A key of the model and the values it takes.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Axis {
    pub(super) key: String,
    /// As they were given, at least one.
    pub(super) values: Vec<String>,
}

/// One combination of values.
#[derive(Debug, Clone)]
pub(super) struct Point {
    /// `key=value, key=value`.
    pub(super) name: String,
    /// The place of its value on each axis.
    pub(super) places: Vec<usize>,
    pub(super) setup: Setup,
}

/// All combinations, the last key changing fastest.
#[derive(Debug, Clone)]
pub(super) struct Grid {
    pub(super) axes: Vec<Axis>,
    pub(super) points: Vec<Point>,
}

impl Grid {
    /// The grid over a model; walls are cut once for each way they are cut.
    ///
    /// # Errors
    /// A `--vary` that is no `KEY=V1,V2,...`, a key that is unknown, there twice, or what laps are compared by; a value
    /// that the model refuses.
    pub(super) fn new(base: &Base<'_>, vary: &[String]) -> Result<Self> {
        let axes: Vec<Axis> = vary.iter().map(|text| Axis::parse(text)).collect::<Result<_>>()?;
        for (i, axis) in axes.iter().enumerate() {
            let twice = axes[..i].iter().any(|other| other.key == axis.key);
            ensure!(
                !twice,
                "--vary {} is given twice; put all its values into one",
                axis.key
            );
            ensure!(
                !base.file.is_set(&axis.key),
                "{key} is given by --set and by --vary; leave one out",
                key = axis.key
            );
        }
        let mut scenes = BTreeMap::new();
        let points = combinations(&axes)
            .into_iter()
            .map(|places| Point::new(base, &axes, places, &mut scenes))
            .collect::<Result<_>>()?;
        Ok(Self { axes, points })
    }

    /// The keys and their values, in the order of the command line.
    pub(super) fn axes_json(&self) -> Value {
        let axis = |axis: &Axis| {
            let values: Vec<Value> = axis.values.iter().map(|value| json_value(value)).collect();
            (axis.key.clone(), json!(values))
        };
        Value::Object(self.axes.iter().map(axis).collect())
    }

    /// A point's values, in the order of the axes, as they were given.
    pub(super) fn values(&self, point: usize) -> impl Iterator<Item = &str> {
        self.axes
            .iter()
            .zip(&self.points[point].places)
            .map(|(axis, &place)| axis.values[place].as_str())
    }
}

impl Axis {
    fn parse(text: &str) -> Result<Self> {
        let (key, values) = text
            .split_once('=')
            .filter(|(key, values)| !key.trim().is_empty() && !values.trim().is_empty())
            .ok_or_else(|| anyhow!("--vary {text}: a key and its values are needed, as KEY=V1,V2,..."))?;
        let key = key.trim().to_owned();
        let fixed = matches!(key.as_str(), "world" | "run.gates");
        ensure!(
            !fixed,
            "--vary {text}: laps are compared gate by gate, so all points need the same world and gates"
        );
        let values = split(values);
        for (i, value) in values.iter().enumerate() {
            ensure!(
                !value.is_empty(),
                "--vary {text}: there is nothing between two commas; remove one"
            );
            let same = |other: &String| json_value(other) == json_value(value);
            ensure!(
                !values[..i].iter().any(same),
                "--vary {text}: {value} is there twice; remove one"
            );
        }
        Ok(Self { key, values })
    }

    /// The values as numbers, if all of them are.
    pub(super) fn numbers(&self) -> Option<Vec<f64>> {
        self.values.iter().map(|value| value.parse().ok()).collect()
    }
}

/// Values at the commas that stand outside brackets and quotation marks, without blanks round them.
fn split(text: &str) -> Vec<String> {
    let (mut values, mut depth, mut quoted) = (vec![String::new()], 0_i32, false);
    for letter in text.chars() {
        match letter {
            '"' => quoted = !quoted,
            '[' | '{' if !quoted => depth += 1,
            ']' | '}' if !quoted => depth -= 1,
            _ => {}
        }
        match values.last_mut() {
            Some(value) if letter != ',' || quoted || depth > 0 => value.push(letter),
            _ => values.push(String::new()),
        }
    }
    values.iter().map(|value| value.trim().to_owned()).collect()
}

/// Every combination of places on the axes.
fn combinations(axes: &[Axis]) -> Vec<Vec<usize>> {
    axes.iter().fold(vec![Vec::new()], |before, axis| {
        let extended = |places: &Vec<usize>| {
            let places = places.clone();
            (0..axis.values.len()).map(move |place| [places.as_slice(), &[place]].concat())
        };
        before.iter().flat_map(extended).collect()
    })
}

impl Point {
    fn new(
        base: &Base<'_>,
        axes: &[Axis],
        places: Vec<usize>,
        scenes: &mut BTreeMap<String, Scene>,
    ) -> Result<Self> {
        let value = |(axis, &place): (&Axis, &usize)| (axis.key.clone(), axis.values[place].clone());
        let chosen: Vec<(String, String)> = axes.iter().zip(&places).map(value).collect();
        let config = chosen
            .iter()
            .try_fold(base.file.config.clone(), |config, (key, value)| {
                config
                    .with(key, value)
                    .with_context(|| format!("--vary {key}={value}"))
            })?;
        let setup = setup(base, &config, scenes).map_err(|error| locate(base, &chosen, error))?;
        let name: Vec<String> = chosen
            .iter()
            .map(|(key, value)| format!("{key}={value}"))
            .collect();
        Ok(Self {
            name: name.join(", "),
            places,
            setup,
        })
    }
}

fn setup(
    base: &Base<'_>,
    config: &Config,
    scenes: &mut BTreeMap<String, Scene>,
) -> Result<Setup, sim::Error> {
    let model = setup::model(config, &base.circuit.course)?;
    let machine = &model.machine;
    let cut = format!(
        "{:?} {} {} {:?}",
        model.wall, machine.robot.body_radius_m, machine.range_m, machine.mounts
    );
    let scene = match scenes.get(&cut) {
        Some(scene) => scene.clone(),
        None => scenes
            .entry(cut)
            .or_insert(Scene::new(Arc::clone(base.circuit), &model, None)?)
            .clone(),
    };
    for run in 0..base.runs {
        scene.world(&model, run)?; // effects have values for every run
    }
    Ok(Setup { model, scene })
}

/// The error with the `--vary`, or the place in the model, where its key was set.
fn locate(base: &Base<'_>, chosen: &[(String, String)], error: sim::Error) -> anyhow::Error {
    let around = |key: &str, at_fault: &str| {
        at_fault
            .strip_prefix(key)
            .is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
    };
    let blamed = setup::blamed(&error);
    match chosen
        .iter()
        .find(|(key, _)| blamed.iter().any(|at_fault| around(key, at_fault)))
    {
        Some((key, value)) => anyhow!("--vary {key}={value}: {error}"),
        None => setup::locate(base.file, base.world, error),
    }
}

/// A value as JSON has it: a number, an array, or else a string.
pub(super) fn json_value(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|_| Value::String(text.to_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::args::{ModelArgs, Settings};

    fn grid(vary: &[&str]) -> Result<Grid, String> {
        let settings = Settings {
            set: Vec::new(),
            world: None,
        };
        let file = setup::model_file(&ModelArgs {
            model: "roduit2007".into(),
            settings,
        })
        .unwrap();
        let world = file.world(None).unwrap();
        let circuit = setup::circuit(&world, 100).unwrap();
        let base = Base {
            file: &file,
            world: &world,
            circuit: &circuit,
            runs: 1,
        };
        let vary: Vec<String> = vary.iter().map(|text| (*text).to_owned()).collect();
        Grid::new(&base, &vary).map_err(|error| format!("{error:#}"))
    }

    #[test]
    fn the_last_key_changes_fastest() {
        let grid = grid(&["slip.level=0.1, 1", "sensor.kind=improved,original"]).unwrap();
        let names: Vec<_> = grid.points.iter().map(|point| point.name.as_str()).collect();
        assert_eq!(names[1], "slip.level=0.1, sensor.kind=original");
        assert_eq!(names[2], "slip.level=1, sensor.kind=improved");
        assert_eq!(grid.points[2].setup.model.machine.slip_level, 1.0);
        assert_eq!(
            grid.axes_json().to_string(),
            r#"{"slip.level":[0.1,1],"sensor.kind":["improved","original"]}"#
        );
    }

    #[test]
    fn commas_inside_brackets_and_quotes_part_nothing() {
        assert_eq!(
            split(r#"[[0, 1], [2, 3]], "a,b" ,c"#),
            ["[[0, 1], [2, 3]]", r#""a,b""#, "c"]
        );
    }

    #[test]
    fn walls_are_cut_once_for_each_way() {
        let grid = grid(&["wall.max_error_m=0.005,0.05", "slip.level=0,1"]).unwrap();
        let walls: Vec<_> = grid
            .points
            .iter()
            .map(|point| std::ptr::from_ref(point.setup.scene.walls()))
            .collect();
        assert!(
            walls[0] == walls[1] && walls[2] == walls[3] && walls[0] != walls[2],
            "{walls:?}"
        );
    }

    #[test]
    fn faults_name_the_flag() {
        for (vary, expected) in [
            (
                vec!["slip.level"],
                "--vary slip.level: a key and its values are needed, as KEY=V1,V2,...",
            ),
            (
                vec!["slip.level=1,,2"],
                "--vary slip.level=1,,2: there is nothing between two commas; remove one",
            ),
            (
                vec!["slip.level=1,1"],
                "--vary slip.level=1,1: 1 is there twice; remove one",
            ),
            (
                vec!["slip.level=1", "slip.level=0"],
                "--vary slip.level is given twice; put all its values into one",
            ),
            (
                vec!["slip.levl=1"],
                "--vary slip.levl=1: unknown key `slip.levl`; nearest known: slip.level",
            ),
            (
                vec!["slip.level=0,1.5"],
                "--vary slip.level=1.5: slip.level = 1.5 is outside [0, 1]",
            ),
            (
                vec!["run.gates=50,100"],
                "--vary run.gates=50,100: laps are compared gate by gate, so all points need the same world and gates",
            ),
        ] {
            assert_eq!(grid(&vary).unwrap_err(), expected);
        }
    }
}
