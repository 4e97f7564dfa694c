//! Whether laps ripple along the track as they do with a wheel that is out of round.
//!
//! What turns with a wheel has another phase in every lap. It leaves nothing in the mean lap, and little in how laps scatter all
//! in all, but lines in the spectrum of what is left, where a wheel's turns per lap are.

use std::f64::consts::TAU;

use nalgebra::DVector;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use sim::Setting;
use statrs::statistics::{Data, OrderStatistics};

use super::atlas::{Atlas, Extent, Simulate};
use super::hypothesis::Hypothesis;
use super::observed::ObservedRun;
use super::part::Part;
use super::probe::Probe;
use super::summary::{BLOCKS, deviations, lap_vector, of_each};
use super::tests_of_fit::Quadratic;
use super::trial::Trial;

/// Data sets simulated of what is expected where effects are known.
const SETS: u64 = 24;

/// Data sets simulated with each wheel out of round beside it, and the share by which it then is.
const WHEEL_SETS: u64 = 8;
const WHEEL_SHARE: f64 = 0.12;

/// Shares that are compared with the data: from this on, each larger by a factor.
const SMALLEST_SHARE: f64 = 0.01;
const FACTOR: f64 = 1.1;
const SHARES: i32 = 40;

/// Cycles per lap from which on lines are looked for: longer waves are what a controller makes of any disturbance.
const LEAST_CYCLES: usize = 10;

/// Frequencies to either side of one of which the median is the ground that a line stands out from.
const GROUND: usize = 8;

/// The wheel that laps ripple with as if it were out of round.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Ripple {
    /// Its probe.
    probe: usize,
    /// How much it is out of round: a share of its speed.
    share: f64,
    /// How many standard deviations laps have of its lines.
    sigmas: f64,
    /// Number of probes among which it is the best.
    tried: usize,
}

impl Ripple {
    /// Probability that chance makes as much of any of the wheels' lines (Bonferroni).
    pub(super) fn p(&self) -> f64 {
        let one_sided = if self.sigmas > 0.0 {
            0.5 * Quadratic::new(self.sigmas.powi(2), 1).p
        } else {
            1.0
        };
        (self.tried as f64 * one_sided).min(1.0)
    }

    /// The wheel as an effect.
    pub(super) fn hypothesis(&self, atlas: &Atlas) -> Hypothesis {
        wheel(atlas, self.probe, self.share)
    }
}

/// A wheel out of round by a share of its speed.
fn wheel(atlas: &Atlas, probe: usize, share: f64) -> Hypothesis {
    let of_wheel = &atlas.probes[probe];
    Hypothesis::of(Part::group(of_wheel, probe, &[share / of_wheel.free[0].1]))
}

/// The probes that turn with a wheel.
fn wheels(probes: &[Probe]) -> impl Iterator<Item = usize> {
    (0..probes.len()).filter(|&probe| probes[probe].turns())
}

/// Number of data sets that are simulated with wheels out of round.
pub(super) fn wheel_sets(probes: &[Probe]) -> u64 {
    WHEEL_SETS * wheels(probes).count() as u64
}

/// Power of how the laps of a data set deviate sideways from the means of their run's quarters, mm^2, from [`LEAST_CYCLES`] cycles per lap
/// to one in two gates.
pub(super) type Power = DVector<f64>;

/// How laps ripple as they are expected to, data set by data set, and as they do with each wheel out of round.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct Ripples {
    round: Vec<Power>,
    /// For each probe that turns with a wheel; `None` where the robot crashes.
    out_of_round: Vec<Option<Vec<Power>>>,
}

