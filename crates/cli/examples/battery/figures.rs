//! The figures that a battery is judged by.

use crate::labels::{Controller, Kind, Level};
use crate::parameters::ParameterError;
use crate::score::{Baselines, Outcome};

/// One row of the table.
#[derive(Debug)]
pub(crate) struct Figure {
    pub(crate) name: &'static str,
    pub(crate) asked: &'static str,
    pub(crate) value: String,
}

/// Every figure, those that are asked for first.
pub(crate) fn figures(outcomes: &[Outcome]) -> Vec<Figure> {
    let of = Groups::new(outcomes);
    let figure = |name, asked, value| Figure { name, asked, value };
    let singles = |test: fn(&Outcome) -> bool| by_controller(|c| share(&of.singles(Level::L1, c), test));
    let logged = of.all(|o| is_single(o) && o.label.level == Level::L2);
    let claimed = |o: &Outcome| !o.trace.effects.is_empty();
    let listed = |o: &Outcome| matches!(o.label.kind, Kind::Single | Kind::Pair);
    let pairs = of.all(|o| o.label.kind == Kind::Pair);
    let sizes: Vec<ParameterError> = outcomes.iter().flat_map(Outcome::parameter_errors).collect();
    let (sizes, places): (Vec<_>, Vec<_>) = sizes.into_iter().partition(|error| error.relative);
    vec![
        figure(
            "false alarms on effect-free sets",
            "at most 2 %",
            share(&of.all(|o| o.label.kind == Kind::Null), |o| {
                o.trace.verdict != "faithful"
            }),
        ),
        figure(
            "L1, one listed effect: named first, classes count as one; Braitenberg / rule-based",
            "95 % / 88 %",
            singles(Outcome::in_class),
        ),
        figure(
            "L1: exact name first, Braitenberg / rule-based",
            "90 % / 75 %",
            singles(Outcome::exact),
        ),
        figure(
            "L1: truth in the reported set, exact name; mean size, Braitenberg / rule-based",
            "at least 97 %; at most 1.6 / 2.2",
            format!(
                "{}; {}",
                singles(Outcome::in_reported),
                by_controller(|c| mean_size(&of.singles(Level::L1, c)))
            ),
        ),
        figure(
            "L1: the same, classes count as one",
            "",
            singles(Outcome::class_in_reported),
        ),
        figure(
            "L2: stage right / named first, classes as one / exact name",
            "100 % / 98 % / 88 %",
            [Outcome::stage_right, Outcome::in_class, Outcome::exact]
                .map(|test| share(&logged, test))
                .join(" / "),
        ),
        figure(
            "unlisted effects: refused or characterised in the right stage",
            "at least 90 %",
            share(
                &of.all(|o| o.label.kind == Kind::Outside && !o.below_detection()),
                Outcome::refused_or_characterised,
            ),
        ),
        figure(
            "two effects: both right / true pair among the reported (classes count as one)",
            "80 % / 90 %",
            [Outcome::all_right, Outcome::all_reported]
                .map(|test| share(&pairs, test))
                .join(" / "),
        ),
        figure(
            "the same, without pairs of which one effect is the answer and leaves nothing that the omnibus sees",
            "",
            [Outcome::all_right, Outcome::all_reported]
                .map(|test| share(&of.all(|o| o.label.kind == Kind::Pair && !o.hides_one()), test))
                .join(" / "),
        ),
        figure(
            "by-run patterns of gain or speed recognised as such",
            "95 %",
            share(&of.all(|o| o.label.by_run), Outcome::by_run_right),
        ),
        figure(
            "parameters: median relative error, 90 % quantile; share of intervals that hold the truth",
            "1.2 %, 6 %; at least 90 %",
            parameters(&sizes),
        ),
        figure(
            "error after / floor on held-out runs, where effects are claimed: median, 90 %",
            "1.02, 1.06",
            spread(&ratios(&of.all(claimed), Outcome::after_over_floor)),
        ),
        figure(
            "the same, every set with listed effects",
            "",
            spread(&ratios(&of.all(listed), Outcome::after_over_floor)),
        ),
        figure(
            "error after / error of the true model on the same runs, where effects are claimed: median, 90 %",
            "",
            spread(&ratios(&of.all(claimed), Outcome::after_over_truth)),
        ),
        figure(
            "error before / floor on effect-free sets: what chance makes of such a ratio",
            "",
            spread(&ratios(
                &of.all(|o| o.label.kind == Kind::Null),
                Outcome::after_over_floor,
            )),
        ),
        figure(
            "places (azimuth rad, position, length m): median difference, 90 % quantile; intervals that hold the truth",
            "",
            apart(&places),
        ),
        figure(
            "sets below detection, left out above",
            "",
            outcomes
                .iter()
                .filter(|o| o.below_detection())
                .count()
                .to_string(),
        ),
        figure(
            "baseline, L1 singles of constant size, classes as one / exact: RMS of the mean lap",
            "",
            baseline(&of, |b| &b.mean_lap_rms),
        ),
        figure(
            "baseline: PDM distance in 2 modes",
            "",
            baseline(&of, |b| &b.two_modes),
        ),
        figure(
            "lapwing on the same sets",
            "",
            [Outcome::in_class, Outcome::exact]
                .map(|test| share(&of.constant(), test))
                .join(" / "),
        ),
    ]
}

