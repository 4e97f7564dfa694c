//! One effect of a hypothesis, with its sizes and their pattern, and the numbers of it that can be fitted.

use std::collections::BTreeMap;
use std::sync::Arc;

use sim::{Pattern, Setting};

use super::atlas::Atlas;
use super::intervals::Interval;
use super::path::at;
use super::probe::{Probe, other_at_place};
use super::slopes::Slopes;
use crate::candidate::apart;
use crate::slip::{level_of, memory_of};

/// How an effect goes over the runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Shape {
    /// The same always.
    Constant,
    /// Another size in each run.
    ByRun,
    /// Changing at the same rate in every run.
    ByTime,
}

/// One effect of a hypothesis.
#[derive(Debug, Clone)]
pub(super) struct Part {
    pub(super) probe: usize,
    pub(super) shape: Shape,
    /// Values of the effect's parameters: one list, or one for each run.
    pub(super) values: Vec<Vec<f64>>,
    /// Change of the sized parameter per second, where it changes.
    pub(super) per_s: f64,
    /// Factor on the steps of the probe's free numbers.
    pub(super) stride: f64,
    /// The standard error of a size that was found by trying many: descents leave it alone.
    pub(super) held: Option<f64>,
    /// What goes with its size wherever a descent leads that.
    pub(super) tied: Option<Tied>,
    /// What its numbers do, if it was looked around there or near by.
    pub(super) slopes: Option<Arc<Slopes>>,
}

impl PartialEq for Part {
    /// What was seen of a part tells it from no other.
    fn eq(&self, other: &Self) -> bool {
        let Self {
            probe,
            shape,
            values,
            per_s,
            stride,
            held,
            tied,
            slopes: _,
        } = self;
        (*probe, *shape, *per_s, *stride) == (other.probe, other.shape, other.per_s, other.stride)
            && (values, held, tied) == (&other.values, &other.held, &other.tied)
    }
}

/// A value that is a known multiple of its effect's size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Tied {
    pub(super) parameter: usize,
    pub(super) multiple: f64,
    /// Standard error of the multiple.
    pub(super) error: f64,
}

/// A number of a hypothesis that a fit may change.
#[derive(Debug, Clone, Copy)]
pub(super) struct Freedom {
    /// Which effect of the hypothesis.
    pub(super) part: usize,
    /// All runs, or one.
    pub(super) run: Option<usize>,
    /// The parameter, or `None` for the change per second.
    pub(super) parameter: Option<usize>,
    /// A step over which its action is about linear.
    pub(super) step: f64,
    /// It moves in whole multiples of this, which its step is then.
    pub(super) quantum: Option<f64>,
}

impl Freedom {
    /// A number that all runs share.
    #[cfg(test)]
    pub(super) fn shared(step: f64) -> Self {
        Self {
            part: 0,
            run: None,
            parameter: Some(0),
            step,
            quantum: None,
        }
    }

    /// The same number over another step, which is at least and at most such shares of its own.
    pub(super) fn over(self, step: f64, (least, most): (f64, f64)) -> Self {
        if self.quantum.is_some() {
            return self;
        }
        Self {
            step: step.clamp(least * self.step, most * self.step),
            ..self
        }
    }

    /// A move that it can make, the nearest to this one.
    pub(super) fn possible(&self, moved: f64) -> f64 {
        self.quantum
            .map_or(moved, |quantum| (moved / quantum).round() * quantum)
    }

    /// Whether this is the same number of another run.
    pub(super) fn is_beside(&self, other: &Self) -> bool {
        self.part == other.part && self.parameter == other.parameter && self.run != other.run
    }
}

impl Part {
    /// A probe at sizes that a screening found: one, one for each run, or one with its change from lap to lap.
    pub(super) fn screened(atlas: &Atlas, probe: usize, shape: Shape, sizes: &[f64]) -> Self {
        let p = &atlas.probes[probe];
        let clamped = |size: f64| p.clamped(&p.values(p.quantum.map_or(size, |q| (size / q).round() * q)));
        match shape {
            Shape::Constant => Self::of(probe, shape, vec![clamped(sizes[0])]),
            Shape::ByRun => Self::of(probe, shape, sizes.iter().map(|&s| clamped(s)).collect()),
            Shape::ByTime => {
                let per_s = sizes[1] / atlas.lap_s();
                let at_start = clamped(sizes[0] - per_s * middle_s(atlas));
                Self {
                    per_s,
                    ..Self::of(probe, shape, vec![at_start])
                }
            }
        }
    }

