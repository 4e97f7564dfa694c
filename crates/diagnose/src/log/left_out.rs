//! An answer's sizes by what all runs but one tell.

use rayon::prelude::*;
use sim::{Pattern, Setting};

use super::catalogue::Variant;
use super::evidence::Evidence;
use super::noise::{is_noise, top_of_parabola};
use super::refine::{jumps, knobs_of, one_step};
use super::refined::Refined;

impl Refined {
    /// The settings with sizes fitted without each of the measured runs. One that gave no evidence, or all of it, has nothing
    /// that could be left out.
    pub(super) fn without_each(&self, evidence: &Evidence<'_>, variants: &[Variant]) -> Vec<Vec<Setting>> {
        let knobs = knobs_of(&self.settings, variants);
        let now = self.assessed(evidence, &knobs);
        let tried: Vec<Tried> = (0..self.settings.len())
            .filter_map(|place| Tried::about(self, place, evidence))
            .collect();
        let runs = evidence.runs();
        let without = |run: usize| {
            let mut settings = self.settings.clone();
            if !runs.contains(&run) || runs.len() == 1 {
                return settings;
            }
            if let Some(now) = &now {
                let others = evidence.without(run);
                settings = one_step(&others, &settings, &knobs, &now.without(run, evidence));
            }
            for tried in &tried {
                settings[tried.place] = tried.best_without(run, evidence);
            }
            for (&place, own) in self.without.get(&run).into_iter().flatten() {
                settings[place].clone_from(own);
            }
            settings
        };
        (0..evidence.measured_runs).into_par_iter().map(without).collect()
    }
}

/// Sizes about that of an effect of which derivatives tell nothing, at even steps, and what every stretch of the logs makes of each.
struct Tried {
    place: usize,
    settings: Vec<Setting>,
    /// Log-likelihood by size and stretch.
    by_stretch: Vec<Vec<f64>>,
    /// Whether the likelihood is a smooth function of the logarithm of the size.
    smooth: bool,
}

impl Tried {
    fn about(answer: &Refined, place: usize, evidence: &Evidence<'_>) -> Option<Self> {
        /// Step of a noise's logarithm.
        const LOG: f64 = 0.08;
        let setting = &answer.settings[place];
        let Pattern::Constant(values) = &setting.pattern else {
            return None;
        };
        let (middle, param) = (values[0], &setting.spec.params[0]);
        let smooth = is_noise(setting);
        let sizes: Vec<f64> = if smooth {
            [-LOG, 0.0, LOG].map(|log| middle * log.exp()).to_vec()
        } else if jumps(setting) {
            let step = match setting.spec.name {
                "command-delay" => evidence.physics_step_s()?,
                _ => answer.standard_errors[place][0],
            };
            [-2.0, -1.0, 0.0, 1.0, 2.0].map(|by| middle + by * step).to_vec()
        } else {
            return None;
        };
        let with = |size: &f64| Setting::constant(setting.spec, [size.clamp(param.low, param.high)]);
        let settings: Vec<Setting> = sizes.iter().map(with).collect();
        let likelihoods = |own: &Setting| {
            let mut all = answer.settings.clone();
            all[place] = own.clone();
            evidence.likelihoods(&all)
        };
        Some(Self {
            place,
            by_stretch: settings.iter().map(likelihoods).collect::<Option<_>>()?,
            settings,
            smooth,
        })
    }

    fn best_without(&self, run: usize, evidence: &Evidence<'_>) -> Setting {
        let total = |by_stretch: &Vec<f64>| -> f64 {
            let stretches = evidence.stretches.iter().zip(by_stretch);
            let others = stretches.filter(|(stretch, _)| stretch.run != run);
            others.map(|(_, likelihood)| likelihood).sum()
        };
        let totals: Vec<f64> = self.by_stretch.iter().map(total).collect();
        let vertex = if self.smooth { self.vertex(&totals) } else { None };
        vertex.unwrap_or_else(|| {
            let best = (0..totals.len()).max_by(|&a, &b| totals[a].total_cmp(&totals[b]));
            self.settings[best.unwrap_or(0)].clone()
        })
    }

    /// The size at the top of a parabola through three over the size's logarithm; `None` if it has none near them.
    fn vertex(&self, totals: &[f64]) -> Option<Setting> {
        let steps = top_of_parabola(totals.try_into().ok()?).filter(|steps| steps.abs() <= 2.0)?;
        let [before, at] = [0, 1].map(|i| self.settings[i].pattern.numbers()[0]);
        Some(Setting::constant(
            self.settings[1].spec,
            [at * (at / before).powf(steps)],
        ))
    }
}

#[cfg(test)]
mod tests {
    use sim::find;

    use super::*;

    #[test]
    fn a_noise_has_the_size_at_the_top_of_a_parabola_over_its_logarithm() {
        let spec = find("camera-noise").unwrap();
        let log = |i: i32| 0.08 * f64::from(i);
        let tried = Tried {
            place: 0,
            settings: (-1..=1)
                .map(|i| Setting::constant(spec, [2.0 * log(i).exp()]))
                .collect(),
            by_stretch: Vec::new(),
            smooth: true,
        };
        let top = |at: f64| {
            let likelihoods = [-1, 0, 1].map(|i| -40.0 * (log(i) - at).powi(2));
            tried.vertex(&likelihoods).map(|found| found.pattern.numbers()[0])
        };
        assert!((top(0.05).unwrap() - 2.0 * 0.05_f64.exp()).abs() < 1e-12);
        assert!((top(-0.1).unwrap() - 2.0 * (-0.1_f64).exp()).abs() < 1e-12);
        assert_eq!(top(0.5), None);
        assert_eq!(tried.vertex(&[1.0, 0.0, 1.0]), None);
    }
}
