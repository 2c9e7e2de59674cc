use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
    sync::Arc,
};

use anyhow::{Context, Result, bail};
use job::{Job, Stage};
use mesh::TriMesh;
use quality::{
    Dame, DistanceOptions, MetricStage, Msdm2, Normalisation, QualityError, Scale, ShapeDna, ShapeDnaOptions,
    SymmetricDistance, Visibility, heatmap, vertex_distances,
};
use registration::match_connectivity;
use serde_json::{Value, json};

use crate::{
    Answer,
    args::{Compare, Heat, Metric},
    files::{self, Output},
    progress::Progress,
    report,
};

/// Pixels along each side of the four views of a heat map.
const VIEW: usize = 600;

/// What was measured; what was not asked for, or not possible, is absent.
#[derive(Default)]
struct Measured {
    distance: Option<SymmetricDistance>,
    shape_dna: Option<(f64, [usize; 2])>,
    msdm2: Option<Msdm2>,
    dame: Option<Dame>,
    /// Why a metric that was asked for is absent.
    missing: BTreeMap<&'static str, String>,
}

struct Pair {
    reference: TriMesh,
    distorted: TriMesh,
    diagonal: f64,
}

/// The stage in which a heat map is painted.
#[derive(Clone, Copy, Debug)]
struct Painting;

impl Stage for Painting {
    fn name(&self) -> &'static str {
        "heatmap"
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
    let job = progress.job(arguments.threads.count());
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
    let painted = paint(arguments, &pair, measured.msdm2.as_ref(), &job)?;
    if let Some(painted) = &painted {
        let output = Output {
            path: &painted.file,
            bytes: &painted.bytes,
            private: false,
        };
        files::write_together(&[output], arguments.force)?;
    }
    let seconds = progress.finish();
    if arguments.json {
        report::json(&object(arguments, &pair, &measured, painted.as_ref(), &seconds))?;
    } else {
        report::lines(&summary(arguments, &pair, &measured, painted.as_ref(), &seconds))?;
    }
    Ok(Answer::Yes)
}

fn check_heatmap(arguments: &Compare) -> Result<()> {
    let Some(path) = &arguments.heatmap else {
        return Ok(());
    };
    if !is(path, "png") && !is(path, "ply") {
        bail!(
            "{}: a heat map is a .png picture or a .ply mesh: give it such a name",
            path.display()
        );
    }
    files::check_apart(path, &arguments.reference, "the reference")?;
    files::check_apart(path, &arguments.distorted, "the mesh compared")?;
    files::check_free(path, arguments.force)
}

fn is(path: &Path, extension: &str) -> bool {
    path.extension()
        .is_some_and(|own| own.eq_ignore_ascii_case(extension))
}

/// Measures what was asked for; fails with the first reason if nothing of it can be measured.
fn measure(arguments: &Compare, pair: &Pair, job: &Job) -> Result<Measured> {
    let mut measured = Measured::default();
    let mut first_reason = None;
    let mut keep = |name: &'static str, result: Result<()>| {
        if let Err(error) = result {
            measured.missing.insert(name, format!("{error:#}"));
            first_reason.get_or_insert(error);
        }
    };
    for metric in [Metric::Distance, Metric::ShapeDna, Metric::Msdm2, Metric::Dame] {
        if !arguments.metrics.contains(&metric) {
            continue;
        }
        match metric {
            Metric::Distance => {
                keep(
                    "distance",
                    distance(arguments, pair, job).map(|d| measured.distance = Some(d)),
                );
            }
            Metric::ShapeDna => {
                keep(
                    "shape_dna",
                    shape_dna(arguments, pair, job).map(|d| measured.shape_dna = Some(d)),
                );
            }
            Metric::Msdm2 => {
                keep(
                    "msdm2",
                    msdm2(arguments, pair, job).map(|m| measured.msdm2 = Some(m)),
                );
            }
            Metric::Dame => {
                keep(
                    "dame",
                    dame(arguments, pair, job).map(|d| measured.dame = Some(d)),
                );
            }
        }
    }
    match first_reason {
        Some(reason) if measured.missing.len() == distinct(&arguments.metrics) => Err(reason),
        _ => Ok(measured),
    }
}