    /// A probe with these values, of which nothing else is known.
    fn of(probe: usize, shape: Shape, values: Vec<Vec<f64>>) -> Self {
        Self {
            probe,
            shape,
            values,
            per_s: 0.0,
            stride: 1.0,
            held: None,
            tied: None,
            slopes: None,
        }
    }

    /// The other effect that acts at a place of a wall at this one's, to either side of nothing; none beside what has no place.
    pub(super) fn at_same_place(&self, atlas: &Atlas) -> Vec<Self> {
        let Some(number) = other_at_place(&atlas.probes, self.probe, &self.values[0]) else {
            return Vec::new();
        };
        let other = &atlas.probes[number];
        let at_size = |size: f64| {
            let mut part = Self::screened(atlas, number, Shape::Constant, &[size]);
            other.move_to_place_of(&mut part.values[0], &atlas.probes[self.probe], &self.values[0]);
            part
        };
        other.smallest_sizes().into_iter().map(at_size).collect()
    }

    /// The other kind of slip, level or memory, with which wheels are as far off after a while; `None` of other effects and of less
    /// slip than declared.
    pub(super) fn slipping_otherwise(&self, atlas: &Atlas) -> Option<Self> {
        let size = self.mean_size(atlas);
        let (name, size) = match atlas.probes[self.probe].spec.name {
            "slip-level" => ("slip-memory", memory_of(size)),
            "slip-memory" => ("slip-level", level_of(size)),
            _ => return None,
        };
        let number = atlas.probes.iter().position(|probe| probe.spec.name == name)?;
        let more = size > atlas.probes[number].neutral;
        more.then(|| Self::screened(atlas, number, Shape::Constant, &[size]))
    }

    /// A group of basis functions at multiples of its steps.
    pub(super) fn group(probe: &Probe, number: usize, multiples: &[f64]) -> Self {
        let mut values = probe.origin().to_vec();
        for (&(parameter, step), multiple) in probe.free.iter().zip(multiples) {
            values[parameter] += step * multiple;
        }
        let largest = multiples.iter().fold(0.0_f64, |most, m| most.max(m.abs()));
        Self {
            stride: (0.3 * largest).max(1.0),
            ..Self::of(number, Shape::Constant, vec![values])
        }
    }

    /// The same of which nothing was seen.
    pub(super) fn without_slopes(self) -> Self {
        Self { slopes: None, ..self }
    }

    /// The same with a value that goes with its size.
    pub(super) fn with_tied(mut self, tied: Tied, probe: &Probe) -> Self {
        self.tied = Some(tied);
        self.keep_tied(probe);
        self
    }

    /// Has what goes with its size follow it.
    pub(super) fn keep_tied(&mut self, probe: &Probe) {
        if let Some(tied) = self.tied {
            for values in &mut self.values {
                values[tied.parameter] = tied.multiple * values[probe.size_index()];
            }
        }
    }

    /// Whether a size that was found by trying many is within its error of another one.
    pub(super) fn is_within_error_of(&self, other: &Self) -> bool {
        let mut sizes = self.values.iter().flatten().zip(other.values.iter().flatten());
        (self.held).is_none_or(|error| sizes.all(|(a, b)| (a - b).abs() <= error))
    }

    /// Whether its numbers are another's but for what sizes that jump move beside effects that are still being fitted.
    pub(super) fn is_about(&self, other: &Self) -> bool {
        const APART: f64 = 0.06;
        let mut sizes = self.values.iter().flatten().zip(other.values.iter().flatten());
        sizes.all(|(a, b)| (a - b).abs() <= APART * a.abs())
    }

    /// The same with its size a multiple as far from the neutral one.
    pub(super) fn times(&self, multiple: f64, atlas: &Atlas) -> Self {
        let size = atlas.probes[self.probe].times(self.mean_size(atlas), multiple);
        Self::screened(atlas, self.probe, Shape::Constant, &[size])
    }

    /// A probe at a size that was found by trying many, to within an error.
    pub(super) fn held(atlas: &Atlas, probe: usize, size: f64, error: f64) -> Self {
        Self {
            held: Some(error),
            ..Self::screened(atlas, probe, Shape::Constant, &[size])
        }
    }

    /// The same with a size that goes over the runs or in time, from the same size; `None` if it has a pattern or cannot.
    pub(super) fn over(&self, shape: Shape, atlas: &Atlas) -> Option<Self> {
        let (can, lists) = match shape {
            Shape::Constant => (false, 1),
            Shape::ByRun => (atlas.layout.runs() > 1, atlas.layout.runs()),
            Shape::ByTime => (!atlas.probes[self.probe].drifts(), 1),
        };
        (can && self.shape == Shape::Constant && self.held.is_none()).then(|| Self {
            shape,
            values: vec![self.values[0].clone(); lists],
            slopes: None,
            ..self.clone()
        })
    }

