//! How often is `lapwing trace` right? `cargo run --release --example battery -- --practice DIR --fresh 200 --out DIR`
//!
//! Drives the program as its user runs it, over data sets whose hidden effects are known: those of a folder with a
//! `labels.csv`, and fresh ones of its own making. Every answer is kept in `OUT/traces`, so that a battery that was
//! stopped goes on where it was. The figures go to stdout and `OUT/battery.md`, one row per set to `OUT/battery.csv`.

mod classes;
mod figures;
mod fresh;
mod further;
mod labels;
mod parameters;
mod program;
mod recipes;
mod report;
mod robot;
mod score;
mod truth;
mod undeclared;

use std::fs;
use std::io::Write;
use std::path::PathBuf;

use anyhow::{Context, Result, ensure};
use clap::Parser;

use labels::Set;
use program::Lapwing;
use report::Battery;
use score::Outcome;

/// How often is `lapwing trace` right, on data sets whose hidden effects are known?
#[derive(Debug, Parser)]
struct Args {
    /// Folder of data sets with labels.csv
    #[arg(long, value_name = "DIR")]
    practice: Option<PathBuf>,
    /// Number of fresh data sets; a larger number adds to those that are there
    #[arg(long, value_name = "N", default_value_t = 0)]
    fresh: u64,
    /// Number of fresh data sets with effects of no list, of further kinds
    #[arg(long, value_name = "N", default_value_t = 0)]
    further: u64,
    /// Only these data sets
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    only: Vec<String>,
    /// Seed of the fresh data sets
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Make the fresh data sets and trace nothing
    #[arg(long)]
    sets_only: bool,
    /// Folder for everything: fresh sets, signatures, answers, figures
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

fn main() -> Result<()> {
    let args = Args::parse();
    ensure!(
        args.practice.is_some() || args.fresh > 0 || args.further > 0,
        "nothing to do: give --practice DIR, --fresh N, --further N"
    );
    let lapwing = Lapwing::built(&args.out)?;
    let wanted = |name: &str| args.only.is_empty() || args.only.iter().any(|only| only == name);
    let mut batteries = Vec::new();
    if let Some(folder) = args.practice.as_ref().filter(|_| !args.sets_only) {
        let mut sets = labels::read(folder)?;
        sets.retain(|set| wanted(&set.label.name));
        batteries.push(judged(&lapwing, "practice", sets)?);
    }
    for (sequence, count) in [(&fresh::FRESH, args.fresh), (&fresh::FURTHER, args.further)] {
        if count > 0 {
            let sets = fresh::sets(&lapwing, sequence, args.seed, count, &wanted)?;
            if !args.sets_only {
                batteries.push(judged(&lapwing, sequence.name, sets)?);
            }
        }
    }
    if args.sets_only {
        return Ok(());
    }
    let text = report::markdown(&batteries, &lapwing.build);
    fs::write(args.out.join("battery.md"), &text).context("cannot write battery.md")?;
    report::write_csv(&args.out.join("battery.csv"), &batteries)?;
    std::io::stdout().lock().write_all(text.as_bytes())?;
    Ok(())
}

/// The answers to all sets, one after the other.
fn judged(lapwing: &Lapwing, name: &'static str, sets: Vec<Set>) -> Result<Battery> {
    let count = sets.len();
    let mut outcomes = Vec::with_capacity(count);
    for (place, set) in sets.into_iter().enumerate() {
        let (trace, timing) = lapwing.trace(&set)?;
        let truth_m = truth::error_m(lapwing, &set)?;
        let outcome = Outcome {
            label: set.label,
            trace,
            timing,
            truth_m,
        };
        eprintln!(
            "{name} {}/{count}, {:.0} s: {}",
            place + 1,
            outcome.timing.seconds,
            outcome.line()
        );
        outcomes.push(outcome);
    }
    Ok(Battery { name, outcomes })
}
