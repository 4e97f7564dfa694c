//! Ray casting: eight rays that start close together against walls that do not move.
//!
//! All casters of ours use one intersection ([`crossing`]) and therefore agree bit for bit.

mod bvh;
#[cfg(test)]
mod cases;
mod cells;
mod grid;
#[cfg(test)]
mod tests;
mod tree;

use track::Vec2;

pub(crate) use cells::Cells;

use crate::{Pose, Walls};

/// Rays that are cast together: one for each sensor.
pub const LANES: usize = 8;

/// Eight rays with unit directions, coordinate by coordinate so that they fill the processor's lanes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rays {
    /// Origins, m.
    pub origin_x: [f64; LANES],
    /// Origins, m.
    pub origin_y: [f64; LANES],
    /// Unit directions.
    pub direction_x: [f64; LANES],
    /// Unit directions.
    pub direction_y: [f64; LANES],
}

impl Rays {
    /// Eight rays from origins (m) and unit directions.
    pub fn new(rays: [(Vec2, Vec2); LANES]) -> Self {
        Self {
            origin_x: rays.map(|(origin, _)| origin.x),
            origin_y: rays.map(|(origin, _)| origin.y),
            direction_x: rays.map(|(_, direction)| direction.x),
            direction_y: rays.map(|(_, direction)| direction.y),
        }
    }

    /// Rays of the body frame in the world of a robot at that pose.
    #[inline(always)]
    pub fn placed(&self, pose: Pose) -> Self {
        let Pose { position, heading } = pose;
        let mut placed = *self;
        for i in 0..LANES {
            let (x, y) = (self.origin_x[i], self.origin_y[i]);
            placed.origin_x[i] = position.x + (heading.x * x - heading.y * y);
            placed.origin_y[i] = position.y + (heading.y * x + heading.x * y);
            let (x, y) = (self.direction_x[i], self.direction_y[i]);
            placed.direction_x[i] = heading.x * x - heading.y * y;
            placed.direction_y[i] = heading.y * x + heading.x * y;
        }
        placed
    }

    /// Origin of ray `i`, m.
    pub fn origin(&self, i: usize) -> Vec2 {
        Vec2::new(self.origin_x[i], self.origin_y[i])
    }

    /// Puts ray `from` of others in place `i`.
    pub(crate) fn set(&mut self, i: usize, others: &Self, from: usize) {
        self.origin_x[i] = others.origin_x[from];
        self.origin_y[i] = others.origin_y[from];
        self.direction_x[i] = others.direction_x[from];
        self.direction_y[i] = others.direction_y[from];
    }

    /// Unit direction of ray `i`.
    pub fn direction(&self, i: usize) -> Vec2 {
        Vec2::new(self.direction_x[i], self.direction_y[i])
    }
}

/// What eight rays hit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hits {
    /// Distance along each ray to the nearest wall, m; infinite where there is none within the range.
    pub distance_m: [f64; LANES],
    /// The segment hit; meaningless where the distance is infinite.
    pub segment: [u32; LANES],
}

impl Hits {
    /// No wall anywhere.
    pub const NONE: Self = Self {
        distance_m: [f64::INFINITY; LANES],
        segment: [0; LANES],
    };

    /// Whether no ray met a wall.
    #[inline]
    pub(crate) fn is_none(&self) -> bool {
        self.distance_m
            .iter()
            .all(|&distance_m| distance_m == f64::INFINITY)
    }

    /// The same without what is beyond a range.
    #[inline(always)]
    fn within(self, range_m: f64) -> Self {
        let limited = |distance_m: f64| {
            if distance_m <= range_m {
                distance_m
            } else {
                f64::INFINITY
            }
        };
        Self {
            distance_m: self.distance_m.map(limited),
            ..self
        }
    }
}

/// Side and advance of a vertex as seen from a ray: the cross and the dot product of the ray's direction with the
/// way from its origin to the vertex. Two neighbouring segments compute the same bits for the vertex they share, so no
/// ray slips through a joint.
#[inline(always)]
fn sight(origin: (f64, f64), direction: (f64, f64), vertex: (f64, f64)) -> (f64, f64) {
    let (x, y) = (vertex.0 - origin.0, vertex.1 - origin.1);
    (
        direction.0 * y - direction.1 * x,
        direction.0 * x + direction.1 * y,
    )
}

/// Distance along a ray to the segment between two vertices seen at `(side, advance)`, or infinity.
///
/// The ray crosses the segment's line where the side changes sign; the distance is interpolated between the two
/// advances. A vertex exactly on the ray counts as on its left, as if the ray were shifted to the right by less than
/// any number: a chain that only touches the ray from the left is not hit, and neither is a segment that lies along
/// it, but the joint where the chain goes on to the right.
#[inline(always)]
fn crossing(from: (f64, f64), to: (f64, f64)) -> f64 {
    let distance = from.1 + (to.1 - from.1) * (from.0 / (from.0 - to.0));
    if ((from.0 >= 0.0) != (to.0 >= 0.0)) & (distance >= 0.0) {
        distance
    } else {
        f64::INFINITY
    }
}

