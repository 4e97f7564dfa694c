//! Where everything stands: room for labels first, then places.

use crate::axis::{Mapping, Scale, Ticks, crowded};
use crate::color::Color;
use crate::draw::{Colors, LEVELS, View};
use crate::figure::{Aspect, Corner, Figure, Legend, Panel, Side};
use crate::legend::Block;
use crate::path::{Frame, Px};
use crate::style::Style;
use crate::svg::{Align, Num, Svg, Type, Weight, area, line_data, stroke};
use crate::text::{self, LINE};
use crate::ticks::{self, Tick};

/// Sizes of letters, px.
const TICK_TEXT_PX: f64 = 11.0;
const LABEL_TEXT_PX: f64 = 12.5;
const TITLE_TEXT_PX: f64 = 13.0;
/// Length of a tick, and the gap between it and its label, px.
const TICK_PX: f64 = 5.0;
const GAP_PX: f64 = 4.0;
/// Gap between tick labels and the axis's label, px.
const LABEL_GAP_PX: f64 = 7.0;
/// Edge of the page, and the gap between panels, px.
const EDGE_PX: f64 = 10.0;
const BETWEEN_PX: f64 = 16.0;
/// Width of a colour bar and its distance from the panel, px.
const BAR_PX: f64 = 12.0;
const BAR_GAP_PX: f64 = 14.0;
/// Distance of a legend from its panel, px.
const LEGEND_GAP_PX: f64 = 16.0;
/// How slanted labels of categories are, degrees.
const SLANT_DEG: f64 = 35.0;
/// The widest label of a category on a y axis, px.
const CATEGORY_PX: f64 = 170.0;

/// A panel with all that is known before it has a place.
#[derive(Debug)]
struct Plan<'a> {
    panel: &'a Panel,
    ranges: [[f64; 2]; 2],
    colors: Option<Colors>,
    /// The room between the axes, px.
    size: [f64; 2],
    ticks: [Vec<Tick>; 2],
    /// Whether the labels of x and y are shown: not if a neighbour shows the same.
    labelled: [bool; 2],
    /// Whether labels of x are too long to lie flat.
    slanted: bool,
    title: Vec<String>,
    labels: [Vec<String>; 2],
    bar: Option<Bar>,
    legend: Option<Block<'a>>,
    margins: Margins,
}

/// Ticks and label of a colour bar.
#[derive(Debug)]
struct Bar {
    colors: Colors,
    ticks: Vec<Tick>,
    label: Vec<String>,
}

/// The room around a panel, px.
#[derive(Debug, Clone, Copy, Default)]
struct Margins {
    left: f64,
    top: f64,
    right: f64,
    bottom: f64,
}

/// The figure on its page.
pub(crate) fn draw(figure: &Figure, ranges: &[[[f64; 2]; 2]], colors: &[Option<Colors>]) -> String {
    let plans: Vec<Plan<'_>> = figure
        .panels
        .iter()
        .enumerate()
        .map(|(index, panel)| {
            Plan::new(panel, ranges[index], colors[index], labelled(figure, index))
        })
        .collect();
    let (places, grid) = places(&plans, figure.columns);
    let legend = shared_legend(figure, grid[0]);
    let (page, legend_at) = page(grid, &places, legend.as_ref(), figure.legend);
    let mut svg = Svg::new(page, &figure.title, &figure.description);
    for (plan, &place) in plans.iter().zip(&places) {
        plan.draw(&mut svg, place, page);
    }
    if let Some(legend) = legend {
        legend.draw(&mut svg, legend_at);
    }
    svg.finish()
}

/// Whether a panel shows the labels of its x and y axis: of shared axes only the lowest and leftmost do.
fn labelled(figure: &Figure, index: usize) -> [bool; 2] {
    let [x, y] = figure.share.axes();
    let below = index + figure.columns < figure.panels.len();
    [!(x && below), !(y && index % figure.columns > 0)]
}

