//! What several tests share.

use crate::{Course, Direction, Spline, Vec2, Wall};
use proptest::prelude::*;

/// The shipped circuit as text.
pub(crate) const CIRCUIT: &str = include_str!("../../../worlds/roduit2007/world.toml");

/// The shipped circuit.
pub(crate) fn circuit() -> Course {
    Course::from_toml(CIRCUIT).unwrap()
}

/// Control points of one spline, smooth joints included, on which `ring_through` stands.
const STEPS: usize = 5;

/// A closed clockwise wall of splines with six control points each, near the points that `at` gives for the turns
/// 0, 1, ... of `STEPS * splines`.
pub(crate) fn ring_through(name: &str, splines: usize, at: impl Fn(usize) -> Vec2) -> Wall {
    let count = STEPS * splines;
    let q = |index: usize| at(index % count);
    let spline = |first: usize| {
        let (joint, next) = (first * STEPS, (first + 1) * STEPS);
        let slope = |index: usize| (q(index + 1) - q(index + count - 1)) / 2.0;
        let points = [
            q(joint),
            q(joint) + slope(joint),
            q(joint + 2),
            q(joint + 3),
            q(next) - slope(next),
            q(next),
        ];
        Spline::new(points.to_vec()).unwrap()
    };
    Wall::new(name, (0..splines).map(spline).collect()).unwrap()
}

/// A point of an ellipse about (1, 1), clockwise, `turn` in [0, 1).
pub(crate) fn on_ellipse(radii_m: [f64; 2], turn: f64) -> Vec2 {
    let angle = -std::f64::consts::TAU * turn;
    Vec2::new(1.0 + radii_m[0] * angle.cos(), 1.0 + radii_m[1] * angle.sin())
}

/// Closed smooth walls: ellipses whose points are moved in and out by up to a tenth.
pub(crate) fn ring() -> impl Strategy<Value = Wall> {
    let bumps = prop::collection::vec(0.9..1.1_f64, 6 * STEPS);
    ([0.2..0.8_f64, 0.2..0.8_f64], 3..=6_usize, bumps).prop_map(|(radii_m, splines, bumps)| {
        ring_through("random", splines, |index| {
            let turn = index as f64 / (STEPS * splines) as f64;
            on_ellipse(radii_m.map(|radius_m| radius_m * bumps[index]), turn)
        })
    })
}

/// Corridors between two such walls, 0.15 m wide with 1 cm of unevenness.
pub(crate) fn corridor() -> impl Strategy<Value = Course> {
    let bumps = || prop::collection::vec(-0.005..0.005_f64, 4 * STEPS);
    ([0.4..0.8_f64, 0.4..0.8_f64], bumps(), bumps()).prop_map(|(radii_m, outer, inner)| {
        let wall = |name: &str, inset_m: f64, bumps: &[f64]| {
            ring_through(name, 4, |index| {
                let turn = index as f64 / (STEPS * 4) as f64;
                on_ellipse(radii_m.map(|radius_m| radius_m - inset_m + bumps[index]), turn)
            })
        };
        let (outer, inner) = (wall("outer", 0.0, &outer), wall("inner", 0.15, &inner));
        Course::new("random", [2.0, 2.0], Direction::Clockwise, outer, inner).unwrap()
    })
}
