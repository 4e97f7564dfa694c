//! A coarse grid whose cells list the runs of segments within a disc.

use track::Vec2;

use super::{Hits, LANES, Rays, crossing, sight};
use crate::Walls;
use crate::walls::nearest_on_segment;

/// A grid over the walls' neighbourhood; each cell lists, as runs of neighbouring vertices, all segments within
/// `disc_m` of any point of the cell.
#[derive(Debug, Clone)]
pub(crate) struct Cells {
    grid: Grid,
    /// Where the runs of each cell begin, and a last end.
    starts: Vec<u32>,
    /// First and last vertex of each run.
    runs: Vec<(u32, u32)>,
}

/// The geometry of a uniform grid.
#[derive(Debug, Clone, Copy)]
pub(super) struct Grid {
    pub(super) low: Vec2,
    pub(super) cell_m: f64,
    pub(super) per_m: f64,
    pub(super) columns: usize,
    pub(super) rows: usize,
}

impl Grid {
    /// Covers the box from `low` to `high` with square cells.
    pub(super) fn new(low: Vec2, high: Vec2, cell_m: f64) -> Self {
        let size = (high - low) / cell_m;
        let (columns, rows) = (size.x.ceil().max(1.0) as usize, size.y.ceil().max(1.0) as usize);
        Self { low, cell_m, per_m: 1.0 / cell_m, columns, rows }
    }

    pub(super) fn len(&self) -> usize {
        self.columns * self.rows
    }

    /// The number of the cell that holds the point, if any does.
    #[inline]
    pub(super) fn cell(&self, p: Vec2) -> Option<usize> {
        let at = (p - self.low) * self.per_m;
        // Written so that NaN is outside.
        if at.x >= 0.0 && at.y >= 0.0 && at.x < self.columns as f64 && at.y < self.rows as f64 {
            Some(at.y as usize * self.columns + at.x as usize)
        } else {
            None
        }
    }

    pub(super) fn center(&self, column: usize, row: usize) -> Vec2 {
        self.low + Vec2::new(column as f64 + 0.5, row as f64 + 0.5) * self.cell_m
    }

    /// Columns and rows of the cells that meet the box from `low` to `high`.
    pub(super) fn cover(&self, low: Vec2, high: Vec2) -> (std::ops::Range<usize>, std::ops::Range<usize>) {
        let index = |x: f64, count: usize| ((x * self.per_m).max(0.0) as usize).min(count - 1);
        let (low, high) = (low - self.low, high - self.low);
        (
            index(low.x, self.columns)..index(high.x, self.columns) + 1,
            index(low.y, self.rows)..index(high.y, self.rows) + 1,
        )
    }
}

/// The most cells worth their memory.
const MOST_CELLS: f64 = 20_000.0;

impl Cells {
    pub(crate) fn new(walls: &Walls, disc_m: f64) -> Self {
        let (low, high) = walls.bounds_m();
        let margin = Vec2::splat(disc_m);
        let (low, high) = (low - margin, high + margin);
        let size = high - low;
        // A tenth of the disc: smaller cells shorten the lists by little and cost more to fill.
        let cell_m = (0.15 * disc_m).max((size.x * size.y / MOST_CELLS).sqrt());
        let grid = Grid::new(low, high, cell_m);
        // Half a diagonal, and a little more for the rounding of the cell's number.
        let within_m = disc_m + cell_m * (0.5_f64.sqrt() + 1e-9);
        let mut lists: Vec<Vec<(u32, u32)>> = vec![Vec::new(); grid.len()];
        for (segment, a, b) in walls.segments() {
            let (columns, rows) = grid.cover(a.min(b) - within_m, a.max(b) + within_m);
            for row in rows {
                for column in columns.clone() {
                    let center = grid.center(column, row);
                    if nearest_on_segment(a, b, center).distance_squared(center) > within_m * within_m {
                        continue;
                    }
                    let list = &mut lists[row * grid.columns + column];
                    match list.last_mut() {
                        Some(run) if run.1 == segment as u32 => run.1 += 1,
                        _ => list.push((segment as u32, segment as u32 + 1)),
                    }
                }
            }
        }
        let mut starts = vec![0; grid.len() + 1];
        for (i, list) in lists.iter().enumerate() {
            starts[i + 1] = starts[i] + list.len() as u32;
        }
        Self { grid, starts, runs: lists.concat() }
    }

    /// The runs of vertices near a point.
    #[inline]
    fn runs(&self, p: Vec2) -> &[(u32, u32)] {
        match self.grid.cell(p) {
            Some(cell) => &self.runs[self.starts[cell] as usize..self.starts[cell + 1] as usize],
            None => &[],
        }
    }

    /// Eight rays at once against each vertex and segment near the robot's centre.
    #[inline]
    pub(super) fn cast(&self, walls: &Walls, center: Vec2, rays: &Rays) -> Hits {
        let (x_m, y_m) = walls.coordinates_m();
        let mut nearest = [f64::INFINITY; LANES];
        let mut number = [0.0; LANES];
        for &(first, last) in self.runs(center) {
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
        Hits { distance_m: nearest, segment: number.map(|n| n as u32) }
    }

    /// The nearest point of a wall if it is closer than `radius_m`, which is at most the disc the cells are made for.
    #[inline]
    pub(crate) fn nearest_within(&self, walls: &Walls, p: Vec2, radius_m: f64) -> Option<Vec2> {
        let mut best = (radius_m * radius_m, None);
        for &(first, last) in self.runs(p) {
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
