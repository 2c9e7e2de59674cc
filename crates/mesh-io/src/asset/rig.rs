use mesh::Rig;

use super::Asset;
use crate::error::AssetError;
use crate::formats;

impl Asset {
    /// Which joints move which vertices of [`Self::mesh`]: the skins of a glTF, whose joints are numbered through all of them; what has none is moved by its node alone. Of vertices
    /// that were merged the first counts. None where the file has no skin.
    ///
    /// # Errors
    /// When joints or weights are damaged.
    pub fn rig(&self) -> Result<Option<Rig>, AssetError> {
        let found = formats::weights(self.format, &self.buffers, &self.slots);
        let Some(of_file) = found.map_err(|fault| fault.of(&self.path))? else {
            return Ok(None);
        };
        let mut weights = vec![Vec::new(); self.mesh().vertex_count()];
        for (own, vertex) in of_file.into_iter().zip(self.welded.vertex_of()) {
            if let Some(vertex) = *vertex
                && weights[vertex as usize].is_empty()
            {
                weights[vertex as usize] = own;
            }
        }
        let rig = Rig::new(&weights);
        Ok((rig.joints() > 0).then_some(rig))
    }
}
