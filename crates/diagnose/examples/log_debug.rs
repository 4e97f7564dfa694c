//! debug
#![allow(missing_docs, clippy::print_stdout, clippy::unwrap_used)]
use anyhow::Result;
use diagnose::LogRow;
use sim::*;
use std::sync::Arc;
use track::{Course, LapTracker, Way};

pub fn read(path: &std::path::Path) -> Result<Vec<LogRow>> {
    let mut reader = csv::Reader::from_reader(flate2::read::GzDecoder::new(std::fs::File::open(path)?));
    reader
        .records()
        .map(|r| {
            let r = r?;
            let f = |i: usize| r[i].parse::<f64>().unwrap_or(f64::NAN);
            let p = Vec2::new(f(1), f(2));
            Ok(LogRow {
                time_s: f(0),
                observed: p.x.is_finite().then_some(p),
                readings: std::array::from_fn(|i| f(3 + i)),
                command: WheelSpeeds {
                    left_m_s: f(11),
                    right_m_s: f(12),
                },
            })
        })
        .collect()
}

pub fn declared(controller: Controller) -> Model {
    let right = [
        (0.030, -0.010, -0.30),
        (0.022, -0.025, -0.80),
        (0.000, -0.031, -1.57),
        (-0.030, -0.015, -2.64),
    ];
    let mount = |x: f64, y: f64, angle_rad: f64| Mount {
        position: Vec2::new(x, y),
        angle_rad,
    };
    let mounts = std::array::from_fn(|i: usize| {
        let (x, y, angle_rad) = right[i.min(7 - i)];
        if i < 4 {
            mount(x, y, angle_rad)
        } else {
            mount(x, -y, -angle_rad)
        }
    });
    Model {
        machine: Machine {
            robot: Robot {
                body_radius_m: 0.037,
                axle_m: 0.053,
                wheel_speed_limit_m_s: 0.1288,
            },
            mounts,
            range_m: 0.1,
            full_scale_counts: 4095.0,
            response: Response::Improved {
                a_counts: 4202.93,
                d0_m: 0.005_219_53,
                exponent: 1.572_816_92,
            },
            noise: ReadingNoise {
                fraction: 0.05,
                counts: 8.0,
            },
            beam: Beam::single(),
            controller,
            slip_level: 0.1,
            camera_noise_m: 0.001,
        },
        run: RunRules {
            way: Way::Forward,
            control_step_s: 0.064,
            physics_steps: 2,
            start_offset_m: 0.02,
            start_heading_rad: 0.2,
            patience_laps: 10.0,
        },
        wall: WallRules {
            max_error_m: 0.005,
            thickness_m: 0.0,
        },
        effects: Vec::new(),
    }
}

pub fn drive_rows(scene: &Scene, model: &Model, seed: u64, laps: usize) -> Vec<Vec<LogRow>> {
    let r = |x: f64, d: f64| (x * d).round() / d;
    (0..4)
        .map(|run| {
            let world = scene.world(model, run).unwrap();
            let mut rows = Vec::new();
            sim::drive(
                &world,
                Streams {
                    seed,
                    run: run as u64,
                },
                laps,
                |s| {
                    rows.push(LogRow {
                        time_s: s.time_s,
                        observed: Some(Vec2::new(r(s.observed.x, 1e4), r(s.observed.y, 1e4))),
                        readings: s.readings.map(|x| r(x, 10.0)),
                        command: s.command.map(|x| r(x, 1e5)),
                    });
                },
            )
            .unwrap();
            rows
        })
        .collect()
}

fn main() -> Result<()> {
    let args: Vec<String> = std::env::args().collect();
    let course = Course::from_toml(include_str!("../../../worlds/roduit2007/world.toml"))?;
    let circuit = Arc::new(Circuit::new(course, 100)?);
    let kind = args[1].as_str();
    let controller = if kind.starts_with('b') {
        Controller::Braitenberg {
            speed_m_s: 0.05,
            gain_per_count: 0.0005,
        }
    } else {
        Controller::RuleBased {
            speed_m_s: 0.05,
            threshold_counts: 500.0,
        }
    };
    let model = declared(controller);
    let scene = Scene::new(circuit, &model, None)?;
    let runs = if args[2] == "sim" {
        let mut m = model.clone();
        if args.len() > 4 {
            m.effects.push(Setting::constant(
                find(&args[4])?,
                args[5..].iter().map(|x| x.parse().unwrap()).collect::<Vec<f64>>(),
            ));
        }
        drive_rows(&scene, &m, args[3].parse()?, 5)
    } else {
        ["a", "b", "c", "d"]
            .iter()
            .map(|r| read(&std::path::Path::new(&args[2]).join(format!("run_{r}.csv.gz"))))
            .collect::<Result<_>>()?
    };
    let t = std::time::Instant::now();
    let refs: Vec<&[LogRow]> = runs.iter().map(Vec::as_slice).collect();
    let d = diagnose::diagnose_logs(&model, &scene, &refs)?;
    println!(
        "took {:?} {:?} p {:.2e} corners {:?} rem {:.4} {:.2e}",
        t.elapsed(),
        d.verdict,
        d.p,
        d.corners,
        d.remainder_share,
        d.remainder_p
    );
    println!("decide {:?}", d.decide);
    println!("unlisted {:?}", d.unlisted);
    for e in d.explanations.iter().take(6) {
        let text: Vec<String> = e
            .effects
            .iter()
            .map(|c| {
                format!(
                    "{} {:?} +- {:?}",
                    c.setting.spec.name, c.setting.pattern, c.standard_errors
                )
            })
            .collect();
        println!("{:10.1}  {}", e.score(), text.join(" & "));
    }
    for c in d.channels {
        print!("{:.2}/{:.2}/{:.3} ", c.mean_square, c.kurtosis, c.correlation);
    }
    println!();
    Ok(())
}
