//! One model and one algorithm: its strength, its marks, and what is left of them after each attack.

use std::{borrow::Cow, fs, path::Path, sync::OnceLock, time::Instant};

use anyhow::{Context, Result, bail, ensure};
use baselines::{Algorithm, Prepared, Reference, Subject};
use job::Job;
use mesh::{Similarity, TriMesh, shapes};
use mesh_io::{Asset, Format, Precision, write_mesh};
use quality::{
    DistanceOptions, Measurement, Metric, Msdm2Metric, ShapeDna, ShapeDnaMetric,
    picture::{Paint, Picture, linear},
    surface_distance, vertex_distances,
};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use sigmark::{
    PatchCount, PublicKey, Scheme, Signature,
    mark::{Patches, extraction_rate},
};

use crate::{meshes::random_similarity, python::Python};
use crate::{
    models::Standin,
    paper::Attack,
    reading::{Finder, Found},
    store::{Store, digest},
};

/// The paper's extraction, by its name.
pub(crate) const PAPER_DETECTOR: &str = "paper";

/// l: the paper's signatures.
pub(crate) const SCHEME: Scheme = Scheme::EcdsaB163Sha1;

/// A message and its signature, whose bits are the mark.
pub(crate) struct Signed {
    /// From 0; also the seed of attacks.
    pub(crate) number: usize,
    pub(crate) message: String,
    pub(crate) signature: Signature,
}

/// How far d_rmse may be from the printed one, as a share of it. Signatures differ, so the bound on each mark is wider.
const NEAR_ENOUGH: f64 = 0.08;

/// MSDM2 takes a minute and a half of a million vertices, and there are dozens of marks; the paper has none of it.
const MOST_FOR_MSDM2: usize = 200_000;

/// What a study works with.
pub(crate) struct Bench<'a> {
    pub(crate) python: &'a Python,
    pub(crate) store: &'a Store,
    /// For files that are soon deleted.
    pub(crate) work: &'a Path,
    pub(crate) signatures: &'a [Signed],
    pub(crate) public_key: PublicKey,
    pub(crate) threads: usize,
}

/// A model and its patches: what all algorithms share.
pub(crate) struct Scene<'a> {
    pub(crate) bench: &'a Bench<'a>,
    pub(crate) standin: &'a Standin,
    pub(crate) patches: Patches,
    shape_dna: OnceLock<ShapeDnaMetric>,
}

/// α, and whether the mark then has the distortion that was asked for.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(crate) struct Strength {
    pub(crate) alpha: f64,
    /// Whether α is the one that the paper gives.
    pub(crate) printed: bool,
    /// False where even α = 0 distorts more: then α is the paper's.
    pub(crate) reached: bool,
}

/// The time for everything that does not depend on the signature.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(crate) struct Preparation {
    pub(crate) patches: usize,
    pub(crate) functions: usize,
    pub(crate) seconds: f64,
    pub(crate) threads: usize,
}

/// A marked mesh beside its original.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(crate) struct Mark {
    pub(crate) alpha: f64,
    /// Per cent of the original's diagonal (eq. 21).
    pub(crate) d_rmse: f64,
    /// The greatest distance from the marked surface to the original's, in per cent of the diagonal.
    pub(crate) hausdorff: f64,
    /// Eq. 24.
    pub(crate) d_2_50: f64,
    /// None of meshes with more than [`MOST_FOR_MSDM2`] vertices, nor of other signatures than the first.
    pub(crate) msdm2: Option<f64>,
    /// What it took to make it.
    pub(crate) seconds: f64,
    /// What it took to compute these metrics.
    pub(crate) measuring_seconds: f64,
}