/// The upper left corner of each panel's frame, and the size of the whole grid from the page's corner.
fn places(plans: &[Plan<'_>], columns: usize) -> (Vec<Px>, [f64; 2]) {
    let rows = plans.len().div_ceil(columns);
    let most = |index: &dyn Fn(usize) -> usize, group: usize, room: &dyn Fn(&Plan<'_>) -> f64| {
        let members = plans
            .iter()
            .enumerate()
            .filter(|(place, _)| index(*place) == group);
        members.map(|(_, plan)| room(plan)).fold(0.0, f64::max)
    };
    let (column_of, row_of) = (
        move |place: usize| place % columns,
        move |place: usize| place / columns,
    );
    let mut lefts = Vec::new();
    let mut x = EDGE_PX;
    for column in 0..columns.min(plans.len()) {
        lefts.push(x + most(&column_of, column, &|plan| plan.margins.left));
        x = lefts[column]
            + most(&column_of, column, &|plan| {
                plan.size[0] + plan.margins.right
            })
            + BETWEEN_PX;
    }
    let mut tops = Vec::new();
    let mut y = EDGE_PX;
    for row in 0..rows {
        tops.push(y + most(&row_of, row, &|plan| plan.margins.top));
        y = tops[row] + most(&row_of, row, &|plan| plan.size[1] + plan.margins.bottom) + BETWEEN_PX;
    }
    let corners = (0..plans.len())
        .map(|place| [lefts[place % columns], tops[place / columns]])
        .collect();
    (corners, [x - BETWEEN_PX, y - BETWEEN_PX])
}

/// The legend of all panels that share one.
fn shared_legend(figure: &Figure, width: f64) -> Option<Block<'_>> {
    let panels = figure
        .panels
        .iter()
        .filter(|panel| panel.legend == Legend::Shared);
    let marks = panels.flat_map(|panel| &panel.marks);
    match figure.legend {
        Side::Right => Block::column(marks),
        Side::Below => Block::rows(marks, width - 2.0 * EDGE_PX),
    }
}

/// The size of the page, and the corner of the shared legend on it.
fn page(grid: [f64; 2], places: &[Px], legend: Option<&Block<'_>>, side: Side) -> ([f64; 2], Px) {
    let [width, height] = grid;
    let (size, at) = match (legend, side) {
        (None, _) => (grid, [0.0, 0.0]),
        (Some(block), Side::Right) => {
            let at = [width + LEGEND_GAP_PX - 4.0, places[0][1]];
            ([at[0] + block.width, height.max(at[1] + block.height)], at)
        }
        (Some(block), Side::Below) => {
            let from = places[0][0];
            let left = from.min((width - block.width).max(EDGE_PX));
            let at = [
                left + ((width - left - block.width) / 2.0).max(0.0),
                height + 6.0,
            ];
            ([width.max(at[0] + block.width), at[1] + block.height], at)
        }
    };
    (size.map(|px| px + EDGE_PX), at)
}

impl<'a> Plan<'a> {
    fn new(
        panel: &'a Panel,
        ranges: [[f64; 2]; 2],
        colors: Option<Colors>,
        labelled: [bool; 2],
    ) -> Self {
        let size = size(panel, ranges);
        let (x_ticks, slanted) = x_ticks(panel, ranges[0], size[0]);
        let legend = match panel.legend {
            Legend::Own(Side::Below) => Block::rows(panel.marks.iter(), size[0]),
            Legend::Own(Side::Right) | Legend::Inside(_) => Block::column(panel.marks.iter()),
            Legend::Shared | Legend::Hidden => None,
        };
        let mut plan = Self {
            panel,
            ranges,
            colors,
            size,
            ticks: [x_ticks, y_ticks(panel, ranges[1], size[1])],
            labelled,
            slanted,
            title: text::wrap(&panel.title, TITLE_TEXT_PX * 1.08, size[0]),
            labels: [
                text::wrap(&panel.x.label, LABEL_TEXT_PX, size[0]),
                text::wrap(&panel.y.label, LABEL_TEXT_PX, size[1]),
            ],
            bar: bar(panel, colors, size[1]),
            legend,
            margins: Margins::default(),
        };
        plan.margins = plan.measured();
        plan
    }

    fn measured(&self) -> Margins {
        let (slant_left, x_end) = self.overhang();
        let top = if self.title.is_empty() {
            7.0
        } else {
            lines_px(&self.title, TITLE_TEXT_PX) + 6.0
        };
        let right = x_end + self.bar.as_ref().map_or(0.0, Bar::width);
        let legend = match (self.panel.legend, &self.legend) {
            (Legend::Own(Side::Right), Some(block)) => [LEGEND_GAP_PX + block.width, 0.0],
            (Legend::Own(Side::Below), Some(block)) => [0.0, 8.0 + block.height],
            _ => [0.0, 0.0],
        };
        Margins {
            left: self.y_room().max(slant_left),
            top,
            right: right + legend[0],
            bottom: self.x_room() + legend[1],
        }
    }

