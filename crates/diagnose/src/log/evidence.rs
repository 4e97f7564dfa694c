//! The logs, prepared once, and how well a model with given effects explains them.

use std::sync::Arc;

use rayon::prelude::*;
use sim::{Forecast, Model, Pattern, Scene, Setting, World};
use track::Side;

use super::catalogue::{Variant, slow_speeds, variants};
use super::columns::Columns;
use super::filter::{
    Trace, Used, clear_readings, filter, filtered, leads_elsewhere, likelihood, reaches_elsewhere,
};
use super::normal::{Normal, Products};
use super::rows::{LogRow, stretches};
use super::steps::WHOLE;
use crate::Error;
use crate::candidate::{apart, bounded, stage_of};
use crate::remembered::Remembered;

/// A stretch of one run's log and what of it counts.
#[derive(Debug, Clone)]
pub(crate) struct Stretch<'a> {
    pub(crate) run: usize,
    pub(crate) rows: &'a [LogRow],
    pub(crate) used: Vec<Used>,
}

/// The logs with the declared models.
#[derive(Debug)]
pub(crate) struct Evidence<'a> {
    pub(crate) scene: &'a Scene,
    /// That of each run.
    pub(crate) models: &'a [&'a Model],
    pub(crate) stretches: Vec<Stretch<'a>>,
    /// Runs that were measured, with evidence or without.
    pub(crate) measured_runs: usize,
    /// Step that the readings are rounded to, by the robot or by the file, counts.
    pub(crate) step_counts: f64,
    /// What was asked of it before.
    pub(super) asked: Asked,
}

/// What was asked of evidence: the same settings come back from one stage of a search to the next.
#[derive(Debug)]
pub(super) struct Asked {
    /// Log-likelihoods by stretch; `None` where the filter lost the robot.
    likelihoods: Remembered<Vec<Setting>, Option<Vec<f64>>>,
    assessments: Remembered<(Vec<Setting>, Vec<Knob>), Option<Assessment>>,
}

impl Asked {
    /// Nothing yet.
    pub(super) fn nothing() -> Self {
        /// Those that are kept of each kind: all of a search for three effects, few kilobytes each.
        const KEPT: usize = 512;
        Self {
            likelihoods: Remembered::new(KEPT),
            assessments: Remembered::new(KEPT),
        }
    }
}

/// How far rays are cast, as a multiple of the range: a little beyond it they tell how far away a wall is that is not seen.
pub(crate) const SIGHT: f64 = 1.2;

/// The first of these models, with rays that much longer than the farthest range of them, and its scene.
pub(crate) fn widened<'m>(
    mut models: impl Iterator<Item = &'m Model>,
    scene: &Scene,
) -> Result<(Model, Scene), Error> {
    let mut wide = models.next().ok_or(Error::NoLog)?.clone();
    let ranges_m = models.map(|model| model.machine.range_m);
    wide.machine.range_m = SIGHT * ranges_m.fold(wide.machine.range_m, f64::max);
    let scene = Scene::new(Arc::new(scene.circuit().clone()), &wide, None)?;
    Ok((wide, scene))
}

/// One value that is fitted: which setting, which of its values, and the step of its derivative.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Knob {
    pub(crate) setting: usize,
    pub(crate) value: usize,
    /// Whether it is the change per second of a pattern by time.
    pub(crate) slope: bool,
    /// Of a pattern by run, whose value it is.
    pub(crate) run: Option<usize>,
    pub(crate) step: f64,
}

impl Knob {
    /// The value in these settings.
    pub(crate) fn of<'s>(&self, settings: &'s mut [Setting]) -> &'s mut f64 {
        match &mut settings[self.setting].pattern {
            Pattern::Constant(values) => &mut values[self.value],
            Pattern::ByTime { per_s, .. } if self.slope => &mut per_s[self.value],
            Pattern::ByTime { start, .. } => &mut start[self.value],
            Pattern::ByRun(runs) => &mut runs[self.run.unwrap_or(0)][self.value],
        }
    }

    /// The settings with the value changed by a multiple of the step, kept in its range.
    pub(crate) fn turned(&self, settings: &[Setting], multiple: f64) -> Vec<Setting> {
        let mut turned = settings.to_vec();
        let value = self.of(&mut turned);
        *value += multiple * self.step;
        let Setting { spec, pattern } = &settings[self.setting];
        let values = match pattern {
            Pattern::Constant(values) | Pattern::ByTime { start: values, .. } => values,
            Pattern::ByRun(runs) => &runs[self.run.unwrap_or(0)],
        };
        if !self.slope {
            *value = bounded(spec, values, self.value, *value);
        }
        turned
    }

    /// How many steps the value moves from one list of settings to another.
    fn steps(&self, from: &[Setting], to: &[Setting]) -> f64 {
        let param = from[self.setting].spec.params.get(self.value);
        let [from, to] = [from, to].map(|settings| *self.of(&mut settings.to_vec()));
        apart(to, from, param.filter(|_| !self.slope)) / self.step
    }
}

