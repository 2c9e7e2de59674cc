use std::ops::ControlFlow;

use anyhow::{Context, Result};
use mesh::Asset;
use mhb_core::{Phase, Spectrum, SpectrumOptions};
use serde_json::json;

use crate::{Answer, args, files, npz::Npz, progress::Progress, report};

pub(crate) fn run(arguments: &args::Spectrum) -> Result<Answer> {
    if let Some(output) = &arguments.output {
        files::check_free(output, arguments.force)?;
    }
    let progress = Progress::new();
    progress.begin("reading", "reading");
    let asset = Asset::open(&arguments.model)?;
    let mut options = SpectrumOptions {
        count: arguments.count,
        threads: arguments.threads.count(),
        ..SpectrumOptions::default()
    };
    if let Some(tolerance) = arguments.tolerance {
        options.tolerance = tolerance;
    }
    progress.begin("harmonics", "manifold harmonics");
    let watch = |phase: Phase, fraction: f64| {
        if phase == Phase::Solving {
            progress.done(fraction);
        }
        ControlFlow::Continue(())
    };
    let spectrum = Spectrum::compute_observed(asset.mesh(), &options, &watch)
        .with_context(|| arguments.model.display().to_string())?;
    if let Some(output) = &arguments.output {
        progress.begin("writing", "writing");
        mesh::write_file(output, &archive(&asset, &spectrum)?, arguments.force)?;
    }
    let seconds = progress.finish();

    let max_residual = spectrum.residuals().iter().fold(0.0f64, |most, &r| most.max(r));
    let eigenvalues = spectrum.eigenvalues();
    if arguments.json {
        report::json(&json!({
            "count": eigenvalues.len(),
            "vertices": asset.mesh().vertex_count(),
            "eigenvalues": eigenvalues,
            "max_residual": max_residual,
            "inertia_complete": spectrum.certificate().complete,
            "output": arguments.output,
            "seconds": report::seconds_json(&seconds),
        }))?;
        return Ok(Answer::Yes);
    }
    let shown: Vec<String> = eigenvalues
        .iter()
        .take(6)
        .map(|value| format!("{value:.6e}"))
        .collect();
    let mut lines = vec![
        format!(
            "{}: {} of a surface of {}",
            arguments.model.display(),
            report::counted(eigenvalues.len(), "eigenpair", "eigenpairs"),
            report::counted(asset.mesh().vertex_count(), "vertex", "vertices"),
        ),
        report::field(
            "eigenvalues",
            format!("{} … {:.6e}", shown.join(" "), eigenvalues[eigenvalues.len() - 1]),
        ),
        report::field("residual", format!("at most {max_residual:.1e}, relative")),
        report::field("completeness", completeness(&spectrum)),
        report::field("time", report::seconds_text(&seconds)),
    ];
    if let Some(output) = &arguments.output {
        lines.push(report::field("written", output.display()));
    }
    report::lines(&lines)?;
    Ok(Answer::Yes)
}

fn completeness(spectrum: &Spectrum) -> &'static str {
    if spectrum.certificate().complete {
        "proved: the inertia counts of the factorisations leave no pair out"
    } else {
        "not proved"
    }
}

/// The arrays that `--help` lists.
fn archive(asset: &Asset, spectrum: &Spectrum) -> Result<Vec<u8>> {
    let functions = spectrum.eigenfunctions();
    let (n, k) = (functions.nrows(), functions.ncols());
    let mut vertex = vec![-1; n];
    for (file_vertex, row) in asset.welded().vertex_of().iter().enumerate().rev() {
        if let Some(row) = row {
            vertex[*row as usize] = file_vertex as i64;
        }
    }
    let mut npz = Npz::new();
    npz.doubles("eigenvalues", &[k], spectrum.eigenvalues().iter().copied())?;
    npz.doubles(
        "eigenfunctions",
        &[n, k],
        (0..n).flat_map(|i| (0..k).map(move |j| functions[(i, j)])),
    )?;
    npz.doubles("mass", &[n], spectrum.mass().iter().copied())?;
    npz.integers("vertex", &vertex)?;
    npz.finish()
}
