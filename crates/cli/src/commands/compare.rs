//! `lapwing compare`: one Point Distribution Model of all clusters, and every pair in it.

mod clusters;

use anyhow::{Context, Result, bail};
use pdm::{Cluster, Modes, Pdm, Projection, TestResult};
use serde_json::{Value, json};

use crate::args::Compare;
use crate::figures::{self, DrawnRun, Scale};
use crate::gate_table;
use crate::interrupt;
use crate::laps::SampledRun;
use crate::output::{OutDir, Work};
use crate::session::Session;
use crate::table::{Table, counted, probability};

pub(crate) fn run(session: &Session, args: &Compare) -> Result<()> {
    let asked = args.modes.as_deref().map(parse_modes).transpose()?;
    let clusters = if args.sampled {
        clusters::tables(&args.data)?
    } else {
        clusters::data_sets(session, args)?
    };
    let pdm = Pdm::fit(&clusters.list)?;
    let modes = asked.unwrap_or_else(|| usual_modes(&pdm));
    let projections: Vec<Projection> = clusters
        .list
        .iter()
        .map(|cluster| pdm.project(cluster, modes))
        .collect::<Result<_, _>>()?;
    let document = compare(session, &pdm, &clusters.list, &projections, args.permutations)?;
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
        folder.write("projections.csv", projections_csv(&projections)?)?;
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
            let drawn = |run| DrawnRun {
                label: label(run),
                laps: &run.laps,
                rest: Vec::new(),
            };
            let drawn: Vec<DrawnRun<'_>> = runs.iter().map(drawn).collect();
            folder.write("laps.svg", figures::laps_map(circuit, &drawn).to_svg()?)?;
            for (name, cluster) in gate_table::file_names(&clusters.list).iter().zip(&clusters.list) {
                folder.write(&format!("laps/{name}.csv"), gate_table::to_csv(cluster))?;
            }
        }
        folder.finish(&session.manifest(configuration, clusters.inputs))?;
    }
    if args.json {
        session.print_json(&document)
    } else {
        session.print(&text(&document, modes))
    }
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

fn compare(
    session: &Session,
    pdm: &Pdm,
    clusters: &[Cluster],
    projections: &[Projection],
    permutations: u32,
) -> Result<Value> {
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

/// Where the laps are in the modes that are compared; laps count from 1, as the rows of the gate tables do.
fn projections_csv(projections: &[Projection]) -> Result<Vec<u8>> {
    let mut csv = csv::Writer::from_writer(Vec::new());
    let modes = projections.first().map_or(0, |p| p.points().ncols());
    let own = ["cluster", "lap"].map(str::to_owned);
    csv.write_record(own.into_iter().chain((1..=modes).map(|r| format!("mode_{r}"))))?;
    for projection in projections {
        for (lap, point) in (1..).zip(projection.points().row_iter()) {
            let own: [String; 2] = [projection.name().to_owned(), format!("{lap}")];
            csv.write_record(own.into_iter().chain(point.iter().map(f64::to_string)))?;
        }
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
    let number = |value: &Value| value.as_u64().unwrap_or(0) as usize;
    let laps = list("clusters").iter().map(|c| number(&c["laps"])).sum();
    let clusters = list("clusters").len();
    let mut text = format!(
        "{} in {}, {}; variance in the first modes: {}\n\n",
        counted(laps, "lap"),
        counted(clusters, "cluster"),
        counted(number(&document["gates"]), "gate"),
        explained.join(", "),
    );
    if clusters == 1 {
        return text + "There is no other cluster to compare it with.\n";
    }
    let used = list("pairs").iter().map(|pair| number(&pair["modes"]));
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
