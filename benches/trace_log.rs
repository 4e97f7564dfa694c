//! What a robot's log lacks, of four runs of five laps: of a robot as declared, and with one, two and three effects.

mod ground;

use criterion::{Criterion, SamplingMode};
use diagnose::{LogRow, LoggedRun, diagnose_logs};
use ground::{braitenberg, circuit, model};
use sim::{Scene, Setting, Streams};

/// Effects by name, with their values.
type Effects = &'static [(&'static str, &'static [f64])];

const RUNS: usize = 4;
const LAPS: usize = 5;

fn main() {
    let mut criterion = Criterion::default().configure_from_args();
    let robots: [(&str, Effects); 4] = [
        ("as-declared", &[]),
        ("one-effect", &[("wheel-asymmetry", &[1.02])]),
        (
            "two-effects",
            &[("reading-gain", &[0.88]), ("marker-offset", &[-0.009, 0.0, 0.0])],
        ),
        (
            "three-effects",
            &[
                ("wheel-scale", &[1.05]),
                ("distance-scale", &[0.93]),
                ("slip-level", &[2.0]),
            ],
        ),
    ];
    let declared = model(braitenberg(), 0.005);
    let scene = Scene::new(circuit(), &declared, None).expect("the shipped circuit can be cut");
    let mut group = criterion.benchmark_group("trace-log");
    group.sample_size(10).sampling_mode(SamplingMode::Flat);
    for (name, effects) in robots {
        let mut robot = declared.clone();
        robot.effects = (effects.iter())
            .map(|(name, values)| {
                let spec = sim::find(name).expect("a name of the registry");
                Setting::constant(spec, values.to_vec())
            })
            .collect();
        let logs: Vec<Vec<LogRow>> = (0..RUNS)
            .map(|run| {
                let world = scene.world(&robot, run).expect("the effects are in range");
                let streams = Streams {
                    seed: 1,
                    run: run as u64,
                };
                let mut rows = Vec::new();
                sim::drive(&world, streams, LAPS, |step| rows.push(LogRow::from(*step)))
                    .expect("the robot goes round");
                rows
            })
            .collect();
        let runs: Vec<LoggedRun<'_>> = (logs.iter())
            .map(|rows| LoggedRun {
                model: &declared,
                rows,
            })
            .collect();
        group.bench_function(name, |bencher| {
            bencher.iter(|| {
                diagnose_logs(&scene, &runs, &|_| true, &|_| ()).expect("logs that can be followed")
            });
        });
    }
    group.finish();
    criterion.final_summary();
}
