use mesh::{MorphTarget, Rig};

use super::Asset;
use crate::error::AssetError;
use crate::formats;

impl Asset {
    /// Which joints and morph targets move which vertices of [`Self::mesh`]: the skins of a glTF, whose joints are numbered through all of them, and the targets of its meshes, in the frame of the mesh;
    /// what has no skin is moved by its node alone. Of vertices that were merged the first counts. None where the file has neither skin nor targets.
    ///
    /// # Errors
    /// When joints, weights or targets are damaged.
    pub fn rig(&self) -> Result<Option<Rig>, AssetError> {
        let found = formats::rig(self.format, &self.buffers, &self.slots);
        let Some(of_file) = found.map_err(|fault| fault.of(&self.path))? else {
            return Ok(None);
        };
        let vertex_of = self.welded.vertex_of();
        let mut weights = vec![Vec::new(); self.mesh().vertex_count()];
        let mut first_of = vec![None; weights.len()];
        for (file_vertex, (own, vertex)) in of_file.weights.into_iter().zip(vertex_of).enumerate() {
            let Some(vertex) = vertex.map(|vertex| vertex as usize) else {
                continue;
            };
            first_of[vertex].get_or_insert(file_vertex);
            if weights[vertex].is_empty() {
                weights[vertex] = own;
            }
        }
        let targets = of_file.targets.into_iter().map(|target| -> MorphTarget {
            let of_mesh = target.into_iter().filter_map(|(file_vertex, offset)| {
                let vertex = (*vertex_of.get(file_vertex as usize)?)?;
                (first_of[vertex as usize] == Some(file_vertex as usize)).then_some((vertex, offset))
            });
            of_mesh.collect()
        });
        let rig = Rig::new(&weights).with_targets(targets);
        Ok((!rig.is_empty()).then_some(rig))
    }
}
