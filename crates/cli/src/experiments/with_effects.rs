//! Tables II and III made again with effects added to the model.

use anyhow::Result;
use pdm::Cluster;
use serde_json::{Value, json};
use sim::{Pattern, Setting};

use super::comparison::Comparison;
use super::distances::{Distances, Row};
use super::estimate::{Estimate, Tally};
use super::study::{Study, Variant};
use super::{table_ii, table_iii};
use crate::progress::Progress;
use crate::table::Table;

/// All that stand in one of the tables.
const VARIANTS: [Variant; 5] = [
    Variant::Standard,
    Variant::OriginalSensor,
    Variant::Wall1,
    Variant::Wall10,
    Variant::Wall50,
];

/// A table of distances before and after effects are added to the model.
#[derive(Debug)]
pub(crate) struct BeforeAfter {
    before: Distances,
    pub(crate) after: Distances,
    /// One for each row.
    changes: Vec<Change>,
}

/// What effects change in a simulation's distance to the measured runs, the mean over them.
#[derive(Debug)]
struct Change {
    before: Estimate,
    after: Estimate,
    /// In how many draws it got closer.
    closer: Tally,
}

/// Number of runs that [`tables`] simulates in each draw.
pub(crate) fn runs_per_draw(study: &Study, effects: &[Setting]) -> usize {
    VARIANTS.len() * acting_runs(study, effects)
}

/// Tables II and III with the effects. Where these go by run, each measured run has simulations of its own.
///
/// # Errors
/// What the simulator refuses, a simulated run without a lap, an interrupt.
pub(crate) fn tables(
    study: &Study,
    seed: u64,
    effects: &[Setting],
    progress: &Progress,
) -> Result<[BeforeAfter; 2]> {
    let simulated = (0..acting_runs(study, effects))
        .map(|run| study.with_effects(seed, effects, run, &VARIANTS, progress))
        .collect::<Result<Vec<_>>>()?;
    Ok([
        before_and_after(study, &simulated, &table_ii::VARIANTS, table_ii::table_ii)?,
        before_and_after(study, &simulated, &table_iii::VARIANTS, table_iii::table_iii)?,
    ])
}

/// As how many different runs the effects act.
fn acting_runs(study: &Study, effects: &[Setting]) -> usize {
    let by_run = |effect: &Setting| matches!(effect.pattern, Pattern::ByRun(_));
    if effects.iter().any(by_run) {
        study.real.len()
    } else {
        1
    }
}

/// One table; `simulated` holds the clusters of [`VARIANTS`] by acting run and draw.
fn before_and_after(
    study: &Study,
    simulated: &[Vec<Vec<Cluster>>],
    variants: &[Variant],
    table: fn(&Study, &[Comparison]) -> Distances,
) -> Result<BeforeAfter> {
    let all: Vec<usize> = (0..study.real.len()).collect();
    let before = [Comparison::new(&study.clusters(&all, variants))?];
    let places = variants
        .iter()
        .filter_map(|variant| VARIANTS.iter().position(|v| v == variant));
    let places: Vec<usize> = places.collect();
    let compare = |draws: &Vec<Vec<Cluster>>| {
        let mut clusters: Vec<Vec<&Cluster>> = Vec::with_capacity(draws.len());
        for draw in draws {
            let chosen = places.iter().map(|&place| &draw[place]);
            clusters.push(study.real.iter().chain(chosen).collect());
        }
        Comparison::new(&clusters)
    };
    let after = simulated.iter().map(compare).collect::<Result<Vec<_>>>()?;
    Ok(BeforeAfter {
        changes: (0..variants.len())
            .map(|row| Change::new(&before, &after, study.real.len(), row))
            .collect(),
        before: table(study, &before),
        after: table(study, &after),
    })
}

impl Change {
    fn new(before: &[Comparison], after: &[Comparison], runs: usize, row: usize) -> Self {
        let draws = 0..before[0].draws.len();
        let mean = |comparisons: &[Comparison], draw: usize| {
            let distance =
                |run: usize| comparisons[run % comparisons.len()].draws[draw].distance(run, runs + row);
            (0..runs).map(distance).sum::<f64>() / runs as f64
        };
        let means =
            |comparisons: &[Comparison]| draws.clone().map(|d| mean(comparisons, d)).collect::<Vec<_>>();
        let (before, after) = (means(before), means(after));
        Self {
            closer: Tally::of(before.iter().zip(&after).map(|(before, after)| after < before)),
            before: Estimate::of(&before),
            after: Estimate::of(&after),
        }
    }

    /// `closer` or `farther` if it is so in at least 95 % of the draws.
    fn word(&self) -> &'static str {
        let Tally { times, draws } = self.closer;
        let farther = Tally {
            times: draws - times,
            draws,
        };
        match (self.closer.holds(), farther.holds()) {
            (true, _) => "closer",
            (_, true) => "farther",
            _ => "neither closer nor farther",
        }
    }
}

impl BeforeAfter {
    /// The paper's line and ours before and after for each simulation.
    pub(crate) fn table(&self) -> Table {
        let title = format!("{}, before and after", self.before.title);
        self.before.beside(&title, "before", &[("after", &self.after)])
    }

    /// Whether each simulation got closer, in a sentence.
    pub(crate) fn sentence(&self) -> String {
        let change = |(row, change): (&Row, &Change)| {
            let (before, after) = (change.before.mean, change.after.mean);
            let (name, word, closer) = (&row.name, change.word(), &change.closer);
            format!("{name} {word} ({before:.1} to {after:.1}, closer in {closer})")
        };
        let changes: Vec<String> = self.before.rows.iter().zip(&self.changes).map(change).collect();
        format!(
            "With the effects the simulations come, by their mean distance over the runs: {}.",
            changes.join("; ")
        )
    }

    /// `[{"simulation", "change", "before", "after", "closer_in_draws", "draws"}]`.
    pub(crate) fn changes_json(&self) -> Value {
        let change = |(row, change): (&Row, &Change)| {
            json!({
                "simulation": row.key, "change": change.word(),
                "before": change.before.json("distance"), "after": change.after.json("distance"),
                "closer_in_draws": change.closer.times, "draws": change.closer.draws,
            })
        };
        self.before.rows.iter().zip(&self.changes).map(change).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiments::Measurements;

    #[test]
    fn without_effects_nothing_changes() {
        let measured = Measurements::load(&[]).unwrap();
        let silent = Progress::new("", 0, true);
        let study = Study::new(measured, 1, 2, &silent).unwrap();
        for table in tables(&study, 1, &[], &silent).unwrap() {
            assert_eq!(table.before.json(), table.after.json());
            assert!(table.changes.iter().all(|change| change.closer.times == 0));
        }
    }
}
