//! The answer: which effects, how sure, what else it could be.

use rayon::prelude::*;
use sim::Setting;

use super::atlas::{Atlas, Simulate, White, observed};
use super::expectation::Expectation;
use super::hypothesis::{Hypothesis, Shape};
use super::refine::{Descended, Refined};
use super::screen::Screened;
use super::summary::Summary;
use super::tests_of_fit::FourNumbers;
use crate::{Candidate, Error};

/// Score of the best probe from which a data set counts as departing from the declared model, whatever the omnibus says.
const ALARM_SCORE: f64 = 7.0;
/// Omnibus probability below which it does.
const ALARM_P: f64 = 0.002;
/// Probability of the fit below which a remainder is significant.
const SIGNIFICANT_P: f64 = 0.001;
/// Share of the excess that an explanation must explain to stand in spite of a significant remainder.
const ENOUGH: f64 = 0.98;
/// Hypotheses within this log-likelihood of the best are reported as alternatives.
const ALTERNATIVE: f64 = 5.0;
/// Log-likelihood that each number of a further effect must gain.
const WORTH: f64 = 10.0;

/// How much of the residual is explained.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Nothing significant is left out of the declared model.
    Faithful,
    /// The effects leave nothing that matters.
    Explained,
    /// They help; a remainder is significant and matters.
    PartlyExplained,
    /// No name would be honest.
    Unexplained,
}

/// One explanation that was tried to the end.
#[derive(Debug, Clone)]
pub struct Explanation {
    /// The effects with their sizes.
    pub effects: Vec<Candidate>,
    /// What they are, for a reader.
    pub label: String,
    hypothesis: Hypothesis,
    /// Log-likelihood gained over the declared model less the price of the fitted numbers.
    pub score: f64,
    /// Log-likelihood gained.
    pub gain: f64,
    /// Share of the excess over the declared model's expectation that it explains.
    pub share: f64,
    /// What remains.
    pub remainder: FourNumbers,
}

impl Explanation {
    /// Whether it leaves nothing significant, or next to nothing.
    fn suffices(&self) -> bool {
        self.remainder.omnibus_p() >= SIGNIFICANT_P || self.share >= ENOUGH
    }

    /// The effects as the simulator takes them.
    pub fn settings(&self) -> Vec<Setting> {
        self.effects.iter().map(|effect| effect.setting.clone()).collect()
    }

    /// The effects' names.
    pub fn names(&self) -> Vec<&'static str> {
        self.effects
            .iter()
            .map(|effect| effect.setting.spec.name)
            .collect()
    }
}

/// What laps tell about a model.
#[derive(Debug, Clone)]
pub struct Diagnosis {
    /// In a word.
    pub verdict: Verdict,
    /// How the data depart from the declared model.
    pub residual: FourNumbers,
    /// Every explanation that was tried to the end, best first; the first is the answer, if there is one.
    pub explanations: Vec<Explanation>,
    /// How many of these the data do not tell apart, from the first on.
    pub indistinguishable: usize,
    /// For each run the answer's effects with sizes fitted to the other runs alone.
    pub left_out: Vec<Vec<Setting>>,
}

impl Atlas {
    /// What the laps of several runs tell about the declared model.
    ///
    /// # Errors
    /// Runs of fewer than three laps, or of another shape than the atlas was made for.
    pub fn diagnose(&self, simulate: &Simulate<'_>, runs: &[Vec<track::Lap>]) -> Result<Diagnosis, Error> {
        let summary = Summary::new(runs).ok_or(Error::TooFewLaps)?;
        let data = observed(&summary);
        let residual = self.white(&data, &self.null);
        let numbers = FourNumbers::new(&residual, &self.laps);
        let screened = self.screen(&residual);
        let alarm = numbers.omnibus_p() < ALARM_P || self.best_score(&residual) > ALARM_SCORE;
        if !alarm {
            return Ok(Diagnosis {
                verdict: Verdict::Faithful,
                residual: numbers,
                explanations: Vec::new(),
                indistinguishable: 0,
                left_out: vec![Vec::new(); runs.len()],
            });
        }
        let search = Search {
            atlas: self,
            simulate,
            data: &data,
            residual: &residual,
        };
        let mut explanations = search.singles(&screened);
        if explanations
            .first()
            .is_none_or(|best| best.remainder.omnibus_p() < SIGNIFICANT_P)
        {
            let pairs = search.pairs();
            explanations = search.weigh(explanations, pairs);
        }
        let verdict = match explanations.first() {
            Some(best) if best.suffices() => Verdict::Explained,
            Some(best) if best.share >= 0.8 => Verdict::PartlyExplained,
            _ => Verdict::Unexplained,
        };
        let indistinguishable = explanations.first().map_or(0, |best| {
            explanations
                .iter()
                .take_while(|e| e.score > best.score - ALTERNATIVE && e.effects.len() == best.effects.len())
                .count()
        });
        let answer = explanations.first().filter(|_| verdict != Verdict::Unexplained);
        let left_out = match answer {
            Some(answer) if runs.len() > 1 => self.leave_out(simulate, runs, &answer.hypothesis)?,
            Some(answer) => vec![answer.settings(); runs.len()],
            None => vec![Vec::new(); runs.len()],
        };
        Ok(Diagnosis {
            verdict,
            residual: numbers,
            explanations,
            indistinguishable,
            left_out,
        })
    }
}

