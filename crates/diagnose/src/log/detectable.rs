//! How large an effect must be to show in robots' logs.

use sim::Param;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::catalogue::{Shape, Variant};
use super::leads::{By, Lead};
use crate::candidate::label;
use crate::detectable::{Detectable, QUANTILE_95};

/// The smallest sizes of all effects with a column that raise an alarm of this probability in 95 of 100 cases, by how sharply the
/// declared model's innovations tell them.
pub(crate) fn detectable(leads: &[Lead], variants: &[Variant], alarm: f64) -> Vec<Detectable> {
    let each = alarm / leads.len() as f64;
    let needed = |lead: &Lead| {
        let chi = ChiSquared::new(lead.fitted.max(1) as f64).expect("a positive freedom");
        chi.inverse_cdf(1.0 - each).sqrt() + QUANTILE_95
    };
    let constant: Vec<(&Lead, &Variant)> = (leads.iter())
        .filter(|lead| lead.by == By::Constant)
        .map(|lead| (lead, &variants[lead.variant]))
        .collect();
    let mut all = Vec::new();
    for (i, (lead, variant)) in constant.iter().enumerate() {
        if variant.shape == Shape::Scan {
            let is_first = constant[..i].iter().all(|(_, other)| other.spec != variant.spec);
            if is_first {
                let of_effect = constant.iter().filter(|(_, other)| other.spec == variant.spec);
                let signals = of_effect.map(|(lead, other)| (other.values[0], lead.information[0].sqrt()));
                all.push(scanned(variant, signals.collect(), needed(lead)));
            }
            continue;
        }
        for (column, setting) in variant.settings().iter().enumerate() {
            let parameter = match variant.shape {
                Shape::Polar => variant.sizes[0],
                _ => variant.sizes[column],
            };
            let param = &variant.spec.params[parameter];
            let neutral = param.neutral.unwrap_or(0.0);
            let size = needed(lead) * variant.steps[column] / lead.information[column].sqrt();
            all.push(Detectable {
                label: label(setting),
                below: Some(neutral - size).filter(|below| *below >= param.low),
                above: Some(neutral + size).filter(|above| *above <= param.high),
                ..unseen(variant, param)
            });
        }
    }
    all
}

/// An effect by its signals, in standard errors, at each of some sizes: the first of them that is seen, as signals are no
/// straight lines in between.
fn scanned(variant: &Variant, signals: Vec<(f64, f64)>, needed: f64) -> Detectable {
    let param = &variant.spec.params[0];
    // A limit does nothing where it is large.
    let neutral = param.neutral.unwrap_or(f64::INFINITY);
    let seen = signals.into_iter().filter(|(_, signal)| *signal >= needed);
    let (below, above): (Vec<f64>, Vec<f64>) = seen.map(|(size, _)| size).partition(|size| *size < neutral);
    Detectable {
        below: below.into_iter().reduce(f64::max),
        above: above.into_iter().reduce(f64::min),
        ..unseen(variant, param)
    }
}

fn unseen(variant: &Variant, param: &Param) -> Detectable {
    Detectable {
        spec: variant.spec,
        label: variant.spec.name.to_owned(),
        parameter: param.name,
        unit: param.unit,
        below: None,
        above: None,
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::DVector;
    use sim::find;

    use super::*;

    /// A lead of a variant that is told by so many standard errors for each step.
    fn lead(variant: usize, signals: &[f64]) -> Lead {
        Lead {
            variant,
            by: By::Constant,
            gain: 0.0,
            fitted: signals.len(),
            multiples: Vec::new(),
            information: DVector::from_iterator(signals.len(), signals.iter().map(|s| s * s)),
        }
    }

    #[test]
    fn sizes_stand_as_far_out_as_the_alarm_needs() {
        let variants = super::super::catalogue::variants([3.0, 2.0], &[0.01, 0.02]);
        let number = |name: &str| variants.iter().position(|v| v.spec.name == name).unwrap();
        let gain = number("reading-gain");
        let leads = [lead(gain, &[2.0])];
        // Two-sided alarm in a hundredth of all cases: 2.576 standard errors, and 1.645 more.
        let found = detectable(&leads, &variants, 0.01);
        let step = variants[gain].steps[0];
        let size = (2.5758 + 1.6449) * step / 2.0;
        assert!((found[0].above.unwrap() - 1.0 - size).abs() < 1e-5, "{found:?}");
        assert!((1.0 - found[0].below.unwrap() - size).abs() < 1e-5, "{found:?}");
    }

    #[test]
    fn a_limit_is_seen_below_and_a_band_above() {
        let spec = |name: &str| find(name).unwrap();
        let variants = super::super::catalogue::variants([3.0, 2.0], &[0.01, 0.02]);
        let of = |name: &str| -> Vec<Lead> {
            (variants.iter().enumerate())
                .filter(|(_, variant)| variant.spec == spec(name))
                .map(|(i, variant)| {
                    let size = variant.values[0];
                    lead(
                        i,
                        &[if name == "dead-band" {
                            1e3 * size
                        } else {
                            1.0 / size
                        }],
                    )
                })
                .collect()
        };
        let leads = [of("acceleration-limit"), of("dead-band")].concat();
        let found = detectable(&leads, &variants, 0.01);
        let [limit, band] = found.as_slice() else {
            panic!("{found:?}");
        };
        assert_eq!((limit.below, limit.above), (Some(0.15), None), "{limit:?}");
        assert_eq!((band.below, band.above), (None, Some(0.01)), "{band:?}");
    }
}
