//! Scratch.
use std::io::Read;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;
use diagnose::{Atlas, laps_debug as lab};
use sim::*;
use track::{Course, Lap, LapTracker, Way};

fn declared(rule: bool) -> Model {
    let m = |x: f64, y: f64, a: f64| Mount { position: Vec2::new(x, y), angle_rad: a };
    Model {
        machine: Machine {
            robot: Robot { body_radius_m: 0.037, axle_m: 0.053, wheel_speed_limit_m_s: 0.1288 },
            mounts: [m(0.030,-0.010,-0.30), m(0.022,-0.025,-0.80), m(0.0,-0.031,-1.57), m(-0.030,-0.015,-2.64), m(-0.030,0.015,2.64), m(0.0,0.031,1.57), m(0.022,0.025,0.80), m(0.030,0.010,0.30)],
            range_m: 0.1, full_scale_counts: 4095.0,
            response: Response::Improved { a_counts: 4202.93, d0_m: 0.00521953, exponent: 1.57281692 },
            noise: ReadingNoise { fraction: 0.05, counts: 8.0 },
            beam: Beam::single(),
            controller: if rule { Controller::RuleBased { speed_m_s: 0.05, threshold_counts: 500.0 } } else { Controller::Braitenberg { speed_m_s: 0.05, gain_per_count: 0.0005 } },
            slip_level: 0.1, camera_noise_m: 0.001,
        },
        run: RunRules { way: Way::Forward, control_step_s: 0.064, physics_steps: 2, start_offset_m: 0.02, start_heading_rad: 0.2, patience_laps: 10.0 },
        wall: WallRules { max_error_m: 0.005, thickness_m: 0.0 },
        effects: vec![],
    }
}

fn read_run(path: &Path, gates: &track::Gates) -> Vec<Lap> {
    let mut text = String::new();
    flate2::read::GzDecoder::new(std::fs::File::open(path).unwrap()).read_to_string(&mut text).unwrap();
    let mut tracker = LapTracker::new(gates, Way::Forward);
    let mut laps = vec![];
    for line in text.lines().skip(1) {
        let mut f = line.split(',');
        let t: f64 = f.next().unwrap().parse().unwrap();
        let (Ok(x), Ok(y)) = (f.next().unwrap().parse::<f64>(), f.next().unwrap().parse::<f64>()) else { continue };
        if let Some(lap) = tracker.push(t, Vec2::new(x, y)) { laps.push(lap); }
    }
    laps.into_iter().skip(1).take(20).collect()
}

fn main() {
    let course = Course::from_toml(include_str!("../../../../worlds/roduit2007/world.toml")).unwrap();
    let circuit = Arc::new(Circuit::new(course, 100).unwrap());
    let args: Vec<String> = std::env::args().collect();
    let folder = Path::new(&args[1]);
    let labels = std::fs::read_to_string(folder.join("labels.csv")).unwrap();
    for rule in [false, true] {
        let model = declared(rule);
        let scene = Scene::new(circuit.clone(), &model, None).unwrap();
        let simulate = |effects: &[Setting], set: u64| -> Option<Vec<Vec<Lap>>> {
            let mut model = model.clone();
            model.effects = effects.to_vec();
            (0..4).map(|run| {
                let world = scene.world(&model, run).ok()?;
                let d = drive(&world, Streams { seed: 1_000_003 + set, run: run as u64 }, 20, |_| {}).ok()?;
                let laps: Vec<Lap> = d.laps.into_iter().filter(|l| l.missed.is_empty()).collect();
                (laps.len() >= 15).then_some(laps)
            }).collect()
        };
        let t = Instant::now();
        let atlas = Atlas::new(&simulate, &|| ()).unwrap();
        println!("== rule {rule}: atlas {} sets in {:.1} s", Atlas::sets(), t.elapsed().as_secs_f64());
        lab::null_report(&atlas);
        for line in labels.lines().skip(1) {
            let f: Vec<&str> = line.split(',').collect();
            if f[1] != "L1" || (f[3] == "rule-based") != rule { continue; }
            if args.len() > 2 && !args[2..].iter().any(|a| a == f[0]) { continue; }
            let runs: Vec<Vec<Lap>> = ["a", "b", "c", "d"].iter().map(|r| read_run(&folder.join(f[0]).join(format!("run_{r}.csv.gz")), &circuit.gates)).collect();
            let t = Instant::now();
            println!("-- {} {} {} {}", f[0], f[2], f[4], f[6]);
            lab::report(&atlas, &simulate, &runs);
            println!("   {:.1} s", t.elapsed().as_secs_f64());
        }
    }
}
