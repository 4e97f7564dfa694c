//! Tables as text, Markdown and HTML.

use std::fmt::Write as _;

/// A cell of more characters than this is broken into lines.
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

    /// For a terminal: the first column to the left, the others to the right.
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
        let line = |cells: &[String]| {
            let padded = cells.iter().zip(&widths).enumerate().map(|(i, (cell, &width))| {
                if i == 0 {
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
        let cells = |tag: &str, row: &[String]| {
            let cell = |cell: &String| {
                let prose = tag == "td" && cell.chars().count() > PROSE;
                let class = if prose { " class=\"prose\"" } else { "" };
                format!("<{tag}{class}>{}</{tag}>", escape(cell))
            };
            row.iter().map(cell).collect::<String>()
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

/// A probability as a reader wants it: three decimals, or the power of ten of a small one.
pub(crate) fn probability(p: f64) -> String {
    if p >= 0.001 {
        format!("{p:.3}")
    } else {
        format!("{p:.0e}")
    }
}

/// A number with four significant digits, trailing zeros left out.
pub(crate) fn four_digits(x: f64) -> String {
    format!("{x:.3e}")
        .parse::<f64>()
        .map_or(String::new(), |x| format!("{x}"))
}

/// A number with its standard error, which has two significant digits.
pub(crate) fn with_error(value: f64, error: f64) -> String {
    // Rounded first: 0.0996 has its second digit where 0.10 has.
    let power = format!("{error:.1e}")
        .split_once('e')
        .and_then(|(_, power)| power.parse().ok())
        .unwrap_or(0);
    let decimals = usize::try_from(1 - power).unwrap_or(0);
    format!("{value:.decimals$} ± {error:.decimals$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_have_two_digits_and_values_as_many_as_their_errors() {
        assert_eq!(with_error(1.5e-4, 1.1e-6), "0.0001500 ± 0.0000011");
        assert_eq!(with_error(-0.078_04, 0.002_24), "-0.0780 ± 0.0022");
        assert_eq!(with_error(37.66, 1.249), "37.7 ± 1.2");
        assert_eq!(with_error(1234.5, 0.0996), "1234.50 ± 0.10");
        assert_eq!(with_error(1234.5, 123.0), "1234 ± 123");
        assert_eq!(four_digits(0.063_514_8), "0.06351");
        assert_eq!(four_digits(-2.0), "-2");
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
