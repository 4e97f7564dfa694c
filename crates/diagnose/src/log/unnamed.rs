//! Causes that are in no list.

use rayon::prelude::*;
use sim::{Pattern, Setting, Stage, Vec2, unlisted_on_floor};

use super::channels::{Channel, channels};
use super::evidence::Evidence;
use super::filter::MEASURED;
use super::groups::{area_variants, unlisted_variants};
use super::leads::{By, Lead, price};
use super::refined::{Refined, together};
use super::repeat::repeats;
use super::search::{FAULTS, FIRST_STEPS, STEPS, Search, least_in_reach, screened};
use super::settling::settling;
use super::wheels::out_of_round;
use crate::Cause;
use crate::candidate::WORDS;

/// A cause without a name: its best coefficients, unless it is noise.
#[derive(Debug)]
pub(super) struct Unnamed {
    pub(super) cause: Cause,
    pub(super) refined: Option<Refined>,
}

impl Unnamed {
    /// Whether it is a wheel out of round.
    pub(super) fn is_a_wheel(&self) -> bool {
        self.cause.depends_on == "wheel angle"
    }

    fn without_form(stage: Stage, acts_on: &str, depends_on: &str) -> Self {
        let cause = Cause {
            stage,
            acts_on: acts_on.into(),
            depends_on: depends_on.into(),
        };
        Self { cause, refined: None }
    }
}

impl Search<'_> {
    /// A cause without a name that leaves nothing that matters where the best effect leaves something, if pairs of effects do not
    /// promise as much over the columns of the declared model, which rank `first`. What is left is noted beside the best effect.
    pub(super) fn unnamed_before_pairs(&mut self, first: &[Lead]) -> Option<Unnamed> {
        /// Share of what innovations that are too wide may gain with which pairs may be all there is, and of what the cause gains.
        const NEARLY: f64 = 0.9;
        let best = (self.found.first())
            .filter(|best| best.by == By::Constant)?
            .clone();
        self.settle(&best);
        if !self.remainder.matters() {
            return None;
        }
        let promised = self.joint(first).first().map_or(0.0, |pair| pair.gain);
        let too_wide: f64 = self.channels.iter().map(Channel::gain_of_width).sum();
        if promised > NEARLY * (best.gain + too_wide) {
            return None;
        }
        let unnamed = self.characterise(best.gain.max(promised / NEARLY))?;
        self.settle(unnamed.refined.as_ref()?);
        let suffices = !self.remainder.matters();
        self.settle(&best);
        suffices.then_some(unnamed)
    }

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
        if self.unnamed.is_none() && (self.remainder.matters() || self.found.is_empty()) {
            self.unnamed = self.characterise(gain);
        }
        if self.unnamed.is_none() {
            self.unnamed = self.no_noise(FAULTS * gain);
        }
    }

    /// The group of basis functions that explains most, if it explains more than the best listed effects.
    fn characterise(&self, listed: f64) -> Option<Unnamed> {
        let refined = self.by_groups.get_or_init(|| self.best_group()).as_ref()?;
        if refined.gain < listed {
            return None;
        }
        Cause::of(&refined.settings[0]).map(|cause| Unnamed {
            cause,
            refined: Some(refined.clone()),
        })
    }

    /// The group of basis functions with fewest coefficients of those that explain most.
    fn best_group(&self) -> Option<Refined> {
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
        match self.on_part_of_the_floor(&refined) {
            Some(area) if area.score() > refined.score() => Some(area),
            _ => Some(refined),
        }
    }

    /// A cause that depends on the place as one that acts on a part of the floor, with a soft edge or a sharp one, about a place on the
    /// track where it acts most.
    fn on_part_of_the_floor(&self, cause: &Refined) -> Option<Refined> {
        const PLACES: usize = 3;
        const APART_M: f64 = 0.3;
        const SOFTNESSES: [f64; 2] = [1.0, 0.25];
        let Pattern::Constant(values) = &cause.settings[0].pattern else {
            return None;
        };
        let variant = area_variants()
            .into_iter()
            .find(|area| area.values[..2] == values[..2])?;
        let circuit = self.evidence.scene.circuit();
        let mut places: Vec<(f64, Vec2)> = (circuit.gates.iter().map(|gate| gate.center - circuit.middle()))
            .map(|place| (unlisted_on_floor(values, place), place))
            .collect();
        places.sort_by(|a, b| b.0.abs().total_cmp(&a.0.abs()));
        let mut starts: Vec<(f64, Vec2)> = Vec::new();
        for (amount, place) in places {
            let is_apart = |(_, other): &(f64, Vec2)| place.distance(*other) > APART_M;
            if starts.len() < PLACES && starts.iter().all(is_apart) {
                starts.push((amount, place));
            }
        }
        let start = |&(amount, place): &(f64, Vec2), softness: f64| {
            let mut area = variant.values.clone();
            area[WORDS..WORDS + 3].copy_from_slice(&[amount, place.x, place.y]);
            area[WORDS + 4] = softness;
            Setting::constant(variant.spec, area)
        };
        let starts = (starts.iter()).flat_map(|place| SOFTNESSES.map(|softness| start(place, softness)));
        let starts: Vec<Setting> = starts.collect();
        let first: Vec<Refined> = (starts.into_par_iter())
            .filter_map(|start| {
                let area = [(variant.clone(), start)];
                together(&self.evidence, &area, self.total(), FIRST_STEPS)
            })
            .collect();
        let least = least_in_reach(first.iter());
        let hopeful = first.into_par_iter().filter(|area| area.score() >= least);
        let variants = std::slice::from_ref(&variant);
        let mut all: Vec<Refined> = hopeful
            .map(|area| area.further(&self.evidence, variants, self.total(), STEPS - FIRST_STEPS))
            .collect();
        all.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        let (best, others) = all.split_first_mut()?;
        // Where a robot that crosses it on one line sees both its ends, a larger area farther aside does the same.
        let least = (1.0 - FAULTS) * best.gain;
        let alike = others.iter().filter(|other| other.gain > least);
        alike.for_each(|other| best.be_as_unsure_as_far_from(other));
        Some(all.swap_remove(0))
    }

    /// What the innovations have that no noise of the best explanation gives, if it is worth more than `small` units of
    /// log-likelihood. The filter finds some of it in simulated logs too, where rounding or large noise takes the robot far from the pose
    /// about which it is linear.
    fn no_noise(&self, small: f64) -> Option<Unnamed> {
        /// A multiple of the largest in simulated logs that is no chance.
        const TIMES: f64 = 1.5;
        type Measure = fn(&[Channel; MEASURED]) -> f64;
        let found: [(Option<Unnamed>, Measure); 2] = [
            (rough(&self.channels, small), heaviest),
            (coloured(&self.channels, small), colour),
        ];
        if found.iter().all(|(unnamed, _)| unnamed.is_none()) {
            return None;
        }
        let simulated = self.found.first().map_or(Vec::new(), |best| {
            let of_log = |repeated: &Evidence<'_>| Some(channels(&repeated.traces(&best.settings)?));
            repeats(&self.evidence, &best.settings, of_log)
        });
        found.into_iter().find_map(|(unnamed, measure)| {
            let by_itself = simulated.iter().map(measure).fold(0.0, f64::max);
            unnamed.filter(|_| measure(&self.channels) >= TIMES * by_itself)
        })
    }
}

