//! What stands in a library, row by row.

use mesh::TriMesh;
use sigmark::GeometryDigest;

use crate::{Descriptor, LibraryError, pack_geometry};

/// The number of an original in its library.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct OriginalId(pub(crate) i64);

impl OriginalId {
    /// As a whole number.
    pub fn number(self) -> i64 {
        self.0
    }
}

impl std::fmt::Display for OriginalId {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.0.fmt(f)
    }
}

/// An original about to be added.
#[derive(Clone, Debug)]
pub struct Entry {
    /// Of its geometry: an original is in a library once, however many files have it.
    pub digest: GeometryDigest,
    /// For people: its file's name.
    pub name: String,
    /// #V.
    pub vertices: usize,
    /// #F.
    pub triangles: usize,
    /// By which it is found.
    pub descriptor: Descriptor,
    /// [Packed](pack_geometry), if it is to be kept.
    pub geometry: Option<Vec<u8>>,
    /// Where it lies.
    pub file: Option<FileRecord>,
}

impl Entry {
    /// Describes an original, and packs it if its geometry is to be kept.
    ///
    /// # Errors
    /// [`LibraryError::NoArea`].
    pub fn of(name: &str, mesh: &TriMesh, keeps_geometry: bool) -> Result<Self, LibraryError> {
        Ok(Self {
            digest: GeometryDigest::of(mesh),
            name: name.into(),
            vertices: mesh.vertex_count(),
            triangles: mesh.triangle_count(),
            descriptor: Descriptor::of(mesh)?,
            geometry: keeps_geometry.then(|| pack_geometry(mesh)),
            file: None,
        })
    }

    /// The same, described by what a viewer shows of the file, which may show some of the mesh several times.
    ///
    /// # Errors
    /// [`LibraryError::NoArea`].
    pub fn seen_as(mut self, scene: &TriMesh) -> Result<Self, LibraryError> {
        self.descriptor = Descriptor::of(scene)?;
        Ok(self)
    }

    /// The same, with the file in which it lies.
    pub fn lying_in(mut self, file: FileRecord) -> Self {
        self.file = Some(file);
        self
    }
}

/// What became of an entry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AddedAs {
    /// It is new.
    New(OriginalId),
    /// Its geometry was there; a file or the geometry may be new.
    Known(OriginalId),
}

/// An original.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct OriginalRecord {
    /// Its number.
    pub id: OriginalId,
    /// Of its geometry.
    pub digest: GeometryDigest,
    /// The name of the file with which it came.
    pub name: String,
    /// #V.
    pub vertices: usize,
    /// #F.
    pub triangles: usize,
    /// Bytes of its geometry in the library; none where it was not kept.
    pub geometry_bytes: Option<usize>,
    /// How many certificates name it.
    pub certificates: usize,
}

/// A file as it was when it was read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FileRecord {
    /// Its path.
    pub path: String,
    /// In bytes.
    pub size: u64,
    /// When it was changed last, in nanoseconds since 1970.
    pub modified: i64,
}

/// A certificate that names an original, whether or not that is in the library.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CertificateRecord {
    /// Of the geometry that was signed.
    pub original: GeometryDigest,
    /// For whom the copy is, or nothing.
    pub recipient: String,
    /// What was signed with it.
    pub message: String,
    /// The public key's fingerprint.
    pub key: String,
    /// The certificate itself.
    pub text: String,
}
