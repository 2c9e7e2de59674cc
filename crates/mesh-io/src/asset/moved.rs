use mesh::Similarity;

use super::Asset;
use crate::error::AssetError;
use crate::formats;
use crate::packing::Beside;
use crate::slots::Slots;
use crate::slots::directions::Unturned;

/// A file whose mesh was moved as a whole.
#[derive(Debug)]
pub struct Moved {
    /// The file with the new positions, normals and tangents.
    pub asset: Asset,
    /// What of it should have been turned, too, and could not be.
    pub left: Vec<Unturned>,
}

impl Asset {
    /// The same file moved by p ↦ s R p + t. Positions are those of [`Self::with_positions`], byte for byte; and what the file says of
    /// directions turns with them, each number rounded to its own type:
    ///
    /// - Normals go to R n, also where R mirrors: they go on pointing to the side of the surface to which they pointed. Triangles keep the
    ///   order of their corners, so that a mirrored one turns its other side out. Of OBJ these are `vn`, of PLY `nx ny nz`, of OFF those of
    ///   `NOFF`, of STL those of facets, of glTF `NORMAL`; each keeps its length.
    /// - Tangents of glTF go to R t; the sign w of the bitangent changes where R mirrors.
    /// - Morph targets of glTF are offsets: those of positions go to s R d, those of normals and tangents to R d.
    ///
    /// Where a node places a mesh of glTF, all of this is done as the scene shows it, and brought back into the node's own coordinates. Of a mesh
    /// that is placed several times, the first place counts, as it does for positions. Skeletons, animations, cameras and lights stay.
    ///
    /// # Errors
    /// As [`Self::with_positions`]. What can't be turned is no error, but named in [`Moved::left`].
    pub fn moved_by(&self, similarity: &Similarity) -> Result<Moved, AssetError> {
        let asset = self.with_positions(&similarity.apply_all(self.mesh().positions()))?;
        let found = formats::directions(asset.format, &asset.buffers, &asset.slots);
        let found = found.map_err(|fault| fault.of(&self.path))?;
        let (mut buffers, mut left) = (asset.buffers.clone(), found.left);
        let vertex_of = self.welded.vertex_of();
        // From the end on: new decimals move what follows them.
        for list in found.lists.iter().rev() {
            let turned = list.turn(&mut buffers, similarity, |vertex| vertex_of[vertex].is_some());
            if let Err(why) = turned {
                left.push(Unturned::new(&list.what, why));
            }
        }
        left.dedup();
        let is_same = buffers
            .iter()
            .zip(&asset.buffers)
            .all(|(new, old)| new.is_same(old));
        if is_same {
            return Ok(Moved { asset, left });
        }
        let (buffers, slots) = match asset.slots.as_ref() {
            Slots::Binary(_) => (buffers, asset.slots.as_ref().clone()),
            Slots::Text(_) => {
                // What lies beside the text stays as it is.
                let bytes = buffers[0].bytes.as_ref().clone();
                let (mut read, geometry) = formats::read(asset.format, &asset.path, bytes, &Beside::Nowhere)?;
                buffers[0] = read.swap_remove(0);
                (buffers, geometry.slots)
            }
            Slots::Scene(scene) => {
                let rewritten = formats::gltf::rewrite(&asset.buffers, buffers, scene);
                let (buffers, scene) = rewritten.map_err(|fault| fault.of(&self.path))?;
                (buffers, Slots::Scene(scene))
            }
        };
        let asset = asset.with_buffers(buffers, slots);
        Ok(Moved { asset, left })
    }
}
