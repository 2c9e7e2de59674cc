//! Small inputs to begin from, made of the shapes and fixtures of the tests.

#[path = "../../mesh-io/tests/files_common/mod.rs"]
mod files_common;
#[path = "../../mesh-io/tests/gltf_common/mod.rs"]
mod gltf_common;

use mesh::{TriMesh, shapes};
use mesh_io::{Format, Precision, write_mesh};

pub(crate) use files_common::gzip;

/// What once broke the target: a vertex is so far away that many others, which two meshes hold differently, lie at one point beside that.
const FOUND_GLB: [&[u8]; 1] = [include_bytes!("../found/scene_with_a_part_far_away.glb")];

/// And the 3MF that did: the comment of the archive holds others, of which a reader takes one when lengths have changed.
const FOUND_3MF: &[u8] = include_bytes!("../found/archives_in_a_comment.3mf");

/// And the OBJ: turned, it has the size of a binary STL without facets, and zeros where that has their number.
const FOUND_OBJ: &[u8] = include_bytes!("../found/zeros_after_a_face.obj");

/// And the STL: with shorter numbers the zeros of its text come to stand where binary STL counts its facets.
const FOUND_STL: &[u8] = include_bytes!("../found/zeros_in_a_text.stl");

/// Files of a format: with all that may stand around coordinates, and with nothing else.
pub(crate) fn of_format(format: Format) -> Vec<Vec<u8>> {
    let of_mesh = |mesh: TriMesh| {
        let fixtures = files_common::fixtures(&mesh).into_iter();
        let mut files: Vec<_> = fixtures
            .filter(|fixture| fixture.format == format)
            .map(|fixture| fixture.bytes())
            .collect();
        files.push(write_mesh(&mesh, format, Precision::Single));
        files.push(write_mesh(&mesh, format, Precision::Double));
        files
    };
    let mut files: Vec<Vec<u8>> = meshes().into_iter().flat_map(of_mesh).collect();
    let scenes = gltf_common::scenes();
    match format {
        Format::Glb => {
            files.extend(scenes.iter().map(gltf_common::Scene::glb));
            files.extend(FOUND_GLB.map(<[u8]>::to_vec));
        }
        Format::Gltf => files.extend(scenes.iter().map(gltf_common::Scene::gltf)),
        Format::ThreeMf => files.push(FOUND_3MF.to_vec()),
        Format::Obj => files.push(FOUND_OBJ.to_vec()),
        Format::Stl => files.push(FOUND_STL.to_vec()),
        _ => {}
    }
    files
}

/// A file of each format, gzipped.
pub(crate) fn gzipped() -> Vec<Vec<u8>> {
    let fixtures = files_common::fixtures(&shapes::tetrahedron());
    fixtures.iter().map(|fixture| gzip(&fixture.bytes())).collect()
}

/// Few vertices: a fuzzer is fast on small inputs.
fn meshes() -> [TriMesh; 4] {
    [
        shapes::tetrahedron(),
        shapes::moebius_strip(5),
        shapes::book(3),
        shapes::disjoint_union(&[
            shapes::tetrahedron(),
            shapes::translated(&shapes::tetrahedron(), [1e6, -1e-6, 3.0]),
        ]),
    ]
}