/// How well one model explains the logs, and how its values would have to change to do better.
#[derive(Debug, Clone)]
pub(crate) struct Assessment {
    /// By stretch.
    pub(crate) log_likelihood: Vec<f64>,
    /// By stretch, in steps of the knobs.
    pub(crate) normals: Vec<Normal>,
}

impl Assessment {
    pub(crate) fn total(&self) -> f64 {
        self.log_likelihood.iter().sum()
    }

    /// The part of it that other runs of the evidence give than this one.
    pub(crate) fn without(&self, run: usize, evidence: &Evidence<'_>) -> Self {
        let kept = || (evidence.stretches.iter().enumerate()).filter(|(_, stretch)| stretch.run != run);
        Self {
            log_likelihood: kept().map(|(i, _)| self.log_likelihood[i]).collect(),
            normals: kept().map(|(i, _)| self.normals[i].clone()).collect(),
        }
    }
}

impl<'a> Evidence<'a> {
    /// Prepares the runs: the declared model's poses decide which readings count. Without a stretch that can be
    /// filtered there is no evidence.
    pub(crate) fn new(
        scene: &'a Scene,
        models: &'a [&'a Model],
        runs: &[&'a [LogRow]],
        step_counts: f64,
    ) -> Result<Self, sim::Error> {
        let pieces: Vec<(usize, &[LogRow])> = (runs.iter().enumerate())
            .flat_map(|(run, rows)| {
                stretches(rows, &models[run].run)
                    .into_iter()
                    .map(move |piece| (run, piece))
            })
            .collect();
        let stretches = pieces
            .into_par_iter()
            .map(|(run, rows)| {
                let world = scene.world(models[run], run)?;
                let first = filter(&world, rows, None, step_counts);
                Ok(first.map(|trace| Stretch {
                    run,
                    rows,
                    used: clear_readings(&world, &trace, rows),
                }))
            })
            .collect::<Result<Vec<_>, sim::Error>>()?;
        Ok(Self {
            scene,
            models,
            stretches: stretches.into_iter().flatten().collect(),
            measured_runs: runs.len(),
            step_counts,
            asked: Asked::nothing(),
        })
    }

    /// Whether the robot rounds its readings, and not the file.
    pub(crate) fn is_coarse(&self) -> bool {
        self.step_counts > WHOLE
    }

    /// What is tried on these logs.
    pub(crate) fn variants(&self) -> Vec<Variant> {
        let course = &self.scene.circuit().course;
        let commands = (self.stretches.iter()).flat_map(|stretch| stretch.rows.iter().map(|row| row.command));
        variants(
            [Side::Outer, Side::Inner].map(|side| course.wall(side).length_m()),
            &slow_speeds(commands),
        )
    }

    /// The runs that gave evidence, in rising order.
    pub(crate) fn runs(&self) -> Vec<usize> {
        let mut runs: Vec<usize> = self.stretches.iter().map(|stretch| stretch.run).collect();
        runs.dedup();
        runs
    }

    /// Time of a physics step, s, in the first of these runs.
    pub(crate) fn physics_step_s(&self) -> Option<f64> {
        Some(self.models[self.stretches.first()?.run].run.physics_step_s())
    }

    /// The part of the evidence that one run gives.
    pub(crate) fn of_run(&self, run: usize) -> Self {
        self.where_run(|other| other == run)
    }

    /// The evidence of all other runs.
    pub(crate) fn without(&self, run: usize) -> Self {
        self.where_run(|other| other != run)
    }

    fn where_run(&self, wanted: impl Fn(usize) -> bool) -> Self {
        let stretches = self.stretches.iter().filter(|stretch| wanted(stretch.run));
        self.of(stretches.cloned().collect())
    }

