//! Laps at the gates, from files and from simulations.

use std::sync::Arc;

use anyhow::{Context, Result, bail};
use pdm::Cluster;
use rayon::prelude::*;
use sim::{Circuit, Drive, Start, Vec2};
use track::{Lap, LapTracker};

use crate::config::Config;
use crate::dataset::{DataSet, RunFile};
use crate::setup;
use crate::sightings::{lost, without_strays};
use crate::table::counted;

/// The laps of one run that are analysed, and what was set aside.
#[derive(Debug, Clone)]
pub(crate) struct SampledRun {
    /// `<data set>/<run>`, or where that does not tell it from others the path it was read from.
    pub(crate) name: String,
    /// The name of its data set.
    pub(crate) set: String,
    /// The name of the run alone.
    pub(crate) run: String,
    /// Closed laps, the first whole lap of the run not among them.
    pub(crate) laps: Vec<Lap>,
    /// Whole laps that missed a gate: number of the lap from 1 (the dropped one is 0) and the gate.
    pub(crate) set_aside: Vec<(usize, usize)>,
    /// Whole laps that were not seen for too long, in words.
    pub(crate) out_of_sight: Vec<String>,
    /// Laps asked for.
    pub(crate) wanted: usize,
    /// Whether the run ended because gate 0 was not crossed for too long.
    pub(crate) timed_out: bool,
    /// Sightings that are not used, in words.
    pub(crate) strays: Vec<String>,
}

impl SampledRun {
    /// The laps to keep among all whole laps of a run, in order: the first is dropped, those that miss a gate, or in which
    /// the robot is `lost` (by the lap's number, in words), are set aside, and of the others the first `wanted` kept.
    pub(crate) fn new(
        set: &str,
        run: &str,
        whole: &[Lap],
        wanted: usize,
        lost: impl Fn(usize) -> Option<String>,
    ) -> Self {
        let mut laps = Vec::new();
        let (mut set_aside, mut out_of_sight) = (Vec::new(), Vec::new());
        for (number, lap) in whole.iter().enumerate().skip(1) {
            if laps.len() == wanted {
                break;
            }
            let missed = lap.missed.first().map(|gate| format!(" misses gate {gate} and"));
            if let Some(words) = lost(number) {
                let missed = missed.unwrap_or_default();
                out_of_sight.push(format!("{words}: lap {number}{missed} is set aside"));
            } else if let Some(&gate) = lap.missed.first() {
                set_aside.push((number, gate));
            } else {
                laps.push(lap.clone());
            }
        }
        Self {
            name: format!("{set}/{run}"),
            set: set.to_owned(),
            run: run.to_owned(),
            laps,
            set_aside,
            out_of_sight,
            wanted,
            timed_out: false,
            strays: Vec::new(),
        }
    }

    /// Where a simulated run must start for its first kept lap to begin as long after the start as this one's.
    pub(crate) fn start(&self) -> Start {
        let lap = &self.laps[0];
        // The dropped lap took about as long.
        let until_s = |gate: usize| lap.end_s - lap.times_s[gate] + lap.duration_s();
        let off_s = |&gate: &usize| (until_s(gate) - lap.start_s).abs();
        // A run that starts on gate 0 may cross it at once or a lap later.
        let gate = (1..lap.times_s.len()).min_by(|a, b| off_s(a).total_cmp(&off_s(b)));
        let gate = gate.unwrap_or(0);
        Start {
            gate,
            time_s: lap.start_s - until_s(gate),
        }
    }

    /// Positions at the gates, laps x gates, m.
    pub(crate) fn offsets_m(&self) -> Vec<Vec<f64>> {
        self.laps.iter().map(|lap| lap.offsets_m.clone()).collect()
    }

    /// The laps as a cluster.
    ///
    /// # Errors
    /// No lap at all.
    pub(crate) fn cluster(&self) -> Result<Cluster> {
        Cluster::new(&self.name, &self.offsets_m()).with_context(|| format!("run {}", self.name))
    }

