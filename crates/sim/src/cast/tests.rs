use proptest::prelude::*;
use track::{Course, Vec2};

use super::cases::{RANGE_M, SPREAD_M, Uniform};
use super::{Caster, CasterKind, LANES, Rays, segment_distance_m};
use crate::effects::testing::{declared, scene};
use crate::{Hits, Run, Scene, Step, Streams, Walls};

const OURS: [CasterKind; 3] = [CasterKind::Brute, CasterKind::Cells, CasterKind::Tree];

fn caster(kind: CasterKind, walls: &Walls) -> Caster {
    Caster::new(Some(kind), walls, RANGE_M, SPREAD_M)
}

/// Whether both hits are the same bits; the segments may differ where both give that distance.
fn agree(walls: &Walls, rays: &Rays, a: &Hits, b: &Hits) -> bool {
    (0..LANES).all(|i| {
        let distance = |hits: &Hits| {
            let segment = hits.segment[i] as usize;
            segment_distance_m(
                rays.origin(i),
                rays.direction(i),
                walls.vertex(segment),
                walls.vertex(segment + 1),
            )
        };
        a.distance_m[i].to_bits() == b.distance_m[i].to_bits()
            && (a.distance_m[i].is_infinite() || distance(a).to_bits() == distance(b).to_bits())
    })
}

/// Whether a hit is plain: at more than a degree, off the segment's ends, within the range.
fn is_plain(walls: &Walls, rays: &Rays, hits: &Hits, i: usize) -> bool {
    if hits.distance_m[i].is_infinite() {
        return true;
    }
    let segment = hits.segment[i] as usize;
    let point = rays.origin(i) + rays.direction(i) * hits.distance_m[i];
    let off_ends = point
        .distance(walls.vertex(segment))
        .min(point.distance(walls.vertex(segment + 1)))
        > 1e-9;
    let steep = walls.normal(segment).dot(rays.direction(i)).abs() > 0.0175;
    off_ends && steep && (RANGE_M - hits.distance_m[i]).abs() > 1e-9 && hits.distance_m[i] > 1e-9
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, ..ProptestConfig::default() })]

    #[test]
    fn casters_agree(seed in any::<u64>()) {
        let mut stream = Streams { seed, run: 0 }.open("rays");
        let mut cases = Uniform(move || 0.5 + 0.5 * stream.symmetric());
        let outlines = cases.outlines();
        let walls = Walls::from_outlines(&outlines);
        let casters = OURS.map(|kind| caster(kind, &walls));
        let bvh = caster(CasterKind::Bvh, &walls);
        for _ in 0..60 {
            let (center, rays) = cases.pose(&outlines);
            let rays = Rays::new(rays);
            let reference = casters[0].cast(&walls, center, &rays);
            for other in &casters[1..] {
                let hits = other.cast(&walls, center, &rays);
                prop_assert!(agree(&walls, &rays, &reference, &hits), "{:?}: {hits:?} for {reference:?}, {rays:?}", other.kind());
            }
            let theirs = bvh.cast(&walls, center, &rays);
            for i in 0..LANES {
                let plain = is_plain(&walls, &rays, &reference, i) && is_plain(&walls, &rays, &theirs, i);
                let (ours, theirs) = (reference.distance_m[i], theirs.distance_m[i]);
                prop_assert!(!plain || ours == theirs || (ours - theirs).abs() <= 1e-9, "{ours} {theirs}");
            }
        }
    }
}

#[test]
fn a_wall_at_exactly_the_range_is_seen_and_one_beyond_is_not() {
    let x = RANGE_M;
    let square = vec![
        Vec2::new(x, -1.0),
        Vec2::new(x + 1.0, -1.0),
        Vec2::new(x + 1.0, 1.0),
        Vec2::new(x, 1.0),
    ];
    let walls = Walls::from_outlines(&[square]);
    for kind in CasterKind::NAMED.map(|(_, kind)| kind) {
        for (origin, expected) in [(0.0, x), (-f64::EPSILON, f64::INFINITY), (0.5 * x, 0.5 * x)] {
            let rays = Rays::new([(Vec2::new(origin, 0.25), Vec2::X); LANES]);
            let hits = caster(kind, &walls).cast(&walls, Vec2::new(origin, 0.25), &rays);
            assert_eq!(hits.distance_m, [expected; LANES], "{kind:?} from {origin}");
        }
    }
}

