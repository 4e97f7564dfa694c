//! Where ticks stand and what they say.

use crate::axis::Scale;

/// A labelled tick.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Tick {
    /// The value it marks.
    pub(crate) at: f64,
    /// The lines of its label.
    pub(crate) lines: Vec<String>,
}

impl Tick {
    pub(crate) fn new(at: f64, label: String) -> Self {
        Self {
            at,
            lines: vec![label],
        }
    }
}

/// A step of an axis: mantissa 1, 2 or 5 times a power of ten.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Step {
    mantissa: u8,
    exponent: i32,
}

impl Step {
    /// The smallest step that divides the span into no more than the given number of parts.
    pub(crate) fn for_span(span: f64, parts: f64) -> Self {
        let least = span / parts.max(1.0);
        let mut step = Self {
            mantissa: 1,
            exponent: least.log10().floor() as i32 - 1,
        };
        while step.value() < least * (1.0 - 1e-9) {
            step = step.next();
        }
        step
    }

    /// The next larger step.
    pub(crate) fn next(self) -> Self {
        match self.mantissa {
            1 => Self { mantissa: 2, ..self },
            2 => Self { mantissa: 5, ..self },
            _ => Self {
                mantissa: 1,
                exponent: self.exponent + 1,
            },
        }
    }

    pub(crate) fn value(self) -> f64 {
        self.times(1)
    }

    /// A multiple of the step, rounded once: 3 steps of 0.1 are 0.3.
    fn times(self, count: i64) -> f64 {
        let units = count as f64 * f64::from(self.mantissa);
        if self.exponent < 0 {
            units / 10_f64.powi(-self.exponent)
        } else {
            units * 10_f64.powi(self.exponent)
        }
    }

    /// The ticks at the multiples of the step in the range.
    pub(crate) fn ticks(self, [low, high]: [f64; 2]) -> Vec<Tick> {
        let step = self.value();
        let first = (low / step - 1e-9).ceil() as i64;
        let last = (high / step + 1e-9).floor() as i64;
        let largest = low.abs().max(high.abs());
        let plain = largest < 1e6 && self.exponent >= -4;
        (first..=last)
            .map(|count| {
                let at = self.times(count);
                let label = if plain {
                    decimal(at, self.exponent.min(0).unsigned_abs() as usize)
                } else {
                    scientific(at)
                };
                Tick::new(at, label)
            })
            .collect()
    }
}

/// The number with a fixed count of decimals and a true minus sign.
pub(crate) fn decimal(value: f64, decimals: usize) -> String {
    let value = if value == 0.0 { 0.0 } else { value };
    format!("{value:.decimals$}").replace('-', "−")
}

/// The number as mantissa and power of ten.
fn scientific(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let written = format!("{value:e}");
    let (mantissa, exponent) = written.split_once('e').unwrap_or((&written, "0"));
    let mantissa = mantissa.parse::<f64>().unwrap_or(1.0);
    let rounded = format!("{mantissa:.4}");
    let mantissa = rounded
        .trim_end_matches('0')
        .trim_end_matches('.')
        .replace('-', "−");
    let power: String = exponent.chars().map(superscript).collect();
    match mantissa.as_str() {
        "1" => format!("10{power}"),
        "−1" => format!("−10{power}"),
        _ => format!("{mantissa}×10{power}"),
    }
}

fn superscript(digit: char) -> char {
    match digit {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        '4' => '⁴',
        '5' => '⁵',
        '6' => '⁶',
        '7' => '⁷',
        '8' => '⁸',
        '9' => '⁹',
        _ => '⁰',
    }
}

/// The shortest text of a number that stands alone.
pub(crate) fn number(value: f64) -> String {
    if value != 0.0 && !(1e-4..1e6).contains(&value.abs()) {
        scientific(value)
    } else {
        format!("{value}").replace('-', "−")
    }
}

/// Candidates for the ticks of a linear axis, from dense to sparse; none has more than one tick over the parts.
pub(crate) fn linear(range: [f64; 2], parts: f64) -> impl Iterator<Item = Vec<Tick>> {
    // Twice the parts: the finer step may still have few ticks in the range.
    let finest = Step::for_span(range[1] - range[0], 2.5 * parts);
    std::iter::successors(Some(finest), |step| Some(step.next()))
        .map(move |step| step.ticks(range))
        .skip_while(move |ticks| ticks.len() as f64 > parts + 1.0)
}

/// Candidates for the ticks of a logarithmic axis, from dense to sparse: 1, 2 and 5 times the powers of ten, the powers
/// themselves, then every second, third, ... of them. Less than a decade takes the linear ones where they are more.
pub(crate) fn logarithmic(range: [f64; 2], parts: f64) -> impl Iterator<Item = Vec<Tick>> {
    let plain = range[0] >= 0.99e-3 && range[1] <= 1.01e5;
    let tick = move |at: f64| Tick::new(at, if plain { number(at) } else { scientific(at) });
    let fine: Vec<Tick> = multiples(range, &[1, 2, 5]).into_iter().map(tick).collect();
    let coarse = (1..).map(move |stride| {
        let powers = exponents(range).filter(|exponent| exponent.rem_euclid(stride) == 0);
        powers
            .map(|exponent| tick(10_f64.powi(exponent)))
            .collect::<Vec<_>>()
    });
    let near = (range[1] < 10.0 * range[0])
        .then(|| linear(range, parts.min(5.0)).next())
        .flatten()
        .filter(|near| near.len() > fine.len());
    let most = parts as usize + 1;
    let fits = fine.len() <= most;
    near.into_iter()
        .chain(fits.then_some(fine))
        .chain(coarse.skip_while(move |powers| powers.len() > most))
}