    /// Lap times, s.
    pub(crate) fn lap_times_s(&self) -> Vec<f64> {
        self.laps.iter().map(Lap::duration_s).collect()
    }

    /// The laps that are set aside, and why, in words.
    pub(crate) fn laps_set_aside(&self) -> impl Iterator<Item = String> {
        let misses = |(lap, gate): &(usize, usize)| {
            format!("{}: lap {lap} misses gate {gate} and is set aside", self.name)
        };
        (self.out_of_sight.iter().cloned()).chain(self.set_aside.iter().map(misses))
    }

    /// What a user must know of laps that are not there, if anything.
    pub(crate) fn remarks(&self) -> Vec<String> {
        let mut remarks = self.strays.clone();
        remarks.extend(self.laps_set_aside());
        if self.laps.len() < self.wanted {
            let ending = if self.timed_out {
                " (the run timed out)"
            } else {
                ""
            };
            remarks.push(format!(
                "{}: {} of {} laps{ending}",
                self.name,
                self.laps.len(),
                self.wanted
            ));
        }
        remarks
    }
}

/// A measured data set, sampled.
#[derive(Debug, Clone)]
pub(crate) struct Measured {
    pub(crate) set: DataSet,
    pub(crate) circuit: Arc<Circuit>,
    pub(crate) runs: Vec<SampledRun>,
}

impl Measured {
    /// The laps of a data set on a circuit that is at hand, driven as it declares over a model. Sightings where no robot can be are
    /// taken for none.
    ///
    /// # Errors
    /// A run without a whole lap after its first.
    pub(crate) fn on(mut set: DataSet, circuit: Arc<Circuit>, model: &Config) -> Result<Self> {
        let config = set.declared_config(model)?;
        let strays: Vec<Vec<String>> = set.runs.iter_mut().map(without_strays).collect();
        let sampled: Vec<Result<SampledRun>> = (set.runs.par_iter().zip(strays))
            .map(|(run, strays)| {
                let sampled = sample(&set, run, &circuit, &config)?;
                Ok(SampledRun { strays, ..sampled })
            })
            .collect();
        // Of several runs at fault the first is named, whichever thread came first.
        let runs = sampled.into_iter().collect::<Result<_>>()?;
        Ok(Self { set, circuit, runs })
    }

    /// Each run as a cluster.
    pub(crate) fn clusters(&self) -> Result<Vec<Cluster>> {
        self.runs.iter().map(SampledRun::cluster).collect()
    }

    /// When and where the robot was seen in a run, s and m.
    pub(crate) fn seen(&self, run: usize) -> impl Iterator<Item = (f64, Vec2)> {
        seen(&self.set.runs[run])
    }

    /// The observed positions of one kept lap, for drawing, m.
    pub(crate) fn path(&self, run: usize, lap: usize) -> Vec<[f64; 2]> {
        let lap = &self.runs[run].laps[lap];
        let rows = &self.set.runs[run].rows;
        let inside = |t: f64| t >= lap.start_s - 1e-9 && t <= lap.end_s + 1e-9;
        rows.since_start_s()
            .zip(&rows.position_m)
            .filter(|(t, _)| inside(*t))
            .filter_map(|(_, p)| *p)
            .collect()
    }
}

/// Times since the run began in s and positions in m where the robot was seen.
fn seen(run: &RunFile) -> impl Iterator<Item = (f64, Vec2)> {
    let rows = run.rows.since_start_s().zip(&run.rows.position_m);
    rows.filter_map(|(time_s, position)| position.map(|[x, y]| (time_s, Vec2::new(x, y))))
}

