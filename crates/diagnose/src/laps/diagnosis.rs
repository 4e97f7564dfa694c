//! The answer: which effects, how sure, what else it could be.

use rayon::prelude::*;

use sim::Setting;

use super::atlas::{Atlas, Simulate, White};
use super::expectation::Expectation;
use super::hypothesis::Hypothesis;
use super::refine::{Descended, Refined};
use super::screen::Screened;
use super::tests_of_fit::FourNumbers;
use crate::{Answer, Candidate, Error, Explanation, Verdict};

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

/// An explanation and what simulates it.
#[derive(Debug, Clone)]
struct Found {
    hypothesis: Hypothesis,
    explanation: Explanation,
}

/// Whether an explanation leaves nothing significant, or next to nothing.
fn suffices(explanation: &Explanation) -> bool {
    explanation.remainder_p >= SIGNIFICANT_P || explanation.share >= ENOUGH
}

/// What laps tell about a model.
#[derive(Debug, Clone)]
pub struct LapDiagnosis {
    /// How the data depart from the declared model.
    pub residual: FourNumbers,
    /// What is claimed.
    pub answer: Answer,
}

impl Atlas {
    /// What the laps of several runs tell about the declared model.
    ///
    /// # Errors
    /// Runs of fewer than three laps, or of another shape than the atlas was made for.
    pub fn diagnose(&self, simulate: &Simulate<'_>, runs: &[Vec<track::Lap>]) -> Result<LapDiagnosis, Error> {
        let data = self.observed(runs)?;
        let residual = self.white(&data, &self.null);
        let numbers = FourNumbers::new(&residual, &self.layout);
        let screened = self.screen(&residual);
        let alarm = numbers.omnibus_p() < ALARM_P || self.best_score(&residual) > ALARM_SCORE;
        if !alarm {
            return Ok(LapDiagnosis {
                residual: numbers,
                answer: Answer::faithful(runs.len()),
            });
        }
        let search = Search {
            atlas: self,
            simulate,
            data: &data,
            residual: &residual,
        };
        let mut found = search.singles(&screened);
        if found
            .first()
            .is_none_or(|best| best.explanation.remainder_p < SIGNIFICANT_P)
        {
            let pairs = search.pairs();
            found = search.weigh(found, pairs);
        }
        let verdict = match found.first().map(|best| &best.explanation) {
            Some(best) if suffices(best) => Verdict::Explained,
            Some(best) if best.share >= 0.8 => Verdict::PartlyExplained,
            _ => Verdict::Unexplained,
        };
        let indistinguishable = found.first().map_or(0, |best| {
            found
                .iter()
                .map(|f| &f.explanation)
                .take_while(|e| {
                    e.score > best.explanation.score - ALTERNATIVE
                        && e.effects.len() == best.explanation.effects.len()
                })
                .count()
        });
        let answer = found.first().filter(|_| verdict != Verdict::Unexplained);
        let left_out = match answer {
            Some(answer) if runs.len() > 1 => self.leave_out(simulate, runs, &answer.hypothesis)?,
            Some(answer) => vec![answer.explanation.settings(); runs.len()],
            None => vec![Vec::new(); runs.len()],
        };
        Ok(LapDiagnosis {
            residual: numbers,
            answer: Answer {
                verdict,
                explanations: found.into_iter().map(|f| f.explanation).collect(),
                indistinguishable,
                left_out,
                cause: None,
            },
        })
    }
}

impl Atlas {
    /// What the laps of several runs leave of an answer that they were not asked for: how they depart from the
    /// declared model, and from the model with these effects; the latter is `None` where the robot then crashes.
    ///
    /// # Errors
    /// Runs of fewer than three laps, or of another shape than the atlas was made for.
    pub fn confirm(
        &self,
        simulate: &Simulate<'_>,
        runs: &[Vec<track::Lap>],
        effects: &[Setting],
    ) -> Result<(FourNumbers, Option<FourNumbers>), Error> {
        let data = self.observed(runs)?;
        let before = FourNumbers::new(&self.white(&data, &self.null), &self.layout);
        if effects.is_empty() {
            return Ok((before, Some(before)));
        }
        let after = self.remainder(simulate, &data, effects);
        Ok((before, after.map(|residual| FourNumbers::new(&residual, &self.layout))))
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
    fn singles(&self, screened: &[Screened]) -> Vec<Found> {
        self.try_all(shortlist(screened).iter().map(|s| &s.hypothesis))
    }

    /// The best pairs, tried to the end.
    fn pairs(&self) -> Vec<Found> {
        const PAIRS: usize = 6;
        let pairs = self.atlas.screen_pairs(self.residual, PAIRS);
        self.try_all(pairs.iter().map(|pair| &pair.hypothesis))
    }

    /// Descends from every hypothesis, then settles those that may still be the best.
    fn try_all<'h>(&self, hypotheses: impl Iterator<Item = &'h Hypothesis>) -> Vec<Found> {
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
        let mut explanations: Vec<Found> = descended
            .par_iter()
            .filter(|d| d.score >= best - BEHIND.max(0.02 * best))
            .filter_map(|d| self.atlas.settle(self.simulate, self.data, d))
            .map(|refined| self.explanation(&refined))
            .collect();
        explanations.sort_by(|a, b| b.explanation.score.total_cmp(&a.explanation.score));
        explanations
    }

    /// Singles and pairs in order of what they are worth: a pair comes before a single effect only if each number of its
    /// further effect gains enough and it fits where the single does not.
    fn weigh(&self, singles: Vec<Found>, pairs: Vec<Found>) -> Vec<Found> {
        let (Some(single), Some(pair)) = (singles.first(), pairs.first()) else {
            return if singles.is_empty() { pairs } else { singles };
        };
        let count = |f: &Found| f.explanation.effects.iter().map(|c| c.fitted).sum::<usize>();
        let further = count(pair).saturating_sub(count(single)).max(1) as f64;
        let wins = pair.explanation.gain - single.explanation.gain > WORTH * further && suffices(&pair.explanation);
        let (mut first, second) = if wins { (pairs, singles) } else { (singles, pairs) };
        first.extend(second);
        first
    }

    fn explanation(&self, refined: &Refined) -> Found {
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
        let excess = |squares: f64| squares - self.residual.len() as f64;
        let remainder = FourNumbers::new(&refined.residual, &atlas.layout);
        Found {
            hypothesis: refined.hypothesis.clone(),
            explanation: Explanation {
                effects,
                score: refined.score,
                gain: refined.gain,
                share: 1.0 - excess(refined.residual.norm_squared()) / excess(self.residual.norm_squared()),
                remainder_p: remainder.omnibus_p(),
                remainder: Some(remainder),
            },
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