/// What one attack left of one mark.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Cell {
    /// What the attack reported of itself.
    pub(crate) attack: Value,
    pub(crate) vertices: usize,
    pub(crate) aligned: bool,
    /// What the alignment rests on.
    pub(crate) basis: String,
    pub(crate) overlap: f64,
    /// The share of the reference's vertices that were not seen.
    pub(crate) missing: f64,
    /// One a detector, the paper's first.
    pub(crate) readings: Vec<Rated>,
    pub(crate) attack_seconds: f64,
    /// The reference's search structures, which the cells of a mesh share.
    pub(crate) reference_seconds: f64,
    pub(crate) registration_seconds: f64,
    /// Sampling and reading, all detectors together.
    pub(crate) reading_seconds: f64,
}

/// What a detector read, judged.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Rated {
    pub(crate) detector: String,
    /// Eq. 18, from 0 to 1.
    pub(crate) rate: f64,
    /// With the true transform in place of the one found; none where it is not known, or where the paper's detector read all bits.
    pub(crate) rate_in_true_pose: Option<f64>,
    /// Agreement with the signatures that are not in the mesh, by their numbers' order.
    pub(crate) strangers: Vec<f64>,
    /// Whether the bits are a signature of the message (eqs. 19, 20).
    pub(crate) verified: bool,
}

/// What is attacked.
#[derive(Clone, Copy)]
pub(crate) enum Target {
    /// The mesh with the signature of this number.
    Marked(usize),
    /// The original. It is read as if it had the first signature.
    Unmarked,
}

impl Target {
    /// The signature that it is read for.
    fn number(self) -> usize {
        match self {
            Self::Marked(number) => number,
            Self::Unmarked => 0,
        }
    }
}

/// An attacked mesh, moved.
struct Suspect {
    mesh: TriMesh,
    /// What moved it, where the attack did not.
    pose: Option<Similarity>,
    /// What the attack said of itself.
    report: Value,
    /// What it took.
    seconds: f64,
}

/// One algorithm on one scene. What costs much is computed when it is first needed.
pub(crate) struct Study<'a> {
    pub(crate) scene: &'a Scene<'a>,
    pub(crate) algorithm: &'a dyn Algorithm,
    /// d_rmse, in per cent.
    pub(crate) distortion: f64,
    prepared: OnceLock<Box<dyn Prepared>>,
}

impl<'a> Study<'a> {
    pub(crate) fn new(scene: &'a Scene<'a>, algorithm: &'a dyn Algorithm, distortion: f64) -> Self {
        Self {
            scene,
            algorithm,
            distortion,
            prepared: OnceLock::new(),
        }
    }

    /// What everything here depends on.
    fn inputs(&self) -> Value {
        json!({
            "mesh": self.scene.standin.digest,
            "patches": self.scene.patches.len(),
            "algorithm": format!("{:?}", self.algorithm),
            "scheme": SCHEME,
        })
    }

    fn with(&self, more: Value) -> Value {
        let mut inputs = self.inputs();
        if let (Some(all), Value::Object(more)) = (inputs.as_object_mut(), more) {
            all.extend(more);
        }
        inputs
    }