    /// How far labels of x reach beyond the left and the right end of the axis, px.
    fn overhang(&self) -> (f64, f64) {
        let mapping = self.mappings([0.0, 0.0])[0];
        let (mut left, mut right) = (0.0_f64, 6.0_f64);
        for tick in self.ticks[0].iter().filter(|_| self.labelled[0]) {
            let width = text::widest_px(&tick.lines, TICK_TEXT_PX);
            let px = mapping.px(tick.at);
            if self.slanted {
                left = left.max(width * SLANT_DEG.to_radians().cos() - px);
            } else {
                left = left.max(width / 2.0 - px);
                right = right.max(px + width / 2.0 - self.size[0]);
            }
        }
        (left, right)
    }

    /// The height of what stands below the frame, px.
    fn x_room(&self) -> f64 {
        let ticks = &self.ticks[0];
        if !self.labelled[0] {
            return TICK_PX + 2.0;
        }
        let labels = &self.labels[0];
        let label = if labels.is_empty() {
            0.0
        } else {
            LABEL_GAP_PX + lines_px(labels, LABEL_TEXT_PX)
        };
        self.x_tick_room(ticks) + label
    }

    fn x_tick_room(&self, ticks: &[Tick]) -> f64 {
        let height = ticks
            .iter()
            .map(|tick| lines_px(&tick.lines, TICK_TEXT_PX))
            .fold(0.0, f64::max);
        match (ticks.is_empty(), self.slanted) {
            (true, _) => 2.0,
            (false, false) => TICK_PX + GAP_PX + height,
            (false, true) => {
                let widest = ticks
                    .iter()
                    .map(|tick| text::widest_px(&tick.lines, TICK_TEXT_PX))
                    .fold(0.0, f64::max);
                TICK_PX + GAP_PX + widest * SLANT_DEG.to_radians().sin() + TICK_TEXT_PX
            }
        }
    }

    /// The width of what stands left of the frame, px.
    fn y_room(&self) -> f64 {
        if !self.labelled[1] {
            return TICK_PX + 2.0;
        }
        let label = if self.labels[1].is_empty() {
            0.0
        } else {
            LABEL_GAP_PX + lines_px(&self.labels[1], LABEL_TEXT_PX)
        };
        self.y_tick_room() + label
    }

    fn y_tick_room(&self) -> f64 {
        if self.ticks[1].is_empty() {
            return 2.0;
        }
        let widest = self.ticks[1]
            .iter()
            .map(|tick| text::widest_px(&tick.lines, TICK_TEXT_PX));
        TICK_PX + GAP_PX + widest.fold(0.0, f64::max)
    }

    /// Where values land when the frame's corner is at a place.
    fn mappings(&self, [left, top]: Px) -> [Mapping; 2] {
        let [width, height] = self.size;
        let up = [top + height, top];
        let down = [top, top + height];
        let vertical = if matches!(self.panel.y.ticks, Ticks::Categories(_)) {
            down
        } else {
            up
        };
        [
            Mapping::new(self.panel.x.scale, self.ranges[0], [left, left + width]),
            Mapping::new(self.panel.y.scale, self.ranges[1], vertical),
        ]
    }

