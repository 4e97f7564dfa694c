//! The bar that tells what colours mean.

use crate::axes::{MIDDLE, RISE, axis_stroke, upwards};
use crate::axis::{Mapping, Scale};
use crate::draw::{Colors, LEVELS};
use crate::figure::Panel;
use crate::path::Frame;
use crate::plan::{GAP_PX, LABEL_GAP_PX, LABEL_TEXT_PX, TICK_PX, TICK_TEXT_PX, free_ticks, lines_px};
use crate::svg::{Align, Num, Svg, Type, area, line_data};
use crate::text;
use crate::ticks::Tick;

/// Width of the bar and its distance from the panel, px.
const BAR_PX: f64 = 12.0;
const BAR_GAP_PX: f64 = 14.0;

/// A colour bar, as high as its panel.
#[derive(Debug)]
pub(crate) struct Bar {
    colors: Colors,
    ticks: Vec<Tick>,
    label: Vec<String>,
}

impl Bar {
    /// The bar of a panel of this height, if it has a colour scale.
    pub(crate) fn new(panel: &Panel, colors: Option<Colors>, height: f64) -> Option<Self> {
        let (scale, colors) = panel.colors.as_ref().zip(colors)?;
        Some(Self {
            colors,
            ticks: free_ticks(colors.range, height),
            label: text::wrap(&scale.label, LABEL_TEXT_PX, height),
        })
    }

    fn tick_room(&self) -> f64 {
        let widest = self
            .ticks
            .iter()
            .map(|tick| text::widest_px(&tick.lines, TICK_TEXT_PX));
        TICK_PX + GAP_PX + widest.fold(0.0, f64::max)
    }

    /// The room that the bar takes, px.
    pub(crate) fn width(&self) -> f64 {
        let label = if self.label.is_empty() {
            0.0
        } else {
            LABEL_GAP_PX + lines_px(&self.label, LABEL_TEXT_PX)
        };
        BAR_GAP_PX + BAR_PX + self.tick_room() + label
    }

    /// Draws the bar this far right of the frame.
    pub(crate) fn draw(&self, svg: &mut Svg, frame: &Frame, away_px: f64) {
        let left = frame.right + away_px + BAR_GAP_PX;
        self.strips(svg, left, frame);
        let mapping = Mapping::new(Scale::Linear, self.colors.range, [frame.bottom, frame.top]);
        let right = left + BAR_PX;
        let mut data = String::new();
        for tick in &self.ticks {
            let y = mapping.px(tick.at);
            line_data(&[[right, y], [right + TICK_PX, y]], &mut data);
            let at = [right + TICK_PX + GAP_PX, y + MIDDLE * TICK_TEXT_PX];
            svg.text(&tick.lines, at, Type::new(TICK_TEXT_PX, Align::Start));
        }
        svg.path(&data, &axis_stroke());
        let out = self.tick_room() + LABEL_GAP_PX + RISE * LABEL_TEXT_PX;
        svg.text(
            &self.label,
            [right + out, (frame.top + frame.bottom) / 2.0],
            upwards(),
        );
    }

    fn strips(&self, svg: &mut Svg, left: f64, frame: &Frame) {
        let step = frame.height() / LEVELS as f64;
        for level in 0..LEVELS {
            let top = frame.bottom - (level + 1) as f64 * step;
            // Each strip reaches under the one below it: no seams.
            let height = step + if level == 0 { 0.0 } else { 0.6 };
            svg.put(format_args!(
                "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" {}/>",
                Num(left),
                Num(top),
                Num(BAR_PX),
                Num(height),
                area(self.colors.of_level(level), 1.0)
            ));
        }
    }
}
