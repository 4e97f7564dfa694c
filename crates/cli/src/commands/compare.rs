//! `lapwing compare`: one Point Distribution Model of all clusters, and every pair in it.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};
use pdm::{Cluster, Modes, Pdm, TestResult};
use serde_json::{Value, json};
use sim::Circuit;
use std::sync::Arc;

use crate::args::Compare;
use crate::config::Config;
use crate::dataset::{self, DataSet};
use crate::figures::{self, Scale};
use crate::gate_table::GateTable;
use crate::interrupt;
use crate::laps::{Measured, SampledRun};
use crate::output::{Input, OutDir, Work};
use crate::session::Session;
use crate::setup;
use crate::table::{Table, probability};

pub(crate) fn run(session: &Session, args: &Compare) -> Result<()> {
    let asked = args.modes.as_deref().map(parse_modes).transpose()?;
    let clusters = if args.sampled {
        tables(&args.data)?
    } else {
        data_sets(session, args)?
    };
    let pdm = Pdm::fit(&clusters.list)?;
    let modes = asked.unwrap_or_else(|| usual_modes(&pdm));
    let document = compare(session, &pdm, &clusters.list, modes, args.permutations)?;
    if let Some(out) = &args.out {
        let configuration =
            json!({ "data": args.data, "modes": shown(modes), "permutations": args.permutations });
        let folder = OutDir::create(
            out,
            &Work::new("compare", &configuration),
            &clusters.inputs,
            false,
        )?;
        folder.write("compare.json", format!("{document:#}\n"))?;
        folder.write("pairs.csv", pairs_csv(&document)?)?;
        if pdm.degrees_of_freedom() >= 2 {
            let scale = if args.sampled { Scale::PLAIN } else { Scale::MM };
            folder.write(
                "modes.svg",
                figures::modes_figure(&pdm, &clusters.list, scale)?.to_svg()?,
            )?;
        }
        if let Some((circuit, runs)) = &clusters.course {
            let label = |run: &SampledRun| match args.data.as_slice() {
                [_] => format!("run {}", run.run),
                _ => run.name.clone(),
            };
            let labelled = runs.iter().map(|run| (label(run), run));
            folder.write("laps.svg", figures::laps_map(circuit, labelled).to_svg()?)?;
        }
        folder.finish(&session.manifest(configuration, clusters.inputs))?;
    }
    if args.json {
        session.print_json(&document)
    } else {
        session.print(&text(&document, modes))
    }
}

/// What is compared, and where it came from.
struct Clusters {
    list: Vec<Cluster>,
    inputs: Vec<Input>,
    /// The circuit and the laps on it, where there is one.
    course: Option<(Arc<Circuit>, Vec<SampledRun>)>,
}

fn parse_modes(text: &str) -> Result<Modes> {
    if text == "all" {
        return Ok(Modes::All);
    }
    match text.parse() {
        Ok(count) if count > 0 => Ok(Modes::First(count)),
        _ => bail!("--modes {text}: a number of modes from 1, or all, is needed"),
    }
}

/// The first two modes, as in the paper's figures, as far as they are there.
fn usual_modes(pdm: &Pdm) -> Modes {
    const USUAL: usize = 2;
    Modes::First(USUAL.min(pdm.degrees_of_freedom()))
}

/// As on the command line.
fn shown(modes: Modes) -> String {
    match modes {
        Modes::First(count) => count.to_string(),
        Modes::All => "all".into(),
    }
}

