//! The size of a hypothesis by simulation, and how well it then explains the data.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use sim::{Pattern, Setting};

use super::atlas::{Atlas, Simulate, White, white};
use super::expectation::{Expectation, Scatter};
use super::hypothesis::{Freedom, Hypothesis, Part, Shape};
use super::layout::Layout;
use super::likelihood::{Doubt, Evaluated, Fit};
use super::screen::price;
use super::summary::Summary;
use crate::Error;

/// What is simulated in a round of a descent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Round {
    /// The hypothesis and a step to either side in each of its numbers, with a few data sets.
    Rough,
    /// The hypothesis alone; what its numbers do is taken from the rough round.
    Again,
    /// The hypothesis and both sides, with as many data sets as sizes and their errors need.
    Full,
}

impl Round {
    /// Data sets at each point: with few numbers to fit, and with many, which have more points.
    fn sets(self) -> [u64; 2] {
        match self {
            Self::Rough => [4, 3],
            Self::Again | Self::Full => [10, 6],
        }
    }
}

/// Numbers to fit from which there are many.
const MANY: usize = 5;

/// Data sets simulated of every hypothesis that comes to the end, of the best, and of it and others that explain nearly as
/// much.
const END_SETS: u64 = 16;
pub(super) const FINAL_SETS: u64 = 32;
pub(super) const CLOSE_SETS: u64 = 64;

/// A hypothesis at its most likely sizes.
#[derive(Debug, Clone)]
pub(super) struct Refined {
    pub(super) hypothesis: Hypothesis,
    /// Standard errors of the fitted numbers, the simulation's own error included.
    pub(super) errors: Vec<(Freedom, f64)>,
    pub(super) fit: Fit,
    /// The gain less the price of the fitted numbers.
    pub(super) score: f64,
}

/// A hypothesis at its most likely sizes with what was simulated to judge it.
pub(super) struct Settled {
    pub(super) refined: Refined,
    evaluated: Evaluated,
}

impl Refined {
    /// Standard errors of one part's values in the order of its pattern's values; 0 for what was not fitted.
    pub(super) fn errors_of(&self, part: usize, atlas: &Atlas) -> Vec<f64> {
        self.hypothesis.parts[part].errors(part, &self.errors, atlas)
    }
}

/// A hypothesis on its way to its most likely sizes.
#[derive(Debug, Clone)]
pub(super) struct Descent {
    pub(super) hypothesis: Hypothesis,
    freedoms: Vec<Freedom>,
    errors: Vec<f64>,
    /// Log-likelihood gained over the declared model less the price of the fitted numbers, as the last round saw it.
    pub(super) score: f64,
    /// What the rough round saw, and the moves since.
    near: Option<(Local, DVector<f64>)>,
    /// Whether there is nowhere left to descend to.
    found: bool,
}

impl Descent {
    /// A hypothesis before its first round.
    pub(super) fn start(atlas: &Atlas, hypothesis: &Hypothesis) -> Self {
        let freedoms = hypothesis.freedoms(atlas);
        Self {
            hypothesis: hypothesis.clone(),
            errors: vec![f64::INFINITY; freedoms.len()],
            freedoms,
            score: f64::NEG_INFINITY,
            near: None,
            found: false,
        }
    }

    fn errors(&self) -> Vec<(Freedom, f64)> {
        self.freedoms
            .iter()
            .copied()
            .zip(self.errors.iter().copied())
            .collect()
    }
}

impl Atlas {
    /// One round towards the best sizes; `None` where the robot then crashes.
    ///
    /// A round simulates the hypothesis at its sizes and a step to either side of each, with the same draws, takes the
    /// means for parabolas in each number, and goes to where these are nearest to the data.
    pub(super) fn descend(
        &self,
        simulate: &Simulate<'_>,
        data: &Expectation,
        descent: Descent,
        round: Round,
    ) -> Option<Descent> {
        match (round, &descent.near) {
            _ if descent.found => Some(descent),
            // A place is not found on one parabola.
            (Round::Again, _) if descent.hypothesis.has_place(self) => {
                self.look_around(simulate, data, descent, Round::Rough)
            }
            (Round::Again, Some(_)) => self.look_again(simulate, data, descent),
            _ => self.look_around(simulate, data, descent, round),
        }
    }