    fn draw(&self, svg: &mut Svg, [left, top]: Px, page: [f64; 2]) {
        let frame = Frame {
            left,
            top,
            right: left + self.size[0],
            bottom: top + self.size[1],
        };
        let view = View {
            axes: self.mappings([left, top]),
            frame,
            page,
            colors: self.colors,
        };
        self.grid(svg, &view);
        self.panel
            .marks
            .iter()
            .for_each(|mark| view.draw(svg, mark));
        self.x_axis(svg, &view);
        self.y_axis(svg, &view);
        let title = Type {
            weight: Weight::Bold,
            ..Type::new(TITLE_TEXT_PX, Align::Start)
        };
        svg.text(
            &self.title,
            [left, top - self.margins.top + TITLE_TEXT_PX],
            title,
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

    fn x_axis(&self, svg: &mut Svg, view: &View) {
        let Frame {
            left,
            right,
            bottom,
            ..
        } = view.frame;
        let mut data = String::new();
        if self.panel.x.ticks != Ticks::Hidden {
            line_data(&[[left, bottom], [right, bottom]], &mut data);
        }
        for (at, length) in self.tick_lengths(0) {
            let x = view.axes[0].px(at);
            line_data(&[[x, bottom], [x, bottom + length]], &mut data);
        }
        svg.path(&data, &axis_stroke());
        if !self.labelled[0] {
            return;
        }
        let align = if self.slanted {
            Align::End
        } else {
            Align::Middle
        };
        let turn_deg = if self.slanted { -SLANT_DEG } else { 0.0 };
        for tick in &self.ticks[0] {
            let nudge = if self.slanted { 3.0 } else { 0.0 };
            let at = [
                view.axes[0].px(tick.at) + nudge,
                bottom + TICK_PX + GAP_PX + 0.8 * TICK_TEXT_PX,
            ];
            svg.text(
                &tick.lines,
                at,
                Type {
                    turn_deg,
                    ..Type::new(TICK_TEXT_PX, align)
                },
            );
        }
        let down = self.x_tick_room(&self.ticks[0]) + LABEL_GAP_PX + 0.8 * LABEL_TEXT_PX;
        svg.text(
            &self.labels[0],
            [(left + right) / 2.0, bottom + down],
            Type::new(LABEL_TEXT_PX, Align::Middle),
        );
    }

    fn y_axis(&self, svg: &mut Svg, view: &View) {
        let Frame {
            left, top, bottom, ..
        } = view.frame;
        let mut data = String::new();
        if self.panel.y.ticks != Ticks::Hidden {
            line_data(&[[left, top], [left, bottom]], &mut data);
        }
        for (at, length) in self.tick_lengths(1) {
            let y = view.axes[1].px(at);
            line_data(&[[left - length, y], [left, y]], &mut data);
        }
        svg.path(&data, &axis_stroke());
        if !self.labelled[1] {
            return;
        }
        for tick in &self.ticks[1] {
            let up = (tick.lines.len() - 1) as f64 / 2.0 * LINE * TICK_TEXT_PX;
            let at = [
                left - TICK_PX - GAP_PX,
                view.axes[1].px(tick.at) + 0.36 * TICK_TEXT_PX - up,
            ];
            svg.text(&tick.lines, at, Type::new(TICK_TEXT_PX, Align::End));
        }
        let out = self.y_tick_room() + LABEL_GAP_PX + lines_px(&self.labels[1], LABEL_TEXT_PX)
            - 0.8 * LABEL_TEXT_PX;
        let set = Type {
            turn_deg: -90.0,
            ..Type::new(LABEL_TEXT_PX, Align::Middle)
        };
        svg.text(&self.labels[1], [left - out, (top + bottom) / 2.0], set);
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

    fn place_legend(&self, svg: &mut Svg, legend: &Block<'_>, frame: &Frame) {
        const INSIDE_PX: f64 = 8.0;
        let (right, bottom) = (
            frame.right - legend.width - INSIDE_PX,
            frame.bottom - legend.height - INSIDE_PX,
        );
        let (left, top) = (frame.left + INSIDE_PX, frame.top + INSIDE_PX);
        let at = match self.panel.legend {
            Legend::Own(Side::Below) => [
                frame.left,
                frame.bottom + self.margins.bottom - legend.height,
            ],
            Legend::Inside(Corner::TopLeft) => [left, top],
            Legend::Inside(Corner::TopRight) => [right, top],
            Legend::Inside(Corner::BottomLeft) => [left, bottom],
            Legend::Inside(Corner::BottomRight) => [right, bottom],
            _ => [frame.right + self.margins.right - legend.width, frame.top],
        };
        if matches!(self.panel.legend, Legend::Inside(_)) {
            svg.put(format_args!(
                "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" rx=\"3\" {}/>",
                Num(at[0] - 5.0),
                Num(at[1] - 3.0),
                Num(legend.width + 10.0),
                Num(legend.height + 6.0),
                area(Color::WHITE, 0.85)
            ));
        }
        legend.draw(svg, at);
    }
}

fn axis_stroke() -> String {
    stroke(&Style {
        width_px: 1.0,
        ..Style::color(Color::INK)
    })
}

fn lines_px(lines: &[String], size_px: f64) -> f64 {
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

/// Into how many parts round ticks divide an axis of this length at most; on a map alike in both directions.
fn parts(panel: &Panel, length_px: f64, px_per_part: f64) -> f64 {
    match panel.aspect {
        Aspect::Free => (length_px / px_per_part).clamp(2.0, 9.0),
        Aspect::Equal => (length_px / 52.0).max(1.0),
    }
}

/// The ticks of the x axis, and whether their labels have to be slanted.
fn x_ticks(panel: &Panel, range: [f64; 2], width: f64) -> (Vec<Tick>, bool) {
    let mapping = Mapping::new(panel.x.scale, range, [0.0, width]);
    let clash = |ticks: &[Tick]| crowded(ticks, &mapping, TICK_TEXT_PX);
    let mut ticks = panel.x.labelled(range, parts(panel, width, 62.0), clash);
    if !matches!(panel.x.ticks, Ticks::Categories(_)) || ticks.is_empty() {
        return (ticks, false);
    }
    let room = (mapping.px(1.0) - mapping.px(0.0)).abs() - 8.0;
    let wrapped: Vec<Vec<String>> = ticks
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

fn y_ticks(panel: &Panel, range: [f64; 2], height: f64) -> Vec<Tick> {
    let mut ticks = panel
        .y
        .labelled(range, parts(panel, height, 42.0), |_| false);
    if matches!(panel.y.ticks, Ticks::Categories(_)) {
        for tick in &mut ticks {
            tick.lines = text::wrap(&tick.lines[0], TICK_TEXT_PX, CATEGORY_PX);
        }
    }
    ticks.retain(|tick| !tick.lines.is_empty());
    ticks
}

fn bar(panel: &Panel, colors: Option<Colors>, height: f64) -> Option<Bar> {
    let (scale, colors) = panel.colors.as_ref().zip(colors)?;
    Some(Bar {
        colors,
        ticks: ticks::linear(colors.range, (height / 42.0).clamp(2.0, 8.0))
            .next()
            .unwrap_or_default(),
        label: text::wrap(&scale.label, LABEL_TEXT_PX, height),
    })
}

impl Bar {
    fn tick_room(&self) -> f64 {
        let widest = self
            .ticks
            .iter()
            .map(|tick| text::widest_px(&tick.lines, TICK_TEXT_PX));
        TICK_PX + GAP_PX + widest.fold(0.0, f64::max)
    }

    fn width(&self) -> f64 {
        let label = if self.label.is_empty() {
            0.0
        } else {
            LABEL_GAP_PX + lines_px(&self.label, LABEL_TEXT_PX)
        };
        BAR_GAP_PX + BAR_PX + self.tick_room() + label
    }

    /// Draws the bar this far right of the frame.
    fn draw(&self, svg: &mut Svg, frame: &Frame, away_px: f64) {
        let left = frame.right + away_px + BAR_GAP_PX;
        let step = frame.height() / LEVELS as f64;
        for level in 0..LEVELS {
            let top = frame.bottom - (level + 1) as f64 * step;
            // Each strip reaches under the next: no seams.
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
        let mapping = Mapping::new(Scale::Linear, self.colors.range, [frame.bottom, frame.top]);
        let right = left + BAR_PX;
        let mut data = String::new();
        for tick in &self.ticks {
            let y = mapping.px(tick.at);
            line_data(&[[right, y], [right + TICK_PX, y]], &mut data);
            let at = [right + TICK_PX + GAP_PX, y + 0.36 * TICK_TEXT_PX];
            svg.text(&tick.lines, at, Type::new(TICK_TEXT_PX, Align::Start));
        }
        svg.path(&data, &axis_stroke());
        let at = [
            right + self.tick_room() + LABEL_GAP_PX + 0.8 * LABEL_TEXT_PX,
            (frame.top + frame.bottom) / 2.0,
        ];
        svg.text(
            &self.label,
            at,
            Type {
                turn_deg: -90.0,
                ..Type::new(LABEL_TEXT_PX, Align::Middle)
            },
        );
    }
}
