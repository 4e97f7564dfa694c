//! A robot that is nothing but noise, for tests.

use sim::{Pattern, Setting, find};

use super::atlas::{Atlas, Extent};
use super::observed::{ObservedLap, ObservedRun};
use super::probe::probes;
use super::summary::Summary;

const GATES: usize = 40;

/// Two runs of laps that scatter by 1 mm, where a wheel scale puts them aside by as many mm, from a hundred on by other draws, and a
/// thousand stops the robot.
pub(super) fn simulated(effects: &[Setting], set: u64, extent: Extent) -> Option<Vec<ObservedRun>> {
    let aside_mm = effects.first().map_or(0.0, |effect| match &effect.pattern {
        Pattern::Constant(values) => values[0],
        _ => unreachable!(),
    });
    let run = |run: u64| {
        let purpose = if aside_mm < 100.0 { "laps" } else { "other laps" };
        let mut stream = sim::Streams { seed: set, run }.open(purpose);
        let mut lap = |number: usize| {
            let mut time_s = 60.0 * number as f64;
            let times_s: Vec<f64> = (0..=GATES)
                .map(|_| {
                    time_s += 1.0 + 0.01 * stream.normal();
                    time_s
                })
                .collect();
            let offsets_m = (0..GATES).map(|_| 1e-3 * (aside_mm + stream.normal()));
            let smooth = track::Lap {
                offsets_m: offsets_m.collect(),
                start_s: times_s[0],
                end_s: times_s[GATES],
                times_s: times_s[..GATES].to_vec(),
                missed: Vec::new(),
            };
            let mut seen = smooth.clone();
            (seen.offsets_m.iter_mut()).for_each(|offset_m| *offset_m += 1e-3 * stream.normal());
            ObservedLap { seen, smooth }
        };
        ObservedRun {
            laps: (0..5).map(&mut lap).collect(),
            beginning: None,
            before: Vec::new(),
        }
    };
    let runs = extent.runs(2) as u64;
    (aside_mm < 1000.0).then(|| (0..runs).map(run).collect())
}

/// An atlas of this robot that knows a wheel scale alone.
pub(super) fn atlas() -> Atlas {
    atlas_of(&["wheel-scale"])
}

/// An atlas of this robot that knows some effects, each of which puts laps aside as a wheel scale does.
pub(super) fn atlas_of(effects: &[&str]) -> Atlas {
    let mut known = probes(0.032);
    known.retain(|probe| effects.contains(&probe.spec.name));
    Atlas::with_probes(&simulated, &[], true, known, &|| ()).expect("it drives its laps")
}

/// A wheel scale that puts laps aside by so many mm.
pub(super) fn aside(mm: f64) -> [Setting; 1] {
    [Setting::constant(find("wheel-scale").expect("an effect"), [mm])]
}

/// So many of this robot's data sets.
pub(super) fn summaries(sets: u64) -> Vec<Summary> {
    summaries_of(sets, |_| ())
}

/// The same of laps that scatter twice as wide.
pub(super) fn twice_as_wide(sets: u64) -> Vec<Summary> {
    summaries_of(sets, |lap| {
        (lap.offsets_m.iter_mut()).for_each(|offset_m| *offset_m *= 2.0);
        // From gate to gate it is a second but for what scatters.
        let start_s = lap.times_s[0];
        let wider = |(gate, time_s): (usize, &mut f64)| {
            let mean_s = start_s + gate as f64;
            *time_s = mean_s + 2.0 * (*time_s - mean_s);
        };
        let times_s = lap.times_s.iter_mut().chain(std::iter::once(&mut lap.end_s));
        times_s.enumerate().for_each(wider);
    })
}

fn summaries_of(sets: u64, change: impl Fn(&mut track::Lap)) -> Vec<Summary> {
    let summary = |set: u64| {
        let mut runs = simulated(&[], set, Extent::Whole).expect("it drives its laps");
        for lap in runs.iter_mut().flat_map(|run| &mut run.laps) {
            change(&mut lap.smooth);
        }
        Summary::new(&runs, &[runs.len()]).expect("runs of five laps")
    };
    (0..sets).map(summary).collect()
}