    fn look_around(
        &self,
        simulate: &Simulate<'_>,
        data: &Expectation,
        descent: Descent,
        round: Round,
    ) -> Option<Descent> {
        /// Errors by which a number may still have moved in the last round.
        const SETTLED: f64 = 0.7;
        let Descent {
            hypothesis,
            mut freedoms,
            mut errors,
            ..
        } = descent;
        let local = self.local(simulate, &hypothesis, &freedoms, round)?;
        let target = white(&local.scatter, &self.layout, data, &local.center);
        let (moves, covariance) = nearest(&local.columns, &target, &freedoms);
        let left = left_of(&local.columns, &target, &moves);
        let fit = self.fit_of(data, left, &local.scatter, local.doubt);
        let hypothesis = self.with_moves(&hypothesis, &freedoms, &moves);
        let settled = (0..moves.len()).all(|i| moves[i].abs() < SETTLED * covariance[(i, i)].sqrt());
        for (i, freedom) in freedoms.iter_mut().enumerate() {
            errors[i] = (covariance[(i, i)] * (1.0 + local.doubt.error)).sqrt();
            // The parabola should hold where the answer may lie, and be wide enough for the noise of its points not to
            // pass for information.
            let reach = (10.0 * errors[i]).max(moves[i].abs());
            freedom.step = reach.clamp(0.2 * freedom.step, freedom.step);
        }
        Some(Descent {
            score: hypothesis.worth(fit.gain) - self.price_of(&hypothesis),
            found: round == Round::Full && settled,
            near: Some((local, moves)),
            hypothesis,
            freedoms,
            errors,
        })
    }

    fn look_again(&self, simulate: &Simulate<'_>, data: &Expectation, descent: Descent) -> Option<Descent> {
        let (local, moved) = descent.near.as_ref()?;
        let sets = self.sets_at(&descent.freedoms, Round::Again, 1);
        let center = self.evaluate(simulate, &descent.hypothesis, sets)?;
        let columns: Vec<Column> = (local.columns.iter().zip(moved.iter()))
            .map(|(column, moved)| column.from(*moved))
            .collect();
        let target = white(&local.scatter, &self.layout, data, &center.expectation);
        let (moves, _) = nearest(&columns, &target, &descent.freedoms);
        let hoped = target.norm_squared() - left_of(&columns, &target, &moves).norm_squared();
        let gain = self.fit(data, &center)?.gain + 0.5 * hoped;
        let hypothesis = self.with_moves(&descent.hypothesis, &descent.freedoms, &moves);
        Some(Descent {
            score: hypothesis.worth(gain) - self.price_of(&hypothesis),
            hypothesis,
            ..descent
        })
    }

    fn with_moves(&self, hypothesis: &Hypothesis, freedoms: &[Freedom], moves: &DVector<f64>) -> Hypothesis {
        let by: Vec<(Freedom, f64)> = freedoms.iter().copied().zip(moves.iter().copied()).collect();
        hypothesis.moved(self, &by)
    }

    /// Data sets at each of so many points of a round.
    fn sets_at(&self, freedoms: &[Freedom], round: Round, points: u64) -> u64 {
        self.enough(round.sets()[usize::from(freedoms.len() >= MANY)], points)
    }

