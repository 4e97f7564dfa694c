//! How far measured laps are from a model's, as the error before and after effects are added is stated: by mean laps.

use track::Lap;

use crate::Error;

/// Laps that a model drove, run by run, with their mean: one lateral position at each gate, m.
#[derive(Debug, Clone)]
pub struct MeanLaps {
    mean_m: Vec<f64>,
    /// Mean lap time, s.
    lap_s: f64,
    /// Runs x laps x gates.
    runs_m: Vec<Vec<Vec<f64>>>,
    /// Runs x laps.
    runs_s: Vec<Vec<f64>>,
}

impl MeanLaps {
    /// The laps of some runs; laps that missed a gate do not count, nor runs without others.
    ///
    /// # Errors
    /// [`Error::NoLaps`] where fewer than two runs count: what chance does cannot be told.
    pub fn new(runs: &[Vec<Lap>]) -> Result<Self, Error> {
        let whole: Vec<Vec<&Lap>> = (runs.iter())
            .map(|laps| laps.iter().filter(|lap| lap.missed.is_empty()).collect())
            .filter(|laps: &Vec<&Lap>| !laps.is_empty())
            .collect();
        let mean_m = mean_lap(whole.iter().flatten().map(|lap| &lap.offsets_m)).filter(|_| whole.len() > 1);
        let mean_m = mean_m.ok_or(Error::NoLaps {
            completing: whole.len(),
            runs: runs.len(),
        })?;
        let lap_times_s = |laps: &Vec<&Lap>| laps.iter().map(|lap| lap.duration_s()).collect();
        let runs_s: Vec<Vec<f64>> = whole.iter().map(lap_times_s).collect();
        let offsets_m = |laps: &Vec<&Lap>| laps.iter().map(|lap| lap.offsets_m.clone()).collect();
        Ok(Self {
            mean_m,
            lap_s: mean(runs_s.iter().flatten()),
            runs_m: whole.iter().map(offsets_m).collect(),
            runs_s,
        })
    }

    /// Mean lap time, s.
    pub fn lap_s(&self) -> f64 {
        self.lap_s
    }

    /// Standard deviation of the mean lap time of a run of so many laps that this very model drove, s.
    pub fn lap_chance_s(&self, laps: usize) -> f64 {
        let mean_of = |run: &Vec<f64>| mean(run.iter().take(laps));
        let means: Vec<f64> = self.runs_s.iter().map(mean_of).collect();
        let middle = mean(&means);
        let squares: f64 = means.iter().map(|run| (run - middle).powi(2)).sum();
        (squares / (means.len() as f64 - 1.0)).sqrt()
    }

    /// The mean of all laps, gate by gate, m.
    pub fn mean_m(&self) -> &[f64] {
        &self.mean_m
    }

    /// Every lap, gate by gate, m.
    pub fn laps_m(&self) -> impl Iterator<Item = &Vec<f64>> {
        self.runs_m.iter().flatten()
    }

    /// The root mean square over the gates of the difference to the mean of some measured laps, m; NaN of none.
    pub fn distance_m<'a>(&self, laps_m: impl IntoIterator<Item = &'a Vec<f64>>) -> f64 {
        mean_lap(laps_m).map_or(f64::NAN, |mean_m| rms(&self.mean_m, &mean_m))
    }

    /// What [`MeanLaps::distance_m`] is on average for a run of so many laps that this very model drove, m.
    pub fn floor_m(&self, laps: usize) -> f64 {
        let means = self.run_means_m(laps);
        let count = means.len() as f64;
        let sum: f64 = means.iter().map(|run| rms(&self.mean_m, run)).sum();
        // Each run is a part of the mean that it is held against.
        sum / (count - 1.0)
    }

    /// Standard error, gate by gate, of the mean of runs of so many laps each that this very model drove, m.
    pub fn standard_error_m(&self, laps: &[usize]) -> Vec<f64> {
        let fewest = laps.iter().copied().min().unwrap_or(1);
        let means = self.run_means_m(fewest);
        let at = |gate: usize| {
            let off = |run: &Vec<f64>| (run[gate] - self.mean_m[gate]).powi(2);
            let variance = means.iter().map(off).sum::<f64>() / (means.len() as f64 - 1.0);
            (variance / laps.len() as f64).sqrt()
        };
        (0..self.mean_m.len()).map(at).collect()
    }

    /// Mean lap of each run's first so many laps, m.
    fn run_means_m(&self, laps: usize) -> Vec<Vec<f64>> {
        (self.runs_m.iter())
            .filter_map(|run| mean_lap(run.iter().take(laps)))
            .collect()
    }
}

