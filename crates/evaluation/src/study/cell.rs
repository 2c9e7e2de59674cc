//! One cell of the tables: a mesh is attacked, moved to where nobody knows, found again, read, and what was read is judged.

use std::{borrow::Cow, fs, path::Path, time::Instant};

use anyhow::{Context, Result, ensure};
use baselines::Reference;
use mesh::{Similarity, TriMesh, shapes};
use mesh_io::{Asset, Format, Precision, write_mesh};
use quality::picture::{Paint, Picture, linear};
use registration::MatchedBy;
use serde_json::{Value, json};
use sigmark::{Signature, mark::extraction_rate};

use super::{Cell, Rated, SCHEME, Study, Target};
use crate::{
    attacks::{Attack, random_similarity},
    reading::{Finder, Reading},
    sources::digest,
};

/// sRGB, of meshes in pictures.
const SURFACE: u32 = 0x8fb0cf;

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

impl<'a> Study<'a> {
    /// What a cell depends on.
    fn cell_inputs(&self, target: Target, alpha: f64, attack: &Attack) -> Value {
        let hex = |number: usize| self.signature(number).to_hex();
        let target = match target {
            Target::Marked(number) => json!({"alpha": alpha, "signature": hex(number), "seed": number}),
            Target::Unmarked => json!({"alpha": alpha, "unmarked": hex(0)}),
        };
        let strangers: String = self.setup().strangers.iter().map(Signature::to_hex).collect();
        let mut inputs = self.inputs(target);
        inputs["attack"] = json!(attack.spec);
        inputs["strangers"] = json!(digest(strangers.as_bytes()));
        inputs
    }

    /// A finished cell, if it was finished before.
    pub(crate) fn kept(&self, target: Target, alpha: f64, attack: &Attack) -> Option<Cell> {
        self.store().get("cell", &self.cell_inputs(target, alpha, attack))
    }

    /// The picture of a finished cell's suspect, as PNG.
    pub(crate) fn picture(&self, target: Target, alpha: f64, attack: &Attack) -> Option<Vec<u8>> {
        let inputs = self.cell_inputs(target, alpha, attack);
        self.store().bytes("cell", &inputs, "png")
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

    /// Attacks a file, moves it, finds it again and reads it. `size` is that of a picture, if one is wanted.
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
        let seed = self.setup().signatures[number].number as u64 + 1;
        let begun = Instant::now();
        let (mesh, report) = self.attacked(file, attack, seed, &inputs)?;
        let seconds = begun.elapsed().as_secs_f64();
        if let Some(size) = size {
            let paint = vec![linear(SURFACE); mesh.triangle_count()];
            let picture = Picture::of(&mesh, Paint::Triangles(&paint), self.scene.standin.view, size);
            self.store()
                .put_bytes("cell", &inputs, "png", &picture.to_png()?)?;
        }
        let pose = random_similarity(self.original(), seed);
        let suspect = Suspect {
            mesh: shapes::moved(&mesh, &pose),
            pose: (!attack.moves()).then_some(pose),
            report,
            seconds,
        };
        let cell = self.read(number, alpha, finder, suspect)?;
        self.store().put("cell", &inputs, &cell)?;
        Ok(cell)
    }

    /// The attacked mesh, and what `attack.py` says of it. The file goes again.
    fn attacked(&self, file: &Path, attack: &Attack, seed: u64, inputs: &Value) -> Result<(TriMesh, Value)> {
        let name = digest(inputs.to_string().as_bytes());
        let result = self.setup().work.join(format!("{name}.ply"));
        let seed = seed.to_string();
        let words = [
            file.as_os_str(),
            result.as_os_str(),
            attack.spec.as_ref(),
            "--seed".as_ref(),
            seed.as_ref(),
        ];
        let said = self.setup().python.run("attack.py", words)?;
        let report = serde_json::from_str(&said).with_context(|| format!("attack.py said {said:?}"))?;
        let suspect = Asset::open(&result).map(|asset| asset.mesh().clone());
        let _ = fs::remove_file(&result);
        Ok((suspect?, report))
    }

    /// Finds a suspect and reads it, as if it had the signature of this number.
    fn read(&self, number: usize, alpha: f64, finder: &Finder, suspect: Suspect) -> Result<Cell> {
        let prepared = self.prepare()?;
        let found = finder.find(&suspect.mesh)?;
        let expected = self.signature(number).bits();
        let read = found.read(prepared, alpha, &expected)?;
        // The true pose explains what was lost.
        let all = read.readings[0].bits == expected;
        let in_true_pose = suspect
            .pose
            .filter(|_| !all)
            .map(|pose| found.read_in(&pose.inverse(), prepared, alpha))
            .transpose()?;
        let rated = read.readings.iter().enumerate().map(|(i, reading)| {
            let in_true_pose = in_true_pose.as_ref().map(|bits| bits[i].as_slice());
            self.rated(number, reading, in_true_pose)
        });
        Ok(Cell {
            readings: rated.collect::<Result<_>>()?,
            attack: suspect.report,
            vertices: suspect.mesh.vertex_count(),
            aligned: found.alignment.aligned,
            basis: name(found.alignment.matched_by),
            overlap: found.alignment.overlap,
            missing: read.missing,
            attack_seconds: suspect.seconds,
            reference_seconds: finder.seconds,
            registration_seconds: found.seconds,
            reading_seconds: read.seconds,
        })
    }

    fn rated(&self, number: usize, reading: &Reading, in_true_pose: Option<&[bool]>) -> Result<Rated> {
        let Reading {
            detector,
            bits,
            tries,
        } = reading;
        let signed = &self.setup().signatures[number];
        let expected = signed.signature.bits();
        ensure!(
            bits.len() == expected.len(),
            "{} read {} bits of {}",
            detector.name(),
            bits.len(),
            expected.len()
        );
        let strangers = self.setup().strangers.iter();
        let read = Signature::from_bits(SCHEME, bits)?;
        let verified = self.setup().public_key.verify(signed.message.as_bytes(), &read);
        Ok(Rated {
            detector: detector.clone(),
            rate: extraction_rate(&expected, bits),
            tries: *tries,
            rate_in_true_pose: in_true_pose.map(|bits| extraction_rate(&expected, bits)),
            strangers: strangers
                .map(|stranger| extraction_rate(&stranger.bits(), bits))
                .collect(),
            verified: verified.is_ok(),
        })
    }
}

/// As JSON has it.
fn name(matched_by: MatchedBy) -> String {
    let name = serde_json::to_value(matched_by).unwrap_or_default();
    name.as_str().unwrap_or_default().into()
}
