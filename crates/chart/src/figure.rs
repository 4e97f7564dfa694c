//! Figures and panels.

use crate::axis::{Axis, Scale};
use crate::color::{ColorMap, ColorScale};
use crate::draw::Colors;
use crate::error::{AxisName, Error};
use crate::layout;
use crate::mark::{Mark, Reach};

/// Panels in a grid, with what they share.
///
/// ```
/// use chart::{Error, Figure, Mark, Panel, Shape, Share, Style};
///
/// let panel = |scale: f64| Panel {
///     marks: vec![Mark::new("", Style::series(0), Shape::Line(vec![[0.0, 0.0], [1.0, scale]]))],
///     ..Panel::default()
/// };
/// let panels = vec![panel(1.0), panel(2.0)];
/// let figure = Figure { title: "Two scales".into(), panels, columns: 2, share: Share::Y, ..Figure::default() };
/// assert_eq!(figure.to_svg()?.matches("<path").count(), 2 * 3); // grid, line and axes of each
/// # Ok::<(), Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// What the picture is called by readers that do not see it; not drawn. Must not be empty.
    pub title: String,
    /// What there is to see, for the same readers; not drawn.
    pub description: String,
    /// The panels, row after row.
    pub panels: Vec<Panel>,
    /// The number of panels in a row.
    pub columns: usize,
    /// Which axes have one range for all panels; their labels stand only at the grid's left and lower edge.
    pub share: Share,
    /// Where the entries of the panels with [`Legend::Shared`] stand.
    pub legend: Side,
}

impl Default for Figure {
    fn default() -> Self {
        Self {
            title: String::new(),
            description: String::new(),
            panels: Vec::new(),
            columns: 1,
            share: Share::None,
            legend: Side::Right,
        }
    }
}

/// Two axes and the marks between them.
#[derive(Debug, Clone, PartialEq)]
pub struct Panel {
    /// What stands above it.
    pub title: String,
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// What it shows; later marks cover earlier ones.
    pub marks: Vec<Mark>,
    /// How the two axes' units compare on the page.
    pub aspect: Aspect,
    /// Where the names of its marks stand.
    pub legend: Legend,
    /// The colours of marks that are coloured by value, shown as a bar at the right.
    pub colors: Option<ColorScale>,
    /// The room between the axes, px; with equal aspect the most that is taken of it.
    pub size_px: [f64; 2],
}

impl Default for Panel {
    fn default() -> Self {
        Self {
            title: String::new(),
            x: Axis::default(),
            y: Axis::default(),
            marks: Vec::new(),
            aspect: Aspect::Free,
            legend: Legend::Shared,
            colors: None,
            size_px: [440.0, 300.0],
        }
    }
}

/// How the units of x and y compare on the page.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Aspect {
    /// Each axis fills its side.
    #[default]
    Free,
    /// A unit of x is as long as a unit of y, as on a map.
    Equal,
}

/// Where a panel's legend stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Legend {
    /// In the figure's legend, one for all panels.
    #[default]
    Shared,
    /// Beside or below the panel.
    Own(Side),
    /// Inside the panel, over its marks.
    Inside(Corner),
    /// Nowhere.
    Hidden,
}

/// A side of a panel or figure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Side {
    /// At the right.
    #[default]
    Right,
    /// Below.
    Below,
}

/// A corner of a panel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Corner {
    /// Upper left.
    TopLeft,
    /// Upper right.
    TopRight,
    /// Lower left.
    BottomLeft,
    /// Lower right.
    BottomRight,
}

/// Which axes have one range for all panels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Share {
    /// Neither.
    #[default]
    None,
    /// The horizontal ones: for panels above each other.
    X,
    /// The vertical ones: for panels beside each other.
    Y,
    /// Both.
    Both,
}

impl Share {
    /// Whether x and whether y is shared.
    pub(crate) fn axes(self) -> [bool; 2] {
        [
            matches!(self, Self::X | Self::Both),
            matches!(self, Self::Y | Self::Both),
        ]
    }
}

