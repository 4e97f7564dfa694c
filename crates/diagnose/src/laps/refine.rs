//! The size of a hypothesis by simulation, and how well it then explains the data.

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use sim::Stage;

use super::atlas::{Atlas, White};
use super::hypothesis::Hypothesis;
use super::likeliest::{Likeliest, Rises};
use super::likelihood::Fit;
use super::parabola::{Column, Local, Nearest};
use super::part::{Freedom, Part, Shape};
use super::rounds::{ERRORS, NEAR, best_of};
use super::screen::price;
use super::simulated::Evaluated;
use super::slopes::{SeenSlopes, Slopes};
use super::tests_of_fit::{Departures, HOPELESS_P, SIGNIFICANT_P};
use super::trial::Trial;
use crate::answer::is_noise;

/// What is simulated in a round of a descent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Round {
    /// The hypothesis and a step to either side in each of its numbers, with a few data sets.
    Rough,
    /// The hypothesis alone; what its numbers do is taken from the rough round.
    Again,
    /// The hypothesis alone, as often as at the end, where an earlier look told what its numbers do; else both sides too, with
    /// as many data sets as sizes and their errors need.
    Full,
}

impl Round {
    /// Data sets at each of so many points: the fewer the more points there are.
    fn sets_around(self, points: u64) -> u64 {
        match self {
            Self::Rough | Self::Again => (16 / points).clamp(3, 4),
            Self::Full => (45 / points).clamp(6, 10),
        }
    }

    /// Data sets by which a hypothesis is compared with itself a step to either side.
    fn sets_of_a_step(self) -> u64 {
        match self {
            Self::Rough => 6,
            Self::Again | Self::Full => self.sets(),
        }
    }

    /// Data sets by which hypotheses are compared after the round; a rough one has no more than it looked by.
    fn sets(self) -> u64 {
        match self {
            Self::Rough | Self::Again => 10,
            Self::Full => END_SETS,
        }
    }
}

/// Data sets simulated of every hypothesis that comes to the end, and of the best and others that explain nearly as much.
const END_SETS: u64 = 16;
pub(super) const CLOSE_SETS: u64 = 64;

/// Errors by which a number may have moved that then is where it should be.
pub(super) const SETTLED: f64 = 0.7;

/// A hypothesis at its most likely sizes.
#[derive(Debug, Clone)]
pub(super) struct Refined {
    pub(super) hypothesis: Hypothesis,
    /// Standard errors of the fitted numbers, the simulation's own error included.
    pub(super) errors: Vec<(Freedom, f64)>,
    /// How these go together.
    pub(super) correlation: DMatrix<f64>,
    pub(super) fit: Fit,
    /// The gain less the price of the fitted numbers.
    pub(super) score: f64,
}

/// A hypothesis at its most likely sizes with what was simulated to judge it.
pub(super) struct Settled {
    pub(super) refined: Refined,
    pub(super) evaluated: Evaluated,
}

/// A hypothesis on its way to its most likely sizes.
#[derive(Debug, Clone)]
pub(super) struct Descent {
    pub(super) hypothesis: Hypothesis,
    freedoms: Vec<Freedom>,
    errors: Vec<f64>,
    /// How these go together.
    correlation: DMatrix<f64>,
    /// Log-likelihood gained over the declared model less the price of the fitted numbers, as the last round saw it.
    pub(super) score: f64,
    /// Standard deviation of that for the simulation's own error.
    pub(super) score_error: f64,
    /// By how much the last round raised the score.
    pub(super) progress: f64,
    /// What it leaves, if the last round tells: neither does a rough one, nor one that looks around several numbers with few data sets.
    pub(super) remainder: Option<Departures>,
    /// What was seen about it, and the moves since.
    near: Option<(Local, DVector<f64>)>,
    /// What was seen of the likelihood itself about its only number.
    rises: Rises,
    /// Where it was last looked around in a full round.
    seen: Option<Seen>,
    /// What this round told of its parts beside other effects.
    given: BTreeMap<usize, Arc<Slopes>>,
    /// How often it was looked around.
    looks: u32,
    /// Whether the moves stayed within the steps of the last look.
    holds: bool,
    /// Whether it is where the likelihood was highest about it.
    rests: bool,
    /// Whether there is nowhere left to descend to.
    found: bool,
    /// What the score was judged by, unless by what steps to all sides told.
    judged: Option<Judged>,
}

/// What a descent's score was judged by.
#[derive(Debug, Clone)]
struct Judged {
    /// The hypothesis before its numbers moved, if they did.
    hypothesis: Hypothesis,
    simulated: Evaluated,
    /// Log-likelihood that its numbers were hoped to gain once they moved.
    hoped: f64,
}

impl Judged {
    /// By the hypothesis as it stays.
    fn staying(hypothesis: &Hypothesis, simulated: Evaluated) -> Self {
        Self {
            hypothesis: hypothesis.clone(),
            simulated,
            hoped: 0.0,
        }
    }
}

