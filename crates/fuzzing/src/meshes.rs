//! Mesh files: what is read is written back byte for byte, and moving vertices changes coordinates and nothing else.

use mesh::{MeshError, Similarity};
use mesh_io::{Asset, AssetError, AssetProblem, Format, Precision, write_mesh};

/// Reads a file of a format, gzipped or not; without a format, the content decides.
pub(crate) fn check(bytes: &[u8], format: Option<Format>) {
    let Ok(asset) = Asset::from_bytes(bytes, format) else {
        return;
    };
    assert_eq!(*asset.to_bytes(), *bytes, "a file that nobody changed");
    let same = asset.with_positions(asset.mesh().positions());
    let same = same.expect("a file holds the positions that were read from it");
    assert_eq!(*same.to_bytes(), *bytes, "positions that are those of the file");
    check_moved(&asset);
    check_turned(&asset);
    check_copies(&asset);
    check_rig(&asset);
}

/// Reads joints and weights, which are of the mesh's vertices and add up to 1, and morph targets, each of which moves some of them.
fn check_rig(asset: &Asset) {
    let Ok(Some(rig)) = asset.rig() else { return };
    assert_eq!(rig.vertices(), asset.mesh().vertex_count());
    for v in 0..rig.vertices() {
        let weights = rig.weights_of(v);
        let sum: f64 = weights.iter().map(|&(_, weight)| weight).sum();
        assert!(
            weights.is_empty() || (sum - 1.0).abs() < 1e-9,
            "weights of a vertex"
        );
        assert!(weights.iter().all(|&(joint, _)| (joint as usize) < rig.joints()));
    }
    for target in rig.targets() {
        let is_one = |&(v, offset): &(u32, [f64; 3])| {
            (v as usize) < rig.vertices() && offset.iter().all(|x| x.is_finite()) && offset != [0.0; 3]
        };
        assert!(!target.is_empty() && target.is_sorted_by_key(|&(v, _)| v));
        assert!(target.iter().all(is_one), "offsets of a morph target");
    }
}

/// Moves every vertex, and reads again what was written.
fn check_moved(asset: &Asset) {
    let positions = moved(asset.mesh().positions());
    let moved = match asset.with_positions(&positions) {
        Ok(moved) => moved,
        // Integers, and models that would be too small or too large.
        Err(AssetError {
            problem:
                AssetProblem::Unwritable { .. }
                | AssetProblem::Geometry(MeshError::TooSmall { .. } | MeshError::TooFar { .. }),
            ..
        }) => return,
        Err(error) => panic!("{error}"),
    };
    if !is_placed(asset.format()) {
        for (wanted, found) in positions.iter().zip(moved.mesh().positions()) {
            for axis in 0..3 {
                let (wanted, found) = (wanted[axis], found[axis]);
                let single = wanted as f32 == found as f32 && (wanted as f32).is_finite();
                assert!(wanted == found || single, "{wanted} became {found}");
            }
        }
    }
    let twice = moved
        .with_positions(&positions)
        .expect("they were written before");
    if twice.content() != moved.content() {
        // Vertices that are one but for rounding keep what they differ by, which rounding may change.
        let has_merged = asset.welded().summary().merged_vertices > 0;
        assert!(
            is_placed(asset.format()) && has_merged && twice.mesh().positions() == moved.mesh().positions(),
            "what was rounded once is rounded so again"
        );
    }
    if !is_placed(asset.format()) {
        check_only_numbers_differ(asset.content(), moved.content());
    }

    let again = match Asset::from_bytes(moved.to_bytes(), asset.format()) {
        Ok(again) => again,
        // Vertices that were rounded onto each other are one for the next reader.
        Err(AssetError {
            problem: AssetProblem::Geometry(MeshError::OnlyRepeatedVertices { .. }),
            ..
        }) => return,
        Err(error) => panic!("what was written is not read: {error}"),
    };
    assert_eq!(again.file_vertex_count(), asset.file_vertex_count());
    assert_eq!(
        again.welded().summary().file_triangles,
        asset.welded().summary().file_triangles
    );
    if is_placed(asset.format()) {
        // Surfaces that meet but for rounding are joined where they are that near, before and after.
        return;
    }
    for (here, there) in asset.welded().vertex_of().iter().zip(again.welded().vertex_of()) {
        if let (Some(here), Some(there)) = (*here, *there) {
            let (written, read) = (
                moved.mesh().positions()[here as usize],
                again.mesh().positions()[there as usize],
            );
            assert_eq!(written, read, "a position as it was written, and as it is read");
        }
    }
}

