//! What stands around and behind a panel's marks.

use crate::axis::Ticks;
use crate::color::Color;
use crate::draw::View;
use crate::figure::{Corner, Legend, Side};
use crate::legend::Block;
use crate::path::{Frame, Px};
use crate::plan::{
    GAP_PX, LABEL_GAP_PX, LABEL_TEXT_PX, Plan, SLANT_DEG, TICK_PX, TICK_TEXT_PX, TITLE_TEXT_PX, lines_px,
    tick_gap,
};
use crate::style::Style;
use crate::svg::{Align, Num, Svg, Type, Weight, area, line_data, stroke};
use crate::text::LINE;
use crate::ticks;

/// From the baseline of a line of text to its top, and to its middle, in font sizes.
pub(crate) const RISE: f64 = 0.8;
pub(crate) const MIDDLE: f64 = 0.36;

impl Plan<'_> {
    /// Draws the panel with the corner of its frame at a place.
    pub(crate) fn draw(&self, svg: &mut Svg, [left, top]: Px, page: [f64; 2]) {
        let [width, height] = self.size;
        let frame = Frame {
            left,
            top,
            right: left + width,
            bottom: top + height,
        };
        let view = View {
            axes: self.mappings([left, top]),
            frame,
            page,
            colors: self.colors,
        };
        self.grid(svg, &view);
        self.panel.marks.iter().for_each(|mark| view.draw(svg, mark));
        self.axis_lines(svg, &view);
        if self.labelled[0] {
            self.x_labels(svg, &view);
        }
        if self.labelled[1] {
            self.y_labels(svg, &view);
        }
        let bold = Type {
            weight: Weight::Bold,
            ..Type::new(TITLE_TEXT_PX, Align::Start)
        };
        svg.text(
            &self.title,
            [left, top - self.margins().top + TITLE_TEXT_PX],
            bold,
        );
        if let Some(bar) = &self.bar {
            bar.draw(svg, &frame, self.overhang().1);
        }
        if let Some(legend) = &self.legend {
            self.place_legend(svg, legend, &frame);
        }
    }

    fn grid(&self, svg: &mut Svg, view: &View) {
        let Frame {
            left,
            top,
            right,
            bottom,
        } = view.frame;
        let mut data = String::new();
        if !matches!(self.panel.x.ticks, Ticks::Categories(_)) {
            for x in self.ticks[0].iter().map(|tick| view.axes[0].px(tick.at)) {
                line_data(&[[x, top], [x, bottom]], &mut data);
            }
        }
        if !matches!(self.panel.y.ticks, Ticks::Categories(_)) {
            for y in self.ticks[1].iter().map(|tick| view.axes[1].px(tick.at)) {
                line_data(&[[left, y], [right, y]], &mut data);
            }
        }
        svg.path(
            &data,
            &stroke(&Style {
                width_px: 0.7,
                ..Style::color(Color::MIST)
            }),
        );
    }

    /// The lines of both axes with their ticks.
    fn axis_lines(&self, svg: &mut Svg, view: &View) {
        let Frame {
            left,
            top,
            right,
            bottom,
        } = view.frame;
        let mut data = String::new();
        if self.panel.x.ticks != Ticks::Hidden {
            line_data(&[[left, bottom], [right, bottom]], &mut data);
        }
        if self.panel.y.ticks != Ticks::Hidden {
            line_data(&[[left, top], [left, bottom]], &mut data);
        }
        for (at, length) in self.tick_lengths(0) {
            let x = view.axes[0].px(at);
            line_data(&[[x, bottom], [x, bottom + length]], &mut data);
        }
        for (at, length) in self.tick_lengths(1) {
            let y = view.axes[1].px(at);
            line_data(&[[left - length, y], [left, y]], &mut data);
        }
        svg.path(&data, &axis_stroke());
    }

    /// The ticks of an axis with their lengths, px; categories need none.
    fn tick_lengths(&self, axis: usize) -> Vec<(f64, f64)> {
        let described = [&self.panel.x, &self.panel.y][axis];
        if matches!(described.ticks, Ticks::Categories(_) | Ticks::Hidden) {
            return Vec::new();
        }
        let minor = ticks::minor(described.scale, self.ranges[axis])
            .into_iter()
            .map(|at| (at, 0.55 * TICK_PX));
        self.ticks[axis]
            .iter()
            .map(|tick| (tick.at, TICK_PX))
            .chain(minor)
            .collect()
    }

    fn x_labels(&self, svg: &mut Svg, view: &View) {
        let Frame {
            left, right, bottom, ..
        } = view.frame;
        let top = bottom + tick_gap(&self.panel.x);
        let flat = Type::new(TICK_TEXT_PX, Align::Middle);
        let slanted = Type {
            turn_deg: -SLANT_DEG,
            ..Type::new(TICK_TEXT_PX, Align::End)
        };
        for tick in &self.ticks[0] {
            let x = view.axes[0].px(tick.at);
            if self.slanted {
                svg.text(&tick.lines, [x + GAP_PX, top + 0.6 * TICK_TEXT_PX], slanted);
            } else {
                svg.text(&tick.lines, [x, top + RISE * TICK_TEXT_PX], flat);
            }
        }
        let down = self.tick_rooms[0] + LABEL_GAP_PX + RISE * LABEL_TEXT_PX;
        let label = Type::new(LABEL_TEXT_PX, Align::Middle);
        svg.text(&self.labels[0], [(left + right) / 2.0, bottom + down], label);
    }

    fn y_labels(&self, svg: &mut Svg, view: &View) {
        let Frame {
            left, top, bottom, ..
        } = view.frame;
        let right = left - tick_gap(&self.panel.y);
        for tick in &self.ticks[1] {
            let up = tick.lines.len().saturating_sub(1) as f64 / 2.0 * LINE * TICK_TEXT_PX;
            let baseline = view.axes[1].px(tick.at) + MIDDLE * TICK_TEXT_PX - up;
            svg.text(
                &tick.lines,
                [right, baseline],
                Type::new(TICK_TEXT_PX, Align::End),
            );
        }
        let width = lines_px(&self.labels[1], LABEL_TEXT_PX) - RISE * LABEL_TEXT_PX;
        let out = self.tick_rooms[1] + LABEL_GAP_PX + width;
        svg.text(&self.labels[1], [left - out, (top + bottom) / 2.0], upwards());
    }

    fn place_legend(&self, svg: &mut Svg, legend: &Block<'_>, frame: &Frame) {
        const INSIDE_PX: f64 = 8.0;
        let (left, top) = (frame.left + INSIDE_PX, frame.top + INSIDE_PX);
        let (right, bottom) = (
            frame.right - legend.width - INSIDE_PX,
            frame.bottom - legend.height - INSIDE_PX,
        );
        let margins = self.margins();
        let at = match self.panel.legend {
            Legend::Own(Side::Below) => [frame.left, frame.bottom + margins.bottom - legend.height],
            Legend::Inside(Corner::TopLeft) => [left, top],
            Legend::Inside(Corner::TopRight) => [right, top],
            Legend::Inside(Corner::BottomLeft) => [left, bottom],
            Legend::Inside(Corner::BottomRight) => [right, bottom],
            _ => [frame.right + margins.right - legend.width, frame.top],
        };
        if matches!(self.panel.legend, Legend::Inside(_)) {
            backing(svg, at, legend);
        }
        legend.draw(svg, at);
    }
}

/// Keeps marks from shining through a legend.
fn backing(svg: &mut Svg, at: Px, legend: &Block<'_>) {
    svg.put(format_args!(
        "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" rx=\"3\" {}/>",
        Num(at[0] - 5.0),
        Num(at[1] - 3.0),
        Num(legend.width + 10.0),
        Num(legend.height + 6.0),
        area(Color::WHITE, 0.85)
    ));
}

/// How labels that read upwards are set.
pub(crate) fn upwards() -> Type {
    Type {
        turn_deg: -90.0,
        ..Type::new(LABEL_TEXT_PX, Align::Middle)
    }
}

/// How axes and their ticks are drawn.
pub(crate) fn axis_stroke() -> String {
    stroke(&Style {
        width_px: 1.0,
        ..Style::color(Color::INK)
    })
}