    fn bench(&self) -> &Bench<'a> {
        self.scene.bench
    }

    fn original(&self) -> &TriMesh {
        &self.scene.standin.mesh
    }

    fn bits(&self, signature: usize) -> Vec<bool> {
        self.bench().signatures[signature].signature.bits()
    }

    fn prepared(&self) -> Result<&dyn Prepared> {
        if self.prepared.get().is_none() {
            let begun = Instant::now();
            let subject = Subject {
                mesh: self.original(),
                patches: &self.scene.patches,
                bits: SCHEME.bits(),
            };
            let prepared = self.algorithm.prepare(&subject, &self.job())?;
            let preparation = Preparation {
                patches: prepared.patches(),
                functions: prepared.functions(),
                seconds: begun.elapsed().as_secs_f64(),
                threads: self.bench().threads,
            };
            self.bench()
                .store
                .put("preparation", &self.inputs(), &preparation)?;
            let _ = self.prepared.set(prepared);
        }
        let prepared = self.prepared.get().context("it was just prepared")?;
        Ok(prepared.as_ref())
    }

    /// Computes what does not depend on the signature, if it is not there yet.
    pub(crate) fn prepare(&self) -> Result<()> {
        self.prepared().map(drop)
    }

    fn job(&self) -> Job {
        Job::new(self.bench().threads)
    }

    pub(crate) fn preparation(&self) -> Result<Preparation> {
        if let Some(kept) = self.bench().store.get("preparation", &self.inputs()) {
            return Ok(kept);
        }
        self.prepared()?;
        let kept = self.bench().store.get("preparation", &self.inputs());
        kept.context("the times of preparation were not kept")
    }

    fn positions(&self, signature: usize, alpha: f64) -> Result<Vec<[f64; 3]>> {
        Ok(self
            .prepared()?
            .embed(&self.bits(signature), alpha, &self.job())?)
    }

    /// The mesh with a signature.
    pub(crate) fn marked(&self, signature: usize, alpha: f64) -> Result<TriMesh> {
        Ok(self
            .original()
            .with_positions(self.positions(signature, alpha)?)?)
    }

    fn d_rmse(&self, marked: &TriMesh) -> Result<(f64, f64)> {
        let distance = surface_distance(marked, self.original(), &DistanceOptions::default(), &self.job())?;
        let per_cent = 100.0 / self.original().bounding_box().diagonal();
        Ok((per_cent * distance.rmse, per_cent * distance.maximum))
    }

    fn measured(&self, metric: &dyn Metric, marked: &TriMesh) -> Result<Measurement> {
        Ok(metric.measure(self.original(), marked, &self.job())?)
    }

    /// α for the distortion that the study has, in the mean over the signatures.
    pub(crate) fn strength(&self) -> Result<Strength> {
        let inputs = self.with(json!({"distortion": self.distortion}));
        if let Some(kept) = self.bench().store.get("strength", &inputs) {
            return Ok(kept);
        }
        let strength = self.calibrated()?;
        self.bench().store.put("strength", &inputs, &strength)?;
        Ok(strength)
    }

    /// The paper's α where it has no unit and distorts as much as in the paper; else the one that does.
    fn calibrated(&self) -> Result<Strength> {
        let base = self.positions(0, 0.0)?;
        let sizes = self.sizes(&base)?;
        // The mean beside the first, which is the one that is measured.
        let mean = sizes.iter().sum::<f64>() / (sizes.len() as f64 * sizes[0]);
        if let Some(alpha) = self.algorithm.paper_alpha() {
            let (found, _) = self.d_rmse(&self.marked(0, alpha)?)?;
            if (found * mean / self.distortion - 1.0).abs() < NEAR_ENOUGH {
                return Ok(Strength {
                    alpha,
                    printed: true,
                    reached: true,
                });
            }
        }
        let mut strength = self.fitted(base, sizes[0])?;
        if strength.reached {
            strength.alpha /= mean;
        }
        Ok(strength)
    }

    /// How far each signature moves vertices at α = 1, root mean square.
    fn sizes(&self, base: &[[f64; 3]]) -> Result<Vec<f64>> {
        let size = |signature: usize| {
            let unit = self.positions(signature, 1.0)?;
            let pairs = base.iter().zip(&unit);
            let squares = pairs.map(|(p, q)| (0..3).map(|i| (p[i] - q[i]).powi(2)).sum::<f64>());
            let size = (squares.sum::<f64>() / base.len() as f64).sqrt();
            ensure!(size > 0.0, "{}: a mark has no size", self.algorithm.name());
            Ok(size)
        };
        (0..self.bench().signatures.len()).map(size).collect()
    }

    /// α for the first signature. The mark is affine in α, so d² is t² + (k α)² to first order, t being the distortion at α = 0.
    fn fitted(&self, base: Vec<[f64; 3]>, per_alpha: f64) -> Result<Strength> {
        let least = if base == self.original().positions() {
            0.0
        } else {
            self.d_rmse(&self.original().with_positions(base)?)?.0
        };
        let Some(room) = Some(self.distortion.powi(2) - least.powi(2)).filter(|room| *room > 0.0) else {
            let name = self.algorithm.name();
            let alpha = self.algorithm.paper_alpha();
            let alpha = alpha.with_context(|| {
                format!("{name} distorts by {least:.4} % unmarked, and there is no other strength to take")
            })?;
            return Ok(Strength {
                alpha,
                printed: true,
                reached: false,
            });
        };
        // A third of a displacement's square is along the normal.
        let mut alpha =
            3f64.sqrt() * room.sqrt() / 100.0 * self.original().bounding_box().diagonal() / per_alpha;
        for _ in 0..5 {
            let (found, _) = self.d_rmse(&self.marked(0, alpha)?)?;
            if (found / self.distortion - 1.0).abs() < 0.01 {
                break;
            }
            let marked = found.powi(2) - least.powi(2);
            ensure!(
                marked > 0.0,
                "{}: a stronger mark distorts no more",
                self.algorithm.name()
            );
            alpha *= (room / marked).sqrt();
        }
        Ok(Strength {
            alpha,
            printed: false,
            reached: true,
        })
    }

    /// A mark's distortion.
    pub(crate) fn mark(&self, signature: usize, alpha: f64) -> Result<Mark> {
        let inputs = self.with(
            json!({"alpha": alpha, "signature": self.bench().signatures[signature].signature.to_hex()}),
        );
        if let Some(kept) = self.bench().store.get("mark", &inputs) {
            return Ok(kept);
        }
        self.prepared()?;
        let begun = Instant::now();
        let marked = self.marked(signature, alpha)?;
        let seconds = begun.elapsed().as_secs_f64();
        let begun = Instant::now();
        let (d_rmse, hausdorff) = self.d_rmse(&marked)?;
        let msdm2 = (signature == 0 && marked.vertex_count() <= MOST_FOR_MSDM2)
            .then(|| self.measured(&Msdm2Metric, &marked))
            .transpose()?;
        let mark = Mark {
            alpha,
            d_rmse,
            hausdorff,
            d_2_50: self
                .measured(self.scene.shape_dna()?, &marked)?
                .number("distance"),
            msdm2: msdm2.map(|found| found.number("symmetric")),
            seconds,
            measuring_seconds: begun.elapsed().as_secs_f64(),
        };
        self.bench().store.put("mark", &inputs, &mark)?;
        Ok(mark)
    }

    /// What a cell depends on.
    fn cell_inputs(&self, target: Target, alpha: f64, attack: &Attack) -> Value {
        let hex = |number: usize| self.bench().signatures[number].signature.to_hex();
        let target = match target {
            Target::Marked(number) => json!({"alpha": alpha, "signature": hex(number), "seed": number}),
            Target::Unmarked => json!({"alpha": alpha, "unmarked": hex(0)}),
        };
        let strangers: Vec<String> = (0..self.bench().signatures.len()).map(hex).collect();
        let mut inputs = self.with(target);
        inputs["attack"] = json!(attack.spec);
        inputs["signatures"] = json!(digest(strangers.concat().as_bytes()));
        inputs
    }

    /// A finished cell, if it was finished before.
    pub(crate) fn kept(&self, target: Target, alpha: f64, attack: &Attack) -> Option<Cell> {
        self.bench()
            .store
            .get("cell", &self.cell_inputs(target, alpha, attack))
    }

    /// The picture of a finished cell's suspect, as PNG.
    pub(crate) fn picture(&self, target: Target, alpha: f64, attack: &Attack) -> Option<Vec<u8>> {
        let inputs = self.cell_inputs(target, alpha, attack);
        self.bench().store.bytes("cell", &inputs, "png")
    }

    /// How far each vertex of a marked mesh lies from the original's surface, #V, in the mesh's unit.
    pub(crate) fn distances(&self, signature: usize, alpha: f64) -> Result<Vec<f64>> {
        let inputs = self.with(
            json!({"alpha": alpha, "signature": self.bench().signatures[signature].signature.to_hex()}),
        );
        let store = self.bench().store;
        if let Some(kept) = store.bytes("distances", &inputs, "f32") {
            let numbers = kept.as_chunks::<4>().0.iter();
            return Ok(numbers
                .map(|&octets| f64::from(f32::from_le_bytes(octets)))
                .collect());
        }
        let distances = vertex_distances(&self.marked(signature, alpha)?, self.original(), &self.job())?;
        let octets: Vec<u8> = distances.iter().flat_map(|&d| (d as f32).to_le_bytes()).collect();
        store.put_bytes("distances", &inputs, "f32", &octets)?;
        Ok(distances)
    }

    /// Writes what is attacked to a file.
    pub(crate) fn write(&self, target: Target, alpha: f64, file: &Path) -> Result<()> {
        let mesh = match target {
            Target::Marked(number) => &self.marked(number, alpha)?,
            Target::Unmarked => self.original(),
        };
        let bytes = write_mesh(mesh, Format::Ply, Precision::Double);
        fs::write(file, bytes).with_context(|| file.display().to_string())
    }

    /// What suspects are brought onto. An unmarked mesh is read as if it had the first signature.
    pub(crate) fn reference(&self, target: Target, alpha: f64) -> Result<Cow<'a, TriMesh>> {
        Ok(match self.algorithm.reference() {
            Reference::Original => Cow::Borrowed(&self.scene.standin.mesh),
            Reference::Marked => Cow::Owned(self.marked(target.number(), alpha)?),
        })
    }

    /// Attacks a file, moves it to where nobody knows, finds it again and reads it. `size` is that of a picture, if one is wanted.
    pub(crate) fn cell(
        &self,
        target: Target,
        alpha: f64,
        attack: &Attack,
        finder: &Finder,
        file: &Path,
        size: Option<usize>,
    ) -> Result<Cell> {
        let inputs = self.cell_inputs(target, alpha, attack);
        let number = target.number();
        let seed = self.bench().signatures[number].number as u64 + 1;
        let begun = Instant::now();
        let (mesh, report) = self.attacked(file, attack, seed, &inputs)?;
        let seconds = begun.elapsed().as_secs_f64();
        if let Some(size) = size {
            let paint = vec![linear(SURFACE); mesh.triangle_count()];
            let picture = Picture::of(&mesh, Paint::Triangles(&paint), self.scene.standin.view, size);
            let store = self.bench().store;
            store.put_bytes("cell", &inputs, "png", &picture.to_png()?)?;
        }
        let pose = random_similarity(self.original(), seed);
        let suspect = Suspect {
            mesh: shapes::moved(&mesh, &pose),
            // Where the attack is itself a motion, nobody knows the true transform.
            pose: (!attack.spec.starts_with("similarity")).then_some(pose),
            report,
            seconds,
        };
        let cell = self.judged(number, alpha, finder, suspect)?;
        self.bench().store.put("cell", &inputs, &cell)?;
        Ok(cell)
    }

    /// Finds a suspect and reads it, as if it had the signature of this number.
    fn judged(&self, number: usize, alpha: f64, finder: &Finder, suspect: Suspect) -> Result<Cell> {
        let prepared = self.prepared()?;
        let found = finder.find(&suspect.mesh)?;
        let reading = found.read(prepared, alpha, &found.alignment.transform)?;
        // The true pose explains what was lost.
        let expected = self.bits(number);
        let all = reading.readings[0].1.hard() == expected;
        let in_true_pose = suspect
            .pose
            .filter(|_| !all)
            .map(|pose| found.read(prepared, alpha, &pose.inverse()))
            .transpose()?;
        let rated = reading.readings.iter().enumerate().map(|(i, (detector, bits))| {
            let true_bits = in_true_pose.as_ref().map(|read| read.readings[i].1.hard());
            self.rated(number, &detector.name(), &bits.hard(), true_bits.as_deref())
        });
        Ok(Cell {
            readings: rated.collect::<Result<_>>()?,
            attack: suspect.report,
            vertices: suspect.mesh.vertex_count(),
            aligned: found.alignment.aligned,
            basis: basis_name(&found),
            overlap: found.alignment.overlap,
            missing: reading.missing,
            attack_seconds: suspect.seconds,
            reference_seconds: finder.seconds,
            registration_seconds: found.seconds,
            reading_seconds: reading.seconds,
        })
    }

    /// The attacked mesh, and what `attack.py` says of it. The file goes again.
    fn attacked(&self, file: &Path, attack: &Attack, seed: u64, inputs: &Value) -> Result<(TriMesh, Value)> {
        let name = digest(inputs.to_string().as_bytes());
        let result = self.bench().work.join(format!("{name}.ply"));
        let seed = seed.to_string();
        let words = [
            file.as_os_str(),
            result.as_os_str(),
            attack.spec.as_ref(),
            "--seed".as_ref(),
            seed.as_ref(),
        ];
        let said = self.bench().python.run("attack.py", words)?;
        let report = serde_json::from_str(&said).with_context(|| format!("attack.py said {said:?}"))?;
        let suspect = Asset::open(&result).map(|asset| asset.mesh().clone());
        let _ = fs::remove_file(&result);
        Ok((suspect?, report))
    }

    fn rated(
        &self,
        number: usize,
        detector: &str,
        bits: &[bool],
        in_true_pose: Option<&[bool]>,
    ) -> Result<Rated> {
        let signed = &self.bench().signatures[number];
        let expected = signed.signature.bits();
        if bits.len() != expected.len() {
            bail!("{} read {} bits of {}", detector, bits.len(), expected.len());
        }
        let others = self
            .bench()
            .signatures
            .iter()
            .filter(|other| other.number != signed.number);
        let read = Signature::from_bits(SCHEME, bits)?;
        Ok(Rated {
            detector: detector.into(),
            rate: extraction_rate(&expected, bits),
            rate_in_true_pose: in_true_pose.map(|bits| extraction_rate(&expected, bits)),
            strangers: others
                .map(|other| extraction_rate(&other.signature.bits(), bits))
                .collect(),
            verified: self
                .bench()
                .public_key
                .verify(signed.message.as_bytes(), &read)
                .is_ok(),
        })
    }
}

