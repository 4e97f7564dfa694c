//! One or more effects with sizes and patterns, as a vector of numbers that can be fitted.

use std::collections::BTreeMap;
use std::ops::Range;

use sim::{Pattern, Setting};

use super::atlas::Atlas;
use super::intervals::Interval;
use super::probe::{Probe, other_at_place};
use super::screen::{at, worth};
use super::tests_of_fit::Quadratic;
use crate::candidate::{apart, round, take_mean_of_others, within};
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
#[derive(Debug, Clone, PartialEq)]
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
}

/// Effects that act together.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Hypothesis {
    pub(super) parts: Vec<Part>,
}

/// A number of a hypothesis that a fit may change.
#[derive(Debug, Clone, Copy)]
pub(super) struct Freedom {
    part: usize,
    /// All runs, or one.
    run: Option<usize>,
    /// The parameter, or `None` for the change per second.
    parameter: Option<usize>,
    /// A step over which its action is about linear.
    pub(super) step: f64,
    /// It moves in whole multiples of this, which its step is then.
    quantum: Option<f64>,
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

    /// The run whose size this is, if it is one run's.
    pub(super) fn run(&self) -> Option<usize> {
        self.run
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
            Shape::Constant => Self {
                probe,
                shape,
                values: vec![clamped(sizes[0])],
                per_s: 0.0,
                stride: 1.0,
                held: None,
            },
            Shape::ByRun => Self {
                probe,
                shape,
                values: sizes.iter().map(|&s| clamped(s)).collect(),
                per_s: 0.0,
                stride: 1.0,
                held: None,
            },
            Shape::ByTime => {
                let per_s = sizes[1] / atlas.lap_s();
                Self {
                    probe,
                    shape,
                    values: vec![clamped(sizes[0] - per_s * middle_s(atlas))],
                    per_s,
                    stride: 1.0,
                    held: None,
                }
            }
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

    /// The same at the other sensors; none of what acts on all.
    pub(super) fn at_other_sensors(&self, atlas: &Atlas) -> Vec<Self> {
        let own = &atlas.probes[self.probe];
        let size = self.mean_size(atlas);
        (atlas.probes.iter().enumerate())
            .filter(|(_, other)| other.is_at_other_sensor(own))
            .map(|(number, _)| Self::screened(atlas, number, Shape::Constant, &[size]))
            .collect()
    }

    /// A group of basis functions at multiples of its steps.
    pub(super) fn group(probe: &Probe, number: usize, multiples: &[f64]) -> Self {
        let mut values = probe.origin().to_vec();
        for (&(parameter, step), multiple) in probe.free.iter().zip(multiples) {
            values[parameter] += step * multiple;
        }
        let largest = multiples.iter().fold(0.0_f64, |most, m| most.max(m.abs()));
        Self {
            probe: number,
            shape: Shape::Constant,
            values: vec![values],
            per_s: 0.0,
            stride: (0.3 * largest).max(1.0),
            held: None,
        }
    }

    /// Whether a size that was found by trying many is within its error of another one.
    pub(super) fn is_within_error_of(&self, other: &Self) -> bool {
        let mut sizes = self.values.iter().flatten().zip(other.values.iter().flatten());
        (self.held).is_none_or(|error| sizes.all(|(a, b)| (a - b).abs() <= error))
    }

    /// Whether its numbers are another's but for what sizes that jump move beside effects that are still being fitted.
    fn is_about(&self, other: &Self) -> bool {
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
    fn over(&self, shape: Shape, atlas: &Atlas) -> Option<Self> {
        let (can, lists) = match shape {
            Shape::Constant => (false, 1),
            Shape::ByRun => (atlas.layout.runs() > 1, atlas.layout.runs()),
            Shape::ByTime => (!atlas.probes[self.probe].drifts(), 1),
        };
        (can && self.shape == Shape::Constant && self.held.is_none()).then(|| Self {
            shape,
            values: vec![self.values[0].clone(); lists],
            ..self.clone()
        })
    }

    /// Its size, the mean over the runs.
    pub(super) fn mean_size(&self, atlas: &Atlas) -> f64 {
        let size_of = |values: &Vec<f64>| atlas.probes[self.probe].size_of(values);
        self.values.iter().map(size_of).sum::<f64>() / self.values.len() as f64
    }

    /// The same at its mean size.
    fn plain(&self, atlas: &Atlas) -> Self {
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
            ..self.clone()
        }
    }

    /// Whether its size came to the neutral one in every run: sizes in steps do.
    pub(super) fn is_nothing(&self, probe: &Probe) -> bool {
        let size = probe.size_index();
        let at_neutral = |values: &Vec<f64>| values[size] == probe.neutral;
        probe.quantum.is_some() && self.per_s == 0.0 && self.values.iter().all(at_neutral)
    }

    fn is_near(&self, other: &Self, atlas: &Atlas) -> bool {
        let probe = &atlas.probes[self.probe];
        let step = |i: usize| {
            probe
                .free
                .iter()
                .find(|free| free.0 == i)
                .map_or(0.0, |free| free.1)
        };
        let off = |i: usize| apart(self.values[0][i], other.values[0][i], probe.spec.params.get(i));
        let near = |i: usize| off(i).abs() <= step(i);
        probe.spec == atlas.probes[other.probe].spec
            && [self.shape, other.shape] == [Shape::Constant; 2]
            && self.values[0].len() == other.values[0].len()
            && (0..self.values[0].len()).all(near)
    }

    fn setting(&self, probe: &Probe) -> Setting {
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
        own.count() + self.held.iter().len()
    }

    /// Standard errors in the order of the pattern's values: run after run, or start values and then slopes.
    pub(super) fn errors(&self, part: usize, errors: &[(Freedom, f64)], atlas: &Atlas) -> Vec<f64> {
        let count = self.values[0].len();
        let slopes = if self.shape == Shape::ByTime { count } else { 0 };
        let mut all = vec![0.0; count * self.values.len() + slopes];
        if let Some(error) = self.held {
            all[atlas.probes[self.probe].size_index()] = error;
        }
        for (freedom, error) in errors.iter().filter(|(f, _)| f.part == part) {
            match freedom.parameter {
                None => {
                    let along = atlas.probes[self.probe].along(*error);
                    (all[count..].iter_mut().zip(along)).for_each(|(all, along)| *all = along.abs());
                }
                Some(i) => {
                    let runs = freedom.run.map_or(0..self.values.len(), |run| run..run + 1);
                    runs.for_each(|run| all[run * count + i] = *error);
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

    fn freedoms(&self, part: usize, atlas: &Atlas) -> Vec<Freedom> {
        let probe = &atlas.probes[self.probe];
        let runs = self.values.len();
        let mut freedoms = Vec::new();
        if self.held.is_some() {
            return freedoms;
        }
        let size = self.mean_size(atlas);
        for (i, &(parameter, _)) in probe.free.iter().enumerate() {
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

/// Time at which a run's laps are half done: the kept ones begin one and a half laps after the run, on average.
fn middle_s(atlas: &Atlas) -> f64 {
    (1.5 + atlas.run_laps() / 2.0) * atlas.lap_s()
}

impl Hypothesis {
    /// The declared model.
    pub(super) fn nothing() -> Self {
        Self { parts: Vec::new() }
    }

    /// A single effect.
    pub(super) fn of(part: Part) -> Self {
        Self { parts: vec![part] }
    }

    /// The effects as the simulator takes them.
    pub(super) fn settings(&self, atlas: &Atlas) -> Vec<Setting> {
        self.parts
            .iter()
            .map(|part| part.setting(&atlas.probes[part.probe]))
            .collect()
    }

    /// Whether an effect acts at a place of a wall, which is fitted too.
    pub(super) fn has_place(&self, atlas: &Atlas) -> bool {
        self.parts.iter().any(|part| atlas.probes[part.probe].has_place())
    }

    /// Whether no size goes over the runs or in time.
    pub(super) fn is_constant(&self) -> bool {
        self.parts.iter().all(|part| part.shape == Shape::Constant)
    }

    /// Constant effects with the size of one of them, of each, going over the runs or in time, from the same size; none of
    /// effects that have patterns.
    pub(super) fn over(&self, shape: Shape, atlas: &Atlas) -> Vec<Self> {
        if !self.is_constant() {
            return Vec::new();
        }
        (0..self.parts.len())
            .filter_map(|part| {
                let mut parts = self.parts.clone();
                parts[part] = parts[part].over(shape, atlas)?;
                Some(Self { parts })
            })
            .collect()
    }

    /// The same with the pattern of its only effect that has one given to each of the others instead.
    pub(super) fn with_pattern_elsewhere(&self, atlas: &Atlas) -> Vec<Self> {
        let mut patterned = self.parts.iter().filter(|part| part.shape != Shape::Constant);
        let (Some(one), None) = (patterned.next(), patterned.next()) else {
            return Vec::new();
        };
        let plain: Vec<Part> = self.parts.iter().map(|part| part.plain(atlas)).collect();
        let given = |(i, part): (usize, &Part)| {
            let mut parts = plain.clone();
            parts[i] = part.over(one.shape, atlas)?;
            Some(Self { parts })
        };
        self.parts.iter().enumerate().filter_map(given).collect()
    }

    /// Where several of its effects have patterns, the same with one of these at its mean size, for each.
    pub(super) fn with_a_pattern_less(&self, atlas: &Atlas) -> Vec<Self> {
        let patterned: Vec<usize> = (0..self.parts.len())
            .filter(|&part| self.parts[part].shape != Shape::Constant)
            .collect();
        if patterned.len() < 2 {
            return Vec::new();
        }
        let with_one_size = |part| self.with_one_size(part, atlas);
        patterned.into_iter().map(with_one_size).collect()
    }

    /// The same with the mean size of every effect whose size goes over the runs or in time; `None` if none does.
    pub(super) fn without_patterns(&self, atlas: &Atlas) -> Option<Self> {
        (!self.is_constant()).then(|| Self {
            parts: self.parts.iter().map(|part| part.plain(atlas)).collect(),
        })
    }

    /// Whether sizes that go over the runs, or in time, do so by more than chance, by their errors.
    pub(super) fn patterns_show(&self, errors: &[(Freedom, f64)]) -> bool {
        (0..self.parts.len()).all(|part| self.pattern_shows(part, errors))
    }

    fn pattern_shows(&self, part: usize, errors: &[(Freedom, f64)]) -> bool {
        const CHANCE: f64 = 0.01;
        let numbers = |are: &dyn Fn(&Freedom) -> bool| -> Vec<(f64, f64)> {
            let own = errors.iter().filter(|(f, _)| f.part == part && are(f));
            own.map(|(f, error)| (self.get(f), *error)).collect()
        };
        let p = match self.parts[part].shape {
            Shape::Constant => 0.0,
            Shape::ByRun => {
                let count = self.parts[part].values[0].len();
                let of = |i: usize| differ(&numbers(&|f| f.run.is_some() && f.parameter == Some(i)));
                let all: Vec<Quadratic> = (0..count).map(of).collect();
                let freedom = all.iter().map(|differ| differ.freedom).sum();
                Quadratic::new(all.iter().map(|differ| differ.q).sum(), freedom).p
            }
            Shape::ByTime => {
                let changes = numbers(&|f| f.parameter.is_none());
                let squares = changes.iter().map(|(change, error)| (change / error).powi(2));
                Quadratic::new(squares.sum(), 1).p
            }
        };
        p < CHANCE
    }

    /// The same without each of its effects that may do nothing, and with one size of each whose sizes may be the same always.
    pub(super) fn simpler(&self, errors: &[(Freedom, f64)], atlas: &Atlas) -> Vec<Self> {
        let idle = self
            .idle(errors, atlas)
            .into_iter()
            .map(|part| self.without(part));
        let steady = (0..self.parts.len()).filter(|&part| !self.pattern_shows(part, errors));
        idle.chain(steady.map(|part| self.with_one_size(part, atlas)))
            .collect()
    }

    /// The same with one of its effects at its mean size.
    fn with_one_size(&self, part: usize, atlas: &Atlas) -> Self {
        let mut parts = self.parts.clone();
        parts[part] = parts[part].plain(atlas);
        Self { parts }
    }

    /// Whether it has another's effects in the same patterns.
    pub(super) fn has_patterns_of(&self, other: &Self) -> bool {
        let has = |part: &Part| {
            let mut own = self.parts.iter();
            own.any(|own| own.probe == part.probe && own.shape == part.shape)
        };
        self.parts.len() == other.parts.len() && other.parts.iter().all(has)
    }

    /// Its constant effects whose sizes are so few errors from doing nothing that they may do it.
    fn idle(&self, errors: &[(Freedom, f64)], atlas: &Atlas) -> Vec<usize> {
        const ERRORS: f64 = 6.0;
        let is_idle = |&number: &usize| {
            let part = &self.parts[number];
            let probe = &atlas.probes[part.probe];
            let is_near_nothing =
                |i: usize, error: f64| (part.values[0][i] - probe.origin()[i]).abs() < ERRORS * error;
            let mut fitted = (errors.iter().filter(|(freedom, _)| freedom.part == number))
                .filter_map(|(freedom, error)| Some((freedom.parameter?, *error)))
                .filter(|(i, _)| probe.is_size(*i))
                .peekable();
            part.shape == Shape::Constant
                && match part.held {
                    Some(error) => is_near_nothing(probe.size_index(), error),
                    None => fitted.peek().is_some() && fitted.all(|(i, error)| is_near_nothing(i, error)),
                }
        };
        (0..self.parts.len()).filter(is_idle).collect()
    }

    /// The same with the sizes of these parts where it has their effects at a size that was found by trying many.
    pub(super) fn with_held(&self, known: &[Part]) -> Self {
        let held = |part: &Part| {
            let same =
                |known: &&Part| part.held.is_some() && known.probe == part.probe && known.is_about(part);
            known.iter().find(same).unwrap_or(part).clone()
        };
        Self {
            parts: self.parts.iter().map(held).collect(),
        }
    }

    /// Its probes, in order.
    pub(super) fn probes(&self) -> Vec<usize> {
        let mut probes: Vec<usize> = self.parts.iter().map(|part| part.probe).collect();
        probes.sort_unstable();
        probes
    }

    /// Whether another has the same constant effects at sizes less than a step away.
    pub(super) fn is_near(&self, other: &Self, atlas: &Atlas) -> bool {
        let near = |part: &Part| other.parts.iter().any(|other| part.is_near(other, atlas));
        self.parts.len() == other.parts.len() && self.parts.iter().all(near)
    }

    /// All its effects but one.
    pub(super) fn without(&self, part: usize) -> Self {
        let mut others = self.clone();
        others.parts.remove(part);
        others
    }

    /// This hypothesis and another together.
    pub(super) fn with(&self, other: &Self) -> Self {
        Self {
            parts: self.parts.iter().chain(&other.parts).cloned().collect(),
        }
    }

    /// How much a part does, for an order of importance: its squared action along its path.
    pub(super) fn weight(&self, part: usize, atlas: &Atlas) -> f64 {
        let part = &self.parts[part];
        let nodes = atlas.nodes(part.probe);
        if nodes.len() < 2 {
            return f64::INFINITY;
        }
        at(&nodes, part.mean_size(atlas)).norm_squared()
    }

    /// What counts of a gain in log-likelihood.
    pub(super) fn worth(&self, gain: f64) -> f64 {
        /// Share of a gain that faults of the simulation may take.
        const FAULTS: f64 = 0.001;
        self.parts
            .iter()
            .map(|part| part.shape)
            .find(|shape| *shape != Shape::Constant)
            .map_or(gain, |shape| worth(gain, shape, FAULTS))
    }

    /// How many numbers were fitted, one way or another.
    pub(super) fn fitted(&self, atlas: &Atlas) -> usize {
        let held = self.parts.iter().filter(|part| part.held.is_some());
        self.freedoms(atlas).len() + held.count()
    }

    /// The shares that data leave, with these errors, of what robots of this kind do, one for each number: their product is the Occam
    /// factor of Laplace's approximation of how probable the data are where only these ranges are known beforehand (Kass and
    /// Raftery 1995). Of sizes by run their mean counts, and no change in time: how far robots change is less known.
    pub(super) fn shares_left(&self, errors: &[(Freedom, f64)], atlas: &Atlas) -> Vec<f64> {
        let moved = errors.iter().filter_map(|(freedom, error)| {
            let part = &self.parts[freedom.part];
            let range = self.far(freedom, atlas)?;
            let error = match freedom.run {
                Some(0) => error / (part.values.len() as f64).sqrt(),
                Some(_) => return None,
                None => *error,
            };
            Some(share_left(error, freedom.quantum, range))
        });
        let held = self.parts.iter().filter_map(|part| {
            let range = atlas.probes[part.probe].range_of(0);
            Some(share_left(part.held?, None, range))
        });
        moved.chain(held).collect()
    }

    /// The numbers that a descent may change.
    pub(super) fn freedoms(&self, atlas: &Atlas) -> Vec<Freedom> {
        self.parts
            .iter()
            .enumerate()
            .flat_map(|(i, part)| part.freedoms(i, atlas))
            .collect()
    }

    /// This hypothesis with the sizes of one run replaced by the mean of the other runs', where they go by run.
    pub(super) fn with_mean_size(mut self, run: usize) -> Self {
        for part in self.parts.iter_mut() {
            take_mean_of_others(&mut part.values, run);
        }
        self
    }

    /// The value of one number.
    pub(super) fn get(&self, freedom: &Freedom) -> f64 {
        let part = &self.parts[freedom.part];
        freedom
            .parameter
            .map_or(part.per_s, |i| part.values[freedom.run.unwrap_or(0)][i])
    }

    /// The range of one number that all runs share; `None` of others, of those that go round, and of those that come in steps.
    pub(super) fn range(&self, freedom: &Freedom, atlas: &Atlas) -> Option<Range<f64>> {
        let params = atlas.probes[self.parts[freedom.part].probe].spec.params;
        let param = params.get(freedom.parameter?)?;
        let own = freedom.run.is_none() && freedom.quantum.is_none() && round(param).is_none();
        own.then_some(param.low..param.high)
    }

    /// How far one number goes among robots of this kind; see [`Probe::range_of`].
    pub(super) fn far(&self, freedom: &Freedom, atlas: &Atlas) -> Option<f64> {
        let probe = &atlas.probes[self.parts[freedom.part].probe];
        let is_it = |free: &(usize, f64)| Some(free.0) == freedom.parameter;
        Some(probe.range_of(probe.free.iter().position(is_it)?))
    }

    /// How far one number is from what it is in another hypothesis of the same parts.
    pub(super) fn apart(&self, other: &Self, freedom: &Freedom, atlas: &Atlas) -> f64 {
        let spec = atlas.probes[self.parts[freedom.part].probe].spec;
        let param = freedom.parameter.and_then(|i| spec.params.get(i));
        apart(self.get(freedom), other.get(freedom), param)
    }

    /// This hypothesis with some numbers moved; each stays in its parameter's range.
    pub(super) fn moved(&self, atlas: &Atlas, moves: &[(Freedom, f64)]) -> Self {
        let mut moved = self.clone();
        for (freedom, by) in moves {
            let part = &mut moved.parts[freedom.part];
            let spec = atlas.probes[part.probe].spec;
            match freedom.parameter {
                None => part.per_s += by,
                Some(i) => {
                    let runs = freedom.run.map_or(0..part.values.len(), |run| run..run + 1);
                    for values in &mut part.values[runs] {
                        let param = spec.param(i);
                        values[i] = param.map_or(values[i] + by, |param| within(values[i] + by, param));
                    }
                }
            }
        }
        moved
    }
}

/// Mean over its range of the likelihood of a number with a standard error, of which the greatest is one. Of numbers that come in
/// steps there is nothing between them.
fn share_left(error: f64, step: Option<f64>, range: f64) -> f64 {
    let left = (std::f64::consts::TAU.sqrt() * error).max(step.unwrap_or(0.0));
    (left / range).min(1.0)
}

/// The squares by which values with errors differ from their weighted mean.
fn differ(values: &[(f64, f64)]) -> Quadratic {
    let weight = |error: f64| error.powi(-2);
    let total: f64 = values.iter().map(|(_, error)| weight(*error)).sum();
    let mean = values
        .iter()
        .map(|(value, error)| value * weight(*error))
        .sum::<f64>()
        / total;
    let square = |(value, error): &(f64, f64)| ((value - mean) / error).powi(2);
    Quadratic::new(values.iter().map(square).sum(), values.len().saturating_sub(1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_likelihood_leaves_its_mean_over_the_range() {
        let mean_over = |error: f64, numbers: &[f64]| {
            let total: f64 = numbers.iter().map(|x| (-0.5 * (x / error).powi(2)).exp()).sum();
            total / numbers.len() as f64
        };
        let all: Vec<f64> = (0..100_000).map(|k| (f64::from(k) - 5e4) * 1e-4).collect();
        assert!((share_left(0.1, None, 10.0) - mean_over(0.1, &all)).abs() < 1e-6);
        let ten: Vec<f64> = (0..10).map(|k| (f64::from(k) - 3.0) * 0.032).collect();
        for error in [0.001, 0.04] {
            let share = share_left(error, Some(0.032), 0.32);
            assert!((share - mean_over(error, &ten)).abs() < 0.02, "{error}: {share}");
        }
        assert_eq!(share_left(20.0, None, 10.0), 1.0);
    }

    #[test]
    fn values_differ_by_their_squares_about_the_weighted_mean() {
        // 5 apart, of variance 1 + 4.
        let found = differ(&[(1.0, 1.0), (6.0, 2.0)]);
        assert!((found.q - 5.0).abs() < 1e-12 && found.freedom == 1);
        assert!((found.p - 0.025_347).abs() < 1e-5, "{}", found.p);
        assert_eq!(differ(&[(3.0, 0.1)]).p, 1.0);
    }
}
