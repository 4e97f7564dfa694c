//! One or more effects with sizes and patterns, as a vector of numbers that can be fitted.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};
use sim::Setting;

use super::atlas::Atlas;
use super::part::{Freedom, Part, Shape};
use super::path::at;
use super::screen::worth;
use super::tests_of_fit::Quadratic;
use crate::candidate::{apart, bounded, round, take_mean_of_others};

/// Effects that act together.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Hypothesis {
    pub(super) parts: Vec<Part>,
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

    /// Whether an effect acts at a place of a wall or of the floor, which is fitted too.
    pub(super) fn has_place(&self, atlas: &Atlas) -> bool {
        self.places(atlas).next().is_some()
    }

    /// Its parts that do.
    pub(super) fn places(&self, atlas: &Atlas) -> impl Iterator<Item = usize> {
        let has_place = |&part: &usize| atlas.probes[self.parts[part].probe].has_place();
        (0..self.parts.len()).filter(has_place)
    }

    /// Whether a size of it was found by trying many.
    pub(super) fn has_held(&self) -> bool {
        self.parts.iter().any(|part| part.held.is_some())
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
    pub(super) fn simpler(
        &self,
        errors: &[(Freedom, f64)],
        correlation: &DMatrix<f64>,
        atlas: &Atlas,
    ) -> Vec<Self> {
        let idle = self
            .idle(errors, correlation, atlas)
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

    /// Its constant effects whose sizes are so few errors from doing nothing that they may do it where they are: at another place, or
    /// over another length, a size may be anything.
    fn idle(&self, errors: &[(Freedom, f64)], correlation: &DMatrix<f64>, atlas: &Atlas) -> Vec<usize> {
        const ERRORS: f64 = 6.0;
        let is_place = |freedom: &Freedom| {
            let is_size = |i: usize| atlas.probes[self.parts[freedom.part].probe].is_size(i);
            freedom.parameter.is_some_and(|i| !is_size(i))
        };
        let fitted_at_place = errors_where(errors, correlation, |freedom, place| {
            freedom.part == place.part && is_place(place)
        });
        let is_idle = |&number: &usize| {
            let part = &self.parts[number];
            let probe = &atlas.probes[part.probe];
            let is_near_nothing =
                |i: usize, error: f64| (part.values[0][i] - probe.origin()[i]).abs() < ERRORS * error;
            let mut fitted = (fitted_at_place
                .iter()
                .filter(|(freedom, _)| freedom.part == number))
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
        self.matches(other, |part, other| part.is_near(other, atlas))
    }

    /// Whether another has the same constant effects at the same places.
    pub(super) fn is_at_places_of(&self, other: &Self, atlas: &Atlas) -> bool {
        self.matches(other, |part, other| part.is_at_place_of(other, atlas))
    }

    fn matches(&self, other: &Self, same: impl Fn(&Part, &Part) -> bool) -> bool {
        let known = |part: &Part| other.parts.iter().any(|other| same(part, other));
        self.parts.len() == other.parts.len() && self.parts.iter().all(known)
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

    /// How much a part does, for an order of importance: its squared action along its path, on average over the runs; infinite of a
    /// cause without a name.
    pub(super) fn weight(&self, part: usize, atlas: &Atlas) -> f64 {
        let part = &self.parts[part];
        let nodes = atlas.nodes(part.probe);
        if nodes.len() < 2 {
            return f64::INFINITY;
        }
        let square = |values: &Vec<f64>| at(&nodes, atlas.probes[part.probe].size_of(values)).norm_squared();
        let values = match part.shape {
            Shape::ByTime => part.plain(atlas).values,
            Shape::Constant | Shape::ByRun => part.values.clone(),
        };
        values.iter().map(square).sum::<f64>() / values.len() as f64
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
        let otherwise = self.parts.iter().map(Part::fitted_otherwise);
        self.freedoms(atlas).len() + otherwise.sum::<usize>()
    }

    /// The shares that data leave, with these errors, of what robots of this kind do, one for each number: their product is the Occam
    /// factor of Laplace's approximation of how probable the data are where only these ranges are known beforehand (Kass and
    /// Raftery 1995), if these errors have nothing to do with each other. Of sizes by run their mean counts, and no change in time: how
    /// far robots change is less known.
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

    /// What the logarithm of that Occam factor is beyond that of the product: less than nothing where one number makes up for what
    /// another is off.
    pub(super) fn made_up_for(
        &self,
        errors: &[(Freedom, f64)],
        correlation: &DMatrix<f64>,
        atlas: &Atlas,
    ) -> f64 {
        let always = |(i, (freedom, error)): (usize, &(Freedom, f64))| {
            let counts = freedom.run.is_none() && freedom.quantum.is_none();
            let range = self.far(freedom, atlas).filter(|_| counts)?;
            Some((i, (range / error).powi(2) / std::f64::consts::TAU))
        };
        let (numbers, ranges): (Vec<usize>, Vec<f64>) = errors.iter().enumerate().filter_map(always).unzip();
        let correlation = correlation.select_rows(&numbers).select_columns(&numbers);
        log_volume(&correlation, &DVector::from_vec(ranges))
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
                        values[i] = bounded(spec, values, i, values[i] + by);
                    }
                }
            }
        }
        for part in &mut moved.parts {
            part.keep_tied(&atlas.probes[part.probe]);
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

/// The logarithm of the volume that normal errors with such a correlation leave within normal ranges, whose squares are given in units of
/// those of the errors, in units of the volume that independent errors leave.
fn log_volume(correlation: &DMatrix<f64>, ranges: &DVector<f64>) -> f64 {
    let log_determinant = |matrix: DMatrix<f64>| matrix.determinant().max(f64::MIN_POSITIVE).ln();
    let within = log_determinant(correlation + DMatrix::from_diagonal(ranges));
    let independent: f64 = ranges.iter().map(|range| range.ln_1p()).sum();
    0.5 * (log_determinant(correlation.clone()) - within + independent)
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

/// The errors of numbers where others stay that hold them, by how all go together.
fn errors_where(
    errors: &[(Freedom, f64)],
    correlation: &DMatrix<f64>,
    holds: impl Fn(&Freedom, &Freedom) -> bool,
) -> Vec<(Freedom, f64)> {
    let of = |i: usize| {
        let (freedom, error) = errors[i];
        let held: Vec<usize> = (0..errors.len())
            .filter(|&j| j != i && holds(&freedom, &errors[j].0))
            .collect();
        if held.is_empty() {
            return (freedom, error);
        }
        let to_held = DVector::from_fn(held.len(), |k, _| correlation[(i, held[k])]);
        let among_held = correlation.select_rows(&held).select_columns(&held);
        let told = among_held
            .cholesky()
            .map(|held| to_held.dot(&held.solve(&to_held)));
        (freedom, error * (1.0 - told.unwrap_or(0.0)).max(0.0).sqrt())
    };
    (0..errors.len()).map(of).collect()
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
    fn a_number_is_known_better_where_what_makes_up_for_it_stays() {
        let correlation = DMatrix::from_row_slice(3, 3, &[1.0, 0.8, 0.0, 0.8, 1.0, 0.0, 0.0, 0.0, 1.0]);
        let freedom = |part: usize| Freedom {
            part,
            run: None,
            parameter: Some(0),
            step: 1.0,
            quantum: None,
        };
        let errors = [(freedom(0), 5.0), (freedom(1), 1.0), (freedom(2), 1.0)];
        // Of its variance 1 - .8^2 is left.
        let known = errors_where(&errors, &correlation, |own, other| {
            own.part == 0 && other.part > 0
        });
        let known: Vec<f64> = known.into_iter().map(|(_, error)| error).collect();
        assert!((known[0] - 3.0).abs() < 1e-12);
        assert_eq!(known[1..], [1.0, 1.0]);
    }

    #[test]
    fn numbers_that_make_up_for_each_other_share_less_of_wide_ranges_alone() {
        let correlation = DMatrix::from_row_slice(2, 2, &[1.0, 0.8, 0.8, 1.0]);
        let volume = |ranges: f64| log_volume(&correlation, &DVector::from_element(2, ranges));
        // The square of .8 is .64: of their independent volume .6 is left.
        assert!((volume(1e9) - 0.6_f64.ln()).abs() < 1e-6);
        assert!(volume(1e-9).abs() < 1e-6);
        // 1 + r and their sum and difference: r + 1.8 and r + .2.
        assert!((volume(1.0) - 0.5 * (0.36 * 4.0 / (2.8 * 1.2_f64)).ln()).abs() < 1e-12);
        let independent = log_volume(&DMatrix::identity(3, 3), &DVector::from_element(3, 7.0));
        assert!(independent.abs() < 1e-12);
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
