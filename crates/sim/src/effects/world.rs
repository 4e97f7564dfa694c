//! Effects on the place of the walls.

use track::Side;

use super::{Effect, Hook, Param, Site, Spec, Stage};

/// One of the two walls.
pub(super) const WALLS: Param = Param::choice("wall", &["outer", "inner"]);

/// Whether a value of [`WALLS`] names this wall.
pub(super) fn is_wall(value: f64, side: Side) -> bool {
    (value < 0.5) == (side == Side::Outer)
}

/// A Gaussian bell of height 1.
pub(super) fn gaussian(distance_m: f64, deviation_m: f64) -> f64 {
    (-0.5 * (distance_m / deviation_m).powi(2)).exp()
}

/// The outer wall moved along its normal.
pub(super) const OUTER_WALL_OFFSET: Spec = Spec {
    name: "outer-wall-offset",
    stage: Stage::World,
    summary: "the outer wall moved along its normal; positive widens the corridor",
    params: &[Param::new("distance_m", "m", 0.0, -0.05, 0.05)],
    list: None,
    build: || Box::new(WallOffset(Side::Outer)),
};

/// The inner wall moved along its normal.
pub(super) const INNER_WALL_OFFSET: Spec = Spec {
    name: "inner-wall-offset",
    stage: Stage::World,
    summary: "the inner wall moved along its normal; positive widens the corridor",
    params: &[Param::new("distance_m", "m", 0.0, -0.05, 0.05)],
    list: None,
    build: || Box::new(WallOffset(Side::Inner)),
};

#[derive(Debug)]
struct WallOffset(Side);

impl Effect for WallOffset {
    fn hooks(&self) -> &'static [Hook] {
        &[]
    }
    fn displacement_m(&self, values: &[f64], at: &Site) -> f64 {
        if at.place.side == self.0 {
            at.outward * values[0]
        } else {
            0.0
        }
    }
}

/// A dent or a bulge of a wall, Gaussian in arc length.
pub(super) const WALL_BUMP: Spec = Spec {
    name: "wall-bump",
    stage: Stage::World,
    summary: "a wall displaced about one place, Gaussian in arc length; positive to the left of the driving direction",
    params: &[
        WALLS,
        Param::place("position", "fraction of the wall", 0.0, 1.0),
        Param::new("height_m", "m", 0.0, -0.05, 0.05),
        Param::place("length_m", "m", 0.005, 2.0),
    ],
    list: None,
    build: || Box::new(WallBump),
};

/// A bump reaches this many standard deviations to either side.
const REACH: f64 = 3.0;

#[derive(Debug)]
struct WallBump;

impl Effect for WallBump {
    fn hooks(&self) -> &'static [Hook] {
        &[]
    }
    fn displacement_m(&self, values: &[f64], at: &Site) -> f64 {
        let [wall, position, height_m, length_m] = [0, 1, 2, 3].map(|i| values[i]);
        if is_wall(wall, at.place.side) {
            height_m * gaussian(at.arc_m(position), length_m)
        } else {
            0.0
        }
    }

    fn divides(&self, values: &[f64], from: &Site, to: &Site) -> bool {
        let [wall, position, _, length_m] = [0, 1, 2, 3].map(|i| values[i]);
        if !is_wall(wall, from.place.side) {
            return false;
        }
        let ahead = |from: f64, to: f64| (to - from).rem_euclid(1.0);
        let start = from.place.fraction;
        let inside = ahead(start, position) <= ahead(start, to.place.fraction);
        inside || from.arc_m(position).min(to.arc_m(position)) <= REACH * length_m
    }
}
