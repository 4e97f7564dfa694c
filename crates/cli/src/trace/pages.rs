//! A trace as a colleague would write it: sections of a report.

use anyhow::Result;
use diagnose::{Candidate, Cause, Decided, Departures, Explanation, Quadratic, Verdict};
use sim::Pattern;

use super::answer::rivals;
use super::document::distinct;
use super::errors::Eq8;
use super::limits::{decide_in_words, innovations, limits, next_experiment, next_in_words, stages};
use super::remarks::sizes_by_run_in_words;
use super::unnamed::{in_words, unnamed};
use super::{Trace, pictures};
use crate::experiments::{Block, Picture, Section};
use crate::figures::MM;
use crate::table::{Table, four_digits, probability, with_error, with_interval};

/// The sections of a trace, with figures numbered as they come.
///
/// # Errors
/// Laps that cannot be compared.
pub(crate) fn sections(trace: &Trace) -> Result<Vec<Section>> {
    let sections = vec![
        Section {
            heading: "Diagnosis".into(),
            blocks: diagnosis(trace),
        },
        Section {
            heading: "Where the model and the robot differ".into(),
            blocks: residual(trace),
        },
        Section {
            heading: "What was tried".into(),
            blocks: candidates(trace),
        },
        Section {
            heading: "What the logs leave".into(),
            blocks: innovations(trace),
        },
        Section {
            heading: match trace.answer.claimed() {
                Some(_) => "Before and after".into(),
                None => "Measured and simulated".into(),
            },
            blocks: before_and_after(trace),
        },
        Section {
            heading: "The next experiment".into(),
            blocks: next_experiment(trace),
        },
        Section {
            heading: "What cannot be seen".into(),
            blocks: limits(trace),
        },
    ];
    let with_content = |section: &Section| !section.blocks.is_empty();
    let mut sections: Vec<Section> = sections.into_iter().filter(with_content).collect();
    let blocks = sections.iter_mut().flat_map(|section| &mut section.blocks);
    let pictures = blocks.filter_map(|block| match block {
        Block::Picture(picture) => Some(picture),
        _ => None,
    });
    for (letter, picture) in ('A'..='Z').zip(pictures) {
        picture.number = format!("Fig. {letter}");
    }
    Ok(sections)
}

impl Trace {
    /// All that a report of these sections says, each sentence once and without the pictures; what must be known of the data follows
    /// the diagnosis.
    pub(crate) fn text(&self, sections: &[Section]) -> String {
        let mut text = String::new();
        for (place, section) in sections.iter().enumerate() {
            for block in &section.blocks {
                match block {
                    Block::Text(said) if !text.contains(said) => text += &format!("{said}\n"),
                    Block::Table(table) => text += &format!("\n{}", table.to_text()),
                    _ => {}
                }
            }
            if place == 0 {
                text.extend(
                    self.remarks_besides()
                        .map(|remark| format!("of the data: {remark}\n")),
                );
            }
        }
        text
    }

    /// What must be known of the data, but for what the summary says.
    pub(super) fn remarks_besides(&self) -> impl Iterator<Item = &String> {
        let said = summary(self);
        self.remarks.iter().filter(move |remark| !said.contains(*remark))
    }
}

/// A trace as a part of another report.
pub(crate) fn digest(trace: &Trace) -> Vec<Block> {
    [diagnosis(trace), residual(trace), candidates(trace)].concat()
}

