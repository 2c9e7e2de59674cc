use std::sync::Arc;

use anyhow::{Context, Result, bail};
use mesh_io::Asset;
use mhb_core::{Spectrum, SpectrumOptions};
use serde_json::json;

use crate::{
    Answer, args,
    files::{self, Output},
    npz::Npz,
    progress::Progress,
    report::{self, Lines},
};

pub(crate) fn run(arguments: &args::Spectrum) -> Result<Answer> {
    if let Some(output) = &arguments.output {
        files::check_apart(output, &arguments.model, "the model itself")?;
        files::check_free(output, arguments.force)?;
    }
    let progress = Arc::new(Progress::new());
    progress.begin("reading", "reading");
    let asset = files::open_mesh(&arguments.model)?;
    check_size(arguments, asset.mesh().vertex_count())?;
    let defaults = SpectrumOptions::default();
    let options = SpectrumOptions {
        count: arguments.count,
        laplacian: arguments.laplacian.kind(),
        tolerance: arguments.tolerance.unwrap_or(defaults.tolerance),
        ..defaults
    };
    let job = progress.job(arguments.common.threads());
    let spectrum = Spectrum::compute(asset.mesh(), &options, &job)
        .with_context(|| arguments.model.display().to_string())?;
    if let Some(output) = &arguments.output {
        progress.begin("writing", "writing");
        let archive = archive(&asset, &spectrum)?;
        files::write_together(&[Output::public((output, &archive))], arguments.force)?;
    }
    let seconds = progress.finish();

    let max_residual = spectrum.residuals().iter().fold(0.0f64, |most, &r| most.max(r));
    let eigenvalues = spectrum.eigenvalues();
    let counts: Vec<(f64, usize)> = spectrum.inertia().iter().map(|c| (c.shift, c.below)).collect();
    let object = json!({
        "count": eigenvalues.len(),
        "vertices": asset.mesh().vertex_count(),
        "eigenvalues": eigenvalues,
        "laplacian": arguments.laplacian.name(),
        "max_residual": max_residual,
        "residuals": spectrum.residuals(),
        "inertia_complete": true,
        "inertia_counts": counts,
        "output": arguments.output,
        "seconds": report::seconds_json(&seconds),
    });
    let pairs = report::counted(eigenvalues.len(), "eigenpair", "eigenpairs");
    let vertices = report::counted(asset.mesh().vertex_count(), "vertex", "vertices");
    let model = arguments.model.display();
    let mut lines = Lines::new(format!("{model}: {pairs} of a surface of {vertices}"));
    lines.field("eigenvalues", abridged(eigenvalues));
    lines.field("residual", format!("at most {max_residual:.1e}, relative"));
    lines.field("completeness", COMPLETE);
    lines.field("time", report::seconds_text(&seconds));
    if let Some(output) = &arguments.output {
        lines.field("written", output.display());
    }
    report::print(arguments.common.json, &object, &lines)?;
    Ok(Answer::Yes)
}

/// What every spectrum is: one of which a pair is missing is an error.
const COMPLETE: &str = "proved: the inertia counts of the factorisations leave no pair out";

/// Eigenfunctions that take more memory than this are refused; a machine that has it would need weeks for them.
const LARGEST_BASIS: usize = 16 << 30;

fn check_size(arguments: &args::Spectrum, vertices: usize) -> Result<()> {
    let count = arguments.count;
    let bytes = vertices.saturating_mul(count).saturating_mul(size_of::<f64>());
    // More pairs than vertices are refused by the solver, in its own words.
    if count <= vertices && bytes > LARGEST_BASIS {
        bail!(
            "{}: {count} eigenfunctions of {} take {} GiB; ask for fewer with -k, {} at most",
            arguments.model.display(),
            report::counted(vertices, "vertex", "vertices"),
            bytes >> 30,
            LARGEST_BASIS / size_of::<f64>() / vertices
        );
    }
    Ok(())
}

/// The first eigenvalues and the last.
fn abridged(eigenvalues: &[f64]) -> String {
    const SHOWN: usize = 6;
    let text = |value: &f64| format!("{value:.6e}");
    let first: Vec<String> = eigenvalues.iter().take(SHOWN).map(text).collect();
    match eigenvalues.get(SHOWN..) {
        Some([.., last]) => format!("{} … {}", first.join(" "), text(last)),
        _ => first.join(" "),
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
    npz.doubles("residuals", &[k], spectrum.residuals().iter().copied())?;
    npz.doubles("mass", &[n], spectrum.mass().iter().copied())?;
    npz.integers("vertex", &vertex)?;
    npz.finish()
}
