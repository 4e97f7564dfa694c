//! A robot that is nothing but noise, for tests.

use sim::{Pattern, Setting, find};

use super::atlas::{Atlas, Extent};
use super::observed::{ObservedLap, ObservedRun};
use super::probe::probes;

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
    let mut known = probes(0.032);
    known.retain(|probe| probe.spec.name == "wheel-scale");
    Atlas::with_probes(&simulated, &[], true, known, &|| ()).expect("it drives its laps")
}

/// A wheel scale that puts laps aside by so many mm.
pub(super) fn aside(mm: f64) -> [Setting; 1] {
    [Setting::constant(find("wheel-scale").expect("an effect"), [mm])]
}