/// The answer in sentences.
pub(crate) fn summary(trace: &Trace) -> String {
    let diagnosis = &trace.answer;
    let answer = diagnosis.explanations.first();
    let said = match (diagnosis.verdict, answer) {
        (Verdict::Faithful, _) => {
            format!(
                "Faithful: the {} do not depart from the declared model by more than chance allows.",
                trace.source()
            )
        }
        (Verdict::Unexplained, _) | (_, None) => unexplained(trace),
        (v, Some(answer)) => {
            let what = described(trace, &answer.effects);
            let rest = if v == Verdict::Explained && answer.remainder_p.is_some() && !answer.fits() {
                " What remains is significant but small."
            } else if v == Verdict::PartlyExplained {
                " What remains is significant and matters."
            } else {
                " Nothing significant remains."
            };
            let mut word = v.name().to_owned();
            word[..1].make_ascii_uppercase();
            let explains = match answer.explained(trace.laps_alone()) {
                Some(share) => format!("this explains {:.1} % of the excess", 100.0 * share),
                None => format!(
                    "this gains {:.1} units of log-likelihood, of an excess that as a whole chance often makes",
                    answer.gain
                ),
            };
            format!("{word}: {}; {explains}.{rest}", what.join(" and "))
        }
    };
    // Two sizes of one effect are no two answers.
    let answers = distinct(rivals(diagnosis).iter().map(Explanation::label));
    let others = answers.get(1..).unwrap_or_default();
    let alternatives = if others.is_empty() {
        String::new()
    } else {
        format!(
            " These {} do not tell it apart from: {}.",
            trace.source(),
            others.join("; ")
        )
    };
    let further = further_in_words(trace);
    let next = next_in_words(trace).map_or(String::new(), |next| format!("\n{next}"));
    format!("{said}{alternatives}{further}{next}\n{}", error_in_words(trace))
}

/// How far the simulation is from the robot.
fn error_in_words(trace: &Trace) -> String {
    let before_mm = MM * trace.mean_m(|e| &e.before_m);
    let after = match trace.answer.claimed() {
        Some(_) => format!(" before, {:.2} mm after", MM * trace.mean_m(|e| &e.after_m)),
        None => String::new(),
    };
    let by_run = sizes_by_run_in_words(&trace.answer).map_or(String::new(), |words| format!(" {words}"));
    format!(
        "Error of the mean lap on {}: {before_mm:.2} mm{after}; {:.2} mm would be chance.{by_run}",
        trace.judged_runs(),
        MM * trace.mean_m(|e| &e.floor_m)
    )
}

/// What may be there beside what is claimed.
fn further_in_words(trace: &Trace) -> String {
    let Some(claimed) = trace.answer.claimed() else {
        return String::new();
    };
    let further = trace.answer.further().into_iter().map(|further| {
        let more = further.gain - claimed.gain;
        format!(
            "{} (gains {more:.1} units of log-likelihood more)",
            further.label()
        )
    });
    let further: Vec<String> = further.collect();
    if further.is_empty() {
        return String::new();
    }
    format!(
        " Another effect may be there, for which these {} speak, but not enough to claim it: {}.",
        trace.source(),
        further.join("; ")
    )
}

/// Why nothing is claimed.
fn unexplained(trace: &Trace) -> String {
    if let Some(found) = trace.from_logs.as_ref().filter(|found| !found.confirmed) {
        let said: Vec<String> = (found.logs.answer.explanations.first().iter())
            .map(|answer| answer.label())
            .collect();
        return format!(
            "Unexplained: the log says {}, and the laps do not agree. Neither is claimed.",
            if said.is_empty() {
                "that nothing is missing".to_owned()
            } else {
                said.join(", ")
            }
        );
    }
    if let Some(found) = &trace.from_logs
        && matches!(found.logs.decide, Decided::NoController { .. })
    {
        return format!(
            "Unexplained: {}",
            decide_in_words(&found.logs.decide, &trace.recordings)
        );
    }
    let stage = trace.answer.cause.as_ref().map(|cause| {
        format!(
            " It sits in the {} stage: {}.",
            cause.stage.name(),
            cause_in_words(cause)
        )
    });
    format!(
        "Unexplained: the data depart from the declared model, and no name would be honest.{}{}",
        stage.unwrap_or_default(),
        best_listed(trace).unwrap_or_default()
    )
}

