//! The promise of the README, tried on real files: sign, and find again after everything that keeps the connectivity; and what is read of today's layout and of the paper's
//! after a few attacks.

use std::{path::Path, time::Instant};

use anyhow::{Context, Result, ensure};
use job::Job;
use mesh::{TriMesh, shapes};
use mesh_io::{Asset, Format, Precision, write_mesh};
use rand_chacha::{ChaCha20Rng, rand_core::SeedableRng};
use sigmark::{Curve, Embedder, Outcome, Signed, SigningKey, Verdict, Verifier};

use crate::{attacks::random_similarity, beside_paper::compared, inputs::mesh_files_below};

/// Signs every mesh file below a folder, says what was not as it should be, and holds today's layout beside the paper's. Larger meshes are passed over.
pub fn run(folder: &Path, most_vertices: usize) -> Result<()> {
    let mut previous: Option<TriMesh> = None;
    check_files(folder, |asset| {
        ensure!(asset.mesh().vertex_count() <= most_vertices, "passed over");
        let checked = check(asset, previous.as_ref());
        previous = Some(asset.mesh().clone());
        checked
    })
}

/// What is said of a mesh file.
#[derive(Default)]
pub(crate) struct Checked {
    /// What it is.
    pub(crate) what: String,
    /// What was not as it should be.
    pub(crate) failed: Vec<String>,
    /// What stands in the lines below.
    pub(crate) below: String,
}

/// Checks every mesh file below a folder, and says of each in words what it is and what was not as it should be; or why it was not
/// checked. Fails if anything was not as it should be.
pub(crate) fn check_files(folder: &Path, mut check: impl FnMut(&Asset) -> Result<Checked>) -> Result<()> {
    let mut failures = 0;
    for path in mesh_files_below(folder)? {
        let Ok(asset) = Asset::open(&path) else { continue };
        let begun = Instant::now();
        let mut below = String::new();
        let said = match check(&asset) {
            Ok(Checked {
                what,
                failed,
                below: table,
            }) => {
                below = table;
                failures += failed.len();
                let verdict = match failed.is_empty() {
                    true => "all as it should be".into(),
                    false => failed.join("; "),
                };
                format!("{what}{verdict} ({:.1} s)", begun.elapsed().as_secs_f64())
            }
            Err(refused) => format!("{refused:#}"),
        };
        let name = path.strip_prefix(folder).unwrap_or(&path).display();
        println!("{name}: {} vertices, {said}", asset.mesh().vertex_count());
        print!("{below}");
    }
    ensure!(failures == 0, "{failures} checks failed");
    Ok(())
}

/// Signs the file's mesh and tries every suspect; answers with what was not as it should be. Fails if it can't be signed.
fn check(asset: &Asset, other_model: Option<&TriMesh>) -> Result<Checked> {
    let job = Job::new(std::thread::available_parallelism().map_or(1, usize::from));
    let keys = [1, 2].map(|seed| SigningKey::generate(Curve::P256, &mut ChaCha20Rng::seed_from_u64(seed)));
    let embedders = keys.each_ref().map(|key| Embedder::new(key).message("checked"));
    let signed = embedders[0].embed(asset.mesh(), &job).context("not signed")?;
    let checked = check_signed(asset, &signed, &embedders[1], other_model, &job);
    Ok(checked.unwrap_or_else(|error| Checked {
        failed: vec![format!("{error:#}")],
        ..Checked::default()
    }))
}

/// Tries every suspect of a signed mesh, and strangers, among them the same mesh signed by another.
fn check_signed(
    asset: &Asset,
    signed: &Signed,
    other: &Embedder,
    other_model: Option<&TriMesh>,
    job: &Job,
) -> Result<Checked> {
    let original = asset.mesh();
    if signed.original().basis_bytes() < 1 << 30 {
        signed.original().keep_bases(job)?;
    }
    let foreign = other.embed_in(signed.original(), job)?;
    // As the file holds it: rounded to its precision.
    let marked = asset.with_positions(signed.positions())?.mesh().clone();
    let foreign = asset.with_positions(foreign.positions())?.mesh().clone();

    let certificate = signed.certificate();
    let verifier = Verifier::with_original(signed.original(), certificate, certificate.public_key())?;
    let moved = shapes::moved(&marked, &random_similarity(original, 7));
    let suspects = [
        ("untouched", marked.clone()),
        ("moved, turned and scaled", moved.clone()),
        ("shuffled", shapes::shuffled(&marked, 3)),
        ("moved and shuffled", shapes::shuffled(&moved, 4)),
        ("as OBJ in single precision", converted(&marked, Format::Obj)?),
        ("as STL", converted(&marked, Format::Stl)?),
        ("as OFF", converted(&marked, Format::Off)?),
    ];
    let mut failed = Vec::new();
    for (name, suspect) in suspects {
        let verdict = verifier.verify(&suspect, job)?;
        if verdict.outcome != Outcome::Verified {
            failed.push(format!("{name}: {}", shown(&verdict)));
        }
    }
    let strangers = [
        ("unmarked", Some(original)),
        ("marked by another key", Some(&foreign)),
        ("another model", other_model),
    ];
    for (name, suspect) in strangers {
        let Some(suspect) = suspect else { continue };
        let verdict = verifier.verify(suspect, job)?;
        if !matches!(verdict.outcome, Outcome::NotFound { .. }) {
            failed.push(format!("{name}: {}", shown(&verdict)));
        }
    }
    Ok(Checked {
        what: String::new(),
        failed,
        below: compared(signed, job)?,
    })
}

fn shown(verdict: &Verdict) -> String {
    let remark = verdict.mismatch.map_or(String::new(), |why| format!(", {why:?}"));
    format!("{:?}, ER {:?}{remark}", verdict.outcome, verdict.extraction_rate)
}

fn converted(mesh: &TriMesh, format: Format) -> Result<TriMesh> {
    let asset = Asset::from_bytes(write_mesh(mesh, format, Precision::Single), format)?;
    Ok(asset.mesh().clone())
}
