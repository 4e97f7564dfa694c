//! Normal equations of columns against the innovations.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::columns::{ABREAST, Changes, NO_CHANGES, Numbers};
use super::filter::MEASURED;

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

    /// The equations of other columns, each vector and each matrix made from these.
    fn map(
        &self,
        rows: impl Fn(&DVector<f64>) -> DVector<f64>,
        block: impl Fn(&DMatrix<f64>) -> DMatrix<f64>,
    ) -> Self {
        Self {
            right: rows(&self.right),
            left: block(&self.left),
            right_time: rows(&self.right_time),
            cross_time: block(&self.cross_time),
            left_time: block(&self.left_time),
        }
    }

    /// The equations of some neighbouring columns alone.
    pub(crate) fn part(&self, columns: &Range<usize>) -> Self {
        let rows = |of: &DVector<f64>| of.rows(columns.start, columns.len()).into_owned();
        let block = |of: &DMatrix<f64>| {
            let at = (columns.start, columns.start);
            of.view(at, (columns.len(), columns.len())).into_owned()
        };
        self.map(rows, block)
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
        self.map(rows, block)
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

    /// Adds a control step of all columns against its innovations.
    pub(super) fn add<'c>(
        &mut self,
        time_s: f64,
        innovation: &[f64; MEASURED],
        columns: impl Iterator<Item = &'c Changes> + Clone,
    ) {
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
            self.add_right(a, own, innovation, time_s);
            match self.wanted {
                Products::Squares => self.add_row((a, 0), |m, k| own[m][k] * own[m][k], time_s),
                Products::All => {
                    let rows = ABREAST.min(self.count - a * ABREAST);
                    for (b, other) in columns.clone().take(others).enumerate() {
                        for i in 0..rows {
                            self.add_row((block + b, i), |m, k| own[m][i] * other[m][k], time_s);
                        }
                    }
                }
            }
            block += others;
        }
    }

    /// The trace holds what was seen less what was expected, the column the change of that difference.
    fn add_right(&mut self, a: usize, own: &Changes, innovation: &[f64; MEASURED], time_s: f64) {
        let mut right = [0.0; ABREAST];
        for (change, innovation) in own.iter().zip(innovation) {
            (0..ABREAST).for_each(|k| right[k] -= change[k] * innovation);
        }
        for k in 0..ABREAST {
            self.right[a][k] += right[k];
            self.right_time[a][k] += right[k] * time_s;
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

#[cfg(test)]
mod tests {
    use super::*;

    const COUNT: usize = 11;
    const STEPS: usize = 5;

    fn time_s(step: usize) -> f64 {
        0.5 + step as f64
    }

    fn wave(step: usize, m: usize, by: f64) -> f64 {
        (by * (1 + step * MEASURED + m) as f64).sin()
    }

    /// Eleven columns side by side, of which none changes anything in the first step.
    fn sums(wanted: Products) -> Normal {
        let mut sums = Sums::new(COUNT, wanted);
        for step in 0..STEPS {
            let change = |m: usize, column: usize| {
                let nothing = step == 0 || column >= COUNT;
                if nothing {
                    0.0
                } else {
                    wave(step, m, 0.3 + column as f64)
                }
            };
            let abreast = [0, ABREAST].map(|first| -> Changes {
                std::array::from_fn(|m| std::array::from_fn(|k| change(m, first + k)))
            });
            let innovation = std::array::from_fn(|m| wave(step, m, 0.7));
            sums.add(time_s(step), &innovation, abreast.iter());
        }
        sums.into()
    }

    fn design() -> (DMatrix<f64>, DVector<f64>, DMatrix<f64>) {
        let rows = STEPS * MEASURED;
        let columns = DMatrix::from_fn(rows, COUNT, |row, column| {
            let (step, m) = (row / MEASURED, row % MEASURED);
            if step == 0 {
                0.0
            } else {
                wave(step, m, 0.3 + column as f64)
            }
        });
        let missed = DVector::from_fn(rows, |row, _| -wave(row / MEASURED, row % MEASURED, 0.7));
        let times = DMatrix::from_diagonal(&DVector::from_fn(rows, |row, _| time_s(row / MEASURED)));
        (columns, missed, times)
    }

    fn are_alike(found: &DMatrix<f64>, expected: &DMatrix<f64>) {
        assert!((found - expected).amax() < 1e-9, "{found} for {expected}");
    }

    #[test]
    fn columns_side_by_side_have_the_normal_equations_of_their_matrix() {
        let (columns, missed, times) = design();
        let (found, transposed) = (sums(Products::All), columns.transpose());
        are_alike(&found.left, &(&transposed * &columns));
        are_alike(&found.cross_time, &(&transposed * &times * &columns));
        are_alike(&found.left_time, &(&transposed * &times * &times * &columns));
        assert!((&found.right - &transposed * &missed).amax() < 1e-9);
        assert!((&found.right_time - &transposed * &times * &missed).amax() < 1e-9);
    }

    #[test]
    fn squares_are_the_diagonal() {
        let (all, squares) = (sums(Products::All), sums(Products::Squares));
        are_alike(&squares.left, &DMatrix::from_diagonal(&all.left.diagonal()));
        are_alike(
            &squares.left_time,
            &DMatrix::from_diagonal(&all.left_time.diagonal()),
        );
        assert_eq!(squares.right, all.right);
    }

    #[test]
    fn some_columns_among_others_keep_their_equations() {
        let all = sums(Products::All);
        let part = all.part(&(3..5));
        assert_eq!(part.left[(0, 1)], all.left[(3, 4)]);
        let among = part.among(4, &[(3, 2.0), (1, 1.0)]);
        assert_eq!(among.left[(3, 1)], 2.0 * all.left[(3, 4)]);
        assert_eq!(among.right[3], 2.0 * all.right[3]);
        assert_eq!((among.right[0], among.left[(0, 3)]), (0.0, 0.0));
    }
}