/// How much the best explanation by listed effects explains, and why it is not claimed; `None` where none was fitted.
fn best_listed(trace: &Trace) -> Option<String> {
    const NOISE: [&str; 4] = ["slip-level", "slip-memory", "reading-noise", "camera-noise"];
    let answer = &trace.answer;
    let is_listed = |e: &&Explanation| {
        e.effects
            .iter()
            .all(|effect| Cause::of(&effect.setting).is_none())
    };
    let best = answer.explanations.iter().find(is_listed)?;
    let stalls = (answer.explanations[..answer.indistinguishable].iter())
        .find(|e| is_listed(e) && e.effects.len() == 2 && e.names().contains(&"wheel-scale"))
        .filter(|e| e.names().contains(&"slip-level"));
    let noises = best.names().iter().filter(|name| NOISE.contains(name)).count();
    let why = match (&answer.cause, best.remainder_p.filter(|_| !best.fits())) {
        (Some(cause), _) if cause.depends_on == "chance" && stalls.is_some() => {
            "but a slower wheel and more slip are what a wheel does that stands still now and then: one cause without a name rather \
             than two with theirs"
                .to_owned()
        }
        (Some(_), _) => "but what it leaves shows a cause without a name".to_owned(),
        _ if noises > 1 => {
            "but with several effects on noise, which are more likely one cause without a name".to_owned()
        }
        (None, Some(p)) => format!(
            "but leaves a remainder that is significant and too large for it to be claimed (p {})",
            probability(p)
        ),
        (None, None) => "but of so weak a signal chance explains as much".to_owned(),
    };
    let explains = match best.explained(trace.laps_alone()) {
        Some(share) => format!("explains {:.1} % of the excess", 100.0 * share),
        None => format!("gains {:.1} units of log-likelihood", best.gain),
    };
    let fitted = answer.explanations.iter().filter(is_listed).count();
    Some(format!(
        " The best of {fitted} explanations by listed effects that were fitted, {}, {explains}, {why}.",
        best.label()
    ))
}

/// What a cause without a name acts on and depends on, for a sentence.
pub(super) fn cause_in_words(cause: &Cause) -> String {
    match cause.depends_on.as_str() {
        "chance" => format!("noise of the {}", cause.acts_on),
        on => format!("{} by {on}", cause.acts_on),
    }
}

/// Effects with their sizes, one by one, for a sentence.
pub(super) fn described(trace: &Trace, effects: &[Candidate]) -> Vec<String> {
    effects.iter().map(|effect| describe(trace, effect)).collect()
}

/// An effect with its size, for a sentence.
fn describe(trace: &Trace, effect: &Candidate) -> String {
    let name = effect.setting.spec.name;
    match (&effect.setting.pattern, Cause::of(&effect.setting)) {
        (_, Some(cause)) => in_words(trace, effect, &cause),
        (Pattern::Constant(_), _) => format!("{name} ({})", size(effect)),
        (Pattern::ByTime { .. }, _) => format!("{name} changing in time ({})", size(effect)),
        (Pattern::ByRun(_), _) => format!("{name} by run ({})", size(effect)),
    }
}

/// The size of an effect, with its standard error where it was fitted, or with its interval where that says more.
fn size(effect: &Candidate) -> String {
    let params = effect.setting.spec.params;
    let numbers = effect.setting.pattern.numbers();
    let number = |place: usize, param: &sim::Param| {
        let (value, error) = (numbers[place], effect.standard_errors[place]);
        match effect.intervals.get(&place) {
            // An end of the parameter's range is none of the interval's.
            Some(&[low, high]) => with_interval(
                value,
                [
                    (low > param.low).then_some(low),
                    (high < param.high).then_some(high),
                ],
            ),
            None if effect.interval(place) == [param.low, param.high] => with_interval(value, [None; 2]),
            None if error > 0.0 => with_error(value, error),
            None => four_digits(value),
        }
    };
    let list = |first: usize| {
        let one = |(i, p): (usize, &sim::Param)| match p.choices.get(numbers[first + i] as usize) {
            Some(choice) => format!("{} {choice}", p.name),
            None => format!("{} {}", p.name, number(first + i, p)),
        };
        params.iter().enumerate().map(one).collect::<Vec<_>>().join(", ")
    };
    match &effect.setting.pattern {
        Pattern::Constant(_) => list(0),
        Pattern::ByTime { per_s, .. } => {
            let changing = (params.iter().enumerate()).filter(|(i, _)| per_s[*i] != 0.0);
            let changes = changing
                .map(|(i, p)| format!("; {} changes by {} per s", p.name, number(params.len() + i, p)));
            format!("{} at the start{}", list(0), changes.collect::<String>())
        }
        Pattern::ByRun(runs) => {
            let each: Vec<String> = (0..runs.len()).map(|run| list(run * params.len())).collect();
            each.join("; ")
        }
    }
}

