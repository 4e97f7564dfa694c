//! The neighbourhood of a hypothesis: what a step in each of its numbers does to the expectation, as parabolas, and where
//! on them the data are nearest.

use std::collections::BTreeMap;
use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::atlas::{Atlas, White, in_other_units, white};
use super::expectation::{Expectation, Scatter};
use super::hypothesis::Hypothesis;
use super::layout::Layout;
use super::likelihood::{Doubt, Fit};
use super::part::Freedom;
use super::simulated::Evaluated;
use super::slopes::SeenSlopes;
use super::trial::Trial;

impl Trial<'_> {
    /// A hypothesis and its neighbourhood, each point simulated with so many data sets; `None` where the robot crashes.
    pub(super) fn local(&self, hypothesis: &Hypothesis, freedoms: &[Freedom], sets: u64) -> Option<Local> {
        self.local_knowing(&BTreeMap::new(), hypothesis, freedoms, sets)
    }

    /// The same where slopes of some parts are known: nothing is simulated to the sides of these.
    pub(super) fn local_knowing(
        &self,
        known: &BTreeMap<usize, SeenSlopes>,
        hypothesis: &Hypothesis,
        freedoms: &[Freedom],
        sets: u64,
    ) -> Option<Local> {
        let center = self.evaluate(hypothesis, sets)?;
        let mut sides = Vec::with_capacity(freedoms.len());
        let is_new = |group: &Vec<Freedom>| !known.contains_key(&group[0].part);
        for group in groups(freedoms).into_iter().filter(is_new) {
            let at = |sign: f64| {
                let moves: Vec<(Freedom, f64)> = group.iter().map(|f| (*f, sign * f.step)).collect();
                let moved = hypothesis.moved(self.atlas, &moves);
                Some(Point {
                    by: group
                        .iter()
                        .map(|f| moved.apart(hypothesis, f, self.atlas))
                        .collect(),
                    simulated: self.evaluate(&moved, sets)?,
                })
            };
            // Where the robot crashes on one side, the other one tells the slope.
            let nowhere = || Point {
                by: vec![0.0; group.len()],
                simulated: center.clone(),
            };
            let (down, up) = (at(-1.0), at(1.0));
            if down.is_none() && up.is_none() {
                return None;
            }
            let (down, up) = (down.unwrap_or_else(nowhere), up.unwrap_or_else(nowhere));
            sides.push(Sides { group, down, up });
        }
        let all = (sides.iter().flat_map(|sides| [&sides.down, &sides.up]))
            .flat_map(|point| &point.simulated.summaries);
        let scatter = self
            .atlas
            .scatter_of(center.summaries.iter().chain(all), 1 + 2 * sides.len())?;
        let columns_of = |expected: &dyn Fn(&Evaluated) -> Expectation| -> Vec<Column> {
            let from = expected(&center);
            let mut columns = Vec::new();
            for Sides { group, down, up } in &sides {
                let [at_down, at_up] = [down, up]
                    .map(|point| white(&scatter, &self.atlas.layout, &expected(&point.simulated), &from));
                for (i, freedom) in group.iter().enumerate() {
                    let own = |action: &White| freedom.own_share(action, &self.atlas.layout);
                    columns.push(Column::through(
                        (down.by[i], own(&at_down)),
                        (up.by[i], own(&at_up)),
                    ));
                }
            }
            columns
        };
        let mut columns = columns_of(&|e| e.expectation.clone());
        let half = center.summaries.len() / 2;
        let part = |first: usize| {
            columns_of(&|e| Expectation::of(e.summaries[first..first + half].iter(), e.doubt.alike))
        };
        // The mean of two halves is off by half their difference.
        let of_all = (2.0 * half as f64 / center.summaries.len() as f64).sqrt();
        for ((column, a), b) in columns.iter_mut().zip(part(0)).zip(part(half)) {
            column.doubt = (a.slope - b.slope) * (0.5 * of_all);
            column.curvature_doubt = (a.curvature - b.curvature) * (0.5 * of_all);
        }
        let widenings = sides.iter().flat_map(|side| self.atlas.widenings(&scatter, side));
        for (column, widening) in columns.iter_mut().zip(widenings) {
            column.widening = widening;
        }
        let mut seen = columns.into_iter();
        let of_part = |own: &[Freedom]| match known.get(&own[0].part) {
            Some(slopes) => slopes.in_units_of(&scatter, &self.atlas.layout),
            None => seen.by_ref().take(own.len()).collect(),
        };
        let parts = freedoms.chunk_by(|a, b| a.part == b.part);
        let columns = parts.flat_map(of_part).collect();
        Some(Local {
            center,
            scatter,
            columns,
            sides,
        })
    }
}

