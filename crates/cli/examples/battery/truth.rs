//! How far a data set's true model is from its runs: an answer comes nearer to them only by chance.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result};
use csv::Reader;
use toml::{Table, Value};

use crate::labels::{Label, Set, Truth};
use crate::parameters::comparable;
use crate::program::{Drive, Lapwing};

/// As many laps as an answer is judged by, of other draws.
const LAPS: Drive = Drive {
    runs: 32,
    laps: 20,
    log: false,
    seed: 1 << 50,
};

/// The error of a data set's true model, as `trace.json` defines it, m: the root mean square over the gates of what its mean laps are off
/// a run's, mean over the runs. `None` of sets whose effects a model file cannot name for sure, or which differ from run to run.
///
/// # Errors
/// A model that the program refuses, a file that cannot be read or written.
pub(crate) fn error_m(lapwing: &Lapwing, set: &Set) -> Result<Option<f64>> {
    let Label { name, controller, .. } = &set.label;
    let Some(effects) = effects(&set.label) else {
        return Ok(None);
    };
    let error_m = lapwing.kept(&format!("{name}.truth"), |work| {
        let model = lapwing.model_file(*controller, effects, name)?;
        let [driven, simulated, measured] = ["driven", "simulated", "measured"].map(|name| work.join(name));
        lapwing.drive(&model, LAPS, &driven)?;
        lapwing.sample(&driven, &simulated)?;
        lapwing.sample(&set.folder, &measured)?;
        let all: Vec<Vec<f64>> = runs_of(&simulated)?.into_iter().flatten().collect();
        let expected_m = mean_lap(&all);
        let errors_m: Vec<f64> = (runs_of(&measured)?.iter())
            .map(|run| rms(&expected_m, &mean_lap(run)))
            .collect();
        Ok(errors_m.iter().sum::<f64>() / errors_m.len() as f64)
    });
    error_m.map(Some)
}

/// The effects of a label as a model file has them; `None` where one has no name, another program may mean something else by it, or
/// its size goes by run.
fn effects(label: &Label) -> Option<Vec<Table>> {
    let mut parameters = label.parameters.iter().peekable();
    let mut tables = Vec::new();
    for name in &label.effects {
        let spec = sim::find(name).ok().filter(|_| comparable(name))?;
        let mut table = Table::new();
        table.insert("kind".into(), name.as_str().into());
        while let Some((key, truth)) = parameters.peek()
            && let Some(param) = spec.params.iter().find(|param| param.name == key)
            && !table.contains_key(key)
        {
            let value = match truth {
                Truth::Number(number) if param.whole => Value::Integer(*number as i64),
                Truth::Number(number) => Value::Float(*number),
                Truth::Word(word) => Value::String(word.clone()),
                Truth::ByRun(_) => return None,
            };
            table.insert(key.clone(), value);
            parameters.next();
        }
        tables.push(table);
    }
    parameters.next().is_none().then_some(tables)
}

/// Laps, run by run, as lateral positions at the gates, m; NaN at a gate that a lap missed.
fn runs_of(compared: &Path) -> Result<Vec<Vec<Vec<f64>>>> {
    let folder = compared.join("laps");
    let shown = folder.display();
    let mut runs = Vec::new();
    for entry in fs::read_dir(&folder).with_context(|| format!("{shown}: cannot be read"))? {
        let mut reader = Reader::from_path(entry?.path())?;
        let gates = (reader.headers()?.iter())
            .filter(|name| name.starts_with("gate_"))
            .count();
        let laps = reader.records().map(|record| {
            let position = |field: &str| field.parse().unwrap_or(f64::NAN);
            Ok(record?.iter().take(gates).map(position).collect())
        });
        runs.push(laps.collect::<Result<_, csv::Error>>()?);
    }
    Ok(runs)
}

/// Gate by gate the mean of the laps that did not miss it.
fn mean_lap(laps: &[Vec<f64>]) -> Vec<f64> {
    let gates = laps.first().map_or(0, Vec::len);
    let mean = |gate: usize| {
        let known: Vec<f64> = (laps.iter().map(|lap| lap[gate]))
            .filter(|x| x.is_finite())
            .collect();
        known.iter().sum::<f64>() / known.len() as f64
    };
    (0..gates).map(mean).collect()
}

fn rms(a: &[f64], b: &[f64]) -> f64 {
    let sum: f64 = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum();
    (sum / a.len() as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::labels::{Controller, Kind, Level};

    #[test]
    fn the_parameters_of_a_pair_go_to_the_effects_that_have_them() {
        let number = |name: &str, number: f64| (name.to_owned(), Truth::Number(number));
        let mut label = Label {
            name: "x".into(),
            level: Level::L1,
            kind: Kind::Pair,
            controller: Controller::Braitenberg,
            effects: vec!["slip-level".into(), "one-sensor-gain".into()],
            by_run: false,
            stages: Vec::new(),
            parameters: vec![number("factor", 2.0), number("sensor", 5.0), number("gain", 0.7)],
        };
        let model = |effects: Vec<Table>| effects.iter().map(Table::to_string).collect::<String>();
        let [slip, gain] = ["kind = \"slip-level\"", "kind = \"one-sensor-gain\""];
        let expected = format!("factor = 2.0\n{slip}\ngain = 0.7\n{gain}\nsensor = 5\n");
        assert_eq!(effects(&label).map(model), Some(expected));
        // Of nothing, of what no effect has, of what goes by run, of what is defined in words.
        label.parameters.push(number("gain", 0.7));
        assert_eq!(effects(&label), None);
        label.parameters = vec![("factor".into(), Truth::ByRun(vec![1.0, 2.0]))];
        assert_eq!(effects(&label), None);
        label.effects = vec!["cone-of-view".into()];
        assert_eq!(effects(&label), None);
    }

    #[test]
    fn a_gate_that_a_lap_missed_does_not_count() {
        let laps = [vec![1.0, 2.0], vec![3.0, f64::NAN]];
        assert_eq!(mean_lap(&laps), [2.0, 2.0]);
        assert_eq!(rms(&[2.0, 2.0], &[5.0, 6.0]), 12.5_f64.sqrt());
    }

    #[test]
    fn runs_are_read_from_tables_of_laps() {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("laps")).unwrap();
        let table = "gate_0,gate_1,time_s\n0.1,0.2,3\n0.3,,4\n";
        fs::write(folder.path().join("laps/x_a.csv"), table).unwrap();
        let runs = runs_of(folder.path()).unwrap();
        assert_eq!(runs.len(), 1);
        assert_eq!(runs[0][0], [0.1, 0.2]);
        assert!(runs[0][1][0] == 0.3 && runs[0][1][1].is_nan());
    }
}
