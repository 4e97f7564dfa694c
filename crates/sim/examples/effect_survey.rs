//! How large is the trace that each effect leaves in 4 x 20 laps? `cargo run --release -p sim --example effect_survey`
//!
//! Two numbers per effect, each the mean over sets of laps of a squared distance from the declared model's laps, less
//! its expectation without any effect: of the mean lap (100 lateral positions and 20 durations of five gates) and of
//! 20 statistics of second order (spread, roughness, kurtosis). Sets with and without an effect share their draws.
//! Beside them stand the numbers of an independent simulator.

#[path = "../../../benches/ground/mod.rs"]
mod ground;

use std::error::Error;
use std::io::Write;

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use rayon::prelude::*;
use sim::{Controller, Model, Scene, Setting, Streams, drive, find};
use track::Lap;

type Result<T> = std::result::Result<T, Box<dyn Error + Send + Sync>>;

const RUNS: usize = 4;
const LAPS: usize = 20;
const NULL_SETS: u64 = 200;
const EFFECT_SETS: u64 = 16;
/// Coordinates of a lap.
const MEAN: usize = 120;
/// Statistics of second order of a set of laps.
const SECOND: usize = 20;

fn main() -> Result<()> {
    let mut out = std::io::stdout().lock();
    for (name, controller, column) in [
        ("Braitenberg", ground::braitenberg(), 0),
        ("rule-based", ground::rule_based(), 1),
    ] {
        let survey = Survey::new(controller)?;
        let (time_s, spread_s, spread_mm) = survey.lap;
        writeln!(
            out,
            "{name}: lap {time_s:.2} s +- {spread_s:.3} s, lateral spread {spread_mm:.2} mm"
        )?;
        writeln!(
            out,
            "{:46} {:>16} {:>9} {:>14} {:>7}",
            "effect", "mean", "there", "second", "there"
        )?;
        for (label, kind, values, known) in rows() {
            let [mean, second] = survey.excess(kind, &values)?;
            let there = known[column];
            writeln!(
                out,
                "{label:46} {:>8.0} +- {:>4.0} {:>9} {:>7.0} +- {:>3.0} {:>7}",
                mean.0, mean.1, there[0], second.0, second.1, there[1]
            )?;
        }
    }
    Ok(())
}

/// Label, name and values of an effect, and the independent simulator's excesses for both controllers.
type Row = (&'static str, &'static str, Vec<f64>, [[u32; 2]; 2]);

fn rows() -> Vec<Row> {
    let e = f64::exp;
    vec![
        ("none", "reading-gain", vec![1.0], [[0, 0], [0, 0]]),
        (
            "reading-gain e^.09",
            "reading-gain",
            vec![e(0.09)],
            [[5800, 580], [6600, 80]],
        ),
        (
            "distance-scale e^.06",
            "distance-scale",
            vec![e(0.06)],
            [[5700, 700], [5900, 30]],
        ),
        (
            "cone-of-view .15 rad",
            "cone-of-view",
            vec![0.15],
            [[110, 55], [170, 45]],
        ),
        (
            "cone-of-view .5 rad",
            "cone-of-view",
            vec![0.5],
            [[2000, 150], [730, 10]],
        ),
        (
            "ambient-offset 30 counts",
            "ambient-offset",
            vec![30.0],
            [[320, 45], [38000, 290]],
        ),
        (
            "sensor-rotation .06 rad",
            "sensor-rotation",
            vec![0.06],
            [[3600, 90], [8700, 100]],
        ),
        (
            "one-sensor-gain S1 .79",
            "one-sensor-gain",
            vec![1.0, 0.79],
            [[1230, 240], [470, 20]],
        ),
        (
            "one-sensor-gain S0 .79",
            "one-sensor-gain",
            vec![0.0, 0.79],
            [[85, 32], [21, 15]],
        ),
        (
            "directional-light 24 counts from .8 rad",
            "directional-light",
            vec![24.0, 0.8],
            [[26000, 80], [3000, 11]],
        ),
        (
            "reading-noise e^.36",
            "reading-noise",
            vec![e(0.36)],
            [[100, 17], [510, 35]],
        ),
        (
            "reading-step 60 counts",
            "reading-step",
            vec![60.0],
            [[1900, 330], [300, 64]],
        ),
        (
            "sensor-lag .12 s",
            "sensor-lag",
            vec![0.12],
            [[2200, 850], [1300, 300]],
        ),
        (
            "wheel-asymmetry 1.009",
            "wheel-asymmetry",
            vec![1.009],
            [[3400, 13], [2800, 200]],
        ),
        (
            "axle-length e^.06",
            "axle-length",
            vec![e(0.06)],
            [[2500, 410], [940, 0]],
        ),
        (
            "wheel-scale 1.03",
            "wheel-scale",
            vec![1.03],
            [[70000, 45], [36000, 20]],
        ),
        (
            "motor-lag .12 s",
            "motor-lag",
            vec![0.12],
            [[3200, 1150], [3000, 460]],
        ),
        (
            "slip-level e^.36",
            "slip-level",
            vec![e(0.36)],
            [[96, 240], [65, 10]],
        ),
        (
            "slip-level e^1.2",
            "slip-level",
            vec![e(1.2)],
            [[1400, 3300], [1200, 350]],
        ),
        (
            "outer-wall-offset 4.5 mm",
            "outer-wall-offset",
            vec![0.0045],
            [[28600, 370], [32400, 27]],
        ),
        (
            "inner-wall-offset 4.5 mm",
            "inner-wall-offset",
            vec![0.0045],
            [[8500, 420], [3400, 46]],
        ),
        // The camera's x, at a place on the floor, plus 0 + .006 (x - middle): no scale of both axes, which is larger.
        (
            "camera-scale 1.006 of x alone",
            "unlisted",
            vec![7.0, 3.0, 0.0, 0.0, 0.006],
            [[7200, 50], [5500, 7]],
        ),
        (
            "marker-offset 2.4 mm left",
            "marker-offset",
            vec![0.0, 0.0024, 0.0],
            [[17000, 0], [10300, 0]],
        ),
        (
            "marker-offset 8 mm forward",
            "marker-offset",
            vec![0.008, 0.0, 0.0],
            [[98, 26], [230, 65]],
        ),
        (
            "camera-noise e^.36",
            "camera-noise",
            vec![e(0.36)],
            [[64, 1800], [100, 480]],
        ),
    ]
}

