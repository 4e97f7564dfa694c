//! A coarse grid whose cells list stretches of wall, and below each stretch a tree of eights.

use std::sync::Arc;

use track::Vec2;
use wide::f64x8;

use super::grid::{Neighbours, Strip};
use super::{Hits, LANES, Rays};
use crate::Walls;
use crate::walls::nearest_on_segment;

/// Stretches of 8, 64, 512, ... neighbouring segments, each known by the chord between its ends and by how far its
/// vertices stray from that chord. A ray that misses the chord by more than that misses the whole stretch.
///
/// Eight rays at once are held against the chords near the robot; a ray that may meet one goes down its tree alone,
/// against eight smaller stretches at once and at last against eight segments.
#[derive(Debug, Clone)]
pub(super) struct Tree {
    near: Arc<Neighbours>,
    stretches: Stretches,
}

/// All stretches.
#[derive(Debug, Clone)]
struct Stretches {
    /// Ends of the stretches at the top, as in [`Walls`]: stretch `i` from vertex `i` to vertex `i + 1`.
    x_m: Vec<f64>,
    y_m: Vec<f64>,
    slack_m: Vec<f64>,
    /// The top node below each stretch.
    top: Vec<u32>,
    /// The nodes, leaves first.
    levels: Vec<Vec<Node>>,
}

/// Eight neighbouring stretches, or, in a leaf, segments.
#[derive(Debug, Clone)]
struct Node {
    /// Their ends, m; an incomplete node repeats its last.
    x_m: [f64; LANES + 1],
    y_m: [f64; LANES + 1],
    /// How far the vertices within each stretch lie from its chord, m.
    slack_m: [f64; LANES],
    /// The first segment or node below.
    first: u32,
}

/// Far more than the rounding of a distance, m.
const MARGIN_M: f64 = 1e-9;

/// The length of the chords at the top, m, is between this and an eighth of it: measured by benches/ray_cast.rs.
const TOP_CHORD_M: f64 = 0.08;

/// Eight rays, one a lane, or one ray in all lanes.
#[derive(Debug, Clone, Copy)]
struct Lanes {
    origin: (f64x8, f64x8),
    direction: (f64x8, f64x8),
}

/// One ray: in all lanes, and by itself.
#[derive(Debug, Clone, Copy)]
struct Ray {
    lanes: Lanes,
    origin: (f64, f64),
    direction: (f64, f64),
}

/// Where the list of an outline's stretches ends.
const NONE: u32 = u32::MAX;

/// Stretches whose eight bits each fit in one word.
const CHUNK: usize = 8;

impl Tree {
    /// The tree over the walls for rays that stay within `disc_m` of the robot's centre.
    pub(super) fn new(walls: &Walls, disc_m: f64) -> Self {
        let stretches = Stretches::new(walls);
        let strips: Vec<Strip> = stretches.strips().collect();
        Self {
            near: Arc::new(Neighbours::new(walls.bounds_m(), disc_m, &strips)),
            stretches,
        }
    }

    /// The tree with the same lists over walls whose vertices moved a little; `None` where other stretches suit them.
    pub(super) fn over(&self, walls: &Walls) -> Option<Self> {
        let stretches = Stretches::new(walls);
        (stretches.top == self.stretches.top).then(|| Self {
            near: Arc::clone(&self.near),
            stretches,
        })
    }

    /// Eight rays at once against the stretches near the robot's centre.
    #[inline]
    pub(super) fn cast(&self, center: Vec2, rays: &Rays, range_m: f64) -> Hits {
        let mut nearest = [(f64::INFINITY, 0); LANES];
        let top_level = self.stretches.levels.len() - 1;
        let all = Lanes::all(rays);
        for &(first, last) in self.near.runs(center) {
            let mut first = first as usize;
            while first < last as usize {
                let end = (first + CHUNK).min(last as usize);
                let mut found = self.stretches.found(&all, first, end, range_m);
                while found != 0 {
                    let bit = found.trailing_zeros() as usize;
                    found &= found - 1;
                    let (stretch, lane) = (first + bit / LANES, bit % LANES);
                    let ray = Ray::one(rays, lane);
                    self.stretches.descend(
                        &ray,
                        top_level,
                        self.stretches.top[stretch] as usize,
                        range_m,
                        &mut nearest[lane],
                    );
                }
                first = end;
            }
        }
        Hits {
            distance_m: nearest.map(|n| n.0),
            segment: nearest.map(|n| n.1),
        }
    }
}

