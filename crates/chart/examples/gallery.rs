//! Writes one picture of each kind that the crate draws into a folder: `cargo run --example gallery -- FOLDER`.

use std::f64::consts::TAU;
use std::path::PathBuf;

use chart::{
    Anchor, Aspect, Axis, Color, ColorMap, ColorScale, Corner, Dash, Direction, Ellipse, Figure, Fill, GAP,
    Grid, Interval, Legend, Mark, Marker, Note, Panel, Shape, Share, Side, Style, Ticks,
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).ok_or("name a folder to write into")?);
    std::fs::create_dir_all(&folder)?;
    let figures = [
        ("01-map", map()),
        ("02-two-maps", two_maps()),
        ("03-clusters", clusters()),
        ("04-response", response()),
        ("05-stacked", stacked()),
        ("06-scaling", scaling()),
        ("07-distances", distances()),
        ("08-ranking", ranking()),
        ("09-residual", residual()),
        ("10-sweep", sweep()),
        ("11-gates", gates()),
        ("12-shared", shared()),
    ];
    for (name, figure) in figures {
        std::fs::write(folder.join(name).with_extension("svg"), figure.to_svg()?)?;
    }
    Ok(())
}

/// A number between -1 and 1 that depends on a counter only.
fn noise(counter: usize) -> f64 {
    let x = (counter as f64 * 12.9898 + 4.1414).sin() * 43_758.545_3;
    2.0 * (x - x.floor()) - 1.0
}

/// A bell-shaped number of about unit spread.
fn bell(counter: usize) -> f64 {
    (0..6).map(|term| noise(6 * counter + term)).sum::<f64>() / 2.0_f64.sqrt()
}

/// A closed curve around the arena's middle, between the inner wall (0) and the outer wall (1).
fn circuit(share: f64, turn: f64) -> [f64; 2] {
    let angle = -TAU * turn;
    let dent =
        0.10 * (-(angle.sin() + 1.0) * 9.0 * (angle.cos() - 0.15).powi(2)).exp() * (1.0 - angle.sin()) / 2.0;
    let radius = 0.36 + 0.19 * share - dent + 0.035 * (4.0 * angle).cos();
    [
        0.7 + 1.12 * radius * angle.cos(),
        0.6 + 0.84 * radius * angle.sin(),
    ]
}

fn around(share: impl Fn(f64) -> f64, points: usize) -> Vec<[f64; 2]> {
    let turn = |index: usize| index as f64 / points as f64;
    (0..=points)
        .map(|index| circuit(share(turn(index)), turn(index)))
        .collect()
}

fn walls() -> Mark {
    let mut both = around(|_| 0.0, 600);
    both.push(GAP);
    both.extend(around(|_| 1.0, 600));
    Mark::new(
        "walls",
        Style {
            width_px: 2.0,
            ..Style::default()
        },
        Shape::Line(both),
    )
}

fn lap(series: usize, label: &str, dash: Dash) -> Mark {
    let wave = 3.0 + series as f64;
    let path = around(
        |turn| {
            0.5 + 0.05 * series as f64 + 0.12 * (TAU * wave * turn).sin() + 0.03 * (TAU * 31.0 * turn).sin()
        },
        2000,
    );
    Mark::new(
        label,
        Style {
            dash,
            ..Style::series(series)
        },
        Shape::Line(path),
    )
}

fn arena(title: &str, marks: Vec<Mark>) -> Panel {
    Panel {
        title: title.into(),
        x: Axis {
            range: Some([0.0, 1.4]),
            ..Axis::linear("x, m")
        },
        y: Axis {
            range: Some([0.0, 1.2]),
            ..Axis::linear("y, m")
        },
        marks,
        aspect: Aspect::Equal,
        ..Panel::default()
    }
}

