//! What the data cannot tell, and what would.

use std::collections::BTreeMap;

use diagnose::{Answer, Candidate, Decided, Detectable, Explanation, Verdict};
use sim::{Param, Stage};

use super::Trace;
use super::answer::{FromLogs, rivals};
use super::document::distinct;
use super::next::{Experiment, MOST_LAPS, to_tell_from};
use super::pages::{cause_in_words, described};
use super::recording::{Recording, files, runs};
use crate::dataset::Log;
use crate::experiments::Block;
use crate::table::{Table, far_from, probability};

/// What the logged commands of some recordings say of the controller.
pub(super) fn decide_in_words(decide: &Decided, recordings: &[Recording]) -> String {
    match decide {
        Decided::AsDeclared => {
            "The declared controller gives every logged command from the logged readings.".to_owned()
        }
        Decided::Changed(effects) => format!(
            "The logged commands follow from the logged readings with another constant: {}.",
            effects.iter().map(|e| e.label()).collect::<Vec<_>>().join(", ")
        ),
        Decided::NoController { share, runs: wrong } => {
            let logged = files(recordings).filter(|run| run.rows.log.is_some()).count();
            let names = runs(recordings)
                .enumerate()
                .filter(|(run, _)| wrong.contains(run));
            let names: Vec<&str> = names.map(|(_, run)| run.name.as_str()).collect();
            let of = if wrong.len() < logged {
                format!(" of run {}", names.join(", "))
            } else {
                String::new()
            };
            format!(
                "No controller of this kind gives the logged commands{of} from the logged readings: {:.1} % of them do not follow from \
                 any constants.{} Look at the units (readings in counts, speeds in m/s), at how they are rounded or cut, at the order of the \
                 columns, and at the controller. Without the columns of the log (ps0 to right_m_s) the laps alone are traced.",
                100.0 * share,
                too_fast(recordings).unwrap_or_default(),
            )
        }
        Decided::Unknown => "No control step has both readings and commands.".to_owned(),
    }
}

/// That logged commands are faster than the declared wheels can be, a sentence.
fn too_fast(recordings: &[Recording]) -> Option<String> {
    let speeds_m_s = |recording: &Recording| {
        let logs = recording
            .measured
            .set
            .runs
            .iter()
            .filter_map(|run| run.rows.log.as_ref());
        let of_log = |log: &Log| {
            log.left_m_s
                .iter()
                .chain(&log.right_m_s)
                .fold(0.0_f64, |most, v| most.max(v.abs()))
        };
        logs.map(of_log).fold(0.0_f64, f64::max)
    };
    recordings.iter().find_map(|recording| {
        let (fastest_m_s, limit_m_s) = (speeds_m_s(recording), recording.config.robot.wheel_speed_limit_m_s);
        (fastest_m_s > 1.5 * limit_m_s).then(|| {
            format!(" The fastest is {fastest_m_s:.3} m/s, and the declared wheels reach {limit_m_s:.3} m/s (robot.wheel_speed_limit_m_s).")
        })
    })
}

/// The next experiment in a sentence; `None` where nothing has to be told apart.
pub(crate) fn next_in_words(trace: &Trace) -> Option<String> {
    let best = trace.experiments.first()?;
    let laps = match best.laps_needed() {
        Some(laps) => format!("about {laps} laps would do for 5 standard deviations"),
        None => format!("more than {MOST_LAPS} laps would be needed for 5 standard deviations"),
    };
    let told: Vec<&str> = best.told().map(|(rival, _)| rival.as_str()).collect();
    let what = if told.is_empty() || told.len() == best.separations.len() {
        "them apart".to_owned()
    } else {
        format!("the answer from {}", told.join(" and from "))
    };
    let some_experiment_tells = |rival: &str| {
        let mut told = trace.experiments.iter().flat_map(Experiment::told);
        told.any(|(other, _)| other == rival)
    };
    let rivals = best.separations.iter().map(|(rival, _)| rival.as_str());
    let never: Vec<&str> = rivals.filter(|rival| !some_experiment_tells(rival)).collect();
    let never = if told.is_empty() || never.is_empty() {
        String::new()
    } else {
        format!(
            " None that was looked at tells it from {}.",
            never.join(" or from ")
        )
    };
    Some(format!(
        "To tell {what}: {} ({}; {laps}); add them as a second --measured.{never}",
        best.name,
        best.expectation()
    ))
}

/// Why there is no next experiment.
fn no_experiment(trace: &Trace) -> String {
    let answer = &trace.answer;
    let Some(claimed) = answer.claimed() else {
        return match answer.verdict {
            Verdict::Faithful => "There is nothing to tell apart.".to_owned(),
            _ => "Nothing is claimed, and no experiment was looked for.".to_owned(),
        };
    };
    let others: Vec<String> = to_tell_from(answer, claimed)
        .into_iter()
        .map(Explanation::label)
        .collect();
    if others.is_empty() {
        return "There is nothing to tell apart.".to_owned();
    }
    let with_log = trace.from_logs.as_ref().map_or(
        ", and laps as they are with the robot's log of readings and commands",
        |_| ", each with the robot's log of readings and commands",
    );
    format!(
        "None of the experiments that were looked at is expected to tell {} from {}: more laps as they are, laps the other way round, \
         with another gain or threshold of the controller and at another speed{with_log}.",
        claimed.label(),
        others.join("; ")
    )
}