    /// For each run the effects with sizes fitted to the other runs alone, by the parabolas about the hypothesis' sizes; a
    /// size of the run itself becomes the mean of the others'. Where the robot crashes beside these sizes, they stay.
    pub(super) fn leave_out(
        &self,
        simulate: &Simulate<'_>,
        runs: &[Vec<track::Lap>],
        hypothesis: &Hypothesis,
    ) -> Result<Vec<Vec<Setting>>, Error> {
        let freedoms = hypothesis.freedoms(self);
        let local = self.local(simulate, hypothesis, &freedoms, Round::Full);
        let fit_without = |run: usize| {
            let found = match &local {
                Some(local) => self.fit_without(run, local, runs, hypothesis, &freedoms)?,
                None => hypothesis.clone(),
            };
            Ok(found.with_mean_size(run).settings(self))
        };
        (0..self.layout.runs()).map(fit_without).collect()
    }

    fn fit_without(
        &self,
        run: usize,
        local: &Local,
        runs: &[Vec<track::Lap>],
        hypothesis: &Hypothesis,
        freedoms: &[Freedom],
    ) -> Result<Hypothesis, Error> {
        let (recording, place) = self.layout.places().nth(run).unwrap_or_default();
        let alone = self.layout.laps[recording].len() == 1;
        let mut data = self.observed(runs)?;
        if !alone {
            data.0[recording] = self.observed_without(runs, run)?.0.remove(recording);
        }
        data.0[recording]
            .means
            .insert(place, local.center.0[recording].means[place].clone());
        if alone {
            data.0[recording].means.truncate(1);
        }
        let target = white(&local.scatter, &self.layout, &data, &local.center);
        let mut own = vec![self.layout.run(run)];
        if alone {
            own.extend([self.layout.trend(recording), self.layout.second(recording)]);
        }
        let mut columns = local.columns.clone();
        for column in &mut columns {
            for range in &own {
                column.slope.rows_mut(range.start, range.len()).fill(0.0);
                column.curvature.rows_mut(range.start, range.len()).fill(0.0);
            }
        }
        let (moves, _) = nearest(&columns, &target, freedoms);
        Ok(self.quantised(self.with_moves(hypothesis, freedoms, &moves)))
    }

    /// A hypothesis at its most likely sizes, simulated often enough to judge it.
    pub(super) fn settle(
        &self,
        simulate: &Simulate<'_>,
        data: &Expectation,
        found: &Descent,
    ) -> Option<Settled> {
        let hypothesis = self.quantised(found.hypothesis.clone());
        let end = self.evaluate(simulate, &hypothesis, self.enough(END_SETS, 1))?;
        self.settled(data, hypothesis, found.errors(), end)
    }

    /// The same hypothesis simulated more often.
    pub(super) fn settle_more(
        &self,
        simulate: &Simulate<'_>,
        data: &Expectation,
        settled: Settled,
        sets: u64,
    ) -> Option<Settled> {
        let Settled { refined, evaluated } = settled;
        let more = self.evaluate_more(simulate, &refined.hypothesis, evaluated, sets)?;
        self.settled(data, refined.hypothesis, refined.errors, more)
    }

    fn settled(
        &self,
        data: &Expectation,
        hypothesis: Hypothesis,
        errors: Vec<(Freedom, f64)>,
        evaluated: Evaluated,
    ) -> Option<Settled> {
        let fit = self.fit(data, &evaluated)?;
        let score = hypothesis.worth(fit.gain) - self.price_of(&hypothesis);
        let refined = Refined {
            hypothesis,
            errors,
            fit,
            score,
        };
        Some(Settled { refined, evaluated })
    }

    /// Data sets at each of so many points that determine the scatter of a lap too: short runs need more of them.
    fn enough(&self, sets: u64, points: u64) -> u64 {
        const TIMES: usize = 3;
        let freedom: usize = (self.layout.laps.iter())
            .map(|laps| laps.iter().map(|n| n - 2).sum())
            .min()
            .unwrap_or(1);
        let needed = (TIMES * self.layout.lap).div_ceil(freedom) as u64;
        sets.max(needed.div_ceil(points)).min(self.samples.len() as u64)
    }