impl Atlas {
    /// What each number of a group does to the scatter of laps, as the points to either side tell it.
    fn widenings(&self, scatter: &[Scatter], sides: &Sides) -> Vec<Vec<f64>> {
        let Sides { group, down, up } = sides;
        let squares = |g: usize, point: &Point| {
            scatter[g].mean_square(point.simulated.summaries.iter().map(|summary| &summary.0[g]))
        };
        let changes: Vec<f64> = (0..scatter.len())
            .map(|g| (squares(g, up) / squares(g, down)).ln())
            .collect();
        let of_number = |(i, freedom): (usize, &Freedom)| {
            let between = up.by[i] - down.by[i];
            let widening = |(g, change): (usize, &f64)| {
                let widening = change * freedom.share_of_scatter(g, &self.layout) / between;
                if between == 0.0 { 0.0 } else { widening }
            };
            changes.iter().enumerate().map(widening).collect()
        };
        group.iter().enumerate().map(of_number).collect()
    }
}

/// Numbers that are moved together, and what was simulated to either side of them.
#[derive(Debug, Clone)]
pub(super) struct Sides {
    group: Vec<Freedom>,
    pub(super) down: Point,
    pub(super) up: Point,
}

/// What was simulated where moves lead, one of each number that is moved.
#[derive(Debug, Clone)]
pub(super) struct Point {
    pub(super) by: Vec<f64>,
    pub(super) simulated: Evaluated,
}

/// Freedoms that are moved together: the sizes of one part in its runs.
pub(super) fn groups(freedoms: &[Freedom]) -> Vec<Vec<Freedom>> {
    let mut groups: Vec<Vec<Freedom>> = Vec::new();
    for freedom in freedoms {
        match groups.last_mut() {
            Some(group) if freedom.run.is_some() && freedom.is_beside(&group[0]) => group.push(*freedom),
            _ => groups.push(vec![*freedom]),
        }
    }
    groups
}

impl Freedom {
    /// Its own share of the action of its group.
    pub(super) fn own_share(&self, action: &White, layout: &Layout) -> White {
        self.run
            .map_or_else(|| action.clone(), |run| of_run(action, run, layout))
    }

    /// Its share of what its group does to the scatter of a recording's laps.
    fn share_of_scatter(&self, recording: usize, layout: &Layout) -> f64 {
        let runs = layout.laps[recording].len() as f64;
        match self.run.and_then(|run| layout.places().nth(run)) {
            None => 1.0,
            Some((own, _)) if own == recording => 1.0 / runs,
            Some(_) => 0.0,
        }
    }
}

/// What one run's size does: that run's mean, and its share of its recording's trend and second-order numbers.
fn of_run(action: &White, run: usize, layout: &Layout) -> White {
    let mut own = White::zeros(action.len());
    let recording = layout.places().nth(run).map_or(0, |at| at.0);
    let share = 1.0 / layout.laps[recording].len() as f64;
    for (range, share) in [
        (layout.run(run), 1.0),
        (layout.trend(recording), share),
        (layout.second(recording), share),
    ] {
        own.rows_mut(range.start, range.len())
            .axpy(share, &action.rows(range.start, range.len()), 1.0);
    }
    own
}

