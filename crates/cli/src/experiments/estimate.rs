//! Numbers that move from draw to draw of the simulated laps.

use serde_json::{Map, Value, json};

/// The share of the draws in which a claim must hold, and of those that an interval spans.
pub(crate) const CONFIDENCE: f64 = 0.95;

/// A number over D draws: one draw is what the paper had.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Estimate {
    pub(crate) mean: f64,
    /// The interval that holds the middle 95 % of the draws; both ends the number itself for one draw.
    pub(crate) low: f64,
    pub(crate) high: f64,
    /// The draw that the figures show.
    pub(crate) first: f64,
}

impl Estimate {
    /// The estimate from at least one value, in the order of the draws.
    pub(crate) fn of(values: &[f64]) -> Self {
        let mut sorted = values.to_vec();
        sorted.sort_by(f64::total_cmp);
        let tail = (1.0 - CONFIDENCE) / 2.0;
        Self {
            mean: values.iter().sum::<f64>() / values.len() as f64,
            low: quantile(&sorted, tail),
            high: quantile(&sorted, 1.0 - tail),
            first: values[0],
        }
    }

    /// Mean and interval with so many decimals: `2.3 [1.9, 2.8]`; the mean alone where nothing moves.
    pub(crate) fn text(&self, decimals: usize) -> String {
        let Self { mean, low, high, .. } = self;
        if low == high {
            return format!("{mean:.decimals$}");
        }
        format!("{mean:.decimals$} [{low:.decimals$}, {high:.decimals$}]")
    }

    /// `{"<key>": mean, "low", "high", "first"}`.
    pub(crate) fn json(&self, key: &str) -> Value {
        let Self {
            mean,
            low,
            high,
            first,
        } = *self;
        let mut object = Map::new();
        object.insert(key.to_owned(), json!(mean));
        object
            .extend([("low", low), ("high", high), ("first", first)].map(|(k, v)| (k.to_owned(), json!(v))));
        Value::Object(object)
    }
}

/// The value below which a share of the sorted values lies, linear between neighbours.
fn quantile(sorted: &[f64], share: f64) -> f64 {
    let place = share * (sorted.len() - 1) as f64;
    let (below, above) = (sorted[place.floor() as usize], sorted[place.ceil() as usize]);
    below + (above - below) * place.fract()
}

/// In how many draws something was so.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Tally {
    pub(crate) times: usize,
    pub(crate) draws: usize,
}

impl Tally {
    /// Counts the draws for which the answer is yes.
    pub(crate) fn of(answers: impl IntoIterator<Item = bool>) -> Self {
        answers
            .into_iter()
            .fold(Self { times: 0, draws: 0 }, |tally, yes| Self {
                times: tally.times + usize::from(yes),
                draws: tally.draws + 1,
            })
    }

    /// Whether it was so in at least 95 % of the draws.
    pub(crate) fn holds(&self) -> bool {
        self.times as f64 >= CONFIDENCE * self.draws as f64
    }
}

impl std::fmt::Display for Tally {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} of {} draws", self.times, self.draws)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_interval_spans_the_middle_of_the_draws() {
        let values: Vec<f64> = (0..=40).rev().map(f64::from).collect();
        let estimate = Estimate::of(&values);
        let is = [estimate.mean, estimate.low, estimate.high, estimate.first];
        for (is, should) in is.iter().zip([20.0, 1.0, 39.0, 40.0]) {
            assert!((is - should).abs() < 1e-12, "{is} should be {should}");
        }
        assert_eq!(estimate.text(1), "20.0 [1.0, 39.0]");
        assert_eq!(Estimate::of(&[2.0]).text(2), "2.00");
    }

    #[test]
    fn a_claim_holds_in_nineteen_of_twenty_draws() {
        let tally = |times: usize| Tally::of((0..20).map(|i| i < times));
        assert!(tally(19).holds() && !tally(18).holds());
        assert_eq!(tally(19).to_string(), "19 of 20 draws");
    }
}
