//! parry2d's bounding volume hierarchy, for comparison.

use parry2d::query::Ray;
use parry2d::shape::{CompositeShapeRef, Polyline};
use track::Vec2;

use super::{Hits, LANES, Rays};
use crate::Walls;

#[derive(Debug, Clone)]
pub(super) struct Bvh {
    polyline: Polyline,
    /// Our number of each of its segments.
    numbers: Vec<u32>,
}

impl Bvh {
    pub(super) fn new(walls: &Walls) -> Self {
        let count = walls.coordinates_m().0.len();
        let vertices: Vec<Vec2> = (0..count).map(|i| walls.vertex(i)).collect();
        let numbers: Vec<u32> = walls.segments().map(|(i, ..)| i as u32).collect();
        let indices = numbers.iter().map(|&i| [i, i + 1]).collect();
        Self {
            polyline: Polyline::new(vertices, Some(indices)),
            numbers,
        }
    }

    pub(super) fn cast(&self, rays: &Rays, range_m: f64) -> Hits {
        let mut hits = Hits::NONE;
        // It leaves out walls at exactly the range, which the caller wants; those beyond, the caller leaves out.
        let beyond_m = range_m * (1.0 + 1e-12);
        for i in 0..LANES {
            let ray = Ray::new(rays.origin(i), rays.direction(i));
            if let Some((segment, distance_m)) =
                CompositeShapeRef(&self.polyline).cast_local_ray(&ray, beyond_m, false)
            {
                hits.distance_m[i] = distance_m;
                hits.segment[i] = self.numbers[segment as usize];
            }
        }
        hits
    }
}
