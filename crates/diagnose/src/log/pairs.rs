//! Two effects at once: a joint search over the columns, because the effect that looks best alone need not be either.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use sim::{Error, Setting, World};

use super::catalogue::Variant;
use super::columns::columns_of;
use super::filter::Trace;
use super::screen::{Normal, TOGETHER, normal_of, solve};

/// Two variants with the settings that linear algebra gives them and the log-likelihood they gain.
#[derive(Debug, Clone)]
pub(crate) struct Pair {
    pub(crate) gain: f64,
    pub(crate) parts: [(usize, Setting); 2],
}

/// The best pairs among the given variants.
///
/// # Errors
/// A variant out of its range.
pub(crate) fn pairs(
    runs: &[(World<'_>, Trace)],
    variants: &[Variant],
    of: &[usize],
    most: usize,
) -> Result<Vec<Pair>, Error> {
    let (sum, ranges) = gram(runs, variants, of)?;
    let mut found: Vec<Pair> = Vec::new();
    for i in 0..of.len() {
        for j in 0..i {
            if variants[of[i]].spec == variants[of[j]].spec {
                continue;
            }
            let rows: Vec<usize> = ranges[i].clone().chain(ranges[j].clone()).collect();
            let left = DMatrix::from_fn(rows.len(), rows.len(), |a, b| sum.left[(rows[a], rows[b])]);
            let right = DVector::from_fn(rows.len(), |a, _| sum.right[rows[a]]);
            let solution = solve(&left, &right);
            let (mine, yours) = solution.multiples.as_slice().split_at(ranges[i].len());
            let setting = |k: usize, m: &[f64]| (of[k], super::leads::start(&variants[of[k]], m));
            found.push(Pair {
                gain: solution.gain,
                parts: [setting(i, mine), setting(j, yours)],
            });
        }
    }
    found.sort_by(|a, b| b.gain.total_cmp(&a.gain));
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

/// Normal equations of all columns of the variants together, and where each variant's columns stand.
fn gram(
    runs: &[(World<'_>, Trace)],
    variants: &[Variant],
    of: &[usize],
) -> Result<(Normal, Vec<std::ops::Range<usize>>), Error> {
    let settings: Vec<Vec<Setting>> = of.iter().map(|&i| variants[i].settings()).collect();
    let mut ranges = Vec::new();
    let mut count = 0;
    for own in &settings {
        ranges.push(count..count + own.len());
        count += own.len();
    }
    let flat: Vec<&Setting> = settings.iter().flatten().collect();
    let normals: Vec<Normal> = (runs.par_iter())
        .map(|(world, trace)| {
            let of_some = |some: &[&Setting]| columns_of(some.iter().copied(), world, trace);
            let columns: Vec<Vec<Vec<f32>>> = (flat.par_chunks(TOGETHER))
                .map(of_some)
                .collect::<Result<_, Error>>()?;
            Ok(normal_of(trace, &columns.concat()))
        })
        .collect::<Result<_, Error>>()?;
    let nothing = || normal_of(&Trace::default(), &vec![Vec::new(); count]);
    Ok((Normal::sum(normals.into_iter()).unwrap_or_else(nothing), ranges))
}