impl Figure {
    /// The figure as the text of an SVG file.
    ///
    /// # Errors
    ///
    /// If there is no title or no panel, an axis has nothing to show or no valid range, a logarithmic axis meets a value
    /// that is not positive, or values to be coloured lack a scale or a point.
    pub fn to_svg(&self) -> Result<String, Error> {
        self.check()?;
        let ranges = self.ranges()?;
        let colors = self
            .panels
            .iter()
            .enumerate()
            .map(|(index, panel)| panel.resolve_colors(index + 1));
        Ok(layout::draw(
            self,
            &ranges,
            &colors.collect::<Result<Vec<_>, _>>()?,
        ))
    }

    fn check(&self) -> Result<(), Error> {
        if self.title.trim().is_empty() {
            return Err(Error::NoTitle);
        }
        let figure = self.title.clone();
        if self.panels.is_empty() {
            return Err(Error::NoPanels { figure });
        }
        if self.columns == 0 {
            return Err(Error::NotDrawable {
                figure,
                what: "the number of columns",
            });
        }
        if self
            .panels
            .iter()
            .flat_map(|panel| panel.size_px)
            .any(|px| !px.is_finite() || px < 1.0)
        {
            return Err(Error::NotDrawable {
                figure,
                what: "the size of every panel",
            });
        }
        self.panels
            .iter()
            .enumerate()
            .try_for_each(|(index, panel)| panel.check(index + 1))
    }

    /// The ranges of x and y of each panel.
    fn ranges(&self) -> Result<Vec<[[f64; 2]; 2]>, Error> {
        let [xs, ys] = [(0, AxisName::X), (1, AxisName::Y)].map(|(axis, name)| self.axis_ranges(axis, name));
        Ok(xs?.into_iter().zip(ys?).map(|(x, y)| [x, y]).collect())
    }

    /// The ranges of one axis of each panel; where it is shared, the first one given or that of all values.
    fn axis_ranges(&self, axis: usize, name: AxisName) -> Result<Vec<[f64; 2]>, Error> {
        let own: Vec<Reach> = self.panels.iter().map(|panel| panel.reaches()[axis]).collect();
        let shared = self.share.axes()[axis].then(|| {
            let mut all = Reach::NONE;
            own.iter().for_each(|reach| all.join(reach));
            (self.panels.iter().find_map(|panel| panel.axes()[axis].range), all)
        });
        let ranges = self
            .panels
            .iter()
            .zip(own)
            .enumerate()
            .map(|(index, (panel, own))| {
                let described = panel.axes()[axis];
                let (given, reach) = shared.unwrap_or((described.range, own));
                described.resolve(given, &reach, index + 1, name)
            });
        ranges.collect()
    }
}

impl Panel {
    fn check(&self, panel: usize) -> Result<(), Error> {
        let linear = self.x.scale == Scale::Linear && self.y.scale == Scale::Linear;
        if self.aspect == Aspect::Equal && !linear {
            return Err(Error::NotLinear { panel });
        }
        for (index, mark) in self.marks.iter().enumerate() {
            let (found, expected) = (mark.shape.color_values().len(), mark.shape.color_value_count());
            if found != expected {
                return Err(Error::Lengths {
                    panel,
                    mark: index + 1,
                    found,
                    expected,
                });
            }
            if found > 0 && self.colors.is_none() {
                return Err(Error::NoColorScale { panel });
            }
        }
        Ok(())
    }

    fn axes(&self) -> [&Axis; 2] {
        [&self.x, &self.y]
    }

    fn reaches(&self) -> [Reach; 2] {
        let mut reaches = [Reach::NONE; 2];
        for mark in &self.marks {
            let [x, y] = mark.shape.reaches();
            reaches[0].join(&x);
            reaches[1].join(&y);
        }
        reaches
    }