/// A hypothesis that was looked around in a full round.
#[derive(Debug, Clone)]
struct Seen {
    hypothesis: Hypothesis,
    simulated: Evaluated,
    /// Log-likelihood gained by it as it is, and the standard deviation of that for the simulation's own error.
    gain: f64,
    error: f64,
}

impl Seen {
    fn new(hypothesis: &Hypothesis, simulated: Evaluated, fit: &Fit) -> Self {
        Self {
            hypothesis: hypothesis.clone(),
            simulated,
            gain: fit.fair_gain(),
            error: fit.gain_error,
        }
    }

    /// Whether this is no better than what led to it, nor so much worse that it went too far: what parabolas promise is noise then.
    fn is_no_better_than(&self, before: &Self) -> bool {
        is_no_better((self.gain, self.error), (before.gain, before.error))
    }
}

/// Log-likelihood by which simulations with the same draws must differ for one to be better.
const BETTER: f64 = 1.0;

/// Whether a gain in log-likelihood is no larger than one before, nor smaller beyond the errors of both.
fn is_no_better((gain, error): (f64, f64), (before, error_before): (f64, f64)) -> bool {
    let gained = gain - before;
    gained < BETTER && -gained < ERRORS * error.hypot(error_before)
}

impl Descent {
    /// A hypothesis before its first round.
    pub(super) fn start(atlas: &Atlas, hypothesis: &Hypothesis) -> Self {
        let freedoms = hypothesis.freedoms(atlas);
        Self {
            hypothesis: hypothesis.clone(),
            errors: vec![f64::INFINITY; freedoms.len()],
            correlation: DMatrix::identity(freedoms.len(), freedoms.len()),
            score: f64::NEG_INFINITY,
            score_error: 0.0,
            progress: f64::INFINITY,
            remainder: None,
            near: None,
            rises: Rises::default(),
            seen: None,
            given: BTreeMap::new(),
            looks: 0,
            holds: false,
            rests: freedoms.is_empty(),
            found: false,
            judged: None,
            freedoms,
        }
    }

    /// The same at a hypothesis with other sizes of what was found by trying many, at which its other numbers do what they did.
    pub(super) fn at(self, hypothesis: Hypothesis) -> Self {
        Self {
            hypothesis,
            rises: Rises::default(),
            seen: None,
            found: false,
            judged: None,
            ..self
        }
    }

    /// The score that another round like the last one would reach, as far as that one's progress was no chance.
    pub(super) fn within_reach(&self) -> f64 {
        let progress = Some(self.progress).filter(|progress| progress.is_finite());
        self.score + (progress.unwrap_or(0.0) - ERRORS * self.score_error).max(0.0)
    }

    /// Whether it lies so far behind the best that no more simulations would bring it near that.
    pub(super) fn is_far_behind(&self, best: &Self) -> bool {
        const FAR: f64 = 2.0 * NEAR;
        self.within_reach() < best.score - FAR.max(self.behind_by_chance(best.score_error))
    }

    /// The log-likelihood by which it may be behind one whose score has such an error, and end near it.
    pub(super) fn behind_by_chance(&self, error: f64) -> f64 {
        const ERRORS_BEHIND: f64 = 2.5;
        ERRORS_BEHIND * error.hypot(self.score_error)
    }

    /// The log-likelihood that it lacks of leaving what chance does, if a round saw what it leaves.
    pub(super) fn missing(&self) -> Option<f64> {
        self.remainder.map(|left| 0.5 * left.excess())
    }

    /// Whether nothing short of another effect would help, as far as a round saw.
    pub(super) fn leaves_far_too_much(&self) -> bool {
        (self.remainder).is_some_and(|left| left.omnibus_p() < HOPELESS_P)
    }

    /// Whether nothing significant is left, as far as a round saw.
    pub(super) fn fits(&self) -> bool {
        self.leaves_more_likely_than(SIGNIFICANT_P)
    }

    /// Whether nothing is left that even hints at another effect, as far as a round saw.
    pub(super) fn leaves_no_hint(&self) -> bool {
        const HINT_P: f64 = 0.1;
        self.leaves_more_likely_than(HINT_P)
    }

    fn leaves_more_likely_than(&self, p: f64) -> bool {
        (self.remainder).is_some_and(|left| left.omnibus_p() >= p)
    }

    /// Whether an earlier look still tells what its numbers do: they moved within its steps, not along noise that another look would
    /// have less of, and little is left, which slopes that are a little off could be taken for.
    fn knows_its_slopes(&self, atlas: &Atlas) -> bool {
        let points = 1 + 2 * self.freedoms.len() as u64;
        let most = atlas.enough(Round::Full.sets_around(points), points);
        let is_clear = |local: &Local| !local.is_noisy() || local.center.summaries.len() as u64 >= most;
        let clear = (self.near.as_ref()).is_some_and(|(local, _)| is_clear(local));
        self.holds && clear && !self.leaves_far_too_much()
    }

