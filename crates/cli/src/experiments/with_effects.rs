//! Tables II and III made again with effects added to the model.

use anyhow::Result;
use pdm::Cluster;
use rayon::prelude::*;
use serde_json::{Value, json};
use sim::Setting;

use super::comparison::Comparison;
use super::distances::{DistanceOf, Distances, Row};
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
    /// One for each row of `before`.
    changes: Vec<Change>,
}

/// What effects change in a simulation's distance to the measured runs, the mean over them.
#[derive(Debug)]
struct Change {
    before: Estimate,
    /// Over the draws in which the robot closes three laps; `None` without any.
    after: Option<Estimate>,
    /// In how many of these it got closer.
    closer: Tally,
    /// Draws in which the robot closes fewer than three laps.
    stuck: usize,
}

/// Distances (eq. 8) by draw, simulation and measured run; `None` for a simulation without three laps.
type ByDraw = Vec<Vec<Option<Vec<f64>>>>;

/// Number of runs that [`tables`] simulates in each draw.
pub(crate) fn runs_per_draw(study: &Study, effects: &[Setting]) -> usize {
    VARIANTS.len() * acting_runs(study, effects)
}

/// Tables II and III with the effects. Where these go by run, each measured run has simulations of its own.
///
/// # Errors
/// What the simulator refuses, an interrupt.
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
    if effects.iter().any(Setting::goes_by_run) {
        study.real.len()
    } else {
        1
    }
}

/// One table; `simulated` holds the clusters of [`VARIANTS`] by acting run and draw.
fn before_and_after(
    study: &Study,
    simulated: &[Vec<Vec<Option<Cluster>>>],
    variants: &[Variant],
    table: fn(&Study, &DistanceOf<'_>) -> Distances,
) -> Result<BeforeAfter> {
    let before = by_draw(study, 1, |_, draw| {
        let clusters = variants.iter().map(|&v| Some(&study.draws[draw].run(v).cluster));
        clusters.collect()
    })?;
    let after = by_draw(study, simulated.len(), |run, draw| {
        let clusters = VARIANTS.iter().zip(&simulated[run][draw]);
        let of = |variant: &Variant| clusters.clone().find(|(v, _)| *v == variant)?.1.as_ref();
        variants.iter().map(of).collect()
    })?;
    let distances = |draws: &ByDraw| {
        let distance = |run: usize, place: usize| {
            let values = draws.iter().filter_map(|draw| Some(draw[place].as_ref()?[run]));
            let values: Vec<f64> = values.collect();
            (!values.is_empty()).then(|| Estimate::of(&values))
        };
        table(study, &distance)
    };
    Ok(BeforeAfter {
        changes: (0..variants.len())
            .map(|place| Change::new(&before, &after, place))
            .collect(),
        before: distances(&before),
        after: distances(&after),
    })
}

/// The distances of each draw's simulations in one PDM with all measured runs, anew for each of `acting` runs.
fn by_draw<'a>(
    study: &'a Study,
    acting: usize,
    clusters: impl Fn(usize, usize) -> Vec<Option<&'a Cluster>> + Sync,
) -> Result<ByDraw> {
    let runs = study.real.len();
    let draw = |draw: usize| {
        let compared = (0..acting)
            .map(|run| distances(study, &clusters(run, draw)))
            .collect::<Result<Vec<_>>>()?;
        let of = |place: usize| {
            (0..runs)
                .map(|run| Some(compared[run % acting][place].as_ref()?[run]))
                .collect()
        };
        Ok((0..compared[0].len()).map(of).collect())
    };
    (0..study.draws.len()).into_par_iter().map(draw).collect()
}

/// The distances of simulations to all measured runs in one PDM.
fn distances(study: &Study, simulated: &[Option<&Cluster>]) -> Result<Vec<Option<Vec<f64>>>> {
    let runs = study.real.len();
    let present = simulated.iter().copied().flatten();
    let comparison = Comparison::new(&[study.real.iter().chain(present).collect()])?;
    let mut places = runs..;
    let mut of = |_: &Cluster| {
        let place = places.next()?;
        Some(
            (0..runs)
                .map(|run| comparison.draws[0].distance(run, place))
                .collect(),
        )
    };
    Ok(simulated.iter().map(|cluster| of((*cluster)?)).collect())
}

