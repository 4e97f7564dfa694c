//! What a model lacks, from the robot's own log.

mod catalogue;
mod columns;
mod evidence;
mod filter;
mod moments;
mod refine;
mod rows;
mod screen;

use std::sync::Arc;

use rayon::prelude::*;
use sim::{Model, Scene};
use track::Side;

pub use rows::LogRow;

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
