//! Which variants, in which pattern over runs and time, are worth a refinement.

use nalgebra::{DMatrix, DVector};
use sim::{Pattern, Setting, UNLISTED};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::catalogue::{Shape, Variant};
use super::evidence::Evidence;
use super::normal::Normal;
use super::screen::solve;

/// How an effect's values go over the runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum By {
    Constant,
    Time,
    Run,
}

/// A variant in a pattern with what linear algebra says that it gains.
#[derive(Debug, Clone)]
pub(crate) struct Lead {
    pub(crate) variant: usize,
    pub(crate) by: By,
    pub(crate) gain: f64,
    pub(crate) fitted: usize,
    /// Multiples of the columns: one list, or one for each run.
    pub(crate) multiples: Vec<DVector<f64>>,
    /// Squared signal, in standard errors, of each column at its step; none for sizes that have a pattern.
    pub(crate) information: DVector<f64>,
}

impl Lead {
    /// Gain less what chance and choice give to as many values (the Bayesian price of a value told to 1 in 80).
    pub(crate) fn score(&self) -> f64 {
        trusted(self.gain, self.fitted, self.by) - price(self.fitted, self.by)
    }

    /// Probability of as large a gain by chance.
    pub(crate) fn p(&self) -> f64 {
        tail(2.0 * self.gain, self.fitted)
    }

    /// Where a refinement of the constant pattern begins.
    pub(crate) fn start(&self, variant: &Variant) -> Setting {
        start(variant, self.multiples[0].as_slice())
    }

    /// Where a refinement in its own pattern begins.
    pub(crate) fn in_pattern(&self, variant: &Variant, evidence: &Evidence<'_>) -> Setting {
        in_pattern(variant, self.by, &self.multiples, evidence)
    }
}

/// Where a refinement of a variant in a pattern begins, which does not change in time yet: at multiples of its columns, one list, or
/// one for each run of the evidence.
pub(super) fn in_pattern(
    variant: &Variant,
    by: By,
    multiples: &[DVector<f64>],
    evidence: &Evidence<'_>,
) -> Setting {
    let values = |multiples: &DVector<f64>| variant.values_at(&multiples.as_slice()[..variant.sizes.len()]);
    let first = values(&multiples[0]);
    let pattern = match by {
        By::Constant => Pattern::Constant(first),
        By::Time => Pattern::ByTime {
            per_s: vec![0.0; first.len()],
            start: first,
        },
        By::Run => {
            let mut all = vec![first; evidence.measured_runs];
            for (run, multiples) in evidence.runs().into_iter().zip(multiples) {
                all[run] = values(multiples);
            }
            Pattern::ByRun(all)
        }
    };
    Setting {
        spec: variant.spec,
        pattern,
    }
}

/// Log-likelihood that a candidate must pay for its values and its pattern.
pub(crate) fn price(fitted: usize, by: By) -> f64 {
    2.2 * fitted as f64 + if by == By::Constant { 0.0 } else { 4.0 }
}

/// What counts of a gain: at very high signal no model is exact, and free values follow its faults.
pub(super) fn trusted(gain: f64, fitted: usize, by: By) -> f64 {
    const BY_VALUE: f64 = 0.002;
    const BY_PATTERN: f64 = 0.007;
    let pattern = if by == By::Constant { 0.0 } else { BY_PATTERN };
    let values = BY_VALUE * fitted.saturating_sub(1).min(3) as f64;
    (1.0 - pattern - values) * gain
}

/// Probability that a chi-squared variable exceeds a value.
pub(crate) fn tail(value: f64, freedom: usize) -> f64 {
    ChiSquared::new(freedom.max(1) as f64).map_or(1.0, |chi| chi.sf(value.max(0.0)))
}

/// Every variant in every pattern.
pub(crate) fn leads(evidence: &Evidence<'_>, variants: &[Variant], normals: &[Vec<Normal>]) -> Vec<Lead> {
    let runs = evidence.runs();
    (variants.iter().zip(normals).enumerate())
        .flat_map(|(i, (variant, normals))| {
            let mut leads = vec![constant(i, normals)];
            if may_change(variant) {
                leads.push(by_time(i, normals));
                if runs.len() > 1 {
                    leads.push(by_run(evidence, i, normals, &runs));
                }
            }
            leads
        })
        .collect()
}

