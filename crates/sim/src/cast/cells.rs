//! A coarse grid whose cells list the runs of segments within a disc.

use std::sync::Arc;

use track::Vec2;

use super::grid::{Neighbours, Strip};
use super::{Hits, LANES, Rays, crossing, sight};
use crate::Walls;
use crate::walls::nearest_on_segment;

/// A grid over the walls' neighbourhood; each cell lists, as runs of neighbours, all segments within `disc_m` of any
/// point of the cell.
#[derive(Debug, Clone)]
pub(crate) struct Cells {
    near: Arc<Neighbours>,
}

impl Cells {
    pub(crate) fn new(walls: &Walls, disc_m: f64) -> Self {
        let strip = |(number, from, to)| Strip {
            number,
            from,
            to,
            slack_m: 0.0,
        };
        let strips: Vec<Strip> = walls.segments().map(strip).collect();
        Self {
            near: Arc::new(Neighbours::new(walls.bounds_m(), disc_m, &strips)),
        }
    }

    /// Eight rays at once against each vertex and segment near the robot's centre.
    #[inline]
    pub(super) fn cast(&self, walls: &Walls, center: Vec2, rays: &Rays) -> Hits {
        let (x_m, y_m) = walls.coordinates_m();
        let mut nearest = [f64::INFINITY; LANES];
        let mut number = [0.0; LANES];
        for &(first, last) in self.near.runs(center) {
            let (first, last) = (first as usize, last as usize);
            let (xs, ys) = (&x_m[first..=last], &y_m[first..=last]);
            let (mut side, mut advance) = sight_all(rays, xs[0], ys[0]);
            for (i, (&x, &y)) in xs[1..].iter().zip(&ys[1..]).enumerate() {
                let (next_side, next_advance) = sight_all(rays, x, y);
                let segment = (first + i) as f64;
                for lane in 0..LANES {
                    let from = (side[lane], advance[lane]);
                    let distance = crossing(from, (next_side[lane], next_advance[lane]));
                    let nearer = distance < nearest[lane];
                    nearest[lane] = if nearer { distance } else { nearest[lane] };
                    number[lane] = if nearer { segment } else { number[lane] };
                }
                (side, advance) = (next_side, next_advance);
            }
        }
        // A whole number below 2^32 plus 2^52 stands in the lowest bits: no conversion, all lanes at once.
        Hits {
            distance_m: nearest,
            segment: number.map(|n| (n + 4_503_599_627_370_496.0).to_bits() as u32),
        }
    }

    /// The nearest point of a wall if it is closer than `radius_m`, which is at most the disc the cells are made for.
    #[inline]
    pub(crate) fn nearest_within(&self, walls: &Walls, p: Vec2, radius_m: f64) -> Option<Vec2> {
        let mut best = (radius_m * radius_m, None);
        for &(first, last) in self.near.runs(p) {
            for segment in first as usize..last as usize {
                let point = nearest_on_segment(walls.vertex(segment), walls.vertex(segment + 1), p);
                let distance2 = point.distance_squared(p);
                if distance2 < best.0 {
                    best = (distance2, Some(point));
                }
            }
        }
        best.1
    }
}

/// [`sight`] of one vertex from all rays.
#[inline(always)]
fn sight_all(rays: &Rays, x: f64, y: f64) -> ([f64; LANES], [f64; LANES]) {
    let (mut side, mut advance) = ([0.0; LANES], [0.0; LANES]);
    for lane in 0..LANES {
        (side[lane], advance[lane]) = sight(
            (rays.origin_x[lane], rays.origin_y[lane]),
            (rays.direction_x[lane], rays.direction_y[lane]),
            (x, y),
        );
    }
    (side, advance)
}
