//! What eight rays met, for effects on what walls send back.

use track::Side;

use super::{Hit, Site};
use crate::cast::{Hits, LANES, Rays};
use crate::{Scene, Walls};

/// What eight rays, one of each sensor or all of one, met: each thing is computed where it is asked for.
#[derive(Debug, Clone, Copy)]
pub struct RayHits<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) walls: &'a Walls,
    pub(crate) rays: &'a Rays,
    pub(crate) hits: &'a Hits,
    /// The sensor that all rays are of; `None` where each is of the sensor of its number.
    pub(crate) of_one: Option<usize>,
}

impl RayHits<'_> {
    /// The same where all rays are of one sensor.
    pub(crate) fn of_sensor(self, sensor: usize) -> Self {
        Self {
            of_one: Some(sensor),
            ..self
        }
    }

    /// The rays that met a wall.
    pub fn lanes(&self) -> impl Iterator<Item = usize> + '_ {
        (0..LANES).filter(|&lane| self.hits.distance_m[lane] < f64::INFINITY)
    }

    /// Cosine of the angle between each ray and the wall's normal, in [0, 1]; anything of a ray that met none.
    #[inline]
    pub fn cos_incidence(&self) -> [f64; LANES] {
        let (normal_x, normal_y) = self.walls.normals(self.hits.segment);
        let Rays {
            direction_x,
            direction_y,
            ..
        } = self.rays;
        let mut cos = [0.0; LANES];
        for i in 0..LANES {
            let towards = (normal_x[i] * direction_x[i] + normal_y[i] * direction_y[i]).abs();
            cos[i] = if towards < 1.0 { towards } else { 1.0 };
        }
        cos
    }

    /// Which wall a ray met.
    #[inline]
    pub fn side(&self, lane: usize) -> Side {
        self.walls.side(self.hits.segment[lane] as usize)
    }

    /// The place on a wall that a ray met.
    #[inline]
    pub fn site(&self, lane: usize) -> Site {
        let Self {
            scene,
            walls,
            rays,
            hits,
            ..
        } = self;
        let point = rays.origin(lane) + rays.direction(lane) * hits.distance_m[lane];
        scene.site(walls.place(hits.segment[lane] as usize, point))
    }

    /// Where a ray met a wall.
    #[inline]
    pub fn hit(&self, lane: usize) -> Hit {
        self.hit_with_direction(lane).0
    }

    /// The same with the ray's direction along the wall's normal.
    #[inline]
    pub(crate) fn hit_with_direction(&self, lane: usize) -> (Hit, f64) {
        let normal = self.walls.normal(self.hits.segment[lane] as usize);
        let towards = normal.dot(self.rays.direction(lane));
        let hit = Hit {
            sensor: self.of_one.unwrap_or(lane),
            distance_m: self.hits.distance_m[lane],
            cos_incidence: towards.abs().min(1.0),
            site: self.site(lane),
        };
        (hit, towards)
    }
}
