//! Figures and panels.

use crate::axis::{Axis, Scale};
use crate::color::{ColorMap, ColorScale};
use crate::draw::Colors;
use crate::error::{AxisName, Error};
use crate::layout;
use crate::mark::{Mark, Reach};

/// Panels in a grid, with what they share.
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
        let mut reaches: Vec<[Reach; 2]> = self.panels.iter().map(Panel::reaches).collect();
        for axis in (0..2).filter(|&axis| self.share.axes()[axis]) {
            let mut all = Reach::NONE;
            reaches.iter().for_each(|reach| all.join(&reach[axis]));
            reaches.iter_mut().for_each(|reach| reach[axis] = all);
        }
        let resolved =
            self.panels
                .iter()
                .zip(&reaches)
                .enumerate()
                .map(|(index, (panel, reach))| {
                    Ok([
                        panel.x.resolve(&reach[0], index + 1, AxisName::X)?,
                        panel.y.resolve(&reach[1], index + 1, AxisName::Y)?,
                    ])
                });
        resolved.collect()
    }
}

impl Panel {
    fn check(&self, panel: usize) -> Result<(), Error> {
        let linear = self.x.scale == Scale::Linear && self.y.scale == Scale::Linear;
        if self.aspect == Aspect::Equal && !linear {
            return Err(Error::NotLinear { panel });
        }
        for (index, mark) in self.marks.iter().enumerate() {
            let (found, expected) = (
                mark.shape.color_values().len(),
                mark.shape.color_value_count(),
            );
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
            (None, ColorMap::Sequential) if reach.low == reach.high => {
                [reach.low - 0.5, reach.high + 0.5]
            }
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