    /// The slopes of those of its parts that are known from elsewhere: what this round told, or until it looks around itself an earlier
    /// one.
    fn known_slopes(&self, atlas: &Atlas) -> BTreeMap<usize, SeenSlopes> {
        if self.hypothesis.parts.len() < 2 {
            return BTreeMap::new();
        }
        let known = |(i, part): (usize, &Part)| {
            let slopes = (self.given.get(&i)).or_else(|| self.slopes_from_elsewhere(part, atlas))?;
            Some((i, slopes.seen_from(part, atlas)?))
        };
        let parts = self.hypothesis.parts.iter().enumerate();
        parts.filter_map(known).collect()
    }

    /// What was told of a part with a place elsewhere, until it looks around itself.
    fn slopes_from_elsewhere<'p>(&self, part: &'p Part, atlas: &Atlas) -> Option<&'p Arc<Slopes>> {
        let slopes = part.slopes.as_ref().filter(|slopes| !slopes.rough);
        slopes.filter(|_| self.looks == 0 && atlas.probes[part.probe].has_place())
    }

    /// Has it know what a look around another descent told of those constant effects that are `shared`, but for places that are known
    /// to it from elsewhere.
    pub(super) fn take_slopes_of(&mut self, other: &Self, shared: impl Fn(&Part) -> bool, atlas: &Atlas) {
        let parts = self.hypothesis.parts.iter().enumerate();
        for (i, part) in parts.filter(|(_, part)| part.shape == Shape::Constant && shared(part)) {
            let same = (other.hypothesis.parts.iter()).find(|other| other.probe == part.probe);
            if let Some(slopes) = same.and_then(|same| same.slopes.as_ref())
                && self.slopes_from_elsewhere(part, atlas).is_none()
            {
                self.given.insert(i, Arc::clone(slopes));
            }
        }
    }

    /// Has each of its parts know what a look around told of it.
    fn keep_slopes(&mut self, local: &Local, round: Round, atlas: &Atlas) {
        let rough = round == Round::Rough;
        for i in 0..self.hypothesis.parts.len() {
            let is_known = (self.slopes_from_elsewhere(&self.hypothesis.parts[i], atlas)).is_some();
            if !(rough && is_known) {
                let slopes = Slopes::of(i, &self.hypothesis, &self.freedoms, local, rough);
                self.hypothesis.parts[i].slopes = Some(Arc::new(slopes));
            }
        }
    }

    /// Whether its numbers are about where they are in a hypothesis of the same parts, by their errors.
    pub(super) fn is_within_errors_of(&self, other: &Hypothesis, atlas: &Atlas) -> bool {
        const ERRORS: f64 = 1.5;
        let mut numbers = self.freedoms.iter().zip(&self.errors);
        numbers.all(|(freedom, error)| self.hypothesis.apart(other, freedom, atlas).abs() < ERRORS * error)
    }

    fn errors(&self) -> Vec<(Freedom, f64)> {
        self.freedoms
            .iter()
            .copied()
            .zip(self.errors.iter().copied())
            .collect()
    }
}