    /// What a hypothesis pays for its fitted numbers and for the choice of its probes.
    fn price_of(&self, hypothesis: &Hypothesis) -> f64 {
        let choices: f64 = hypothesis.parts.iter().map(|part| self.choice(part.probe)).sum();
        price(hypothesis.freedoms(self).len(), self.layout.total_laps()) + choices
    }

    /// Sizes that come in steps brought to the nearest.
    fn quantised(&self, mut hypothesis: Hypothesis) -> Hypothesis {
        for part in &mut hypothesis.parts {
            let probe = &self.probes[part.probe];
            if let Some(quantum) = probe.quantum {
                let i = probe.free[0].0;
                part.values
                    .iter_mut()
                    .for_each(|values| values[i] = (values[i] / quantum).round() * quantum);
            }
        }
        hypothesis
    }

    /// What a hypothesis leaves of the data, in units of the declared model's scatter; `None` where the robot crashes.
    pub(super) fn left_by(
        &self,
        simulate: &Simulate<'_>,
        data: &Expectation,
        hypothesis: &Hypothesis,
    ) -> Option<White> {
        let evaluated = self.evaluate(simulate, hypothesis, self.enough(FINAL_SETS, 1))?;
        Some(self.white(data, &evaluated.expectation))
    }

    /// What one step of each of these numbers of probes does, by the same draws; `None` where the robot crashes.
    pub(super) fn actions(
        &self,
        simulate: &Simulate<'_>,
        numbers: &[(usize, usize)],
        sets: u64,
    ) -> Vec<Option<White>> {
        let same_draws = Expectation::mean(&self.samples[..sets as usize], true);
        numbers
            .par_iter()
            .map(|&(probe, number)| {
                let setting = [self.probes[probe].step(number)];
                let found = self.simulated_plainly(simulate, &setting, sets)?;
                Some(self.white(&found, &same_draws))
            })
            .collect()
    }

    fn simulated_plainly(
        &self,
        simulate: &Simulate<'_>,
        settings: &[Setting],
        sets: u64,
    ) -> Option<Expectation> {
        self.spent.add(sets);
        let summaries: Vec<Summary> = (0..sets)
            .map(|set| self.summary(simulate, settings, set))
            .collect::<Option<_>>()?;
        Some(Expectation::of(summaries.iter(), true))
    }

    /// The size of an effect that jumps, by trying many: all over the probe's range, then ever closer about the best. `None`
    /// where no size explains a fair share.
    pub(super) fn hunt(&self, simulate: &Simulate<'_>, data: &Expectation, probe: usize) -> Option<Descent> {
        const COARSE: usize = 60;
        const COARSE_SETS: u64 = 1;
        const CLOSER: [u64; 3] = [4, 8, 12];
        const FAIR_SHARE: f64 = 0.25;
        let p = &self.probes[probe];
        let (low, high) = (p.sizes[0], p.sizes[p.sizes.len() - 1]);
        // Sizes in a constant ratio: what matters is how many steps fit into a speed or a reading.
        let ratio = (high / low).powf(1.0 / (COARSE - 1) as f64);
        let sizes: Vec<f64> = (0..COARSE).map(|i| low * ratio.powi(i as i32)).collect();
        let (left, mut best) = least(&self.distances(simulate, data, probe, &sizes, COARSE_SETS))?;
        if left > (1.0 - FAIR_SHARE) * self.white(data, &self.null).norm_squared() {
            return None;
        }
        let mut spacing = best * (ratio - 1.0);
        let mut last = Vec::new();
        for sets in CLOSER {
            let sizes: Vec<f64> = (-4..=4).map(|i| best + spacing * f64::from(i) / 3.0).collect();
            last = self.distances(simulate, data, probe, &sizes, sets);
            best = least(&last)?.1;
            spacing /= 3.0;
        }
        // Sizes that are no worse than by 4 in squared distance bound the answer.
        let bound = least(&last)?.0 + 4.0;
        let as_good = last
            .iter()
            .filter(|found| found.0 < bound)
            .map(|found| (found.1 - best).abs());
        let error = as_good.fold(spacing / 2.0, f64::max);
        let hypothesis = Hypothesis {
            parts: vec![Part::screened(self, probe, Shape::Constant, &[best])],
        };
        let start = Descent::start(self, &hypothesis);
        Some(Descent {
            errors: vec![error; start.freedoms.len()],
            found: true,
            ..start
        })
    }

