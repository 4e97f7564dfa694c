//! How far a further experiment would tell two explanations apart.

use rayon::prelude::*;
use sim::Setting;

use super::atlas::{Extent, Simulate, White, white};
use super::expectation::{Expectation, Scatter};
use super::layout::Layout;
use super::summary::Summary;

/// Data sets simulated under each explanation; half of them against the other half make the distance free of bias.
const SETS: u64 = 12;

/// An explanation with how well its overall size is known from the data at hand.
#[derive(Debug, Clone)]
pub struct Rival {
    /// The effects at their fitted sizes.
    pub settings: Vec<Setting>,
    /// Relative standard error of the size.
    pub relative_error: f64,
}

/// Distances, in standard deviations of one data set of the experiment, between what an explanation leads one to expect
/// of it and what its rivals do; a rival may change its size as far as its error allows. `None` for a rival, or
/// altogether, where the robot crashes.
///
/// `simulate` simulates the experiment.
pub fn separations(
    simulate: &Simulate<'_>,
    answer: &[Setting],
    rivals: &[Rival],
) -> Option<Vec<Option<f64>>> {
    let declared = simulated(simulate, &[])?;
    let answered = simulated(simulate, answer)?;
    let first = simulate(answer, 0, Extent::Whole)?;
    let layout = Layout::of_recording(&first, answered[0].0[0].scatter.nrows());
    let other = Scatter::of_few(declared.iter().map(|summary| &summary.0[0]))?;
    let scatter = [Scatter::near(
        answered.iter().map(|summary| &summary.0[0]),
        1,
        &other,
    )?];
    let halves = |summaries: &[Summary]| {
        let (a, b) = summaries.split_at(summaries.len() / 2);
        [a, b].map(|half| Expectation::of(half.iter(), true))
    };
    let away = |to: &[Expectation; 2], from: &[Expectation; 2]| -> [White; 2] {
        [0, 1].map(|half| white(&scatter, &layout, &to[half], &from[half]))
    };
    let (declared, answered) = (halves(&declared), halves(&answered));
    let separation = |rival: &Rival| {
        let expected = halves(&simulated(simulate, &rival.settings)?);
        let [d1, d2] = away(&expected, &answered);
        let [a1, a2] = away(&expected, &declared);
        // The rival's own size takes up what its error allows.
        let stiffness = 1.0 / rival.relative_error.max(1e-6).powi(2);
        let along = d1.dot(&a2) * d2.dot(&a1);
        let square = d1.dot(&d2) - along.max(0.0) / (a1.dot(&a2).max(0.0) + stiffness);
        Some(square.max(0.0).sqrt())
    };
    Some(rivals.iter().map(separation).collect())
}

fn simulated(simulate: &Simulate<'_>, effects: &[Setting]) -> Option<Vec<Summary>> {
    (0..SETS)
        .into_par_iter()
        .map(|set| {
            let runs = simulate(effects, set, Extent::Whole)?;
            Summary::new(&runs, &[runs.len()])
        })
        .collect()
}
