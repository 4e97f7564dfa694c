use proptest::prelude::*;
use track::{Side, Vec2};

use super::super::testing::{active, declared, scene, silent, steps, with};
use super::super::{Active, Hit, RayHits, Site};
use crate::{Caster, LANES, Machine, Model, Pose, Rays, Readings, WallPlace, segment_distance_m};

fn altered(name: &str, values: &[f64]) -> Machine {
    let (active, mut machine) = (active(name, values), declared().machine);
    active.effect.on_machine().unwrap()(&active.values, &mut machine);
    machine
}

/// Distance (m) and segment that a ray of the body frame meets on the declared walls, by looking at all of them.
fn meets(pose: Pose, origin: Vec2, angle_rad: f64) -> (f64, usize) {
    let (origin, direction) = (
        pose.to_world(origin),
        pose.rotate(Vec2::new(angle_rad.cos(), angle_rad.sin())),
    );
    let distance = |(i, a, b)| (segment_distance_m(origin, direction, a, b), i);
    scene()
        .walls()
        .segments()
        .map(distance)
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .unwrap()
}

/// The readings of a silent robot at some starts, beside what `expect` makes of pose, sensor, distance and segment.
fn compare(name: &str, values: &[f64], turn_rad: f64, expect: impl Fn(Pose, usize, f64, usize) -> f64) {
    let machine = silent().machine;
    let (mut seen, model): (usize, Model) = (0, with(&silent(), name, values));
    for seed in 0..40 {
        let (pose, step) = steps(&model, 0, seed, 1)[0];
        for (sensor, mount) in machine.mounts.iter().enumerate() {
            let (distance_m, segment) = meets(pose, mount.position, mount.angle_rad + turn_rad);
            let expected = expect(pose, sensor, distance_m, segment).min(machine.full_scale_counts);
            seen += usize::from(expected > 0.0);
            let reading = step.readings[sensor];
            assert!(
                (reading - expected).abs() < 1e-8 * (1.0 + expected),
                "{name} S{sensor}: {reading} against {expected}"
            );
        }
    }
    assert!(seen > 25, "{name}: {seen} readings above zero");
}

fn response(distance_m: f64) -> f64 {
    if distance_m <= 0.1 {
        declared().machine.response.reading(distance_m)
    } else {
        0.0
    }
}

#[test]
fn scale_of_distance_reach_and_rotation_of_a_run() {
    let scaled = |d: f64| {
        if d <= 0.1 {
            declared().machine.response.reading(1.3 * d)
        } else {
            0.0
        }
    };
    compare("distance-scale", &[1.3], 0.0, |_, _, d, _| scaled(d));
    compare("sensor-reach", &[0.6], 0.0, |_, _, d, _| {
        if d <= 0.06 { response(d) } else { 0.0 }
    });
    compare("sensor-reach", &[1.5], 0.0, |_, _, d, _| {
        if d <= 0.15 {
            declared().machine.response.reading(d)
        } else {
            0.0
        }
    });
    compare("sensor-rotation", &[0.4], 0.4, |_, _, d, _| response(d));
}

#[test]
fn exponent_times_its_scale() {
    let reading = altered("response-exponent", &[1.2]).response.reading(0.03);
    let expected = 4202.93 / (1.0 + (0.03_f64 / 0.005_219_53).powf(1.2 * 1.572_816_92));
    assert!(
        (reading / expected - 1.0).abs() < 1e-12,
        "{reading} against {expected}"
    );
}

#[test]
fn incidence_and_reflectance_of_a_run() {
    let walls = scene().walls();
    compare("incidence-falloff", &[2.0], 0.0, |pose, sensor, d, segment| {
        let angle = declared().machine.mounts[sensor].angle_rad;
        let cos = pose
            .rotate(Vec2::new(angle.cos(), angle.sin()))
            .dot(walls.normal(segment));
        cos * cos * response(d)
    });
    let of = |side: Side, factor: f64| {
        move |_: Pose, _: usize, d: f64, segment: usize| {
            let hit = walls.place(segment, walls.vertex(segment)).side;
            response(d) * if hit == side { factor } else { 1.0 }
        }
    };
    compare("outer-wall-reflectance", &[0.4], 0.0, of(Side::Outer, 0.4));
    compare("inner-wall-reflectance", &[0.4], 0.0, of(Side::Inner, 0.4));
}

#[test]
fn factors_of_eight_rays_are_those_of_each() {
    let (walls, machine) = (scene().walls(), silent().machine);
    let caster = Caster::new(None, walls, 0.1, 0.05);
    let mut met = 0;
    for (name, values) in [
        ("incidence-falloff", &[0.0][..]),
        ("incidence-falloff", &[0.7]),
        ("outer-wall-reflectance", &[0.4]),
        ("inner-wall-reflectance", &[1.3]),
        ("reflectance-patch", &[0.0, 0.3, 0.2, 1.3]),
        ("reflectance-patch", &[1.0, 0.8, 0.2, 0.0]),
    ] {
        let Active { effect, values, .. } = active(name, values);
        for seed in 0..20 {
            let pose = steps(&silent(), 0, seed, 1)[0].0;
            let rays = Rays::new(machine.mounts.map(|mount| (mount.position, mount.axis()))).placed(pose);
            let hits = caster.cast(walls, pose.position, &rays);
            let hits = RayHits {
                scene: scene(),
                walls,
                rays: &rays,
                hits: &hits,
                of_one: None,
            };
            let mut factors = [2.0; LANES];
            effect.ray_factors(&values, &hits, &mut factors);
            for lane in hits.lanes() {
                met += 1;
                assert_eq!(
                    factors[lane],
                    2.0 * effect.ray_factor(&values, &hits.hit(lane)),
                    "{name}"
                );
            }
        }
    }
    assert!(met > 100, "{met} walls met");
}

