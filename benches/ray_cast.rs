//! Eight rays against 15 to 100 000 segments, by every caster, at the poses of a driven lap and at random ones; and
//! what it costs to make a caster.

mod ground;

use std::hint::black_box;

use criterion::{Criterion, Throughput};
use ground::{circuit, driven, random, walls};
use sim::{Caster, CasterKind, LANES, Rays, Vec2, Walls, max_error_for};

/// Segments of both walls together; the first four are the paper's maximal errors of 50, 10, 5 and 1 mm.
const SEGMENTS: [usize; 7] = [15, 33, 47, 105, 1000, 10_000, 100_000];

/// Range of the sensors and distance of their places from the robot's centre, m.
const REACH_M: (f64, f64) = (0.1, 0.0336);

fn main() {
    let mut criterion = Criterion::default().configure_from_args();
    let circuit = circuit();
    let poses = [("driven", driven(&circuit)), ("random", random(&circuit))];
    for segments in SEGMENTS {
        let max_error_m =
            max_error_for(&circuit.course, segments).expect("the shipped circuit can be cut that fine");
        let walls = walls(&circuit, max_error_m);
        for (_, looks) in &poses {
            assert_agreement(&walls, looks);
        }
        for (name, kind) in CasterKind::NAMED {
            let caster = Caster::new(Some(kind), &walls, REACH_M.0, REACH_M.1);
            for (place, looks) in &poses {
                cast(
                    &mut criterion,
                    &format!("ray_cast/{place}/{name}"),
                    &caster,
                    &walls,
                    looks,
                );
            }
            let make = || Caster::new(Some(kind), black_box(&walls), REACH_M.0, REACH_M.1);
            criterion.bench_function(&format!("make_caster/{name}/{}", walls.len()), |bencher| {
                bencher.iter(make)
            });
        }
    }
    criterion.final_summary();
}

/// One pass over all poses; the report's time per element is that of one reading of eight rays.
fn cast(criterion: &mut Criterion, name: &str, caster: &Caster, walls: &Walls, looks: &[(Vec2, Rays)]) {
    // A pass of the plain loop over the finest walls would take seconds.
    let looks = if caster.kind() == CasterKind::Brute {
        &looks[..looks.len().min(4_000_000 / walls.len())]
    } else {
        looks
    };
    let mut group = criterion.benchmark_group(name);
    group.throughput(Throughput::Elements(looks.len() as u64));
    group.bench_function(walls.len().to_string(), |bencher| {
        bencher.iter(|| {
            for (center, rays) in looks {
                black_box(caster.cast(walls, *center, rays));
            }
        });
    });
}

/// Ours give the same bits; parry2d's agrees to 1e-9 m where no ray grazes.
fn assert_agreement(walls: &Walls, looks: &[(Vec2, Rays)]) {
    let casters = CasterKind::NAMED.map(|(_, kind)| Caster::new(Some(kind), walls, REACH_M.0, REACH_M.1));
    for (center, rays) in looks.iter().step_by(walls.len().div_ceil(2000)) {
        let hits = casters
            .each_ref()
            .map(|caster| (caster.kind(), caster.cast(walls, *center, rays)));
        let (_, reference) = hits[0];
        for (kind, other) in &hits[1..] {
            for i in 0..LANES {
                let (a, b) = (reference.distance_m[i], other.distance_m[i]);
                let grazes = a.is_finite()
                    && walls
                        .normal(reference.segment[i] as usize)
                        .dot(rays.direction(i))
                        .abs()
                        < 0.02;
                let same = a == b || (*kind == CasterKind::Bvh && (grazes || (a - b).abs() < 1e-9));
                assert!(same, "{kind:?}: {b} m for {a} m, ray {i} of {rays:?}");
            }
        }
    }
}
