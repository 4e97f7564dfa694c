//! Normal equations of columns against the innovations.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::columns::{ABREAST, Changes, NO_CHANGES, Numbers};
use super::filter::{Instant, MEASURED};

/// Normal equations of columns against the innovations, of one stretch or more.
#[derive(Debug, Clone)]
pub(crate) struct Normal {
    /// C^T e and C^T C.
    pub(crate) right: DVector<f64>,
    pub(crate) left: DMatrix<f64>,
    /// The same for columns that grow with time: the cross term with the constant ones, and their own.
    pub(crate) right_time: DVector<f64>,
    pub(crate) cross_time: DMatrix<f64>,
    pub(crate) left_time: DMatrix<f64>,
}

impl Normal {
    /// Those of so many columns of nothing.
    pub(crate) fn zeros(count: usize) -> Self {
        Self {
            right: DVector::zeros(count),
            left: DMatrix::zeros(count, count),
            right_time: DVector::zeros(count),
            cross_time: DMatrix::zeros(count, count),
            left_time: DMatrix::zeros(count, count),
        }
    }

    /// The equations of several runs together; `None` of none.
    pub(crate) fn sum(normals: impl Iterator<Item = Self>) -> Option<Self> {
        normals.reduce(|a, b| Self {
            right: a.right + b.right,
            left: a.left + b.left,
            right_time: a.right_time + b.right_time,
            cross_time: a.cross_time + b.cross_time,
            left_time: a.left_time + b.left_time,
        })
    }

    /// The equations of some neighbouring columns alone.
    pub(crate) fn part(&self, columns: &Range<usize>) -> Self {
        let rows = |of: &DVector<f64>| of.rows(columns.start, columns.len()).into_owned();
        let block = |of: &DMatrix<f64>| {
            let at = (columns.start, columns.start);
            of.view(at, (columns.len(), columns.len())).into_owned()
        };
        Self {
            right: rows(&self.right),
            left: block(&self.left),
            right_time: rows(&self.right_time),
            cross_time: block(&self.cross_time),
            left_time: block(&self.left_time),
        }
    }

    /// The equations of `count` columns of which these are some, at their places and times these factors; the others hold nothing.
    pub(crate) fn among(&self, count: usize, places: &[(usize, f64)]) -> Self {
        let rows = |of: &DVector<f64>| {
            let mut all = DVector::zeros(count);
            for (&value, &(place, factor)) in of.iter().zip(places) {
                all[place] = factor * value;
            }
            all
        };
        let block = |of: &DMatrix<f64>| {
            let mut all = DMatrix::zeros(count, count);
            for (i, &(row, of_row)) in places.iter().enumerate() {
                for (j, &(column, of_column)) in places.iter().enumerate() {
                    all[(row, column)] = of_row * of_column * of[(i, j)];
                }
            }
            all
        };
        Self {
            right: rows(&self.right),
            left: block(&self.left),
            right_time: rows(&self.right_time),
            cross_time: block(&self.cross_time),
            left_time: block(&self.left_time),
        }
    }
}

/// Products of columns that are taken side by side with others that are.
type Block = [Numbers; ABREAST];

/// Which products of columns are wanted; the others are 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Products {
    /// Of all with each other.
    All,
    /// Of each with itself.
    Squares,
}

/// Normal equations while control steps are added.
pub(super) struct Sums {
    count: usize,
    wanted: Products,
    /// Of the columns that are side by side.
    right: Vec<Numbers>,
    right_time: Vec<Numbers>,
    /// Of these with themselves and those before them, or their squares in the first row.
    left: Vec<Block>,
    cross_time: Vec<Block>,
    left_time: Vec<Block>,
}

impl Sums {
    /// Of so many columns.
    pub(super) fn new(count: usize, wanted: Products) -> Self {
        let n = count.div_ceil(ABREAST);
        let blocks = match wanted {
            Products::All => n * (n + 1) / 2,
            Products::Squares => n,
        };
        let products = vec![[[0.0; ABREAST]; ABREAST]; blocks];
        Self {
            count,
            wanted,
            right: vec![[0.0; ABREAST]; n],
            right_time: vec![[0.0; ABREAST]; n],
            left: products.clone(),
            cross_time: products.clone(),
            left_time: products,
        }
    }

    /// Adds a control step of all columns.
    pub(super) fn add<'c>(&mut self, instant: &Instant, columns: impl Iterator<Item = &'c Changes> + Clone) {
        let mut block = 0;
        for (a, own) in columns.clone().enumerate() {
            let others = match self.wanted {
                Products::All => a + 1,
                Products::Squares => 1,
            };
            if *own == NO_CHANGES {
                block += others;
                continue;
            }
            self.add_right(a, own, instant);
            let time_s = instant.time_s;
            match self.wanted {
                Products::Squares => self.add_row((a, 0), |m, k| own[m][k] * own[m][k], time_s),
                Products::All => {
                    for (b, other) in columns.clone().take(others).enumerate() {
                        for i in 0..ABREAST {
                            self.add_row((block + b, i), |m, k| own[m][i] * other[m][k], time_s);
                        }
                    }
                }
            }
            block += others;
        }
    }

    /// The trace holds what was seen less what was expected, the column the change of that difference.
    fn add_right(&mut self, a: usize, own: &Changes, instant: &Instant) {
        let mut right = [0.0; ABREAST];
        for (change, innovation) in own.iter().zip(&instant.innovation) {
            (0..ABREAST).for_each(|k| right[k] -= change[k] * innovation);
        }
        for k in 0..ABREAST {
            self.right[a][k] += right[k];
            self.right_time[a][k] += right[k] * instant.time_s;
        }
    }

    /// Adds to a row of a block the products of numbers and columns, plain, with the time and with its square.
    #[inline(always)]
    fn add_row(&mut self, (block, row): (usize, usize), product: impl Fn(usize, usize) -> f64, time_s: f64) {
        let mut products = [0.0; ABREAST];
        for m in 0..MEASURED {
            (0..ABREAST).for_each(|k| products[k] += product(m, k));
        }
        let sums = [&mut self.left, &mut self.cross_time, &mut self.left_time];
        let [plain, once, twice] = sums.map(|of| &mut of[block][row]);
        for k in 0..ABREAST {
            plain[k] += products[k];
            once[k] += products[k] * time_s;
            twice[k] += products[k] * time_s * time_s;
        }
    }
}

impl From<Sums> for Normal {
    fn from(sums: Sums) -> Self {
        let count = sums.count;
        let rows = |of: &[Numbers]| DVector::from_iterator(count, of.iter().flatten().copied().take(count));
        let block = |of: &[Block]| {
            let at = |i: usize, j: usize| {
                let (a, b) = (i / ABREAST, j / ABREAST);
                match sums.wanted {
                    Products::All => of[a * (a + 1) / 2 + b][i % ABREAST][j % ABREAST],
                    Products::Squares if i == j => of[a][0][i % ABREAST],
                    Products::Squares => 0.0,
                }
            };
            DMatrix::from_fn(count, count, |i, j| at(i.max(j), i.min(j)))
        };
        Self {
            right: rows(&sums.right),
            left: block(&sums.left),
            right_time: rows(&sums.right_time),
            cross_time: block(&sums.cross_time),
            left_time: block(&sums.left_time),
        }
    }
}