impl Change {
    fn new(before: &ByDraw, after: &ByDraw, place: usize) -> Self {
        let mean = |draw: &Vec<Option<Vec<f64>>>| {
            let distances = draw[place].as_ref()?;
            Some(distances.iter().sum::<f64>() / distances.len() as f64)
        };
        let pairs = before.iter().zip(after);
        let pairs: Vec<(f64, f64)> = pairs
            .filter_map(|(before, after)| Some((mean(before)?, mean(after)?)))
            .collect();
        let after_all: Vec<f64> = pairs.iter().map(|(_, after)| *after).collect();
        Self {
            before: Estimate::of(&before.iter().filter_map(mean).collect::<Vec<_>>()),
            after: (!after_all.is_empty()).then(|| Estimate::of(&after_all)),
            closer: Tally::of(pairs.iter().map(|(before, after)| after < before)),
            stuck: before.len() - pairs.len(),
        }
    }

    /// `closer` or `farther` if it is so in at least 95 % of the draws.
    fn word(&self) -> &'static str {
        let Tally { times, draws } = self.closer;
        let farther = Tally {
            times: draws - times,
            draws,
        };
        match (draws, self.closer.holds(), farther.holds()) {
            (0, ..) => "closes fewer than three laps",
            (_, true, _) => "closer",
            (_, _, true) => "farther",
            _ => "neither closer nor farther",
        }
    }

    fn sentence(&self, name: &str) -> String {
        let all = self.stuck + self.closer.draws;
        let Some(after) = self.after else {
            return format!("{name} closes fewer than three laps in {all} draws");
        };
        let (before, after, closer) = (self.before.mean, after.mean, &self.closer);
        let stuck = match self.stuck {
            0 => String::new(),
            stuck => format!("; {stuck} of {all} draws close fewer than three laps and are left out"),
        };
        format!(
            "{name} {} ({before:.1} to {after:.1}, closer in {closer}{stuck})",
            self.word()
        )
    }

    fn json(&self, key: &str) -> Value {
        json!({
            "simulation": key, "change": self.word(),
            "before": self.before.json("distance"), "after": self.after.map(|after| after.json("distance")),
            "closer_in_draws": self.closer.times, "draws": self.closer.draws, "draws_without_three_laps": self.stuck,
        })
    }
}

impl BeforeAfter {
    /// The paper's line and ours before and after for each simulation.
    pub(crate) fn table(&self) -> Table {
        let title = format!("{}, before and after", self.before.title);
        self.before.beside(&title, "before", &[("after", &self.after)])
    }

    fn changes(&self) -> impl Iterator<Item = (&Row, &Change)> {
        self.before.rows.iter().zip(&self.changes)
    }

    /// Whether each simulation got closer, in a sentence.
    pub(crate) fn sentence(&self) -> String {
        let changes: Vec<String> = self
            .changes()
            .map(|(row, change)| change.sentence(&row.name))
            .collect();
        format!(
            "With the effects, by the mean distance over the runs: {}.",
            changes.join("; ")
        )
    }

    /// `[{"simulation", "change", "before", "after", "closer_in_draws", "draws", "draws_without_three_laps"}]`.
    pub(crate) fn changes_json(&self) -> Value {
        self.changes()
            .map(|(row, change)| change.json(&row.key))
            .collect()
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
            assert!(
                table
                    .changes
                    .iter()
                    .all(|change| change.closer.times + change.stuck == 0)
            );
        }
    }

    #[test]
    fn draws_without_three_laps_are_counted_and_left_out() {
        let draw = |distance: Option<f64>| vec![distance.map(|d| vec![d, d + 2.0])];
        let before = vec![draw(Some(4.0)), draw(Some(6.0))];
        let change = Change::new(&before, &vec![draw(None), draw(Some(1.0))], 0);
        assert_eq!(
            change.sentence("coarse"),
            "coarse closer (6.0 to 2.0, closer in 1 of 1 draws; 1 of 2 draws close fewer than three laps and are left out)"
        );
        let stuck = Change::new(&before, &vec![draw(None), draw(None)], 0);
        assert_eq!(
            stuck.sentence("coarse"),
            "coarse closes fewer than three laps in 2 draws"
        );
        assert_eq!(
            (stuck.word(), stuck.json("k")["after"].is_null()),
            ("closes fewer than three laps", true)
        );
    }
}
