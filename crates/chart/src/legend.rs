//! Legends: a sample and a name for each labelled mark.

use crate::glyph::{FAINT, arrow_head, box_data, cap, inside, markers};
use crate::mark::{Direction, Mark, Shape};
use crate::path::Px;
use crate::style::Style;
use crate::svg::{Align, Svg, Type, area, line_data, stroke};
use crate::text;

const TEXT_PX: f64 = 11.5;
const ROW_PX: f64 = 18.0;
const SAMPLE_PX: f64 = 26.0;
const GAP_PX: f64 = 7.0;
const BETWEEN_PX: f64 = 18.0;
/// The widest name in a legend beside a panel, px; longer ones take several lines.
const NAME_PX: f64 = 230.0;

/// A name with the marks that bear it.
#[derive(Debug)]
struct Entry<'a> {
    lines: Vec<String>,
    marks: Vec<&'a Mark>,
    /// The upper left corner, from that of the legend.
    at: Px,
}

/// A legend whose entries have their places.
#[derive(Debug)]
pub(crate) struct Block<'a> {
    entries: Vec<Entry<'a>>,
    pub(crate) width: f64,
    pub(crate) height: f64,
}

impl<'a> Block<'a> {
    /// The legend of these marks in one column; none if no mark has a label.
    pub(crate) fn column(marks: impl Iterator<Item = &'a Mark>) -> Option<Self> {
        let mut entries = entries(marks);
        let mut height = 0.0;
        for entry in &mut entries {
            entry.at = [0.0, height];
            height += entry.height();
        }
        Self::around(entries, height)
    }

    /// The legend in as few rows as the width allows, filled row by row and about equally full.
    pub(crate) fn rows(marks: impl Iterator<Item = &'a Mark>, room: f64) -> Option<Self> {
        let mut entries = entries(marks);
        let widest = entries.iter().map(Entry::width).fold(1.0, f64::max);
        let fit = (((room + BETWEEN_PX) / (widest + BETWEEN_PX)) as usize).max(1);
        let columns = entries.len().div_ceil(entries.len().div_ceil(fit).max(1)).max(1);
        let mut height = 0.0;
        for row in entries.chunks_mut(columns) {
            for (column, entry) in row.iter_mut().enumerate() {
                entry.at = [column as f64 * (widest + BETWEEN_PX), height];
            }
            height += row.iter().map(Entry::height).fold(0.0, f64::max);
        }
        Self::around(entries, height)
    }

    fn around(entries: Vec<Entry<'a>>, height: f64) -> Option<Self> {
        let width = entries
            .iter()
            .map(|entry| entry.at[0] + entry.width())
            .fold(0.0, f64::max);
        (!entries.is_empty()).then_some(Self {
            entries,
            width,
            height,
        })
    }

    /// Draws the legend with its upper left corner at a point.
    pub(crate) fn draw(&self, svg: &mut Svg, [x, y]: Px) {
        for entry in &self.entries {
            let [left, top] = [x + entry.at[0], y + entry.at[1]];
            for mark in &entry.marks {
                sample(svg, mark, [left, top + ROW_PX / 2.0]);
            }
            let baseline = top + ROW_PX / 2.0 + 0.36 * TEXT_PX;
            svg.text(
                &entry.lines,
                [left + SAMPLE_PX + GAP_PX, baseline],
                Type::new(TEXT_PX, Align::Start),
            );
        }
    }
}

impl Entry<'_> {
    fn width(&self) -> f64 {
        SAMPLE_PX + GAP_PX + text::widest_px(&self.lines, TEXT_PX)
    }

    fn height(&self) -> f64 {
        ROW_PX + (self.lines.len().max(1) - 1) as f64 * text::LINE * TEXT_PX
    }
}

