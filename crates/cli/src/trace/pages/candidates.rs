//! What a trace tried.

use diagnose::{ALTERNATIVE, Cause, Explanation, Verdict};

use super::in_words::{described, size};
use crate::experiments::Block;
use crate::table::{Table, probability};
use crate::trace::Trace;
use crate::trace::unnamed::unnamed;

/// The explanations that were tried to the end, and what the claimed one does if it has no name.
pub(super) fn candidates(trace: &Trace) -> Vec<Block> {
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
    let first = rivals.first()?;
    let best = rivals.iter().map(|e| e.score).fold(first.score, f64::max);
    let behind = rivals.iter().map(|e| best - e.score).fold(0.0, f64::max);
    let far = (behind > ALTERNATIVE).then(|| {
        format!(
            "Of those marked * some are up to {behind:.1} units behind: likelihoods are simulated, that of the first within {:.1}.",
            first.gain_error
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