impl Trial<'_> {
    /// One round towards the best sizes; `None` where the robot then crashes, and does so a little aside of these sizes too: a crash
    /// in one lap of hundreds does not speak against them.
    pub(super) fn descend(&self, descent: Descent, round: Round) -> Option<Descent> {
        /// Shares of a step.
        const ASIDE: [f64; 2] = [0.1, -0.1];
        let (hypothesis, first) = (descent.hypothesis.clone(), descent.freedoms.first().copied());
        self.descend_from(descent, round).or_else(|| {
            let freedom = first?;
            ASIDE.into_iter().find_map(|share| {
                let aside = hypothesis.moved(self.atlas, &[(freedom, share * freedom.step)]);
                self.descend_from(Descent::start(self.atlas, &aside), round)
            })
        })
    }

    /// One round from where a descent is; `None` where the robot crashes.
    ///
    /// A round simulates the hypothesis at its sizes and a step to either side of each, with the same draws, takes the
    /// means for parabolas in each number, and goes to where these are nearest to the data.
    fn descend_from(&self, descent: Descent, round: Round) -> Option<Descent> {
        if descent.found {
            return Some(Descent {
                progress: 0.0,
                ..descent
            });
        }
        if descent.rests {
            return self.weigh(descent, round);
        }
        // A place is not found on one parabola, nor where it moved beyond the steps of the last.
        let knows_its_place = !descent.hypothesis.has_place(self.atlas) || descent.holds && descent.looks > 1;
        let again = match round {
            Round::Rough => false,
            Round::Again => knows_its_place,
            Round::Full => knows_its_place && descent.knows_its_slopes(self.atlas),
        };
        if again && descent.near.is_some() {
            self.look_again(descent, round)
        } else {
            self.look_around(descent, round)
        }
    }

    /// A descent that rests, simulated as often as the others of the round.
    fn weigh(&self, descent: Descent, round: Round) -> Option<Descent> {
        let center = self.evaluate(&descent.hypothesis, self.atlas.enough(round.sets(), 1))?;
        let fit = self.fit_with_error(&center)?;
        let gain = fit.fair_gain();
        let score = self.atlas.score_of(&descent.hypothesis, gain);
        let found = round == Round::Full;
        Some(Descent {
            score,
            score_error: fit.gain_error,
            progress: score - descent.score,
            remainder: Some(Departures::new(&fit.residual, &self.atlas.layout)),
            found,
            judged: Some(Judged::staying(&descent.hypothesis, center)),
            ..descent
        })
    }

    fn look_around(&self, mut descent: Descent, round: Round) -> Option<Descent> {
        let full = round == Round::Full;
        let known = descent.known_slopes(self.atlas);
        let is_new = |freedom: &&Freedom| !known.contains_key(&freedom.part);
        let points_in = |numbers: usize| 2 * numbers as u64 + 1;
        let points = points_in(descent.freedoms.iter().filter(is_new).count());
        // What is known of others was told by as many data sets as all take, and candidates are compared by the same draws.
        let sets = round.sets_around(points_in(descent.freedoms.len()));
        let sets = self.atlas.enough(sets, points);
        let mut local = self.local_knowing(&known, &descent.hypothesis, &descent.freedoms, sets)?;
        descent.keep_slopes(&local, round, self.atlas);
        let Descent {
            hypothesis, freedoms, ..
        } = &descent;
        let sets = self.atlas.enough(round.sets_of_a_step(), 1);
        if let Some(likeliest) = self.likeliest(hypothesis, freedoms, &local, sets, &descent.rises) {
            return Some(self.atlas.climbed(descent, likeliest, round));
        }
        local.sides.clear();
        let center = if round == Round::Rough {
            local.center.clone()
        } else {
            let sets = self.atlas.enough(round.sets(), 1);
            self.evaluate_more(hypothesis, &local.center, sets)?
        };
        let nearest = self.nearest(&center, &local.scatter, &local.columns, freedoms);
        let (mut here, mut judged) = (None, None);
        let (gain, score_error) = if round == Round::Rough {
            let fit = &nearest.fit;
            let too_little = (self.atlas.least_left(hypothesis) - fit.residual.norm_squared()).max(0.0);
            (fit.fair_gain() - 0.5 * too_little, fit.gain_error)
        } else {
            let fit = self.fit_with_error(&center)?;
            // Several effects go farther than one on parabolas that are a little off.
            if full && hypothesis.parts.len() == 1 {
                let seen = Seen::new(hypothesis, center.clone(), &fit);
                if descent
                    .seen
                    .as_ref()
                    .is_some_and(|before| seen.is_no_better_than(before))
                {
                    return Some(self.atlas.stalled(descent, seen, &nearest.fit.residual));
                }
                here = Some(seen);
            }
            judged = Some(Judged {
                hypothesis: hypothesis.clone(),
                simulated: center,
                hoped: nearest.hoped,
            });
            (self.hoped_gain(hypothesis, &fit, nearest.hoped), fit.gain_error)
        };
        let Descent {
            hypothesis,
            mut freedoms,
            looks,
            ..
        } = descent;
        let correlation = nearest.correlation();
        let Nearest { moves, errors, .. } = nearest;
        // A place that is known was looked around elsewhere.
        let is_known = |part: usize| known.get(&part).is_some_and(|slopes| !slopes.are_rough());
        let knows_place = !known.is_empty() && hypothesis.places(self.atlas).all(is_known);
        let found = full && is_settled(&moves, &nearest.covariance, &freedoms);
        let (hypothesis, moves) = if found && are_at_rest(&moves, &errors) {
            (hypothesis, DVector::zeros(moves.len()))
        } else {
            (self.atlas.with_moves(&hypothesis, &freedoms, &moves), moves)
        };
        let holds = are_within_steps(&moves, &freedoms);
        let remainder = full.then(|| Departures::new(&nearest.fit.residual, &self.atlas.layout));
        for (i, freedom) in freedoms.iter_mut().enumerate() {
            // The parabola should hold where the answer may lie, and be wide enough for the noise of its points not to
            // pass for information.
            let reach = (10.0 * errors[i]).max(moves[i].abs());
            *freedom = freedom.over(reach, (0.2, 1.0));
        }
        let score = self.atlas.score_of(&hypothesis, gain);
        Some(Descent {
            score,
            score_error,
            progress: score - descent.score,
            near: Some((local, moves)),
            rises: Rises::default(),
            seen: here,
            given: BTreeMap::new(),
            looks: looks + 1 + u32::from(knows_place),
            holds,
            rests: false,
            found,
            judged,
            remainder,
            hypothesis,
            freedoms,
            errors,
            correlation,
        })
    }

    fn look_again(&self, descent: Descent, round: Round) -> Option<Descent> {
        let Descent {
            freedoms,
            near,
            looks,
            holds,
            ..
        } = descent;
        let (local, moved) = near?;
        let full = round == Round::Full;
        let center = self.evaluate(&descent.hypothesis, self.atlas.enough(round.sets(), 1))?;
        let columns: Vec<Column> = (local.columns.iter().zip(moved.iter()))
            .map(|(column, moved)| column.from(*moved))
            .collect();
        let nearest = self.nearest(&center, &local.scatter, &columns, &freedoms);
        let fit = self.fit_with_error(&center)?;
        let gain = self.hoped_gain(&descent.hypothesis, &fit, nearest.hoped);
        let correlation = nearest.correlation();
        let Nearest {
            moves, errors, hoped, ..
        } = nearest;
        let found = full && is_settled(&moves, &nearest.covariance, &freedoms);
        let remainder = Some(Departures::new(&nearest.fit.residual, &self.atlas.layout));
        let (hypothesis, moved) = if found && are_at_rest(&moves, &errors) {
            (descent.hypothesis.clone(), moved)
        } else {
            let hypothesis = self.atlas.with_moves(&descent.hypothesis, &freedoms, &moves);
            (hypothesis, moved + moves)
        };
        let score = self.atlas.score_of(&hypothesis, gain);
        Some(Descent {
            score,
            score_error: fit.gain_error,
            progress: score - descent.score,
            remainder,
            holds: holds && are_within_steps(&moved, &freedoms),
            near: Some((local, moved)),
            rises: Rises::default(),
            seen: None,
            given: BTreeMap::new(),
            looks,
            rests: false,
            found,
            judged: Some(Judged {
                hypothesis: descent.hypothesis,
                simulated: center,
                hoped,
            }),
            hypothesis,
            freedoms,
            errors,
            correlation,
        })
    }

    /// The log-likelihood gained by a simulated hypothesis once its numbers have moved, which is hoped to gain so much more: never
    /// so much that less would be left than chance leaves.
    fn hoped_gain(&self, hypothesis: &Hypothesis, fit: &Fit, hoped: f64) -> f64 {
        let most = 0.5 * (fit.residual.norm_squared() - self.atlas.least_left(hypothesis));
        fit.fair_gain() + hoped.min(most.max(0.0))
    }

    /// A hypothesis at its most likely sizes, simulated often enough to judge it, or as it was before a last move that promised more
    /// than it kept; `None` where the robot crashes, and where one of its effects came to nothing.
    pub(super) fn settle(&self, found: &Descent) -> Option<Settled> {
        let hypothesis = self.atlas.quantised(found.hypothesis.clone());
        if !self.atlas.may_be_settled(&hypothesis) {
            return None;
        }
        let sets = self.atlas.enough(END_SETS, 1);
        let (hypothesis, simulated) = match &found.judged {
            Some(judged) if judged.hypothesis == hypothesis => (hypothesis, judged.simulated.clone()),
            judged => {
                let moved = self.evaluate(&hypothesis, sets);
                match (judged.as_ref()).filter(|judged| self.was_better(judged, moved.as_ref())) {
                    Some(judged) => (judged.hypothesis.clone(), judged.simulated.clone()),
                    None => (hypothesis, moved?),
                }
            }
        };
        let end = self.evaluate_more(&hypothesis, &simulated, sets)?;
        self.settled_at(found, hypothesis, end)
    }

    /// A hypothesis as the last round of its descent judged it, before its last move; `None` if it was not judged, or cannot be settled.
    pub(super) fn settle_as_judged(&self, found: &Descent) -> Option<Settled> {
        let judged = found.judged.as_ref()?;
        let hypothesis = judged.hypothesis.clone();
        (self.atlas.may_be_settled(&hypothesis))
            .then(|| self.settled_at(found, hypothesis, judged.simulated.clone()))
            .flatten()
    }

    fn settled_at(&self, found: &Descent, hypothesis: Hypothesis, end: Evaluated) -> Option<Settled> {
        let fit = self.fit_with_error(&end)?;
        let errors = (found.errors(), found.correlation.clone());
        Some(self.atlas.settled(hypothesis, errors, fit, end))
    }

    /// Whether a hypothesis that may be settled was better before its numbers moved to where the robot may crash.
    fn was_better(&self, judged: &Judged, moved: Option<&Evaluated>) -> bool {
        let gain = |simulated: &Evaluated| Some(self.fit(simulated)?.fair_gain());
        let lost =
            gain(&judged.simulated).map(|before| before - moved.and_then(gain).unwrap_or(f64::NEG_INFINITY));
        self.atlas.may_be_settled(&judged.hypothesis) && lost.is_some_and(|lost| lost > BETTER)
    }

    /// Hypotheses that explain the data about as well simulated more often, and told apart by what they do to the mean:
    /// by the scatter only as far as theirs differ by more than chance.
    pub(super) fn settle_rivals(&self, rivals: Vec<Settled>, sets: u64) -> Vec<Settled> {
        let (refined, evaluated): (Vec<Refined>, Vec<Evaluated>) = (rivals.into_par_iter())
            .map(|Settled { refined, evaluated }| {
                // A lap in thousands may crash.
                let more = self.evaluate_more(&refined.hypothesis, &evaluated, sets);
                (refined, more.unwrap_or(evaluated))
            })
            .unzip();
        let fits = self.fits_of_rivals(&evaluated.iter().collect::<Vec<_>>());
        (refined.into_iter().zip(evaluated).zip(fits.unwrap_or_default()))
            .map(|((refined, evaluated), fit)| {
                self.atlas.settled(
                    refined.hypothesis,
                    (refined.errors, refined.correlation),
                    fit,
                    evaluated,
                )
            })
            .collect()
    }

    /// Judges those descents of a round together that are near the best of them: a scatter of its own has an error of its own.
    pub(super) fn judge_together(&self, descents: &mut [Descent]) {
        let Some(best) = best_of(descents) else { return };
        let near = |(place, descent): (usize, &'_ Descent)| {
            let is_near = descent.score > best.score - NEAR.max(descent.behind_by_chance(best.score_error));
            (is_near && descent.judged.is_some()).then_some(place)
        };
        let near: Vec<usize> = descents.iter().enumerate().filter_map(near).collect();
        let judged = near.iter().filter_map(|&place| descents[place].judged.as_ref());
        let (simulated, hoped): (Vec<&Evaluated>, Vec<f64>) =
            judged.map(|judged| (&judged.simulated, judged.hoped)).unzip();
        if simulated.len() < 2 {
            return;
        }
        let fits = self.fits_of_rivals(&simulated).unwrap_or_default();
        for ((place, fit), hoped) in near.into_iter().zip(fits).zip(hoped) {
            let rival = &mut descents[place];
            let gain = self.hoped_gain(&rival.hypothesis, &fit, hoped);
            let score = self.atlas.score_of(&rival.hypothesis, gain);
            rival.progress += score - rival.score;
            rival.score = score;
            rival.score_error = fit.gain_error;
        }
    }
}