/// A hypothesis and its neighbourhood.
#[derive(Debug, Clone)]
pub(super) struct Local {
    pub(super) center: Evaluated,
    pub(super) scatter: Vec<Scatter>,
    pub(super) columns: Vec<Column>,
    /// What was simulated to either side of each number, or of the sizes of all runs.
    pub(super) sides: Vec<Sides>,
}

/// The action of one number: slope and curvature.
#[derive(Debug, Clone)]
pub(super) struct Column {
    pub(super) slope: White,
    pub(super) curvature: White,
    /// How the slope is off for the simulation's own error, and how the curvature is: one draw of each.
    pub(super) doubt: White,
    curvature_doubt: White,
    /// Slope of the logarithm of the variance of laps, recording by recording.
    widening: Vec<f64>,
}

impl Local {
    /// Whether noise is a fair share of what its points told of some number.
    pub(super) fn is_noisy(&self) -> bool {
        const FAIR: f64 = 0.05;
        let noisy = |column: &Column| column.doubt.norm_squared() > FAIR * column.slope.norm_squared();
        self.columns.iter().any(noisy)
    }
}

impl Column {
    /// The same in units of another scatter.
    pub(super) fn in_other_units(&self, layout: &Layout, from: &[Scatter], to: &[Scatter]) -> Self {
        let other = |white: &White| in_other_units(white, layout, from, to);
        Self {
            slope: other(&self.slope),
            curvature: other(&self.curvature),
            doubt: other(&self.doubt),
            curvature_doubt: other(&self.curvature_doubt),
            widening: self.widening.clone(),
        }
    }

    /// The same parabola as seen from another point of it.
    pub(super) fn from(&self, moved: f64) -> Self {
        Self {
            slope: &self.slope + &self.curvature * (2.0 * moved),
            curvature: self.curvature.clone(),
            doubt: &self.doubt + &self.curvature_doubt * (2.0 * moved),
            curvature_doubt: self.curvature_doubt.clone(),
            widening: self.widening.clone(),
        }
    }

    /// The same with a straight line for a curvature that is mostly noise.
    pub(super) fn without_noise(self) -> Self {
        const MOSTLY: f64 = 2.0;
        if self.curvature.norm_squared() > MOSTLY * self.curvature_doubt.norm_squared() {
            return self;
        }
        Self {
            curvature: &self.slope * 0.0,
            curvature_doubt: &self.slope * 0.0,
            ..self
        }
    }

    /// The parabola through the origin and two points.
    fn through(down: (f64, White), up: (f64, White)) -> Self {
        let (a, b) = (down.0, up.0);
        if a == 0.0 || b == 0.0 {
            // At the end of the range there is one side only.
            let (by, action) = if a == 0.0 { up } else { down };
            let slope = if by == 0.0 { action * 0.0 } else { action / by };
            return Self {
                curvature: &slope * 0.0,
                doubt: &slope * 0.0,
                curvature_doubt: &slope * 0.0,
                widening: Vec::new(),
                slope,
            };
        }
        let curvature = (&up.1 / b - &down.1 / a) / (b - a);
        let slope = &up.1 / b - &curvature * b;
        Self {
            doubt: &slope * 0.0,
            curvature_doubt: &slope * 0.0,
            widening: Vec::new(),
            slope,
            curvature,
        }
    }
}

/// Where parabolas are nearest to data.
pub(super) struct Nearest {
    pub(super) moves: DVector<f64>,
    pub(super) covariance: DMatrix<f64>,
    /// Standard errors of the moves, the simulation's own error included.
    pub(super) errors: Vec<f64>,
    pub(super) fit: Fit,
    /// Log-likelihood that the moves are hoped to gain.
    pub(super) hoped: f64,
}

