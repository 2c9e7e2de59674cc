use std::{collections::BTreeMap, path::PathBuf, sync::Arc};

use anyhow::{Context, Result, bail};
use clap::ValueEnum;
use job::{Job, Stage};
use mesh::TriMesh;
use quality::{
    Measurement, Metric, Msdm2Metric, Needs, QualityError, Scale, Side, heatmap, vertex_distances,
};
use registration::match_connectivity;
use serde_json::{Value, json};

use crate::{
    Answer,
    args::{Compare, Heat, MetricName},
    files::{self, Output},
    progress::Progress,
    report::{self, Lines, Seconds},
};

/// Pixels along each side of the four views of a heat map.
const VIEW: usize = 600;

/// What was measured; what was not asked for, or not possible, is absent.
#[derive(Default)]
struct Measured {
    /// By the metrics' names, in their order.
    measurements: Vec<(&'static str, Measurement)>,
    /// Why a metric that was asked for is absent.
    missing: BTreeMap<&'static str, String>,
}

impl Measured {
    fn get(&self, name: &str) -> Option<&Measurement> {
        let found = self.measurements.iter().find(|(own, _)| *own == name);
        found.map(|(_, measurement)| measurement)
    }
}

struct Pair {
    reference: TriMesh,
    distorted: TriMesh,
    diagonal: f64,
}

/// What is being measured or painted.
#[derive(Clone, Copy, Debug)]
struct Doing(&'static str);

impl Stage for Doing {
    fn name(&self) -> &'static str {
        self.0
    }
}

/// A heat map that was painted.
struct Painted {
    file: PathBuf,
    bytes: Vec<u8>,
    greatest: f64,
}

pub(crate) fn run(arguments: &Compare) -> Result<Answer> {
    check_heatmap(arguments)?;
    let progress = Arc::new(Progress::new());
    let job = progress.job(arguments.common.threads());
    progress.begin("reading", "reading");
    let [reference, distorted] =
        [&arguments.reference, &arguments.distorted].map(|path| files::open_mesh(path));
    let (reference, distorted) = (reference?.mesh().clone(), distorted?.mesh().clone());
    let pair = Pair {
        diagonal: reference.bounding_box().diagonal(),
        reference,
        distorted,
    };
    let measured = measure(arguments, &pair, &job)?;
    let painted = paint(arguments, &pair, &measured, &job)?;
    if let Some(painted) = &painted {
        let output = Output::public((&painted.file, &painted.bytes));
        files::write_together(&[output], arguments.force)?;
    }
    let seconds = progress.finish();
    let object = object(arguments, &pair, &measured, painted.as_ref(), &seconds);
    let lines = summary(arguments, &pair, &measured, painted.as_ref(), &seconds);
    report::print(arguments.common.json, &object, &lines)?;
    Ok(Answer::Yes)
}

fn check_heatmap(arguments: &Compare) -> Result<()> {
    let Some(path) = &arguments.heatmap else {
        return Ok(());
    };
    if !files::has_extension(path, "png") && !files::has_extension(path, "ply") {
        bail!(
            "{}: a heat map is a .png picture or a .ply mesh: give it such a name",
            path.display()
        );
    }
    files::check_apart(path, &arguments.reference, "the reference")?;
    files::check_apart(path, &arguments.distorted, "the mesh compared")?;
    files::check_free(path, arguments.force)
}

/// Measures what was asked for; fails with the first reason if nothing of it can be measured.
fn measure(arguments: &Compare, pair: &Pair, job: &Job) -> Result<Measured> {
    let mut measured = Measured::default();
    let mut first_reason = None;
    for name in MetricName::value_variants() {
        if !arguments.metrics.contains(name) {
            continue;
        }
        let metric = arguments.metric(*name);
        job.begin(Doing(metric.name()))?;
        match compare(arguments, pair, &*metric, job) {
            Ok(measurement) => measured.measurements.push((metric.name(), measurement)),
            Err(reason) => {
                measured.missing.insert(metric.name(), format!("{reason:#}"));
                first_reason.get_or_insert(reason);
            }
        }
    }
    // A metric that was interrupted is not one that could not be computed.
    job.go_on()?;
    match first_reason {
        Some(reason) if measured.measurements.is_empty() => Err(reason),
        _ => Ok(measured),
    }
}

/// Measures by one metric, with the vertices in the reference's order where it needs that.
fn compare(arguments: &Compare, pair: &Pair, metric: &dyn Metric, job: &Job) -> Result<Measurement> {
    let measurement = match metric.needs() {
        Needs::SameConnectivity => {
            let in_order =
                in_order(pair, &job.quiet()).with_context(|| arguments.distorted.display().to_string())?;
            metric.measure(&pair.reference, &in_order, job)
        }
        _ => metric.measure(&pair.reference, &pair.distorted, job),
    };
    measurement.map_err(|error| blame(arguments, error))
}

/// The distorted mesh with the reference's triangles.
fn in_order(pair: &Pair, job: &Job) -> Result<TriMesh> {
    let matched = match_connectivity(&pair.reference, &pair.distorted, job)?;
    let carried = matched.carry(&pair.distorted);
    let positions: Option<Vec<[f64; 3]>> = carried.into_iter().collect();
    let positions = positions.context("the reference has vertices that no face uses")?;
    Ok(pair.reference.with_positions(positions)?)
}

/// The error with the name of the file that it is about, if it is about one.
fn blame(arguments: &Compare, error: QualityError) -> anyhow::Error {
    match error {
        QualityError::Mesh { side, source } => {
            let file = match side {
                Side::Reference => &arguments.reference,
                Side::Other => &arguments.distorted,
            };
            anyhow::Error::new(*source).context(file.display().to_string())
        }
        error => error.into(),
    }
}

fn paint(arguments: &Compare, pair: &Pair, measured: &Measured, job: &Job) -> Result<Option<Painted>> {
    let Some(file) = &arguments.heatmap else {
        return Ok(None);
    };
    job.begin(Doing("heatmap"))?;
    let (values, unit, factor) = match arguments.heatmap_of {
        Heat::Distance => {
            let distances = vertex_distances(&pair.distorted, &pair.reference, job)?;
            let fractions = distances.into_iter().map(|d| d / pair.diagonal).collect();
            (fractions, "distance, % of diagonal", 100.0)
        }
        Heat::Msdm2 => (local_msdm2(arguments, pair, measured, job)?, "local msdm2", 1.0),
    };
    let scale = arguments
        .heatmap_max
        .map_or_else(|| Scale::of(&values), Scale::up_to);
    let bytes = if files::has_extension(file, "ply") {
        mesh_io::write_coloured_ply(&pair.distorted, &scale.bytes(&values))
    } else {
        heatmap(&pair.distorted, &values, scale, VIEW, unit, factor).to_png()?
    };
    Ok(Some(Painted {
        file: file.clone(),
        bytes,
        greatest: scale.greatest(),
    }))
}

/// The local distortion at each vertex, computed unless it is known.
fn local_msdm2(arguments: &Compare, pair: &Pair, measured: &Measured, job: &Job) -> Result<Vec<f64>> {
    let found = match measured.get(Msdm2Metric.name()) {
        Some(known) => known.clone(),
        None => compare(arguments, pair, &Msdm2Metric, job)?,
    };
    let local = found.local().map(<[f64]>::to_vec);
    local.context("MSDM2 has a distortion at each vertex")
}

/// What `--json` prints.
fn object(
    arguments: &Compare,
    pair: &Pair,
    measured: &Measured,
    painted: Option<&Painted>,
    seconds: &Seconds,
) -> Value {
    let mut object = json!({
        "reference": arguments.reference,
        "distorted": arguments.distorted,
        "diagonal": pair.diagonal,
        "not_computed": measured.missing,
        "heatmap": painted.map(|p| json!({"file": p.file, "max": p.greatest})),
        "seconds": report::seconds_json(seconds),
    });
    for name in MetricName::value_variants() {
        let name = arguments.metric(*name).name();
        object[name] = json!(measured.get(name));
    }
    object
}

fn summary(
    arguments: &Compare,
    pair: &Pair,
    measured: &Measured,
    painted: Option<&Painted>,
    seconds: &Seconds,
) -> Lines {
    let (distorted, reference) = (arguments.distorted.display(), arguments.reference.display());
    let mut lines = Lines::new(format!("{distorted} beside {reference}"));
    for (name, measurement) in &measured.measurements {
        tell(&mut lines, name, measurement);
    }
    for (name, reason) in &measured.missing {
        lines.field("not computed", format!("{name}: {reason}"));
    }
    if let Some(painted) = painted {
        let greatest = match arguments.heatmap_of {
            Heat::Distance => format!("{} of the diagonal", percentage(painted.greatest)),
            Heat::Msdm2 => format!("{:.3}", painted.greatest),
        };
        let text = format!("{}, red is {greatest}", painted.file.display());
        lines.field("heat map", text);
    }
    lines.field("diagonal", format!("{:.6} in the models' unit", pair.diagonal));
    lines.field("time", report::seconds_text(seconds));
    lines
}

/// What a metric found, for people. One without words of its own is told by its figures.
fn tell(lines: &mut Lines, metric: &str, found: &Measurement) {
    let number = |name: &str| found.number(name);
    let cent = |name: &str| percentage(found.number(name));
    match metric {
        "distance" => {
            let [rms, mean, greatest] = ["d_rmse", "mean", "hausdorff_forward"].map(cent);
            let forward = format!("{rms} of the diagonal (mean {mean}, greatest {greatest})");
            lines.field("d_rmse", forward);
            let [rms, mean, greatest] = ["rmse_backward", "mean_backward", "hausdorff_backward"].map(cent);
            lines.field(
                "the other way",
                format!("{rms} (mean {mean}, greatest {greatest})"),
            );
            let [hausdorff, mrms, interval] = ["hausdorff", "mrms", "interval"].map(cent);
            lines.field("Hausdorff", format!("{hausdorff}, MRMS {mrms}"));
            let samples = report::grouped(found.counts("samples").iter().sum());
            lines.field("samples", format!("{samples}, every {interval}"));
        }
        "shape_dna" => {
            let pieces = match found.counts("components") {
                [1, 1] => String::new(),
                [a, b] => format!(" ({a} and {b} components)"),
            };
            let (p, m, distance) = (number("p"), number("m"), number("distance"));
            lines.field("Shape-DNA", format!("d_{p},{m} = {distance:.6}{pieces}"));
        }
        "msdm2" => {
            let [symmetric, forward, backward] = ["symmetric", "forward", "backward"].map(number);
            let text =
                format!("{symmetric:.4} (forward {forward:.4}, backward {backward:.4}; 0 is the same)");
            lines.field("MSDM2", text);
        }
        "dame" => {
            let edges = report::counted(number("edges") as usize, "edge", "edges");
            lines.field("DAME", format!("{:.5} rad over {edges}", number("error")));
        }
        other => {
            let figures = found.figures().iter();
            let figures = figures.map(|(name, figure)| format!("{name} {}", json!(figure)));
            lines.field(other, figures.collect::<Vec<_>>().join(", "));
        }
    }
}

/// A fraction in per cent with four digits.
fn percentage(fraction: f64) -> String {
    let cent = 100.0 * fraction;
    if cent == 0.0 || cent.abs() >= 1e-4 {
        let digits = if cent > 0.0 {
            (3.0 - cent.log10().floor()).clamp(0.0, 8.0)
        } else {
            0.0
        };
        format!("{cent:.*} %", digits as usize)
    } else {
        format!("{cent:.3e} %")
    }
}