/// Distance along the ray to the segment, m, or infinity: the one intersection that all casters of ours share.
///
/// ```
/// use sim::{Vec2, segment_distance_m};
/// let hit = segment_distance_m(Vec2::ZERO, Vec2::X, Vec2::new(0.1, -1.0), Vec2::new(0.1, 1.0));
/// assert_eq!(hit, 0.1);
/// ```
#[inline]
pub fn segment_distance_m(origin: Vec2, direction: Vec2, a: Vec2, b: Vec2) -> f64 {
    let (origin, direction) = ((origin.x, origin.y), (direction.x, direction.y));
    crossing(
        sight(origin, direction, (a.x, a.y)),
        sight(origin, direction, (b.x, b.y)),
    )
}

/// The ways to cast rays.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum CasterKind {
    /// A plain loop over all segments for each ray.
    Brute,
    /// The bounding volume hierarchy of parry2d.
    Bvh,
    /// For each cell of a coarse grid the runs of segments in the robot's reach, against eight rays at once.
    Cells,
    /// For each cell of a coarse grid the stretches of wall in the robot's reach, and below each a tree of eights.
    Tree,
}

impl CasterKind {
    /// All kinds with the names a user gives them.
    pub const NAMED: [(&'static str, Self); 4] = [
        ("brute", Self::Brute),
        ("bvh", Self::Bvh),
        ("cells", Self::Cells),
        ("tree", Self::Tree),
    ];

    /// The quicker of our casters for these walls: by benches/ray_cast.rs the tree wins as soon as segments are on
    /// average shorter than a sixth of the range.
    fn for_walls(walls: &Walls, range_m: f64) -> Self {
        const LONG_SEGMENT: f64 = 0.16;
        let length_m: f64 = walls.segments().map(|(_, a, b)| a.distance(b)).sum();
        if length_m < LONG_SEGMENT * range_m * walls.len() as f64 {
            Self::Tree
        } else {
            Self::Cells
        }
    }

    /// The name a user gives this kind.
    pub fn name(self) -> &'static str {
        Self::NAMED
            .iter()
            .find(|(_, kind)| *kind == self)
            .map_or("", |(name, _)| name)
    }
}

/// Walls prepared for one way of casting rays.
#[derive(Debug, Clone)]
pub struct Caster {
    method: Method,
    range_m: f64,
}

#[derive(Debug, Clone)]
enum Method {
    Brute,
    Bvh(Box<bvh::Bvh>),
    Cells(Cells),
    Tree(tree::Tree),
}

impl Caster {
    /// The caster for walls whose vertices moved by no more than what the caster's `spread_m` has to spare; `None` where
    /// it must be made anew.
    pub(crate) fn over(&self, walls: &Walls) -> Option<Self> {
        let method = match &self.method {
            Method::Brute => Method::Brute,
            Method::Bvh(_) => Method::Bvh(Box::new(bvh::Bvh::new(walls))),
            Method::Cells(cells) => Method::Cells(cells.clone()),
            Method::Tree(tree) => Method::Tree(tree.over(walls)?),
        };
        Some(Self {
            method,
            range_m: self.range_m,
        })
    }

    /// Prepares the walls for rays of at most `range_m` that start within `spread_m` of the robot's centre; `None`
    /// chooses the kind by the walls.
    pub fn new(kind: Option<CasterKind>, walls: &Walls, range_m: f64, spread_m: f64) -> Self {
        Self::about_disc(kind, walls, range_m, range_m + spread_m)
    }

    /// The same for rays that stay within a disc of `disc_m` about a point.
    pub(crate) fn about_disc(kind: Option<CasterKind>, walls: &Walls, range_m: f64, disc_m: f64) -> Self {
        let kind = kind.unwrap_or_else(|| CasterKind::for_walls(walls, range_m));
        let method = match kind {
            CasterKind::Brute => Method::Brute,
            CasterKind::Bvh => Method::Bvh(Box::new(bvh::Bvh::new(walls))),
            CasterKind::Cells => Method::Cells(Cells::new(walls, disc_m)),
            CasterKind::Tree => Method::Tree(tree::Tree::new(walls, disc_m)),
        };
        Self { method, range_m }
    }

    /// Which way of casting this is.
    pub fn kind(&self) -> CasterKind {
        match self.method {
            Method::Brute => CasterKind::Brute,
            Method::Bvh(_) => CasterKind::Bvh,
            Method::Cells(_) => CasterKind::Cells,
            Method::Tree(_) => CasterKind::Tree,
        }
    }

    /// What the rays hit within the range. `center` is the robot's centre, or that of the disc, `walls` those the caster was made for.
    #[inline]
    pub fn cast(&self, walls: &Walls, center: Vec2, rays: &Rays) -> Hits {
        // Each for itself: hits that are cut to the range after all ways have come together go through memory once more.
        match &self.method {
            Method::Brute => brute(walls, rays).within(self.range_m),
            Method::Bvh(bvh) => bvh.cast(rays, self.range_m).within(self.range_m),
            Method::Cells(cells) => cells.cast(walls, center, rays).within(self.range_m),
            Method::Tree(tree) => tree.cast(center, rays, self.range_m).within(self.range_m),
        }
    }
}

/// The plain loop: every ray against every segment.
fn brute(walls: &Walls, rays: &Rays) -> Hits {
    let mut hits = Hits::NONE;
    for i in 0..LANES {
        let (origin, direction) = (rays.origin(i), rays.direction(i));
        for (segment, a, b) in walls.segments() {
            let distance = segment_distance_m(origin, direction, a, b);
            if distance < hits.distance_m[i] {
                hits.distance_m[i] = distance;
                hits.segment[i] = segment as u32;
            }
        }
    }
    hits
}