impl Ripples {
    /// Those of several recordings together.
    pub(super) fn join(parts: &[&Self]) -> Self {
        let sum = |parts: &[&Vec<Power>]| -> Vec<Power> {
            let of_set = |set: usize| parts.iter().map(|part| &part[set]).sum();
            (0..parts[0].len()).map(of_set).collect()
        };
        let round: Vec<&Vec<Power>> = parts.iter().map(|part| &part.round).collect();
        let out_of_round = |wheel: usize| {
            let of_wheel = parts.iter().map(|part| part.out_of_round[wheel].as_ref());
            Some(sum(&of_wheel.collect::<Option<Vec<_>>>()?))
        };
        Self {
            round: sum(&round),
            out_of_round: (0..parts[0].out_of_round.len()).map(out_of_round).collect(),
        }
    }
}

impl Atlas {
    /// How laps ripple beside some effects, of data sets in which wheels are round and of such with each wheel out of round.
    pub(super) fn ripples(&self, simulate: &Simulate<'_>, others: &Hypothesis, round: Vec<Power>) -> Ripples {
        let out_of_round = |probe: usize| {
            let with = others.with(&wheel(self, probe, WHEEL_SHARE));
            powers(simulate, &with.settings(self), WHEEL_SETS)
        };
        Ripples {
            round,
            out_of_round: wheels(&self.probes).map(out_of_round).collect(),
        }
    }
}

impl Trial<'_> {
    /// The wheel whose lines measured laps have most of, beside what some effects make of them; `None` where the robot crashes.
    pub(super) fn ripple(&self, runs: &[ObservedRun], others: &Hypothesis) -> Option<Ripple> {
        if others.parts.is_empty() {
            return self.ripple_beyond(runs, &self.atlas.ripples);
        }
        self.spend(SETS + wheel_sets(&self.atlas.probes), Extent::Whole);
        let round = powers(self.simulate, &others.settings(self.atlas), SETS)?;
        self.ripple_beyond(runs, &self.atlas.ripples(self.simulate, others, round))
    }

    /// The same beyond how laps are expected to ripple.
    fn ripple_beyond(&self, runs: &[ObservedRun], ripples: &Ripples) -> Option<Ripple> {
        let expected: Vec<DVector<f64>> = ripples.round.iter().map(logarithms).collect();
        if expected.is_empty() {
            return None;
        }
        let mean = mean(&expected);
        let missing = lines(&(logarithms(&power(runs)) - &mean));
        let scatters: Vec<DVector<f64>> = (expected.iter())
            .map(|spectrum| lines(&(spectrum - &mean)))
            .collect();
        let freedom = scatters.len() as f64 - 1.0;
        // The mean of the simulated spectra has an error too.
        let variance_of = |squares: f64| squares / freedom * (1.0 + 1.0 / scatters.len() as f64);
        let of_each = variance_of(scatters.iter().map(DVector::norm_squared).sum()) / missing.len() as f64;
        let ripple = |(probe, with): (usize, &Option<Vec<Power>>)| {
            let with: Vec<DVector<f64>> = with.as_ref()?.iter().map(logarithms).collect();
            let more = self::mean(&with) - &mean;
            let direction = lines(&more).try_normalize(f64::MIN_POSITIVE)?;
            // Lines that lie side by side scatter together.
            let along = scatters
                .iter()
                .map(|scatter| scatter.dot(&direction).powi(2))
                .sum();
            let sigma = of_each.max(variance_of(along)).sqrt();
            let power = more.map(|ln| ln.exp_m1().max(0.0) / WHEEL_SHARE.powi(2));
            let misfit = |share: f64| {
                (lines(&power.map(|power| (share.powi(2) * power).ln_1p())) - &missing).norm_squared()
            };
            let share = (0..SHARES)
                .map(|k| SMALLEST_SHARE * FACTOR.powi(k))
                .min_by(|a, b| misfit(*a).total_cmp(&misfit(*b)))?;
            Some(Ripple {
                probe,
                share,
                sigmas: missing.dot(&direction) / sigma,
                tried: ripples.out_of_round.len(),
            })
        };
        (wheels(&self.atlas.probes).zip(&ripples.out_of_round))
            .filter_map(ripple)
            .max_by(|a, b| a.sigmas.total_cmp(&b.sigmas))
    }
}

