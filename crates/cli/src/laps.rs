//! Laps at the gates, from files and from simulations.

use std::sync::Arc;

use anyhow::{Context, Result, bail};
use pdm::Cluster;
use rayon::prelude::*;
use sim::{Circuit, Drive, Start, Vec2};
use track::{Lap, LapTracker, Way};

use crate::config::Config;
use crate::dataset::{DataSet, RunFile};
use crate::setup;

/// The laps of one run that are analysed, and what was set aside.
#[derive(Debug, Clone)]
pub(crate) struct SampledRun {
    /// `<data set>/<run>`.
    pub(crate) name: String,
    /// The name of the run alone.
    pub(crate) run: String,
    /// Closed laps, the first whole lap of the run not among them.
    pub(crate) laps: Vec<Lap>,
    /// Whole laps that missed a gate: number of the lap from 1 (the dropped one is 0) and the gate.
    pub(crate) set_aside: Vec<(usize, usize)>,
    /// Laps asked for.
    pub(crate) wanted: usize,
    /// Whether the run ended because gate 0 was not crossed for too long.
    pub(crate) timed_out: bool,
    /// Time of the run's first row, s.
    pub(crate) began_s: f64,
    /// Sightings that are not used, in words.
    pub(crate) strays: Vec<String>,
}

impl SampledRun {
    /// The laps to keep among all whole laps of a run, in order: the first is dropped, those that miss a gate are set
    /// aside, and of the others the first `wanted` kept.
    pub(crate) fn new(set: &str, run: &str, whole: &[Lap], wanted: usize, began_s: f64) -> Self {
        let mut laps = Vec::with_capacity(wanted);
        let mut set_aside = Vec::new();
        for (number, lap) in whole.iter().enumerate().skip(1) {
            if laps.len() == wanted {
                break;
            }
            match lap.missed.first() {
                Some(&gate) => set_aside.push((number, gate)),
                None => laps.push(lap.clone()),
            }
        }
        Self {
            name: format!("{set}/{run}"),
            run: run.to_owned(),
            laps,
            set_aside,
            wanted,
            timed_out: false,
            began_s,
            strays: Vec::new(),
        }
    }

