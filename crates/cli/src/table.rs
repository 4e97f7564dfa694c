//! Tables as text, Markdown and HTML.

use std::fmt::Write as _;

/// A column with a cell of more characters than this holds prose: it stands to the left, and a page breaks it into lines.
const PROSE: usize = 40;

/// Named columns and rows of words.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Table {
    /// What stands above it; may be empty.
    pub(crate) title: String,
    pub(crate) columns: Vec<String>,
    pub(crate) rows: Vec<Vec<String>>,
}

impl Table {
    pub(crate) fn new(title: impl Into<String>, columns: &[&str]) -> Self {
        Self {
            title: title.into(),
            columns: columns.iter().map(|c| (*c).to_owned()).collect(),
            rows: Vec::new(),
        }
    }

    pub(crate) fn push(&mut self, row: impl IntoIterator<Item = impl Into<String>>) {
        self.rows.push(row.into_iter().map(Into::into).collect());
    }

    /// For a terminal: the first column and prose to the left, the others to the right.
    pub(crate) fn to_text(&self) -> String {
        let width = |i: usize| {
            let cells = self.rows.iter().filter_map(|row| row.get(i));
            cells
                .chain(self.columns.get(i))
                .map(|cell| cell.chars().count())
                .max()
                .unwrap_or(0)
        };
        let widths: Vec<usize> = (0..self.columns.len()).map(width).collect();
        let prose = self.prose();
        let line = |cells: &[String]| {
            let padded = cells.iter().zip(&widths).enumerate().map(|(i, (cell, &width))| {
                if i == 0 || prose[i] {
                    format!("{cell:<width$}")
                } else {
                    format!("{cell:>width$}")
                }
            });
            padded.collect::<Vec<_>>().join("  ").trim_end().to_owned()
        };
        let mut text = String::new();
        if !self.title.is_empty() {
            let _ = writeln!(text, "{}", self.title);
        }
        let _ = writeln!(text, "{}", line(&self.columns));
        let _ = writeln!(
            text,
            "{}",
            "-".repeat(widths.iter().sum::<usize>() + 2 * widths.len().saturating_sub(1))
        );
        for row in &self.rows {
            let _ = writeln!(text, "{}", line(row));
        }
        text
    }

    /// Of each column whether it holds prose.
    fn prose(&self) -> Vec<bool> {
        let is_prose = |column: usize| {
            let mut cells = self.rows.iter().filter_map(|row| row.get(column));
            cells.any(|cell| cell.chars().count() > PROSE)
        };
        (0..self.columns.len()).map(is_prose).collect()
    }

    /// As CSV; cells with a comma or a quotation mark are quoted.
    pub(crate) fn to_csv(&self) -> String {
        let cell = |cell: &String| match cell.contains([',', '"', '\n']) {
            true => format!("\"{}\"", cell.replace('"', "\"\"")),
            false => cell.clone(),
        };
        let line = |row: &Vec<String>| row.iter().map(cell).collect::<Vec<_>>().join(",") + "\n";
        std::iter::once(&self.columns)
            .chain(&self.rows)
            .map(line)
            .collect()
    }

    /// As an HTML table; the title is its caption.
    pub(crate) fn to_html(&self) -> String {
        let prose = self.prose();
        let cells = |tag: &str, row: &[String]| {
            let cell = |(cell, prose): (&String, &bool)| {
                let class = if *prose { " class=\"prose\"" } else { "" };
                format!("<{tag}{class}>{}</{tag}>", escape(cell))
            };
            row.iter().zip(&prose).map(cell).collect::<String>()
        };
        let mut html = String::from("<table>\n");
        if !self.title.is_empty() {
            let _ = writeln!(html, "<caption>{}</caption>", escape(&self.title));
        }
        let _ = writeln!(
            html,
            "<thead><tr>{}</tr></thead>\n<tbody>",
            cells("th", &self.columns)
        );
        for row in &self.rows {
            let _ = writeln!(html, "<tr>{}</tr>", cells("td", row));
        }
        html.push_str("</tbody></table>\n");
        html
    }
}

/// Text as it may stand in HTML.
pub(crate) fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

/// So many of them, in words.
pub(crate) fn counted(count: usize, what: &str) -> String {
    match count {
        1 => format!("1 {what}"),
        _ => format!("{count} {what}s"),
    }
}

/// A probability as a reader wants it: three decimals, or the power of ten of a small one.
pub(crate) fn probability(p: f64) -> String {
    if p >= 0.001 {
        format!("{p:.3}")
    } else if p == 0.0 {
        "< 1e-300".into()
    } else {
        format!("{p:.0e}")
    }
}

/// A number with four significant digits, trailing zeros left out; a very small one with its power of ten.
pub(crate) fn four_digits(x: f64) -> String {
    let rounded: f64 = format!("{x:.3e}").parse().unwrap_or(x);
    if rounded != 0.0 && rounded.abs() < SMALL {
        format!("{rounded:e}")
    } else {
        format!("{rounded}")
    }
}