impl Stretches {
    fn new(walls: &Walls) -> Self {
        let length_m: f64 = walls.segments().map(|(_, a, b)| a.distance(b)).sum();
        let mean_m = length_m / walls.len().max(1) as f64;
        let depth = (1..8)
            .take_while(|&d| mean_m * 8_f64.powi(d) <= TOP_CHORD_M)
            .count()
            .max(1);
        let levels = vec![vec![]; depth];
        let mut stretches = Self {
            x_m: vec![],
            y_m: vec![],
            slack_m: vec![],
            top: vec![],
            levels,
        };
        for outline in walls.outlines() {
            stretches.push(walls, outline);
        }
        stretches
    }

    /// The stretches at the top, as the grid wants them.
    fn strips(&self) -> impl Iterator<Item = Strip> + '_ {
        let vertex = |i: usize| Vec2::new(self.x_m[i], self.y_m[i]);
        (0..self.top.len())
            .filter(|&i| self.top[i] != NONE)
            .map(move |i| Strip {
                number: i,
                from: vertex(i),
                to: vertex(i + 1),
                slack_m: self.slack_m[i],
            })
    }

    /// Adds the closed outline of the given vertices, the last of which is the first again.
    fn push(&mut self, walls: &Walls, outline: std::ops::Range<usize>) {
        let last = outline.end - 1;
        let vertex = |i: usize| (outline.start + i).min(last);
        let count = outline.len() - 1;
        let mut span = 1; // segments in a child
        let mut below = outline.start; // first segment or node of the level below
        for level in &mut self.levels {
            let first = level.len();
            for node in 0..count.div_ceil(8 * span) {
                let end = |j: usize| vertex((8 * node + j) * span);
                level.push(Node {
                    x_m: std::array::from_fn(|j| walls.vertex(end(j)).x),
                    y_m: std::array::from_fn(|j| walls.vertex(end(j)).y),
                    slack_m: std::array::from_fn(|j| slack_m(walls, end(j), end(j + 1))),
                    first: (below + 8 * node) as u32,
                });
            }
            below = first;
            span *= 8;
        }
        let tops = count.div_ceil(span);
        for i in 0..=tops {
            let (from, to) = (vertex(i * span), vertex((i + 1) * span));
            self.x_m.push(walls.vertex(from).x);
            self.y_m.push(walls.vertex(from).y);
            self.slack_m.push(slack_m(walls, from, to));
            self.top.push(if i < tops { (below + i) as u32 } else { NONE });
        }
    }

    /// The stretches from `first` to before `end` that eight rays may meet, as eight bits for each stretch.
    #[inline(always)]
    fn found(&self, all: &Lanes, first: usize, end: usize, range_m: f64) -> u64 {
        let (xs, ys) = (&self.x_m[first..=end], &self.y_m[first..=end]);
        let slacks = &self.slack_m[first..end];
        let limit = f64x8::splat(range_m);
        let mut found = 0;
        let mut from = all.sight(f64x8::splat(xs[0]), f64x8::splat(ys[0]));
        for (i, ((&x, &y), &slack)) in xs[1..].iter().zip(&ys[1..]).zip(slacks).enumerate() {
            let to = all.sight(f64x8::splat(x), f64x8::splat(y));
            found |= u64::from(may_cross(from, to, f64x8::splat(slack), limit)) << (LANES * i);
            from = to;
        }
        found
    }

    #[inline]
    fn descend(&self, ray: &Ray, level: usize, node: usize, range_m: f64, nearest: &mut (f64, u32)) {
        let node = &self.levels[level][node];
        if level == 0 {
            node.hit(ray, nearest);
            return;
        }
        let mut children = node.may_cross(ray, range_m.min(nearest.0));
        while children != 0 {
            let child = children.trailing_zeros() as usize;
            children &= children - 1;
            self.descend(ray, level - 1, node.first as usize + child, range_m, nearest);
        }
    }
}