/// A mean and its standard error.
type Estimate = (f64, f64);

/// The declared model with the distribution of its statistics.
struct Survey {
    scene: Scene,
    model: Model,
    mean: Distribution,
    second: Distribution,
    /// Mean lap time, its standard deviation (s) and the gates' mean standard deviation of the lateral position (mm).
    lap: (f64, f64, f64),
}

impl Survey {
    fn new(controller: Controller) -> Result<Self> {
        let model = ground::model(controller, 0.005);
        let scene = Scene::new(ground::circuit(), &model, None)?;
        let sets = (0..NULL_SETS)
            .into_par_iter()
            .map(|seed| Set::drive(&scene, &model, seed))
            .collect::<Result<Vec<_>>>()?;
        let within = sets.iter().map(Set::within).sum::<DMatrix<f64>>() / NULL_SETS as f64;
        let mean = Distribution::new(&sets.iter().map(Set::mean).collect::<Vec<_>>(), Some(&within));
        let second = Distribution::new(&sets.iter().map(Set::second).collect::<Vec<_>>(), None);
        let spread_mm = within.diagonal().rows(0, 100).map(f64::sqrt).mean();
        let time_s = mean.center.rows(100, 20).sum() / 100.0;
        let spread_s = within.view((100, 100), (20, 20)).sum().sqrt() / 100.0;
        Ok(Self {
            scene,
            model,
            mean,
            second,
            lap: (time_s, spread_s, spread_mm),
        })
    }

    /// Excess of the mean lap's and of the second-order statistics' squared distance.
    fn excess(&self, kind: &str, values: &[f64]) -> Result<[Estimate; 2]> {
        let model = Model {
            effects: vec![Setting::constant(find(kind)?, values)],
            ..self.model.clone()
        };
        let sets = (0..EFFECT_SETS)
            .into_par_iter()
            .map(|seed| Set::drive(&self.scene, &model, NULL_SETS + seed))
            .collect::<Result<Vec<_>>>()?;
        let of = |distribution: &Distribution, statistic: fn(&Set) -> DVector<f64>| {
            estimate(
                &sets
                    .iter()
                    .map(|set| distribution.excess(&statistic(set)))
                    .collect::<Vec<_>>(),
            )
        };
        Ok([of(&self.mean, Set::mean), of(&self.second, Set::second)])
    }
}

fn estimate(values: &[f64]) -> Estimate {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let variance = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (count - 1.0);
    (mean, (variance / count).sqrt())
}

/// Mean and covariance of a statistic.
struct Distribution {
    center: DVector<f64>,
    covariance: Cholesky<f64, Dyn>,
}