    /// The evidence that these stretches give.
    fn of(&self, stretches: Vec<Stretch<'a>>) -> Self {
        Self {
            stretches,
            asked: Asked::nothing(),
            ..*self
        }
    }

    /// The same evidence against a scene whose walls are cut otherwise.
    pub(crate) fn elsewhere<'b>(&self, scene: &'b Scene) -> Evidence<'b>
    where
        'a: 'b,
    {
        let stretches = self.stretches.iter().map(Stretch::clone).collect();
        Evidence {
            scene,
            models: self.models,
            stretches,
            measured_runs: self.measured_runs,
            step_counts: self.step_counts,
            asked: Asked::nothing(),
        }
    }

    /// The evidence of the readings that count with each of these models too; `None` if rays end elsewhere in none of them.
    pub(crate) fn clear_with_each<'s>(&self, models: impl Iterator<Item = &'s [Setting]>) -> Option<Self> {
        models.fold(None, |clear, settings| {
            clear.as_ref().unwrap_or(self).clear_with(settings).or(clear)
        })
    }

    /// The evidence of the readings that count with these effects too, if they are notably fewer: where walls, or the robot, are
    /// elsewhere, other rays come near the end of the range, and near edges.
    fn clear_with(&self, settings: &[Setting]) -> Option<Self> {
        /// Share of the numbers that do as if they were not there.
        const FEW: f64 = 0.002;
        let narrowed = |stretch: &Stretch<'a>| {
            let (world, trace) = self.trace(stretch, settings)?;
            let (other, declared) = self.trace(stretch, &[])?;
            let mut own = stretch.clone();
            let elsewhere = reaches_elsewhere(&world, &other, &trace) || leads_elsewhere(&trace, &declared);
            if elsewhere {
                let clear = clear_readings(&world, &trace, stretch.rows);
                own.used = stretch.used.iter().zip(&clear).map(|(a, b)| a & b).collect();
            }
            Some(own)
        };
        let stretches: Vec<Stretch<'a>> = (self.stretches.par_iter().map(narrowed)).collect::<Option<_>>()?;
        let narrowed = self.of(stretches);
        let (before, left) = (self.numbers(), narrowed.numbers());
        ((before - left) as f64 > FEW * before as f64).then_some(narrowed)
    }

    /// How many of the measured numbers count.
    fn numbers(&self) -> usize {
        let used = self.stretches.iter().flat_map(|stretch| &stretch.used);
        used.map(|used| used.count_ones() as usize).sum()
    }

    /// The log-likelihood with these effects added.
    pub(crate) fn likelihood(&self, settings: &[Setting]) -> Option<f64> {
        Some(self.likelihoods(settings)?.iter().sum())
    }

    /// The same by stretch.
    pub(crate) fn likelihoods(&self, settings: &[Setting]) -> Option<Vec<f64>> {
        let likelihoods = &self.asked.likelihoods;
        if let Some(known) = likelihoods.find(|asked| asked == settings) {
            return known;
        }
        let of_stretch = |stretch: &Stretch<'_>| {
            let world = self.world(settings, stretch.run).ok()?;
            likelihood(&world, stretch.rows, &stretch.used, self.step_counts)
        };
        let found: Option<Vec<f64>> = self.stretches.par_iter().map(of_stretch).collect();
        likelihoods.keep(settings.to_vec(), found.clone());
        found
    }

    pub(crate) fn world(&self, settings: &[Setting], run: usize) -> Result<World<'a>, sim::Error> {
        let mut model = self.models[run].clone();
        model.effects.extend(settings.iter().cloned());
        self.scene.world(&model, run)
    }

    /// All stretches filtered with these effects added; `None` where the filter lost the robot.
    pub(crate) fn traces(&self, settings: &[Setting]) -> Option<Vec<(World<'a>, Trace)>> {
        (self.stretches.par_iter())
            .map(|stretch| self.trace(stretch, settings))
            .collect()
    }

    fn trace(&self, stretch: &Stretch<'_>, settings: &[Setting]) -> Option<(World<'a>, Trace)> {
        let world = self.world(settings, stretch.run).ok()?;
        let trace = filter(&world, stretch.rows, Some(&stretch.used), self.step_counts)?;
        Some((world, trace))
    }

    /// The log-likelihood with these effects and its derivatives with the knobs.
    pub(crate) fn assess(&self, settings: &[Setting], knobs: &[Knob]) -> Option<Assessment> {
        let Asked {
            likelihoods,
            assessments,
        } = &self.asked;
        if let Some(known) = assessments.find(|asked| asked.0 == settings && asked.1 == knobs) {
            return known;
        }
        let found = self.assessed_anew(settings, knobs);
        if let Some(found) = &found {
            likelihoods.keep(settings.to_vec(), Some(found.log_likelihood.clone()));
        }
        assessments.keep((settings.to_vec(), knobs.to_vec()), found.clone());
        found
    }

    fn assessed_anew(&self, settings: &[Setting], knobs: &[Knob]) -> Option<Assessment> {
        let parts: Option<Vec<(f64, Normal)>> = (self.stretches.par_iter())
            .map(|stretch| self.with_derivatives(stretch, settings, knobs))
            .collect();
        let (log_likelihood, normals) = parts?.into_iter().unzip();
        Some(Assessment {
            log_likelihood,
            normals,
        })
    }

    /// The log-likelihood of a stretch, and the normal equations of the changes of its whitened innovations for one step of each knob,
    /// from the side with more of its range.
    fn with_derivatives(
        &self,
        stretch: &Stretch<'_>,
        settings: &[Setting],
        knobs: &[Knob],
    ) -> Option<(f64, Normal)> {
        /// A step but for its rounding.
        const WHOLE: f64 = 0.999;
        let world = self.world(settings, stretch.run).ok()?;
        let count = knobs.len();
        let turned = |knob: &Knob| {
            let [up, down] = [1.0, -1.0].map(|multiple| {
                let side = knob.turned(settings, multiple);
                (knob.steps(settings, &side), side)
            });
            // A range may end within a step.
            let is_cut = up.0.abs() < WHOLE.min(down.0.abs());
            if is_cut { down } else { up }
        };
        let (own, knobs): (Vec<usize>, Vec<&Knob>) = (knobs.iter().enumerate())
            .filter(|(_, knob)| knob.run.is_none_or(|run| run == world.run()))
            .unzip();
        let sides: Vec<(f64, Vec<Setting>)> = knobs.iter().map(|knob| turned(knob)).collect();
        let worlds: Vec<World<'a>> = (sides.iter())
            .map(|(_, side)| self.world(side, world.run()).ok())
            .collect::<Option<_>>()?;
        let others = (worlds.iter().zip(knobs))
            .map(|(other, knob)| {
                let forecast = Forecast::compared(other, &world).ok()?;
                Some((forecast, stage_of(&settings[knob.setting])))
            })
            .collect::<Option<Vec<_>>>()?;
        let whole = |steps: f64| if steps == 0.0 { 0.0 } else { steps.recip() };
        let places: Vec<(usize, f64)> = (own.into_iter().zip(&sides))
            .map(|(place, (steps, _))| (place, whole(*steps)))
            .collect();
        let mut columns = Columns::new(vec![(others, Products::All)]);
        let steps = self.step_counts;
        let log_likelihood = filtered(&world, stretch.rows, Some(&stretch.used), steps, |instant| {
            columns.add(instant, steps);
        })?;
        let normal = columns.normals().next()?;
        // What another run's value changes here: nothing.
        Some((log_likelihood, normal.among(count, &places)))
    }
}

#[cfg(test)]
mod tests {
    use sim::find;

    use super::*;

    #[test]
    fn a_step_that_the_end_of_a_range_cuts_short_is_less_than_one() {
        let knob = |step: f64, value: usize| Knob {
            setting: 0,
            value,
            slope: false,
            run: None,
            step,
        };
        let moved = |setting: &Setting, knob: &Knob, multiple: f64| {
            let settings = [setting.clone()];
            knob.steps(&settings, &knob.turned(&settings, multiple))
        };
        let spec = find("reading-noise").unwrap();
        let quiet = Setting::constant(spec, [0.02]);
        let knob_of_noise = knob(0.08, 0);
        assert!((moved(&quiet, &knob_of_noise, 1.0) - 1.0).abs() < 1e-12);
        assert!((moved(&quiet, &knob_of_noise, -1.0) + 0.25).abs() < 1e-12);
        // An angle goes round.
        let tilt = Setting::constant(find("floor-tilt").unwrap(), [1e-3, 3.1]);
        assert!((moved(&tilt, &knob(0.15, 1), 1.0) - 1.0).abs() < 1e-12);
    }
}
