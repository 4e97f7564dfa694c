//! Linear algebra on the columns: what each variant would explain.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use sim::{Error, Setting, World};

use super::catalogue::Variant;
use super::columns::{ABREAST, each_beside, normals as normals_of_lots};
use super::filter::Trace;
use super::normal::{Normal, Products};

/// The normal equations of every variant (outer) in every run (inner).
pub(crate) fn normals(runs: &[(World<'_>, Trace)], variants: &[Variant]) -> Result<Vec<Vec<Normal>>, Error> {
    /// Lots of variants that one pass over a trace is made for.
    const LOTS: usize = 4;
    let of_some = |some: &[Variant]| -> Result<Vec<Vec<Normal>>, Error> {
        let by_run = (runs.iter())
            .map(|run| normals_of_run(run, some))
            .collect::<Result<Vec<_>, _>>()?;
        let of_variant = |i: usize| by_run.iter().map(|normals| normals[i].clone()).collect();
        Ok((0..some.len()).map(of_variant).collect())
    };
    let parts: Vec<Vec<Vec<Normal>>> = (variants.par_chunks(LOTS * ABREAST))
        .map(of_some)
        .collect::<Result<_, _>>()?;
    Ok(parts.concat())
}

fn normals_of_run((world, trace): &(World<'_>, Trace), variants: &[Variant]) -> Result<Vec<Normal>, Error> {
    // Columns of one variant are wanted with each other, those of several are not.
    let stands_alone = |variant: &Variant| variant.sizes.len() == 1;
    let lots: Vec<&[Variant]> = variants
        .chunk_by(|a, b| stands_alone(a) && stands_alone(b))
        .flat_map(|lot| lot.chunks(ABREAST))
        .collect();
    let lots: Vec<Vec<Vec<Setting>>> = (lots.iter())
        .map(|lot| lot.iter().map(Variant::settings).collect())
        .collect();
    let others = (lots.iter())
        .map(|lot| {
            let wanted = if lot.len() > 1 {
                Products::Squares
            } else {
                Products::All
            };
            Ok((each_beside(lot.iter().flatten().cloned(), world)?, wanted))
        })
        .collect::<Result<_, Error>>()?;
    let parts = |(normal, lot): (Normal, &Vec<Vec<Setting>>)| -> Vec<Normal> {
        ranges(lot).iter().map(|own| normal.part(own)).collect()
    };
    let normals = normals_of_lots(others, trace).into_iter();
    Ok(normals.zip(&lots).flat_map(parts).collect())
}

/// Where the columns of each variant stand among those of all, by the settings of each.
pub(super) fn ranges(settings: &[Vec<Setting>]) -> Vec<Range<usize>> {
    let mut end = 0;
    let range = |own: &Vec<Setting>| {
        let start = end;
        end += own.len();
        start..end
    };
    settings.iter().map(range).collect()
}

/// Multiples that fit best and the log-likelihood they gain.
#[derive(Debug, Clone)]
pub(crate) struct Solution {
    pub(crate) multiples: DVector<f64>,
    pub(crate) gain: f64,
}

/// The least-squares solution of normal equations.
pub(crate) fn solve(left: &DMatrix<f64>, right: &DVector<f64>) -> Solution {
    let mut damped = left.clone();
    for i in 0..damped.nrows() {
        damped[(i, i)] += 1e-9 * damped[(i, i)] + 1e-12;
    }
    let multiples = damped
        .cholesky()
        .map_or_else(|| DVector::zeros(right.len()), |factor| factor.solve(right));
    let gain = 0.5 * multiples.dot(right);
    Solution { multiples, gain }
}
