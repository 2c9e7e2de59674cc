//! How d_2,50 (eq. 24) of a mark depends on the signature, the kernel, the normalisation and the mass matrix.
//!
//! ```text
//! cargo run --release -p sigmark-baselines --example shape_dna -- MODEL SIGNATURES MHB_ALPHA [ALGORITHM]
//! ```
//!
//! A line a signature and algorithm: d_rmse (eq. 21) in % of the diagonal, d_2,50 as the paper defines it, with eigenvalues multiplied by the area
//! instead, and with the lumped mass; then by how many per cent the mark changed the first eigenvalue, and d_2,50 of the spectrum in
//! which it changed nothing else. Then the least, the median, the mean and the greatest of each. ALGORITHM leaves out all others.

#![allow(clippy::print_stdout)]

use std::path::Path;

use baselines::{Algorithm, Kernel, Mhb, Rbf, Subject};
use job::Job;
use mesh::TriMesh;
use mesh_io::Asset;
use quality::{DistanceOptions, Mass, Normalisation, QualityError, ShapeDna, ShapeDnaOptions};
use rand_chacha::{
    ChaCha8Rng,
    rand_core::{Rng, SeedableRng},
};
use sigmark::mark::{PatchCount, Patches};

const BITS: usize = 324;

/// What is measured of each mark.
const COLUMNS: [&str; 6] = ["d_rmse", "d_2,50", "by area", "lumped", "λ_1", "λ_1 alone"];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (model, signatures, mhb_alpha, only) = match &arguments[..] {
        [a, b, c] => (a, b, c, None),
        [a, b, c, only] => (a, b, c, Some(only)),
        _ => return Err("usage: shape_dna MODEL SIGNATURES MHB_ALPHA [ALGORITHM]".into()),
    };
    let asset = Asset::open(Path::new(model))?;
    let mesh = asset.mesh();
    let patches = Patches::cut(mesh, 325, PatchCount::Exactly(1), &Job::new(2))?;
    let subject = Subject {
        mesh,
        patches: &patches,
        bits: BITS,
    };
    let original = Spectra::of(mesh)?;
    let runs: [(Box<dyn Algorithm>, f64); 4] = [
        (Box::new(Mhb::default()), mhb_alpha.parse()?),
        (Box::new(Rbf::default()), Rbf::PAPER_ALPHA),
        (Box::new(Rbf::with_kernel(Kernel::Cubic)), Rbf::PAPER_ALPHA),
        (Box::new(Rbf::with_kernel(Kernel::ThinPlate)), Rbf::PAPER_ALPHA),
    ];
    println!(
        "{:>18} {:>9} {}",
        "",
        "",
        COLUMNS.map(|c| format!("{c:>10}")).join("")
    );
    for (algorithm, alpha) in runs {
        if only.is_some_and(|name| *name != algorithm.name()) {
            continue;
        }
        let prepared = algorithm.prepare(&subject, &Job::default())?;
        let mut rows = Vec::new();
        for number in 0..signatures.parse::<u64>()? {
            let mut random = ChaCha8Rng::seed_from_u64(number);
            let signature: Vec<bool> = (0..BITS).map(|_| random.next_u32() & 1 == 1).collect();
            let marked = mesh.with_positions(prepared.embed(&signature, alpha, &Job::default())?)?;
            let row = original.compared(&marked, mesh)?;
            print(&algorithm.name(), &number.to_string(), row);
            rows.push(row);
        }
        for (what, of) in [
            ("least", rank as fn(&[f64], f64) -> f64),
            ("median", rank),
            ("mean", |values, _| {
                values.iter().sum::<f64>() / values.len() as f64
            }),
            ("greatest", rank),
        ] {
            let part = match what {
                "least" => 0.0,
                "median" => 0.5,
                _ => 1.0,
            };
            let column = |c: usize| {
                let mut values: Vec<f64> = rows.iter().map(|row| row[c].abs()).collect();
                values.sort_by(f64::total_cmp);
                of(&values, part)
            };
            print(&algorithm.name(), what, std::array::from_fn(column));
        }
    }
    Ok(())
}

fn rank(ascending: &[f64], part: f64) -> f64 {
    ascending[((ascending.len() - 1) as f64 * part) as usize]
}

fn print(name: &str, what: &str, row: [f64; 6]) {
    println!(
        "{name:>18} {what:>9} {}",
        row.map(|x| format!("{x:>10.4}")).join("")
    );
}

/// The Shape-DNA of a mesh with either mass matrix.
struct Spectra {
    full: ShapeDna,
    lumped: ShapeDna,
}

impl Spectra {
    fn of(mesh: &TriMesh) -> Result<Self, QualityError> {
        let with = |mass| {
            ShapeDna::of(
                mesh,
                &ShapeDnaOptions {
                    mass,
                    ..Default::default()
                },
                &Job::default(),
            )
        };
        Ok(Self {
            full: with(Mass::Full)?,
            lumped: with(Mass::Lumped)?,
        })
    }

    fn compared(&self, marked: &TriMesh, mesh: &TriMesh) -> Result<[f64; 6], QualityError> {
        let theirs = Self::of(marked)?;
        let first = Normalisation::FirstEigenvalue;
        let distance = quality::surface_distance(marked, mesh, &DistanceOptions::default(), &Job::default())?;
        let change = theirs.full.eigenvalues()[0] / self.full.eigenvalues()[0] - 1.0;
        let others = self.full.normalised(first).into_iter().skip(1);
        let alone = others
            .map(|l| (l / (1.0 + change) - l).powi(2))
            .sum::<f64>()
            .sqrt();
        Ok([
            100.0 * distance.rmse / mesh.bounding_box().diagonal(),
            theirs.full.distance(&self.full, 2.0, first)?,
            theirs.full.distance(&self.full, 2.0, Normalisation::Area)?,
            theirs.lumped.distance(&self.lumped, 2.0, first)?,
            100.0 * change,
            alone,
        ])
    }
}
