//! A fine grid that knows, in every cell, how far the nearest wall is.

use track::Vec2;

use super::grid::Grid;
use super::{Hits, LANES, Rays, crossing, sight};
use crate::Walls;

/// Each ray leaps over the empty space around it and tests segments only in the cells that walls pass through.
#[derive(Debug, Clone)]
pub(super) struct March {
    grid: Grid,
    /// A distance that a ray can go from anywhere in the cell without meeting a wall, m; 0 in a cell with a wall.
    clearance_m: Vec<f32>,
    /// Where the segments of each cell begin, and a last end.
    starts: Vec<u32>,
    segments: Vec<u32>,
}

/// How much farther than its segments a cell's list reaches, m: far more than the rounding of a point on a ray.
const MARGIN_M: f64 = 1e-9;

/// The most cells worth their memory.
const MOST_CELLS: f64 = 4e6;

impl March {
    pub(super) fn new(walls: &Walls, range_m: f64) -> Self {
        let (low, high) = walls.bounds_m();
        let margin = Vec2::splat(range_m);
        let (low, high) = (low - margin, high + margin);
        let size = high - low;
        let length_m: f64 = walls.segments().map(|(_, a, b)| a.distance(b)).sum();
        // About as large as a segment, so that a cell holds two or three; never so small that leaps become steps.
        let cell_m = (1.5 * length_m / walls.len().max(1) as f64)
            .clamp(0.0015, 0.01)
            .max((size.x * size.y / MOST_CELLS).sqrt());
        let grid = Grid::new(low, high, cell_m);
        let mut lists: Vec<Vec<u32>> = vec![Vec::new(); grid.len()];
        for (segment, a, b) in walls.segments() {
            for cell in cells_on(&grid, a, b) {
                lists[cell].push(segment as u32);
            }
        }
        let mut starts = vec![0; grid.len() + 1];
        for (i, list) in lists.iter().enumerate() {
            starts[i + 1] = starts[i] + list.len() as u32;
        }
        let occupied: Vec<bool> = lists.iter().map(|list| !list.is_empty()).collect();
        Self { grid, clearance_m: clearances_m(&grid, &occupied), starts, segments: lists.concat() }
    }

    pub(super) fn cast(&self, walls: &Walls, rays: &Rays, range_m: f64) -> Hits {
        let mut hits = Hits::NONE;
        for i in 0..LANES {
            (hits.distance_m[i], hits.segment[i]) =
                self.cast_one(walls, rays.origin(i), rays.direction(i), range_m);
        }
        hits
    }

    fn cast_one(&self, walls: &Walls, origin: Vec2, direction: Vec2, range_m: f64) -> (f64, u32) {
        let (x_m, y_m) = walls.coordinates_m();
        let (from, along) = ((origin.x, origin.y), (direction.x, direction.y));
        let inverse = Vec2::new(1.0 / direction.x, 1.0 / direction.y);
        let mut nearest = (f64::INFINITY, 0);
        let mut at_m = 0.0;
        while at_m <= range_m.min(nearest.0) {
            // Outside the grid there is no wall within the range.
            let p = origin + direction * at_m;
            let Some(cell) = self.grid.cell(p) else { break };
            let leap_m = f64::from(self.clearance_m[cell]);
            if leap_m > 0.0 {
                at_m += leap_m;
                continue;
            }
            for &segment in &self.segments[self.starts[cell] as usize..self.starts[cell + 1] as usize] {
                let i = segment as usize;
                let distance = crossing(
                    sight(from, along, (x_m[i], y_m[i])),
                    sight(from, along, (x_m[i + 1], y_m[i + 1])),
                );
                if distance < nearest.0 {
                    nearest = (distance, segment);
                }
            }
            at_m += self.exit_m(p, direction, inverse);
        }
        nearest
    }

