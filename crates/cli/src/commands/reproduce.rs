//! `lapwing reproduce`: the experiments of the paper, on measured and simulated laps.

use std::path::{Path, PathBuf};

use anyhow::Result;
use serde_json::{Map, Value, json};

use crate::args::Reproduce;
use crate::case_study::CaseStudy;
use crate::dataset::DataSet;
use crate::experiments::{Block, Claim, EXPERIMENTS, Measurements, Outcome, Section, Study};
use crate::interrupt;
use crate::output::{OutDir, Work};
use crate::ray_study;
use crate::report::Report;
use crate::session::Session;
use crate::table::Table;
use crate::trace::Cache;

/// Numbers of segments whose ray casting is measured.
const SEGMENTS: [usize; 5] = [15, 47, 105, 1000, 10_000];

/// Draws behind the ladder of wall errors, at the most.
const LADDER_DRAWS: usize = 20;

/// Where the report goes if `--out` does not say.
const FOLDER: &str = "lapwing-report";

pub(crate) fn run(session: &Session, args: &Reproduce) -> Result<()> {
    let out = args.out.clone().unwrap_or_else(|| PathBuf::from(FOLDER));
    let measured = Measurements::load(&args.measured)?;
    measured
        .remarks()
        .iter()
        .for_each(|remark| session.remark(remark));
    let inputs = measured.inputs();
    let configuration = json!({
        "standard": measured.standard()?, "rule_based": measured.rule_based()?,
        "seed": session.seed(), "seeds": args.seeds, "trace": !args.no_trace, "inputs": inputs,
    });
    let folder = OutDir::create(&out, &Work::new("reproduce", &configuration), &inputs, false)?;
    let draws = args.seeds as usize;
    // A comparison of a draw takes about as long as a run.
    let total = draws * (Study::RUNS_PER_DRAW + EXPERIMENTS.len());
    let progress = session.progress("driving", total as u64);
    let study = Study::new(measured, session.seed(), draws, &progress)?;
    progress.message("comparing");
    let outcome = |experiment: &crate::experiments::Experiment| {
        interrupt::check()?;
        let outcome = experiment(&study)?;
        progress.tick(draws as u64);
        Ok(outcome)
    };
    let outcomes: Vec<Outcome> = EXPERIMENTS.iter().map(outcome).collect::<Result<_>>()?;
    progress.message("casting rays");
    let costs = ray_study::measure(&study.standard, &study.measured.circuit, &SEGMENTS, &|| ())?;
    let ladder_draws = (session.seed(), draws.min(LADDER_DRAWS), study.laps);
    let rungs = ray_study::ladder(
        &study.standard,
        &study.measured.circuit,
        &study.real,
        ladder_draws,
    )?;
    drop(progress);
    let cache = Cache::new(&args.signatures);
    let case_study = (!args.no_trace)
        .then(|| CaseStudy::new(session, &study, &cache))
        .transpose()?;
    let tables = tables_json(session.seed(), draws, &outcomes, case_study.as_ref());
    let text = text(&outcomes, case_study.as_ref(), &out);
    let mut files = report(session.seed(), &study, outcomes);
    let place = files.report.sections.len() - 2; // after the experiments
    files
        .report
        .sections
        .insert(place, ray_study::section(&rungs, ladder_draws.1));
    files
        .csv
        .push(("ladder.csv", ray_study::ladder_table(&rungs).to_csv()));
    if let Some(case_study) = &case_study {
        files.report.sections.push(case_study.section());
        for (name, text) in case_study.files() {
            folder.write(&name, text)?;
        }
    }
    write(&folder, &tables, files)?;
    folder.write(ray_study::PICTURE, ray_study::figure(&costs, &rungs).to_svg()?)?;
    interrupt::check()?;
    folder.finish(&session.manifest(configuration, inputs))?;
    if args.json {
        session.print_json(&tables)
    } else {
        session.print(&text)
    }
}

