use mesh::{TriMesh, components};

use crate::SigmarkError;

/// A connected piece of a mesh that carries the whole signature, with the mesh vertices that it covers.
#[derive(Clone, Debug)]
pub struct Patch {
    vertices: Vec<u32>,
    mesh: TriMesh,
}

impl Patch {
    /// The mesh vertex of each patch vertex, ascending.
    pub fn vertices(&self) -> &[u32] {
        &self.vertices
    }

    /// The patch as a mesh of its own; a triangle belongs to a patch if its three vertices do.
    pub fn mesh(&self) -> &TriMesh {
        &self.mesh
    }

    /// The values of the patch's vertices in a field over the whole mesh.
    pub fn gather<T: Copy>(&self, field: &[T]) -> Vec<T> {
        self.vertices.iter().map(|&v| field[v as usize]).collect()
    }
}

/// The patches of a mesh, in the order of their first vertices, and what is left without a mark.
#[derive(Clone, Debug)]
pub struct Patches {
    /// The patches; never empty.
    pub marked: Vec<Patch>,
    /// How many components are too small to carry the signature and stay as they are.
    pub unmarked_components: usize,
    /// How many vertices those have.
    pub unmarked_vertices: usize,
}

/// A basis of m functions says something about a surface only if it has clearly more vertices.
const VERTICES_PER_FUNCTION: usize = 2;

/// The largest patch: a basis of a larger one costs more memory and time than a user expects.
pub const LARGEST_PATCH: usize = 60_000;

/// Cuts a mesh into patches: one a connected component, leaving components of fewer than twice `functions` vertices unmarked.
///
/// # Errors
/// When no component is large enough for `functions` manifold harmonics, or one is larger than [`LARGEST_PATCH`].
pub fn partition_into_patches(mesh: &TriMesh, functions: usize) -> Result<Patches, SigmarkError> {
    let components = components(mesh);
    let least = VERTICES_PER_FUNCTION.saturating_mul(functions);
    let largest = components.sizes.iter().copied().max().unwrap_or(0);
    if largest < least {
        return Err(SigmarkError::TooFewVertices {
            largest,
            least,
            functions,
        });
    }
    if largest > LARGEST_PATCH {
        return Err(SigmarkError::TooManyVertices {
            largest,
            most: LARGEST_PATCH,
        });
    }

    // Patch number and place within the patch of every mesh vertex.
    let mut patch_of_component = vec![None; components.count];
    let mut vertices: Vec<Vec<u32>> = Vec::new();
    for (component, &size) in components.sizes.iter().enumerate() {
        if size >= least {
            patch_of_component[component] = Some(vertices.len());
            vertices.push(Vec::with_capacity(size));
        }
    }
    let patch_of = |v: u32| patch_of_component[components.of_vertex[v as usize] as usize];
    let mut place = vec![0u32; mesh.vertex_count()];
    for v in 0..mesh.vertex_count() as u32 {
        if let Some(patch) = patch_of(v) {
            place[v as usize] = vertices[patch].len() as u32;
            vertices[patch].push(v);
        }
    }
    let mut triangles: Vec<Vec<[u32; 3]>> = vec![Vec::new(); vertices.len()];
    for triangle in mesh.triangles() {
        if let Some(patch) = patch_of(triangle[0]) {
            triangles[patch].push(triangle.map(|v| place[v as usize]));
        }
    }

    let marked_vertices: usize = vertices.iter().map(Vec::len).sum();
    let marked = vertices
        .into_iter()
        .zip(triangles)
        .map(|(vertices, triangles)| {
            let positions = vertices.iter().map(|&v| mesh.positions()[v as usize]).collect();
            Ok(Patch {
                mesh: TriMesh::new(positions, triangles)?,
                vertices,
            })
        })
        .collect::<Result<Vec<_>, SigmarkError>>()?;
    Ok(Patches {
        unmarked_components: components.count - marked.len(),
        unmarked_vertices: mesh.vertex_count() - marked_vertices,
        marked,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use mesh::shapes;

    #[test]
    fn every_large_component_becomes_a_patch_and_small_ones_stay_unmarked() {
        let mesh = shapes::disjoint_union(&[
            shapes::icosphere(3),
            shapes::tetrahedron(),
            shapes::translated(&shapes::icosphere(3), [5.0, 0.0, 0.0]),
        ]);
        let patches = partition_into_patches(&mesh, 100).unwrap();
        assert_eq!(patches.marked.len(), 2);
        assert_eq!((patches.unmarked_components, patches.unmarked_vertices), (1, 4));
        for patch in &patches.marked {
            assert_eq!(patch.mesh().vertex_count(), 642);
            assert_eq!(patch.mesh().triangle_count(), 1280);
            assert_eq!(patch.gather(mesh.positions()), patch.mesh().positions());
        }
    }

    #[test]
    fn a_mesh_without_a_large_enough_component_is_refused() {
        let error = partition_into_patches(&shapes::icosphere(2), 325).unwrap_err();
        assert!(matches!(
            error,
            SigmarkError::TooFewVertices {
                largest: 162,
                least: 650,
                functions: 325
            }
        ));
    }
}