fn map() -> Figure {
    let joints =
        (0..4).flat_map(|joint| [0.0, 1.0].map(|share| circuit(share, f64::from(joint) / 4.0 + 0.04)));
    let gate = |index: usize| [0.0, 1.0].map(|share| circuit(share, index as f64 / 100.0));
    let gates = Style {
        width_px: 0.8,
        ..Style::color(Color::GREY)
    };
    let squares = Style {
        marker: Marker::Square,
        fill: Fill::Solid,
        ..Style::default()
    };
    let start = Style {
        width_px: 2.0,
        ..Style::color(Color::VERMILLION)
    };
    let crosses = Style {
        marker: Marker::Cross,
        size_px: 5.0,
        width_px: 1.1,
        ..Style::color(Color::BLUE)
    };
    let sampled = (0..100)
        .map(|index| index as f64 / 100.0)
        .map(|turn| circuit(0.5 + 0.15 * (TAU * 3.0 * turn).sin(), turn));
    let lap = around(|turn| 0.5 + 0.15 * (TAU * 3.0 * turn).sin(), 2000);
    let way = [circuit(0.25, 0.79), circuit(0.25, 0.84)];
    Figure {
        title: "The course with its gates and a sampled lap".into(),
        description: "Two closed walls, a hundred gates across, one lap and its crossings.".into(),
        panels: vec![Panel {
            size_px: [560.0, 480.0],
            ..arena(
                "",
                vec![
                    Mark::new("gates", gates, Shape::Segments((1..100).map(gate).collect())),
                    walls(),
                    Mark::new("joints of the splines", squares, Shape::Points(joints.collect())),
                    Mark::new(
                        "lap",
                        Style {
                            width_px: 1.2,
                            ..Style::color(Color::BLUE)
                        },
                        Shape::Line(lap),
                    ),
                    Mark::new("crossings", crosses, Shape::Points(sampled.collect())),
                    Mark::new("gate 0", start, Shape::Segments(vec![gate(0)])),
                    Mark::new(
                        "driving direction",
                        Style::color(Color::GREEN),
                        Shape::Arrows(vec![way]),
                    ),
                    Mark::new(
                        "",
                        Style::color(Color::VERMILLION),
                        Shape::Notes(vec![Note {
                            at: circuit(1.0, 0.0),
                            text: "gate 0".into(),
                            anchor: Anchor::Right,
                        }]),
                    ),
                ],
            )
        }],
        ..Figure::default()
    }
}

fn two_maps() -> Figure {
    let panel = |title: &str, from: usize| {
        let mut marks = vec![walls()];
        marks.extend((0..2).map(|series| {
            lap(
                from + series,
                &format!("run {}", ["a", "b", "c", "d"][from + series]),
                Dash::series(series),
            )
        }));
        Panel {
            size_px: [400.0, 350.0],
            ..arena(title, marks)
        }
    };
    Figure {
        title: "Laps of two controllers".into(),
        description: "Four sample laps on the course for each controller.".into(),
        panels: vec![
            panel("(a) Controller 1, rule-based", 0),
            panel("(b) Controller 2, Braitenberg", 2),
        ],
        columns: 2,
        share: Share::Y,
        legend: Side::Below,
    }
}

fn cloud(series: usize, center: [f64; 2], spread: [f64; 2], angle_rad: f64) -> Vec<[f64; 2]> {
    let (sin, cos) = angle_rad.sin_cos();
    let point = |index: usize| {
        let (a, b) = (
            spread[0] * bell(1000 * series + 2 * index),
            spread[1] * bell(1000 * series + 2 * index + 1),
        );
        [center[0] + a * cos - b * sin, center[1] + a * sin + b * cos]
    };
    (0..20).map(point).collect()
}

