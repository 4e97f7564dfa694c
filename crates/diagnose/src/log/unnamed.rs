//! Causes that are in no list.

use sim::Stage;

use super::channels::{Channel, channels};
use super::filter::MEASURED;
use super::groups::unlisted_variants;
use super::leads::{By, Lead, price};
use super::refined::{Refined, together};
use super::repeat::repeats;
use super::search::{FAULTS, STEPS, Search, screened};
use super::settling::settling;
use super::wheels::out_of_round;
use crate::Cause;

/// A cause without a name: its best coefficients, unless it is noise.
#[derive(Debug)]
pub(super) struct Unnamed {
    pub(super) cause: Cause,
    pub(super) refined: Option<Refined>,
}

impl Search<'_> {
    /// What is left beside the best explanation, and whether that makes it dishonest to name it.
    pub(super) fn judge(&mut self) {
        let gain = self.found.first().map_or(0.0, |best| best.gain);
        if let Some(wheels) = out_of_round(&self.evidence, self.best(), FAULTS * gain) {
            self.unnamed = Cause::of(&wheels.settings[0]).map(|cause| {
                let refined = Some(wheels).filter(|wheels| wheels.score() > gain);
                Unnamed { cause, refined }
            });
            return;
        }
        let settles = (self.found.first()).and_then(|best| settling(&self.evidence, best, self.total()));
        if let Some(settles) = settles {
            self.unnamed = Cause::of(&settles.settings[0]).map(|cause| Unnamed {
                cause,
                refined: Some(settles),
            });
            return;
        }
        if self.remainder.matters() || self.found.is_empty() {
            self.unnamed = self.characterise(gain);
        }
        if self.unnamed.is_none() {
            self.unnamed = rough(&self.channels, FAULTS * gain).filter(|_| !self.is_rough_by_itself());
        }
    }

    /// The group of basis functions that explains most, if it explains more than the best listed effects.
    fn characterise(&self, listed: f64) -> Option<Unnamed> {
        let groups = unlisted_variants();
        let (_, found) = screened(&self.evidence, &[], &groups)?;
        let score = |lead: &Lead| lead.gain - price(lead.fitted, By::Constant);
        let most = found.iter().map(score).fold(0.0, f64::max);
        let lead = (found.iter())
            .filter(|lead| score(lead) >= 0.97 * most)
            .min_by(|a, b| a.fitted.cmp(&b.fitted).then(b.gain.total_cmp(&a.gain)))?;
        let variant = &groups[lead.variant];
        let setting = lead.start(variant);
        let refined = together(&self.evidence, &[(variant.clone(), setting)], self.total(), STEPS)?;
        if refined.gain < listed {
            return None;
        }
        Cause::of(&refined.settings[0]).map(|cause| Unnamed {
            cause,
            refined: Some(refined),
        })
    }

    /// Whether the filter finds tails about as heavy in simulated logs of the best explanation: where rounding or large noise
    /// takes the robot far from the pose about which it is linear.
    fn is_rough_by_itself(&self) -> bool {
        /// Excess kurtosis, as a multiple of the largest in simulated logs, that is no chance.
        const TIMES: f64 = 1.5;
        let Some(best) = self.found.first() else {
            return false;
        };
        let heaviest = |channels: &[Channel; MEASURED]| {
            let excess = channels.iter().map(|channel| channel.kurtosis - 3.0);
            excess.fold(0.0, f64::max)
        };
        let simulated = repeats(&self.evidence, &best.settings, |repeated| {
            Some(heaviest(&channels(&repeated.traces(&best.settings)?)))
        });
        heaviest(&self.channels) < TIMES * simulated.into_iter().fold(0.0, f64::max)
    }
}

/// Noise that no normal distribution has: innovations with heavy tails that are no edges of readings, and that are worth more than
/// `small` units of log-likelihood.
fn rough(channels: &[Channel; MEASURED], small: f64) -> Option<Unnamed> {
    let heavy = |channel: &Channel| {
        let count = channel.count.max(1) as f64;
        let excess = channel.kurtosis - 3.0;
        // What a law with that fourth cumulant gains over the normal one, to second order (Edgeworth's series).
        let gain = count * excess * excess / 48.0;
        excess > 0.3 && excess > 10.0 * (24.0 / count).sqrt() && gain > small
    };
    let camera = channels[..2].iter().any(heavy);
    let readings = channels[2..].iter().filter(|channel| heavy(channel)).count();
    if !camera && readings == 0 {
        return None;
    }
    let (stage, acts_on) = match (camera, readings) {
        (true, 0) => (Stage::Observe, "camera"),
        (false, 1 | 2) => (Stage::Sense, "reading"),
        _ => (Stage::Act, "wheel speed"),
    };
    Some(Unnamed {
        cause: Cause {
            stage,
            acts_on: acts_on.into(),
            depends_on: "chance".into(),
        },
        refined: None,
    })
}
