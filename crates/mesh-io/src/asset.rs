mod moved;
mod rig;

use std::borrow::Cow;
use std::collections::HashMap;
use std::fmt;
use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use mesh::{LARGEST_COORDINATE, MeshError, TriMesh, Welded};

use crate::buffer::Buffer;
use crate::error::{AssetError, AssetProblem, Fault};
use crate::formats::{self, Geometry, Instance};
use crate::packing::Packing;
use crate::save::write_file;
use crate::slots::Slots;
use crate::{Format, source};
pub use moved::Moved;

/// A mesh file that keeps all its bytes: its geometry is seen as a welded [`TriMesh`], and positions can be replaced.
///
/// Everything but the coordinates of vertices stays byte for byte: comments, materials, colours, normals, order,
/// spacing, headers. Polygons and strips are cut into triangles for [`Self::mesh`] only; lines and points are not seen.
/// Normals that a file holds are kept as they are, also where vertices move; [`Self::moved_by`] turns them.
///
/// **Precision.** Binary coordinates are rounded to their own type, and those of ASCII PLY to the declared one. Other
/// text is taken as single precision when no coordinate has more than 9 significant digits, as doubles otherwise. New
/// numbers are the shortest that read back to the same number of that precision. A coordinate that rounds to the old one
/// keeps its bytes. [`Self::mesh`] always has exactly the numbers in the bytes.
///
/// **Names.** The file's name decides the format, with `.gz` passed over; compression is seen by content. A name
/// that contradicts a mark in the content (`ply`, `OFF`, `solid`, the size of binary STL) is an error; a name
/// without an extension leaves the decision to the content. Saving keeps format and compression.
///
/// A clone shares the bytes.
#[derive(Clone)]
pub struct Asset {
    path: PathBuf,
    format: Format,
    /// The file first.
    buffers: Vec<Buffer>,
    slots: Arc<Slots>,
    packing: Packing,
    names: Arc<[(Range<usize>, String)]>,
    instances: Arc<[Instance]>,
    manifests: usize,
    welded: Arc<Welded>,
    moved: Option<TriMesh>,
}