    /// Its size, the mean over the runs.
    pub(super) fn mean_size(&self, atlas: &Atlas) -> f64 {
        let size_of = |values: &Vec<f64>| atlas.probes[self.probe].size_of(values);
        self.values.iter().map(size_of).sum::<f64>() / self.values.len() as f64
    }

    /// The same at its mean size.
    pub(super) fn plain(&self, atlas: &Atlas) -> Self {
        let probe = &atlas.probes[self.probe];
        let mut values = self.values[0].clone();
        for (i, change) in probe.along(self.per_s * middle_s(atlas)).into_iter().enumerate() {
            if probe.moves(i) {
                let all = self.values.iter().map(|values| values[i]);
                values[i] = all.sum::<f64>() / self.values.len() as f64 + change;
            }
        }
        Self {
            shape: Shape::Constant,
            values: vec![values],
            per_s: 0.0,
            slopes: None,
            ..self.clone()
        }
    }

    /// Whether its size came to the neutral one in every run: sizes in steps do.
    pub(super) fn is_nothing(&self, probe: &Probe) -> bool {
        let size = probe.size_index();
        let at_neutral = |values: &Vec<f64>| values[size] == probe.neutral;
        probe.quantum.is_some() && self.per_s == 0.0 && self.values.iter().all(at_neutral)
    }

    /// Whether another is the same constant effect at a size less than a step away, and at the same place.
    pub(super) fn is_near(&self, other: &Self, atlas: &Atlas) -> bool {
        self.agrees_with(other, atlas, 1.0, |_| true)
    }

    /// Whether another is the same constant effect at about the same place, whatever its size and its length.
    pub(super) fn is_at_place_of(&self, other: &Self, atlas: &Atlas) -> bool {
        const STEPS: f64 = 3.0;
        let probe = &atlas.probes[self.probe];
        let length = probe.spec.place_of("length_m");
        self.agrees_with(other, atlas, STEPS, |i| !probe.is_size(i) && Some(i) != length)
    }

    /// Whether another is the same constant effect at values less than so many steps away, of the parameters that count.
    fn agrees_with(&self, other: &Self, atlas: &Atlas, steps: f64, counts: impl Fn(usize) -> bool) -> bool {
        let probe = &atlas.probes[self.probe];
        let step = |i: usize| {
            probe
                .free
                .iter()
                .find(|free| free.0 == i)
                .map_or(0.0, |free| free.1)
        };
        let off = |i: usize| apart(self.values[0][i], other.values[0][i], probe.spec.params.get(i));
        let near = |i: usize| off(i).abs() <= steps * step(i);
        probe.spec == atlas.probes[other.probe].spec
            && [self.shape, other.shape] == [Shape::Constant; 2]
            && self.values[0].len() == other.values[0].len()
            && (0..self.values[0].len()).filter(|&i| counts(i)).all(near)
    }

    pub(super) fn setting(&self, probe: &Probe) -> Setting {
        let pattern = match self.shape {
            Shape::Constant => Pattern::Constant(self.values[0].clone()),
            Shape::ByRun => Pattern::ByRun(self.values.clone()),
            Shape::ByTime => Pattern::ByTime {
                start: self.values[0].clone(),
                per_s: probe.along(self.per_s),
            },
        };
        Setting {
            spec: probe.spec,
            pattern,
        }
    }

    /// How many numbers of it were fitted, one way or another: one that all runs share is one.
    pub(super) fn fitted(&self, part: usize, errors: &[(Freedom, f64)]) -> usize {
        let own = errors.iter().filter(|(freedom, _)| freedom.part == part);
        own.count() + self.fitted_otherwise()
    }

    /// How many numbers of it were found otherwise than by descents.
    pub(super) fn fitted_otherwise(&self) -> usize {
        self.held.iter().len() + self.tied.iter().len()
    }

    /// Standard errors in the order of the pattern's values: run after run, or start values and then slopes.
    pub(super) fn errors(&self, part: usize, errors: &[(Freedom, f64)], atlas: &Atlas) -> Vec<f64> {
        let count = self.values[0].len();
        let slopes = if self.shape == Shape::ByTime { count } else { 0 };
        let mut all = vec![0.0; count * self.values.len() + slopes];
        if let Some(error) = self.held {
            all[atlas.probes[self.probe].size_index()] = error;
        }
        if let Some(tied) = self.tied {
            let size = atlas.probes[self.probe].size_index();
            for (run, values) in self.values.iter().enumerate() {
                all[run * count + tied.parameter] = tied.error * values[size].abs();
            }
        }
        for (freedom, error) in errors.iter().filter(|(f, _)| f.part == part) {
            match freedom.parameter {
                None => {
                    let along = atlas.probes[self.probe].along(*error);
                    (all[count..].iter_mut().zip(along)).for_each(|(all, along)| *all = along.abs());
                }
                Some(i) => {
                    let runs = freedom.run.map_or(0..self.values.len(), |run| run..run + 1);
                    // Any size that comes to the same step is as good.
                    let within_step = freedom.quantum.map_or(0.0, |step| step / 12.0_f64.sqrt());
                    runs.for_each(|run| all[run * count + i] = error.max(within_step));
                }
            }
        }
        all
    }

