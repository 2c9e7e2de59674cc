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

impl<'a> Study<'a> {
    /// What a cell depends on.
    fn cell_inputs(&self, target: Target, attack: &Attack) -> Value {
        let signature = self.signature(target.signature).to_hex();
        let target = match target.is_marked {
            true => json!({"alpha": target.alpha, "signature": signature, "seed": target.signature}),
            false => json!({"alpha": target.alpha, "unmarked": signature}),
        };
        let strangers: String = self.setup().strangers.iter().map(Signature::to_hex).collect();
        let mut inputs = self.inputs(target);
        inputs["attack"] = json!(attack.spec);
        inputs["strangers"] = json!(digest(strangers.as_bytes()));
        inputs
    }

    /// A finished cell, if it was finished before.
    pub(crate) fn kept(&self, target: Target, attack: &Attack) -> Option<Cell> {
        self.store().get("cell", &self.cell_inputs(target, attack))
    }

    /// The picture of a finished cell's suspect, as PNG.
    pub(crate) fn picture(&self, target: Target, attack: &Attack) -> Option<Vec<u8>> {
        self.store()
            .bytes("cell", &self.cell_inputs(target, attack), "png")
    }

    /// Writes what is attacked to a file.
    pub(crate) fn write(&self, target: Target, file: &Path) -> Result<()> {
        let mesh = match target.is_marked {
            true => &self.marked(target.signature, target.alpha)?,
            false => self.original(),
        };
        let bytes = write_mesh(mesh, Format::Ply, Precision::Double);
        fs::write(file, bytes).with_context(|| file.display().to_string())
    }

    /// What suspects are brought onto. An unmarked mesh is read as if it had the first signature.
    pub(crate) fn reference(&self, target: Target) -> Result<Cow<'a, TriMesh>> {
        Ok(match self.algorithm.reference() {
            Reference::Original => Cow::Borrowed(&self.scene.standin.mesh),
            Reference::Marked => Cow::Owned(self.marked(target.signature, target.alpha)?),
        })
    }

    /// Attacks a file, moves it, finds it again and reads it. `size` is that of a picture, if one is wanted.
    pub(crate) fn cell(
        &self,
        target: Target,
        attack: &Attack,
        finder: &Finder,
        file: &Path,
        size: Option<usize>,
    ) -> Result<Cell> {
        let inputs = self.cell_inputs(target, attack);
        let seed = self.setup().signatures[target.signature].number as u64 + 1;
        let begun = Instant::now();
        let (mesh, report) = self.attacked(file, attack, seed, &inputs)?;
        let attacked = (report, begun.elapsed().as_secs_f64());
        if let Some(size) = size {
            let paint = vec![linear(SURFACE); mesh.triangle_count()];
            let picture =
                Picture::of(&mesh, Paint::Triangles(&paint), self.scene.standin.view, size).to_png()?;
            self.store().put_bytes("cell", &inputs, "png", &picture)?;
        }
        let pose = random_similarity(self.original(), seed);
        let known_pose = (!attack.moves()).then(|| pose.inverse());
        let suspect = shapes::moved(&mesh, &pose);
        let cell = self.read(target, finder, &suspect, known_pose, attacked)?;
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

    /// Finds a suspect and reads it. The attack's own report, and its seconds, go into the cell.
    fn read(
        &self,
        target: Target,
        finder: &Finder,
        suspect: &TriMesh,
        true_pose: Option<Similarity>,
        (attack, attack_seconds): (Value, f64),
    ) -> Result<Cell> {
        let prepared = self.prepare()?;
        let (number, alpha) = (target.signature, target.alpha);
        let found = finder.find(suspect)?;
        let expected = self.signature(number).bits();
        let read = found.read(prepared, alpha, &expected)?;
        // The true pose explains what was lost.
        let all = read.readings[0].bits == expected;
        let in_true_pose = true_pose.filter(|_| !all);
        let in_true_pose = in_true_pose
            .map(|pose| found.read_in(&pose, prepared, alpha))
            .transpose()?;
        let rated = read.readings.iter().enumerate().map(|(i, reading)| {
            let in_true_pose = in_true_pose.as_ref().map(|bits| bits[i].as_slice());
            self.rated(number, reading, in_true_pose)
        });
        Ok(Cell {
            readings: rated.collect::<Result<_>>()?,
            attack,
            vertices: suspect.vertex_count(),
            aligned: found.alignment.aligned,
            basis: name(found.alignment.matched_by),
            overlap: found.alignment.overlap,
            missing: read.missing,
            attack_seconds,
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
        let (count, wanted) = (bits.len(), expected.len());
        ensure!(
            count == wanted,
            "{} read {count} bits of {wanted}",
            detector.name()
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
                .map(|other| extraction_rate(&other.bits(), bits))
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