/// One entry for each label, in order of first use.
fn entries<'a>(marks: impl Iterator<Item = &'a Mark>) -> Vec<Entry<'a>> {
    let mut named: Vec<(&str, Entry<'a>)> = Vec::new();
    for mark in marks.filter(|mark| !mark.label.is_empty()) {
        match named.iter_mut().find(|(label, _)| *label == mark.label) {
            Some((_, entry)) if entry.marks.iter().any(|&other| looks_like(other, mark)) => {}
            Some((_, entry)) => entry.marks.push(mark),
            None => {
                let lines = text::wrap(&mark.label, TEXT_PX, NAME_PX);
                named.push((
                    &mark.label,
                    Entry {
                        lines,
                        marks: vec![mark],
                        at: [0.0, 0.0],
                    },
                ));
            }
        }
    }
    named.into_iter().map(|(_, entry)| entry).collect()
}

fn looks_like(a: &Mark, b: &Mark) -> bool {
    a.style == b.style && std::mem::discriminant(&a.shape) == std::mem::discriminant(&b.shape)
}

/// Draws a mark in small, `SAMPLE_PX` wide, from the middle of its left edge.
fn sample(svg: &mut Svg, mark: &Mark, [x, y]: Px) {
    let (style, middle, right) = (&mark.style, x + SAMPLE_PX / 2.0, x + SAMPLE_PX);
    let mut data = String::new();
    match &mark.shape {
        Shape::Line(_) | Shape::Segments(_) | Shape::ColoredLine { .. } => horizontal(svg, [x, y], style),
        Shape::Rules {
            direction: Direction::Horizontal,
            ..
        } => horizontal(svg, [x, y], style),
        Shape::Rules { .. } => {
            line_data(&[[middle, y - 7.0], [middle, y + 7.0]], &mut data);
            svg.path(&data, &stroke(style));
        }
        Shape::Points(_) => markers(svg, &[[middle, y]], style),
        Shape::Arrows(_) => {
            let mut head = String::new();
            line_data(
                &[[x, y], arrow_head([x, y], [right, y], style.width_px, &mut head)],
                &mut data,
            );
            svg.path(&data, &stroke(style));
            svg.path(&head, &area(style.color, style.opacity));
        }
        Shape::ErrorBars { direction, .. } => {
            let ends = match direction {
                Direction::Vertical => [[middle, y - 7.0], [middle, y + 7.0]],
                Direction::Horizontal => [[middle - 9.0, y], [middle + 9.0, y]],
            };
            line_data(&ends, &mut data);
            ends.into_iter().for_each(|end| cap(end, *direction, &mut data));
            svg.path(&data, &stroke(style));
        }
        Shape::Band(_) | Shape::Stripes { .. } => {
            swatch(svg, [x, y], &area(style.color, FAINT * style.opacity))
        }
        Shape::Bars { .. } => swatch(svg, [x, y], &area(style.color, style.opacity)),
        Shape::Polygon(_) if inside(style).is_none() => horizontal(svg, [x, y], style),
        Shape::Polygon(_) => {
            let (color, share) = inside(style).unwrap_or((style.color, 0.0));
            swatch(svg, [x, y], &area(color, share));
            if style.width_px > 0.0 {
                swatch(svg, [x, y], &stroke(style));
            }
        }
        Shape::Ellipses(_) => oval(svg, [middle, y], style),
        Shape::Notes(_) | Shape::Cells(_) => {}
    }
}

fn horizontal(svg: &mut Svg, [x, y]: Px, style: &Style) {
    let mut data = String::new();
    line_data(&[[x, y], [x + SAMPLE_PX, y]], &mut data);
    svg.path(&data, &stroke(style));
}

fn swatch(svg: &mut Svg, [x, y]: Px, attributes: &str) {
    let mut data = String::new();
    box_data([x + 2.0, y - 5.5], [x + SAMPLE_PX - 2.0, y + 5.5], &mut data);
    svg.path(&data, attributes);
}

fn oval(svg: &mut Svg, [x, y]: Px, style: &Style) {
    let data = format!(
        "M{} {}a12 6 0 1 0 24 0a12 6 0 1 0 -24 0Z",
        crate::svg::Num(x - 12.0),
        crate::svg::Num(y)
    );
    if let Some((color, share)) = inside(style) {
        svg.path(&data, &area(color, share));
    }
    svg.path(&data, &stroke(style));
}