/// A number with its standard error, which has two significant digits.
pub(crate) fn with_error(value: f64, error: f64) -> String {
    if value.abs().max(error) < SMALL {
        let power = power_of_ten(value.abs().max(error));
        let up = 10.0_f64.powi(-power);
        return format!("({})e{power}", with_error(up * value, up * error));
    }
    let decimals = decimals(error);
    format!("{value:.decimals$} ± {error:.decimals$}")
}

/// A number with the ends of its interval, as far as it has any.
pub(crate) fn with_interval(value: f64, [low, high]: [Option<f64>; 2]) -> String {
    if value != 0.0 && value.abs() < SMALL {
        let power = power_of_ten(value.abs());
        let up = |x: f64| 10.0_f64.powi(-power) * x;
        let number = with_interval(up(value), [low.map(up), high.map(up)]);
        return format!("({number})e{power}");
    }
    let reach = |end: Option<f64>| end.map_or(f64::INFINITY, |end| (value - end).abs());
    let decimals = decimals(reach(low).min(reach(high)).min(value.abs()));
    let number = |x: f64| format!("{x:.decimals$}");
    let interval = match (low.map(number), high.map(number)) {
        (Some(low), Some(high)) => format!("{low} to {high}"),
        (Some(low), None) => format!("{low} or more"),
        (None, Some(high)) => format!("{high} or less"),
        (None, None) => "of any size".into(),
    };
    format!("{}, {interval}", number(value))
}

/// A number by whose distance from a neutral one it matters: of the distance it shows two significant digits.
pub(crate) fn far_from(neutral: f64, x: f64) -> String {
    let distance = (x - neutral).abs();
    if neutral == 0.0 && distance < SMALL {
        return format!("{x:.1e}");
    }
    let decimals = decimals(distance);
    format!("{x:.decimals$}")
}

/// Numbers below this are shown with their power of ten.
const SMALL: f64 = 1e-3;

/// Decimals with which a number has two significant digits.
fn decimals(x: f64) -> usize {
    usize::try_from(1 - power_of_ten(x)).unwrap_or(0)
}

/// The power of ten of a number rounded to two significant digits: 0.0996 has its second digit where 0.10 has.
fn power_of_ten(x: f64) -> i32 {
    format!("{x:.1e}")
        .split_once('e')
        .and_then(|(_, power)| power.parse().ok())
        .unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_have_two_digits_and_values_as_many_as_their_errors() {
        assert_eq!(with_error(1.5e-4, 1.1e-6), "(1.500 ± 0.011)e-4");
        assert_eq!(with_error(-0.078_04, 0.002_24), "-0.0780 ± 0.0022");
        assert_eq!(with_error(37.66, 1.249), "37.7 ± 1.2");
        assert_eq!(with_error(1234.5, 0.0996), "1234.50 ± 0.10");
        assert_eq!(with_error(1234.5, 123.0), "1234 ± 123");
        assert_eq!(with_interval(14.73, [Some(11.08), None]), "14.7, 11.1 or more");
        assert_eq!(
            with_interval(-1.5e-4, [None, Some(-1.2e-4)]),
            "(-1.50, -1.20 or less)e-4"
        );
        assert_eq!(
            with_interval(31.2, [Some(30.0), Some(71.0)]),
            "31.2, 30.0 to 71.0"
        );
        assert_eq!(four_digits(0.063_514_8), "0.06351");
        assert_eq!(four_digits(-2.0), "-2");
        assert_eq!(four_digits(0.000_012_34), "1.234e-5");
        assert_eq!(four_digits(0.0), "0");
    }

    #[test]
    fn what_is_near_its_neutral_value_shows_by_how_much() {
        assert_eq!(far_from(1.0, 0.999_726), "0.99973");
        assert_eq!(far_from(1.0, 1.234), "1.23");
        assert_eq!(far_from(0.0, -1.578), "-1.6");
        assert_eq!(far_from(0.0, 8.046e-7), "8.0e-7");
        assert_eq!(far_from(0.0, 59.83), "60");
    }

    #[test]
    fn text_is_aligned_and_html_escaped() {
        let mut table = Table::new("T", &["run", "d"]);
        table.push(["a & b", "1.0"]);
        table.push(["c", "10.0"]);
        assert_eq!(
            table.to_text(),
            "T\nrun       d\n-----------\na & b   1.0\nc      10.0\n"
        );
        assert!(table.to_html().contains("<td>a &amp; b</td>"));
        table.push(["a sentence that does not fit into the width of a column", "-"]);
        assert!(table.to_html().contains("<td class=\"prose\">a sentence"));
        table.rows.pop();
        table.push(["d, \"e\"", "2"]);
        assert!(table.to_csv().ends_with("c,10.0\n\"d, \"\"e\"\"\",2\n"));
    }
}