fn clusters() -> Figure {
    let marks = (0..8).flat_map(|series| {
        let controller = series / 4;
        let center = [
            if controller == 0 { -0.15 } else { 0.14 } + 0.03 * noise(series),
            0.09 * noise(series + 40),
        ];
        let (spread, angle_rad) = ([0.022, 0.012], 0.7 * series as f64);
        let label = format!("Real {}{}", controller + 1, ["a", "b", "c", "d"][series % 4]);
        let style = Style::series(series);
        let around = Ellipse {
            center,
            semi_axes: spread.map(|s| 2.0 * s),
            angle_rad,
        };
        [
            Mark::new(
                "",
                Style {
                    fill: Fill::Faint,
                    width_px: 1.0,
                    ..style
                },
                Shape::Ellipses(vec![around]),
            ),
            Mark::new(
                label,
                Style {
                    width_px: 1.3,
                    ..style
                },
                Shape::Points(cloud(series, center, spread, angle_rad)),
            ),
        ]
    });
    Figure {
        title: "Eight clusters in the first two modes".into(),
        description: "The clusters of the two controllers lie apart along the first mode.".into(),
        panels: vec![Panel {
            x: Axis::linear("mode 1, m (71.3 % of the variance)"),
            y: Axis::linear("mode 2, m (12.8 %)"),
            marks: marks.collect(),
            size_px: [480.0, 360.0],
            legend: Legend::Own(Side::Right),
            ..Panel::default()
        }],
        ..Figure::default()
    }
}

const MEASURED: [[f64; 2]; 10] = [
    [0.0, 4095.0],
    [0.005, 2133.33],
    [0.010, 1465.73],
    [0.015, 601.46],
    [0.020, 383.84],
    [0.030, 234.93],
    [0.040, 158.03],
    [0.050, 120.0],
    [0.060, 104.09],
    [0.070, 67.19],
];

fn response() -> Figure {
    let reading = |d: f64| 4202.93 / (1.0 + (d / 0.005_219_53_f64).powf(1.572_816_92));
    let distances = (0..=200).map(|index| 0.1 * f64::from(index) / 200.0);
    let improved: Vec<[f64; 2]> = distances.map(|d| [d, reading(d)]).collect();
    let noise = |[at, value]: [f64; 2]| {
        let deviation = (0.05 * value).hypot(8.0);
        Interval {
            at,
            low: value - 2.0 * deviation,
            high: value + 2.0 * deviation,
        }
    };
    Figure {
        title: "Sensor response and two models".into(),
        description: "The measured reading falls much faster than the original linear model.".into(),
        panels: vec![Panel {
            x: Axis {
                range: Some([0.0, 0.1]),
                ..Axis::linear("distance to the wall, m")
            },
            y: Axis {
                range: Some([0.0, 4500.0]),
                ..Axis::linear("sensor reading, counts")
            },
            marks: vec![
                Mark::new(
                    "two standard deviations",
                    Style::series(0),
                    Shape::Band(improved.iter().copied().map(noise).collect()),
                ),
                Mark::new(
                    "improved model",
                    Style {
                        width_px: 1.8,
                        ..Style::series(0)
                    },
                    Shape::Line(improved),
                ),
                Mark::new(
                    "original model",
                    Style {
                        dash: Dash::Dashed,
                        width_px: 1.8,
                        ..Style::series(1)
                    },
                    Shape::Line(vec![[0.0, 3800.0], [0.1, 300.0]]),
                ),
                Mark::new(
                    "measured",
                    Style {
                        marker: Marker::Cross,
                        size_px: 9.0,
                        ..Style::default()
                    },
                    Shape::Points(MEASURED.to_vec()),
                ),
            ],
            legend: Legend::Inside(Corner::TopRight),
            ..Panel::default()
        }],
        ..Figure::default()
    }
}

