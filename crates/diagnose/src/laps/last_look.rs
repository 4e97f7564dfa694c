//! The last look about the answer: its sizes, their errors, and the sizes without each of the runs.

use nalgebra::DVector;
use sim::Setting;

use super::hypothesis::Hypothesis;
use super::intervals::Interval;
use super::observed::ObservedRun;
use super::parabola::{Column, Local, Nearest};
use super::part::Freedom;
use super::refine::are_within_steps;
use super::trial::Trial;
use crate::Error;

/// A hypothesis at its most likely sizes, as parabolas over a few of their errors tell them.
pub(super) struct LastLook {
    pub(super) found: Hypothesis,
    /// Standard errors of the fitted numbers, the simulation's own error included.
    pub(super) errors: Vec<(Freedom, f64)>,
    /// 95 % intervals of numbers of which the standard error tells little.
    pub(super) intervals: Vec<Interval>,
    /// What was looked about, in which numbers, and what was seen; `None` where nothing is fitted or the robot crashes.
    about: Hypothesis,
    freedoms: Vec<Freedom>,
    local: Option<Local>,
    /// From there to what was found.
    moves: DVector<f64>,
}

/// Looks at most: sizes that leave the parabolas, or turn out less certain, are looked about again.
const LOOKS: usize = 2;
/// Data sets at all points together, and where so few leave slopes noisy.
const FEW: u64 = 36;
const ALL: u64 = 100;
/// Errors, as multiples of those that a look was made for, with which it was too narrow.
const LESS_CERTAIN: f64 = 2.0;
/// Standard errors that a parabola reaches to either side.
const REACH: f64 = 3.0;
/// The least share of a step to look over: a step of nothing tells nothing.
const LEAST: f64 = 1e-3;

impl LastLook {
    /// Whether sizes stayed where their parabolas were made, and are not far less certain than these were made for.
    fn is_as_certain_as_thought(&self, widest: &[Freedom]) -> bool {
        let certain = (self.errors.iter().zip(widest)).all(|((freedom, error), widest)| {
            freedom.step == widest.step || REACH * error < LESS_CERTAIN * freedom.step
        });
        certain && are_within_steps(&self.moves, &self.freedoms)
    }

    fn is_noisy(&self) -> bool {
        self.local.as_ref().is_some_and(Local::is_noisy)
    }
}

impl Trial<'_> {
    /// Looks closely about a hypothesis whose numbers have these errors.
    pub(super) fn look_closely(&self, hypothesis: &Hypothesis, errors: &[(Freedom, f64)]) -> LastLook {
        let hypothesis = self.smoothed(hypothesis);
        let mut look = LastLook {
            found: hypothesis.clone(),
            errors: errors.to_vec(),
            intervals: Vec::new(),
            about: hypothesis.clone(),
            freedoms: Vec::new(),
            local: None,
            moves: DVector::zeros(0),
        };
        let widest = hypothesis.freedoms(self.atlas);
        for at in 1..=LOOKS {
            let freedoms: Vec<Freedom> = (widest.iter().zip(&look.errors))
                .map(|(widest, (_, error))| widest.over(REACH * error, (LEAST, 1.0)))
                .collect();
            let Some(next) = self.look_once(&look.found, &freedoms, FEW) else {
                break;
            };
            let holds = next.is_as_certain_as_thought(&widest);
            let clearer = (next.is_noisy() && (holds || at == LOOKS))
                .then(|| self.look_once(&look.found, &freedoms, ALL))
                .flatten();
            look = clearer.unwrap_or(next);
            if holds {
                break;
            }
        }
        if let Some(local) = &look.local {
            look.intervals = self.slow_intervals(&look.found, &look.errors, local);
        }
        look
    }

    /// One look about a hypothesis, with so many data sets in all; `None` where the robot crashes.
    fn look_once(&self, about: &Hypothesis, freedoms: &[Freedom], of_all: u64) -> Option<LastLook> {
        /// The least and the most data sets at each point.
        const EACH: (u64, u64) = (6, 32);
        let points = 2 * freedoms.len() as u64 + 1;
        let sets = (of_all / points).clamp(EACH.0, EACH.1);
        let mut local = self.local(about, freedoms, self.atlas.enough(sets, points))?;
        local.columns = local.columns.into_iter().map(Column::without_noise).collect();
        let Nearest { moves, errors, .. } =
            self.nearest(&local.center, &local.scatter, &local.columns, freedoms);
        Some(LastLook {
            found: self
                .atlas
                .quantised(self.atlas.with_moves(about, freedoms, &moves)),
            errors: freedoms.iter().copied().zip(errors).collect(),
            intervals: Vec::new(),
            about: about.clone(),
            freedoms: freedoms.to_vec(),
            moves,
            local: Some(local),
        })
    }

    /// For each run the effects with sizes fitted to the other runs alone, by the parabolas of the last look; a
    /// size of the run itself becomes the mean of the others'. Where the robot crashes beside the sizes, they stay.
    pub(super) fn leave_out(
        &self,
        runs: &[ObservedRun],
        look: &LastLook,
    ) -> Result<Vec<Vec<Setting>>, Error> {
        let fit_without = |run: usize| {
            let found = match &look.local {
                Some(local) => self.fit_without(run, local, runs, look)?,
                None => look.found.clone(),
            };
            Ok(found.with_mean_size(run).settings(self.atlas))
        };
        (0..self.atlas.layout.runs()).map(fit_without).collect()
    }

    fn fit_without(
        &self,
        run: usize,
        local: &Local,
        runs: &[ObservedRun],
        look: &LastLook,
    ) -> Result<Hypothesis, Error> {
        let (recording, place) = self.atlas.layout.places().nth(run).unwrap_or_default();
        let expected = &local.center.expectation.0[recording];
        let of_all_runs = [
            self.atlas.layout.trend(recording),
            self.atlas.layout.second(recording),
        ];
        let mut silent = vec![self.atlas.layout.run(run)];
        let mut data = self.atlas.observed(runs)?;
        let count = self.atlas.layout.laps[recording].len();
        if count > 1 {
            data.0[recording] = self.atlas.observed_without(runs, run)?.0.remove(recording);
        } else {
            data.0[recording].means.clear();
            silent.extend(of_all_runs.clone());
        }
        data.0[recording]
            .means
            .insert(place, expected.means[place].clone());
        // Numbers of all runs scatter more without one of them, and tell as much less.
        let told = ((count - 1) as f64 / count as f64).sqrt();
        data.0[recording].draw_towards(expected, told);
        let mut columns = local.columns.clone();
        for column in &mut columns {
            for action in [&mut column.slope, &mut column.curvature] {
                for range in &of_all_runs {
                    action.rows_mut(range.start, range.len()).scale_mut(told);
                }
                let own = &silent[0];
                action.rows_mut(own.start, own.len()).fill(0.0);
            }
        }
        let without = Trial {
            data: &data,
            silent: &silent,
            ..*self
        };
        let nearest = without.nearest(&local.center, &local.scatter, &columns, &look.freedoms);
        let found = self.atlas.with_moves(&look.about, &look.freedoms, &nearest.moves);
        let hunted = without.hunt_about(&found).unwrap_or(found);
        Ok(self.atlas.quantised(hunted))
    }
}