fn distinct(metrics: &[Metric]) -> usize {
    metrics
        .iter()
        .enumerate()
        .filter(|(i, metric)| !metrics[..*i].contains(metric))
        .count()
}

fn distance(arguments: &Compare, pair: &Pair, job: &Job) -> Result<SymmetricDistance> {
    let options = DistanceOptions {
        interval: arguments.interval,
    };
    SymmetricDistance::between(&pair.distorted, &pair.reference, &options, job)
        .map_err(|error| blame(arguments, pair, error))
}

/// d_{p,m}, and how many components both have.
fn shape_dna(arguments: &Compare, pair: &Pair, job: &Job) -> Result<(f64, [usize; 2])> {
    let options = ShapeDnaOptions {
        count: arguments.eigenvalues,
        ..Default::default()
    };
    let of = |mesh: &TriMesh, path: &Path, job: &Job| {
        ShapeDna::of(mesh, &options, job).with_context(|| path.display().to_string())
    };
    let (reference, distorted) = job.join(
        || of(&pair.reference, &arguments.reference, job),
        || of(&pair.distorted, &arguments.distorted, &job.quiet()),
    )?;
    let (reference, distorted) = (reference?, distorted?);
    let distance = distorted.distance(&reference, arguments.norm, Normalisation::FirstEigenvalue)?;
    Ok((distance, [reference.components(), distorted.components()]))
}

fn msdm2(arguments: &Compare, pair: &Pair, job: &Job) -> Result<Msdm2> {
    Msdm2::between(&pair.distorted, &pair.reference, job).map_err(|error| blame(arguments, pair, error))
}

fn dame(arguments: &Compare, pair: &Pair, job: &Job) -> Result<Dame> {
    let matched = match_connectivity(&pair.reference, &pair.distorted, job)
        .with_context(|| arguments.distorted.display().to_string())?;
    let carried = matched.carry(&pair.distorted);
    let positions: Option<Vec<[f64; 3]>> = carried.into_iter().collect();
    let positions = positions.context("the reference has vertices that no face uses")?;
    let in_order = pair.reference.with_positions(positions)?;
    Ok(Dame::between(&in_order, &pair.reference, Visibility::Seen, job)?)
}

/// The error with the name of the file that it is about, if it is about one.
fn blame(arguments: &Compare, pair: &Pair, error: QualityError) -> anyhow::Error {
    let file = match error {
        QualityError::NoSurface { .. } if pair.reference.area().is_normal() => &arguments.distorted,
        QualityError::NoSurface { .. } => &arguments.reference,
        _ => return error.into(),
    };
    anyhow::Error::new(error).context(file.display().to_string())
}