fn stacked() -> Figure {
    let series = |phase: f64, scale: f64| -> Vec<[f64; 2]> {
        (0..3000)
            .map(|i| f64::from(i) * 0.02)
            .map(|t| {
                [
                    t,
                    scale * ((0.9 * t + phase).sin() + 0.1 * noise((t * 50.0) as usize)),
                ]
            })
            .collect()
    };
    let panel = |title: &str, label: &str, scale: f64| Panel {
        title: title.into(),
        x: Axis::linear("time, s"),
        y: Axis::linear(label),
        marks: vec![
            Mark::new(
                "contact",
                Style::color(Color::VERMILLION),
                Shape::Stripes {
                    between: vec![[12.0, 14.0], [41.0, 42.5]],
                    direction: Direction::Vertical,
                },
            ),
            Mark::new(
                "measured",
                Style {
                    width_px: 1.0,
                    ..Style::color(Color::INK)
                },
                Shape::Line(series(0.0, scale)),
            ),
            Mark::new(
                "simulated",
                Style {
                    width_px: 1.2,
                    ..Style::series(0)
                },
                Shape::Line(series(0.4, scale)),
            ),
        ],
        size_px: [560.0, 130.0],
        ..Panel::default()
    };
    Figure {
        title: "Three quantities over time".into(),
        description: "Position, heading and wheel speed of a lap, measured and simulated.".into(),
        panels: vec![
            panel("", "lateral position, m", 0.02),
            panel("", "heading, rad", 1.5),
            panel("", "speed of the left wheel over time, m/s", 0.05),
        ],
        share: Share::X,
        ..Figure::default()
    }
}

fn scaling() -> Figure {
    let sizes = [15.0, 33.0, 47.0, 105.0, 1000.0, 10_000.0, 100_000.0];
    let caster = |series: usize, label: &str, slope: f64| {
        let time = move |n: f64| 40.0 * n.powf(slope);
        let points: Vec<[f64; 2]> = sizes
            .iter()
            .map(|&n| [n, time(n) * (1.0 + 0.2 * noise(n as usize + series))])
            .collect();
        let bars = points
            .iter()
            .map(|&[at, y]| Interval {
                at,
                low: 0.7 * y,
                high: 1.4 * y,
            })
            .collect();
        let style = Style::series(series);
        [
            Mark::new(
                "",
                Style {
                    width_px: 1.1,
                    dash: Dash::Dashed,
                    ..style
                },
                Shape::Line(sizes.iter().map(|&n| [n, time(n)]).collect()),
            ),
            Mark::new(
                "",
                Style {
                    width_px: 1.1,
                    ..style
                },
                Shape::ErrorBars {
                    intervals: bars,
                    direction: Direction::Vertical,
                },
            ),
            Mark::new(
                label,
                Style {
                    fill: Fill::With(Color::WHITE),
                    ..style
                },
                Shape::Points(points),
            ),
            Mark::new(
                "",
                style,
                Shape::Notes(vec![Note {
                    at: [3000.0, 0.6 * time(3000.0)],
                    text: format!("slope {slope:.2}"),
                    anchor: Anchor::Below,
                }]),
            ),
        ]
    };
    Figure {
        title: "Time of a reading against the number of segments".into(),
        description: "The brute caster grows linearly, the tree hardly at all.".into(),
        panels: vec![Panel {
            x: Axis::log("segments"),
            y: Axis::log("time of a reading, ns"),
            marks: caster(0, "brute", 0.98)
                .into_iter()
                .chain(caster(1, "bvh", 0.14))
                .collect(),
            ..Panel::default()
        }],
        ..Figure::default()
    }
}

fn distances() -> Figure {
    let group = |series: usize, label: &str, values: [f64; 4]| {
        let at = |run: usize| run as f64 + 0.36 * (series as f64 - 0.5);
        let bars = values
            .iter()
            .enumerate()
            .map(|(run, &high)| Interval {
                at: at(run),
                low: 0.0,
                high,
            })
            .collect();
        let errors = values
            .iter()
            .enumerate()
            .map(|(run, &v)| Interval {
                at: at(run),
                low: 0.85 * v,
                high: 1.2 * v,
            })
            .collect();
        let style = Style::series(series);
        [
            Mark::new(
                label,
                style,
                Shape::Bars {
                    bars,
                    width: 0.34,
                    direction: Direction::Vertical,
                },
            ),
            Mark::new(
                "",
                Style {
                    width_px: 1.1,
                    ..Style::default()
                },
                Shape::ErrorBars {
                    intervals: errors,
                    direction: Direction::Vertical,
                },
            ),
        ]
    };
    Figure {
        title: "Distances of two sensor models".into(),
        description: "The improved sensor model is much nearer to every run.".into(),
        panels: vec![Panel {
            x: Axis::categories("real run", ["a", "b", "c", "d"]),
            y: Axis::linear("inter-cluster distance"),
            marks: group(0, "improved sensor", [2.4, 2.3, 2.4, 0.5])
                .into_iter()
                .chain(group(1, "original sensor", [16.3, 12.9, 9.7, 11.0]))
                .collect(),
            size_px: [380.0, 260.0],
            ..Panel::default()
        }],
        ..Figure::default()
    }
}

