//! What explains best what a hypothesis leaves.

use std::collections::BTreeMap;

use rayon::prelude::*;
use sim::Setting;

use super::atlas::{Atlas, White, in_other_units, white};
use super::expectation::{Expectation, Scatter};
use super::hypothesis::Hypothesis;
use super::parabola::groups;
use super::part::{Freedom, Part};
use super::path::Node;
use super::screen::{Screened, without_directions};
use super::search::{Found, Search, WEAK};
use super::simulated::Draws;
use super::trial::Trial;
use crate::remembered::NO_PANIC;

/// A hypothesis beside which another effect is sought.
#[derive(Debug, Clone)]
pub(super) struct Base {
    pub(super) hypothesis: Hypothesis,
    units: Units,
    /// What its numbers do, as orthonormal directions in these units: they follow the other effect. None if they stay.
    following: Vec<White>,
}

/// What goes with a hypothesis, as simulations beside it told.
#[derive(Debug, Clone)]
pub(super) struct Heard {
    base: Base,
    /// What it leaves of the data, in units of the declared model's scatter.
    left: White,
    /// Further effects, best first.
    pub(super) others: Vec<Screened>,
}

/// What goes with a single effect, whose numbers have such standard errors.
pub(super) type HeardBesideSingle = (Heard, Vec<(Freedom, f64)>);

/// In units of which scatter what is left beside a hypothesis has to stand out.
#[derive(Debug, Clone)]
enum Units {
    /// The declared model's.
    Declared,
    /// The declared model's, whose entries turned have variances with such logarithms: how the hypothesis' recordings scatter, as a few
    /// data sets tell it.
    Widened(White),
    /// The hypothesis' own, as well as many data sets tell it.
    Own(Vec<Scatter>),
}

impl Units {
    fn scatter<'a>(&'a self, atlas: &'a Atlas) -> &'a [Scatter] {
        match self {
            Self::Own(own) => own,
            Self::Declared | Self::Widened(_) => &atlas.scatter,
        }
    }

    /// How much more there is than in this scatter.
    fn widened(&self) -> Option<&White> {
        match self {
            Self::Widened(widened) => Some(widened),
            Self::Declared | Self::Own(_) => None,
        }
    }
}

impl Base {
    /// The same in units of another scatter, if there is one.
    pub(super) fn in_units_of(self, scatter: Option<Vec<Scatter>>) -> Self {
        match scatter {
            Some(scatter) => Self {
                units: Units::Own(scatter),
                ..self
            },
            None => self,
        }
    }

    /// What no change of its numbers explains.
    fn beyond(&self, left: White) -> White {
        without_directions(left, &self.following)
    }
}

impl Heard {
    /// Whether it was told beside an effect where that is, by such errors: beyond what its numbers do the same is left.
    fn is_beside(&self, effect: &Part, errors: &[(Freedom, f64)], atlas: &Atlas) -> bool {
        let known = &self.base.hypothesis;
        let [part] = known.parts.as_slice() else {
            return false;
        };
        let there = Hypothesis::of(effect.clone());
        let mut numbers = errors.iter();
        (part.probe, part.shape) == (effect.probe, effect.shape)
            && effect.is_within_error_of(part)
            && numbers.all(|(freedom, error)| there.apart(known, freedom, atlas).abs() <= *error)
    }
}

