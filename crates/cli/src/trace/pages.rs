//! A trace as a colleague would write it: sections of a report.

mod candidates;
mod departures;
mod in_words;

use anyhow::Result;

use candidates::candidates;
use departures::residual;
pub(crate) use in_words::{cause_in_words, described, summary};

use super::errors::Eq8;
use super::limits::{innovations, limits, next_experiment, stages};
use super::{Trace, pictures};
use crate::experiments::{Block, Picture, Section};
use crate::figures::MM;
use crate::table::Table;

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
        if let Some(own_m) = &errors.own_m {
            let after = mean_mm(own_m);
            table.push(of_answer([
                format!("{of}the same with each run's own size, fitted, mm"),
                "-".into(),
                after,
                "-".into(),
            ]));
        }
        let [before, after] = errors.lap_times.longer_s().map(|s| format!("{s:+.2}"));
        table.push(of_answer([
            format!("{of}lap time, s off"),
            before,
            after,
            format!("{:.2}", errors.lap_times.chance_s),
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
        for of_modes in errors.eq_8 {
            let Eq8 {
                modes,
                before,
                after,
                chance,
            } = of_modes;
            let [before, after, chance] =
                [before, after, chance].map(|d| d.map_or("-".into(), |d| format!("{d:.2}")));
            table.push(of_answer([
                format!("{of}eq. 8 in {modes} modes"),
                before,
                after,
                chance,
            ]));
        }
    }
    table
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
