//! Two effects at once: a joint search over the columns, because the effect that looks best alone need not be either.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use sim::{Error, Setting, World};

use super::catalogue::Variant;
use super::columns::{each_beside, normal};
use super::evidence::Evidence;
use super::filter::Trace;
use super::leads::{By, in_pattern, may_change, price, trusted};
use super::normal::Normal;
use super::screen::{ranges, solve};

/// Two variants with the settings that linear algebra gives them and the log-likelihood they gain.
#[derive(Debug, Clone)]
pub(crate) struct Pair {
    pub(crate) gain: f64,
    score: f64,
    pub(crate) parts: [(usize, Setting); 2],
}

/// The best pairs among the given variants, of which one may go by run or by time. `runs` are the traces of the evidence.
///
/// # Errors
/// A variant out of its range.
pub(crate) fn pairs(
    evidence: &Evidence<'_>,
    runs: &[(World<'_>, Trace)],
    variants: &[Variant],
    of: &[usize],
    most: usize,
) -> Result<Vec<Pair>, Error> {
    let gram = Gram::new(evidence, runs, variants, of)?;
    let both = (0..of.len()).flat_map(|i| (0..of.len()).map(move |j| (i, j)));
    let mut found: Vec<Pair> = both
        .filter(|&(i, j)| variants[of[i]].spec != variants[of[j]].spec)
        .flat_map(|(i, j)| {
            let patterns: &[By] = match (may_change(&variants[of[i]]), i < j) {
                (true, true) => &[By::Constant, By::Time, By::Run],
                (true, false) => &[By::Time, By::Run],
                (false, true) => &[By::Constant],
                (false, false) => &[],
            };
            patterns.iter().map(move |&by| (i, j, by))
        })
        .map(|(i, j, by)| {
            let (gain, own, other) = gram.solve(i, j, by);
            let fitted = own.iter().map(DVector::len).sum::<usize>() + other.len();
            let part = |k: usize, by: By, multiples: &[DVector<f64>]| {
                (of[k], in_pattern(&variants[of[k]], by, multiples, evidence))
            };
            Pair {
                gain,
                score: trusted(gain, fitted, by) - price(fitted, by),
                parts: [part(i, by, &own), part(j, By::Constant, &[other])],
            }
        })
        .collect();
    found.sort_by(|a, b| b.score.total_cmp(&a.score));
    Ok(diverse(found, variants, most))
}

/// The best pairs of different names.
fn diverse(sorted: Vec<Pair>, variants: &[Variant], most: usize) -> Vec<Pair> {
    let mut kept: Vec<Pair> = Vec::new();
    let names = |pair: &Pair| {
        let mut names = pair.parts.each_ref().map(|(i, _)| variants[*i].spec.name);
        names.sort_unstable();
        names
    };
    for pair in sorted {
        if kept.len() < most && !kept.iter().any(|other| names(other) == names(&pair)) {
            kept.push(pair);
        }
    }
    kept
}

/// Normal equations of all columns of several variants together.
struct Gram {
    /// Of each run that gave evidence.
    runs: Vec<Normal>,
    all: Normal,
    /// Where each variant's columns stand.
    ranges: Vec<Range<usize>>,
}

impl Gram {
    fn new(
        evidence: &Evidence<'_>,
        traces: &[(World<'_>, Trace)],
        variants: &[Variant],
        of: &[usize],
    ) -> Result<Self, Error> {
        let settings: Vec<Vec<Setting>> = of.iter().map(|&i| variants[i].settings()).collect();
        let ranges = ranges(&settings);
        let count = ranges.last().map_or(0, |last| last.end);
        let normals: Vec<Normal> = (traces.par_iter())
            .map(|(world, trace)| {
                let others = each_beside(settings.iter().flatten().cloned(), world)?;
                Ok(normal(others, trace))
            })
            .collect::<Result<_, Error>>()?;
        let nothing = || Normal::zeros(count);
        let of_run = |run: usize| {
            let own = (evidence.stretches.iter().zip(&normals)).filter(|(stretch, _)| stretch.run == run);
            Normal::sum(own.map(|(_, normal)| normal.clone())).unwrap_or_else(nothing)
        };
        let runs: Vec<Normal> = evidence.runs().into_iter().map(of_run).collect();
        Ok(Self {
            all: Normal::sum(runs.iter().cloned()).unwrap_or_else(nothing),
            runs,
            ranges,
        })
    }

    /// What two variants gain together, the first in a pattern, and their multiples: of the first one list, or one for each run.
    fn solve(&self, i: usize, j: usize, by: By) -> (f64, Vec<DVector<f64>>, DVector<f64>) {
        let (own, other) = (self.ranges[i].clone(), self.ranges[j].clone());
        let count = own.len();
        // The columns of the first, part by part, each a number of rows of these equations: what they hold of `all` or of a run.
        let parts: Vec<Part<'_>> = match by {
            By::Constant => vec![Part::of(&self.all)],
            By::Time => vec![Part::of(&self.all), Part::growing(&self.all)],
            By::Run => self.runs.iter().map(Part::of).collect(),
        };
        let size = parts.len() * count;
        let mut left = DMatrix::zeros(size + other.len(), size + other.len());
        let mut right = DVector::zeros(size + other.len());
        let block = |of: &DMatrix<f64>, rows: &Range<usize>, columns: &Range<usize>| {
            of.view((rows.start, columns.start), (rows.len(), columns.len()))
                .into_owned()
        };
        for (nth, part) in parts.iter().enumerate() {
            let at = nth * count;
            left.view_mut((at, at), (count, count))
                .copy_from(&block(part.own, &own, &own));
            let beside = block(part.with_constant, &own, &other);
            left.view_mut((at, size), (count, other.len())).copy_from(&beside);
            left.view_mut((size, at), (other.len(), count))
                .copy_from(&beside.transpose());
            right
                .rows_mut(at, count)
                .copy_from(&part.right.rows(own.start, count));
        }
        if by == By::Time {
            let cross = block(&self.all.cross_time, &own, &own);
            left.view_mut((0, count), (count, count)).copy_from(&cross);
            left.view_mut((count, 0), (count, count)).copy_from(&cross);
        }
        left.view_mut((size, size), (other.len(), other.len()))
            .copy_from(&block(&self.all.left, &other, &other));
        right
            .rows_mut(size, other.len())
            .copy_from(&self.all.right.rows(other.start, other.len()));
        let solution = solve(&left, &right);
        let multiples = |from: usize, count: usize| solution.multiples.rows(from, count).into_owned();
        let first = if by == By::Run {
            (0..parts.len())
                .map(|nth| multiples(nth * count, count))
                .collect()
        } else {
            vec![multiples(0, size)]
        };
        (solution.gain, first, multiples(size, other.len()))
    }
}

/// Columns of the first of two variants: their normal equations with themselves and with columns that are constant.
struct Part<'n> {
    own: &'n DMatrix<f64>,
    with_constant: &'n DMatrix<f64>,
    right: &'n DVector<f64>,
}

impl<'n> Part<'n> {
    fn of(normal: &'n Normal) -> Self {
        Self {
            own: &normal.left,
            with_constant: &normal.left,
            right: &normal.right,
        }
    }

    /// Those that grow with time.
    fn growing(normal: &'n Normal) -> Self {
        Self {
            own: &normal.left_time,
            with_constant: &normal.cross_time,
            right: &normal.right_time,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEPS: usize = 12;

    /// Three columns of two runs, what they have to explain and when, all of no pattern.
    fn columns(run: usize) -> (DMatrix<f64>, DVector<f64>, DVector<f64>) {
        let wave = |step: usize, by: f64| (by * (step + 7 * run) as f64).sin();
        let columns = DMatrix::from_fn(STEPS, 3, |step, k| wave(step, [0.7, 1.9, 2.6][k]));
        let missed = DVector::from_fn(STEPS, |step, _| wave(step, 0.9) + 0.1 * wave(step, 3.7));
        let times_s = DVector::from_fn(STEPS, |step, _| 0.5 * step as f64 + 3.0 * run as f64);
        (columns, missed, times_s)
    }

    fn normal(run: usize) -> Normal {
        let (columns, missed, times_s) = columns(run);
        let times = DMatrix::from_diagonal(&times_s);
        Normal {
            right: columns.transpose() * &missed,
            left: columns.transpose() * &columns,
            right_time: columns.transpose() * &times * &missed,
            cross_time: columns.transpose() * &times * &columns,
            left_time: columns.transpose() * &times * &times * &columns,
        }
    }

    /// The first variant has the first two columns, the second the third.
    fn gram() -> Gram {
        Gram {
            runs: vec![normal(0), normal(1)],
            all: Normal::sum([normal(0), normal(1)].into_iter()).unwrap(),
            ranges: vec![0..2, 2..3],
        }
    }

    /// Least squares over rows: half of what the best multiples of these columns take off the sum of squares, and these multiples.
    fn by_rows(design: &DMatrix<f64>) -> (f64, DVector<f64>) {
        let missed = DVector::from_iterator(
            2 * STEPS,
            (0..2).flat_map(|run| columns(run).1.data.as_vec().clone()),
        );
        let multiples = design.clone().svd(true, true).solve(&missed, 1e-12).unwrap();
        let left = &missed - design * &multiples;
        ((missed.norm_squared() - left.norm_squared()) / 2.0, multiples)
    }

    /// Rows of both runs, each with the columns of `of` for a run and a step.
    fn design(width: usize, of: impl Fn(usize, usize) -> Vec<f64>) -> DMatrix<f64> {
        let rows = (0..2).flat_map(|run| (0..STEPS).map(move |step| (run, step)));
        let numbers: Vec<f64> = rows.flat_map(|(run, step)| of(run, step)).collect();
        DMatrix::from_row_slice(2 * STEPS, width, &numbers)
    }

    fn are_the_same(found: &(f64, Vec<DVector<f64>>, DVector<f64>), expected: &(f64, DVector<f64>)) {
        assert!((found.0 - expected.0).abs() < 1e-6, "{found:?}, {expected:?}");
        let all = found.1.iter().chain([&found.2]).flat_map(|part| part.iter());
        for (found, expected) in all.zip(expected.1.iter()) {
            assert!((found - expected).abs() < 1e-6, "{found} {expected}");
        }
    }

    #[test]
    fn two_effects_at_once_are_least_squares_over_the_rows() {
        let row = |run: usize, step: usize| columns(run).0.row(step).iter().copied().collect();
        are_the_same(&gram().solve(0, 1, By::Constant), &by_rows(&design(3, row)));
    }

    #[test]
    fn one_that_changes_in_time_has_columns_that_grow() {
        let row = |run: usize, step: usize| {
            let (columns, _, times_s) = columns(run);
            let (a, b, c) = (columns[(step, 0)], columns[(step, 1)], columns[(step, 2)]);
            vec![a, b, times_s[step] * a, times_s[step] * b, c]
        };
        are_the_same(&gram().solve(0, 1, By::Time), &by_rows(&design(5, row)));
    }

    #[test]
    fn one_that_goes_by_run_has_columns_of_each_run() {
        let row = |run: usize, step: usize| {
            let columns = columns(run).0;
            let mut row = vec![0.0; 5];
            (row[2 * run], row[2 * run + 1]) = (columns[(step, 0)], columns[(step, 1)]);
            row[4] = columns[(step, 2)];
            row
        };
        are_the_same(&gram().solve(0, 1, By::Run), &by_rows(&design(5, row)));
    }
}