/// The experiments that would tell rivals apart.
pub(super) fn next_experiment(trace: &Trace) -> Vec<Block> {
    if trace.experiments.is_empty() {
        return vec![Block::Text(no_experiment(trace))];
    }
    let mut blocks: Vec<Block> = next_in_words(trace).into_iter().map(Block::Text).collect();
    let mut table = Table::new(
        "Experiments that would tell the answer from its rivals, by what a lap of them tells",
        &["experiment", "rival", "sigma", "of laps", "laps for 5 sigma"],
    );
    for experiment in &trace.experiments {
        for (rival, sigma) in &experiment.separations {
            table.push([
                experiment.name.clone(),
                rival.clone(),
                format!("{sigma:.1}"),
                experiment.laps.to_string(),
                (experiment.laps_for(*sigma)).map_or("too many".to_owned(), |laps| laps.to_string()),
            ]);
        }
    }
    blocks.push(Block::Table(table));
    blocks
}

/// The smallest effects that would have been seen.
pub(super) fn limits(trace: &Trace) -> Vec<Block> {
    let mut blocks: Vec<Block> = trace.remarks_besides().cloned().map(Block::Text).collect();
    if trace.from_logs.is_none() {
        blocks.push(Block::Text(
            "There is no log of readings and commands: the laps alone were judged.".into(),
        ));
    }
    if trace.detectable.is_empty() {
        return blocks;
    }
    let mut sizes: BTreeMap<(&str, &str), Vec<&Detectable>> = BTreeMap::new();
    for detectable in &trace.detectable {
        let size = (detectable.spec.name, detectable.parameter);
        sizes.entry(size).or_default().push(detectable);
    }
    let mut table = Table::new(
        format!(
            "Sizes from which a single effect shows in these {} in 95 of 100 cases (over its sensors, places and directions: the \
             easiest to the hardest)",
            trace.source()
        ),
        &["effect", "parameter", "below", "above"],
    );
    let mut unseen = vec!["marker-offset (angle_rad)".to_owned()];
    if trace.from_logs.is_none() {
        unseen.push("gain and offset of S3 and S4, which neither controller reads".to_owned());
    }
    for ((name, parameter), all) in sizes {
        let side = |of: &dyn Fn(&Detectable) -> Option<f64>, reversed: bool| range(&all, of, reversed);
        let (below, above) = (side(&|d| d.below, true), side(&|d| d.above, false));
        if below.is_none() && above.is_none() {
            unseen.push(format!("{name} ({parameter})"));
            continue;
        }
        let unit = all[0].unit;
        // Most names end with their unit.
        let parameter = if parameter.ends_with(&unit.replace('/', "_").replace('^', "")) {
            parameter.to_owned()
        } else {
            format!("{parameter}, {unit}")
        };
        let shown = |side: Option<String>| side.unwrap_or_else(|| "-".to_owned());
        table.push([name.to_owned(), parameter, shown(below), shown(above)]);
    }
    blocks.push(Block::Table(table));
    if trace.from_logs.is_some() {
        blocks.push(Block::Text(
            "A constant of the controller that is not as declared shows in every command, and a rounding of readings in every reading. \
             Noise is judged by how much larger or smaller the innovations are: the intervals above say how well a factor is known. Of \
             delays, lags, limits, steps and the like the table has the first size, of those that were looked at, which is seen."
                .into(),
        ));
    }
    let speed = if trace.from_logs.is_some() {
        ""
    } else {
        ", and a controller's speed the same as both wheels'"
    };
    blocks.push(Block::Text(format!(
        "Not seen at any size that was looked at: {}. A shifted or turned world is the same as a shifted or turned camera{speed}.",
        unseen.join(", ")
    )));
    blocks
}

/// From the easiest to the hardest to see; `None` if one of them is not seen at all and no other is.
fn range(all: &[&Detectable], of: &dyn Fn(&Detectable) -> Option<f64>, falling: bool) -> Option<String> {
    let mut sizes: Vec<f64> = all.iter().filter_map(|d| of(d)).collect();
    sizes.sort_by(|a, b| if falling { b.total_cmp(a) } else { a.total_cmp(b) });
    let (first, last) = (sizes.first()?, sizes.last()?);
    let hidden = if sizes.len() < all.len() {
        ", some never"
    } else {
        ""
    };
    let sized = |p: &&Param| p.name == all[0].parameter;
    let neutral = all[0].spec.params.iter().find(sized).and_then(|p| p.neutral);
    let [first, last] = [first, last].map(|size| far_from(neutral.unwrap_or(0.0), *size));
    Some(if first == last {
        format!("{first}{hidden}")
    } else {
        format!("{first} to {last}{hidden}")
    })
}