/// Gate tables.
fn tables(paths: &[PathBuf]) -> Result<Clusters> {
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
fn data_sets(session: &Session, args: &Compare) -> Result<Clusters> {
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

fn compare(
    session: &Session,
    pdm: &Pdm,
    clusters: &[Cluster],
    modes: Modes,
    permutations: u32,
) -> Result<Value> {
    let projections: Vec<pdm::Projection> = clusters
        .iter()
        .map(|cluster| pdm.project(cluster, modes))
        .collect::<Result<_, _>>()?;
    let used = projections.first().map_or(0, |p| p.points().ncols());
    let pair_count = clusters.len() * clusters.len().saturating_sub(1) / 2;
    let progress = session.progress("comparing", pair_count as u64);
    let mut pairs = Vec::with_capacity(pair_count);
    for (i, a) in projections.iter().enumerate() {
        for (j, b) in projections.iter().enumerate().skip(i + 1) {
            interrupt::check()?;
            let t = pdm::hotelling(a, b)?;
            let mut pair = json!({
                "a": a.name(), "b": b.name(), "modes": t.df1, "distance": t.distance, "t2": t.t2,
                "f": t.f, "df1": t.df1, "df2": t.df2, "p": t.p,
            });
            if permutations > 0 {
                let energy =
                    pdm::energy_test(&clusters[i], &clusters[j], permutations as usize, session.seed())?;
                pair["energy"] = test(&energy);
            }
            pairs.push(pair);
            progress.tick(1);
        }
    }
    Ok(json!({
        "clusters": clusters.iter().map(|c| json!({ "name": c.name(), "laps": c.len() })).collect::<Vec<_>>(),
        "gates": clusters.first().map_or(0, Cluster::dimension),
        "modes": used,
        "explained": pdm.explained(),
        "eigenvalues": pdm.eigenvalues(),
        "pairs": pairs,
    }))
}

fn test(result: &TestResult) -> Value {
    json!({ "statistic": result.statistic, "p": result.p, "method": result.method })
}

fn pairs_csv(document: &Value) -> Result<Vec<u8>> {
    let mut csv = csv::Writer::from_writer(Vec::new());
    csv.write_record(["a", "b", "distance", "t2", "f", "df1", "df2", "p", "energy_p"])?;
    for pair in document["pairs"].as_array().into_iter().flatten() {
        let names = ["a", "b"].map(|key| pair[key].as_str().unwrap_or("").to_owned());
        let numbers = ["distance", "t2", "f", "df1", "df2", "p"].map(|key| pair[key].to_string());
        let energy = pair["energy"]["p"]
            .as_f64()
            .map_or(String::new(), |p| p.to_string());
        csv.write_record(names.into_iter().chain(numbers).chain([energy]))?;
    }
    csv.into_inner().context("cannot write to memory")
}

fn text(document: &Value, modes: Modes) -> String {
    let list = |key: &str| document[key].as_array().map_or(&[][..], Vec::as_slice);
    let explained: Vec<String> = list("explained")
        .iter()
        .take(5)
        .map(|share| format!("{:.1} %", 100.0 * share.as_f64().unwrap_or(0.0)))
        .collect();
    let laps = list("clusters").iter().filter_map(|c| c["laps"].as_u64()).sum();
    let clusters = list("clusters").len() as u64;
    let mut text = format!(
        "{} in {}, {}; variance in the first modes: {}\n\n",
        counted(laps, "lap"),
        counted(clusters, "cluster"),
        counted(document["gates"].as_u64().unwrap_or(0), "gate"),
        explained.join(", "),
    );
    if clusters == 1 {
        return text + "There is no other cluster to compare it with.\n";
    }
    let used = list("pairs").iter().filter_map(|pair| pair["modes"].as_u64());
    let [fewest, most] = [used.clone().min().unwrap_or(0), used.max().unwrap_or(0)];
    let modes = match modes {
        Modes::First(_) => counted(most, "mode"),
        Modes::All if fewest == most => format!("all modes ({most} a pair)"),
        Modes::All => format!("all modes ({fewest} to {most} a pair)"),
    };
    let title = format!("Inter-cluster distances in {modes} (eq. 8), Hotelling's and the energy test");
    let mut table = Table::new(title, &["a", "b", "distance", "T2", "F", "df", "p", "energy p"]);
    for pair in list("pairs") {
        let number = |key: &str| pair[key].as_f64().unwrap_or(f64::NAN);
        table.push([
            pair["a"].as_str().unwrap_or("").to_owned(),
            pair["b"].as_str().unwrap_or("").to_owned(),
            format!("{:.2}", number("distance")),
            format!("{:.2}", number("t2")),
            format!("{:.2}", number("f")),
            format!("{}, {}", pair["df1"], pair["df2"]),
            probability(number("p")),
            pair["energy"]["p"].as_f64().map_or("-".into(), probability),
        ]);
    }
    text += &table.to_text();
    if fewest < most {
        text += "\nDistances in different numbers of modes (the first number of df) are not comparable.\n";
    }
    text
}

/// So many of them, in words.
fn counted(count: u64, what: &str) -> String {
    match count {
        1 => format!("1 {what}"),
        _ => format!("{count} {what}s"),
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