impl Nearest {
    /// How the errors of the moves go together.
    pub(super) fn correlation(&self) -> DMatrix<f64> {
        let deviations = self.covariance.diagonal().map(f64::sqrt);
        let scaled = |i: usize, j: usize| self.covariance[(i, j)] / (deviations[i] * deviations[j]);
        DMatrix::from_fn(deviations.len(), deviations.len(), scaled)
    }
}

impl Trial<'_> {
    /// Where parabolas through a simulated hypothesis are nearest to the data, in units of a scatter that widens with its numbers: where
    /// the likelihood is highest.
    pub(super) fn nearest(
        &self,
        center: &Evaluated,
        scatter: &[Scatter],
        columns: &[Column],
        freedoms: &[Freedom],
    ) -> Nearest {
        let target = white(scatter, &self.atlas.layout, self.data, &center.expectation);
        let laps = self.atlas.laps_of(center.doubt, self.silent);
        let (moves, covariance) = nearest(columns, &target, freedoms, &laps);
        let moves = DVector::from_fn(moves.len(), |i, _| freedoms[i].possible(moves[i]));
        let left = left_of(columns, &target, &moves);
        let wider = wider(columns, &moves, laps.entries.len());
        let variances = covariance.diagonal() * (1.0 + center.doubt.error);
        let mut fit = self.fit_of(left.clone(), scatter, center.doubt);
        fit.gain -= 0.5 * laps.more(&left, &wider);
        for (g, wider) in wider.iter().enumerate() {
            for range in self.atlas.layout.laps_of(g) {
                fit.residual
                    .rows_mut(range.start, range.len())
                    .scale_mut((-0.5 * wider).exp());
            }
        }
        Nearest {
            errors: variances.iter().map(|variance| variance.sqrt()).collect(),
            hoped: 0.5 * (target.norm_squared() - laps.distance(&left, &wider)),
            fit,
            moves,
            covariance,
        }
    }
}

impl Atlas {
    /// The entries that tell the scatter of laps where an expectation is in doubt.
    fn laps_of(&self, doubt: Doubt, silent: &[Range<usize>]) -> Laps<'_> {
        let of_recording = |g: usize| {
            let all = self.layout.laps_of(g);
            let counted = all.iter().filter(|range| !silent.contains(range));
            counted.map(Range::len).sum::<usize>() as f64
        };
        Laps {
            entries: (0..self.layout.laps.len()).map(of_recording).collect(),
            squares: Box::new(move |left: &White| {
                let mut left = left.clone();
                self.allow_for(&mut left, doubt);
                let square = |range: Range<usize>| left.rows(range.start, range.len()).norm_squared();
                let of_recording = |g: usize| self.layout.laps_of(g).into_iter().map(square).sum();
                (0..self.layout.laps.len()).map(of_recording).collect()
            }),
        }
    }
}

/// What runs' mean laps and trends, draws of the scatter of a lap, tell of that scatter, recording by recording.
struct Laps<'a> {
    /// How many numbers they are.
    entries: Vec<f64>,
    /// The sum of their squares, in units of the scatter and of the simulation's error.
    squares: Squares<'a>,
}

type Squares<'a> = Box<dyn Fn(&White) -> Vec<f64> + 'a>;

impl Laps<'_> {
    /// Squared distance, and the logarithm of the determinant of the scatter, that a scatter adds which is wider by these logarithms.
    fn more(&self, left: &White, wider: &[f64]) -> f64 {
        let of_recording = |((square, entries), wider): ((f64, &f64), &f64)| {
            ((-wider).exp() - 1.0) * square + entries * wider
        };
        let squares = (self.squares)(left).into_iter();
        squares.zip(&self.entries).zip(wider).map(of_recording).sum()
    }

    /// Squared distance and that.
    fn distance(&self, left: &White, wider: &[f64]) -> f64 {
        left.norm_squared() + self.more(left, wider)
    }

    /// Slope of the log-likelihood along the logarithm of each recording's variance. What is left of data that another effect is in
    /// says little of the scatter: of a far too large one no more than half too much counts.
    fn slopes(&self, left: &White, wider: &[f64]) -> Vec<f64> {
        const MOST: f64 = 1.5;
        let slope = |((square, entries), wider): ((f64, &f64), &f64)| {
            0.5 * (((-wider).exp() * square).min(MOST * entries) - entries)
        };
        let squares = (self.squares)(left).into_iter();
        squares.zip(&self.entries).zip(wider).map(slope).collect()
    }
}