#[test]
fn without_falloff_a_wall_seen_edge_on_sends_back_as_much() {
    let Active { effect, values, .. } = active("incidence-falloff", &[0.0]);
    let hit = Hit {
        sensor: 0,
        distance_m: 0.05,
        cos_incidence: 0.0,
        site: site(Side::Outer, 0.5),
    };
    assert_eq!(effect.ray_factor(&values, &hit), 1.0);
}

/// A flat wall straight ahead at d: the ray at angle a sees d / cos a. The mean over the cone by a fine sum.
#[test]
fn cone_over_a_flat_wall() {
    let response = |distance_m: f64| declared().machine.response.reading(distance_m);
    for half_angle_rad in [0.05, 0.15, 0.5, 0.8] {
        let seen: f64 = altered("cone-of-view", &[half_angle_rad])
            .beam
            .rays()
            .iter()
            .map(|(direction, weight)| weight * response(0.04 / direction.x))
            .sum();
        let count = 100_000;
        let share = |i: i32| (2.0 * f64::from(i) + 1.0) / f64::from(count) - 1.0;
        let weight = |i: i32| (std::f64::consts::FRAC_PI_2 * share(i)).cos();
        let term = |i: i32| weight(i) * response(0.04 / (half_angle_rad * share(i)).cos());
        let integral = (0..count).map(term).sum::<f64>() / (0..count).map(weight).sum::<f64>();
        assert!(
            (seen / integral - 1.0).abs() < 4e-3,
            "{half_angle_rad}: {seen} against {integral}"
        );
        assert!(seen < response(0.04), "a slanted ray is longer");
    }
}

#[test]
fn cone_of_a_run_is_the_mean_over_its_rays() {
    let rays = altered("cone-of-view", &[0.3]).beam;
    let mounts = declared().machine.mounts;
    compare("cone-of-view", &[0.3], 0.0, |pose, sensor, _, _| {
        let ray = |(direction, weight): &(Vec2, f64)| {
            let angle_rad = mounts[sensor].angle_rad + direction.y.atan2(direction.x);
            weight * response(meets(pose, mounts[sensor].position, angle_rad).0)
        };
        rays.rays().iter().map(ray).sum()
    });
    assert!(rays.rays().len() >= 7);
}

fn site(side: Side, fraction: f64) -> Site {
    Site {
        place: WallPlace { side, fraction },
        wall_length_m: 4.0,
        outward: 1.0,
    }
}

fn patch(values: &[f64], side: Side, fraction: f64) -> f64 {
    let active = active("reflectance-patch", values);
    active.effect.ray_factor(
        &active.values,
        &Hit {
            sensor: 0,
            distance_m: 0.05,
            cos_incidence: 1.0,
            site: site(side, fraction),
        },
    )
}

/// To the last bit: beyond nine deviations the bell is less than half of what tells a number from 1.
#[test]
fn a_patch_ends_where_it_is_nothing() {
    const LENGTH_M: f64 = 0.02;
    for (i, factor) in (0..400).flat_map(|i| [(i, 0.0), (i, 10.0)]) {
        let fraction = 0.3 + 1e-3 * f64::from(i);
        let deviations = site(Side::Outer, fraction).arc_m(0.3) / LENGTH_M;
        let bell = 1.0 + (factor - 1.0) * (-0.5 * deviations.powi(2)).exp();
        assert_eq!(
            patch(&[0.0, 0.3, LENGTH_M, factor], Side::Outer, fraction),
            bell,
            "{deviations}"
        );
    }
}

#[test]
fn patch_is_a_gaussian_in_arc_length() {
    let values = [1.0, 0.99, 0.2, 3.0]; // on the inner wall, 4 cm before its first joint, 20 cm wide
    let bell = |distance_m: f64| 1.0 + 2.0 * (-0.5 * (distance_m / 0.2_f64).powi(2)).exp();
    for (fraction, distance_m) in [(0.99, 0.0), (0.94, 0.2), (0.04, 0.2), (0.0, 0.04), (0.49, 2.0)] {
        let factor = patch(&values, Side::Inner, fraction);
        assert!((factor - bell(distance_m)).abs() < 1e-12, "{fraction}: {factor}");
        assert_eq!(patch(&values, Side::Outer, fraction), 1.0);
    }
}

/// With the mean of distances for readings, a wall of half the reflectance still halves them.
#[test]
fn reflectance_acts_on_the_mean_of_distances_too() {
    let mut model = silent();
    model.machine.beam = crate::Beam::cone(5, 0.1, crate::Combine::Distances).unwrap();
    let dark = with(
        &with(&model, "outer-wall-reflectance", &[0.5]),
        "inner-wall-reflectance",
        &[0.5],
    );
    for seed in 0..20 {
        let of = |model: &Model| -> Readings { steps(model, 0, seed, 1)[0].1.readings };
        for (half, whole) in of(&dark).iter().zip(of(&model)) {
            // Rays of the beam that see no wall have nothing to lose.
            assert!(
                *half >= 0.5 * whole - 1e-9 && (*half < whole || whole == 0.0),
                "{half} of {whole}"
            );
        }
    }
}

proptest! {
    #[test]
    fn patch_lies_between_nothing_and_its_factor(fraction in 0.0..1.0, position in 0.0..1.0, factor in 0.0..10.0) {
        let here = patch(&[0.0, position, 0.1, factor], Side::Outer, fraction);
        prop_assert!((factor.min(1.0)..=factor.max(1.0)).contains(&here), "{}", here);
    }
}