/// Whether a set has one listed effect that the omnibus sees.
fn is_single(outcome: &Outcome) -> bool {
    outcome.label.kind == Kind::Single && !outcome.below_detection()
}

/// The sets to count over.
struct Groups<'a>(&'a [Outcome]);

impl<'a> Groups<'a> {
    fn new(outcomes: &'a [Outcome]) -> Self {
        Self(outcomes)
    }

    fn all(&self, which: impl Fn(&Outcome) -> bool) -> Vec<&'a Outcome> {
        self.0.iter().filter(|outcome| which(outcome)).collect()
    }

    /// L1 singles of the same size in all runs, which is all that the baselines know.
    fn constant(&self) -> Vec<&'a Outcome> {
        self.all(|o| is_single(o) && o.label.level == Level::L1 && !o.label.by_run)
    }

    fn singles(&self, level: Level, controller: Controller) -> Vec<&'a Outcome> {
        self.all(|o| is_single(o) && o.label.level == level && o.label.controller == controller)
    }
}

fn by_controller(value: impl Fn(Controller) -> String) -> String {
    [Controller::Braitenberg, Controller::RuleBased]
        .map(value)
        .join(" / ")
}

fn share(outcomes: &[&Outcome], test: fn(&Outcome) -> bool) -> String {
    let hits = outcomes.iter().filter(|outcome| test(outcome)).count();
    percent(hits, outcomes.len())
}

fn percent(hits: usize, count: usize) -> String {
    if count == 0 {
        return "-".into();
    }
    format!("{:.0} % ({hits}/{count})", 100.0 * hits as f64 / count as f64)
}

/// Mean number of names reported, where any is.
fn mean_size(outcomes: &[&Outcome]) -> String {
    let sizes: Vec<usize> = (outcomes.iter().map(|o| o.reported().len()))
        .filter(|&size| size > 0)
        .collect();
    if sizes.is_empty() {
        return "-".into();
    }
    format!("{:.2}", sizes.iter().sum::<usize>() as f64 / sizes.len() as f64)
}

fn parameters(errors: &[ParameterError]) -> String {
    let values: Vec<f64> = errors.iter().map(|error| 100.0 * error.error).collect();
    match (median(&values), quantile(&values, 0.9)) {
        (Some(middle), Some(high)) => format!("{middle:.2} %, {high:.1} %; {}", coverage(errors)),
        _ => "-".into(),
    }
}

/// Differences of places, each kind by itself.
fn apart(errors: &[ParameterError]) -> String {
    let of = |name: &str| {
        let own: Vec<ParameterError> = errors
            .iter()
            .filter(|error| error.name == name)
            .cloned()
            .collect();
        let values: Vec<f64> = own.iter().map(|error| error.error).collect();
        let (middle, high) = (median(&values)?, quantile(&values, 0.9)?);
        Some(format!("{name} {middle:.4}, {high:.4}; {}", coverage(&own)))
    };
    let kinds: Vec<String> = ["azimuth_rad", "position", "length_m"]
        .into_iter()
        .filter_map(of)
        .collect();
    if kinds.is_empty() {
        "-".into()
    } else {
        kinds.join("; ")
    }
}

fn coverage(errors: &[ParameterError]) -> String {
    percent(errors.iter().filter(|error| error.covered).count(), errors.len())
}

fn ratios(outcomes: &[&Outcome], ratio: fn(&Outcome) -> Option<f64>) -> Vec<f64> {
    outcomes.iter().filter_map(|outcome| ratio(outcome)).collect()
}

fn spread(values: &[f64]) -> String {
    match (median(values), quantile(values, 0.9)) {
        (Some(middle), Some(high)) => format!("{middle:.3}, {high:.3} ({})", values.len()),
        _ => "-".into(),
    }
}

fn baseline(of: &Groups<'_>, names: fn(&Baselines) -> &Vec<String>) -> String {
    let right: Vec<[bool; 2]> = (of.constant().iter())
        .filter_map(|outcome| outcome.baseline(|baselines| names(baselines)))
        .collect();
    let count = |which: usize| right.iter().filter(|flags| flags[which]).count();
    format!(
        "{} / {}",
        percent(count(1), right.len()),
        percent(count(0), right.len())
    )
}

/// The middle value; `None` of none.
pub(crate) fn median(values: &[f64]) -> Option<f64> {
    quantile(values, 0.5)
}

/// The value below which a share of them lies, linear in between; `None` of none.
fn quantile(values: &[f64], share: f64) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let at = share * (sorted.len().checked_sub(1)?) as f64;
    let (low, high) = (sorted[at.floor() as usize], sorted[at.ceil() as usize]);
    Some(low + at.fract() * (high - low))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_by_hand() {
        let values = [4.0, 1.0, 3.0, 2.0];
        assert_eq!(median(&values), Some(2.5));
        assert!((quantile(&values, 0.9).unwrap() - 3.7).abs() < 1e-12);
        assert_eq!(quantile(&[7.0], 0.9), Some(7.0));
        assert_eq!(median(&[]), None);
    }

    #[test]
    fn shares_show_their_counts() {
        assert_eq!(percent(19, 20), "95 % (19/20)");
        assert_eq!(percent(0, 0), "-");
    }
}
