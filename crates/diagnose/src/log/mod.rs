//! What a model lacks, from the robot's own log.

mod catalogue;
mod columns;
mod evidence;
mod filter;
mod moments;
mod noise;
mod refine;
mod rows;
mod screen;
mod search;

use std::sync::Arc;

use rayon::prelude::*;
use sim::{Model, Scene};
use track::Side;

pub use rows::LogRow;

/// debug
pub fn debug_search(model: &Model, scene: &Scene, runs: &[Vec<LogRow>]) -> Vec<(String, f64)> {
    let t = std::time::Instant::now();
    let wide = {
        let mut m = model.clone();
        m.machine.range_m *= 1.2;
        Scene::new(Arc::new(scene.circuit().clone()), &m, None).unwrap()
    };
    let refs: Vec<&[LogRow]> = runs.iter().map(|r| r.as_slice()).collect();
    let ev = evidence::Evidence::new(&wide, model, &refs).unwrap();
    let traces = ev.traces(&[]).unwrap();
    eprintln!("base {:?}", t.elapsed());
    if std::env::var("ERRSCAN").is_ok() {
        let l0: f64 = traces.iter().map(|t| t.1.log_likelihood).sum();
        let text = std::fs::read_to_string(std::env::var("ERRSCAN").unwrap()).unwrap();
        for line in text.lines() {
            let mut it = line.split(';');
            let label = it.next().unwrap();
            let chain = |t: &str, side: Side| {
                let wall = scene.circuit().course.wall(side);
                let vertices = t.split(' ').map(|p| {
                    let (x, y) = p.split_once(',').unwrap();
                    let position = sim::Vec2::new(x.parse().unwrap(), y.parse().unwrap());
                    let fraction = (0..20000).map(|i| f64::from(i) / 20000.0).min_by(|a, b| wall.point(*a).distance(position).total_cmp(&wall.point(*b).distance(position))).unwrap();
                    track::Vertex { position, left_normal: wall.left_normal(fraction), fraction }
                }).collect();
                track::Chain { vertices }
            };
            let o = chain(it.next().unwrap(), Side::Outer);
            let i = chain(it.next().unwrap(), Side::Inner);
            let mut m = model.clone();
            m.machine.range_m *= 1.2;
            let sc = wide.recut(&m, o, i);
            let ev2 = evidence::Evidence { scene: &sc, model, stretches: ev.of_run(0).stretches.into_iter().chain(ev.of_run(1).stretches).chain(ev.of_run(2).stretches).chain(ev.of_run(3).stretches).collect() };
            let l: f64 = ev2.traces(&[]).unwrap().iter().map(|t| t.1.log_likelihood).sum();
            eprintln!("{label}: {:.1} segs {}", l - l0, sc.walls().len());
        }
        return vec![];
    }
    let base: Vec<f64> = traces.iter().map(|t| t.1.log_likelihood).collect();
    let lengths = [Side::Outer, Side::Inner].map(|s| scene.circuit().course.wall(s).length_m());
    let variants = catalogue::variants(lengths);
    let normals = screen::normals(&traces, &variants).unwrap();
    eprintln!("columns {} {:?}", variants.len(), t.elapsed());
    let leads = search::leads(&ev, &variants, &normals);
    let list = search::shortlist(&leads, &variants, 8);
    for l in &list {
        eprintln!("lead {:9.1} {:?} {} {:?}", l.score(), l.by, variants[l.variant].spec.name, variants[l.variant].values);
    }
    let mut out: Vec<_> = list.iter().filter_map(|l| search::pursue(&ev, &variants[l.variant], l, &base)).collect();
    eprintln!("refined {:?}", t.elapsed());
    out.extend(noise::noises(&ev, &[], base.iter().sum()));
    eprintln!("noise {:?}", t.elapsed());
    out.sort_by(|a, b| b.score().total_cmp(&a.score()));
    out.iter().map(|r| (format!("{} {:?} {:?}", r.settings[0].spec.name, r.settings[0].pattern, r.standard_errors), r.score())).collect()
}

/// debug
pub fn debug_screen(model: &Model, scene: &Scene, runs: &[Vec<LogRow>]) -> Vec<(String, f64, Vec<f64>)> {
    let t = std::time::Instant::now();
    let wide = {
        let mut m = model.clone();
        m.machine.range_m *= 1.2;
        Scene::new(Arc::new(scene.circuit().clone()), &m, None).unwrap()
    };
    eprintln!("scene {:?}", t.elapsed());
    let traces: Vec<_> = runs
        .par_iter()
        .enumerate()
        .map(|(r, rows)| {
            let rows = rows::stretches(rows, &model.run)[0];
            let world = wide.world(model, r).unwrap();
            let first = filter::filter(&world, rows, None).unwrap();
            let used = filter::clear_readings(&world, &first, rows);
            let trace = filter::filter(&world, rows, Some(&used)).unwrap();
            (world, trace)
        })
        .collect();
    if std::env::var("DUMP").is_ok() {
        for (_, t) in &traces {
            for i in &t.instants {
                for m in 2..10 {
                    if i.used >> m & 1 == 1 && i.innovation[m].abs() > 4.5 {
                        println!("D {} {} {:.4} {:.4} {:.3} d {:.4} sd {:.5} exp {:.1} e {:.1}", m - 2, i.time_s, i.sensed_from.position.x, i.sensed_from.position.y, i.sensed_from.heading_rad(), i.look.distance_m[m-2], i.look.deviation_m[m-2], i.uncut[m-2], i.innovation[m]);
                    }
                }
            }
        }
    }
    eprintln!("base {:?}", t.elapsed());
    for m in 0..10 {
        let e: Vec<f64> =
            traces.iter().flat_map(|t| t.1.instants.iter()).filter(|i| i.used >> m & 1 == 1).map(|i| i.innovation[m]).collect();
        let n = e.len() as f64;
        let mean = e.iter().sum::<f64>() / n;
        let v = e.iter().map(|x| x * x).sum::<f64>() / n;
        let k = e.iter().map(|x| x.powi(4)).sum::<f64>() / n / v / v;
        let ac = e.windows(2).map(|w| w[0] * w[1]).sum::<f64>() / n;
        eprintln!("{m}: n {n} mean {:.4} (z {:.1}) var {v:.4} (z {:.1}) kurt {k:.2} ac {:.4}", mean, mean * n.sqrt(), (v - 1.0) * (n / 2.0).sqrt(), ac);
    }
    let i = &traces[0].1.instants[3000];
    eprintln!("sd {:?}", (i.covariance[0][0].sqrt(), i.covariance[1][1].sqrt(), i.covariance[2][2].sqrt()));
    let lengths = [Side::Outer, Side::Inner].map(|s| scene.circuit().course.wall(s).length_m());
    let variants = catalogue::variants(lengths);
    let normals = screen::normals(&traces, &variants).unwrap();
    eprintln!("columns {} {:?}", variants.len(), t.elapsed());
    variants
        .iter()
        .zip(&normals)
        .map(|(v, n)| {
            let right = n.iter().map(|n| n.right.clone()).sum::<nalgebra::DVector<f64>>();
            let left = n.iter().map(|n| n.left.clone()).sum::<nalgebra::DMatrix<f64>>();
            let s = screen::solve(&left, &right);
            (format!("{} {:?}", v.spec.name, v.values), s.gain, v.values_at(s.multiples.as_slice()))
        })
        .collect()
}
