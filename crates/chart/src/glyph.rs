//! Small signs: markers, caps, arrow heads, boxes.

use std::fmt::Write as _;

use crate::color::Color;
use crate::mark::Direction;
use crate::path::Px;
use crate::style::{Dash, Fill, Marker, Style};
use crate::svg::{Num, Svg, line_data, opacity, stroke};

/// How strongly bands, stripes and faint fills show.
pub(crate) const FAINT: f64 = 0.18;
/// Half the width of the caps of error bars, px.
const CAP_PX: f64 = 3.5;

/// Markers at points of the page, as one path.
pub(crate) fn markers(svg: &mut Svg, points: &[Px], style: &Style) {
    let mut data = String::new();
    if style.marker == Marker::Circle && style.fill == Fill::Solid {
        // A line without length and with round ends is a disc: a fifth of the bytes of one drawn with arcs.
        for [x, y] in points {
            put(&mut data, format_args!("M{} {}h0", Num(*x), Num(*y)));
        }
        let disc = Style {
            width_px: style.size_px,
            dash: Dash::Solid,
            ..*style
        };
        return svg.path(&data, &format!("{} stroke-linecap=\"round\"", stroke(&disc)));
    }
    points
        .iter()
        .for_each(|&point| marker_data(style.marker, point, style.size_px, &mut data));
    let line = stroke(&Style {
        dash: Dash::Solid,
        width_px: style.width_px.min(style.size_px / 4.0),
        ..*style
    });
    let attributes = match inside(style) {
        Some((color, share)) => line.replacen(
            "fill=\"none\"",
            &format!("fill=\"{color}\"{}", opacity("fill-opacity", share)),
            1,
        ),
        None => line,
    };
    svg.path(&data, &attributes);
}

/// Path data of a marker; sizes are such that all seem equally large.
fn marker_data(marker: Marker, [x, y]: Px, size_px: f64, data: &mut String) {
    let r = size_px / 2.0;
    match marker {
        Marker::Circle => {
            let (r, d) = (Num(r), Num(2.0 * r));
            let left = Num(x - size_px / 2.0);
            put(
                data,
                format_args!("M{left} {}a{r} {r} 0 1 0 {d} 0a{r} {r} 0 1 0 -{d} 0Z", Num(y)),
            );
        }
        Marker::Cross => rays(data, [x, y], &[[0.8 * r, 0.8 * r], [0.8 * r, -0.8 * r]]),
        Marker::Plus => rays(data, [x, y], &[[1.05 * r, 0.0], [0.0, 1.05 * r]]),
        Marker::Star => rays(
            data,
            [x, y],
            &[[r, 0.0], [0.0, r], [0.7 * r, 0.7 * r], [0.7 * r, -0.7 * r]],
        ),
        Marker::Square => corners(
            data,
            [x, y],
            0.88 * r,
            &[[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]],
        ),
        Marker::Diamond => corners(
            data,
            [x, y],
            1.2 * r,
            &[[0.0, -1.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]],
        ),
        Marker::Triangle => corners(data, [x, y], 1.2 * r, &[[0.0, -1.0], [0.9, 0.6], [-0.9, 0.6]]),
        Marker::TriangleDown => corners(data, [x, y], 1.2 * r, &[[0.0, 1.0], [0.9, -0.6], [-0.9, -0.6]]),
    }
}

fn rays(data: &mut String, [x, y]: Px, rays: &[[f64; 2]]) {
    for [dx, dy] in rays {
        put(
            data,
            format_args!(
                "M{} {}l{} {}",
                Num(x - dx),
                Num(y - dy),
                Num(2.0 * dx),
                Num(2.0 * dy)
            ),
        );
    }
}

fn corners(data: &mut String, [x, y]: Px, size: f64, corners: &[[f64; 2]]) {
    let around: Vec<Px> = corners
        .iter()
        .map(|[dx, dy]| [x + size * dx, y + size * dy])
        .collect();
    line_data(&around, data);
    data.push('Z');
}

/// Path data of a box between two corners.
pub(crate) fn box_data(from: Px, to: Px, data: &mut String) {
    line_data(&[from, [to[0], from[1]], to, [from[0], to[1]]], data);
    data.push('Z');
}

/// Path data of the cap of an error bar.
pub(crate) fn cap([x, y]: Px, direction: Direction, data: &mut String) {
    match direction {
        Direction::Vertical => line_data(&[[x - CAP_PX, y], [x + CAP_PX, y]], data),
        Direction::Horizontal => line_data(&[[x, y - CAP_PX], [x, y + CAP_PX]], data),
    }
}

/// Adds an arrow's head to the path data; returns where the shaft ends.
pub(crate) fn arrow_head(from: Px, to: Px, width_px: f64, data: &mut String) -> Px {
    let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
    let length = dx.hypot(dy);
    if length == 0.0 {
        return to;
    }
    let head = (5.0 + 2.0 * width_px).min(length);
    let (ux, uy) = (dx / length, dy / length);
    let base = [to[0] - head * ux, to[1] - head * uy];
    let half = 0.42 * head;
    line_data(
        &[
            to,
            [base[0] - half * uy, base[1] + half * ux],
            [base[0] + half * uy, base[1] - half * ux],
        ],
        data,
    );
    data.push('Z');
    base
}

fn put(data: &mut String, text: std::fmt::Arguments<'_>) {
    data.write_fmt(text).expect("writing to a string cannot fail");
}

/// The colour and opacity inside an outline, if there is any.
pub(crate) fn inside(style: &Style) -> Option<(Color, f64)> {
    match style.fill {
        Fill::Open => None,
        Fill::Solid => Some((style.color, style.opacity)),
        Fill::Faint => Some((style.color, FAINT * style.opacity)),
        Fill::With(color) => Some((color, style.opacity)),
    }
}
