use std::sync::{Arc, OnceLock};

use mesh::{Surface, TriMesh};

use crate::{
    RegistrationError,
    sampled::{SAMPLES, Sampled},
};

/// A mesh with what alignment and resampling ask of it, each computed when it is first needed and kept.
///
/// Clones share all of it, so that a search tree is built once, whoever needs it.
#[derive(Clone)]
pub struct PreparedMesh(Arc<Parts>);

struct Parts {
    mesh: Arc<TriMesh>,
    surface: OnceLock<Arc<Surface>>,
    triangle_normals: OnceLock<Arc<[[f64; 3]]>>,
    vertex_normals: OnceLock<Vec<[f64; 3]>>,
    /// None where the mesh has no area.
    sampled: OnceLock<Option<Sampled>>,
}

impl PreparedMesh {
    /// Nothing is computed yet.
    pub fn new(mesh: Arc<TriMesh>) -> Self {
        Self(Arc::new(Parts {
            mesh,
            surface: OnceLock::new(),
            triangle_normals: OnceLock::new(),
            vertex_normals: OnceLock::new(),
            sampled: OnceLock::new(),
        }))
    }

    /// The mesh itself.
    pub fn mesh(&self) -> &Arc<TriMesh> {
        &self.0.mesh
    }

    /// The search tree over its triangles.
    pub fn surface(&self) -> &Arc<Surface> {
        self.0.surface.get_or_init(|| Arc::new(Surface::new(self.mesh())))
    }

    /// Unit normals, #V by 3, as [`TriMesh::vertex_normals`] has them.
    pub fn vertex_normals(&self) -> &[[f64; 3]] {
        self.0.vertex_normals.get_or_init(|| self.mesh().vertex_normals())
    }

    /// Unit normals, #F by 3; zero where a triangle has no area.
    pub fn triangle_normals(&self) -> &Arc<[[f64; 3]]> {
        self.0
            .triangle_normals
            .get_or_init(|| self.mesh().triangle_normals().into())
    }

    /// Points all over the surface. `role`, "original" or "suspect", names the mesh in errors.
    ///
    /// # Errors
    /// [`RegistrationError::NoSurface`].
    pub(crate) fn sampled(&self, role: &'static str) -> Result<&Sampled, RegistrationError> {
        let sample = || Sampled::of(self.mesh(), self.surface(), self.triangle_normals(), SAMPLES);
        let sampled = self.0.sampled.get_or_init(sample);
        sampled
            .as_ref()
            .ok_or(RegistrationError::NoSurface { mesh: role })
    }
}

impl From<Arc<TriMesh>> for PreparedMesh {
    fn from(mesh: Arc<TriMesh>) -> Self {
        Self::new(mesh)
    }
}

impl From<TriMesh> for PreparedMesh {
    fn from(mesh: TriMesh) -> Self {
        Self::new(Arc::new(mesh))
    }
}

impl From<&Arc<TriMesh>> for PreparedMesh {
    fn from(mesh: &Arc<TriMesh>) -> Self {
        Self::new(Arc::clone(mesh))
    }
}

/// Copies the mesh.
impl From<&TriMesh> for PreparedMesh {
    fn from(mesh: &TriMesh) -> Self {
        Self::from(mesh.clone())
    }
}

/// Shares all there is.
impl From<&Self> for PreparedMesh {
    fn from(prepared: &Self) -> Self {
        prepared.clone()
    }
}