impl Atlas {
    /// A descent that came to a hypothesis which is no better than what it came from: the better of the two.
    fn stalled(&self, descent: Descent, here: Seen, left: &White) -> Descent {
        let better = match descent.seen {
            Some(before) if before.gain > here.gain => before,
            _ => here,
        };
        let score = self.score_of(&better.hypothesis, better.gain);
        let judged = Some(Judged::staying(&better.hypothesis, better.simulated));
        Descent {
            score,
            score_error: better.error,
            progress: score - descent.score,
            remainder: Some(Departures::new(left, &self.layout)),
            hypothesis: better.hypothesis,
            rests: true,
            found: true,
            near: None,
            seen: None,
            judged,
            ..descent
        }
    }

    /// A descent of one number moved to where the likelihood is highest about it.
    fn climbed(&self, descent: Descent, to: Likeliest, round: Round) -> Descent {
        let full = round == Round::Full;
        let mut freedoms = descent.freedoms;
        let hypothesis = descent.hypothesis.moved(self, &[(freedoms[0], to.moved)]);
        // Points three errors away tell a top through noise too.
        freedoms[0] = freedoms[0].over(3.0 * to.error, (0.3, 2.0));
        let score = self.score_of(&hypothesis, to.gain + to.hoped);
        Descent {
            score,
            score_error: to.fit.gain_error,
            progress: score - descent.score,
            remainder: (round != Round::Rough).then(|| Departures::new(&to.fit.residual, &self.layout)),
            near: None,
            rises: to.rises,
            seen: None,
            given: BTreeMap::new(),
            looks: descent.looks + 1,
            holds: false,
            // With so few data sets a top may be anywhere.
            rests: to.is_near && round != Round::Rough,
            found: full && to.is_near,
            judged: Some(Judged {
                hypothesis: descent.hypothesis,
                simulated: to.center,
                hoped: to.hoped,
            }),
            errors: vec![to.error],
            correlation: DMatrix::identity(1, 1),
            hypothesis,
            freedoms,
        }
    }