/// The mean of laps, gate by gate; `None` of none.
pub fn mean_lap<'a>(laps: impl IntoIterator<Item = &'a Vec<f64>>) -> Option<Vec<f64>> {
    let (mut sum, mut count) = (Vec::new(), 0.0);
    for lap in laps {
        sum.resize(lap.len(), 0.0);
        sum.iter_mut().zip(lap).for_each(|(s, x)| *s += x);
        count += 1.0;
    }
    (count > 0.0).then(|| sum.into_iter().map(|s: f64| s / count).collect())
}

fn mean<'a>(values: impl IntoIterator<Item = &'a f64>) -> f64 {
    let (sum, count) = (values.into_iter()).fold((0.0, 0.0), |(sum, count), x| (sum + x, count + 1.0));
    sum / count
}

/// The root mean square of what two laps differ by, gate by gate.
pub fn rms(a: &[f64], b: &[f64]) -> f64 {
    (a.iter().zip(b).map(|(x, y)| (x - y) * (x - y)).sum::<f64>() / a.len() as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use sim::Streams;

    use super::*;

    fn lap(offsets_m: Vec<f64>) -> Lap {
        Lap {
            start_s: 10.0,
            end_s: 80.0,
            times_s: Vec::new(),
            offsets_m,
            missed: Vec::new(),
        }
    }

    #[test]
    fn a_run_that_is_off_by_as_much_at_every_gate_is_as_far() {
        let mut broken = lap(vec![9.0, f64::NAN]);
        broken.missed = vec![1];
        let runs = [
            vec![lap(vec![0.0, 1.0])],
            vec![lap(vec![0.2, 1.2]), broken.clone(), lap(vec![0.1, 1.1])],
            vec![broken],
        ];
        let laps = MeanLaps::new(&runs).unwrap();
        assert_eq!((laps.lap_s(), laps.laps_m().count()), (70.0, 3));
        assert!((laps.mean_m()[0] - 0.1).abs() < 1e-12 && (laps.mean_m()[1] - 1.1).abs() < 1e-12);
        let run = [vec![0.3, 0.9], vec![0.5, 1.1]];
        // The mean of that is (0.4, 1.0).
        let expected = ((0.3_f64.powi(2) + 0.1_f64.powi(2)) / 2.0).sqrt();
        assert!((laps.distance_m(&run) - expected).abs() < 1e-12);
        assert!(laps.distance_m(&[]).is_nan());
    }

    #[test]
    fn lap_times_scatter_as_the_means_of_runs_do() {
        let of = |duration_s: f64| Lap {
            end_s: 10.0 + duration_s,
            ..lap(vec![0.0])
        };
        let runs = [vec![of(69.0), of(71.0), of(90.0)], vec![of(72.0), of(76.0)]];
        let laps = MeanLaps::new(&runs).unwrap();
        assert!((laps.lap_s() - 75.6).abs() < 1e-12);
        // Means of 70 and 74 s of the first two laps.
        assert!((laps.lap_chance_s(2) - 8.0_f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn one_run_tells_nothing_of_chance() {
        assert!(MeanLaps::new(&[vec![lap(vec![0.0])], Vec::new()]).is_err());
    }

    #[test]
    fn the_floor_is_what_chance_does_to_a_run() {
        const RUNS: usize = 400;
        const LAPS: usize = 5;
        const GATES: usize = 200;
        let mut stream = Streams { seed: 5, run: 0 }.open("laps");
        let mut drawn = || lap((0..GATES).map(|_| 0.01 * stream.normal()).collect());
        let runs: Vec<Vec<Lap>> = (0..RUNS).map(|_| (0..LAPS).map(|_| drawn()).collect()).collect();
        let laps = MeanLaps::new(&runs).unwrap();
        // Of so many gates the root mean square hardly varies.
        let of_run = 0.01 / (LAPS as f64).sqrt();
        assert!((laps.floor_m(LAPS) / of_run - 1.0).abs() < 0.01);
        let errors_m = laps.standard_error_m(&[LAPS; 4]);
        let mean = errors_m.iter().sum::<f64>() / GATES as f64;
        assert!((mean / (0.5 * of_run) - 1.0).abs() < 0.01, "{mean}");
    }
}