/// sRGB, of meshes in pictures.
const SURFACE: u32 = 0x8fb0cf;

fn basis_name(found: &Found) -> String {
    serde_json::to_value(found.alignment.matched_by)
        .ok()
        .and_then(|name| name.as_str().map(String::from))
        .unwrap_or_default()
}

impl<'a> Scene<'a> {
    pub(crate) fn new(bench: &'a Bench<'a>, standin: &'a Standin) -> Result<Self> {
        // Patches must have room for the harmonics of three chips a bit.
        let functions = SCHEME.bits() + 1;
        let count = PatchCount::Exactly(standin.model.patches);
        Ok(Self {
            bench,
            standin,
            patches: Patches::cut(&standin.mesh, functions, count, &Job::new(bench.threads))?,
            shape_dna: OnceLock::new(),
        })
    }

    /// d_2,50 from the original, whose eigenvalues are computed once for all marks.
    fn shape_dna(&self) -> Result<&ShapeDnaMetric> {
        if self.shape_dna.get().is_none() {
            let mut metric = ShapeDnaMetric::default();
            metric.reference = Some(ShapeDna::of(
                &self.standin.mesh,
                &metric.options,
                &Job::default(),
            )?);
            let _ = self.shape_dna.set(metric);
        }
        self.shape_dna.get().context("it was just computed")
    }
}