/// The logarithm by which moves make the variance of the laps of each of so many recordings larger.
fn wider(columns: &[Column], moves: &DVector<f64>, recordings: usize) -> Vec<f64> {
    let of_recording = |g: usize| {
        (columns.iter().zip(moves.iter()))
            .map(|(column, moved)| column.widening[g] * moved)
            .sum()
    };
    (0..recordings).map(of_recording).collect()
}

/// The moves that bring the parabolas nearest to the target, and their covariance.
fn nearest(
    columns: &[Column],
    target: &White,
    freedoms: &[Freedom],
    laps: &Laps<'_>,
) -> (DVector<f64>, DMatrix<f64>) {
    let count = columns.len();
    let recordings = laps.entries.len();
    let mut moves = DVector::<f64>::zeros(count);
    let mut normal = DMatrix::identity(count, count);
    let distance = |moves: &DVector<f64>| {
        laps.distance(
            &left_of(columns, target, moves),
            &wider(columns, moves, recordings),
        )
    };
    for _ in 0..30 {
        let left = left_of(columns, target, &moves);
        let wide = wider(columns, &moves, recordings);
        let slopes: Vec<White> = (columns.iter().zip(moves.iter()))
            .map(|(c, m)| &c.slope + &c.curvature * (2.0 * m))
            .collect();
        let sum = |terms: &dyn Fn(usize) -> f64| (0..recordings).map(terms).sum::<f64>();
        normal = DMatrix::from_fn(count, count, |i, j| {
            let (a, b) = (&columns[i].widening, &columns[j].widening);
            slopes[i].dot(&slopes[j]) + sum(&|g| 0.5 * laps.entries[g] * a[g] * b[g])
        });
        // A number without action stays where it is.
        for (i, freedom) in freedoms.iter().enumerate() {
            normal[(i, i)] += 1e-6 / (freedom.step * freedom.step);
        }
        let along_scatter = laps.slopes(&left, &wide);
        let gradient = DVector::from_fn(count, |i, _| {
            slopes[i].dot(&left) + sum(&|g| columns[i].widening[g] * along_scatter[g])
        });
        let Some(step) = normal.clone().cholesky().map(|f| f.solve(&gradient)) else {
            break;
        };
        let before = laps.distance(&left, &wide);
        let mut share = 1.0;
        let mut next = bounded(&moves, &step, share, freedoms);
        while distance(&next) > before && share > 1e-3 {
            share *= 0.5;
            next = bounded(&moves, &step, share, freedoms);
        }
        let change = (&next - &moves)
            .component_div(&DVector::from_fn(count, |i, _| freedoms[i].step))
            .amax();
        moves = next;
        if change < 1e-6 {
            break;
        }
    }
    let there: Vec<Column> = (columns.iter().zip(moves.iter()))
        .map(|(column, moved)| column.from(*moved))
        .collect();
    let covariance = covariance(&there, normal);
    (moves, covariance)
}