/// Turns and mirrors the whole, with all directions that the file holds.
fn check_turned(asset: &Asset) {
    let similarity = Similarity {
        scale: 0.75,
        translation: [0.5, -1.0, 2.0],
        rotation: [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]],
    };
    let Ok(turned) = asset.moved_by(&similarity) else {
        return;
    };
    let positions = similarity.apply_all(asset.mesh().positions());
    let moved = asset.with_positions(&positions).expect("it was done just now");
    assert_eq!(
        turned.asset.mesh().positions(),
        moved.mesh().positions(),
        "directions change no position"
    );
    match Asset::from_bytes(turned.asset.to_bytes(), asset.format()) {
        Ok(again) => assert_eq!(again.file_vertex_count(), asset.file_vertex_count()),
        Err(AssetError {
            problem: AssetProblem::Geometry(MeshError::OnlyRepeatedVertices { .. }),
            ..
        }) => {}
        Err(error) => panic!("what was turned is not read: {error}"),
    }
}

/// New positions, each vertex and axis moved otherwise; a number that would become infinite stays.
fn moved(positions: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let moved = |(vertex, position): (usize, &[f64; 3])| {
        std::array::from_fn(|axis| {
            let step = ((7 * vertex + 3 * axis) % 11) as f64 / 64.0 - 0.07;
            let x = position[axis] * 0.8125 + step;
            if x.is_finite() { x } else { position[axis] }
        })
    };
    positions.iter().enumerate().map(moved).collect()
}

/// Whether a file of the format may say where its vertices are shown, so that rounding depends on the file, and may hold integers or Base64 in place of
/// numbers.
fn is_placed(format: Format) -> bool {
    !matches!(format, Format::Obj | Format::Ply | Format::Stl | Format::Off)
}

/// Binary numbers keep their size. Of texts, all is the same but words that are numbers.
fn check_only_numbers_differ(old: &[u8], new: &[u8]) {
    if old.len() == new.len() {
        return;
    }
    let (old, new) = (words(old), words(new));
    assert_eq!(old.len(), new.len(), "as many words as before");
    for (old, new) in old.into_iter().zip(new) {
        let numbers = is_number(old) && is_number(new);
        assert!(
            numbers || old == new,
            "{} became {}",
            old.escape_ascii(),
            new.escape_ascii()
        );
    }
}

/// Words and what separates them, one character each.
fn words(text: &[u8]) -> Vec<&[u8]> {
    let separates = |b: &u8| b" \t\r\n\x0B\x0C\\#,:[]{}\"".contains(b);
    let mut words = Vec::new();
    for word in text.split_inclusive(separates) {
        match word.split_last() {
            Some((last, rest)) if separates(last) => words.extend([rest, std::slice::from_ref(last)]),
            _ => words.push(word),
        }
    }
    words
}

fn is_number(word: &[u8]) -> bool {
    std::str::from_utf8(word).is_ok_and(|word| word.parse::<f64>().is_ok())
}

/// New files with nothing but the mesh hold the mesh.
fn check_copies(asset: &Asset) {
    for format in [Format::Obj, Format::Off, Format::Ply] {
        let copy = Asset::from_bytes(write_mesh(asset.mesh(), format, Precision::Double), format);
        let copy = copy.expect("a file that we wrote ourselves");
        assert_eq!(copy.mesh(), asset.mesh(), "{format}");
    }
}
