//! How much room a panel needs.

use crate::axis::{Axis, Mapping, Scale, Ticks, crowded};
use crate::bar::Bar;
use crate::draw::Colors;
use crate::figure::{Aspect, Legend, Panel, Side};
use crate::legend::Block;
use crate::path::Px;
use crate::text::{self, LINE};
use crate::ticks::{Step, Tick};

/// Sizes of letters, px.
pub(crate) const TICK_TEXT_PX: f64 = 11.0;
pub(crate) const LABEL_TEXT_PX: f64 = 12.5;
pub(crate) const TITLE_TEXT_PX: f64 = 13.0;
/// How much wider bold letters are.
const BOLD: f64 = 1.08;
/// Length of a tick, and the gap between it and its label, px.
pub(crate) const TICK_PX: f64 = 5.0;
pub(crate) const GAP_PX: f64 = 4.0;
/// Gap between tick labels and the axis's label, px.
pub(crate) const LABEL_GAP_PX: f64 = 7.0;
/// Distance of a legend from its panel, px.
pub(crate) const LEGEND_GAP_PX: f64 = 16.0;
/// How slanted labels of categories are, degrees.
pub(crate) const SLANT_DEG: f64 = 35.0;
/// The widest label of a category on a y axis, px.
const CATEGORY_PX: f64 = 170.0;
/// Gap between the frame and a label where there is no tick, px.
const BARE_GAP_PX: f64 = 6.0;
/// The shortest stretch between round ticks along x, along y, and on maps, px.
const PART_PX: [f64; 2] = [62.0, 36.0];
const MAP_PART_PX: f64 = 48.0;

/// A panel with all that is known before it has a place.
#[derive(Debug)]
pub(crate) struct Plan<'a> {
    pub(crate) panel: &'a Panel,
    pub(crate) ranges: [[f64; 2]; 2],
    pub(crate) colors: Option<Colors>,
    /// The room between the axes, px.
    pub(crate) size: [f64; 2],
    pub(crate) ticks: [Vec<Tick>; 2],
    /// Whether the labels of x and y are shown: not if a neighbour shows the same.
    pub(crate) labelled: [bool; 2],
    /// Whether labels of x are too long to lie flat.
    pub(crate) slanted: bool,
    pub(crate) title: Vec<String>,
    pub(crate) labels: [Vec<String>; 2],
    /// The room from the frame to the far end of the tick labels of x (downwards) and y (to the left), px.
    pub(crate) tick_rooms: [f64; 2],
    pub(crate) bar: Option<Bar>,
    pub(crate) legend: Option<Block<'a>>,
}

/// The room around a panel, px.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Margins {
    pub(crate) left: f64,
    pub(crate) top: f64,
    pub(crate) right: f64,
    pub(crate) bottom: f64,
}

impl<'a> Plan<'a> {
    pub(crate) fn new(
        panel: &'a Panel,
        ranges: [[f64; 2]; 2],
        colors: Option<Colors>,
        labelled: [bool; 2],
    ) -> Self {
        let size = size(panel, ranges);
        let (x_ticks, slanted) = x_ticks(panel, ranges[0], size[0]);
        let y_ticks = y_ticks(panel, ranges[1], size[1], &x_ticks);
        let legend = match panel.legend {
            Legend::Own(Side::Below) => Block::rows(panel.marks.iter(), size[0]),
            Legend::Own(Side::Right) | Legend::Inside(_) => Block::column(panel.marks.iter()),
            Legend::Shared | Legend::Hidden => None,
        };
        Self {
            tick_rooms: [
                x_tick_room(panel, &x_ticks, slanted),
                y_tick_room(panel, &y_ticks),
            ],
            ticks: [x_ticks, y_ticks],
            title: text::wrap(&panel.title, TITLE_TEXT_PX * BOLD, size[0]),
            labels: [
                text::wrap(&panel.x.label, LABEL_TEXT_PX, size[0]),
                text::wrap(&panel.y.label, LABEL_TEXT_PX, size[1]),
            ],
            bar: Bar::new(panel, colors, size[1]),
            panel,
            ranges,
            colors,
            size,
            labelled,
            slanted,
            legend,
        }
    }

