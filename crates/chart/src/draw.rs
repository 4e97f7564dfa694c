//! Shapes on the page.

use crate::axis::Mapping;
use crate::color::{Color, ColorMap};
use crate::glyph::{FAINT, arrow_head, box_data, cap, inside, markers};
use crate::mark::{Direction, Ellipse, Grid, Interval, Mark, Note, Shape};
use crate::path::{Frame, Px, thin, tolerance_px};
use crate::style::{Anchor, Dash, Style};
use crate::svg::{Align, Svg, Type, Weight, area, line_data, stroke};
use crate::text;
use crate::ticks::decimal;

/// The number of colours in a coloured line and in a colour bar.
pub(crate) const LEVELS: usize = 64;

/// A resolved colour scale.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Colors {
    pub(crate) map: ColorMap,
    pub(crate) range: [f64; 2],
}

impl Colors {
    fn share(&self, value: f64) -> f64 {
        ((value - self.range[0]) / (self.range[1] - self.range[0])).clamp(0.0, 1.0)
    }

    fn level(&self, value: f64) -> usize {
        ((self.share(value) * LEVELS as f64) as usize).min(LEVELS - 1)
    }

    fn of(&self, value: f64) -> Color {
        self.map.at(self.share(value))
    }

    pub(crate) fn of_level(&self, level: usize) -> Color {
        self.map.at((level as f64 + 0.5) / LEVELS as f64)
    }
}

/// Where a panel's values land on the page.
#[derive(Debug)]
pub(crate) struct View {
    pub(crate) axes: [Mapping; 2],
    pub(crate) frame: Frame,
    /// The size of the page, px.
    pub(crate) page: [f64; 2],
    pub(crate) colors: Option<Colors>,
}

impl View {
    fn px(&self, point: [f64; 2]) -> Px {
        [self.axes[0].px(point[0]), self.axes[1].px(point[1])]
    }

    fn all(&self, points: &[[f64; 2]]) -> impl Iterator<Item = Px> {
        points.iter().map(|&point| self.px(point))
    }

    /// The point with a value along a direction's axis and one across it.
    fn oriented(&self, along: f64, across: f64, direction: Direction) -> Px {
        match direction {
            Direction::Vertical => self.px([across, along]),
            Direction::Horizontal => self.px([along, across]),
        }
    }

    /// Draws a mark, cut to the frame.
    pub(crate) fn draw(&self, svg: &mut Svg, mark: &Mark) {
        let style = &mark.style;
        match &mark.shape {
            Shape::Line(points) => self.line(svg, self.all(points), style),
            Shape::Points(points) => self.points(svg, points, style),
            Shape::Segments(pairs) => self.segments(svg, pairs, style),
            Shape::Arrows(pairs) => self.arrows(svg, pairs, style),
            Shape::Polygon(points) => self.outline(svg, self.all(points).filter(is_finite).collect(), style),
            Shape::Band(intervals) => self.band(svg, intervals, style),
            Shape::ErrorBars { intervals, direction } => self.error_bars(svg, intervals, *direction, style),
            Shape::Bars {
                bars,
                width,
                direction,
            } => self.bars(svg, bars, *width, *direction, style),
            Shape::Ellipses(ellipses) => {
                ellipses
                    .iter()
                    .for_each(|ellipse| self.outline(svg, self.around(ellipse), style));
            }
            Shape::Rules { at, direction } => self.rules(svg, at, *direction, style),
            Shape::Stripes { between, direction } => self.stripes(svg, between, *direction, style),
            Shape::Notes(notes) => notes.iter().for_each(|note| self.note(svg, note, style)),
            Shape::ColoredLine { points, values } => self.colored_line(svg, points, values, style),
            Shape::Cells(grid) => {
                self.cells(svg, grid);
                self.cell_values(svg, grid, style);
            }
        }
    }

    fn line(&self, svg: &mut Svg, points: impl Iterator<Item = Px>, style: &Style) {
        svg.path(&self.line_data(points), &stroke(style));
    }

    fn line_data(&self, points: impl Iterator<Item = Px>) -> String {
        let mut data = String::new();
        for run in self.frame.cut_line(points) {
            line_data(&thin(&run, tolerance_px(run.len())), &mut data);
        }
        data
    }

    fn points(&self, svg: &mut Svg, points: &[[f64; 2]], style: &Style) {
        let mut shown: Vec<Px> = self
            .all(points)
            .filter(|&point| is_finite(&point) && self.frame.holds(point))
            .collect();
        // Markers of one path that lie on each other paint the same pixels: one of them is enough.
        let mut seen = std::collections::BTreeSet::new();
        shown.retain(|point| seen.insert(point.map(|px| (px * 10.0).round() as i64)));
        markers(svg, &shown, style);
    }