impl Asset {
    /// Reads a file.
    ///
    /// # Errors
    /// When it cannot be read or is larger than [`LARGEST`](crate::LARGEST), its format is not known or its content is damaged; the
    /// message says where and what to do.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, AssetError> {
        let path = path.as_ref();
        let bytes = source::read(path, source::LARGEST).map_err(|problem| problem.of(path))?;
        Self::read(path.into(), bytes, None)
    }

    /// Reads a file's bytes, gzipped or not; without a format, the content decides.
    ///
    /// # Errors
    /// As [`Self::open`].
    pub fn from_bytes(
        bytes: impl Into<Vec<u8>>,
        format: impl Into<Option<Format>>,
    ) -> Result<Self, AssetError> {
        Self::read(PathBuf::new(), bytes.into(), format.into())
    }

    fn read(path: PathBuf, stored: Vec<u8>, format: Option<Format>) -> Result<Self, AssetError> {
        let refused = |problem: AssetProblem| problem.of(&path);
        let (packing, bytes) = Packing::open(stored).map_err(refused)?;
        if bytes.is_empty() {
            return Err(AssetProblem::Empty.of(path));
        }
        let format = match &packing {
            Packing::Zip(archive) => archive.format,
            _ => formats::decide(&path, format, &bytes).map_err(refused)?,
        };
        let beside = packing.beside(&path, bytes.len());
        let (buffers, geometry) = formats::read(format, &path, bytes, &beside)?;
        Self::assembled(path, format, packing, buffers, geometry)
    }

    /// Puts together what a format's reader found in the buffers.
    fn assembled(
        path: PathBuf,
        format: Format,
        packing: Packing,
        buffers: Vec<Buffer>,
        Geometry {
            positions,
            triangles,
            slots,
            names,
            instances,
            manifests,
        }: Geometry,
    ) -> Result<Self, AssetError> {
        let welded = match Welded::new(&positions, &triangles) {
            Ok(welded) => welded,
            Err(MeshError::NotFinite { vertex, position } | MeshError::TooFar { vertex, position }) => {
                let fits = |x: &f64| x.abs() <= LARGEST_COORDINATE;
                let axis = position.iter().position(|x| !fits(x)).unwrap_or(0);
                let value = position[axis];
                let advice = match value.is_finite() {
                    true => format!(
                        "coordinates beyond {LARGEST_COORDINATE:.1e} can't be computed with: scale the model down"
                    ),
                    false => "write the file again with finite numbers".into(),
                };
                let problem = format!("vertex {vertex} has the coordinate {value:e}: {advice}");
                let place = slots.place(&buffers, vertex, axis);
                return Err(Fault { place, problem }.of(path));
            }
            Err(error) => return Err(AssetProblem::Geometry(error).of(path)),
        };
        Ok(Self {
            path,
            format,
            buffers,
            slots: Arc::new(slots),
            packing,
            names: names.into(),
            instances: instances.into(),
            manifests,
            welded: Arc::new(welded),
            moved: None,
        })
    }

    /// The file's format.
    pub fn format(&self) -> Format {
        self.format
    }

    /// Whether the file is gzipped.
    pub fn is_gzipped(&self) -> bool {
        matches!(self.packing, Packing::Gzip(_))
    }

    /// The file that was opened; empty for bytes in memory.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The surface, with the positions that the bytes hold now.
    pub fn mesh(&self) -> &TriMesh {
        self.moved.as_ref().unwrap_or(self.welded.mesh())
    }

    /// What the file calls the part that a vertex of [`Self::mesh`] belongs to: the name of a node, mesh or object in glTF and 3MF.
    pub fn name_of(&self, vertex: usize) -> Option<&str> {
        if self.names.is_empty() {
            return None;
        }
        let of_mesh = self.welded.vertex_of();
        let file_vertex = of_mesh
            .iter()
            .position(|v| v.is_some_and(|v| v as usize == vertex))?;
        let (_, name) = self
            .names
            .iter()
            .find(|(vertices, _)| vertices.contains(&file_vertex))?;
        Some(name)
    }

    /// All that a viewer shows. [`Self::mesh`] has what the file holds: a mesh that a scene places several times is there once, and here each
    /// time. Everywhere else the two are the same.
    ///
    /// # Errors
    /// When a place is farther away than a [`TriMesh`] may reach.
    pub fn scene(&self) -> Result<Cow<'_, TriMesh>, AssetError> {
        if self.instances.is_empty() {
            return Ok(Cow::Borrowed(self.mesh()));
        }
        let mesh = self.mesh();
        let (mut positions, mut triangles) = (mesh.positions().to_vec(), mesh.triangles().to_vec());
        for instance in self.instances.iter() {
            let mut copies = HashMap::new();
            for corners in &instance.triangles {
                let [Some(a), Some(b), Some(c)] = corners.map(|v| self.welded.vertex_of()[v as usize]) else {
                    continue;
                };
                let mut copy = |v: u32| {
                    *copies.entry(v).or_insert_with(|| {
                        positions.push(instance.carry(mesh.positions()[v as usize]));
                        positions.len() as u32 - 1
                    })
                };
                let [a, b, c] = [copy(a), copy(b), copy(c)];
                triangles.push(if instance.mirrors() { [a, c, b] } else { [a, b, c] });
            }
        }
        let welded = Welded::new(&positions, &triangles);
        let welded = welded.map_err(|error| AssetProblem::Geometry(error).of(&self.path))?;
        Ok(Cow::Owned(welded.into_mesh()))
    }

    /// How the file's vertices were welded when it was read; its mesh has the positions of that time.
    pub fn welded(&self) -> &Welded {
        &self.welded
    }

    /// Vertices in the file; STL counts three a facet.
    pub fn file_vertex_count(&self) -> usize {
        self.slots.len()
    }

    /// The same file with new positions (#V by 3, one a vertex of [`Self::mesh`]), rounded to the file's precision.
    ///
    /// Every file vertex that was merged into a mesh vertex moves with it; unused ones stay. Vertices that become
    /// equal by rounding stay apart here, though a later reader will weld them.
    ///
    /// # Errors
    /// When the count differs, a [`TriMesh`] has no room for a number, or the file cannot hold it (integers, overflow of 32 bits).
    pub fn with_positions(&self, positions: &[[f64; 3]]) -> Result<Self, AssetError> {
        let refused = |error| AssetProblem::Geometry(error).of(&self.path);
        let finite = self.mesh().with_positions(positions.to_vec()).map_err(refused)?;
        let vertex_of = self.welded.vertex_of();
        let (file_held, held) = (self.slots.positions(&self.buffers), self.mesh().positions());
        let target = |file_vertex: usize| {
            let vertex = vertex_of[file_vertex]? as usize;
            let (own, new) = (file_held[file_vertex], finite.positions()[vertex]);
            // Copies that were merged though they differ in their last digits go on differing by as much.
            Some(std::array::from_fn(|axis| {
                match own[axis] == held[vertex][axis] {
                    true => new[axis],
                    false => own[axis] + (new[axis] - held[vertex][axis]),
                }
            }))
        };
        let rewritten = self.slots.rewrite(&self.buffers, target);
        let (buffers, slots) = rewritten.map_err(|refusal| {
            let vertex = vertex_of[refusal.file_vertex].map_or(0, |v| v as usize);
            let (value, problem) = (refusal.value, refusal.problem);
            AssetProblem::Unwritable {
                vertex,
                value,
                problem,
            }
            .of(&self.path)
        })?;
        let is_same = |i: usize| buffers[i].is_same(&self.buffers[i]);
        if (0..buffers.len()).all(is_same) {
            return Ok(self.clone());
        }

        let mut held = finite.positions().to_vec();
        for (position, vertex) in slots.positions(&buffers).into_iter().zip(vertex_of).rev() {
            if let Some(vertex) = *vertex {
                held[vertex as usize] = position;
            }
        }
        let moved = Some(self.mesh().with_positions(held).map_err(refused)?);
        Ok(Self {
            moved,
            ..self.with_buffers(buffers, slots)
        })
    }

    /// The same file with other bytes, and where the coordinates lie in them.
    fn with_buffers(&self, buffers: Vec<Buffer>, slots: Slots) -> Self {
        let pairs = buffers.iter().zip(&self.buffers);
        let changed = pairs.filter(|(new, old)| !new.is_same(old)).map(|(new, _)| new);
        Self {
            packing: self.packing.changed(changed),
            buffers,
            slots: Arc::new(slots),
            manifests: 0,
            ..self.clone()
        }
    }

    /// The file's content, unpacked where it is gzipped or in a zip archive.
    pub fn content(&self) -> &[u8] {
        &self.buffers[0].bytes
    }

    /// Files that this one refers to by name, such as buffers and textures of glTF and the materials of an OBJ: name, within the folder of the file, and bytes.
    /// What lies in the same zip archive is part of the file, and no companion.
    pub fn companions(&self) -> impl Iterator<Item = (&str, &[u8])> {
        let is_packed = matches!(self.packing, Packing::Zip(_));
        let named = self
            .buffers
            .iter()
            .filter(move |buffer| !is_packed && !buffer.is_file());
        named.map(|Buffer { name, bytes }| (name.as_str(), bytes.as_slice()))
    }

    /// Whether the file says who made it by a digest of all its bytes (a C2PA manifest). No file with other positions has it: it would
    /// no longer be true.
    pub fn has_manifest(&self) -> bool {
        self.manifests > 0
    }

    /// The bytes that [`Self::save`] writes: packed as the file was; for an unchanged file, exactly its bytes.
    pub fn to_bytes(&self) -> Cow<'_, [u8]> {
        self.packing.pack(&self.buffers)
    }

    /// Whether [`Self::save`] accepts a name: it must end as the format demands, and in `.gz` exactly if the file is gzipped.
    ///
    /// # Errors
    /// When it does not; the message says how it should end.
    pub fn check_name(&self, path: impl AsRef<Path>) -> Result<(), AssetError> {
        let path = path.as_ref();
        let format = self.format;
        let (packed, ending) = self.packing.name_of(format);
        if self.packing.fits(format, path) {
            return Ok(());
        }
        let problem = AssetProblem::SaveName {
            format,
            packed,
            ending,
        };
        Err(problem.of(path))
    }

    /// Writes the file: to a temporary one in the same folder, which is then renamed, so that a failure leaves nothing.
    /// A symbolic link is followed. A file that is overwritten passes its permissions on. Its [companions](Self::companions)
    /// are written beside it first, each as a whole; one that is there already with the same content stays.
    ///
    /// # Errors
    /// When the name does not end as the format demands, the file exists and `overwrite` is false, or writing fails.
    pub fn save(&self, path: impl AsRef<Path>, overwrite: bool) -> Result<(), AssetError> {
        let path = path.as_ref();
        self.check_name(path)?;
        for (name, bytes) in self.companions() {
            let beside = path.with_file_name(name);
            if fs::read(&beside).is_ok_and(|there| there == bytes) {
                continue;
            }
            if let Some(folder) = beside.parent() {
                fs::create_dir_all(folder).map_err(|error| AssetProblem::Write(error).of(folder))?;
            }
            write_file(beside, bytes, overwrite)?;
        }
        write_file(path, &self.to_bytes(), overwrite)
    }
}