/// The largest excess kurtosis of a channel.
fn heaviest(channels: &[Channel; MEASURED]) -> f64 {
    let excess = channels.iter().map(|channel| channel.kurtosis - 3.0);
    excess.fold(0.0, f64::max)
}

/// The most that a first-order autoregression of a channel's innovations gains in log-likelihood.
fn colour(channels: &[Channel; MEASURED]) -> f64 {
    channels.iter().map(Channel::gain_of_memory).fold(0.0, f64::max)
}

/// A mean that no explanation gives: innovations of a reading that are like their neighbours, which noise is not, and which are worth
/// more than `small` units of log-likelihood. What acts on the robot's motion is seen by the camera most.
fn coloured(channels: &[Channel; MEASURED], small: f64) -> Option<Unnamed> {
    /// Log-likelihood that no fault of the filter gains: of 90 logged robots with effects of the list or none nothing has more than 8.
    const SURE: f64 = 50.0;
    if colour(channels) < SURE.max(small) {
        return None;
    }
    let (camera, readings) = channels.split_at(2);
    let gain = |channels: &[Channel]| channels.iter().map(Channel::gain_of_memory).sum::<f64>();
    let (stage, acts_on) = if gain(readings) > gain(camera) {
        (Stage::Sense, "reading")
    } else {
        (Stage::Act, "wheel speed")
    };
    Some(Unnamed::without_form(stage, acts_on, "place"))
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
    Some(Unnamed::without_form(stage, acts_on, "chance"))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// White innovations but for one channel's correlation.
    fn with(channel: usize, correlation: f64) -> [Channel; MEASURED] {
        let mut all = [Channel {
            count: 20_000,
            mean_square: 1.0,
            kurtosis: 3.0,
            pairs: 20_000,
            correlation: 0.01,
        }; MEASURED];
        all[channel].correlation = correlation;
        all
    }

    #[test]
    fn innovations_that_are_like_their_neighbours_are_no_noise() {
        let stage = |channels, small| coloured(&channels, small).map(|unnamed| unnamed.cause.stage);
        assert_eq!(stage(with(4, 0.03), 0.0), None);
        assert_eq!(stage(with(4, 0.3), 0.0), Some(Stage::Sense));
        assert_eq!(stage(with(1, 0.3), 0.0), Some(Stage::Act));
        // -10^4 log(1 - 0.09) = 943.
        assert_eq!(stage(with(4, 0.3), 950.0), None);
    }
}
