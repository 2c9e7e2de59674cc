//! Marks a mesh with each algorithm, and says what that costs and reads.
//!
//! ```text
//! cargo run --release -p sigmark-baselines --example mark -- MODEL PATCHES LBF_FUNCTIONS MHB_ALPHA THREADS [OUT_DIR]
//! ```
//!
//! `rms` is the root mean square displacement over the vertices, `normal` that of its part along vertex normals, which is d_rmse to first
//! order; both in % of the bounding box's diagonal. `noise` is the extraction rate in % after each coordinate moved by up to 0.5 % of the bounding
//! box's edge. With OUT_DIR the marked meshes are written there as PLY.

#![allow(clippy::print_stdout)]

use std::{path::Path, time::Instant};

use baselines::{Adapted, Algorithm, Lbf, Mhb, Rbf, Subject};
use job::Job;
use mesh::TriMesh;
use mesh_io::{Asset, Format, Precision, write_file, write_mesh};
use rand_chacha::{
    ChaCha8Rng,
    rand_core::{Rng, SeedableRng},
};
use sigmark::mark::{PatchCount, Patches, Registered, extraction_rate};

const BITS: usize = 324;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (model, patches, functions, mhb_alpha, threads, out) = match &arguments[..] {
        [a, b, c, d, e] => (a, b, c, d, e, None),
        [a, b, c, d, e, out] => (a, b, c, d, e, Some(out)),
        _ => return Err("usage: mark MODEL PATCHES LBF_FUNCTIONS MHB_ALPHA THREADS [OUT_DIR]".into()),
    };
    let asset = Asset::open(Path::new(model))?;
    let mesh = asset.mesh();
    let functions: usize = functions.parse()?;
    let job = &Job::new(threads.parse()?);
    let patches = Patches::cut(mesh, 325, PatchCount::Exactly(patches.parse()?), job)?;
    let subject = Subject {
        mesh,
        patches: &patches,
        bits: BITS,
    };
    // Adapted marks move the surface about as far as manifold harmonics do at the paper's α.
    let unit_alpha = mhb_alpha.parse::<f64>()? / patches[0].mesh().area().sqrt();
    let runs: Vec<(Box<dyn Algorithm>, f64)> = vec![
        (Box::new(Mhb::default()), mhb_alpha.parse()?),
        (Box::new(Rbf::default()), Rbf::PAPER_ALPHA),
        (Box::new(Adapted::radial()), unit_alpha),
        (Box::new(Adapted::laplacian()), unit_alpha),
        (Box::new(Lbf::new(functions).compensated()), Lbf::PAPER_ALPHA),
        (Box::new(Lbf::new(functions)), 0.0),
        (Box::new(Lbf::new(functions)), Lbf::PAPER_ALPHA),
    ];
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let signature: Vec<bool> = (0..BITS).map(|_| random.next_u32() & 1 == 1).collect();
    println!(
        "{:>20} {:>8} {:>8} {:>8} {:>6} {:>6} {:>8}",
        "", "alpha", "rms", "normal", "read", "noise", "seconds"
    );
    let mut prepared = None;
    for (i, (algorithm, alpha)) in runs.iter().enumerate() {
        let begun = Instant::now();
        // The last two differ by α alone.
        if i + 1 < runs.len() || prepared.is_none() {
            prepared = Some(algorithm.prepare(&subject, job)?);
        }
        let seconds = begun.elapsed().as_secs_f64();
        let Some(prepared) = prepared.as_deref() else {
            continue;
        };
        let marked = prepared.embed(&signature, *alpha, job)?;
        let (rms, normal) = displacement(mesh, &marked);
        let rate = |positions: Vec<[f64; 3]>| -> Result<f64, baselines::BaselineError> {
            let suspect = Registered::by_vertices(positions.into_iter().map(Some).collect());
            let soft = prepared.extract(&suspect, *alpha, job)?;
            Ok(100.0 * extraction_rate(&signature, &soft.hard()))
        };
        let read = rate(marked.clone())?;
        let noise = rate(noisy(mesh, &marked, 0.005))?;
        let name = algorithm.name();
        println!("{name:>20} {alpha:>8.1e} {rms:>8.4} {normal:>8.4} {read:>6.1} {noise:>6.1} {seconds:>8.1}");
        if let Some(out) = out {
            let file = format!("{i}_{}.ply", name.replace([',', ' '], ""));
            let ply = write_mesh(&mesh.with_positions(marked)?, Format::Ply, Precision::Double);
            write_file(Path::new(out).join(file), &ply, true)?;
        }
    }
    Ok(())
}

/// Root mean square of the displacement, and of its part along the normals, in % of the diagonal.
fn displacement(mesh: &TriMesh, marked: &[[f64; 3]]) -> (f64, f64) {
    let normals = mesh.vertex_normals();
    let (mut all, mut along) = (0.0, 0.0);
    for ((p, q), n) in mesh.positions().iter().zip(marked).zip(&normals) {
        let d: [f64; 3] = std::array::from_fn(|axis| q[axis] - p[axis]);
        all += d.iter().map(|x| x * x).sum::<f64>();
        along += (0..3).map(|axis| d[axis] * n[axis]).sum::<f64>().powi(2);
    }
    let percent = 100.0 / (mesh.bounding_box().diagonal() * (marked.len() as f64).sqrt());
    (percent * all.sqrt(), percent * along.sqrt())
}

/// Each coordinate moved by a uniform amount within ± `share` of the bounding box's edge along that axis.
fn noisy(mesh: &TriMesh, positions: &[[f64; 3]], share: f64) -> Vec<[f64; 3]> {
    let mut random = ChaCha8Rng::seed_from_u64(2);
    let size = mesh.bounding_box().size();
    let mut uniform = || f64::from(random.next_u32()) / f64::from(u32::MAX) * 2.0 - 1.0;
    let moved = positions
        .iter()
        .map(|p| std::array::from_fn(|axis| p[axis] + share * size[axis] * uniform()));
    moved.collect()
}