    pub(crate) fn margins(&self) -> Margins {
        let (left_end, right_end) = self.overhang();
        let beside = match (self.panel.legend, &self.legend) {
            (Legend::Own(Side::Right), Some(block)) => LEGEND_GAP_PX + block.width,
            _ => 0.0,
        };
        let below = match (self.panel.legend, &self.legend) {
            (Legend::Own(Side::Below), Some(block)) => LEGEND_GAP_PX / 2.0 + block.height,
            _ => 0.0,
        };
        Margins {
            left: self.axis_room(1).max(left_end),
            top: if self.title.is_empty() {
                7.0
            } else {
                lines_px(&self.title, TITLE_TEXT_PX) + 8.0
            },
            right: right_end + self.bar.as_ref().map_or(0.0, Bar::width) + beside,
            bottom: self.axis_room(0) + below,
        }
    }

    /// The room outside the frame for the ticks and labels of an axis, px.
    fn axis_room(&self, axis: usize) -> f64 {
        match (self.labelled[axis], self.labels[axis].is_empty()) {
            (false, _) => TICK_PX + 2.0,
            (true, true) => self.tick_rooms[axis],
            (true, false) => {
                self.tick_rooms[axis] + LABEL_GAP_PX + lines_px(&self.labels[axis], LABEL_TEXT_PX)
            }
        }
    }

    /// How far labels of x reach beyond the left and the right end of the axis, px.
    pub(crate) fn overhang(&self) -> (f64, f64) {
        let mapping = self.mappings([0.0, 0.0])[0];
        let (mut left, mut right) = (0.0_f64, 6.0_f64);
        for tick in self.ticks[0].iter().filter(|_| self.labelled[0]) {
            let (px, width) = (mapping.px(tick.at), text::widest_px(&tick.lines, TICK_TEXT_PX));
            if self.slanted {
                left = left.max(width * SLANT_DEG.to_radians().cos() + TICK_TEXT_PX - px);
            } else {
                left = left.max(width / 2.0 - px);
                right = right.max(px + width / 2.0 - self.size[0]);
            }
        }
        (left, right)
    }

    /// Where values land when the frame's corner is at a place.
    pub(crate) fn mappings(&self, [left, top]: Px) -> [Mapping; 2] {
        let [width, height] = self.size;
        let vertical = match self.panel.y.ticks {
            Ticks::Categories(_) => [top, top + height],
            _ => [top + height, top],
        };
        [
            Mapping::new(self.panel.x.scale, self.ranges[0], [left, left + width]),
            Mapping::new(self.panel.y.scale, self.ranges[1], vertical),
        ]
    }
}

/// The distance of labels from the frame, px.
pub(crate) fn tick_gap(axis: &Axis) -> f64 {
    match axis.ticks {
        Ticks::Categories(_) | Ticks::Hidden => BARE_GAP_PX,
        Ticks::Auto | Ticks::At(_) => TICK_PX + GAP_PX,
    }
}

fn x_tick_room(panel: &Panel, ticks: &[Tick], slanted: bool) -> f64 {
    let tallest = ticks
        .iter()
        .map(|tick| lines_px(&tick.lines, TICK_TEXT_PX))
        .fold(0.0, f64::max);
    let widest = ticks
        .iter()
        .map(|tick| text::widest_px(&tick.lines, TICK_TEXT_PX))
        .fold(0.0, f64::max);
    match (ticks.is_empty(), slanted) {
        (true, _) => 2.0,
        (false, false) => tick_gap(&panel.x) + tallest,
        (false, true) => tick_gap(&panel.x) + widest * SLANT_DEG.to_radians().sin() + TICK_TEXT_PX,
    }
}