impl fmt::Debug for Asset {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Asset")
            .field("path", &self.path)
            .field("format", &self.format)
            .field("bytes", &self.content().len())
            .field("weld", &self.welded.summary())
            .finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::scalar::{Endian, Scalar};
    use crate::slots::binary::BinaryRun;

    #[test]
    fn an_asset_of_two_files_is_saved_as_two_files() {
        let corners = [[0.0_f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let numbers: Vec<u8> = corners
            .as_flattened()
            .iter()
            .flat_map(|x| x.to_le_bytes())
            .collect();
        let slots = Slots::Binary(vec![BinaryRun {
            buffer: 1,
            start: 0,
            stride: 12,
            vertices: vec![[0, 4, 8]],
            count: 3,
            types: [Scalar::F32; 3],
            endian: Endian::Little,
            quantisation: None,
            placement: None,
            locked: None,
        }]);
        let beside = Buffer {
            name: "corners.bin".into(),
            bytes: Arc::new(numbers),
        };
        let buffers = vec![Buffer::file(b"# see corners.bin\n".to_vec()), beside];
        let geometry = Geometry {
            positions: slots.positions(&buffers),
            triangles: vec![[0, 1, 2]],
            slots,
            names: Vec::new(),
            instances: Vec::new(),
            manifests: 0,
        };
        let asset = Asset::assembled(PathBuf::new(), Format::Obj, Packing::Plain, buffers, geometry).unwrap();
        let moved = asset
            .with_positions(&[[0.0; 3], [2.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
            .unwrap();
        assert_eq!(moved.mesh().area(), 1.0);
        assert_eq!(moved.content(), asset.content());

        let folder = tempfile::tempdir().unwrap();
        moved.save(folder.path().join("moved.obj"), false).unwrap();
        assert_eq!(
            fs::read(folder.path().join("moved.obj")).unwrap(),
            asset.content()
        );
        assert_eq!(
            fs::read(folder.path().join("corners.bin")).unwrap()[12..16],
            2.0_f32.to_le_bytes()
        );
        let again = asset.save(folder.path().join("other.obj"), false);
        let error = again.unwrap_err();
        assert!(matches!(error.problem, AssetProblem::Exists) && error.path.ends_with("corners.bin"));
    }
}