/// Of data sets simulated with these settings; `None` where the robot crashes.
fn powers(simulate: &Simulate<'_>, settings: &[Setting], sets: u64) -> Option<Vec<Power>> {
    (0..sets)
        .into_par_iter()
        .map(|set| simulate(settings, set, Extent::Whole).map(|runs| power(&runs)))
        .collect()
}

fn mean(spectra: &[DVector<f64>]) -> DVector<f64> {
    spectra.iter().sum::<DVector<f64>>() / spectra.len() as f64
}

/// Of a data set; see [`Power`].
pub(super) fn power(runs: &[ObservedRun]) -> Power {
    let deviations: Vec<DVector<f64>> = deviations(&of_each(runs, lap_vector)).collect();
    let gates = deviations.first().map_or(0, |lap| lap.len() - BLOCKS);
    let at = |cycles: usize| -> f64 {
        let turn = TAU * cycles as f64 / gates as f64;
        let cos = DVector::from_fn(gates, |gate, _| (turn * gate as f64).cos());
        let sin = DVector::from_fn(gates, |gate, _| (turn * gate as f64).sin());
        let of_lap = |lap: &DVector<f64>| {
            let positions_mm = lap.rows(0, gates);
            positions_mm.dot(&cos).powi(2) + positions_mm.dot(&sin).powi(2)
        };
        deviations.iter().map(of_lap).sum()
    };
    Power::from_vec((LEAST_CYCLES..=gates / 2).map(at).collect())
}

fn logarithms(power: &Power) -> DVector<f64> {
    power.map(|power| power.max(f64::MIN_POSITIVE).ln())
}

/// How much each of a spectrum's numbers is above the median of those about it.
fn lines(spectrum: &DVector<f64>) -> DVector<f64> {
    let values = spectrum.as_slice();
    let above = |at: usize| {
        let about = at.saturating_sub(GROUND)..(at + GROUND + 1).min(values.len());
        let others: Vec<f64> = about.filter(|&k| k != at).map(|k| values[k]).collect();
        if others.is_empty() {
            return 0.0;
        }
        values[at] - Data::new(others).median()
    };
    DVector::from_iterator(values.len(), (0..values.len()).map(above))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Laps of 100 gates, each a wave with a phase of its own.
    fn waves(cycles: f64, amplitude_m: f64) -> Vec<ObservedRun> {
        let lap = |number: usize| track::Lap {
            start_s: 70.0 * number as f64,
            end_s: 70.0 * (number + 1) as f64,
            times_s: (0..100)
                .map(|gate| 70.0 * number as f64 + 0.7 * f64::from(gate))
                .collect(),
            offsets_m: (0..100)
                .map(|gate| {
                    let phase = TAU * (0.25 * number as f64 + cycles * f64::from(gate) / 100.0);
                    amplitude_m * phase.sin()
                })
                .collect(),
            missed: Vec::new(),
        };
        vec![ObservedRun::exact((0..16).map(lap))]
    }

    #[test]
    fn the_power_of_a_wave_is_at_its_frequency() {
        let spectrum = logarithms(&power(&waves(24.0, 0.002)));
        assert_eq!(spectrum.len(), 41);
        // Four laps a quarter of a turn apart have a mean of zero; each has (amplitude x gates / 2)^2.
        let expected = (16.0 * 100.0_f64.powi(2)).ln();
        assert!(
            (spectrum[24 - LEAST_CYCLES] - expected).abs() < 1e-9,
            "{spectrum}"
        );
        assert!(spectrum[30 - LEAST_CYCLES] < expected - 20.0);
    }

    #[test]
    fn lines_stand_out_from_a_slope() {
        let mut spectrum = DVector::from_fn(41, |k, _| 5.0 - 0.1 * k as f64);
        spectrum[20] += 2.0;
        let lines = lines(&spectrum);
        assert!((lines[20] - 2.0).abs() < 1e-12);
        assert!((9..32).filter(|&k| k != 20).all(|k| lines[k].abs() < 0.151));
    }
}