impl Trial<'_> {
    /// A hypothesis whose numbers follow an effect beside it, in units of the declared model's scatter.
    pub(super) fn following(&self, hypothesis: Hypothesis) -> Base {
        Base {
            units: Units::Declared,
            following: self.directions(&hypothesis, &self.atlas.scatter),
            hypothesis,
        }
    }

    /// A hypothesis whose numbers follow an effect beside it, in units of its own scatter if it explains nearly all.
    pub(super) fn base(&self, hypothesis: Hypothesis) -> Base {
        let units = self.units_of(&hypothesis).unwrap_or(Units::Declared);
        Base {
            following: self.directions(&hypothesis, units.scatter(self.atlas)),
            hypothesis,
            units,
        }
    }

    /// Units of what is left beside a hypothesis; `None` where the robot crashes.
    fn units_of(&self, hypothesis: &Hypothesis) -> Option<Units> {
        const SETS: u64 = 10;
        const NEARLY_ALL: f64 = 0.95;
        let evaluated = self.evaluate(hypothesis, SETS)?;
        let excess = |scatter: &[Scatter], from: &Expectation| {
            let left = white(scatter, &self.atlas.layout, self.data, from);
            left.norm_squared() - self.atlas.layout.len() as f64
        };
        let own = (self.atlas.scatter_of(evaluated.summaries.iter(), 1)).filter(|own| {
            excess(own, &evaluated.expectation) < (1.0 - NEARLY_ALL) * excess(own, &self.atlas.null)
        });
        Some(match own {
            Some(own) => Units::Own(own),
            None => Units::Widened(self.atlas.widened(&evaluated.summaries)),
        })
    }

    /// What the numbers of a hypothesis do, as orthonormal directions in units of a scatter.
    fn directions(&self, hypothesis: &Hypothesis, scatter: &[Scatter]) -> Vec<White> {
        const SETS: u64 = 4;
        let layout = &self.atlas.layout;
        let simulated = |group: &[Freedom]| -> Option<Vec<White>> {
            let at = |sign: f64| {
                let moves: Vec<(Freedom, f64)> = group.iter().map(|f| (*f, sign * f.step)).collect();
                let moved = hypothesis.moved(self.atlas, &moves);
                self.simulated_plainly(&moved.settings(self.atlas), 0..SETS)
            };
            let action = white(scatter, layout, &at(1.0)?, &at(-1.0)?);
            Some(group.iter().map(|f| f.own_share(&action, layout)).collect())
        };
        let of_part = |freedoms: &[Freedom]| -> Vec<White> {
            let part = &hypothesis.parts[freedoms[0].part];
            let seen = part
                .slopes
                .as_ref()
                .and_then(|slopes| slopes.seen_from(part, self.atlas));
            match seen {
                Some(seen) => (seen.in_units_of(scatter, layout).into_iter())
                    .map(|column| column.slope)
                    .collect(),
                None => groups(freedoms)
                    .iter()
                    .filter_map(|group| simulated(group))
                    .flatten()
                    .collect(),
            }
        };
        let freedoms = hypothesis.freedoms(self.atlas);
        let parts = freedoms.chunk_by(|a, b| a.part == b.part);
        let mut directions: Vec<White> = Vec::new();
        for along in parts.flat_map(of_part) {
            directions.extend(without_directions(along, &directions).try_normalize(f64::MIN_POSITIVE));
        }
        directions
    }

    /// What an expectation leaves of the data, in units of a base's scatter, but for what the base's numbers can follow.
    pub(super) fn left_beyond(&self, base: &Base, expected: &Expectation) -> White {
        let scatter = base.units.scatter(self.atlas);
        let left = white(scatter, &self.atlas.layout, self.data, expected);
        self.without_silent(base.beyond(self.without_silent(left)))
    }

    /// What is left where entries have a say.
    pub(super) fn without_silent(&self, mut left: White) -> White {
        for range in self.silent {
            left.rows_mut(range.start, range.len()).fill(0.0);
        }
        left
    }

    /// What simulations by some draws leave of the data with further settings beside a base; see [`Trial::left_beyond`]. `None`
    /// where the robot crashes.
    pub(super) fn left_beside(&self, base: &Base, further: &[Setting], draws: &Draws) -> Option<White> {
        let mut settings = base.hypothesis.settings(self.atlas);
        settings.extend_from_slice(further);
        let found = self.simulated_by(&settings, draws)?;
        Some(self.left_beyond(base, &found))
    }

    /// The same by two draws: if these are different, products of what they leave have no noise on average.
    pub(super) fn left_twice(
        &self,
        base: &Base,
        further: &[Setting],
        draws: &[Draws; 2],
    ) -> Option<[White; 2]> {
        twice(draws, |draws| self.left_beside(base, further, draws))
    }
}

impl Atlas {
    /// A hypothesis whose numbers stay as they are, in units of the declared model's scatter.
    pub(super) fn at_rest(&self, hypothesis: Hypothesis) -> Base {
        Base {
            hypothesis,
            units: Units::Declared,
            following: Vec::new(),
        }
    }

    /// Every probe in every pattern at its size that explains most of what a base leaves, but for what the base's numbers can
    /// follow, best first. What is left is given in units of the declared model's scatter.
    fn screen_beside(&self, base: &Base, left: &White) -> Vec<Screened> {
        let beyond = |white: &White| self.beyond(base, white);
        self.screen_by(&beyond(left), beyond, base.units.widened())
    }

    /// A vector in units of the declared model's scatter in those of a base's, but for what the base's numbers can follow.
    pub(super) fn beyond(&self, base: &Base, white: &White) -> White {
        base.beyond(match &base.units {
            Units::Own(own) => in_other_units(white, &self.layout, &self.scatter, own),
            Units::Declared | Units::Widened(_) => white.clone(),
        })
    }
}

