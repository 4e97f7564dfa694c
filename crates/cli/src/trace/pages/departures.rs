//! How the laps of a trace depart from the model.

use diagnose::{Departures, Quadratic};

use super::of_shown;
use crate::experiments::{Block, Picture};
use crate::table::{Table, probability};
use crate::trace::{Trace, pictures};

/// What stands below the table of these numbers.
const NUMBERS_EXPLAINED: &str = "Mean lap: its position at each gate and its times; run to run: how the means of runs differ; drift: how \
    laps change along a run; noise: how single laps scatter about that, where and how roughly; start: how runs set off. Freedom: of how \
    many numbers each is told. Excess: the sum of their squared deviations in units of chance, less the freedom, which is what chance \
    makes of it on average: about 0, and as often below, where the model is right. p: the probability of as much by chance.";

/// The numbers that tell how laps depart, in words.
const NUMBERS: [&str; 5] = [
    "mean lap",
    "run to run",
    "drift within runs",
    "noise",
    "start of runs",
];

/// How laps depart from the declared model and from the answer, and where on the circuit.
pub(super) fn residual(trace: &Trace) -> Vec<Block> {
    let claimed = trace.answer.claimed();
    let left = claimed.and_then(|claimed| claimed.remainder.as_ref().map(Departures::named));
    let and_answer = left.as_ref().map_or("", |_| ", and of the model with the answer");
    let mut columns = vec!["part", "freedom", "excess", "p"];
    columns.extend(left.iter().flat_map(|_| ["with the answer", "p with it"]));
    let mut table = Table::new(
        format!("What the laps hold beyond the expectation of the declared model{and_answer}"),
        &columns,
    );
    // What rounds to nothing has no sign.
    let shown = |q: Quadratic| match q.freedom {
        0 => ["-".to_owned(), "-".to_owned()],
        _ => [format!("{:.0}", q.excess().round() + 0.0), probability(q.p)],
    };
    for (i, (word, (_, declared))) in NUMBERS.into_iter().zip(trace.residual.named()).enumerate() {
        let row = [word.to_owned(), declared.freedom.to_string()];
        let left = left.iter().flat_map(|left| shown(left[i].1));
        table.push(row.into_iter().chain(shown(declared)).chain(left));
    }
    let with_answer = claimed.map_or("", |_| " of the model with the answer");
    let of = of_shown(trace);
    vec![
        Block::Table(table),
        Block::Text(NUMBERS_EXPLAINED.into()),
        Picture::block(
            "residual_map",
            "",
            format!(
                "Where the residual sits: the mean measured lap, coloured by its distance from the declared model's.{} Pale is within \
                 chance{with_answer}.{of}",
                departures_in_words(trace)
            ),
            pictures::residual_map(trace),
        ),
    ]
}

/// How much of the mean lap's path departs from the declared model, and what else does, which a map does not show.
fn departures_in_words(trace: &Trace) -> String {
    /// Share of gates outside of the band for 95 of 100 that is no chance: neighbours go together.
    const MANY: f64 = 0.15;
    let departing = trace.residual.departing();
    let errors = trace.shown().1;
    let chance_mm = pictures::chance_mm(trace, &errors.before);
    let pairs = pictures::residual_mm(trace).into_iter().zip(chance_mm);
    let (gates, outside) = pairs.fold((0, 0), |(gates, outside), (mm, chance_mm)| {
        (gates + 1, outside + usize::from(mm.abs() > chance_mm))
    });
    let path_departs = departing.contains(&"mean") && outside as f64 > MANY * f64::from(gates);
    let path = if path_departs {
        format!(" It is farther than chance leaves 95 of 100 at {outside} of {gates} gates.")
    } else {
        " Nothing here exceeds chance.".to_owned()
    };
    let later_s = -errors.lap_times.longer_s()[0];
    let than = if later_s > 0.0 { "longer" } else { "shorter" };
    // Of several data sets the numbers are those of all, and the map is one's.
    let times = (departing.contains(&"mean") && !path_departs && trace.recordings.len() == 1).then(|| {
        format!(
            "the times of the mean lap (measured laps take {:.2} s {than})",
            later_s.abs()
        )
    });
    let others = NUMBERS.into_iter().zip(trace.residual.named()).skip(1);
    let others = others.filter(|(_, (name, _))| departing.contains(name));
    let others = others.map(|(word, (_, number))| {
        format!(
            "{word} (excess {:.0}, p {})",
            number.excess(),
            probability(number.p)
        )
    });
    let unseen: Vec<String> = times.into_iter().chain(others).collect();
    if unseen.is_empty() {
        path
    } else {
        format!(
            "{path} What departs besides and is not in the map: {}.",
            unseen.join(", ")
        )
    }
}
