//! What the numbers of an effect do, kept from one hypothesis with it to the next.

use std::sync::Arc;

use super::atlas::Atlas;
use super::expectation::Scatter;
use super::hypothesis::Hypothesis;
use super::layout::Layout;
use super::parabola::{Column, Local};
use super::part::{Freedom, Part};

/// What a look around an effect told of its numbers: beside other effects they do nearly the same.
#[derive(Debug, Clone)]
pub(super) struct Slopes {
    /// The effect alone as it was looked around.
    at: Hypothesis,
    freedoms: Vec<Freedom>,
    columns: Vec<Column>,
    /// In units of which the columns are.
    scatter: Vec<Scatter>,
    /// Whether it was looked around for the first time, which does not find a place.
    pub(super) rough: bool,
}

impl Slopes {
    /// Those of a part of a hypothesis that was looked around in some numbers.
    pub(super) fn of(
        part: usize,
        hypothesis: &Hypothesis,
        freedoms: &[Freedom],
        local: &Local,
        rough: bool,
    ) -> Self {
        let numbers = freedoms.iter().zip(&local.columns);
        let (freedoms, columns) = numbers
            .filter(|(freedom, _)| freedom.part == part)
            .map(|(freedom, column)| (Freedom { part: 0, ..*freedom }, column.clone()))
            .unzip();
        Self {
            at: Hypothesis::of(hypothesis.parts[part].clone().without_slopes()),
            freedoms,
            columns,
            scatter: local.scatter.clone(),
            rough,
        }
    }

    /// Their parabolas as seen from another part; `None` from another effect, and from where they do not reach.
    pub(super) fn seen_from(self: &Arc<Self>, part: &Part, atlas: &Atlas) -> Option<SeenSlopes> {
        /// Steps of the look that they reach.
        const STEPS: f64 = 2.0;
        let at = &self.at.parts[0];
        if (at.probe, at.shape, &at.tied) != (part.probe, part.shape, &part.tied) {
            return None;
        }
        let there = Hypothesis::of(part.clone().without_slopes());
        let columns = self.columns.iter().zip(&self.freedoms);
        let seen = columns.map(|(column, freedom)| {
            let apart = there.apart(&self.at, freedom, atlas);
            let reaches = apart.abs() <= STEPS * freedom.step;
            reaches.then(|| column.clone().without_noise().from(apart))
        });
        Some(SeenSlopes {
            columns: seen.collect::<Option<_>>()?,
            of: Arc::clone(self),
        })
    }
}

/// Slopes of an effect as they are elsewhere.
#[derive(Debug)]
pub(super) struct SeenSlopes {
    columns: Vec<Column>,
    of: Arc<Slopes>,
}

impl SeenSlopes {
    /// Whether they are those of a first look.
    pub(super) fn are_rough(&self) -> bool {
        self.of.rough
    }

    /// What each number does, in units of a scatter.
    pub(super) fn in_units_of(&self, scatter: &[Scatter], layout: &Layout) -> Vec<Column> {
        let other = |column: &Column| column.in_other_units(layout, &self.of.scatter, scatter);
        self.columns.iter().map(other).collect()
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;
    use std::sync::atomic::{AtomicU64, Ordering};

    use sim::Setting;

    use super::*;
    use crate::laps::atlas::Extent;
    use crate::laps::part::Shape;
    use crate::laps::testing::{aside, atlas_of, simulated};
    use crate::laps::trial::Trial;

    #[test]
    fn slopes_are_known_wherever_their_parabolas_reach() {
        const SETS: u64 = 6;
        let atlas = atlas_of(&["reflectance-patch"]);
        let patch = Hypothesis::of(Part::screened(&atlas, 0, Shape::Constant, &[1.2]));
        let freedoms = patch.freedoms(&atlas);
        // Laps go aside by 10 x + 2 x^2 mm, by 20 y + 4 y^2 and so on, where x and y are numbers in units of their steps.
        let count = AtomicU64::new(0);
        let bent = |effects: &[Setting], set: u64, extent: Extent| {
            count.fetch_add(1, Ordering::Relaxed);
            let mut part = patch.parts[0].clone();
            part.values[0] = effects[0].values(0, 0).ok()?.0.to_vec();
            let there = Hypothesis::of(part);
            let steps = freedoms
                .iter()
                .map(|freedom| there.apart(&patch, freedom, &atlas) / freedom.step);
            let mm = (1..)
                .map(f64::from)
                .zip(steps)
                .map(|(i, x)| i * (10.0 * x + 2.0 * x * x));
            simulated(&aside(mm.sum()), set, extent)
        };
        let data = atlas
            .observed(&simulated(&aside(0.0), 1000, Extent::Whole).unwrap())
            .unwrap();
        let trial = Trial::new(&atlas, &bent, &data);
        let local = trial.local(&patch, &freedoms, SETS).unwrap();
        let slopes = Arc::new(Slopes::of(0, &patch, &freedoms, &local, false));

        let by = |steps: f64| patch.moved(&atlas, &[(freedoms[0], steps * freedoms[0].step)]);
        let near = by(1.5);
        let there = trial.local(&near, &freedoms, SETS).unwrap();
        let known = BTreeMap::from([(0, slopes.seen_from(&near.parts[0], &atlas).unwrap())]);
        count.store(0, Ordering::Relaxed);
        let again = trial.local_knowing(&known, &near, &freedoms, SETS).unwrap();
        assert_eq!(count.load(Ordering::Relaxed), SETS);
        for (seen, looked) in again.columns.iter().zip(&there.columns) {
            let off = (&seen.slope - &looked.slope).norm();
            assert!(
                off < 0.1 * looked.slope.norm(),
                "{off} of {}",
                looked.slope.norm()
            );
        }
        assert!(slopes.seen_from(&by(2.5).parts[0], &atlas).is_none());
    }
}