impl Search<'_> {
    /// A base with each of the effects that explain best what it leaves, but for those that were tried and for those that
    /// jump: [`Search::scans_beside`] is for these.
    pub(super) fn beside(&self, base: Base, left: White, tried: &[Hypothesis]) -> Vec<Hypothesis> {
        self.with_heard(&self.hear(base, left), tried)
    }

    /// The same of what was heard already.
    pub(super) fn with_heard(&self, heard: &Heard, tried: &[Hypothesis]) -> Vec<Hypothesis> {
        const FURTHER: usize = 3;
        /// The same where more are about as good as the best, or of a weak signal, of which what was heard tells less.
        const MOST: usize = 5;
        /// Log-likelihood by which what was heard may be behind and turn out as good.
        const NEAR: f64 = 10.0;
        let gain = self.gained(heard.left.norm_squared());
        let shortlist = self.shortlist(&heard.others);
        let near = |other: &&&Screened| other.score > shortlist[0].score - NEAR;
        let further = if gain < WEAK {
            MOST
        } else {
            shortlist.iter().filter(near).count().clamp(FURTHER, MOST)
        };
        let start = &heard.base.hypothesis;
        (shortlist.iter())
            .map(|other| (other.score, start.with(&other.hypothesis)))
            // A pattern may cost more than all that a further effect gains.
            .filter(|(score, pair)| pair.worth(gain + score) > start.worth(gain))
            .map(|(_, pair)| pair)
            .filter(|pair| !tried.iter().any(|other| other.probes() == pair.probes()))
            .take(further)
            .collect()
    }

    /// What goes with a base.
    fn hear(&self, base: Base, left: White) -> Heard {
        let screened = self.screened_beside(&base, &left);
        self.hear_screened(base, left, screened)
    }

    /// The same of what was screened beside it.
    pub(super) fn hear_screened(&self, base: Base, left: White, screened: Vec<Screened>) -> Heard {
        let others = self.heard_beside(&base, screened);
        Heard { base, left, others }
    }

    /// What explains best what a base leaves, by paths: effects of its own and those that jump are left out.
    pub(super) fn screened_beside(&self, base: &Base, left: &White) -> Vec<Screened> {
        let mut screened = self.atlas().screen_beside(base, left);
        screened
            .retain(|other| !self.shares_effect(other, &base.hypothesis) && !self.jumps(&other.hypothesis));
        screened
    }

    /// The best of what was screened beside a base, at the sizes and with the scores that simulations give them: paths were
    /// simulated without the base, and actions do not quite add up. One group of data sets tells of which another is worth it.
    fn heard_beside(&self, base: &Base, screened: Vec<Screened>) -> Vec<Screened> {
        const HEARD: usize = 16;
        const HEARD_TWICE: usize = 8;
        const OF_ONE_EFFECT: usize = 2;
        const SHARE: f64 = 0.4;
        /// Data sets whose noise is not the same.
        const DRAWS: [Draws; 2] = [Draws::Sets(0..4), Draws::Sets(4..8)];
        let atlas = self.atlas();
        let spec_of = |probe: usize| atlas.probes[probe].spec;
        let left = |further: &[Setting], draws: &Draws| {
            let left = self.trial.left_beside(base, further, draws)?;
            Some(atlas.turned(&left))
        };
        let [by_first, by_second] = DRAWS.each_ref().map(|draws| left(&[], draws));
        let (Some(best), Some(by_first), Some(by_second)) = (screened.first(), by_first, by_second) else {
            return screened;
        };
        let mut heard: Vec<&Screened> = Vec::new();
        for candidate in screened.iter().filter(|candidate| candidate.may_win(best, SHARE)) {
            let probe = candidate.probe();
            let is_known = heard.iter().any(|other| other.probe() == probe);
            let alike = (heard.iter()).filter(|other| spec_of(other.probe()) == spec_of(probe));
            if heard.len() < HEARD && !is_known && alike.count() < OF_ONE_EFFECT {
                let constant = |s: &&Screened| s.probe() == probe && s.hypothesis.is_constant();
                heard.extend(screened.iter().find(constant));
            }
        }
        // With the first group alone its noise, which candidates share, counts as gained.
        let once = [by_first.clone(), by_first.clone()];
        let mut first: Vec<(&Screened, White, f64)> = (heard.into_par_iter())
            .filter_map(|constant| {
                let with = left(&constant.hypothesis.settings(atlas), &DRAWS[0])?;
                let (_, gain) = self.gain_beside(base, constant, &once, &[with.clone(), with.clone()]);
                Some((constant, with, atlas.score_of_constant(constant.probe(), gain)))
            })
            .collect();
        first.sort_by(|a, b| b.2.total_cmp(&a.2));
        first.truncate(HEARD_TWICE);
        let without = [by_first, by_second];
        let simulated: BTreeMap<usize, (f64, f64)> = (first.into_par_iter())
            .filter_map(|(constant, with, _)| {
                let probe = constant.probe();
                let again = left(&constant.hypothesis.settings(atlas), &DRAWS[1])?;
                let (multiple, gain) = self.gain_beside(base, constant, &without, &[with, again]);
                let score = atlas.score_of_constant(probe, gain);
                Some((probe, (multiple, score - constant.score)))
            })
            .collect();
        let corrected = |mut candidate: Screened| {
            let &(multiple, change) = simulated.get(&candidate.probe())?;
            candidate.score += change;
            if candidate.hypothesis.is_constant() {
                candidate.hypothesis.parts[0] = candidate.hypothesis.parts[0].times(multiple, atlas);
            }
            Some(candidate)
        };
        let mut all: Vec<Screened> = screened.into_iter().filter_map(corrected).collect();
        all.sort_by(|a, b| b.score.total_cmp(&a.score));
        all
    }

    /// The multiple of a constant effect beside a base that explains most of what that leaves, and what it gains, by what is left
    /// without it and with it, turned, each by two groups of data sets; it scatters as its path says.
    fn gain_beside(
        &self,
        base: &Base,
        constant: &Screened,
        without: &[White; 2],
        with: &[White; 2],
    ) -> (f64, f64) {
        let atlas = self.atlas();
        let probe = constant.probe();
        let path = atlas.path(probe, &atlas.nodes(probe), base.units.widened());
        let [before, after] = [
            atlas.probes[probe].neutral,
            constant.hypothesis.parts[0].mean_size(atlas),
        ]
        .map(|size| path.at(size));
        let in_units_of = |node: &Node, left: &[White; 2]| {
            let deviations = node.widened.map(|widened| (-0.5 * widened).exp());
            left.each_ref().map(|left| left.component_mul(&deviations))
        };
        let deviance = |node: &Node, left: &[White; 2]| left[0].dot(&left[1]) + node.widened.sum();
        let [without_before, without, with] = [
            in_units_of(&before, without),
            in_units_of(&after, without),
            in_units_of(&after, with),
        ];
        let (multiple, gain) = explains(&difference(&without, &with), &without, false);
        let narrower = deviance(&before, &without_before) - deviance(&after, &without);
        (multiple, gain + 0.5 * narrower)
    }

    /// Explanations with the effects that explain best what each of them leaves, but for those hypotheses that were tried.
    pub(super) fn beside_found<'f>(
        &self,
        bases: impl Iterator<Item = &'f Found>,
        tried: &[Hypothesis],
    ) -> Vec<Hypothesis> {
        let mut all = tried.to_vec();
        for found in bases {
            self.tell(format_args!("what is beside {}", found.explanation.label()));
            let base = self.trial.base(found.hypothesis.clone());
            let heard = self.hear(base, found.left.clone());
            all.extend(self.with_heard(&heard, &all));
            self.remember(heard, found);
        }
        all.split_off(tried.len())
    }

    /// Effects with those that explain best what each of them leaves, but for those pairs that were tried: actions do not quite add up,
    /// and of effects that do about the same the best few were tried.
    pub(super) fn beside_each(&self, effects: &[Part], tried: &[Hypothesis]) -> Vec<Hypothesis> {
        let mut all = tried.to_vec();
        for effect in effects {
            if let Some(heard) = self.heard_before(effect) {
                all.extend(self.with_heard(&heard, &all));
                continue;
            }
            let alone = Hypothesis::of(effect.clone());
            if let Some(left) = self.left_by(&alone) {
                all.extend(self.beside(self.trial.base(alone), left, &all));
            }
        }
        all.split_off(tried.len())
    }

    /// Keeps what was heard beside a single effect.
    pub(super) fn remember(&self, heard: Heard, single: &Found) {
        let mut known = self.heard.lock().expect(NO_PANIC);
        known.push((heard, single.errors.clone()));
    }

    /// What was heard beside an effect already, if that is where it was.
    fn heard_before(&self, effect: &Part) -> Option<Heard> {
        let known = self.heard.lock().expect(NO_PANIC);
        let mut known = known.iter();
        let (heard, _) = known.find(|(heard, errors)| heard.is_beside(effect, errors, self.atlas()))?;
        Some(heard.clone())
    }

    /// What a hypothesis leaves of the data, in units of the declared model's scatter; `None` where the robot crashes.
    pub(super) fn left_by(&self, hypothesis: &Hypothesis) -> Option<White> {
        const SETS: u64 = 10;
        if hypothesis.parts.is_empty() {
            return Some(self.residual.clone());
        }
        let evaluated = self.trial.evaluate(hypothesis, SETS)?;
        Some(self.atlas().white(self.trial.data, &evaluated.expectation))
    }

    fn shares_effect(&self, screened: &Screened, start: &Hypothesis) -> bool {
        let spec = |part: &Part| self.atlas().probes[part.probe].spec;
        let own = spec(&screened.hypothesis.parts[0]);
        start.parts.iter().any(|part| spec(part) == own)
    }
}

