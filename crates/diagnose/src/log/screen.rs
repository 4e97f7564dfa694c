//! Linear algebra on the columns: what each variant would explain.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use sim::{Error, Setting, World};

use super::catalogue::Variant;
use super::columns::columns_of;
use super::filter::{MEASURED, Trace};

/// Normal equations of a variant's columns against the innovations, of one run.
#[derive(Debug, Clone)]
pub(crate) struct Normal {
    /// C^T e and C^T C.
    pub(crate) right: DVector<f64>,
    pub(crate) left: DMatrix<f64>,
    /// The same for columns that grow with time: the cross term with the constant ones, and their own.
    pub(crate) right_time: DVector<f64>,
    pub(crate) cross_time: DMatrix<f64>,
    pub(crate) left_time: DMatrix<f64>,
}

impl Normal {
    /// The equations of several runs together; `None` of none.
    pub(crate) fn sum(normals: impl Iterator<Item = Self>) -> Option<Self> {
        normals.reduce(|a, b| Self {
            right: a.right + b.right,
            left: a.left + b.left,
            right_time: a.right_time + b.right_time,
            cross_time: a.cross_time + b.cross_time,
            left_time: a.left_time + b.left_time,
        })
    }
}

/// Variants whose columns are taken in one pass over a trace.
pub(crate) const TOGETHER: usize = 8;

/// The normal equations of every variant (outer) in every run (inner).
pub(crate) fn normals(runs: &[(World<'_>, Trace)], variants: &[Variant]) -> Result<Vec<Vec<Normal>>, Error> {
    let of_some = |some: &[Variant]| -> Result<Vec<Vec<Normal>>, Error> {
        let by_run = (runs.iter())
            .map(|run| normals_of_run(run, some))
            .collect::<Result<Vec<_>, _>>()?;
        let of_variant = |i: usize| by_run.iter().map(|normals| normals[i].clone()).collect();
        Ok((0..some.len()).map(of_variant).collect())
    };
    let parts: Vec<Vec<Vec<Normal>>> = (variants.par_chunks(TOGETHER))
        .map(of_some)
        .collect::<Result<_, _>>()?;
    Ok(parts.concat())
}

fn normals_of_run((world, trace): &(World<'_>, Trace), variants: &[Variant]) -> Result<Vec<Normal>, Error> {
    let settings: Vec<Vec<Setting>> = variants.iter().map(Variant::settings).collect();
    let mut found = columns_of(settings.iter().flatten(), world, trace)?.into_iter();
    let normal = |own: &Vec<Setting>| {
        let columns: Vec<Vec<f32>> = found.by_ref().take(own.len()).collect();
        normal_of(trace, &columns)
    };
    Ok(settings.iter().map(normal).collect())
}

/// Normal equations of columns.
pub(crate) fn normal_of(trace: &Trace, columns: &[Vec<f32>]) -> Normal {
    let k = columns.len();
    let mut sum = Normal {
        right: DVector::zeros(k),
        left: DMatrix::zeros(k, k),
        right_time: DVector::zeros(k),
        cross_time: DMatrix::zeros(k, k),
        left_time: DMatrix::zeros(k, k),
    };
    for (step, instant) in trace.instants.iter().enumerate() {
        let at = step * MEASURED..(step + 1) * MEASURED;
        let time_s = instant.time_s;
        for a in 0..k {
            let ca = &columns[a][at.clone()];
            // The trace holds what was seen less what was expected, the column the change of that difference.
            let right = -ca
                .iter()
                .zip(&instant.innovation)
                .map(|(&c, e)| f64::from(c) * e)
                .sum::<f64>();
            sum.right[a] += right;
            sum.right_time[a] += right * time_s;
            for b in 0..=a {
                let cb = &columns[b][at.clone()];
                let product = f64::from(ca.iter().zip(cb).map(|(x, y)| x * y).sum::<f32>());
                sum.left[(a, b)] += product;
                sum.cross_time[(a, b)] += product * time_s;
                sum.left_time[(a, b)] += product * time_s * time_s;
            }
        }
    }
    for sum in [&mut sum.left, &mut sum.cross_time, &mut sum.left_time] {
        sum.fill_upper_triangle_with_lower_triangle();
    }
    sum
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