/// `tables.json`.
fn tables_json(seed: u64, draws: usize, outcomes: &[Outcome], case_study: Option<&CaseStudy>) -> Value {
    let mut tables = Map::new();
    tables.insert("seed".into(), seed.into());
    tables.insert("draws".into(), draws.into());
    let parts = outcomes.iter().flat_map(|outcome| outcome.json.iter().cloned());
    tables.extend(parts.map(|(key, value)| (key.to_owned(), value)));
    tables.insert("claims".into(), claims(outcomes).map(Claim::json).collect());
    tables.extend(case_study.map(|study| ("trace".to_owned(), study.json())));
    Value::Object(tables)
}

fn claims(outcomes: &[Outcome]) -> impl Iterator<Item = &Claim> {
    outcomes.iter().flat_map(|outcome| outcome.section.claims())
}

/// What is printed: every table, every claim, what the model lacks, and where the report is.
fn text(outcomes: &[Outcome], case_study: Option<&CaseStudy>, out: &Path) -> String {
    let mut text = String::new();
    for table in outcomes.iter().flat_map(|outcome| outcome.section.tables()) {
        text += &format!("{}\n", table.to_text());
    }
    let held = claims(outcomes).filter(|claim| claim.holds).count();
    text += &format!(
        "Claims of section IV: {held} of {} hold here\n",
        claims(outcomes).count()
    );
    for claim in claims(outcomes) {
        text += &format!(
            "{:>4}  {}\n      paper: {}\n      here:  {}\n",
            if claim.holds { "yes" } else { "NO" },
            claim.claim,
            claim.paper,
            claim.here
        );
    }
    if let Some(case_study) = case_study {
        text += &format!("\n{}", case_study.text());
    }
    text + &format!("\nreport: {}\n", out.join("report.html").display())
}

