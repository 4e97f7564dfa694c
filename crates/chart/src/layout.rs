//! Where everything stands: room for labels first, then places.

use crate::draw::Colors;
use crate::figure::{Figure, Legend, Side};
use crate::legend::Block;
use crate::path::Px;
use crate::plan::{LEGEND_GAP_PX, Plan};
use crate::svg::Svg;

/// Edge of the page, and the gap between panels, px.
const EDGE_PX: f64 = 10.0;
const BETWEEN_PX: f64 = 16.0;
/// How much farther than its own ticks ask a label moves out to line up with the others of its column, px.
const LINE_UP_PX: f64 = 40.0;

/// The figure on its page.
pub(crate) fn draw(figure: &Figure, ranges: &[[[f64; 2]; 2]], colors: &[Option<Colors>]) -> String {
    let mut plans: Vec<Plan<'_>> = figure
        .panels
        .iter()
        .enumerate()
        .map(|(index, panel)| Plan::new(panel, ranges[index], colors[index], labelled(figure, index)))
        .collect();
    line_up(&mut plans, figure.columns);
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
    [!(x && below), !y || index.is_multiple_of(figure.columns)]
}

/// Puts the y labels of a column at one distance, unless that would move one far out.
fn line_up(plans: &mut [Plan<'_>], columns: usize) {
    for column in 0..columns {
        let members = plans.iter().skip(column).step_by(columns);
        let most = members.map(|plan| plan.tick_rooms[1]).fold(0.0, f64::max);
        for plan in plans.iter_mut().skip(column).step_by(columns) {
            if most - plan.tick_rooms[1] <= LINE_UP_PX {
                plan.tick_rooms[1] = most;
            }
        }
    }
}

/// The upper left corner of each panel's frame, and the size of the whole grid from the page's corner.
fn places(plans: &[Plan<'_>], columns: usize) -> (Vec<Px>, [f64; 2]) {
    let across = plans
        .iter()
        .map(|plan| [plan.margins().left, plan.size[0] + plan.margins().right]);
    let down = plans
        .iter()
        .map(|plan| [plan.margins().top, plan.size[1] + plan.margins().bottom]);
    let (lefts, width) = tracks(across.enumerate().map(|(place, room)| (place % columns, room)));
    let (tops, height) = tracks(down.enumerate().map(|(place, room)| (place / columns, room)));
    let corners = (0..plans.len()).map(|place| [lefts[place % columns], tops[place / columns]]);
    (corners.collect(), [width, height])
}

/// Where the frames of each row or column begin and where the last one ends, from the room each panel of it needs
/// before and after that.
fn tracks(panels: impl Iterator<Item = (usize, [f64; 2])>) -> (Vec<f64>, f64) {
    let mut rooms: Vec<[f64; 2]> = Vec::new();
    for (track, [before, after]) in panels {
        if track == rooms.len() {
            rooms.push([0.0; 2]);
        }
        rooms[track] = [rooms[track][0].max(before), rooms[track][1].max(after)];
    }
    let mut end = EDGE_PX - BETWEEN_PX;
    let begins = rooms.iter().map(|[before, after]| {
        let begin = end + BETWEEN_PX + before;
        end = begin + after;
        begin
    });
    (begins.collect(), end)
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
            let at = [left + ((width - left - block.width) / 2.0).max(0.0), height + 9.0];
            ([width.max(at[0] + block.width), at[1] + block.height], at)
        }
    };
    (size.map(|px| px + EDGE_PX), at)
}
