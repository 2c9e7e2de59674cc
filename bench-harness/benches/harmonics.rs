//! Assembly of the Laplacian; the solver's steps; whole spectra: against the size of the mesh, the number of pairs, the tolerance.
#![allow(missing_docs)]

use bench_harness::surface;
use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use job::Job;
use mhb_core::bench::{Factorised, Ordered, rayleigh_ritz};
use mhb_core::{Laplacian, Spectrum, SpectrumOptions};

fn assembly(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("assembly");
    for vertices in [10_000, 40_000] {
        let mesh = surface(vertices);
        group.bench_function(BenchmarkId::from_parameter(mesh.vertex_count()), |bencher| {
            bencher.iter(|| Laplacian::cotangent(&mesh));
        });
    }
    group.finish();
}

/// What a band of the spectrum is made of: a factorisation, solves by blocks, and Rayleigh–Ritz in a Krylov space.
fn steps(criterion: &mut Criterion) {
    /// Columns of a band's Krylov space, and pairs that come out of it.
    const SPACE: usize = 232;
    const PAIRS: usize = 84;
    let mut group = criterion.benchmark_group("steps");
    group.sample_size(10);
    for vertices in [10_000, 40_000] {
        let laplacian = Laplacian::cotangent(&surface(vertices)).expect("the surface has an area");
        let rows = laplacian.mass().len();
        group.bench_function(BenchmarkId::new("ordering", rows), |bencher| {
            bencher.iter(|| Ordered::new(&laplacian));
        });
        let ordered = Ordered::new(&laplacian).expect("the surface is connected");
        // Among the eigenvalues of a surface of unit area, which are about 4π k.
        let shift = 1000.0;
        group.bench_function(BenchmarkId::new("factorisation", rows), |bencher| {
            bencher.iter(|| ordered.factorise(shift));
        });
        let factor = ordered.factorise(shift).expect("the shift is no eigenvalue");
        let mut block: Vec<f64> = (0..rows * Factorised::LANES).map(wave).collect();
        let name = format!("solve of {}", Factorised::LANES);
        group.bench_function(BenchmarkId::new(name, rows), |bencher| {
            bencher.iter(|| {
                factor.solve(&mut block);
                let scale = block.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
                block.iter_mut().for_each(|x| *x /= scale);
            });
        });
        let basis: Vec<f64> = (0..rows * SPACE).map(wave).collect();
        group.bench_function(BenchmarkId::new("Rayleigh-Ritz", rows), |bencher| {
            bencher.iter(|| rayleigh_ritz(rows, &basis, &basis, PAIRS));
        });
    }
    group.finish();
}

/// Numbers of about 1 without a pattern that matters here.
fn wave(i: usize) -> f64 {
    (i as f64 * 0.7).sin()
}

fn spectrum(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("spectrum");
    group.sample_size(10);
    for (vertices, count, tolerance) in [
        (2_500, 100, 1e-8),
        (10_000, 100, 1e-8),
        (40_000, 100, 1e-8),
        (10_000, 325, 1e-6),
        (10_000, 325, 1e-8),
        (10_000, 325, 1e-10),
    ] {
        let laplacian = Laplacian::cotangent(&surface(vertices)).expect("the surface has an area");
        let options = SpectrumOptions {
            count,
            tolerance,
            ..Default::default()
        };
        let name = format!(
            "{} vertices, {count} pairs, {tolerance:e}",
            laplacian.mass().len()
        );
        group.bench_function(name, |bencher| {
            bencher.iter(|| Spectrum::of_laplacian(&laplacian, &options, &Job::default()));
        });
    }
    group.finish();
}

/// Positions to coefficients and back (eqs. 6 to 8).
fn transform(criterion: &mut Criterion) {
    let mesh = surface(10_000);
    let options = SpectrumOptions {
        count: 325,
        tolerance: 1e-6,
        ..Default::default()
    };
    let spectrum = Spectrum::compute(&mesh, &options, &Job::default()).expect("the surface has a spectrum");
    let coefficients = spectrum.transform_positions(mesh.positions());
    let mut group = criterion.benchmark_group("transform");
    group.bench_function("forward", |bencher| {
        bencher.iter(|| spectrum.transform_positions(mesh.positions()));
    });
    group.bench_function("inverse", |bencher| {
        bencher.iter(|| spectrum.inverse_transform_positions(&coefficients));
    });
    group.finish();
}

criterion_group!(benches, assembly, steps, spectrum, transform);
criterion_main!(benches);