fn y_tick_room(panel: &Panel, ticks: &[Tick]) -> f64 {
    let widest = ticks
        .iter()
        .map(|tick| text::widest_px(&tick.lines, TICK_TEXT_PX))
        .fold(0.0, f64::max);
    if ticks.is_empty() {
        2.0
    } else {
        tick_gap(&panel.y) + widest
    }
}

/// The height of lines of text, px.
pub(crate) fn lines_px(lines: &[String], size_px: f64) -> f64 {
    match lines.len() {
        0 => 0.0,
        count => size_px * (1.0 + (count - 1) as f64 * LINE),
    }
}

/// The room between the axes: as the panel says, cut to the shape of the ranges where units are equal.
fn size(panel: &Panel, ranges: [[f64; 2]; 2]) -> [f64; 2] {
    let [width, height] = panel.size_px;
    match panel.aspect {
        Aspect::Free => [width, height],
        Aspect::Equal => {
            let [dx, dy] = ranges.map(|[low, high]| high - low);
            let px_per_unit = (width / dx).min(height / dy);
            [dx * px_per_unit, dy * px_per_unit].map(|px| px.max(1.0))
        }
    }
}

/// Into how many parts round ticks divide an axis of this length at most.
fn parts(panel: &Panel, length_px: f64, axis: usize) -> f64 {
    match panel.aspect {
        Aspect::Free => (length_px / PART_PX[axis]).clamp(2.0, 8.0),
        Aspect::Equal => (length_px / MAP_PART_PX).clamp(1.0, 10.0),
    }
}

/// The ticks of the x axis, and whether their labels have to be slanted.
fn x_ticks(panel: &Panel, range: [f64; 2], width: f64) -> (Vec<Tick>, bool) {
    let mapping = Mapping::new(panel.x.scale, range, [0.0, width]);
    let clash = |ticks: &[Tick]| crowded(ticks, &mapping, TICK_TEXT_PX);
    let mut ticks = panel.x.labelled(range, parts(panel, width, 0), clash);
    if !matches!(panel.x.ticks, Ticks::Categories(_)) {
        return (ticks, false);
    }
    let room = mapping.px(1.0) - mapping.px(0.0) - BARE_GAP_PX;
    let wrapped: Vec<_> = ticks
        .iter()
        .map(|tick| text::wrap(&tick.lines[0], TICK_TEXT_PX, room))
        .collect();
    let slanted = wrapped
        .iter()
        .any(|lines| text::widest_px(lines, TICK_TEXT_PX) > room || lines.len() > 3);
    if !slanted {
        ticks
            .iter_mut()
            .zip(wrapped)
            .for_each(|(tick, lines)| tick.lines = lines);
    }
    (ticks, slanted)
}

/// The ticks of the y axis; on a map with the step of the x axis.
fn y_ticks(panel: &Panel, range: [f64; 2], height: f64, x_ticks: &[Tick]) -> Vec<Tick> {
    let parts = parts(panel, height, 1);
    if let ([first, second, ..], Aspect::Equal, Ticks::Auto, Ticks::Auto) =
        (x_ticks, panel.aspect, &panel.x.ticks, &panel.y.ticks)
    {
        let step = Step::for_span(second.at - first.at, 1.0);
        // A map that is one px wide would have any number of them.
        if range[1] - range[0] <= 2.0 * parts * step.value() {
            return step.ticks(range);
        }
    }
    let mut ticks = panel.y.labelled(range, parts, |_| false);
    if matches!(panel.y.ticks, Ticks::Categories(_)) {
        for tick in &mut ticks {
            tick.lines = text::wrap(&tick.lines[0], TICK_TEXT_PX, CATEGORY_PX);
        }
    }
    ticks
}

/// The ticks of a linear stretch of this height that nothing else depends on.
pub(crate) fn free_ticks(range: [f64; 2], height: f64) -> Vec<Tick> {
    let axis = Axis {
        scale: Scale::Linear,
        ..Axis::default()
    };
    axis.labelled(range, (height / PART_PX[1]).clamp(2.0, 8.0), |_| false)
}
