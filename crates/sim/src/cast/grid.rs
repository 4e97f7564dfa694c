//! A uniform grid, and lists of what lies near each of its cells.

use std::ops::Range;

use track::Vec2;

use crate::walls::nearest_on_segment;

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
        Self {
            low,
            cell_m,
            per_m: 1.0 / cell_m,
            columns,
            rows,
        }
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
    pub(super) fn cover(&self, low: Vec2, high: Vec2) -> (Range<usize>, Range<usize>) {
        let index = |x: f64, count: usize| ((x * self.per_m).max(0.0) as usize).min(count - 1);
        let (low, high) = (low - self.low, high - self.low);
        (
            index(low.x, self.columns)..index(high.x, self.columns) + 1,
            index(low.y, self.rows)..index(high.y, self.rows) + 1,
        )
    }
}

/// For each cell of a grid the things of a chain that may lie within a disc about a point of the cell, as runs of
/// neighbours.
#[derive(Debug, Clone)]
pub(super) struct Neighbours {
    grid: Grid,
    /// Where the runs of each cell begin, and a last end.
    starts: Vec<u32>,
    /// First thing of each run and the one after its last.
    runs: Vec<(u32, u32)>,
}

/// A straight thing of a chain: its number, its ends, and how far it may reach beyond the line between them, m.
#[derive(Debug, Clone, Copy)]
pub(super) struct Strip {
    pub(super) number: usize,
    pub(super) from: Vec2,
    pub(super) to: Vec2,
    pub(super) slack_m: f64,
}

/// The most cells worth their memory.
const MOST_CELLS: f64 = 20_000.0;

impl Neighbours {
    /// Lists for discs of `disc_m`; `strips` in rising order of their numbers.
    pub(super) fn new(bounds_m: (Vec2, Vec2), disc_m: f64, strips: &[Strip]) -> Self {
        let (low, high) = (bounds_m.0 - disc_m, bounds_m.1 + disc_m);
        let size = high - low;
        // A seventh of the disc: smaller cells shorten the lists by little and cost more to fill.
        let cell_m = (0.15 * disc_m).max((size.x * size.y / MOST_CELLS).sqrt());
        let grid = Grid::new(low, high, cell_m);
        // The points of a cell are within half a diagonal of its centre, and a little more for the rounding of the
        // cell's number.
        let within_m = disc_m + cell_m * (0.5_f64.sqrt() + 1e-9);
        let mut entries = Vec::with_capacity(4 * grid.len()); // (cell, number), in rising order of the numbers
        for strip in strips {
            near(&grid, strip, within_m + strip.slack_m, |cell| {
                entries.push((cell, strip.number as u32))
            });
        }
        let (starts, runs) = runs(grid.len(), &entries);
        Self { grid, starts, runs }
    }

    /// The runs near a point.
    #[inline]
    pub(super) fn runs(&self, p: Vec2) -> &[(u32, u32)] {
        match self.grid.cell(p) {
            Some(cell) => &self.runs[self.starts[cell] as usize..self.starts[cell + 1] as usize],
            None => &[],
        }
    }
}

/// Calls `found` with every cell whose centre is within `within_m` of the strip's line.
fn near(grid: &Grid, strip: &Strip, within_m: f64, mut found: impl FnMut(u32)) {
    let Strip { from, to, .. } = *strip;
    let (columns, rows) = grid.cover(from.min(to) - within_m, from.max(to) + within_m);
    for row in rows {
        for column in columns.clone() {
            let center = grid.center(column, row);
            if nearest_on_segment(from, to, center).distance_squared(center) <= within_m * within_m {
                found((row * grid.columns + column) as u32);
            }
        }
    }
}

/// The entries sorted by cell, neighbours joined to runs: where each cell's runs begin, and the runs.
fn runs(cells: usize, entries: &[(u32, u32)]) -> (Vec<u32>, Vec<(u32, u32)>) {
    let mut ends = vec![0_u32; cells + 1];
    for &(cell, _) in entries {
        ends[cell as usize + 1] += 1;
    }
    for cell in 0..cells {
        ends[cell + 1] += ends[cell];
    }
    let mut numbers = vec![0; entries.len()];
    let mut next = ends.clone();
    for &(cell, number) in entries {
        numbers[next[cell as usize] as usize] = number;
        next[cell as usize] += 1;
    }
    let (mut starts, mut runs) = (Vec::with_capacity(cells + 1), Vec::<(u32, u32)>::new());
    starts.push(0);
    for cell in 0..cells {
        let begin = runs.len();
        for &number in &numbers[ends[cell] as usize..ends[cell + 1] as usize] {
            match runs[begin..].last_mut() {
                Some(run) if run.1 == number => run.1 += 1,
                _ => runs.push((number, number + 1)),
            }
        }
        starts.push(runs.len() as u32);
    }
    (starts, runs)
}
