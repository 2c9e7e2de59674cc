//! The pictures: heat maps (Figs. 4, 5), attacked meshes (Figs. 6–10), the curve of strengths (Fig. 2).

use std::fmt::Write;

use anyhow::Result;
use baselines::Algorithm;
use quality::{Scale, heatmap};

use crate::{
    models::Standin,
    paper::{self, ATTACKS, Attack, COMBINED, Model},
    results::Results,
    roc::Frame,
    study::Target,
};

/// Multiples of Table 4's α in the sweep.
pub(crate) const SWEEP: [f64; 6] = [0.25, 0.5, 1.0, 2.0, 4.0, 8.0];

/// The attacks under which strengths are compared: those that leave something to tell apart.
pub(crate) fn swept_attacks() -> impl Iterator<Item = &'static Attack> {
    ATTACKS
        .iter()
        .filter(|attack| ["noise 0.5 %", "LS5", "simpl. 5 %", "simpl. 1 %"].contains(&attack.name))
}

/// A picture with a caption, for the page.
pub(crate) struct Shown {
    /// With its extension: .png or .svg.
    pub(crate) file: String,
    pub(crate) title: String,
    pub(crate) caption: String,
    pub(crate) bytes: Vec<u8>,
}

/// Which figure shows which attacks on which model.
const SERIES: [(&str, &str, &[&str]); 5] = [
    (
        "Fig. 6",
        paper::ARMADILLO.name,
        &["simpl. 50 %", "simpl. 10 %", "simpl. 5 %", "simpl. 1 %"],
    ),
    ("Fig. 7", paper::DRAGON.name, &["noise 0.1 %", "noise 0.5 %"]),
    ("Fig. 8", paper::TEDDY.name, &["re-meshing"]),
    ("Fig. 9", paper::BUNNY.name, &["TS", "LS5"]),
    (
        "Fig. 10",
        paper::EROS.name,
        &["crop. + 0.1 sim.", "0.3 sim. + Loop", "crop. + 0.1 sim. + Loop"],
    ),
];

/// Pixels of an attacked mesh's picture.
const SIZE: usize = 420;

/// The size of the picture that a figure wants of a suspect, if it wants one: the first signature's, marked by MHBs.
pub(crate) fn size(
    model: &Model,
    algorithm: &dyn Algorithm,
    target: Target,
    attack: &Attack,
) -> Option<usize> {
    let shown = SERIES
        .iter()
        .any(|(_, name, attacks)| *name == model.name && attacks.contains(&attack.name));
    (shown && algorithm.name() == "MHBs" && matches!(target, Target::Marked(0))).then_some(SIZE)
}

/// Collects the distances of a model's marked meshes from their original, for pictures with one scale.
pub(crate) struct Heat<'a> {
    standin: &'a Standin,
    fields: Vec<(String, Vec<f64>)>,
}

/// Models of Figs. 4 and 5; the bunny stands in for them where it is alone.
const HEATED: [(&str, &str); 3] = [
    (paper::TEDDY.name, "Fig. 4"),
    (paper::LION.name, "Fig. 5"),
    (paper::BUNNY.name, "As Figs. 4 and 5"),
];

impl<'a> Heat<'a> {
    pub(crate) fn new(standin: &'a Standin) -> Self {
        Self {
            standin,
            fields: Vec::new(),
        }
    }

    fn figure(&self) -> Option<&'static str> {
        let name = self.standin.model.name;
        HEATED
            .iter()
            .find(|(model, _)| *model == name)
            .map(|(_, figure)| *figure)
    }

    /// Whether a figure shows this algorithm's mark.
    pub(crate) fn wants(&self, algorithm: &str) -> bool {
        self.figure().is_some() && self.standin.model.printed(algorithm).is_some()
    }

    /// Distances in the mesh's unit, #V.
    pub(crate) fn add(&mut self, algorithm: &str, distances: Vec<f64>) {
        self.fields.push((algorithm.into(), distances));
    }

    /// The algorithms' pictures, red where any of them is farthest.
    pub(crate) fn painted(&self) -> Result<Vec<Shown>> {
        let Some(figure) = self.figure() else {
            return Ok(Vec::new());
        };
        let diagonal = self.standin.mesh.bounding_box().diagonal();
        let all = self.fields.iter().flat_map(|(_, field)| field);
        let greatest = all.copied().fold(0.0, f64::max) / diagonal;
        self.fields
            .iter()
            .map(|(algorithm, field)| {
                let shares: Vec<f64> = field.iter().map(|distance| distance / diagonal).collect();
                let own = shares.iter().copied().fold(0.0, f64::max);
                let title = format!("{figure}: {}, {algorithm}", self.standin.file);
                let scale = Scale::up_to(greatest);
                let picture = heatmap(&self.standin.mesh, &shares, scale, 300, "% of the diagonal", 100.0);
                Ok(Shown {
                    file: format!("heat_{}_{}.png", self.standin.file, algorithm.to_lowercase()),
                    title,
                    caption: format!(
                        "Distance from the original's surface, at most {:.4} % of the diagonal. The algorithms' pictures share one scale.",
                        100.0 * own
                    ),
                    bytes: picture.to_png()?,
                })
            })
            .collect()
    }
}

