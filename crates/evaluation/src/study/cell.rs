//! One cell of the tables: a mesh is attacked, moved to where nobody knows, found again, read, and what was read is judged.

use std::{fs, path::Path, time::Instant};

use anyhow::{Context, Result};
use mesh::{TriMesh, shapes};
use mesh_io::{Asset, Format, Precision, write_mesh};
use quality::picture::{Paint, Picture, linear};
use serde_json::{Value, json};
use sigmark::Signature;

use super::{
    Cell, Study, Target,
    marking::{Attacked, Judge},
};
use crate::{
    attacks::{Attack, random_similarity},
    plan,
    sources::digest,
};

/// sRGB, of meshes in pictures.
const SURFACE: u32 = 0x8fb0cf;

impl Study<'_> {
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

    /// Who reads suspects. An unmarked mesh is read as if it had the first signature.
    pub(crate) fn judge(&self, target: Target) -> Result<Box<dyn Judge + '_>> {
        let signed = &self.setup().signatures[target.signature];
        self.prepare()?.judge(self.scene, signed, target.alpha)
    }

    /// Attacks a file, moves it, finds it again and reads it. `size` is that of a picture, if one is wanted.
    pub(crate) fn cell(
        &self,
        target: Target,
        attack: &Attack,
        judge: &dyn Judge,
        file: &Path,
        size: Option<usize>,
    ) -> Result<Cell> {
        let inputs = self.cell_inputs(target, attack);
        let seed = self.setup().signatures[target.signature].number as u64 + 1;
        let begun = Instant::now();
        let (mesh, report) = self.attacked(file, attack, seed, &inputs)?;
        let seconds = begun.elapsed().as_secs_f64();
        if let Some(size) = size {
            let paint = vec![linear(SURFACE); mesh.triangle_count()];
            let picture =
                Picture::of(&mesh, Paint::Triangles(&paint), self.scene.standin.view, size).to_png()?;
            self.store().put_bytes("cell", &inputs, "png", &picture)?;
        }
        let pose = random_similarity(self.original(), seed);
        let cell = judge.judged(Attacked {
            mesh: shapes::moved(&mesh, &pose),
            true_pose: (!attack.moves()).then(|| pose.inverse()),
            report,
            seconds,
            by_steps: plan::reads_by_steps(&self.marking.id(), &self.scene.standin.model, target, attack),
        })?;
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
}