/// The whole powers of ten that may lie in the range.
fn exponents([low, high]: [f64; 2]) -> std::ops::RangeInclusive<i32> {
    (low.log10() - 1e-9).ceil() as i32..=(high.log10() + 1e-9).floor() as i32
}

/// The given multiples of powers of ten in the range.
fn multiples([low, high]: [f64; 2], mantissas: &[i64]) -> Vec<f64> {
    let first = low.log10().floor() as i32;
    let last = high.log10().ceil() as i32;
    let all = (first..=last).flat_map(|exponent| {
        mantissas.iter().map(move |&count| {
            Step {
                mantissa: 1,
                exponent,
            }
            .times(count)
        })
    });
    all.filter(|&at| at >= low * (1.0 - 1e-9) && at <= high * (1.0 + 1e-9))
        .collect()
}

/// Where short ticks without label stand: at all multiples of powers of ten, up to six decades.
pub(crate) fn minor(scale: Scale, range: [f64; 2]) -> Vec<f64> {
    match scale {
        Scale::Log if range[1] / range[0] < 1e6 => multiples(range, &[1, 2, 3, 4, 5, 6, 7, 8, 9]),
        _ => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn at(ticks: &[Tick]) -> Vec<f64> {
        ticks.iter().map(|tick| tick.at).collect()
    }

    fn labels(ticks: &[Tick]) -> Vec<&str> {
        ticks.iter().map(|tick| tick.lines[0].as_str()).collect()
    }

    #[test]
    fn linear_ticks_are_exact_multiples() {
        let ticks = linear([-0.1, 0.52], 7.0).next().unwrap();
        assert_eq!(at(&ticks), [-0.1, 0.0, 0.1, 0.2, 0.3, 0.4, 0.5]);
        assert_eq!(labels(&ticks), ["−0.1", "0.0", "0.1", "0.2", "0.3", "0.4", "0.5"]);
        assert_eq!(
            at(&linear([0.0, 100.0], 5.0).next().unwrap()),
            [0.0, 20.0, 40.0, 60.0, 80.0, 100.0]
        );
        assert_eq!(
            at(&linear([0.0, 4200.0], 5.0).next().unwrap()),
            [0.0, 1000.0, 2000.0, 3000.0, 4000.0]
        );
    }

    #[test]
    fn steps_go_one_two_five() {
        let step = Step::for_span(10.0, 10.0);
        let values: Vec<f64> = std::iter::successors(Some(step), |step| Some(step.next()))
            .take(5)
            .map(Step::value)
            .collect();
        assert_eq!(values, [1.0, 2.0, 5.0, 10.0, 20.0]);
    }

    #[test]
    fn far_numbers_are_powers_of_ten() {
        assert_eq!(
            labels(&linear([0.0, 2e7], 2.0).next().unwrap()),
            ["0", "10⁷", "2×10⁷"]
        );
        assert_eq!(
            labels(&linear([-2e-6, 0.0], 2.0).next().unwrap()),
            ["−2×10⁻⁶", "−10⁻⁶", "0"]
        );
        assert_eq!(number(-0.25), "−0.25");
    }

    #[test]
    fn logarithmic_ticks_thin_out_with_the_decades() {
        assert_eq!(
            at(&logarithmic([1.0, 100.0], 6.0).next().unwrap()),
            [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0]
        );
        assert_eq!(
            labels(&logarithmic([1e-5, 1e-2], 4.0).next().unwrap()),
            ["10⁻⁵", "10⁻⁴", "10⁻³", "10⁻²"]
        );
        assert_eq!(
            at(&logarithmic([1.0, 1e6], 3.0).next().unwrap()),
            [1.0, 1e2, 1e4, 1e6]
        );
        assert_eq!(
            at(&logarithmic([30.0, 45.0], 5.0).next().unwrap()),
            [30.0, 35.0, 40.0, 45.0]
        );
    }

    #[test]
    fn short_ticks_fill_the_decades() {
        assert_eq!(minor(Scale::Log, [1.0, 10.0]).len(), 10);
        assert!(minor(Scale::Linear, [1.0, 10.0]).is_empty());
    }

    proptest! {
        #[test]
        fn linear_ticks_lie_in_the_range_and_are_few(low in -1e6..1e6_f64, span in 1e-3..1e6_f64, parts in 2.0..9.0_f64) {
            let range = [low, low + span];
            let ticks = at(&linear(range, parts).next().unwrap());
            prop_assert!(ticks.len() as f64 <= parts + 1.0);
            let slack = 1e-6 * span;
            prop_assert!(ticks.iter().all(|&at| at >= low - slack && at <= range[1] + slack));
        }
    }
}