fn sample(set: &DataSet, run: &RunFile, circuit: &Circuit, config: &Config) -> Result<SampledRun> {
    let mut tracker = LapTracker::new(&circuit.gates, setup::way(config, &circuit.course));
    let whole: Vec<Lap> = seen(run)
        .filter_map(|(time_s, position)| tracker.push(time_s, position))
        .collect();
    let sampled = SampledRun::new(&set.name, &run.name, &whole, set.laps, lost(run, &whole));
    if sampled.laps.is_empty() {
        let path = run.path.display();
        if seen(run).next().is_none() {
            bail!("{path}: x_m and y_m are empty in every row: the camera did not see the robot at all");
        }
        if let Some(lap) = sampled.out_of_sight.first() {
            bail!("{lap}, and none is left: measure the run again, or take it out of `runs` in dataset.toml");
        }
        if let Some((lap, gate)) = sampled.set_aside.first() {
            bail!(
                "{path}: no lap crosses all gates: lap {lap} misses gate {gate}; is this the world it was driven in?"
            );
        }
        bail!(
            "{path}: {}, and the first is not analysed: at least two are needed, and four to trace; check the world, the \
             driving direction ({}; [declared] run.direction in dataset.toml) and the unit of x_m and y_m",
            counted(whole.len(), "whole lap"),
            config.run.direction.on(&circuit.course).name()
        );
    }
    Ok(sampled)
}

/// The sampled laps of a simulated run.
pub(crate) fn simulated(name: &str, run: usize, drive: &Drive, wanted: usize) -> SampledRun {
    // The simulator has dropped the first lap already; any lap stands in its place here.
    let whole: Vec<Lap> = drive
        .laps
        .first()
        .into_iter()
        .chain(&drive.laps)
        .cloned()
        .collect();
    let sampled = SampledRun::new(name, &crate::dataset::run_name(run), &whole, wanted, |_| None);
    SampledRun {
        timed_out: drive.timed_out,
        ..sampled
    }
}

/// Mean and standard deviation (divisor n - 1); NaN where there are too few for it.
pub(crate) fn mean_and_deviation(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let squares: f64 = values.iter().map(|v| (v - mean) * (v - mean)).sum();
    let deviation = match values {
        [] | [_] => f64::NAN,
        _ => (squares / (n - 1.0)).sqrt(),
    };
    (mean, deviation)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Laps of 50 s that pass 100 gates evenly, the first of them begun so long after the start.
    fn run(first_s: f64) -> SampledRun {
        let lap = |k: usize| {
            let start_s = first_s + 50.0 * k as f64;
            Lap {
                offsets_m: vec![0.0; 100],
                times_s: (0..100).map(|gate| start_s + 0.5 * f64::from(gate)).collect(),
                start_s,
                end_s: start_s + 50.0,
                missed: Vec::new(),
            }
        };
        let whole: Vec<Lap> = (0..4).map(lap).collect();
        SampledRun::new("set", "a", &whole, 3, |_| None)
    }

    #[test]
    fn one_value_has_no_deviation_and_none_has_no_mean() {
        let (mean, deviation) = mean_and_deviation(&[]);
        assert!(mean.is_nan() && deviation.is_nan(), "{mean} {deviation}");
        let (mean, deviation) = mean_and_deviation(&[3.0]);
        assert!(mean == 3.0 && deviation.is_nan(), "{mean} {deviation}");
        assert_eq!(mean_and_deviation(&[1.0, 3.0]), (2.0, 2.0_f64.sqrt()));
    }

    #[test]
    fn a_simulated_run_starts_where_the_measured_one_did() {
        // Gate 60 is 20 s before gate 0.
        let start = run(20.0).start();
        assert_eq!(start.gate, 60);
        assert!(start.time_s.abs() < 1e-9, "{start:?}");
        // Between gates: 0.1 s after gate 60.
        let start = run(19.9).start();
        assert_eq!(start.gate, 60);
        assert!((start.time_s + 0.1).abs() < 1e-9, "{start:?}");
    }

    #[test]
    fn a_run_that_had_driven_before_it_was_seen_has_a_clock_ahead() {
        let start = run(120.0).start();
        assert_eq!(start.gate, 1);
        assert!((start.time_s - 70.5).abs() < 1e-9, "{start:?}");
    }
}