    /// Intervals of its values that were found, by their place among the pattern's values.
    pub(super) fn intervals(&self, part: usize, intervals: &[Interval]) -> BTreeMap<usize, [f64; 2]> {
        let count = self.values[0].len();
        // What all runs share stands beside each run's own.
        let in_every_run = |i: usize, ends: [f64; 2]| {
            let runs = 0..self.values.len();
            runs.map(move |run| (run * count + i, ends))
        };
        (intervals.iter().filter(|(freedom, _)| freedom.part == part))
            .filter_map(|(freedom, ends)| Some(in_every_run(freedom.parameter?, *ends)))
            .flatten()
            .collect()
    }

    pub(super) fn freedoms(&self, part: usize, atlas: &Atlas) -> Vec<Freedom> {
        let probe = &atlas.probes[self.probe];
        let runs = self.values.len();
        let mut freedoms = Vec::new();
        if self.held.is_some() {
            return freedoms;
        }
        let size = self.mean_size(atlas);
        let is_tied = |parameter: usize| self.tied.is_some_and(|tied| tied.parameter == parameter);
        for (i, &(parameter, _)) in probe.free.iter().enumerate() {
            if is_tied(parameter) {
                continue;
            }
            let quantum = probe.quantum.filter(|_| i == 0);
            let step = quantum.unwrap_or(probe.step_at(i, size) * self.stride);
            let goes_by_run = self.shape == Shape::ByRun && probe.moves(parameter);
            let of = if goes_by_run {
                (0..runs).map(Some).collect()
            } else {
                vec![None]
            };
            freedoms.extend(of.into_iter().map(|run| Freedom {
                part,
                run,
                parameter: Some(parameter),
                step,
                quantum,
            }));
        }
        if self.shape == Shape::ByTime {
            let run_s = atlas.run_laps() * atlas.lap_s();
            freedoms.push(Freedom {
                part,
                run: None,
                parameter: None,
                step: probe.step_at(0, size) / run_s,
                quantum: None,
            });
        }
        freedoms
    }
}

impl Atlas {
    /// Whether two parts do about the same, as far as their paths tell: at their mean sizes, whatever these are. More slip and slip that
    /// remembers do, and of both paths tell little but noise.
    pub(super) fn do_alike(&self, one: &Part, other: &Part) -> bool {
        /// Cosine of the angle between their actions.
        const ALIKE: f64 = 0.95;
        let slips = |part: &Part| part.slipping_otherwise(self).is_some();
        if slips(one) && slips(other) {
            return true;
        }
        let action = |part: &Part| {
            let nodes = self.nodes(part.probe);
            (!nodes.is_empty()).then(|| at(&nodes, part.mean_size(self)))
        };
        match (action(one), action(other)) {
            (Some(one), Some(other)) => one.dot(&other).abs() >= ALIKE * one.norm() * other.norm(),
            // Of what was simulated at no size the same alone is known.
            _ => one.probe == other.probe,
        }
    }
}

/// Time at which a run's laps are half done: the kept ones begin one and a half laps after the run, on average.
fn middle_s(atlas: &Atlas) -> f64 {
    (1.5 + atlas.run_laps() / 2.0) * atlas.lap_s()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::laps::testing::atlas_of;

    #[test]
    fn effects_that_put_a_robot_aside_do_alike() {
        let mut atlas = atlas_of(&["wheel-scale", "axle-length"]);
        let [one, other] = [0, 1].map(|probe| Part::screened(&atlas, probe, Shape::Constant, &[5.0]));
        assert!(atlas.do_alike(&one, &other));
        // The other puts the first run to the other side.
        let first = atlas.layout.run(0);
        for departure in atlas.paths[1].iter_mut().flatten() {
            let action = &mut departure.action;
            action.rows_mut(first.start, first.len()).scale_mut(-1.0);
        }
        assert!(!atlas.do_alike(&one, &other));
        assert!(atlas.do_alike(&other, &other));
    }
}