    /// Squared distances of the data from a probe at some sizes, each with its size; sizes at which the robot crashes are
    /// left out.
    fn distances(
        &self,
        simulate: &Simulate<'_>,
        data: &Expectation,
        probe: usize,
        sizes: &[f64],
        sets: u64,
    ) -> Vec<(f64, f64)> {
        let same_draws = Expectation::mean(&self.samples[..sets as usize], true);
        let distance = |&size: &f64| {
            let settings = [self.probes[probe].setting(size)];
            let found = self.simulated_plainly(simulate, &settings, sets)?;
            let expected = found.moved(1.0, &same_draws, &self.null);
            Some((self.white(data, &expected).norm_squared(), size))
        };
        sizes.par_iter().filter_map(distance).collect()
    }

    /// What effects leave of the data, in units of their own scatter; `None` where the robot crashes.
    pub(super) fn remainder(
        &self,
        simulate: &Simulate<'_>,
        data: &Expectation,
        effects: &[Setting],
    ) -> Option<White> {
        let alike = !effects.iter().any(|e| matches!(e.pattern, Pattern::ByRun(_)));
        let end = self.simulated(simulate, effects, alike, self.enough(FINAL_SETS, 1))?;
        Some(self.fit(data, &end)?.residual)
    }

    fn evaluate(&self, simulate: &Simulate<'_>, hypothesis: &Hypothesis, sets: u64) -> Option<Evaluated> {
        self.simulated(simulate, &hypothesis.settings(self), hypothesis.alike(), sets)
    }

    fn evaluate_more(
        &self,
        simulate: &Simulate<'_>,
        hypothesis: &Hypothesis,
        evaluated: Evaluated,
        sets: u64,
    ) -> Option<Evaluated> {
        let mut summaries = evaluated.summaries;
        let done = summaries.len() as u64;
        summaries.extend(self.summaries(simulate, &hypothesis.settings(self), done..sets.max(done))?);
        Some(self.evaluated(summaries, hypothesis.alike()))
    }

    fn simulated(
        &self,
        simulate: &Simulate<'_>,
        settings: &[Setting],
        alike: bool,
        sets: u64,
    ) -> Option<Evaluated> {
        let summaries = self.summaries(simulate, settings, 0..sets)?;
        Some(self.evaluated(summaries, alike))
    }

    fn summaries(
        &self,
        simulate: &Simulate<'_>,
        settings: &[Setting],
        sets: Range<u64>,
    ) -> Option<Vec<Summary>> {
        self.spent.add(sets.end - sets.start);
        sets.into_par_iter()
            .map(|set| self.summary(simulate, settings, set))
            .collect()
    }

    /// What simulated data sets say of their hypothesis. What their draws did to the declared model is taken off as far as
    /// it helps (a control variate).
    fn evaluated(&self, summaries: Vec<Summary>, alike: bool) -> Evaluated {
        let sets = summaries.len();
        let mean = Expectation::of(summaries.iter(), alike);
        let declared = &self.samples[..sets];
        let declared_mean = Expectation::mean(declared, alike);
        let (mut both, mut own) = (0.0, 0.0);
        for (summary, sample) in summaries.iter().zip(declared) {
            let sample = self.white(sample, &declared_mean);
            both += self
                .white(&Expectation::of(std::iter::once(summary), false), &mean)
                .dot(&sample);
            own += sample.norm_squared();
        }
        let share = (both / own).clamp(0.0, 1.0);
        let expectation = mean.moved(share, &declared_mean, &self.null);
        let error = (1.0 - share * share) / sets as f64 + share * share / self.samples.len() as f64;
        Evaluated {
            expectation,
            doubt: Doubt { error, alike },
            summaries,
        }
    }