/// The answer, the verdict by stage where there are logs, and the error.
fn diagnosis(trace: &Trace) -> Vec<Block> {
    let mut blocks: Vec<Block> = summary(trace)
        .lines()
        .map(|l| Block::Text(l.to_owned()))
        .collect();
    blocks.splice(1..1, stages(trace));
    blocks.push(Block::Table(error_table(trace)));
    blocks
}

fn error_table(trace: &Trace) -> Table {
    // Where nothing is added after is before.
    let of_answer = |[what, before, after, chance]: [String; 4]| match trace.answer.claimed() {
        Some(_) => vec![what, before, after, chance],
        None => vec![what, before, chance],
    };
    let before = trace.answer.claimed().map_or("declared model", |_| "before");
    let columns = of_answer(["", before, "after", "chance"].map(String::from));
    let mut table = Table::new(
        format!("The simulation against {}", trace.judged_runs()),
        &columns.iter().map(String::as_str).collect::<Vec<_>>(),
    );
    let mm = |m: f64| format!("{:.2}", MM * m);
    for errors in &trace.errors {
        let of = match trace.errors.len() {
            1 => String::new(),
            _ => format!("{}: ", trace.recordings[errors.recording].measured.set.name),
        };
        let mean_mm = |values: &[f64]| mm(values.iter().sum::<f64>() / values.len() as f64);
        table.push(of_answer([
            format!("{of}mean lap, rms over the gates, mm"),
            mean_mm(&errors.before_m),
            mean_mm(&errors.after_m),
            mean_mm(&errors.floor_m),
        ]));
        let measured_s = errors.measured_lap_s();
        let [before, after] = errors
            .simulated_lap_s()
            .map(|s| format!("{:+.2}", s - measured_s));
        table.push(of_answer([
            format!("{of}lap time, s off"),
            before,
            after,
            "0".into(),
        ]));
        if let Some(starts) = &errors.starts {
            let [before, after, chance] = starts.errors_mm().map(|mm| format!("{mm:.2}"));
            table.push(of_answer([
                format!("{of}start of runs, rms, mm"),
                before,
                after,
                chance,
            ]));
        }
        for Eq8 { modes, before, after } in errors.eq_8() {
            let [before, after] = [before, after].map(|d| d.map_or("-".into(), |d| format!("{d:.2}")));
            table.push(of_answer([
                format!("{of}eq. 8 in {modes} modes"),
                before,
                after,
                "-".into(),
            ]));
        }
    }
    table
}

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