    /// Whether each effect does something, at a size that there is.
    fn may_be_settled(&self, hypothesis: &Hypothesis) -> bool {
        let is_nothing = |part: &Part| part.is_nothing(&self.probes[part.probe]);
        !hypothesis.parts.iter().any(is_nothing) && self.quantised(hypothesis.clone()) == *hypothesis
    }

    /// The least sum of squares that a hypothesis may be hoped to leave of data: what chance leaves in the luckiest case, and in
    /// the mean where sizes jump, of which parabolas promise anything.
    fn least_left(&self, hypothesis: &Hypothesis) -> f64 {
        const DEVIATIONS: f64 = 4.0;
        let count = self.layout.len() as f64;
        let jumps = (hypothesis.parts.iter()).any(|part| self.probes[part.probe].jumps());
        count
            - if jumps {
                0.0
            } else {
                DEVIATIONS * (2.0 * count).sqrt()
            }
    }

    pub(super) fn with_moves(
        &self,
        hypothesis: &Hypothesis,
        freedoms: &[Freedom],
        moves: &DVector<f64>,
    ) -> Hypothesis {
        let by: Vec<(Freedom, f64)> = freedoms.iter().copied().zip(moves.iter().copied()).collect();
        hypothesis.moved(self, &by)
    }

    fn settled(
        &self,
        hypothesis: Hypothesis,
        (errors, correlation): (Vec<(Freedom, f64)>, DMatrix<f64>),
        fit: Fit,
        evaluated: Evaluated,
    ) -> Settled {
        let score = self.score_of(&hypothesis, fit.gain);
        let refined = Refined {
            hypothesis,
            errors,
            correlation,
            fit,
            score,
        };
        Settled { refined, evaluated }
    }