/// What two draws leave, which are looked at once if they are the same.
pub(super) fn twice(draws: &[Draws; 2], left: impl Fn(&Draws) -> Option<White>) -> Option<[White; 2]> {
    let first = left(&draws[0])?;
    let second = if draws[0] == draws[1] {
        first.clone()
    } else {
        left(&draws[1])?
    };
    Some([first, second])
}

/// What one thing leaves less what another does, each by two groups of data sets.
pub(super) fn difference(one: &[White; 2], other: &[White; 2]) -> [White; 2] {
    [0, 1].map(|i| &one[i] - &other[i])
}

/// The multiple of an action that explains most of what is left, and half the squared distance that it gains, both by two groups
/// of data sets; of an odd action it may be negative.
pub(super) fn explains(action: &[White; 2], left: &[White; 2], odd: bool) -> (f64, f64) {
    let product = 0.5 * (left[0].dot(&action[1]) + left[1].dot(&action[0]));
    best_multiple(product, action[0].dot(&action[1]), odd)
}

/// The multiple of an action that explains most, by its product with what is to be explained and its square, and half the squared
/// distance that it gains. It is not more than twice as much as was simulated.
fn best_multiple(product: f64, square: f64, odd: bool) -> (f64, f64) {
    const MOST: f64 = 2.0;
    // Noise alone may make a square negative.
    if square <= 0.0 {
        return (0.0, 0.0);
    }
    let least = if odd { -MOST } else { 0.0 };
    let multiple = (product / square).clamp(least, MOST);
    (multiple, multiple * product - 0.5 * multiple * multiple * square)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::laps::part::Shape;
    use crate::laps::testing::atlas_of;

    #[test]
    fn what_was_heard_beside_an_effect_holds_within_the_errors_of_its_size() {
        let atlas = atlas_of(&["wheel-scale", "turn-scrub"]);
        let effect = |probe: usize, size: f64| Part::screened(&atlas, probe, Shape::Constant, &[size]);
        let single = Hypothesis::of(effect(0, 1.05));
        let errors: Vec<(Freedom, f64)> = (single.freedoms(&atlas).into_iter())
            .map(|freedom| (freedom, 0.01))
            .collect();
        assert_eq!(errors.len(), 1);
        let heard = |hypothesis: Hypothesis| Heard {
            base: atlas.at_rest(hypothesis),
            left: White::zeros(1),
            others: Vec::new(),
        };
        let is_beside = |effect: &Part| heard(single.clone()).is_beside(effect, &errors, &atlas);
        assert!(is_beside(&effect(0, 1.042)) && is_beside(&effect(0, 1.058)));
        assert!(!is_beside(&effect(0, 1.038)) && !is_beside(&effect(0, 1.062)));
        assert!(!is_beside(&effect(1, 1.05)));
        let pair = single.with(&Hypothesis::of(effect(1, 1.05)));
        assert!(!heard(pair).is_beside(&effect(0, 1.05), &errors, &atlas));
    }

    #[test]
    fn a_multiple_is_the_vertex_of_a_parabola_within_bounds() {
        // |(3, 4) - m (2, 0)|^2 is least at m = 1.5, and 9 less than at 0.
        assert_eq!(best_multiple(6.0, 4.0, false), (1.5, 4.5));
        assert_eq!(best_multiple(20.0, 4.0, false), (2.0, 32.0));
        assert_eq!(best_multiple(-6.0, 4.0, false), (0.0, 0.0));
        assert_eq!(best_multiple(-6.0, 4.0, true), (-1.5, 4.5));
        for product in [-1.0, 1.0] {
            assert_eq!(best_multiple(product, -0.5, true), (0.0, 0.0));
        }
    }
}
