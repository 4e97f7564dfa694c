//! One control step of both controllers against 15 to 1000 segments, with one ray per sensor and with many; with effects
//! that drift; what it costs to cut a circuit and to make a variant of it; and twenty laps with draws that are made in their
//! course, or were made before.

mod ground;

use std::hint::black_box;
use std::sync::Arc;

use criterion::Criterion;
use ground::{braitenberg, circuit, model, rule_based};
use sim::{Beam, Circuit, Combine, Draws, Model, Pattern, Run, Scene, Setting, Streams, Tape, max_error_for};

fn main() {
    let mut criterion = Criterion::default().configure_from_args();
    let circuit = circuit();
    for segments in [15, 47, 105, 1000] {
        let max_error_m =
            max_error_for(&circuit.course, segments).expect("the shipped circuit can be cut that fine");
        for (name, controller) in [("braitenberg", braitenberg()), ("rule-based", rule_based())] {
            step(
                &mut criterion,
                &format!("step/{name}/{segments}"),
                &circuit,
                &model(controller, max_error_m),
            );
        }
        let declared = model(braitenberg(), max_error_m);
        criterion.bench_function(&format!("scene/{segments}"), |bencher| {
            bencher.iter(|| Scene::new(Arc::clone(&circuit), black_box(&declared), None));
        });
    }
    for rays in [1, 3, 10, 30, 100] {
        let mut wide = model(braitenberg(), 0.005);
        wide.machine.beam = Beam::cone(rays, 0.3, Combine::Responses).expect("a cone in range");
        step(
            &mut criterion,
            &format!("step/rays-per-sensor/{rays}"),
            &circuit,
            &wide,
        );
    }
    let effects: [&[(&str, &[f64])]; 5] = [
        &[("reading-gain", &[1.02])],
        &[("incidence-falloff", &[0.9])],
        &[("outer-wall-reflectance", &[0.97])],
        &[("slip-level", &[1.5])],
        &[("sensor-lag", &[0.1]), ("camera-offset", &[0.001, 0.0])],
    ];
    for together in effects {
        let mut with = model(braitenberg(), 0.005);
        let setting = |&(name, values): &(&str, &[f64])| {
            let spec = sim::find(name).expect("a name of the registry");
            Setting::constant(spec, values.to_vec())
        };
        with.effects = together.iter().map(setting).collect();
        let names: Vec<&str> = together.iter().map(|(name, _)| *name).collect();
        step(
            &mut criterion,
            &format!("step/with/{}", names.join("+")),
            &circuit,
            &with,
        );
    }
    for name in ["reading-gain", "sensor-reach", "outer-wall-offset"] {
        let mut drifting = model(braitenberg(), 0.005);
        drifting.effects.push(by_time(name));
        step(
            &mut criterion,
            &format!("step/by-time/{name}"),
            &circuit,
            &drifting,
        );
    }
    laps(&mut criterion, &circuit);
    criterion.final_summary();
}

/// An effect with one parameter that moves away from its neutral value by a millionth a second.
fn by_time(name: &str) -> Setting {
    let spec = sim::find(name).expect("a name of the registry");
    let start = vec![spec.params[0].neutral.expect("a size")];
    Setting {
        spec,
        pattern: Pattern::ByTime {
            start,
            per_s: vec![1e-6],
        },
    }
}

fn step(criterion: &mut Criterion, name: &str, circuit: &Arc<Circuit>, model: &Model) {
    let scene =
        Scene::new(Arc::clone(circuit), model, None).expect("the shipped model fits the shipped world");
    let world = scene.world(model, 0).expect("no effects, no error");
    let mut run = Run::new(&world, Streams { seed: 1, run: 0 }).expect("no effects, no error");
    criterion.bench_function(name, |bencher| bencher.iter(|| black_box(run.step())));
}

/// Twenty laps with fresh draws and from a tape, and the tape itself.
fn laps(criterion: &mut Criterion, circuit: &Arc<Circuit>) {
    const LAPS: usize = 20;
    let declared = model(braitenberg(), 0.005);
    let scene =
        Scene::new(Arc::clone(circuit), &declared, None).expect("the shipped model fits the shipped world");
    let world = scene.world(&declared, 0).expect("no effects, no error");
    let streams = Streams { seed: 1, run: 0 };
    let tape = Tape::new(&world, streams, LAPS);
    let mut time = |name: &str, draws: Draws<'_>| {
        criterion.bench_function(name, |bencher| {
            bencher.iter(|| sim::drive(&world, black_box(draws), LAPS, |_| ()))
        });
    };
    time("laps/fresh", streams.into());
    time("laps/taped", (&tape).into());
    criterion.bench_function("laps/tape", |bencher| {
        bencher.iter(|| Tape::new(&world, black_box(streams), LAPS));
    });
}