#[test]
fn rays_do_not_slip_through_joints_nor_see_a_segment_end_on() {
    let square = vec![
        Vec2::new(0.0, 0.0),
        Vec2::new(0.1, 0.0),
        Vec2::new(0.1, 0.1),
        Vec2::new(0.0, 0.1),
    ];
    let walls = Walls::from_outlines(&[square]);
    let inside = Vec2::new(0.05, 0.05);
    let corner = (Vec2::new(0.1, 0.1) - inside).normalize();
    for kind in OURS {
        let cast = |origin, direction| {
            caster(kind, &walls)
                .cast(&walls, inside, &Rays::new([(origin, direction); LANES]))
                .distance_m[0]
        };
        assert!(
            (cast(inside, corner) - 0.005_f64.sqrt()).abs() < 1e-15,
            "{kind:?}"
        );
        // Along a side, from its middle: seen is the corner where the chain turns to the right.
        assert!(
            (cast(Vec2::new(0.05, 0.1), Vec2::X) - 0.05).abs() < 1e-15,
            "{kind:?}"
        );
        assert_eq!(
            cast(Vec2::new(0.05, 0.0), Vec2::X),
            f64::INFINITY,
            "{kind:?} touches it from the left"
        );
    }
}

#[test]
fn nothing_is_seen_where_there_is_nothing() {
    for walls in [
        Walls::default(),
        Walls::from_outlines(&[vec![Vec2::splat(9.0), Vec2::splat(9.5), Vec2::X * 9.0]]),
    ] {
        for kind in CasterKind::NAMED.map(|(_, kind)| kind) {
            let rays = Rays::new([(Vec2::ZERO, Vec2::X); LANES]);
            assert_eq!(
                caster(kind, &walls).cast(&walls, Vec2::ZERO, &rays).distance_m,
                [f64::INFINITY; LANES],
                "{kind:?}"
            );
        }
    }
}

#[test]
fn the_caster_is_chosen_by_the_walls() {
    let course = Course::from_toml(include_str!("../../../../worlds/roduit2007/world.toml")).unwrap();
    for (max_error_m, expected) in [
        (0.05, CasterKind::Cells),
        (0.001, CasterKind::Cells),
        (1e-5, CasterKind::Tree),
    ] {
        let chains = (
            course.outer.flatten(max_error_m).unwrap(),
            course.inner.flatten(max_error_m).unwrap(),
        );
        let walls = Walls::new(&chains.0, &chains.1, 0.0);
        assert_eq!(
            Caster::new(None, &walls, 0.1, 0.035).kind(),
            expected,
            "{} segments",
            walls.len()
        );
    }
}

#[test]
fn a_drive_does_not_depend_on_the_caster() {
    let circuit = std::sync::Arc::new(scene().circuit().clone());
    for (max_error_m, thickness_m) in [(0.05, 0.0), (0.005, 0.0), (0.005, 0.01), (2e-5, 0.0)] {
        let mut model = declared();
        (model.wall.max_error_m, model.wall.thickness_m) = (max_error_m, thickness_m);
        let drive = |kind| -> Vec<Step> {
            let scene = Scene::new(circuit.clone(), &model, kind).unwrap();
            let world = scene.world(&model, 0).unwrap();
            let mut run = Run::new(&world, Streams { seed: 5, run: 0 }).unwrap();
            (0..600).map(|_| run.step()).collect()
        };
        let chosen = drive(None);
        for kind in OURS {
            assert_eq!(drive(Some(kind)), chosen, "{kind:?}, {max_error_m} m");
        }
    }
}