impl Node {
    /// The stretches that the ray may meet, as bits.
    #[inline]
    fn may_cross(&self, ray: &Ray, limit_m: f64) -> u32 {
        let (from, to) = self.sights(ray);
        may_cross(from, to, f64x8::from(self.slack_m), f64x8::splat(limit_m))
    }

    /// The nearest of the eight segments, if it is nearer than what is known.
    #[inline]
    fn hit(&self, ray: &Ray, nearest: &mut (f64, u32)) {
        let ((from, _), (to, _)) = self.sights(ray);
        let mut crossed = from.simd_ge(f64x8::ZERO).to_bitmask() ^ to.simd_ge(f64x8::ZERO).to_bitmask();
        while crossed != 0 {
            let i = crossed.trailing_zeros() as usize & 7;
            crossed &= crossed - 1;
            let sight = |i: usize| super::sight(ray.origin, ray.direction, (self.x_m[i], self.y_m[i]));
            let distance = super::crossing(sight(i), sight(i + 1));
            if distance < nearest.0 {
                *nearest = (distance, self.first + i as u32);
            }
        }
    }

    /// Where the stretches begin and end.
    #[inline(always)]
    fn sights(&self, ray: &Ray) -> (Sight, Sight) {
        let lanes = |values: &[f64; LANES + 1], i: usize| -> f64x8 {
            f64x8::from(<[f64; LANES]>::try_from(&values[i..i + LANES]).expect("eight of nine"))
        };
        let sight = |i: usize| ray.lanes.sight(lanes(&self.x_m, i), lanes(&self.y_m, i));
        (sight(0), sight(1))
    }
}

/// Sides and advances of eight vertices or of one vertex from eight rays.
type Sight = (f64x8, f64x8);

impl Ray {
    /// Number `i` of eight rays.
    #[inline(always)]
    fn one(rays: &Rays, i: usize) -> Self {
        let origin = (rays.origin_x[i], rays.origin_y[i]);
        let direction = (rays.direction_x[i], rays.direction_y[i]);
        let splat = |(x, y)| (f64x8::splat(x), f64x8::splat(y));
        Self {
            lanes: Lanes {
                origin: splat(origin),
                direction: splat(direction),
            },
            origin,
            direction,
        }
    }
}

impl Lanes {
    /// Eight rays, one a lane.
    #[inline(always)]
    fn all(rays: &Rays) -> Self {
        Self {
            origin: (f64x8::from(rays.origin_x), f64x8::from(rays.origin_y)),
            direction: (f64x8::from(rays.direction_x), f64x8::from(rays.direction_y)),
        }
    }

    /// [`super::sight`] in every lane.
    #[inline(always)]
    fn sight(&self, x: f64x8, y: f64x8) -> Sight {
        let (x, y) = (x - self.origin.0, y - self.origin.1);
        (
            self.direction.0 * y - self.direction.1 * x,
            self.direction.0 * x + self.direction.1 * y,
        )
    }
}

/// Lanes, as bits, in which a ray may meet something within `slack` of a chord at no more than `limit`.
#[inline(always)]
fn may_cross(from: Sight, to: Sight, slack: f64x8, limit: f64x8) -> u32 {
    let sides = (from.0.fast_min(to.0), from.0.fast_max(to.0));
    let advances = (from.1.fast_min(to.1), from.1.fast_max(to.1));
    let beside = sides.0.simd_le(slack) & sides.1.simd_ge(-slack);
    let ahead = advances.1.simd_ge(-slack) & (advances.0 - slack).simd_le(limit);
    (beside & ahead).to_bitmask()
}

/// How far the vertices from one to another lie from the chord between them, m, and a little more.
fn slack_m(walls: &Walls, from: usize, to: usize) -> f64 {
    let (a, b) = (walls.vertex(from), walls.vertex(to));
    (from..to)
        .map(|i| nearest_on_segment(a, b, walls.vertex(i)).distance(walls.vertex(i)))
        .fold(0.0, f64::max)
        + MARGIN_M
}