    /// What counts of a gain in log-likelihood, less what the hypothesis pays for it.
    pub(super) fn score_of(&self, hypothesis: &Hypothesis, gain: f64) -> f64 {
        hypothesis.worth(gain) - self.price_of(hypothesis)
    }

    /// What a hypothesis pays for its fitted numbers, for the choice of its probes, and for what robots hardly do.
    fn price_of(&self, hypothesis: &Hypothesis) -> f64 {
        /// A program's constants can be read in it: one in three that they are not what was declared rather than what does the same.
        const KNOWN_CONSTANT: f64 = 1.1;
        /// A program's constants stay what they are, and so does an axle: one in twenty that it is not another cause that changes.
        const CHANGING_CONSTANT: f64 = 3.0;
        /// What slips more in one moment does not slip less in the next: laps tell that from less slip as little as memory from more.
        const SWINGING_SLIP: f64 = 3.0;
        /// Sensors and cameras that have hardly any of their noise: one in twenty that it is not another cause that takes from it.
        const HARDLY_ANY_NOISE: f64 = 3.0;
        const HARDLY_ANY: f64 = 0.2;
        let of_part = |part: &Part| {
            let spec = self.probes[part.probe].spec;
            let swings = spec.name == "slip-memory" && part.mean_size(self) < 0.0;
            let changes =
                part.shape != Shape::Constant && (spec.name == "axle-length" || spec.stage == Stage::Decide);
            let is_known = spec.stage == Stage::Decide;
            let is_quiet =
                is_noise(spec.name) && spec.stage != Stage::Act && part.mean_size(self) < HARDLY_ANY;
            self.choice(part.probe)
                + if is_quiet { HARDLY_ANY_NOISE } else { 0.0 }
                + if is_known { KNOWN_CONSTANT } else { 0.0 }
                + if changes { CHANGING_CONSTANT } else { 0.0 }
                + if swings { SWINGING_SLIP } else { 0.0 }
        };
        let parts: f64 = hypothesis.parts.iter().map(of_part).sum();
        price(hypothesis.fitted(self), self.layout.total_laps()) + parts
    }

    /// Sizes that come in steps brought to the nearest.
    pub(super) fn quantised(&self, mut hypothesis: Hypothesis) -> Hypothesis {
        for part in &mut hypothesis.parts {
            let probe = &self.probes[part.probe];
            if let Some(quantum) = probe.quantum {
                let i = probe.free[0].0;
                part.values
                    .iter_mut()
                    .for_each(|values| values[i] = (values[i] / quantum).round() * quantum);
            }
        }
        hypothesis
    }
}

/// Whether numbers stayed where their parabolas were made.
pub(super) fn are_within_steps(moves: &DVector<f64>, freedoms: &[Freedom]) -> bool {
    (moves.iter().zip(freedoms)).all(|(moved, freedom)| moved.abs() < freedom.step)
}

/// Whether numbers are off by so little that they are left as they are: by an eighth of a unit each.
fn are_at_rest(moves: &DVector<f64>, errors: &[f64]) -> bool {
    const AT_REST: f64 = 0.5;
    (moves.iter().zip(errors)).all(|(moved, error)| moved.abs() < AT_REST * error)
}

