//! The text of an SVG picture.

use std::fmt::{self, Write as _};

use crate::color::Color;
use crate::path::Px;
use crate::style::Style;
use crate::text::LINE;

/// Fonts that look alike, the first that the reader has.
const FONTS: &str = "'Helvetica Neue',Helvetica,Arial,'Liberation Sans','DejaVu Sans',sans-serif";

/// A coordinate with at most two decimals; what is not finite never gets here.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Num(pub(crate) f64);

impl fmt::Display for Num {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let hundredths = (self.0 * 100.0).round() as i64;
        if hundredths < 0 {
            f.write_char('-')?;
        }
        let (whole, part) = (hundredths.unsigned_abs() / 100, hundredths.unsigned_abs() % 100);
        match (part, part % 10) {
            (0, _) => write!(f, "{whole}"),
            (_, 0) => write!(f, "{whole}.{}", part / 10),
            _ => write!(f, "{whole}.{part:02}"),
        }
    }
}

/// Text as it may stand in XML: markup escaped, characters that XML does not know left out.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Escaped<'a>(pub(crate) &'a str);

impl fmt::Display for Escaped<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for letter in self.0.chars() {
            match letter {
                '&' => f.write_str("&amp;")?,
                '<' => f.write_str("&lt;")?,
                '>' => f.write_str("&gt;")?,
                '"' => f.write_str("&quot;")?,
                '\n' | '\t' => f.write_char(' ')?,
                '\u{fffe}' | '\u{ffff}' => {}
                letter if letter.is_control() => {}
                letter => f.write_char(letter)?,
            }
        }
        Ok(())
    }
}

/// Which end of a text its point is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Align {
    Start,
    Middle,
    End,
}

impl Align {
    fn name(self) -> &'static str {
        match self {
            Self::Start => "start",
            Self::Middle => "middle",
            Self::End => "end",
        }
    }
}

/// How a text is set.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Type {
    pub(crate) size_px: f64,
    pub(crate) color: Color,
    pub(crate) align: Align,
    pub(crate) weight: Weight,
    /// Turned about its point, degrees clockwise.
    pub(crate) turn_deg: f64,
}

/// How strong a text is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Weight {
    Normal,
    Bold,
    /// Normal with a white edge, to be read over marks.
    Haloed,
}

impl Type {
    pub(crate) fn new(size_px: f64, align: Align) -> Self {
        Self {
            size_px,
            color: Color::INK,
            align,
            weight: Weight::Normal,
            turn_deg: 0.0,
        }
    }
}

/// A picture being written.
#[derive(Debug)]
pub(crate) struct Svg {
    out: String,
}

impl Svg {
    /// A white page of this size with its title and description.
    pub(crate) fn new([width, height]: [f64; 2], title: &str, description: &str) -> Self {
        let (w, h) = (Num(width.ceil()), Num(height.ceil()));
        let mut svg = Self { out: String::new() };
        svg.put(format_args!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{w}\" height=\"{h}\" viewBox=\"0 0 {w} {h}\" \
             role=\"img\" font-family=\"{FONTS}\" stroke-linejoin=\"round\">"
        ));
        svg.put(format_args!("<title>{}</title>", Escaped(title)));
        if !description.is_empty() {
            svg.put(format_args!("<desc>{}</desc>", Escaped(description)));
        }
        svg.put(format_args!(
            "<rect width=\"{w}\" height=\"{h}\" fill=\"#ffffff\"/>"
        ));
        svg
    }

    /// Writes one element on a line of its own.
    pub(crate) fn put(&mut self, element: fmt::Arguments<'_>) {
        self.out
            .write_fmt(element)
            .expect("writing to a string cannot fail");
        self.out.push('\n');
    }

    /// A path with the given attributes; nothing if the path is empty.
    pub(crate) fn path(&mut self, data: &str, attributes: &str) {
        if !data.is_empty() {
            self.put(format_args!("<path d=\"{data}\" {attributes}/>"));
        }
    }

    /// A text of one or several lines, the first with its baseline on the point.
    pub(crate) fn text(&mut self, lines: &[String], [x, y]: Px, set: Type) {
        for (index, line) in lines.iter().enumerate() {
            let down = index as f64 * LINE * set.size_px;
            self.put(format_args!(
                "<text {}font-size=\"{}\" fill=\"{}\" text-anchor=\"{}\"{}>{}</text>",
                place([x, y], down, set.turn_deg),
                Num(set.size_px),
                set.color,
                set.align.name(),
                match set.weight {
                    Weight::Normal => "",
                    Weight::Bold => " font-weight=\"bold\"",
                    Weight::Haloed => " stroke=\"#ffffff\" stroke-width=\"3\" stroke-opacity=\"0.85\" paint-order=\"stroke\"",
                },
                Escaped(line)
            ));
        }
    }

    pub(crate) fn finish(mut self) -> String {
        self.out.push_str("</svg>\n");
        self.out
    }
}

/// The attributes that put a line of text at a point, or below it when turned.
fn place([x, y]: Px, down: f64, turn_deg: f64) -> String {
    if turn_deg == 0.0 {
        format!("x=\"{}\" y=\"{}\" ", Num(x), Num(y + down))
    } else {
        let turn = Num(turn_deg);
        format!(
            "transform=\"translate({} {}) rotate({turn})\" y=\"{}\" ",
            Num(x),
            Num(y),
            Num(down)
        )
    }
}

/// The attributes of a line in a style.
pub(crate) fn stroke(style: &Style) -> String {
    let mut attributes = format!(
        "fill=\"none\" stroke=\"{}\" stroke-width=\"{}\"",
        style.color,
        Num(style.width_px)
    );
    let dashes: Vec<String> = style
        .dash
        .lengths()
        .iter()
        .map(|length| Num(length * style.width_px.max(1.0)).to_string())
        .collect();
    if !dashes.is_empty() {
        attributes += &format!(" stroke-dasharray=\"{}\"", dashes.join(" "));
    }
    attributes + &opacity("stroke-opacity", style.opacity)
}

/// The attributes of an area without outline.
pub(crate) fn area(color: Color, share: f64) -> String {
    format!("fill=\"{color}\"{}", opacity("fill-opacity", share))
}

/// An opacity as an attribute; none where it is opaque.
pub(crate) fn opacity(name: &str, share: f64) -> String {
    if share >= 1.0 || share.is_nan() {
        String::new()
    } else {
        format!(" {name}=\"{}\"", Num(share.max(0.0)))
    }
}

/// Path data through the points.
pub(crate) fn line_data(points: &[Px], data: &mut String) {
    for (index, [x, y]) in points.iter().enumerate() {
        let command = match index {
            0 => "M",
            1 => "L",
            _ => " ",
        };
        write!(data, "{command}{} {}", Num(*x), Num(*y)).expect("writing to a string cannot fail");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_rounded() {
        let written: Vec<String> = [1.0, 0.5, -0.004, 12.345, -3.1, 0.05]
            .iter()
            .map(|&value| Num(value).to_string())
            .collect();
        assert_eq!(written, ["1", "0.5", "0", "12.35", "-3.1", "0.05"]);
    }

    #[test]
    fn markup_is_escaped() {
        assert_eq!(
            Escaped("a < b & \"c\" > d\u{0}").to_string(),
            "a &lt; b &amp; &quot;c&quot; &gt; d"
        );
    }

    #[test]
    fn a_line_is_one_move_and_its_points() {
        let mut data = String::new();
        line_data(&[[0.0, 1.0], [2.0, 3.0], [4.0, 5.5]], &mut data);
        assert_eq!(data, "M0 1L2 3 4 5.5");
    }
}