/// The covariance of moves with these normal equations. What is noise in the slopes tells nothing, and follows the data's:
/// along the principal axes of the noise in the moves' own metric, information that is noise by a share n is worth
/// (1 - n)^2 of itself.
fn covariance(columns: &[Column], normal: DMatrix<f64>) -> DMatrix<f64> {
    /// Noise of slopes is known from one draw: no direction is told to be noise altogether.
    const MOST_NOISE: f64 = 0.9;
    let count = columns.len();
    if count == 0 {
        return normal;
    }
    let Some(root) = normal.cholesky().map(|factor| factor.l()) else {
        return DMatrix::identity(count, count);
    };
    let noise = DMatrix::from_fn(count, count, |i, j| columns[i].doubt.dot(&columns[j].doubt));
    let whitened = |matrix: &DMatrix<f64>| root.solve_lower_triangular(matrix);
    let Some(noise) = whitened(&noise).and_then(|half| whitened(&half.transpose())) else {
        return DMatrix::identity(count, count);
    };
    let axes = noise.symmetric_eigen();
    let worth = axes.eigenvalues.map(|n| 1.0 - n.min(MOST_NOISE));
    let wide = &axes.eigenvectors * DMatrix::from_diagonal(&worth.map(|worth| 1.0 / worth));
    let moves = root.transpose().solve_upper_triangular(&wide).unwrap_or(wide);
    &moves * moves.transpose()
}

/// What the parabolas at some moves leave of the target.
fn left_of(columns: &[Column], target: &White, moves: &DVector<f64>) -> White {
    let mut left = target.clone();
    for (column, &m) in columns.iter().zip(moves.iter()) {
        left.axpy(-m, &column.slope, 1.0);
        left.axpy(-m * m, &column.curvature, 1.0);
    }
    left
}

/// A parabola is trusted for two and a half times the step that it was made with.
fn bounded(moves: &DVector<f64>, step: &DVector<f64>, share: f64, freedoms: &[Freedom]) -> DVector<f64> {
    DVector::from_fn(moves.len(), |i, _| {
        let most = 2.5 * freedoms[i].step;
        (moves[i] + share * step[i]).clamp(-most, most)
    })
}

#[cfg(test)]
mod tests {
    use sim::Streams;

    use super::*;

    /// One recording with so many entries, whose squares what is left does not change.
    fn laps(entries: f64, square: f64) -> Laps<'static> {
        Laps {
            entries: vec![entries],
            squares: Box::new(move |_| vec![square]),
        }
    }

    #[test]
    fn without_numbers_nothing_moves() {
        let (moves, covariance) = nearest(&[], &White::from_element(5, 1.0), &[], &laps(5.0, 5.0));
        assert!(moves.is_empty() && covariance.is_empty());
    }

    #[test]
    fn a_number_that_widens_the_scatter_moves_until_laps_are_as_wide_as_it() {
        let column = Column {
            slope: White::zeros(5),
            curvature: White::zeros(5),
            doubt: White::zeros(5),
            curvature_doubt: White::zeros(5),
            widening: vec![2.0],
        };
        for times in [0.8_f64, 1.0, 1.3, 4.0] {
            let laps = laps(600.0, 600.0 * times);
            let (moves, covariance) = nearest(
                std::slice::from_ref(&column),
                &White::zeros(5),
                &[Freedom::shared(0.5)],
                &laps,
            );
            assert!((moves[0] - times.ln() / 2.0).abs() < 1e-5, "{times}: {moves}");
            // A variance is known to two parts of its square in as many draws.
            assert!((covariance[(0, 0)] - 2.0 / 600.0 / 4.0).abs() < 1e-6);
        }
    }

    #[test]
    fn noise_in_a_slope_is_no_information() {
        const ENTRIES: usize = 400;
        let mut stream = Streams { seed: 3, run: 0 }.open("noise");
        let mut noise = || White::from_fn(ENTRIES, |_, _| 0.2 * stream.normal());
        // Information 36, to which the noise of the slope seems to add 16.
        let column = Column {
            slope: White::from_element(ENTRIES, 0.3) + noise(),
            curvature: White::zeros(ENTRIES),
            doubt: noise(),
            curvature_doubt: White::zeros(ENTRIES),
            widening: vec![0.0],
        };
        let normal = DMatrix::from_element(1, 1, column.slope.norm_squared());
        let variance = covariance(&[column], normal)[(0, 0)];
        let expected = 52.0 / (36.0 * 36.0);
        assert!(
            (variance / expected - 1.0).abs() < 0.2,
            "{variance} for {expected}"
        );
    }
}
