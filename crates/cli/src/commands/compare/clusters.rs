//! What is compared: gate tables, or the runs of data sets, each as a cluster with a name of its own.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, Result, ensure};
use pdm::Cluster;
use sim::Circuit;

use crate::args::Compare;
use crate::config::Config;
use crate::dataset::{self, DataSet};
use crate::gate_table::GateTable;
use crate::interrupt;
use crate::laps::{Measured, SampledRun};
use crate::output::Input;
use crate::session::Session;
use crate::setup;

/// What is compared, and where it came from.
pub(super) struct Clusters {
    pub(super) list: Vec<Cluster>,
    pub(super) inputs: Vec<Input>,
    /// The circuit and the laps on it, where there is one.
    pub(super) course: Option<(Arc<Circuit>, Vec<SampledRun>)>,
}

/// Gate tables.
pub(super) fn tables(paths: &[PathBuf]) -> Result<Clusters> {
    let tables: Vec<GateTable> = paths
        .iter()
        .map(|path| GateTable::load(path))
        .collect::<Result<_>>()?;
    for table in &tables[1..] {
        ensure!(
            table.header.len() == tables[0].header.len(),
            "{} has {} columns and {} has {}: laps are compared coordinate by coordinate",
            table.path.display(),
            table.header.len(),
            tables[0].path.display(),
            tables[0].header.len()
        );
    }
    let paths: Vec<String> = paths.iter().map(|path| path.display().to_string()).collect();
    let names = distinct(tables.iter().map(|table| table.name.clone()).collect(), &paths)?;
    let cluster = |(name, table): (String, &GateTable)| {
        Cluster::new(name, &table.rows).with_context(|| table.path.display().to_string())
    };
    Ok(Clusters {
        list: names
            .into_iter()
            .zip(&tables)
            .map(cluster)
            .collect::<Result<_>>()?,
        inputs: tables.into_iter().map(|table| table.input).collect(),
        course: None,
    })
}

/// Data sets and single runs; each circuit is prepared once.
pub(super) fn data_sets(session: &Session, args: &Compare) -> Result<Clusters> {
    let mut circuits: BTreeMap<(String, usize), Arc<Circuit>> = BTreeMap::new();
    let (mut paths, mut inputs, mut runs) = (Vec::new(), Vec::new(), Vec::new());
    for path in &args.data {
        interrupt::check()?;
        let set = load(path)?;
        let source = set.world_source(args.world.as_deref())?;
        let gates = set.declared_config(&Config::shipped())?.run.gates;
        let key = (source.text.clone(), gates);
        if !circuits.contains_key(&key) {
            circuits.insert(key.clone(), setup::circuit(&source, gates)?);
            ensure!(
                circuits.len() == 1,
                "{}: its world or its gates differ from those of {}: laps are compared gate by gate",
                path.display(),
                args.data[0].display()
            );
        }
        let Measured { set, runs: own, .. } =
            Measured::on(set, Arc::clone(&circuits[&key]), &Config::shipped())?;
        paths.extend(own.iter().map(|run| match is_one_run(path) {
            true => path.display().to_string(),
            false => set.folder.join(&run.run).display().to_string(),
        }));
        inputs.extend(set.inputs);
        runs.extend(own);
    }
    let names = distinct(runs.iter().map(|run| run.name.clone()).collect(), &paths)?;
    for (run, name) in runs.iter_mut().zip(names) {
        run.name = name;
    }
    runs.iter()
        .flat_map(SampledRun::remarks)
        .for_each(|remark| session.remark(&remark));
    let list = runs.iter().map(SampledRun::cluster).collect::<Result<_>>()?;
    let course = circuits.into_values().next().map(|circuit| (circuit, runs));
    Ok(Clusters { list, inputs, course })
}

/// A folder is a data set, a file one run.
fn load(path: &Path) -> Result<DataSet> {
    if is_one_run(path) {
        dataset::load_run_csv(path)
    } else {
        DataSet::load(path)
    }
}

fn is_one_run(path: &Path) -> bool {
    path.is_file() && !path.ends_with(dataset::DESCRIPTION)
}

/// Names that tell clusters apart: those that repeat give way to the paths as they were given.
///
/// # Errors
/// The same path twice.
fn distinct(mut names: Vec<String>, paths: &[String]) -> Result<Vec<String>> {
    loop {
        let repeats = |&i: &usize| names.iter().filter(|name| **name == names[i]).count() > 1;
        let repeated: Vec<usize> = (0..names.len()).filter(repeats).collect();
        let Some(&first) = repeated.first() else {
            return Ok(names);
        };
        ensure!(
            repeated.iter().any(|&i| names[i] != paths[i]),
            "{} is given twice, and nothing tells the two apart; leave one out",
            paths[first]
        );
        for i in repeated {
            names[i].clone_from(&paths[i]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_that_is_another_cluster_s_name_makes_that_give_way_too() {
        let owned = |words: [&str; 3]| words.map(str::to_owned).to_vec();
        let paths = owned(["x/a", "y/a", "z/a"]);
        let names = distinct(owned(["n/a", "n/a", "x/a"]), &paths);
        assert_eq!(names.unwrap(), paths);
        let names = distinct(owned(["n/a", "n/b", "x/a"]), &paths);
        assert_eq!(names.unwrap(), ["n/a", "n/b", "x/a"]);
    }
}