    /// Where a simulated run must start for its first kept lap to begin as long after the start as this one's.
    pub(crate) fn start(&self) -> Start {
        let lap = &self.laps[0];
        // The dropped lap took about as long.
        let until_lap_s = lap.start_s - self.began_s;
        let until_s = |gate: usize| lap.end_s - lap.times_s[gate] + lap.duration_s();
        let off_s = |&gate: &usize| (until_s(gate) - until_lap_s).abs();
        // A run that starts on gate 0 may cross it at once or a lap later.
        let gate = (1..lap.times_s.len()).min_by(|a, b| off_s(a).total_cmp(&off_s(b)));
        let gate = gate.unwrap_or(0);
        Start {
            gate,
            time_s: until_lap_s - until_s(gate),
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

    /// What a user must know of laps that are not there, if anything.
    pub(crate) fn remarks(&self) -> Vec<String> {
        let mut remarks = self.strays.clone();
        remarks.extend(
            (self.set_aside.iter())
                .map(|(lap, gate)| format!("{}: lap {lap} misses gate {gate} and is set aside", self.name)),
        );
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
    /// The laps of a data set on a circuit that is at hand. Sightings where no robot can be are taken for none.
    ///
    /// # Errors
    /// A run without a whole lap after its first.
    pub(crate) fn on(mut set: DataSet, circuit: Arc<Circuit>) -> Result<Self> {
        let config = set.declared_config(&Config::shipped())?;
        let way = setup::way(&config, &circuit.course);
        let strays: Vec<Vec<String>> = set.runs.iter_mut().map(without_strays).collect();
        let sampled: Vec<Result<SampledRun>> = (set.runs.par_iter().zip(strays))
            .map(|(run, strays)| {
                let sampled = sample(&set, run, &circuit, way)?;
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
        rows.t_s
            .iter()
            .zip(&rows.position_m)
            .filter(|(t, _)| inside(**t))
            .filter_map(|(_, p)| *p)
            .collect()
    }
}

/// Times in s and positions in m where the robot was seen.
fn seen(run: &RunFile) -> impl Iterator<Item = (f64, Vec2)> {
    let rows = run.rows.t_s.iter().zip(&run.rows.position_m);
    rows.filter_map(|(&time_s, position)| position.map(|[x, y]| (time_s, Vec2::new(x, y))))
}

/// Takes sightings away where no robot can have been between those beside them, and says which.
fn without_strays(run: &mut RunFile) -> Vec<String> {
    let path = run.path.display().to_string();
    let rows = &mut run.rows;
    let say = |row: usize| {
        let [x, y] = rows.position_m[row].unwrap_or([f64::NAN; 2]);
        let time_s = rows.t_s[row];
        format!(
            "{path}: at t_s = {time_s:.3} the robot is seen at ({x}, {y}), where it cannot get from where it is seen \
             before and after; taken as not seen"
        )
    };
    let strays = strays(&rows.t_s, &rows.position_m);
    let words = strays.iter().map(|&row| say(row)).collect();
    for row in strays {
        rows.position_m[row] = None;
    }
    words
}

/// The rows in which a robot is seen where it cannot get, and out of which it comes back; none if they are many, which is no
/// fault of single sightings.
fn strays(t_s: &[f64], position_m: &[Option<[f64; 2]>]) -> Vec<usize> {
    /// A robot's speed at most, and how far sightings of it may be off.
    const FAST_M_S: f64 = 0.2;
    const OFF_M: f64 = 0.05;
    /// Time within which it has come back, s, if not with the very next sighting.
    const SOON_S: f64 = 0.6;
    /// Share of the sightings that are many.
    const MANY: f64 = 0.01;
    let seen: Vec<(usize, f64, [f64; 2])> = (t_s.iter().zip(position_m).enumerate())
        .filter_map(|(row, (&time_s, position))| position.map(|position_m| (row, time_s, position_m)))
        .collect();
    let gets = |a: usize, b: usize| {
        let ((_, from_s, from), (_, to_s, to)) = (seen[a], seen[b]);
        let way_m = (to[0] - from[0]).hypot(to[1] - from[1]);
        way_m <= OFF_M + FAST_M_S * (to_s - from_s).abs()
    };
    let mut strays = Vec::new();
    let mut last = 0;
    if seen.len() > 2 && !gets(0, 1) && gets(1, 2) {
        strays.push(seen[0].0);
        last = 1;
    }
    let mut next = last + 1;
    while next < seen.len() {
        if !gets(last, next) {
            let soon = |&later: &usize| later == next + 1 || seen[later].1 - seen[last].1 <= SOON_S;
            let mut later = (next + 1..seen.len()).take_while(soon);
            if let Some(back) = later.find(|&later| gets(last, later)) {
                strays.extend(seen[next..back].iter().map(|(row, ..)| row));
                next = back;
            }
        }
        last = next;
        next += 1;
    }
    if strays.len() as f64 > MANY * seen.len() as f64 {
        return Vec::new();
    }
    strays
}

fn sample(set: &DataSet, run: &RunFile, circuit: &Circuit, way: Way) -> Result<SampledRun> {
    let mut tracker = LapTracker::new(&circuit.gates, way);
    let whole: Vec<Lap> = seen(run)
        .filter_map(|(time_s, position)| tracker.push(time_s, position))
        .collect();
    let began_s = run.rows.t_s.first().copied().unwrap_or_default();
    let sampled = SampledRun::new(&set.name, &run.name, &whole, set.laps, began_s);
    if sampled.laps.is_empty() {
        let path = run.path.display();
        if let Some((lap, gate)) = sampled.set_aside.first() {
            bail!(
                "{path}: no lap crosses all gates: lap {lap} misses gate {gate}; is this the world it was driven in?"
            );
        }
        bail!(
            "{path}: {} whole lap{}, and the first is not analysed: at least two are needed; check the world, the \
             driving direction ([declared] run.direction in dataset.toml) and the unit of x_m and y_m",
            whole.len(),
            if whole.len() == 1 { "" } else { "s" }
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
    let sampled = SampledRun::new(name, &crate::dataset::run_name(run), &whole, wanted, 0.0);
    SampledRun {
        timed_out: drive.timed_out,
        ..sampled
    }
}

/// Mean and standard deviation (divisor n - 1).
pub(crate) fn mean_and_deviation(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let squares: f64 = values.iter().map(|v| (v - mean) * (v - mean)).sum();
    (mean, (squares / (n - 1.0)).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Laps of 50 s that pass 100 gates evenly, the first of them begun then.
    fn run(first_s: f64, began_s: f64) -> SampledRun {
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
        SampledRun::new("set", "a", &whole, 3, began_s)
    }

    #[test]
    fn sightings_where_no_robot_gets_are_strays_if_it_comes_back() {
        let t_s: Vec<f64> = (0..1000).map(|i| 0.064 * f64::from(i)).collect();
        let way: Vec<Option<[f64; 2]>> = (0..1000).map(|i| Some([0.003 * f64::from(i), 0.5])).collect();
        assert_eq!(strays(&t_s, &way), [0; 0]);
        let mut seen = way.clone();
        for row in [0, 400, 401, 700] {
            seen[row] = Some([57.0, 0.5]);
        }
        seen[402] = None;
        assert_eq!(strays(&t_s, &seen), [0, 400, 401, 700]);
        // Carried elsewhere it does not come back.
        let mut carried = way.clone();
        carried[500..].iter_mut().flatten().for_each(|at| at[1] = 0.9);
        assert_eq!(strays(&t_s, &carried), [0; 0]);
        // Another unit is no fault of single sightings.
        let millimetres: Vec<_> = way.iter().map(|at| at.map(|at| at.map(|m| 1000.0 * m))).collect();
        assert_eq!(strays(&t_s, &millimetres), [0; 0]);
    }

    #[test]
    fn a_simulated_run_starts_where_the_measured_one_did() {
        // Gate 60 is 20 s before gate 0.
        let start = run(23.0, 3.0).start();
        assert_eq!(start.gate, 60);
        assert!(start.time_s.abs() < 1e-9, "{start:?}");
        // Between gates: 0.1 s after gate 60.
        let start = run(22.9, 3.0).start();
        assert_eq!(start.gate, 60);
        assert!((start.time_s + 0.1).abs() < 1e-9, "{start:?}");
    }

    #[test]
    fn a_run_that_had_driven_before_it_was_seen_has_a_clock_ahead() {
        let start = run(123.0, 3.0).start();
        assert_eq!(start.gate, 1);
        assert!((start.time_s - 70.5).abs() < 1e-9, "{start:?}");
    }
}