fn residual(trace: &Trace) -> Vec<Block> {
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
    let later_s = errors.measured_lap_s() - errors.simulated_lap_s()[0];
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

fn candidates(trace: &Trace) -> Vec<Block> {
    if trace.answer.explanations.is_empty() {
        let tried = match trace.answer.verdict {
            Verdict::Faithful => "Nothing had to be tried.",
            _ => "No explanation could be fitted.",
        };
        return vec![Block::Text(tried.into())];
    }
    let source = trace.source();
    let answer = &trace.answer;
    let further = answer.further();
    let (rivals, others) = answer.explanations.split_at(answer.indistinguishable.max(1));
    let mut others: Vec<&Explanation> = others.iter().collect();
    others.sort_by(|a, b| b.score.total_cmp(&a.score));
    let first = match answer.claimed() {
        Some(_) => "the answer first",
        None => "what comes nearest first, though it is not claimed",
    };
    let and_rivals = if rivals.len() > 1 {
        format!(", with what these {source} do not tell from it (marked *)")
    } else {
        String::new()
    };
    let and_further = if further.is_empty() {
        ""
    } else {
        "; what those marked + have besides may be there"
    };
    let mut table = Table::new(
        format!(
            "Explanations fitted to the {source}: {first}{and_rivals}, then the others by what they gain less the price of their \
             numbers; sizes ± one standard error{and_further}"
        ),
        &[
            "effect",
            "log-likelihood gained",
            "less price",
            "explained",
            "remainder p",
            "size",
        ],
    );
    for (place, e) in rivals.iter().chain(others.iter().copied()).enumerate() {
        let mark = if rivals.len() > 1 && place < rivals.len() {
            " *"
        } else if further.contains(&e) {
            " +"
        } else {
            ""
        };
        table.push([
            format!("{}{mark}", e.label()),
            units(e.gain),
            units(e.score),
            e.explained(trace.laps_alone())
                .map_or("-".into(), |share| format!("{:.1} %", 100.0 * share)),
            e.remainder_p.map_or("-".into(), probability),
            sizes(trace, e),
        ]);
    }
    let mut blocks = vec![Block::Table(table)];
    blocks.extend(order_in_words(rivals, &others).map(Block::Text));
    blocks.extend(unnamed(trace));
    blocks
}

/// Why explanations come in an order that is not that of their scores, as far as they do.
fn order_in_words(rivals: &[Explanation], others: &[&Explanation]) -> Option<String> {
    /// Units within which explanations are alternatives whatever the error.
    const NEAR: f64 = 5.0;
    let first = rivals.first()?;
    let best = rivals.iter().map(|e| e.score).fold(first.score, f64::max);
    let behind = rivals.iter().map(|e| best - e.score).fold(0.0, f64::max);
    let far = (behind > NEAR).then(|| {
        format!(
            "Of those marked * some are up to {behind:.1} units behind: likelihoods are simulated, and that is within twice their error."
        )
    });
    let is_ahead = |other: &&&Explanation| other.score > first.score;
    let mut ahead = others.iter().filter(is_ahead).peekable();
    let further = ahead.peek().is_some() && ahead.all(|other| other.effects.len() > first.effects.len());
    let further = further.then(|| {
        "What comes out ahead of the first has further effects, and what these gain is too little to be sure of them.".to_owned()
    });
    let words: Vec<String> = far.into_iter().chain(further).collect();
    (!words.is_empty()).then(|| words.join(" "))
}

/// Log-likelihood; what a log shows exactly is no matter of likelihood.
fn units(gain: f64) -> String {
    if gain.is_finite() {
        format!("{gain:.1}")
    } else {
        "certain".into()
    }
}

fn sizes(trace: &Trace, explanation: &Explanation) -> String {
    match explanation.effects.as_slice() {
        [effect] if Cause::of(&effect.setting).is_none() => size(effect),
        effects => described(trace, effects).join(" + "),
    }
}

/// Whose laps are drawn, a sentence for a caption, where there are several data sets.
fn of_shown(trace: &Trace) -> String {
    match trace.recordings.len() {
        1 => String::new(),
        _ => format!(
            " These are the laps of {}; gates.csv has all data sets.",
            trace.shown().0.measured.set.name
        ),
    }
}

fn before_and_after(trace: &Trace) -> Vec<Block> {
    let of = of_shown(trace);
    let [with_answer, left, right] = match trace.answer.claimed() {
        Some(_) => [
            ", and with the answer",
            "each of the two leaves of the measured mean lap",
            " Where the answer is right, 95 of 100 bars reach its line.",
        ],
        None => [
            "",
            "it leaves of the measured mean lap",
            " Where the model is right, 95 of 100 bars reach its line.",
        ],
    };
    let mut blocks = vec![
        Picture::block(
            "mean_laps",
            "",
            format!(
                "Mean position at each gate: measured, simulated with the declared model{with_answer}. Below, what {left}; in the \
                 band, 95 of 100 gates lie by chance. The mean over all runs is nearer to the simulation than single runs, whose \
                 errors the table has.{of}"
            ),
            pictures::mean_laps(trace),
        ),
        Picture::block(
            "laps",
            "",
            format!("Laps of the declared model{with_answer}, over measured ones.{of}"),
            pictures::laps(trace),
        ),
    ];
    if let Some(starts) = pictures::starts(trace) {
        blocks.push(Picture::block(
            "starts",
            "",
            format!(
                "How runs start: how far the robot is ahead of where it would be had it always been as fast as in the second after, on \
                 average over the runs. One that sets off late is ahead at first, for it then falls behind.{right}{of}"
            ),
            starts,
        ));
    }
    blocks
}