    /// The colour scale with its range: as given, or that of the values, for signed colours the same on both sides of 0.
    fn resolve_colors(&self, panel: usize) -> Result<Option<Colors>, Error> {
        let Some(ColorScale { map, range, .. }) = self.colors else {
            return Ok(None);
        };
        let mut reach = Reach::NONE;
        self.marks
            .iter()
            .flat_map(|mark| mark.shape.color_values())
            .for_each(|&value| reach.add(value));
        let axis = AxisName::Color;
        let [low, high] = match (range, map) {
            (Some(range), _) => range,
            (None, _) if reach.is_empty() => return Err(Error::NoValues { panel, axis }),
            (None, ColorMap::Diverging) => {
                let most = reach.high.abs().max(reach.low.abs()).max(f64::MIN_POSITIVE);
                [-most, most]
            }
            (None, ColorMap::Sequential) if reach.low == reach.high => [reach.low - 0.5, reach.high + 0.5],
            (None, ColorMap::Sequential) => [reach.low, reach.high],
        };
        if low.is_finite() && high.is_finite() && low < high {
            Ok(Some(Colors {
                map,
                range: [low, high],
            }))
        } else {
            Err(Error::BadRange {
                panel,
                axis,
                low,
                high,
            })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::Color;
    use crate::mark::{Direction, Ellipse, Grid, Interval, Note, Shape};
    use crate::style::{Anchor, Fill, Style};
    use proptest::prelude::*;

    fn figure(panels: Vec<Panel>) -> Figure {
        Figure {
            title: "test".into(),
            columns: 2,
            panels,
            ..Figure::default()
        }
    }

    fn panel(shapes: impl IntoIterator<Item = Shape>) -> Panel {
        let colors = Some(ColorScale::default());
        let mark = |(index, shape)| Mark::new(format!("mark {index}"), Style::series(index), shape);
        Panel {
            marks: shapes.into_iter().enumerate().map(mark).collect(),
            colors,
            ..Panel::default()
        }
    }

    /// One shape of each kind through these points.
    fn shapes(points: &[[f64; 2]]) -> Vec<Shape> {
        let pairs: Vec<[[f64; 2]; 2]> = points.windows(2).map(|pair| [pair[0], pair[1]]).collect();
        let intervals: Vec<Interval> = points
            .iter()
            .map(|&[at, high]| Interval {
                at,
                low: 0.5 * high,
                high,
            })
            .collect();
        let direction = Direction::Horizontal;
        let note = |&at: &[f64; 2]| Note {
            at,
            text: "a <b> & c".into(),
            anchor: Anchor::Above,
        };
        let ellipse = |&center: &[f64; 2]| Ellipse {
            center,
            semi_axes: [2.0, 1.0],
            angle_rad: 0.5,
        };
        let edges: Vec<f64> = (0..=points.len()).map(|edge| edge as f64 + 1.0).collect();
        vec![
            Shape::Line(points.to_vec()),
            Shape::Points(points.to_vec()),
            Shape::Segments(pairs.clone()),
            Shape::Arrows(pairs),
            Shape::Polygon(points.to_vec()),
            Shape::Band(intervals.clone()),
            Shape::ErrorBars {
                intervals: intervals.clone(),
                direction,
            },
            Shape::Bars {
                bars: intervals,
                width: 0.5,
                direction: Direction::Vertical,
            },
            Shape::Ellipses(points.iter().map(ellipse).collect()),
            Shape::Rules {
                at: points.iter().map(|point| point[0]).collect(),
                direction,
            },
            Shape::Stripes {
                between: points.to_vec(),
                direction,
            },
            Shape::Notes(points.iter().map(note).collect()),
            Shape::ColoredLine {
                points: points.to_vec(),
                values: points.iter().map(|point| point[1]).collect(),
            },
            Shape::Cells(Grid {
                y_edges: vec![1.0, 2.0],
                values: points.iter().map(|point| point[1]).collect(),
                x_edges: edges,
                decimals: Some(1),
            }),
        ]
    }

    /// Whether tags are balanced, attributes quoted and all markup is known.
    fn check_xml(svg: &str) -> Result<(), String> {
        let mut open = Vec::new();
        for piece in svg.split('<').skip(1) {
            let (tag, text) = piece.split_once('>').ok_or("a tag does not end")?;
            if !tag.matches('"').count().is_multiple_of(2) {
                return Err(format!("quotes in <{tag}>"));
            }
            for entity in text.split('&').skip(1) {
                let known = ["amp;", "lt;", "gt;", "quot;"]
                    .iter()
                    .any(|name| entity.starts_with(name));
                known.then_some(()).ok_or(format!("entity in {text}"))?;
            }
            let name = tag.split([' ', '/']).next().unwrap_or_default();
            match tag.strip_prefix('/') {
                Some(closed) if open.pop() == Some(closed) => {}
                Some(closed) => return Err(format!("</{closed}> closes nothing")),
                None if tag.ends_with('/') => {}
                None => open.push(name),
            }
        }
        open.is_empty()
            .then_some(())
            .ok_or(format!("not closed: {open:?}"))
    }

    fn attribute(element: &str, name: &str) -> Option<String> {
        let (_, rest) = element.split_once(&format!(" {name}=\""))?;
        rest.split_once('"').map(|(value, _)| value.to_owned())
    }

    /// The absolute coordinates of paths, and the points of texts.
    fn coordinates(svg: &str) -> Vec<[f64; 2]> {
        let mut found = Vec::new();
        for element in svg.split('<') {
            for run in attribute(element, "d").unwrap_or_default().split(['M', 'L']) {
                let run = run
                    .split(|letter: char| letter.is_ascii_alphabetic())
                    .next()
                    .unwrap_or_default();
                let numbers: Vec<f64> = run
                    .split_whitespace()
                    .map(|number| number.parse().unwrap())
                    .collect();
                found.extend(numbers.chunks_exact(2).map(|pair| [pair[0], pair[1]]));
            }
            if let Some(x) = attribute(element, "x").filter(|_| element.starts_with("text")) {
                found.push([x, attribute(element, "y").unwrap()].map(|number| number.parse().unwrap()));
            }
        }
        found
    }

    fn page(svg: &str) -> [f64; 2] {
        ["width", "height"].map(|name| attribute(svg, name).unwrap().parse().unwrap())
    }

    const POINTS: [[f64; 2]; 4] = [[1.0, 2.0], [2.0, 5.0], [4.0, 3.0], [8.0, 9.0]];

    #[test]
    fn every_shape_is_drawn_inside_the_page() {
        for range in [None, Some([2.0, 4.0])] {
            let x = Axis {
                range,
                ..Axis::linear("x <&> \"y\"")
            };
            let panels = shapes(&POINTS).into_iter().map(|shape| Panel {
                x: x.clone(),
                ..panel([shape])
            });
            let colors = |panel: Panel| {
                let colored = panel
                    .marks
                    .iter()
                    .any(|mark| !mark.shape.color_values().is_empty());
                let colors = colored.then(ColorScale::default);
                let y = Axis {
                    range: Some([0.0, 10.0]),
                    ..Axis::linear("y")
                };
                Panel {
                    colors,
                    y,
                    x: Axis {
                        range: panel.x.range.or(Some([0.0, 9.0])),
                        ..panel.x
                    },
                    ..panel
                }
            };
            let svg = figure(panels.map(colors).collect()).to_svg().unwrap();
            check_xml(&svg).unwrap();
            let [width, height] = page(&svg);
            let found = coordinates(&svg);
            assert!(found.len() > 200, "{} coordinates", found.len());
            for [x, y] in found {
                assert!(
                    (0.0..=width).contains(&x) && (0.0..=height).contains(&y),
                    "({x}, {y}) of {width} x {height}"
                );
            }
        }
    }

    #[test]
    fn the_same_figure_gives_the_same_bytes() {
        let figure = figure(vec![panel(shapes(&POINTS)), panel(shapes(&POINTS))]);
        assert_eq!(figure.to_svg().unwrap(), figure.clone().to_svg().unwrap());
    }

    #[test]
    fn text_is_escaped_everywhere() {
        let title = "a < b & \"c\"".to_owned();
        let line = Mark::new(title.clone(), Style::default(), Shape::Line(POINTS.to_vec()));
        let panels = vec![Panel {
            title: title.clone(),
            marks: vec![line],
            ..Panel::default()
        }];
        let svg = Figure {
            description: title.clone(),
            title,
            panels,
            ..Figure::default()
        }
        .to_svg()
        .unwrap();
        check_xml(&svg).unwrap();
        assert_eq!(svg.matches("a &lt; b &amp; &quot;c&quot;").count(), 4);
        assert!(svg.contains("<title>") && svg.contains("<desc>"));
    }

    #[test]
    fn ends_of_the_range_lie_on_the_frame() {
        let [x, y] = ["x", "y"].map(|label| Axis {
            range: Some([0.0, 1.0]),
            ..Axis::linear(label)
        });
        let ends = Mark::new(
            "",
            Style::color(Color::GREEN),
            Shape::Line(vec![[0.0, 0.0], [1.0, 1.0]]),
        );
        let svg = figure(vec![Panel {
            x,
            y,
            marks: vec![ends],
            size_px: [200.0, 100.0],
            ..Panel::default()
        }]);
        let svg = svg.to_svg().unwrap();
        let line = svg
            .lines()
            .find(|line| line.contains(&Color::GREEN.to_string()))
            .unwrap();
        let [[left, bottom], [right, top]] = coordinates(line).try_into().unwrap();
        assert_eq!([right - left, bottom - top], [200.0, 100.0], "{line}");
    }

    #[test]
    fn maps_have_one_scale() {
        let square = Shape::Polygon(vec![[0.0, 0.0], [0.5, 0.0], [0.5, 0.5], [0.0, 0.5]]);
        let square = Mark::new("", Style::color(Color::GREEN), square);
        let [x, y] = [[0.0, 1.4], [0.0, 1.2]].map(|range| Axis {
            range: Some(range),
            ..Axis::default()
        });
        let map = Panel {
            x,
            y,
            marks: vec![square],
            aspect: Aspect::Equal,
            ..Panel::default()
        };
        let svg = figure(vec![map]).to_svg().unwrap();
        let line = svg
            .lines()
            .find(|line| line.contains(&Color::GREEN.to_string()))
            .unwrap();
        let corners = coordinates(line);
        let (width, height) = (corners[1][0] - corners[0][0], corners[1][1] - corners[2][1]);
        assert!(
            (width - height).abs() < 0.02 && width > 100.0,
            "{width} x {height}"
        );
    }

    #[test]
    fn what_cannot_be_drawn_is_refused() {
        let good = panel([Shape::Line(POINTS.to_vec())]);
        let error = |figure: Figure| figure.to_svg().unwrap_err();
        assert_eq!(error(Figure::default()), Error::NoTitle);
        assert_eq!(error(figure(vec![])).to_string(), "figure `test` has no panels");
        let none = Figure {
            columns: 0,
            ..figure(vec![good.clone()])
        };
        assert_eq!(
            error(none).to_string(),
            "figure `test`: the number of columns must be positive"
        );
        let log = Panel {
            y: Axis::log("y"),
            ..panel([Shape::Points(vec![[1.0, 1.0], [2.0, 0.0]])])
        };
        let log = Panel { colors: None, ..log };
        let expected = Error::NotPositive {
            panel: 1,
            axis: AxisName::Y,
            value: 0.0,
        };
        assert_eq!(error(figure(vec![log])), expected);
        let map = Panel {
            x: Axis::log("x"),
            aspect: Aspect::Equal,
            ..good.clone()
        };
        assert_eq!(error(figure(vec![map])), Error::NotLinear { panel: 1 });
        let colored = Shape::ColoredLine {
            points: POINTS.to_vec(),
            values: vec![1.0; 3],
        };
        let expected = Error::Lengths {
            panel: 1,
            mark: 1,
            found: 3,
            expected: 4,
        };
        assert_eq!(error(figure(vec![panel([colored])])), expected);
        let colored = Shape::ColoredLine {
            points: POINTS.to_vec(),
            values: vec![1.0; 4],
        };
        let bare = Panel {
            colors: None,
            ..panel([colored])
        };
        assert_eq!(error(figure(vec![bare])), Error::NoColorScale { panel: 1 });
        let empty = Panel {
            colors: None,
            ..panel([Shape::Line(vec![[f64::NAN, 1.0]])])
        };
        assert_eq!(
            error(figure(vec![empty])),
            Error::NoValues {
                panel: 1,
                axis: AxisName::X
            }
        );
    }

    #[test]
    fn shared_axes_have_one_range_and_labels_at_the_edge() {
        let [near, far] = [1.0, 7.0].map(|scale| Panel {
            x: Axis::linear("the x axis"),
            y: Axis::linear("the y axis"),
            colors: None,
            ..panel([Shape::Line(POINTS.map(|[x, y]| [x, scale * y]).to_vec())])
        });
        let shared = Figure {
            share: Share::Y,
            ..figure(vec![near, far])
        };
        let ranges = shared.ranges().unwrap();
        assert_eq!(ranges[0][1], ranges[1][1]);
        let svg = shared.to_svg().unwrap();
        assert_eq!(svg.matches("the x axis").count(), 2);
        assert_eq!(svg.matches("the y axis").count(), 1);
    }

    #[test]
    fn marks_of_one_label_share_an_entry() {
        let line = |fill| {
            Mark::new(
                "shared name",
                Style {
                    fill,
                    ..Style::default()
                },
                Shape::Line(POINTS.to_vec()),
            )
        };
        let marks = vec![line(Fill::Open), line(Fill::Solid)];
        let svg = figure(vec![Panel {
            marks,
            ..Panel::default()
        }])
        .to_svg()
        .unwrap();
        assert_eq!(svg.matches("shared name").count(), 1);
    }

    #[test]
    fn large_sets_stay_compact() {
        let many = (0..100_000)
            .map(f64::from)
            .map(|i| [i, (i * 1e-3).sin() + 0.3 * (i * 12.9898).sin()]);
        let many: Vec<[f64; 2]> = many.collect();
        for shape in [Shape::Line(many.clone()), Shape::Points(many)] {
            let fill = Fill::Solid;
            let mark = Mark::new(
                "",
                Style {
                    fill,
                    ..Style::default()
                },
                shape,
            );
            let svg = figure(vec![Panel {
                marks: vec![mark],
                ..Panel::default()
            }])
            .to_svg()
            .unwrap();
            assert!(svg.len() < 2_000_000, "{} bytes", svg.len());
        }
    }

    fn coordinate() -> impl Strategy<Value = f64> {
        prop_oneof![8 => -1e3..1e3_f64, 1 => Just(f64::NAN), 1 => Just(f64::INFINITY), 1 => -1e300..1e300_f64]
    }

    proptest! {
        #[test]
        fn any_points_give_xml_without_strange_numbers(
            points in proptest::collection::vec([coordinate(), coordinate()], 1..12),
            equal in proptest::bool::ANY,
        ) {
            let aspect = if equal { Aspect::Equal } else { Aspect::Free };
            let drawn = figure(vec![Panel { aspect, ..panel(shapes(&points)) }]).to_svg();
            if let Ok(svg) = drawn {
                prop_assert_eq!(check_xml(&svg), Ok(()));
                prop_assert!(!svg.contains("NaN") && !svg.contains("\"inf") && !svg.contains(" inf"));
                let [width, height] = page(&svg);
                for [x, y] in coordinates(&svg) {
                    prop_assert!((-20.0..=width + 20.0).contains(&x) && (-20.0..=height + 20.0).contains(&y));
                }
            }
        }
    }
}