/// What is measured in a control step, in the order of a diagnosis' channels.
pub(super) const CHANNELS: [&str; 10] = [
    "camera x", "camera y", "S0", "S1", "S2", "S3", "S4", "S5", "S6", "S7",
];

/// What the robot's logs say stage by stage, and whether the laps agree; nothing where there are no logs.
pub(super) fn stages(trace: &Trace) -> Vec<Block> {
    let Some(found) = &trace.from_logs else {
        return Vec::new();
    };
    let logs = &found.logs;
    let mut table = Table::new("What the logs say, stage by stage", &["stage", "verdict"]);
    for stage in [
        Stage::Sense,
        Stage::Decide,
        Stage::Act,
        Stage::World,
        Stage::Observe,
    ] {
        table.push([stage.name().to_owned(), of_stage(trace, found, stage)]);
    }
    let mut blocks = vec![Block::Table(table)];
    if !matches!(logs.decide, Decided::NoController { .. }) {
        let agree = match (found.confirmed, trace.answer.verdict) {
            (false, _) => {
                " The laps do not agree with what the logs say: both are shown and neither is claimed."
            }
            (true, Verdict::Unexplained) => "",
            (true, _) if laps_decided(&trace.answer) => {
                " The laps agree with this, and contradict what comes a little nearer by the logs alone."
            }
            (true, _) => " The laps agree.",
        };
        blocks.push(Block::Text(format!(
            "{} control steps were followed by a filter over the pose that takes the camera and all readings; the probability of as \
             much by chance is {}.{agree}",
            logs.steps,
            probability(logs.p)
        )));
    }
    blocks
}

/// Whether the laps told the answer from another that the logs put before it.
fn laps_decided(answer: &Answer) -> bool {
    let rivals = rivals(answer);
    rivals.iter().any(|other| other.score > rivals[0].score)
}

/// What the logs say of a stage.
fn of_stage(trace: &Trace, found: &FromLogs, stage: Stage) -> String {
    match (&found.logs.decide, stage) {
        (Decided::AsDeclared, Stage::Decide) => {
            "as declared: every logged command follows from the logged readings".to_owned()
        }
        (Decided::Unknown, Stage::Decide) => "no control step has both readings and commands".to_owned(),
        (Decided::NoController { share, .. }, Stage::Decide) => format!(
            "no controller of this kind: {:.1} % of the commands do not follow from the readings",
            100.0 * share
        ),
        (Decided::NoController { .. }, _) => "not judged".to_owned(),
        // What the laps do not confirm is what the logs say all the same.
        _ if !found.confirmed => of_answer(trace, &found.logs.answer, stage),
        _ => of_answer(trace, &trace.answer, stage),
    }
}

/// What an answer has in a stage.
fn of_answer(trace: &Trace, answer: &Answer, stage: Stage) -> String {
    let Some(claimed) = answer.claimed() else {
        return match &answer.cause {
            Some(cause) if cause.stage == stage => format!("{}, without a name", cause_in_words(cause)),
            _ if answer.verdict == Verdict::Faithful => "as declared".to_owned(),
            _ => "nothing is claimed".to_owned(),
        };
    };
    let own = |explanation: &Explanation| -> Vec<Candidate> {
        let effects = explanation.effects.iter();
        effects
            .filter(|effect| effect.stage() == stage)
            .cloned()
            .collect()
    };
    let label = |rival: &Explanation| {
        own(rival)
            .iter()
            .map(Candidate::label)
            .collect::<Vec<_>>()
            .join(" and ")
    };
    let mut others = distinct(rivals(answer).iter().map(label));
    others.retain(|other| !other.is_empty() && *other != label(claimed));
    let others = others.join(" or ");
    match (described(trace, &own(claimed)).join(" and "), answer.verdict) {
        (own, _) if !own.is_empty() && others.is_empty() => own,
        (own, _) if !own.is_empty() => format!("{own}; not told apart from {others}"),
        _ if !others.is_empty() => format!("as declared, unless it is {others}"),
        (_, Verdict::PartlyExplained) => "nothing found, but something is left".to_owned(),
        _ => "as declared".to_owned(),
    }
}

/// What is left of the logs' innovations; nothing where there are no logs.
pub(super) fn innovations(trace: &Trace) -> Vec<Block> {
    let Some(FromLogs { logs, .. }) = &trace.from_logs else {
        return Vec::new();
    };
    let mut table = Table::new(
        "Innovations of the filter with the best explanation: 1, 3 and 0 if it were the whole truth",
        &["measured", "number", "mean square", "kurtosis", "correlation"],
    );
    for (name, channel) in CHANNELS.iter().zip(&logs.channels) {
        table.push([
            (*name).to_owned(),
            channel.count.to_string(),
            format!("{:.3}", channel.mean_square),
            format!("{:.2}", channel.kurtosis),
            format!("{:+.3}", channel.correlation),
        ]);
    }
    vec![Block::Table(table)]
}
