//! Sensors of many rays: eight neighbouring rays of one sensor at a time, among the few walls near them.

use track::Vec2;

use crate::cast::{Caster, CasterKind, Hits, LANES, Rays};
use crate::world::Geometry;
use crate::{Machine, Mount, Pose, Walls};

/// The rays of all sensors, pack by pack.
#[derive(Debug)]
pub(crate) struct Cones {
    packs: Vec<Pack>,
    /// For discs as large as the largest one about a pack.
    caster: Caster,
    /// How many of each sensor's rays are in packs: the first ones.
    sights: usize,
}

/// Up to eight neighbouring rays of one sensor; an incomplete pack repeats its last with no weight.
#[derive(Debug)]
pub(crate) struct Pack {
    pub(crate) sensor: usize,
    /// Number of the first among the sensor's rays.
    first: usize,
    pub(crate) weights: [f64; LANES],
    /// In the body frame.
    rays: Rays,
    /// The middle of a disc about the rays, in the body frame, and its radius, m.
    middle: Vec2,
    radius_m: f64,
}

impl Cones {
    /// Those of a machine among walls, as far as its rays go there; `None` if its sensors have few rays each.
    pub(crate) fn new(machine: &Machine, geometry: &Geometry, kind: Option<CasterKind>) -> Option<Self> {
        /// Rays of a sensor fewer than which are quicker one by one, on all sensors together (benches/step.rs).
        const FEW: usize = 5;
        let Geometry { walls, range_m, .. } = geometry;
        let (rays, range_m) = (machine.beam.rays(), *range_m);
        let left = rays.len() % LANES;
        let sights = if left < FEW { rays.len() - left } else { rays.len() };
        if sights == 0 {
            return None;
        }
        let of_sensor = |sensor: usize| {
            let packs = rays[..sights].chunks(LANES).enumerate();
            packs.map(move |(i, rays)| Pack::new((sensor, i * LANES), machine.mounts[sensor], rays, range_m))
        };
        let packs: Vec<Pack> = (0..LANES).flat_map(of_sensor).collect();
        let radius_m = packs.iter().map(|pack| pack.radius_m).fold(0.0, f64::max);
        Some(Self {
            caster: Caster::about_disc(kind, walls, range_m, radius_m),
            packs,
            sights,
        })
    }

    /// How many of each sensor's rays are in packs: the first ones.
    pub(crate) fn sights(&self) -> usize {
        self.sights
    }

    /// Calls `found` with every pack, its rays and what they hit; those of a sensor in the order of its rays.
    #[inline]
    pub(crate) fn cast(&self, walls: &Walls, pose: Pose, mut found: impl FnMut(&Pack, &Rays, &Hits)) {
        for pack in &self.packs {
            let middle = pose.position + pose.heading.rotate(pack.middle);
            let rays = pack.rays.placed(pose);
            found(pack, &rays, &self.caster.cast(walls, middle, &rays));
        }
    }
}

impl Pack {
    /// Where in the pack the sensor's ray of a number is, if it is.
    pub(crate) fn place_of(&self, number: usize) -> Option<usize> {
        number.checked_sub(self.first).filter(|place| *place < LANES)
    }

    fn new((sensor, number): (usize, usize), mount: Mount, rays: &[(Vec2, f64)], range_m: f64) -> Self {
        /// Far more than the rounding of a place, m.
        const MARGIN_M: f64 = 1e-9;
        let axis = mount.axis();
        let (first, last) = (rays[0].0, rays[rays.len() - 1].0);
        let along = (first + last).try_normalize().unwrap_or(first);
        let (ahead_m, radius_m) = disc(along.dot(first).clamp(0.0, 1.0), range_m);
        let ray = |i: usize| (mount.position, axis.rotate(rays[i.min(rays.len() - 1)].0));
        Self {
            sensor,
            first: number,
            weights: std::array::from_fn(|i| rays.get(i).map_or(0.0, |ray| ray.1)),
            rays: Rays::new(std::array::from_fn(ray)),
            middle: mount.position + axis.rotate(along) * ahead_m,
            radius_m: radius_m + MARGIN_M,
        }
    }
}

/// The smallest disc about a sector of at most a right angle to either side, by the cosine of that angle: how far ahead of its corner
/// the middle is, and the radius, m.
fn disc(cos: f64, radius_m: f64) -> (f64, f64) {
    if cos > std::f64::consts::FRAC_1_SQRT_2 {
        let about_corners_m = 0.5 * radius_m / cos;
        (about_corners_m, about_corners_m)
    } else {
        (radius_m * cos, radius_m * (1.0 - cos * cos).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::{declared, scene};
    use crate::{Beam, Combine, Run, Scene, Streams, WallRules};

    #[test]
    fn the_disc_holds_the_sector() {
        for degrees in 0..=90 {
            let half = f64::from(degrees).to_radians();
            let (ahead, radius) = disc(half.cos(), 0.1);
            for i in -20..=20 {
                let angle = half * f64::from(i) / 20.0;
                for end in [0.0, 0.05, 0.1] {
                    let point = Vec2::new(angle.cos(), angle.sin()) * end;
                    let distance = point.distance(Vec2::new(ahead, 0.0));
                    assert!(
                        distance < radius + 1e-12,
                        "{degrees} degrees: {distance} > {radius}"
                    );
                }
            }
        }
        assert_eq!(disc(1.0, 0.1), (0.05, 0.05));
        let (ahead, radius) = disc(0.5, 0.1);
        assert!((ahead - 0.05).abs() < 1e-15 && (radius - 0.1 * 0.75_f64.sqrt()).abs() < 1e-15);
    }

    #[test]
    fn few_rays_make_no_cones_and_a_few_more_than_a_pack_stay_sights() {
        let sights = |rays: usize| {
            let mut model = declared();
            model.machine.beam = Beam::cone(rays, 0.3, Combine::Responses).unwrap();
            let world = scene().world(&model, 0).unwrap();
            world.cones.map_or(0, |cones| cones.sights())
        };
        assert_eq!([1, 4, 5, 8, 10, 13, 16].map(sights), [0, 0, 5, 8, 8, 13, 16]);
    }

    #[test]
    fn readings_are_those_of_rays_one_by_one() {
        const STEPS: usize = 400;
        for (max_error_m, combine) in [(0.005, Combine::Responses), (1e-6, Combine::Distances)] {
            for (rays, half_angle_rad) in [(5, 0.02), (7, 0.3), (10, 1.0), (16, 1.57), (21, 0.6)] {
                let mut model = declared();
                model.wall = WallRules {
                    max_error_m,
                    ..model.wall
                };
                model.machine.beam = Beam::cone(rays, half_angle_rad, combine).unwrap();
                let scene = Scene::new(scene().circuit().clone().into(), &model, None).unwrap();
                let world = scene.world(&model, 0).unwrap();
                assert!(world.cones.is_some());
                let streams = Streams { seed: 3, run: 0 };
                let (mut by_sensors, mut by_rays) = (
                    Run::new(&world, streams).unwrap(),
                    Run::new(&world, streams).unwrap(),
                );
                by_rays.cast_ray_by_ray();
                for _ in 0..STEPS {
                    assert_eq!(
                        by_sensors.step(),
                        by_rays.step(),
                        "{rays} rays to {half_angle_rad}"
                    );
                }
            }
        }
    }
}