fn ranking() -> Figure {
    let names = [
        "sensor-gain",
        "wheel-slip",
        "ambient-light",
        "cone-of-view",
        "camera-scale and a name that is long",
        "axle-length",
    ];
    let shares = [0.62, 0.21, 0.08, 0.05, 0.03, -0.01];
    let bars = shares
        .iter()
        .enumerate()
        .map(|(at, &high)| Interval {
            at: at as f64,
            low: 0.0,
            high,
        })
        .collect();
    let errors = shares
        .iter()
        .enumerate()
        .map(|(at, &v)| Interval {
            at: at as f64,
            low: v - 0.04,
            high: v + 0.05,
        })
        .collect();
    let upright = Axis::categories("", names);
    let lying = Axis::categories("", names);
    let bar = |direction| Shape::Bars {
        bars: Vec::clone(&bars),
        width: 0.62,
        direction,
    };
    Figure {
        title: "Shares of the explained error".into(),
        description: "The gain of the sensors explains most.".into(),
        panels: vec![
            Panel {
                title: "(a) Ranking".into(),
                x: Axis::linear("share of the explained error"),
                y: upright,
                marks: vec![
                    Mark::new("", Style::series(0), bar(Direction::Horizontal)),
                    Mark::new(
                        "",
                        Style {
                            width_px: 1.1,
                            ..Style::default()
                        },
                        Shape::ErrorBars {
                            intervals: errors,
                            direction: Direction::Horizontal,
                        },
                    ),
                    Mark::new(
                        "",
                        Style {
                            width_px: 1.0,
                            ..Style::default()
                        },
                        Shape::Rules {
                            at: vec![0.0],
                            direction: Direction::Vertical,
                        },
                    ),
                ],
                size_px: [300.0, 220.0],
                ..Panel::default()
            },
            Panel {
                title: "(b) The same, upright".into(),
                x: lying,
                y: Axis::linear("share"),
                marks: vec![Mark::new("", Style::color(Color::SKY), bar(Direction::Vertical))],
                size_px: [300.0, 220.0],
                ..Panel::default()
            },
        ],
        columns: 2,
        ..Figure::default()
    }
}

fn residual() -> Figure {
    let points = around(|_| 0.5, 400);
    let values = (0..=400)
        .map(|index| 0.012 * (TAU * 3.0 * f64::from(index) / 400.0).sin() + 0.004)
        .collect();
    Figure {
        title: "Residual along the course".into(),
        description: "Where the simulated mean lap differs from the measured one.".into(),
        panels: vec![Panel {
            colors: Some(ColorScale {
                label: "measured − simulated, m".into(),
                map: ColorMap::Diverging,
                range: None,
            }),
            ..arena(
                "Residual of the mean lap",
                vec![
                    Mark {
                        label: String::new(),
                        ..walls()
                    },
                    Mark::new(
                        "",
                        Style {
                            width_px: 7.0,
                            ..Style::default()
                        },
                        Shape::ColoredLine { points, values },
                    ),
                ],
            )
        }],
        ..Figure::default()
    }
}