/// Whether numbers moved so little that there is nowhere left to go.
fn is_settled(moves: &DVector<f64>, covariance: &DMatrix<f64>, freedoms: &[Freedom]) -> bool {
    /// Errors by which a number may still have moved if the points of its parabola lie so many times farther out.
    const WITHIN: (f64, f64) = (3.0, 4.0);
    (0..moves.len()).all(|i| {
        let (moved, error) = (moves[i].abs(), covariance[(i, i)].sqrt());
        moved < SETTLED * error || moved < WITHIN.0 * error && WITHIN.1 * moved < freedoms[i].step
    })
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::sync::Mutex;

    use sim::Setting;

    use super::*;
    use crate::laps::atlas::Extent;
    use crate::laps::probe::Probe;
    use crate::laps::testing::{aside, atlas, atlas_of, simulated};

    #[test]
    fn a_last_move_that_promised_more_than_it_kept_is_taken_back() {
        let atlas = atlas();
        let runs = simulated(&aside(1.3), 1000, Extent::Whole).unwrap();
        let data = atlas.observed(&runs).unwrap();
        let at = |mm: f64| Hypothesis::of(Part::screened(&atlas, 0, Shape::Constant, &[mm]));
        let trial = Trial::new(&atlas, &simulated, &data);
        let settled = |before_mm: f64, after_mm: f64| {
            let before = at(before_mm);
            let judged = Judged::staying(&before, trial.evaluate(&before, END_SETS).unwrap());
            let descent = Descent {
                judged: Some(judged),
                ..Descent::start(&atlas, &at(after_mm))
            };
            trial.settle(&descent).unwrap().refined.hypothesis
        };
        assert_eq!(settled(1.3, 0.8), at(1.3));
        assert_eq!(settled(0.8, 1.3), at(1.3));
    }

    #[test]
    fn a_crash_now_and_then_does_not_speak_against_sizes() {
        let atlas = atlas();
        let runs = simulated(&aside(1.3), 1000, Extent::Whole).unwrap();
        let data = atlas.observed(&runs).unwrap();
        let at = |mm: f64| Hypothesis::of(Part::screened(&atlas, 0, Shape::Constant, &[mm]));
        let sets = atlas.enough(END_SETS, 1);
        // At one size at once, elsewhere in a later data set, and from a size on always.
        let crashing = |effects: &[Setting], set: u64, extent: Extent| {
            let crashes = |mm: f64| mm == 1.2 || mm > 1.5 || set >= sets;
            let stops = (effects.iter())
                .any(|effect| effect.values(0, 0).is_ok_and(|(values, _)| crashes(values[0])));
            simulated(effects, set, extent).filter(|_| !stops)
        };
        let trial = Trial::new(&atlas, &crashing, &data);
        let descended = |mm: f64| trial.descend(Descent::start(&atlas, &at(mm)), Round::Rough);
        assert!(trial.evaluate(&at(1.2), 3).is_none());
        assert!(descended(1.2).is_some() && descended(1.8).is_none());
        let before = at(1.3);
        let judged = Judged::staying(&before, trial.evaluate(&before, sets).unwrap());
        let moved = Descent {
            judged: Some(judged),
            ..Descent::start(&atlas, &at(1.2))
        };
        let settled = trial.settle(&moved).unwrap();
        assert_eq!(settled.refined.hypothesis, before);
        let rivals = trial.settle_rivals(vec![settled], CLOSE_SETS);
        assert_eq!(rivals[0].evaluated.summaries.len() as u64, sets);
    }

    #[test]
    fn noisy_slopes_are_looked_at_again_only_by_more_data_sets() {
        let atlas = atlas();
        let runs = simulated(&aside(1.3), 1000, Extent::Whole).unwrap();
        let data = atlas.observed(&runs).unwrap();
        // Above a size other draws are met.
        let noisy = |effects: &[Setting], set: u64, extent: Extent| {
            let is_above =
                (effects.iter()).any(|effect| effect.values(0, 0).is_ok_and(|(values, _)| values[0] > 1.3));
            simulated(effects, if is_above { set + 500 } else { set }, extent)
        };
        let trial = Trial::new(&atlas, &noisy, &data);
        let there = Hypothesis::of(Part::screened(&atlas, 0, Shape::Constant, &[1.3]));
        let mut descent = Descent::start(&atlas, &there);
        descent.freedoms[0].step = 0.01;
        descent.holds = true;
        let enough = atlas.enough(Round::Full.sets_around(3), 3);
        for (sets, knows) in [(enough - 1, false), (enough, true)] {
            let local = trial.local(&there, &descent.freedoms, sets).unwrap();
            assert!(local.is_noisy());
            descent.near = Some((local, DVector::zeros(1)));
            assert_eq!(descent.knows_its_slopes(&atlas), knows, "{sets}");
        }
    }

    #[test]
    fn what_an_effect_does_is_looked_at_once_for_all_that_share_it() {
        let atlas = atlas_of(&["reflectance-patch", "wheel-scale", "axle-length"]);
        let runs = simulated(&aside(1.3), 1000, Extent::Whole).unwrap();
        let data = atlas.observed(&runs).unwrap();
        let part = |effect: &str| {
            let is_it = |probe: &Probe| probe.spec.name == effect;
            let probe = atlas.probes.iter().position(is_it).unwrap();
            Part::screened(&atlas, probe, Shape::Constant, &[1.2])
        };
        let beside = |effect: &str| Hypothesis {
            parts: vec![part("reflectance-patch"), part(effect)],
        };
        let asked = Mutex::new(BTreeSet::new());
        let counting = |effects: &[Setting], set: u64, extent: Extent| {
            asked.lock().unwrap().insert(format!("{effects:?}"));
            simulated(effects, set, extent)
        };
        let trial = Trial::new(&atlas, &counting, &data);
        let points = |descent: Descent| {
            asked.lock().unwrap().clear();
            let after = trial.descend(descent, Round::Rough).unwrap();
            (after, asked.lock().unwrap().len())
        };
        // A patch has a factor, a place and a length.
        let (first, all) = points(Descent::start(&atlas, &beside("wheel-scale")));
        assert_eq!(all, 1 + 2 * 4);
        let mut other = Descent::start(&atlas, &beside("axle-length"));
        other.take_slopes_of(&first, |_| true, &atlas);
        let (other, own) = points(other);
        assert_eq!(own, 1 + 2);
        // A first look does not find a place: it is looked around again.
        assert_eq!(other.looks, 1);
    }

    #[test]
    fn what_gains_nothing_within_noise_is_no_better() {
        // Twice the error of the difference is 8.5.
        for (gain, no_better) in [(102.0, false), (100.5, true), (92.0, true), (91.0, false)] {
            assert_eq!(is_no_better((gain, 3.0), (100.0, 3.0)), no_better, "{gain}");
        }
    }
}