fn paint(
    arguments: &Compare,
    pair: &Pair,
    msdm2_known: Option<&Msdm2>,
    job: &Job,
) -> Result<Option<Painted>> {
    let Some(file) = &arguments.heatmap else {
        return Ok(None);
    };
    job.begin(Painting)?;
    let (values, unit, factor) = match (arguments.heatmap_of, msdm2_known) {
        (Heat::Distance, _) => {
            let distances = vertex_distances(
                &pair.distorted,
                &pair.reference,
                &job.within(MetricStage::Distance),
            )?;
            let fractions = distances.into_iter().map(|d| d / pair.diagonal).collect();
            (fractions, "distance, % of diagonal", 100.0)
        }
        (Heat::Msdm2, Some(known)) => (known.local.clone(), "local msdm2", 1.0),
        (Heat::Msdm2, None) => (
            msdm2(arguments, pair, &job.within(MetricStage::Msdm2))?.local,
            "local msdm2",
            1.0,
        ),
    };
    let scale = arguments
        .heatmap_max
        .map_or_else(|| Scale::of(&values), Scale::up_to);
    let bytes = if is(file, "ply") {
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

/// What `--json` prints.
fn object(
    arguments: &Compare,
    pair: &Pair,
    measured: &Measured,
    painted: Option<&Painted>,
    seconds: &[(&'static str, f64)],
) -> Value {
    let distance = measured.distance.map(|d| {
        let part = |length: f64| length / d.diagonal;
        json!({
            "d_rmse": part(d.forward.rmse),
            "mean": part(d.forward.mean),
            "hausdorff_forward": part(d.forward.maximum),
            "hausdorff_backward": part(d.backward.maximum),
            "hausdorff": part(d.hausdorff()),
            "rmse_backward": part(d.backward.rmse),
            "mean_backward": part(d.backward.mean),
            "mrms": part(d.mrms()),
            "samples": [d.forward.samples, d.backward.samples],
            "interval": arguments.interval,
        })
    });
    let shape_dna = measured.shape_dna.map(|(distance, components)| {
        json!({"p": arguments.norm, "m": arguments.eigenvalues, "distance": distance, "components": components})
    });
    json!({
        "reference": arguments.reference,
        "distorted": arguments.distorted,
        "diagonal": pair.diagonal,
        "distance": distance,
        "shape_dna": shape_dna,
        "msdm2": measured.msdm2,
        "dame": measured.dame,
        "not_computed": measured.missing,
        "heatmap": painted.map(|p| json!({"file": p.file, "max": p.greatest})),
        "seconds": report::seconds_json(seconds),
    })
}

fn summary(
    arguments: &Compare,
    pair: &Pair,
    measured: &Measured,
    painted: Option<&Painted>,
    seconds: &[(&'static str, f64)],
) -> Vec<String> {
    let mut lines = vec![format!(
        "{} beside {}",
        arguments.distorted.display(),
        arguments.reference.display()
    )];
    let field = |lines: &mut Vec<String>, name: &str, value: String| lines.push(report::field(name, value));
    if let Some(d) = measured.distance {
        let cent = |length: f64| percentage(length / d.diagonal);
        field(
            &mut lines,
            "d_rmse",
            format!(
                "{} of the diagonal (mean {}, greatest {})",
                cent(d.forward.rmse),
                cent(d.forward.mean),
                cent(d.forward.maximum)
            ),
        );
        let back = &d.backward;
        let text = format!(
            "{} (mean {}, greatest {})",
            cent(back.rmse),
            cent(back.mean),
            cent(back.maximum)
        );
        field(&mut lines, "the other way", text);
        field(
            &mut lines,
            "Hausdorff",
            format!("{}, MRMS {}", cent(d.hausdorff()), cent(d.mrms())),
        );
        let samples = report::grouped(d.forward.samples + d.backward.samples);
        field(
            &mut lines,
            "samples",
            format!("{samples}, every {}", percentage(arguments.interval)),
        );
    }
    if let Some((distance, components)) = measured.shape_dna {
        let pieces = match components {
            [1, 1] => String::new(),
            [a, b] => format!(" ({a} and {b} components)"),
        };
        let text = format!(
            "d_{},{} = {distance:.6}{pieces}",
            arguments.norm, arguments.eigenvalues
        );
        field(&mut lines, "Shape-DNA", text);
    }
    if let Some(msdm2) = &measured.msdm2 {
        let text = format!(
            "{:.4} (forward {:.4}, backward {:.4}; 0 is the same)",
            msdm2.symmetric, msdm2.forward, msdm2.backward
        );
        field(&mut lines, "MSDM2", text);
    }
    if let Some(dame) = &measured.dame {
        let text = format!(
            "{:.5} rad over {}",
            dame.error,
            report::counted(dame.edges, "edge", "edges")
        );
        field(&mut lines, "DAME", text);
    }
    for (name, reason) in &measured.missing {
        field(&mut lines, "not computed", format!("{name}: {reason}"));
    }
    if let Some(painted) = painted {
        let greatest = match arguments.heatmap_of {
            Heat::Distance => format!("{} of the diagonal", percentage(painted.greatest)),
            Heat::Msdm2 => format!("{:.3}", painted.greatest),
        };
        field(
            &mut lines,
            "heat map",
            format!("{}, red is {greatest}", painted.file.display()),
        );
    }
    field(
        &mut lines,
        "diagonal",
        format!("{:.6} in the models' unit", pair.diagonal),
    );
    field(&mut lines, "time", report::seconds_text(seconds));
    lines
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