    /// How far a ray at `p` goes until it has left its cell by less than the lists' margin.
    #[inline]
    fn exit_m(&self, p: Vec2, direction: Vec2, inverse: Vec2) -> f64 {
        let at = (p - self.grid.low) * self.grid.per_m;
        let to_wall = |at: f64, direction: f64, inverse: f64| {
            let ahead = if direction > 0.0 { at.floor() + 1.0 - at } else { at.floor() - at };
            if direction == 0.0 { f64::INFINITY } else { ahead * inverse }
        };
        let cells = to_wall(at.x, direction.x, inverse.x).min(to_wall(at.y, direction.y, inverse.y));
        cells.max(0.0) * self.grid.cell_m + 0.5 * MARGIN_M
    }
}

/// The cells that a segment passes through, and those it misses by less than [`MARGIN_M`].
fn cells_on(grid: &Grid, a: Vec2, b: Vec2) -> impl Iterator<Item = usize> {
    let margin = Vec2::splat(MARGIN_M);
    let (columns, rows) = grid.cover(a.min(b) - margin, a.max(b) + margin);
    let normal = (b - a).perp();
    let grid = *grid;
    let columns_of_row = move |row: usize| columns.clone().map(move |column| (column, row));
    rows.flat_map(columns_of_row).filter_map(move |(column, row)| {
        // Separating axis: the segment's normal; the boxes overlap already.
        let offset = normal.dot(grid.center(column, row) - a).abs();
        let reach = (0.5 * grid.cell_m + MARGIN_M) * (normal.x.abs() + normal.y.abs());
        (offset <= reach).then_some(row * grid.columns + column)
    })
}

/// For every cell a lower bound of the distance from any of its points to any occupied cell, m.
///
/// The exact squared distance between cell centres by the two passes of Felzenszwalb and Huttenlocher, "Distance
/// Transforms of Sampled Functions" (2012), less one diagonal.
fn clearances_m(grid: &Grid, occupied: &[bool]) -> Vec<f32> {
    let mut squared: Vec<f64> = occupied.iter().map(|&o| if o { 0.0 } else { 1e18 }).collect();
    let mut line = vec![0.0; grid.columns.max(grid.rows)];
    for column in 0..grid.columns {
        for row in 0..grid.rows {
            line[row] = squared[row * grid.columns + column];
        }
        let transformed = distance_transform(&line[..grid.rows]);
        for (row, value) in transformed.into_iter().enumerate() {
            squared[row * grid.columns + column] = value;
        }
    }
    for row in squared.chunks_mut(grid.columns) {
        let transformed = distance_transform(row);
        row.copy_from_slice(&transformed);
    }
    squared
        .iter()
        .zip(occupied)
        .map(|(&d2, &occupied)| {
            // A cell beside a wall's has no clearance to speak of: the ray leaves it like a wall's cell.
            let cells = d2.sqrt() - 2.0_f64.sqrt();
            if occupied || cells < 0.05 { 0.0 } else { (cells * grid.cell_m) as f32 * (1.0 - 1e-6) }
        })
        .collect()
}

/// min over q of (p - q)^2 + f(q), for every p.
fn distance_transform(f: &[f64]) -> Vec<f64> {
    let mut hull: Vec<(usize, f64)> = Vec::with_capacity(f.len()); // parabola, and from where on it is the lowest
    for (q, &height) in f.iter().enumerate() {
        let mut from = f64::NEG_INFINITY;
        while let Some(&(p, start)) = hull.last() {
            let (pf, qf) = (p as f64, q as f64);
            from = (height + qf * qf - f[p] - pf * pf) / (2.0 * (qf - pf));
            if from > start {
                break;
            }
            hull.pop();
            from = f64::NEG_INFINITY;
        }
        hull.push((q, from));
    }
    let mut k = 0;
    (0..f.len())
        .map(|p| {
            while k + 1 < hull.len() && hull[k + 1].1 <= p as f64 {
                k += 1;
            }
            let offset = p as f64 - hull[k].0 as f64;
            offset * offset + f[hull[k].0]
        })
        .collect()
}
