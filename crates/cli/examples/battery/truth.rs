//! How far a data set's true model is from its runs: an answer comes nearer to them only by chance.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result};
use csv::Reader;
use diagnose::{mean_lap, rms};
use sim::Spec;
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
        let simulated = runs_of(&simulated)?;
        let expected_m = mean_lap(simulated.iter().flatten()).context("the true model drives laps")?;
        let errors_m: Vec<f64> = (runs_of(&measured)?.iter())
            .filter_map(|run| Some(rms(&expected_m, &mean_lap(run)?)))
            .collect();
        Ok(errors_m.iter().sum::<f64>() / errors_m.len() as f64)
    });
    error_m.map(Some)
}

/// The effects of a label as a model file has them; `None` where one has no name, another program may mean something else by it, its
/// size goes by run, or it is not clear which of them a parameter belongs to.
fn effects(label: &Label) -> Option<Vec<Table>> {
    let specs = (label.effects.iter()).map(|name| sim::find(name).ok().filter(|_| comparable(name)));
    let specs: Vec<&Spec> = specs.collect::<Option<_>>()?;
    let mut ways = shared_out(&specs, &label.parameters);
    ways.pop().filter(|_| ways.is_empty())
}

/// Every way in which effects may have the parameters, in their order and at least one each.
fn shared_out(specs: &[&Spec], parameters: &[(String, Truth)]) -> Vec<Vec<Table>> {
    let Some((spec, others)) = specs.split_first() else {
        return Vec::from_iter(parameters.is_empty().then(Vec::new));
    };
    let mut ways = Vec::new();
    for count in 1..=parameters.len() {
        let (own, rest) = parameters.split_at(count);
        let Some(first) = effect(spec, own) else { break };
        for others in shared_out(others, rest) {
            ways.push([vec![first.clone()], others].concat());
        }
    }
    ways
}

/// An effect with these parameters; `None` where it lacks one of them, or one goes by run.
fn effect(spec: &Spec, parameters: &[(String, Truth)]) -> Option<Table> {
    let mut table = Table::from_iter([("kind".to_owned(), spec.name.into())]);
    for (key, truth) in parameters {
        let param = spec.params.iter().find(|param| param.name == key)?;
        let value = match truth {
            Truth::Number(number) if param.whole => Value::Integer(*number as i64),
            Truth::Number(number) => Value::Float(*number),
            Truth::Word(word) => Value::String(word.clone()),
            Truth::ByRun(_) => return None,
        };
        if table.insert(key.clone(), value).is_some() {
            return None;
        }
    }
    Some(table)
}

/// Sampled laps, run by run, as lateral positions at the gates, m.
fn runs_of(sampled: &Path) -> Result<Vec<Vec<Vec<f64>>>> {
    let folder = sampled.join("laps");
    let shown = folder.display();
    let mut runs = Vec::new();
    for entry in fs::read_dir(&folder).with_context(|| format!("{shown}: cannot be read"))? {
        let mut reader = Reader::from_path(entry?.path())?;
        runs.push(reader.deserialize().collect::<Result<_, csv::Error>>()?);
    }
    Ok(runs)
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
        // Both have an angle, and the first one another number before it.
        label.effects = vec!["marker-offset".into(), "sensor-rotation".into()];
        label.parameters = vec![number("forward_m", 0.01), number("angle_rad", 0.06)];
        let [marker, rotation] = ["kind = \"marker-offset\"", "kind = \"sensor-rotation\""];
        let expected = format!("forward_m = 0.01\n{marker}\nangle_rad = 0.06\n{rotation}\n");
        assert_eq!(effects(&label).map(model), Some(expected));
        // Of two markers it is not clear whose the second number is.
        label.effects[1] = "marker-offset".into();
        label.parameters = vec![
            number("left_m", 0.01),
            number("forward_m", 0.01),
            number("angle_rad", 0.06),
        ];
        assert_eq!(effects(&label), None);
        label.effects = vec!["slip-level".into(), "one-sensor-gain".into()];
        label.parameters = vec![number("factor", 2.0), number("sensor", 5.0), number("gain", 0.7)];
        // Of what no effect has, of what goes by run, of what is defined in words.
        label.parameters.push(number("gain", 0.7));
        assert_eq!(effects(&label), None);
        label.parameters = vec![("factor".into(), Truth::ByRun(vec![1.0, 2.0]))];
        assert_eq!(effects(&label), None);
        label.effects = vec!["cone-of-view".into()];
        assert_eq!(effects(&label), None);
    }

    #[test]
    fn runs_are_read_from_tables_of_laps() {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("laps")).unwrap();
        let table = "gate_0,gate_1\n0.1,0.2\n0.3,0.4\n";
        let file = folder.path().join("laps/x_a.csv");
        fs::write(&file, table).unwrap();
        assert_eq!(runs_of(folder.path()).unwrap(), [[[0.1, 0.2], [0.3, 0.4]]]);
        fs::write(&file, table.replace("0.4", "")).unwrap();
        assert!(runs_of(folder.path()).is_err());
    }
}