/// Whether a variant may differ by run or change in time: not where its place or its size is one of a scan.
pub(super) fn may_change(variant: &Variant) -> bool {
    match variant.shape {
        Shape::Scan => variant.spec.name == "cone-of-view",
        Shape::Along => variant.spec.name == "directional-light",
        Shape::Linear | Shape::Polar => *variant.spec != UNLISTED,
    }
}

pub(crate) fn constant(variant: usize, normals: &[Normal]) -> Lead {
    let sum = Normal::sum(normals.iter().cloned());
    let information = (sum.as_ref()).map_or(DVector::zeros(0), |sum| sum.left.diagonal());
    let solution = sum.map(|sum| solve(&sum.left, &sum.right));
    let (multiples, gain) = solution.map_or((DVector::zeros(0), 0.0), |s| (s.multiples, s.gain));
    Lead {
        variant,
        by: By::Constant,
        gain,
        fitted: multiples.len(),
        multiples: vec![multiples],
        information,
    }
}

fn by_time(variant: usize, normals: &[Normal]) -> Lead {
    let Some(sum) = Normal::sum(normals.iter().cloned()) else {
        return constant(variant, normals);
    };
    let k = sum.right.len();
    let mut left = DMatrix::zeros(2 * k, 2 * k);
    left.view_mut((0, 0), (k, k)).copy_from(&sum.left);
    left.view_mut((0, k), (k, k)).copy_from(&sum.cross_time);
    left.view_mut((k, 0), (k, k)).copy_from(&sum.cross_time);
    left.view_mut((k, k), (k, k)).copy_from(&sum.left_time);
    let right = DVector::from_iterator(2 * k, sum.right.iter().chain(sum.right_time.iter()).copied());
    let solution = solve(&left, &right);
    Lead {
        variant,
        by: By::Time,
        gain: solution.gain,
        fitted: 2 * k,
        multiples: vec![solution.multiples],
        information: DVector::zeros(0),
    }
}

pub(crate) fn by_run(evidence: &Evidence<'_>, variant: usize, normals: &[Normal], runs: &[usize]) -> Lead {
    let of = |run: usize| {
        let mine = evidence
            .stretches
            .iter()
            .zip(normals)
            .filter(move |(s, _)| s.run == run);
        Normal::sum(mine.map(|(_, n)| n.clone())).map(|sum| solve(&sum.left, &sum.right))
    };
    let solutions: Vec<_> = runs.iter().filter_map(|&run| of(run)).collect();
    Lead {
        variant,
        by: By::Run,
        gain: solutions.iter().map(|s| s.gain).sum(),
        fitted: solutions.iter().map(|s| s.multiples.len()).sum(),
        multiples: solutions.into_iter().map(|s| s.multiples).collect(),
        information: DVector::zeros(0),
    }
}

/// The leads worth a refinement: the best of each effect, at most two of one, the best first.
pub(crate) fn shortlist(leads: &[Lead], variants: &[Variant], most: usize) -> Vec<Lead> {
    let mut sorted: Vec<&Lead> = leads.iter().collect();
    sorted.sort_by(|a, b| b.score().total_cmp(&a.score()));
    let mut list: Vec<Lead> = Vec::new();
    let name = |lead: &Lead| variants[lead.variant].spec.name;
    for lead in sorted {
        let same = list.iter().filter(|other| name(other) == name(lead)).count();
        let again = list
            .iter()
            .any(|other| other.variant == lead.variant && other.by <= lead.by);
        if same < 2 && !again && list.len() < most {
            list.push(lead.clone());
        }
    }
    list
}

/// The variants' multiples in a joint solution as a setting.
pub(crate) fn start(variant: &Variant, multiples: &[f64]) -> Setting {
    Setting::constant(variant.spec, variant.values_at(multiples))
}

/// Those of a constant size.
pub(super) fn of_constant_size(leads: &[Lead]) -> Vec<Lead> {
    (leads.iter().filter(|lead| lead.by == By::Constant))
        .cloned()
        .collect()
}

/// The best score.
pub(super) fn most(leads: &[Lead]) -> f64 {
    leads.iter().map(Lead::score).fold(0.0, f64::max)
}

/// Probability of the best lead by chance, given how many there are.
pub(super) fn least_p(leads: &[Lead]) -> f64 {
    let least = leads.iter().map(Lead::p).fold(1.0, f64::min);
    (least * leads.len() as f64).min(1.0)
}
