//! Logs simulated of an answer: what becomes of them tells what to make of the measured ones.

use std::ops::Range;

use rayon::prelude::*;
use sim::{Run, Setting, Streams, find};

use super::evidence::Evidence;
use super::rows::LogRow;

/// Times as many logs as were measured that are simulated in all.
pub(crate) const REPEATS: u64 = 8;

/// What `of` makes of logs of robots with these effects, [`REPEATS`] times as many as were measured, with readings rounded as the
/// measured ones.
pub(crate) fn repeats<R: Send>(
    evidence: &Evidence<'_>,
    settings: &[Setting],
    of: impl Fn(&Evidence<'_>) -> Option<R> + Sync,
) -> Vec<R> {
    some_repeats(evidence, settings, 0..REPEATS, of)
}

/// The probability that `judged` gives to what `of_log` makes of each simulated log. Half of the logs are enough where these make plain
/// chance of it; four that make plainly none of it may do so by chance.
pub(super) fn p_in_repeats(
    evidence: &Evidence<'_>,
    settings: &[Setting],
    of_log: impl Fn(&Evidence<'_>) -> Option<f64> + Sync,
    judged: impl Fn(&[f64]) -> f64,
) -> f64 {
    /// The logs that are simulated first and those that follow.
    const FIRST: Range<u64> = 0..REPEATS / 2;
    const OTHERS: Range<u64> = REPEATS / 2..REPEATS;
    /// Probability of plain chance.
    const CHANCE: f64 = 0.5;
    let mut logs = some_repeats(evidence, settings, FIRST, &of_log);
    let first = judged(&logs);
    if first > CHANCE {
        return first;
    }
    logs.extend(some_repeats(evidence, settings, OTHERS, &of_log));
    judged(&logs)
}

/// The same as [`repeats`] of some of these logs, by their numbers.
fn some_repeats<R: Send>(
    evidence: &Evidence<'_>,
    settings: &[Setting],
    numbers: Range<u64>,
    of: impl Fn(&Evidence<'_>) -> Option<R> + Sync,
) -> Vec<R> {
    let mut rounded = settings.to_vec();
    rounded.extend(find("reading-step").map(|spec| Setting::constant(spec, [evidence.step_counts])));
    let one = |repeat: u64| {
        let logs = simulated(evidence, &rounded, repeat)?;
        let runs: Vec<&[LogRow]> = logs.iter().map(Vec::as_slice).collect();
        of(&Evidence::new(evidence.scene, evidence.models, &runs, evidence.step_counts).ok()?)
    };
    numbers.into_par_iter().filter_map(one).collect()
}

/// One log for each run, as long as what was used of the measured one and with its holes.
fn simulated(evidence: &Evidence<'_>, settings: &[Setting], repeat: u64) -> Option<Vec<Vec<LogRow>>> {
    const SEED: u64 = 1 << 52;
    let log_of = |run: usize| {
        let own = evidence.stretches.iter().filter(|stretch| stretch.run == run);
        let mut measured = own.flat_map(|stretch| stretch.rows).peekable();
        if measured.peek().is_none() {
            return Some(Vec::new());
        }
        let world = evidence.world(settings, run).ok()?;
        let streams = Streams {
            seed: SEED + repeat,
            run: run as u64,
        };
        let mut drive = Run::new(&world, streams).ok()?;
        let row = |measured: &LogRow| LogRow::from(drive.step()).with_holes_of(measured);
        Some(measured.map(row).collect())
    };
    (0..=*evidence.runs().last()?).map(log_of).collect()
}
