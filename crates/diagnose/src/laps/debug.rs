//! Scratch.
use super::atlas::*;
use super::tests_of_fit::FourNumbers;
pub fn null_report(atlas: &Atlas) {
    let mut sums = [[0.0; 2]; 4];
    let mut best = vec![];
    for s in &atlas.samples {
        let x = atlas.white(s, &atlas.null);
        let f = FourNumbers::new(&x, &atlas.laps);
        for (k, q) in [f.mean, f.runs, f.trend, f.noise].iter().enumerate() {
            sums[k][0] += q.excess() / 200.0;
            sums[k][1] += q.excess().powi(2) / 200.0;
        }
        best.push(atlas.best_score(&x));
    }
    best.sort_by(f64::total_cmp);
    println!(
        "null: excess {:?}",
        sums.map(|s| format!("{:.1} sd {:.1}", s[0], s[1].sqrt()))
    );
    println!(
        "null best score: median {:.2} 90% {:.2} 98% {:.2} max {:.2}",
        best[100], best[180], best[196], best[199]
    );
}
pub fn report(atlas: &Atlas, simulate: &Simulate<'_>, runs: &[Vec<track::Lap>]) {
    let d = atlas.diagnose(simulate, runs).unwrap();
    let four = |f: &FourNumbers| {
        format!(
            "{:?}",
            [f.mean, f.runs, f.trend, f.noise].map(|q| format!("{:.0} p{:.0e}", q.excess(), q.p))
        )
    };
    println!("   {:?} {}", d.verdict, four(&d.residual));
    for (i, e) in d.explanations.iter().enumerate() {
        println!(
            "   {} {:9.1} share {:.4} {:50} {:?} +- {:?} left {}",
            if i < d.indistinguishable { "*" } else { " " },
            e.score,
            e.share,
            e.label,
            e.effects.iter().map(|c| &c.setting.pattern).collect::<Vec<_>>(),
            e.effects
                .iter()
                .map(|c| c.standard_errors.iter().map(|x| *x as f32).collect::<Vec<_>>())
                .collect::<Vec<_>>(),
            four(&e.remainder)
        );
    }
}