    fn segments(&self, svg: &mut Svg, pairs: &[[[f64; 2]; 2]], style: &Style) {
        let mut data = String::new();
        for pair in pairs {
            for run in self.frame.cut_line(self.all(pair)) {
                line_data(&run, &mut data);
            }
        }
        svg.path(&data, &stroke(style));
    }

    fn arrows(&self, svg: &mut Svg, pairs: &[[[f64; 2]; 2]], style: &Style) {
        let (mut shafts, mut heads) = (String::new(), String::new());
        for &[from, to] in pairs {
            let [from, to] = [self.px(from), self.px(to)];
            if is_finite(&from) && is_finite(&to) && self.frame.holds(to) {
                let base = arrow_head(from, to, style.width_px, &mut heads);
                self.frame
                    .cut_line([from, base])
                    .iter()
                    .for_each(|run| line_data(run, &mut shafts));
            }
        }
        svg.path(&shafts, &stroke(style));
        svg.path(&heads, &area(style.color, style.opacity));
    }

    /// A closed outline with its inside.
    fn outline(&self, svg: &mut Svg, points: Vec<Px>, style: &Style) {
        let closed: Vec<Px> = points.iter().chain(points.first()).copied().collect();
        if let Some((color, share)) = inside(style) {
            self.area(svg, points, &area(color, share));
        }
        if style.width_px > 0.0 {
            self.line(svg, closed.into_iter(), style);
        }
    }

    fn area(&self, svg: &mut Svg, points: Vec<Px>, attributes: &str) {
        let kept = self.frame.cut_area(points);
        let kept = thin(&kept, tolerance_px(kept.len()));
        if kept.len() > 2 {
            let mut data = String::new();
            line_data(&kept, &mut data);
            data.push('Z');
            svg.path(&data, attributes);
        }
    }

    fn around(&self, ellipse: &Ellipse) -> Vec<Px> {
        const CORNERS: u32 = 120;
        let (sin, cos) = ellipse.angle_rad.sin_cos();
        let ([x, y], [a, b]) = (ellipse.center, ellipse.semi_axes);
        let corner = |index: u32| {
            let (t_sin, t_cos) = (std::f64::consts::TAU * f64::from(index) / f64::from(CORNERS)).sin_cos();
            self.px([
                x + a * t_cos * cos - b * t_sin * sin,
                y + a * t_cos * sin + b * t_sin * cos,
            ])
        };
        (0..CORNERS).map(corner).filter(is_finite).collect()
    }

    fn band(&self, svg: &mut Svg, intervals: &[Interval], style: &Style) {
        for run in intervals.split(|interval| !interval.is_finite()) {
            let high = run.iter().map(|interval| [interval.at, interval.high]);
            let low = run.iter().rev().map(|interval| [interval.at, interval.low]);
            let around = high.chain(low).map(|point| self.px(point)).collect();
            self.area(svg, around, &area(style.color, FAINT * style.opacity));
        }
    }

    fn error_bars(&self, svg: &mut Svg, intervals: &[Interval], direction: Direction, style: &Style) {
        let mut data = String::new();
        for interval in intervals.iter().filter(|interval| interval.is_finite()) {
            let ends = [interval.low, interval.high].map(|end| self.oriented(end, interval.at, direction));
            for run in self.frame.cut_line(ends) {
                line_data(&run, &mut data);
            }
            ends.into_iter()
                .filter(|&end| self.frame.holds(end))
                .for_each(|end| cap(end, direction, &mut data));
        }
        svg.path(
            &data,
            &stroke(&Style {
                dash: Dash::Solid,
                ..*style
            }),
        );
    }

    fn bars(&self, svg: &mut Svg, bars: &[Interval], width: f64, direction: Direction, style: &Style) {
        let mut data = String::new();
        for bar in bars.iter().filter(|bar| bar.is_finite()) {
            let from = self.oriented(bar.low, bar.at - width / 2.0, direction);
            let to = self.oriented(bar.high, bar.at + width / 2.0, direction);
            box_data(self.frame.clamp(from), self.frame.clamp(to), &mut data);
        }
        svg.path(&data, &area(style.color, style.opacity));
    }

    /// The frame with its two sides across a direction moved to these values.
    fn across(&self, [low, high]: [f64; 2], direction: Direction) -> [Px; 2] {
        let axis = direction.across();
        let mut ends = [
            [self.frame.left, self.frame.top],
            [self.frame.right, self.frame.bottom],
        ];
        ends[0][axis] = self.axes[axis].px(low);
        ends[1][axis] = self.axes[axis].px(high);
        ends
    }

    fn rules(&self, svg: &mut Svg, at: &[f64], direction: Direction, style: &Style) {
        let mut data = String::new();
        for &value in at {
            for run in self.frame.cut_line(self.across([value, value], direction)) {
                line_data(&run, &mut data);
            }
        }
        svg.path(&data, &stroke(style));
    }