impl Distribution {
    /// `within`: covariance of one lap, where the statistic is the mean of independent laps.
    fn new(values: &[DVector<f64>], within: Option<&DMatrix<f64>>) -> Self {
        let count = values.len() as f64;
        let center = values.iter().sum::<DVector<f64>>() / count;
        let covariance = within.map_or_else(
            || {
                let scatter: DMatrix<f64> = values
                    .iter()
                    .map(|x| (x - &center) * (x - &center).transpose())
                    .sum();
                // Hartlap et al. 2007: the inverse of an estimated covariance is too large.
                scatter / (count - center.len() as f64 - 2.0)
            },
            |within| within / (RUNS * LAPS) as f64,
        ) * (1.0 + 1.0 / count);
        let covariance = Cholesky::new(covariance).expect("there are more laps than coordinates");
        Self { center, covariance }
    }

    fn excess(&self, x: &DVector<f64>) -> f64 {
        let away = x - &self.center;
        away.dot(&self.covariance.solve(&away)) - away.len() as f64
    }
}

/// The laps of some runs: lateral positions (mm) and durations of five gates (10 ms).
struct Set(Vec<Vec<DVector<f64>>>);

impl Set {
    fn drive(scene: &Scene, model: &Model, seed: u64) -> Result<Self> {
        let run = |run: usize| -> Result<Vec<DVector<f64>>> {
            let world = scene.world(model, run)?;
            let drive = drive(
                &world,
                Streams {
                    seed,
                    run: run as u64,
                },
                LAPS,
                |_| {},
            )?;
            drive
                .laps
                .iter()
                .map(|lap| Ok(lap_vector(lap, lap.closed()?)))
                .collect()
        };
        Ok(Self((0..RUNS).map(run).collect::<Result<_>>()?))
    }

    fn mean(&self) -> DVector<f64> {
        self.0.iter().flatten().sum::<DVector<f64>>() / self.0.iter().flatten().count() as f64
    }

    /// Covariance of the laps about the means of their runs.
    fn within(&self) -> DMatrix<f64> {
        residuals(&self.0, LAPS)
            .map(|r| &r * r.transpose())
            .sum::<DMatrix<f64>>()
            / (RUNS * (LAPS - 1)) as f64
    }

    /// Log variances in ten blocks of gates and five of durations about the means of a run's quarters; log mean squares
    /// of a lap's second differences at spacings 1 and 5, log kurtosis of the first of these; kurtosis and skewness of
    /// durations.
    fn second(&self) -> DVector<f64> {
        let laps: Vec<DVector<f64>> = residuals(&self.0, LAPS / 4).collect();
        let block = |from: usize, count: usize| {
            moment(
                laps.iter()
                    .flat_map(|lap| lap.rows(from, count).iter().copied().collect::<Vec<_>>()),
                2,
            )
            .ln()
        };
        let bends = |spacing: usize| {
            self.0.iter().flatten().flat_map(move |lap| {
                (0..100 - 2 * spacing).map(move |i| lap[i] - 2.0 * lap[i + spacing] + lap[i + 2 * spacing])
            })
        };
        let times = || {
            laps.iter()
                .flat_map(|lap| lap.rows(100, 20).iter().copied().collect::<Vec<_>>())
        };
        let [m2, m3, m4] = [2, 3, 4].map(|power| moment(times(), power));
        let [rough, rougher] = [1, 5].map(|spacing| moment(bends(spacing), 2));
        let mut values: Vec<f64> = (0..10).map(|i| block(10 * i, 10)).collect();
        values.extend((0..5).map(|i| block(100 + 4 * i, 4)));
        values.extend([
            rough.ln(),
            rougher.ln(),
            (moment(bends(1), 4) / rough.powi(2)).ln(),
        ]);
        values.extend([m4 / m2.powi(2), m3 / m2.powf(1.5)]);
        assert_eq!(values.len(), SECOND);
        DVector::from_vec(values)
    }
}

fn moment(values: impl Iterator<Item = f64>, power: i32) -> f64 {
    let (count, sum) = values.fold((0.0, 0.0), |(count, sum), x| (count + 1.0, sum + x.powi(power)));
    sum / count
}

/// Laps less the mean of the stretch of `count` laps that they are in.
fn residuals(runs: &[Vec<DVector<f64>>], count: usize) -> impl Iterator<Item = DVector<f64>> {
    runs.iter()
        .flat_map(move |laps| laps.chunks(count))
        .flat_map(|stretch| {
            let mean = stretch.iter().sum::<DVector<f64>>() / stretch.len() as f64;
            stretch.iter().map(move |lap| lap - &mean)
        })
}

fn lap_vector(lap: &Lap, offsets_m: &[f64]) -> DVector<f64> {
    let crossing_s = |gate: usize| if gate < 100 { lap.times_s[gate] } else { lap.end_s };
    let durations = (0..20).map(|i| 100.0 * (crossing_s(5 * i + 5) - crossing_s(5 * i)));
    DVector::from_iterator(MEAN, offsets_m.iter().map(|x| 1000.0 * x).chain(durations))
}