/// A search for explanations of one data set.
struct Search<'a> {
    atlas: &'a Atlas,
    simulate: &'a Simulate<'a>,
    data: &'a Expectation,
    residual: &'a White,
}

impl Search<'_> {
    /// The best single effects, tried to the end.
    fn singles(&self, screened: &[Screened]) -> Vec<Explanation> {
        self.try_all(shortlist(screened).iter().map(|s| &s.hypothesis))
    }

    /// The best pairs, tried to the end.
    fn pairs(&self) -> Vec<Explanation> {
        const PAIRS: usize = 6;
        let pairs = self.atlas.screen_pairs(self.residual, PAIRS);
        self.try_all(pairs.iter().map(|pair| &pair.hypothesis))
    }

    /// Descends from every hypothesis, then settles those that may still be the best.
    fn try_all<'h>(&self, hypotheses: impl Iterator<Item = &'h Hypothesis>) -> Vec<Explanation> {
        const ROUNDS: usize = 3;
        // What lies this far behind after its descent does not come back.
        const BEHIND: f64 = 25.0;
        let all: Vec<&Hypothesis> = hypotheses.collect();
        let descended: Vec<Descended> = all
            .par_iter()
            .filter_map(|start| self.atlas.descend(self.simulate, self.data, start, ROUNDS))
            .collect();
        let best = descended
            .iter()
            .map(|d| d.score)
            .fold(f64::NEG_INFINITY, f64::max);
        let mut explanations: Vec<Explanation> = descended
            .par_iter()
            .filter(|d| d.score >= best - BEHIND.max(0.02 * best))
            .filter_map(|d| self.atlas.settle(self.simulate, self.data, d))
            .map(|refined| self.explanation(&refined))
            .collect();
        explanations.sort_by(|a, b| b.score.total_cmp(&a.score));
        explanations
    }

    /// Singles and pairs in order of what they are worth: a pair comes before a single effect only if each number of its
    /// further effect gains enough and it fits where the single does not.
    fn weigh(&self, singles: Vec<Explanation>, pairs: Vec<Explanation>) -> Vec<Explanation> {
        let (Some(single), Some(pair)) = (singles.first(), pairs.first()) else {
            return if singles.is_empty() { pairs } else { singles };
        };
        let count = |e: &Explanation| e.effects.iter().map(|c| c.fitted).sum::<usize>();
        let further = count(pair).saturating_sub(count(single)).max(1) as f64;
        let wins = pair.gain - single.gain > WORTH * further && pair.suffices();
        let (mut first, second) = if wins { (pairs, singles) } else { (singles, pairs) };
        first.extend(second);
        first
    }

    fn explanation(&self, refined: &Refined) -> Explanation {
        let atlas = self.atlas;
        let settings = refined.hypothesis.settings(atlas);
        let effects = settings
            .into_iter()
            .enumerate()
            .map(|(part, setting)| {
                let errors: Vec<f64> = refined.errors_of(part, atlas);
                let fitted = errors.iter().filter(|e| **e > 0.0).count();
                Candidate {
                    setting,
                    standard_errors: errors,
                    gain: refined.gain,
                    fitted,
                }
            })
            .collect();
        let labels: Vec<String> = refined
            .hypothesis
            .parts
            .iter()
            .map(|part| {
                let pattern = match part.shape {
                    Shape::Constant => "",
                    Shape::ByRun => ", by run",
                    Shape::ByTime => ", by time",
                };
                atlas.probes[part.probe].label() + pattern
            })
            .collect();
        let excess = |squares: f64| squares - self.residual.len() as f64;
        Explanation {
            effects,
            label: labels.join(" + "),
            hypothesis: refined.hypothesis.clone(),
            score: refined.score,
            gain: refined.gain,
            share: 1.0 - excess(refined.residual.norm_squared()) / excess(self.residual.norm_squared()),
            remainder: FourNumbers::new(&refined.residual, &atlas.laps),
        }
    }
}

/// The screened hypotheses worth a simulation: each probe in its best pattern.
fn shortlist(screened: &[Screened]) -> Vec<&Screened> {
    const MOST: usize = 7;
    let Some(best) = screened.first() else {
        return Vec::new();
    };
    let mut list: Vec<&Screened> = Vec::new();
    for candidate in screened {
        let probe = candidate.hypothesis.parts[0].probe;
        let seen = list.iter().any(|s| s.hypothesis.parts[0].probe == probe);
        let hopeless = candidate.score < 0.7 * best.score - 20.0;
        if list.len() == MOST || hopeless {
            break;
        }
        if !seen {
            list.push(candidate);
        }
    }
    list
}