    fn stripes(&self, svg: &mut Svg, between: &[[f64; 2]], direction: Direction, style: &Style) {
        let mut data = String::new();
        for &edges in between {
            let [from, to] = self.across(edges, direction);
            if is_finite(&from) && is_finite(&to) {
                box_data(self.frame.clamp(from), self.frame.clamp(to), &mut data);
            }
        }
        svg.path(&data, &area(style.color, FAINT * style.opacity));
    }

    /// Words beside their point, moved where they would leave the page.
    fn note(&self, svg: &mut Svg, note: &Note, style: &Style) {
        const GAP_PX: f64 = 6.0;
        let [x, y] = self.px(note.at);
        if !self.frame.holds([x, y]) {
            return;
        }
        let (size_px, width) = (style.text_px, text::width_px(&note.text, style.text_px));
        let (left, middle) = match note.anchor {
            Anchor::Center => (x - width / 2.0, y),
            Anchor::Left => (x - width - GAP_PX, y),
            Anchor::Right => (x + GAP_PX, y),
            Anchor::Above => (x - width / 2.0, y - GAP_PX - size_px / 2.0),
            Anchor::Below => (x - width / 2.0, y + GAP_PX + size_px / 2.0),
        };
        let moved = left.min(self.page[0] - width - 4.0).max(4.0) - left;
        let (start, align) = match note.anchor {
            Anchor::Right => (left, Align::Start),
            Anchor::Left => (left + width, Align::End),
            _ => (left + width / 2.0, Align::Middle),
        };
        let set = Type {
            color: style.color,
            weight: Weight::Haloed,
            ..Type::new(size_px, align)
        };
        svg.text(
            std::slice::from_ref(&note.text),
            [start + moved, middle + 0.36 * size_px],
            set,
        );
    }

    fn colored_line(&self, svg: &mut Svg, points: &[[f64; 2]], values: &[f64], style: &Style) {
        let Some(colors) = self.colors else { return };
        let level = |index: usize| {
            let value = (values[index] + values[index + 1]) / 2.0;
            value.is_finite().then(|| colors.level(value))
        };
        let mut first = 0;
        while first + 1 < points.len() {
            let mut last = first + 1;
            while last + 1 < points.len() && level(last) == level(first) {
                last += 1;
            }
            if let Some(level) = level(first) {
                let data = self.line_data(self.all(&points[first..=last]));
                let colored = Style {
                    color: colors.of_level(level),
                    dash: Dash::Solid,
                    ..*style
                };
                svg.path(&data, &format!("{} stroke-linecap=\"round\"", stroke(&colored)));
            }
            first = last;
        }
    }

    fn cells(&self, svg: &mut Svg, grid: &Grid) {
        let Some(colors) = self.colors else { return };
        svg.put(format_args!("<g shape-rendering=\"crispEdges\">"));
        for (value, [from, to]) in self.cell_boxes(grid) {
            let mut data = String::new();
            box_data(self.frame.clamp(from), self.frame.clamp(to), &mut data);
            svg.path(&data, &area(colors.of(value), 1.0));
        }
        svg.put(format_args!("</g>"));
    }

    /// The values of a grid in their cells.
    fn cell_values(&self, svg: &mut Svg, grid: &Grid, style: &Style) {
        let (Some(colors), Some(decimals)) = (self.colors, grid.decimals) else {
            return;
        };
        for (value, [from, to]) in self.cell_boxes(grid) {
            let middle = [(from[0] + to[0]) / 2.0, (from[1] + to[1]) / 2.0];
            if self.frame.holds(middle) {
                let dark = colors.of(value).is_dark();
                let color = if dark { Color::WHITE } else { Color::INK };
                let set = Type {
                    color,
                    ..Type::new(style.text_px, Align::Middle)
                };
                svg.text(
                    &[decimal(value, decimals)],
                    [middle[0], middle[1] + 0.36 * style.text_px],
                    set,
                );
            }
        }
    }

    /// The finite values of a grid with two opposite corners of their cells.
    fn cell_boxes<'g>(&'g self, grid: &'g Grid) -> impl Iterator<Item = (f64, [Px; 2])> + 'g {
        let columns = grid.x_edges.len().saturating_sub(1).max(1);
        let cells = grid
            .values
            .iter()
            .enumerate()
            .filter(|(_, value)| value.is_finite());
        let cells = cells.map(move |(index, &value)| {
            let (row, column) = (index / columns, index % columns);
            (
                value,
                [0, 1].map(|step| self.px([grid.x_edges[column + step], grid.y_edges[row + step]])),
            )
        });
        cells.filter(|(_, corners)| corners.iter().all(is_finite))
    }
}

fn is_finite(point: &Px) -> bool {
    point[0].is_finite() && point[1].is_finite()
}