    /// A hypothesis and its neighbourhood.
    fn local(
        &self,
        simulate: &Simulate<'_>,
        hypothesis: &Hypothesis,
        freedoms: &[Freedom],
        round: Round,
    ) -> Option<Local> {
        let sets = self.sets_at(freedoms, round, 3);
        let center = self.evaluate(simulate, hypothesis, sets)?;
        let mut sides = Vec::with_capacity(freedoms.len());
        for group in groups(freedoms) {
            let at = |sign: f64| {
                let moves: Vec<(Freedom, f64)> = group.iter().map(|f| (*f, sign * f.step)).collect();
                let moved = hypothesis.moved(self, &moves);
                let by: Vec<f64> = group.iter().map(|f| moved.get(f) - hypothesis.get(f)).collect();
                self.evaluate(simulate, &moved, sets)
                    .map(|evaluated| (by, evaluated))
            };
            // Where the robot crashes on one side, the other one tells the slope.
            let nowhere = |side: Option<(Vec<f64>, Evaluated)>| {
                side.unwrap_or_else(|| (vec![0.0; group.len()], center.clone()))
            };
            let (down, up) = (at(-1.0), at(1.0));
            if down.is_none() && up.is_none() {
                return None;
            }
            let (down, up) = (nowhere(down), nowhere(up));
            sides.push((group, down, up));
        }
        let all = sides
            .iter()
            .flat_map(|(_, a, b)| a.1.summaries.iter().chain(&b.1.summaries));
        let scatter = self.scatter_of(center.summaries.iter().chain(all))?;
        let action = |e: &Evaluated| white(&scatter, &self.layout, &e.expectation, &center.expectation);
        let mut columns = Vec::new();
        for (group, (down_by, down), (up_by, up)) in &sides {
            let (down, up) = (action(down), action(up));
            for (i, freedom) in group.iter().enumerate() {
                let mask = |w: &White| {
                    freedom
                        .run()
                        .map_or_else(|| w.clone(), |run| of_run(w, run, &self.layout))
                };
                columns.push(Column::through((down_by[i], mask(&down)), (up_by[i], mask(&up))));
            }
        }
        Some(Local {
            center: center.expectation,
            doubt: center.doubt,
            scatter,
            columns,
        })
    }
}

/// The least of some distances, with its size.
fn least(found: &[(f64, f64)]) -> Option<(f64, f64)> {
    found.iter().copied().min_by(|a, b| a.0.total_cmp(&b.0))
}

/// Freedoms that are moved together: the sizes of one part in its runs.
fn groups(freedoms: &[Freedom]) -> Vec<Vec<Freedom>> {
    let mut groups: Vec<Vec<Freedom>> = Vec::new();
    for freedom in freedoms {
        match groups.last_mut() {
            Some(group) if freedom.run().is_some() && freedom.is_beside(&group[0]) => group.push(*freedom),
            _ => groups.push(vec![*freedom]),
        }
    }
    groups
}

/// What one run's size does: that run's mean, and its share of its recording's trend and second-order numbers.
fn of_run(action: &White, run: usize, layout: &Layout) -> White {
    let mut own = White::zeros(action.len());
    let recording = layout.places().nth(run).map_or(0, |at| at.0);
    let share = 1.0 / layout.laps[recording].len() as f64;
    for (range, share) in [
        (layout.run(run), 1.0),
        (layout.trend(recording), share),
        (layout.second(recording), share),
    ] {
        own.rows_mut(range.start, range.len())
            .axpy(share, &action.rows(range.start, range.len()), 1.0);
    }
    own
}