struct Files {
    report: Report,
    csv: Vec<(&'static str, String)>,
}

fn write(folder: &OutDir, tables: &Value, Files { report, csv }: Files) -> Result<()> {
    folder.write("tables.json", format!("{tables:#}\n"))?;
    folder.write("report.html", report.to_html()?)?;
    for (name, text) in csv {
        folder.write(name, text)?;
    }
    for picture in report.sections.iter().flat_map(Section::pictures) {
        folder.write(&format!("figures/{}.svg", picture.file), picture.figure.to_svg()?)?;
    }
    Ok(())
}

fn report(seed: u64, study: &Study, outcomes: Vec<Outcome>) -> Files {
    let carries = carry_over(&outcomes);
    let lead = lead(study, &outcomes);
    let (mut sections, mut csv) = (Vec::new(), Vec::new());
    for outcome in outcomes {
        sections.push(outcome.section);
        csv.extend(outcome.csv);
    }
    sections.push(carries);
    sections.push(configuration(seed, study));
    let title = "Laps of a mobile robot, measured and simulated: the experiments of Roduit, Martinoli and Jacot (2007)";
    Files {
        report: Report {
            title: title.into(),
            lead,
            sections,
        },
        csv,
    }
}

/// What the data are, the method in three lines, and how many claims hold.
fn lead(study: &Study, outcomes: &[Outcome]) -> Vec<Block> {
    let (held, all) = (
        claims(outcomes).filter(|claim| claim.holds).count(),
        claims(outcomes).count(),
    );
    let (gates, laps, draws) = (study.circuit().gates.len(), study.laps, study.draws.len());
    let sets = [&study.measured.rule_based.set, &study.measured.braitenberg.set];
    let paragraphs = [
        format!(
            "This report repeats section IV of “A quantitative method for comparing trajectories of mobile robots using \
             point distribution models” (IROS 2007). {} Of the {all} claims of that section that can be put to the test, \
             {held} hold on these laps.",
            provenance(sets)
        ),
        format!(
            "Method. A lap is its positions on {gates} gates across the corridor (eq. 1); the first lap of a run is \
             dropped. All laps that are compared go into one Point Distribution Model (PDM), whose modes are the \
             principal axes of their covariance (eq. 2). Two clusters are compared in the first two modes by the distance \
             of their means in units of their pooled covariance (eq. 8) and by Hotelling's test (eq. 9)."
        ),
        format!(
            "Confidence. A simulated cluster is one run of {laps} laps, as in the paper, and therefore one draw. All that \
             is simulated is drawn {draws} times from random streams of its own, with a PDM for each draw: numbers are \
             means over the draws with the interval that holds the middle 95 % of them in brackets, and figures show the \
             first draw. The interval tells how much one draw of {laps} laps moves, not how well the mean is known. A \
             claim about simulated laps holds if it does in at least 95 % of the draws."
        ),
    ];
    paragraphs.into_iter().map(Block::Text).collect()
}

/// Where the measured laps come from.
fn provenance(sets: [&DataSet; 2]) -> String {
    let named = |set: &&DataSet| match set.note.as_str() {
        "" => set.name.clone(),
        note => format!("{} ({note})", set.name),
    };
    let (shipped, given): (Vec<&DataSet>, Vec<&DataSet>) = sets.into_iter().partition(|set| set.is_shipped());
    let mut text = String::new();
    if !given.is_empty() {
        text += &format!(
            "The measured laps are those of {}. ",
            given.iter().map(named).collect::<Vec<_>>().join(" and ")
        );
    }
    if !shipped.is_empty() {
        let names = shipped
            .iter()
            .map(|set| set.name.as_str())
            .collect::<Vec<_>>()
            .join(" and ");
        text += &format!(
            "The measured laps of {names} are generated: the paper's camera laps were never published, and these stand in \
             for them. They come from a separate program whose robot differs from the declared model in ways that are not \
             declared. "
        );
    }
    text.trim_end().to_owned()
}

/// What of the paper is not so here, and why that is to be expected or not.
fn carry_over(outcomes: &[Outcome]) -> Section {
    let mut blocks = vec![Block::Text(
        "The paper's laps, its walls as numbers and the constants of its controllers were never published: neither the \
         laps nor the shape of the shipped course are the paper's, only the numbers of segments are. So printed distances \
         are not expected to be met, and claims about those particular runs (which run is nearest, how far runs are \
         apart, which wall error happens to be nearest) need not hold; what the method finds, and the order of the \
         influences, should. Distances depend on how much laps scatter: measured laps scatter more or less than the \
         paper's, and all distances shrink or grow with that. Modes belong to the PDM of each comparison: their axes mean \
         different things in different figures and in the paper's."
            .into(),
    )];
    let failed: Vec<Claim> = claims(outcomes).filter(|claim| !claim.holds).cloned().collect();
    if failed.is_empty() {
        blocks.push(Block::Text("Every claim holds on these laps.".into()));
    } else {
        blocks.push(Block::Text(format!(
            "{} claims do not hold on these laps:",
            failed.len()
        )));
        blocks.push(Block::Table(failures(&failed)));
    }
    Section {
        heading: "What does not carry over".into(),
        blocks,
    }
}

fn failures(claims: &[Claim]) -> Table {
    let mut table = Table::new("", &["claim", "paper", "here"]);
    for claim in claims {
        table.push([&claim.claim, &claim.paper, &claim.here].map(String::as_str));
    }
    table
}

fn configuration(seed: u64, study: &Study) -> Section {
    let blocks = vec![
        Block::Text(format!(
            "lapwing {}, seed {seed}, {} draws. The laps of draw 1 are those of `lapwing drive roduit2007 --seed {seed} \
             --runs 4` for the standard simulation. The same seed and inputs give the same bytes for any number of \
             threads.",
            env!("CARGO_PKG_VERSION"),
            study.draws.len()
        )),
        Block::Text("The declared model of the standard simulation:".into()),
        Block::Code(study.standard.to_toml()),
    ];
    Section {
        heading: "Seed and configuration".into(),
        blocks,
    }
}