fn sweep() -> Figure {
    let edges = |count: usize| (0..=count).map(|edge| edge as f64 - 0.5).collect::<Vec<_>>();
    let value =
        |row: usize, column: usize| 0.5 + ((row as f64 - 2.0).powi(2) + (column as f64 - 3.0).powi(2)) * 0.8;
    let cells = |(rows, columns): (usize, usize)| {
        (0..rows).flat_map(move |row| (0..columns).map(move |column| (row, column)))
    };
    let values: Vec<f64> = cells((5, 6))
        .map(|(row, column)| {
            if (row, column) == (4, 0) {
                f64::NAN
            } else {
                value(row, column)
            }
        })
        .collect();
    Figure {
        title: "Distance over two parameters".into(),
        description: "The distance is least near the declared values.".into(),
        panels: vec![Panel {
            title: "Distance to run d".into(),
            x: Axis::categories(
                "gain, 1/count",
                ["0.0001", "0.0002", "0.0005", "0.001", "0.002", "0.005"],
            ),
            y: Axis::categories("wall tolerance, m", ["0.001", "0.002", "0.005", "0.01", "0.05"]),
            marks: vec![Mark::new(
                "",
                Style::default(),
                Shape::Cells(Grid {
                    x_edges: edges(6),
                    y_edges: edges(5),
                    values,
                    decimals: Some(1),
                }),
            )],
            colors: Some(ColorScale {
                label: "inter-cluster distance".into(),
                ..ColorScale::default()
            }),
            ..Panel::default()
        }],
        ..Figure::default()
    }
}

fn gates() -> Figure {
    let mean = |series: usize| -> Vec<[f64; 2]> {
        (0..100)
            .map(|gate| {
                [
                    f64::from(gate),
                    0.02 * (0.2 * f64::from(gate) + 0.3 * series as f64).sin() + 0.008 * series as f64,
                ]
            })
            .collect()
    };
    let marks = ["Real 2d", "1 mm", "10 mm", "50 mm"]
        .iter()
        .enumerate()
        .flat_map(|(series, label)| {
            let band = mean(series)
                .iter()
                .map(|&[at, y]| Interval {
                    at,
                    low: y - 0.005,
                    high: y + 0.005,
                })
                .collect();
            let style = Style {
                dash: Dash::series(series),
                ..Style::series(series)
            };
            [
                Mark::new(*label, style, Shape::Band(band)),
                Mark::new(*label, style, Shape::Line(mean(series))),
            ]
        });
    Figure {
        title: "Mean laps on the gates".into(),
        description: "Mean lateral position with one standard deviation for four wall tolerances.".into(),
        panels: vec![Panel {
            x: Axis {
                range: Some([0.0, 99.0]),
                ticks: Ticks::At(vec![0.0, 25.0, 50.0, 75.0, 99.0]),
                ..Axis::linear("gate")
            },
            y: Axis::linear("lateral position, m"),
            marks: marks.collect(),
            size_px: [560.0, 260.0],
            legend: Legend::Own(Side::Below),
            ..Panel::default()
        }],
        ..Figure::default()
    }
}

fn shared() -> Figure {
    let panel = |title: &str, from: usize| {
        let marks = (from..from + 3).map(|series| {
            let points = cloud(
                series,
                [0.1 * noise(series), 0.1 * noise(series + 9)],
                [0.03, 0.015],
                series as f64,
            );
            Mark::new(
                format!("simulation {}", series + 1),
                Style {
                    size_px: 6.0,
                    width_px: 1.2,
                    ..Style::series(series)
                },
                Shape::Points(points),
            )
        });
        Panel {
            title: title.into(),
            x: Axis::linear("mode 1, m"),
            y: Axis::linear("mode 2, m"),
            marks: marks.collect(),
            size_px: [250.0, 230.0],
            ..Panel::default()
        }
    };
    Figure {
        title: "Three panels on one scale".into(),
        description: "Clusters of three features on common axes.".into(),
        panels: vec![
            panel("(a) Sensor", 0),
            panel("(b) Walls", 2),
            panel("(c) Slip", 4),
        ],
        columns: 3,
        share: Share::Both,
        legend: Side::Below,
    }
}