/// A hypothesis and its neighbourhood.
#[derive(Debug, Clone)]
struct Local {
    center: Expectation,
    doubt: Doubt,
    scatter: Vec<Scatter>,
    columns: Vec<Column>,
}

/// The action of one number: slope and curvature.
#[derive(Debug, Clone)]
struct Column {
    slope: White,
    curvature: White,
}

impl Column {
    /// The same parabola as seen from another point of it.
    fn from(&self, moved: f64) -> Self {
        Self {
            slope: &self.slope + &self.curvature * (2.0 * moved),
            curvature: self.curvature.clone(),
        }
    }

    /// The parabola through the origin and two points.
    fn through(down: (f64, White), up: (f64, White)) -> Self {
        let (a, b) = (down.0, up.0);
        if a == 0.0 || b == 0.0 {
            // At the end of the range there is one side only.
            let (by, action) = if a == 0.0 { up } else { down };
            let slope = if by == 0.0 { action * 0.0 } else { action / by };
            return Self {
                curvature: &slope * 0.0,
                slope,
            };
        }
        let curvature = (&up.1 / b - &down.1 / a) / (b - a);
        let slope = &up.1 / b - &curvature * b;
        Self { slope, curvature }
    }
}

/// The moves that bring the parabolas nearest to the target, and their covariance.
fn nearest(columns: &[Column], target: &White, freedoms: &[Freedom]) -> (DVector<f64>, DMatrix<f64>) {
    let count = columns.len();
    let mut moves = DVector::<f64>::zeros(count);
    let mut normal = DMatrix::identity(count, count);
    for _ in 0..30 {
        let left = left_of(columns, target, &moves);
        let slopes: Vec<White> = columns
            .iter()
            .zip(moves.iter())
            .map(|(c, m)| &c.slope + &c.curvature * (2.0 * m))
            .collect();
        normal = DMatrix::from_fn(count, count, |i, j| slopes[i].dot(&slopes[j]));
        // A number without action stays where it is.
        for (i, freedom) in freedoms.iter().enumerate() {
            normal[(i, i)] += 1e-6 / (freedom.step * freedom.step);
        }
        let gradient = DVector::from_fn(count, |i, _| slopes[i].dot(&left));
        let Some(step) = normal.clone().cholesky().map(|f| f.solve(&gradient)) else {
            break;
        };
        let mut share = 1.0;
        let mut next = bounded(&moves, &step, share, freedoms);
        while left_of(columns, target, &next).norm_squared() > left.norm_squared() && share > 1e-3 {
            share *= 0.5;
            next = bounded(&moves, &step, share, freedoms);
        }
        let change = (&next - &moves)
            .component_div(&DVector::from_fn(count, |i, _| freedoms[i].step))
            .amax();
        moves = next;
        if change < 1e-6 {
            break;
        }
    }
    let covariance = normal
        .cholesky()
        .map_or_else(|| DMatrix::identity(count, count), |f| f.inverse());
    (moves, covariance)
}

/// What the parabolas at some moves leave of the target.
fn left_of(columns: &[Column], target: &White, moves: &DVector<f64>) -> White {
    let mut left = target.clone();
    for (column, &m) in columns.iter().zip(moves.iter()) {
        left.axpy(-m, &column.slope, 1.0);
        left.axpy(-m * m, &column.curvature, 1.0);
    }
    left
}

/// A parabola is trusted for twice the step it was made with.
fn bounded(moves: &DVector<f64>, step: &DVector<f64>, share: f64, freedoms: &[Freedom]) -> DVector<f64> {
    DVector::from_fn(moves.len(), |i, _| {
        let most = 2.5 * freedoms[i].step;
        (moves[i] + share * step[i]).clamp(-most, most)
    })
}
