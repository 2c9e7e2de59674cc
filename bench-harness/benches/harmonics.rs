//! Assembly of the Laplacian, and whole spectra: against the size of the mesh, the number of pairs, the tolerance.
#![allow(missing_docs)]

use bench_harness::surface;
use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
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
            bencher.iter(|| Spectrum::of_laplacian(&laplacian, &options));
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
    let spectrum = Spectrum::compute(&mesh, &options).expect("the surface has a spectrum");
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

criterion_group!(benches, assembly, spectrum, transform);
criterion_main!(benches);
