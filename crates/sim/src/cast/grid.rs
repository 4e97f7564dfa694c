//! A uniform grid, and lists of what lies near each of its cells.

use std::ops::Range;

use track::Vec2;

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

    /// Rows of the cells that meet the heights from `low` to `high`.
    fn rows_between(&self, low: f64, high: f64) -> Range<usize> {
        let row = |y: f64| (((y - self.low.y) * self.per_m).max(0.0) as usize).min(self.rows - 1);
        row(low)..row(high) + 1
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

/// Calls `found` with every cell whose centre is within `within_m` of the strip's line: in each row those between the
/// ends of the row's cut through two discs about the line's ends and the band between them.
fn near(grid: &Grid, strip: &Strip, within_m: f64, mut found: impl FnMut(u32)) {
    let Strip { from, to, .. } = *strip;
    let band = Band::new(from, to, within_m);
    for row in grid.rows_between(from.y.min(to.y) - within_m, from.y.max(to.y) + within_m) {
        let y = grid.center(0, row).y;
        let cuts = [
            disc_cut(from, within_m, y),
            disc_cut(to, within_m, y),
            band.cut(y),
        ];
        let [low, high] = cuts
            .into_iter()
            .fold(NO_CUT, |[a, b], [low, high]| [a.min(low), b.max(high)]);
        let column = |x: f64| (x - grid.low.x) * grid.per_m - 0.5;
        let first = column(low).ceil().max(0.0) as usize;
        let end = (column(high).floor() + 1.0).clamp(0.0, grid.columns as f64) as usize;
        for column in first..end {
            found((row * grid.columns + column) as u32);
        }
    }
}

/// A cut that holds nothing.
const NO_CUT: [f64; 2] = [f64::INFINITY, f64::NEG_INFINITY];

/// Where the horizontal line at `y` enters and leaves a disc.
fn disc_cut(center: Vec2, radius_m: f64, y: f64) -> [f64; 2] {
    let squared = radius_m * radius_m - (y - center.y) * (y - center.y);
    if squared < 0.0 {
        return NO_CUT;
    }
    [center.x - squared.sqrt(), center.x + squared.sqrt()]
}

/// The corners of a rectangle about a line.
#[derive(Debug)]
struct Band([Vec2; 4]);

impl Band {
    fn new(from: Vec2, to: Vec2, within_m: f64) -> Self {
        let aside = (to - from).try_normalize().unwrap_or(Vec2::ZERO).perp() * within_m;
        Self([from + aside, to + aside, to - aside, from - aside])
    }

    /// Where the horizontal line at `y` enters and leaves it.
    fn cut(&self, y: f64) -> [f64; 2] {
        let mut cut = NO_CUT;
        for i in 0..4 {
            let (a, b) = (self.0[i], self.0[(i + 1) % 4]);
            let (rise, up) = (b.y - a.y, y - a.y);
            // An edge along the line ends where its neighbours cross it.
            if (up >= 0.0) != (y - b.y >= 0.0) {
                let x = a.x + (b.x - a.x) * (up / rise);
                cut = [cut[0].min(x), cut[1].max(x)];
            }
        }
        cut
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
