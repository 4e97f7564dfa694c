//! How far a further experiment would tell two explanations apart.

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use rayon::prelude::*;
use sim::Setting;

use super::atlas::{Extent, Simulate, White, white};
use super::expectation::{Expectation, Scatter};
use super::layout::Layout;
use super::summary::Summary;

/// Data sets simulated under each explanation; half of them against the other half make the distance free of bias.
const SETS: [u64; 12] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11];
/// Some of each half, simulated with one number moved: with the same draws few tell what that changes.
const FEW: [u64; 4] = [0, 1, 6, 7];

/// Standard deviations between two explanations that tell nothing.
pub const TELLS_NOTHING: f64 = 0.3;

/// An explanation that an experiment has to tell from the answer.
#[derive(Debug, Clone)]
pub struct Rival {
    /// The effects at their fitted sizes.
    pub settings: Vec<Setting>,
    /// The same with one of the fitted numbers moved by its standard error, number by number.
    pub moved: Vec<Vec<Setting>>,
}

/// Distances, in standard deviations of one data set of the experiment, between what an explanation leads one to expect
/// of it and what its rivals do; the numbers of a rival go where they bring it nearest, as far as their errors allow. `None` for a
/// rival, or altogether, where the robot crashes.
///
/// `simulate` simulates the experiment.
pub fn separations(
    simulate: &Simulate<'_>,
    answer: &[Setting],
    rivals: &[Rival],
) -> Option<Vec<Option<f64>>> {
    let declared = simulated(simulate, &[], &SETS)?;
    let answered = simulated(simulate, answer, &SETS)?;
    let first = simulate(answer, 0, Extent::Whole)?;
    let layout = Layout::of_recording(&first, answered[0].0[0].scatter.nrows());
    let other = Scatter::of_few(declared.iter().map(|summary| &summary.0[0]))?;
    let scatter = [Scatter::near(
        answered.iter().map(|summary| &summary.0[0]),
        1,
        &other,
    )?];
    let away = |to: &[Summary], from: &[Summary]| -> [White; 2] {
        let [to, from] = [to, from].map(halves);
        [0, 1].map(|half| white(&scatter, &layout, &to[half], &from[half]))
    };
    let separation = |rival: &Rival| {
        let expected = simulated(simulate, &rival.settings, &SETS)?;
        let offset = away(&answered, &expected);
        let plain = nearest(&offset, &[]);
        // Moved numbers bring it nearer yet.
        if plain < TELLS_NOTHING {
            return Some(plain);
        }
        let few = FEW.map(|set| expected[set as usize].clone());
        // A number with which the robot crashes stays.
        let moved = (rival.moved.iter()).filter_map(|settings| simulated(simulate, settings, &FEW));
        let moved: Vec<[White; 2]> = moved.map(|moved| away(&moved, &few)).collect();
        Some(nearest(&offset, &moved))
    };
    Some(rivals.iter().map(separation).collect())
}

/// How far off something stays that is an offset away, where each of some moves by a standard error may be made as often as the
/// square of how often costs: the root of |d - G t|^2 + |t|^2 at its least. Products are of halves of the simulations, so
/// that their noise has no mean.
fn nearest(offset: &[White; 2], moves: &[[White; 2]]) -> f64 {
    let [d1, d2] = offset;
    if moves.is_empty() {
        return d1.dot(d2).max(0.0).sqrt();
    }
    let toward =
        |half: usize, d: &White| DVector::from_iterator(moves.len(), moves.iter().map(|by| by[half].dot(d)));
    let (b1, b2) = (toward(0, d2), toward(1, d1));
    let product = |i: usize, j: usize| 0.5 * (moves[i][0].dot(&moves[j][1]) + moves[i][1].dot(&moves[j][0]));
    let along = SymmetricEigen::new(DMatrix::from_fn(moves.len(), moves.len(), product));
    let saved = along.eigenvalues.iter().zip(along.eigenvectors.column_iter());
    let saved = saved.map(|(square, axis)| axis.dot(&b1) * axis.dot(&b2) / (1.0 + square.max(0.0)));
    (d1.dot(d2) - saved.sum::<f64>().max(0.0)).max(0.0).sqrt()
}

/// Summaries of the data sets with these draws.
fn simulated(simulate: &Simulate<'_>, effects: &[Setting], sets: &[u64]) -> Option<Vec<Summary>> {
    sets.par_iter()
        .map(|&set| {
            let runs = simulate(effects, set, Extent::Whole)?;
            Summary::new(&runs, &[runs.len()])
        })
        .collect()
}

fn halves(summaries: &[Summary]) -> [Expectation; 2] {
    let (a, b) = summaries.split_at(summaries.len() / 2);
    [a, b].map(|half| Expectation::of(half.iter(), true))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_number_can_make_up_for_tells_nothing() {
        let both = |numbers: [f64; 3]| [White::from_row_slice(&numbers), White::from_row_slice(&numbers)];
        let offset = both([3.0, 4.0, 0.0]);
        assert!((nearest(&offset, &[]) - 5.0).abs() < 1e-12);
        // Along (3, 0, 0) t moves cost t^2: of 3 a tenth of 9 is left.
        let one = nearest(&offset, &[both([3.0, 0.0, 0.0])]);
        assert!((one - (16.0_f64 + 0.9).sqrt()).abs() < 1e-12, "{one}");
        // Numbers that hardly do anything make up for nothing, and well known ones no more together than apart.
        let none = nearest(&offset, &[both([0.0, 0.0, 9.0]), both([1e-9, 0.0, 0.0])]);
        assert!((none - 5.0).abs() < 1e-12, "{none}");
        let free = nearest(&offset, &[both([1e6, 0.0, 0.0]), both([1e6, 1e6, 0.0])]);
        assert!(free < 1e-3, "{free}");
    }
}