/// Figs. 6–10: what there is of them.
pub(crate) fn attacked(results: &Results) -> Vec<Shown> {
    let mut shown = Vec::new();
    for (figure, model, attacks) in SERIES {
        let outcomes = results
            .outcomes
            .iter()
            .filter(|outcome| outcome.model.name == model);
        for outcome in outcomes {
            let columns = outcome.columns.iter().filter(|column| column.algorithm == "MHBs");
            for trial in columns.flat_map(|column| &column.trials) {
                let Some(picture) = &trial.picture else { continue };
                if !attacks.contains(&trial.attack.name) || !matches!(trial.target, Target::Marked(0)) {
                    continue;
                }
                let printed = outcome
                    .model
                    .printed("MHBs")
                    .and_then(|printed| printed.row.rate(trial.attack.name));
                let printed = printed.map_or(String::new(), |rate| format!(", printed {rate} %"));
                let readings = trial.cell.readings.iter();
                let readings: Vec<String> = readings
                    .map(|rated| format!("{:.2} % ({})", 100.0 * rated.rate, rated.detector))
                    .collect();
                let known = ATTACKS
                    .iter()
                    .chain(&COMBINED)
                    .position(|attack| attack == trial.attack);
                shown.push(Shown {
                    file: format!(
                        "{}_{}.png",
                        figure.to_lowercase().replace(". ", ""),
                        known.unwrap_or_default()
                    ),
                    title: format!("{figure}: {}, {}", outcome.file, trial.attack.name),
                    caption: format!(
                        "{} vertices. Extraction rate {}{printed}.",
                        trial.cell.vertices,
                        readings.join(", ")
                    ),
                    bytes: picture.clone(),
                });
            }
        }
    }
    shown
}

const COLOURS: [&str; 4] = ["#d9480f", "#1c7ed6", "#2b8a3e", "#862e9c"];

/// Fig. 2: extraction rate over distortion, as SVG; none without a sweep.
pub(crate) fn strengths(results: &Results) -> Option<String> {
    let columns = results.outcomes.iter().flat_map(|outcome| &outcome.columns);
    let swept = columns
        .filter(|column| !column.sweep.is_empty())
        .map(|column| &column.sweep)
        .next()?;
    let frame = Frame::new(70.0, 50.0, 500.0, 270.0);
    let mut svg = String::from(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 720 380\" width=\"720\" height=\"380\" \
         font-family=\"system-ui, -apple-system, 'Segoe UI', 'DejaVu Sans', sans-serif\" font-size=\"12\">\n\
         <rect width=\"100%\" height=\"100%\" rx=\"8\" fill=\"#ffffff\"/>\n",
    );
    svg += &frame.axes("d_rmse (% of the diagonal), logarithmic", "extraction rate (%)");
    let distortions: Vec<f64> = swept.iter().map(|(mark, _)| mark.d_rmse).collect();
    let (least, greatest) = (distortions.first()?.ln(), distortions.last()?.ln());
    let across = |d: f64| 0.03 + 0.94 * (d.ln() - least) / (greatest - least).max(f64::MIN_POSITIVE);
    for &d in &distortions {
        svg += &frame.mark_x(across(d), &format!("{d:.4}"));
    }
    for rate in [50, 60, 70, 80, 90, 100] {
        svg += &frame.mark_y(f64::from(rate - 45) / 58.0, &rate.to_string());
    }
    for (i, attack) in swept_attacks().enumerate() {
        let mut path = String::new();
        for (mark, trials) in swept {
            let Some(trial) = trials.iter().find(|trial| trial.attack.name == attack.name) else {
                continue;
            };
            let rate = 100.0 * trial.cell.readings.first()?.rate;
            let (x, y) = frame.place(across(mark.d_rmse), (rate - 45.0) / 58.0);
            let _ = write!(path, "{}{x:.1} {y:.1}", if path.is_empty() { "M" } else { "L" });
        }
        let colour = COLOURS[i % COLOURS.len()];
        let _ = writeln!(
            svg,
            "<path d=\"{path}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\"/>"
        );
        svg += &Frame::new(590.0, 60.0, 0.0, 100.0).key(i, attack.name, colour);
    }
    Some(svg + "</svg>\n")
}
