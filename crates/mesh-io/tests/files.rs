//! Files are written back with new positions and nothing else changed.

mod files_common;

use files_common::{Fixture, fixtures, gzip};
use mesh::{TriMesh, Vec3, shapes};
use mesh_io::{Asset, Format, Precision, write_mesh};
use proptest::prelude::*;

fn sample() -> TriMesh {
    shapes::bumpy_sphere(2, 7)
}

fn moved(mesh: &TriMesh) -> Vec<[f64; 3]> {
    mesh.positions()
        .iter()
        .map(|[x, y, z]| [x * 1.01 + 1e-3, y - 0.1 * x, z * (1.0 + 1e-6 * x)])
        .collect()
}

/// Panics unless each number is the wanted one, rounded to the file's precision.
fn assert_held(held: &[[f64; 3]], wanted: &[[f64; 3]], fixture: &Fixture) {
    for (held, wanted) in held.as_flattened().iter().zip(wanted.as_flattened()) {
        let right = if fixture.double {
            held == wanted
        } else {
            *held as f32 == *wanted as f32
        };
        assert!(right, "{}: {held} for {wanted}", fixture.name);
    }
}

fn opened(bytes: Vec<u8>, format: Format) -> Asset {
    Asset::from_bytes(bytes, format).expect("a good file")
}

#[test]
fn every_format_shows_the_same_surface() {
    let mesh = sample();
    for fixture in fixtures(&mesh) {
        let asset = opened(fixture.bytes(), fixture.format);
        let seen = asset.mesh();
        assert_eq!(seen.vertex_count(), mesh.vertex_count(), "{}", fixture.name);
        assert_eq!(seen.triangle_count(), mesh.triangle_count(), "{}", fixture.name);
        for t in 0..mesh.triangle_count() {
            for (seen, true_corner) in seen.corners(t).iter().zip(mesh.corners(t)) {
                for axis in 0..3 {
                    assert!(
                        (seen[axis] - true_corner[axis]).abs() < 1e-6,
                        "{}: triangle {t}",
                        fixture.name
                    );
                }
            }
        }
    }
}

#[test]
fn the_content_tells_the_format() {
    for fixture in fixtures(&sample()) {
        assert_eq!(
            Format::of_content(&fixture.bytes()),
            Some(fixture.format),
            "{}",
            fixture.name
        );
        assert_eq!(
            Asset::from_bytes(gzip(&fixture.bytes()), None).unwrap().format(),
            fixture.format
        );
    }
}

/// Its bytes 80 to 84 would be the number of its facets.
#[test]
fn a_text_with_the_size_of_a_binary_stl_is_none() {
    for facets in [0_u8, 1] {
        let mut bytes = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n#".to_vec();
        bytes.resize(80, b' ');
        bytes.extend([facets, 0, 0, 0]);
        bytes.resize(84 + 50 * usize::from(facets), b' ');
        let asset = opened(bytes.clone(), Format::Obj);
        assert_eq!(
            asset.with_positions(asset.mesh().positions()).unwrap().to_bytes(),
            bytes
        );
    }
    let stl = write_mesh(&sample(), Format::Stl, Precision::Single);
    let refused = Asset::from_bytes(stl, Format::Obj).unwrap_err().to_string();
    assert!(refused.contains("the content is STL"), "{refused}");
}

/// Shorter numbers would bring the zeros to bytes 80 to 84, and the text would have become a binary STL of so many facets.
#[test]
fn an_ascii_stl_with_zero_bytes_is_refused() {
    let text = "solid with a name so long that what follows is no header\nfacet normal 0 0 1\nouter loop\nvertex 0.000000000 0 0 \u{b}\0\0\0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n";
    let refused = Asset::from_bytes(text.as_bytes().to_vec(), Format::Stl)
        .unwrap_err()
        .to_string();
    assert!(refused.contains("line 4: a zero byte"), "{refused}");
    opened(text.replace('\0', " ").into_bytes(), Format::Stl);
}

#[test]
fn with_unchanged_positions_the_file_is_identical() {
    for fixture in fixtures(&sample()) {
        for bytes in [fixture.bytes(), gzip(&fixture.bytes())] {
            let asset = opened(bytes.clone(), fixture.format);
            assert_eq!(*asset.to_bytes(), *bytes, "{}", fixture.name);
            let same = asset.with_positions(asset.mesh().positions()).unwrap();
            assert_eq!(*same.to_bytes(), *bytes, "{}", fixture.name);
        }
    }
}

#[test]
fn with_changed_positions_only_coordinates_differ_and_read_back_exactly() {
    for fixture in fixtures(&sample()) {
        let asset = opened(fixture.bytes(), fixture.format);
        let target = moved(asset.mesh());
        let changed = asset.with_positions(&target).unwrap();
        assert_ne!(*changed.to_bytes(), *asset.to_bytes());
        fixture.assert_only_coordinates_differ(&changed.to_bytes());

        let again = opened(changed.to_bytes().into_owned(), fixture.format);
        assert_eq!(again.mesh(), changed.mesh(), "{}", fixture.name);
        assert_held(again.mesh().positions(), &target, &fixture);
    }
}

#[test]
fn moving_there_and_back_restores_the_numbers() {
    for fixture in fixtures(&sample()) {
        let asset = opened(fixture.bytes(), fixture.format);
        let there = asset.with_positions(&moved(asset.mesh())).unwrap();
        let back = there.with_positions(asset.mesh().positions()).unwrap();
        fixture.assert_only_coordinates_differ(&back.to_bytes());
        assert_held(back.mesh().positions(), asset.mesh().positions(), &fixture);
    }
}

#[test]
fn a_coordinate_that_keeps_its_rounded_value_keeps_its_bytes() {
    let text = "v 0.10 +2.5e-1 -0\nv 1.00000 0 0\nv 0 1.0e0 0\nf 1 2 3\n";
    let asset = opened(text.into(), Format::Obj);
    let mut positions = asset.mesh().positions().to_vec();
    positions[0] = positions[0].map(|x| x * (1.0 + 1e-9));
    positions[1][0] = 1.5;
    let changed = asset.with_positions(&positions).unwrap();
    assert_eq!(*changed.to_bytes(), *text.replace("1.00000", "1.5").as_bytes());
    assert_eq!(changed.mesh().positions()[0], asset.mesh().positions()[0]);
}

#[test]
fn digits_that_single_precision_would_lose_make_a_text_file_double() {
    let read = |x: &str| {
        opened(
            format!("v {x} 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").into(),
            Format::Obj,
        )
    };
    let third = [[1.0 / 3.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let written =
        |x| String::from_utf8(read(x).with_positions(&third).unwrap().to_bytes().into_owned()).unwrap();
    assert!(written("0.123456791").starts_with("v 0.33333334 0 0\n"));
    // The second in metres of a country's grid, to the centimetre.
    for double in ["0.123456789", "523457.40", "0.1234567891"] {
        assert!(
            written(double).starts_with("v 0.3333333333333333 0 0\n"),
            "{double}"
        );
    }
}

#[test]
fn ascii_ply_has_the_precision_that_it_declares() {
    let written = |real: &str| {
        let header = format!(
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty {real} x\nproperty float y\nproperty float z\n"
        );
        let faces = "element face 1\nproperty list uchar int vertex_index\nend_header\n";
        let text = header + faces + "0.5 0 0\n1 0 0.1234567890123\n0 1 0\n3 0 1 2\n";
        let asset = opened(text.into(), Format::Ply);
        let mut positions = asset.mesh().positions().to_vec();
        positions[0] = [1.0 / 3.0; 3];
        String::from_utf8(asset.with_positions(&positions).unwrap().to_bytes().into_owned()).unwrap()
    };
    assert!(
        written("double")
            .contains("end_header\n0.3333333333333333 0.33333334 0.33333334\n1 0 0.1234567890123\n")
    );
    assert!(written("float32").contains("end_header\n0.33333334 0.33333334 0.33333334\n"));
}

/// As assimp writes a scene of whose meshes some have colours and others none.
#[test]
fn a_line_of_ascii_ply_may_end_after_the_coordinates() {
    let header = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
                  property uchar red\nproperty uchar green\nelement face 1\nproperty list uchar int vertex_index\nend_header\n";
    let text = header.to_owned() + "0 0 0 255 45\n1 0 0 0\n0 1 0\n3 0 1 2\n";
    let asset = opened(text.clone().into(), Format::Ply);
    let mut positions = asset.mesh().positions().to_vec();
    positions.iter_mut().for_each(|position| position[2] = 0.5);
    assert_eq!(
        asset.with_positions(&positions).unwrap().to_bytes(),
        text.replace("0 0 0 255", "0 0 0.5 255")
            .replace("1 0 0 0\n0 1 0\n", "1 0 0.5 0\n0 1 0.5\n")
            .as_bytes()
    );
    let cut = text.replace("0 1 0\n3", "0 1\n3").into_bytes();
    let refused = Asset::from_bytes(cut, Format::Ply).unwrap_err().to_string();
    assert!(
        refused.contains("the line ends before the value of property z"),
        "{refused}"
    );
}

#[test]
fn every_copy_of_a_vertex_moves_and_unused_vertices_stay() {
    let text = "v 0 0 0\nv 9 9 9\nv 1 0 0\nv 0 1 0\nv 1 0 -0\nv 0 1 0\nv 1 1 0\nf 1 3 4\nf 5 7 6\n";
    let asset = opened(text.into(), Format::Obj);
    assert_eq!((asset.file_vertex_count(), asset.mesh().vertex_count()), (7, 4));
    let lifted: Vec<_> = asset
        .mesh()
        .positions()
        .iter()
        .map(|&[x, y, _]| [x, y, 2.0])
        .collect();
    let expected = "v 0 0 2\nv 9 9 9\nv 1 0 2\nv 0 1 2\nv 1 0 2\nv 0 1 2\nv 1 1 2\nf 1 3 4\nf 5 7 6\n";
    assert_eq!(
        *asset.with_positions(&lifted).unwrap().to_bytes(),
        *expected.as_bytes()
    );
}

#[test]
fn gzip_keeps_the_name_and_the_time() {
    for fixture in fixtures(&sample()) {
        let asset = opened(gzip(&fixture.bytes()), fixture.format);
        assert!(asset.is_gzipped());
        let changed = asset.with_positions(&moved(asset.mesh())).unwrap();
        let packed = changed.to_bytes().into_owned();
        let header = flate2::bufread::GzDecoder::new(&packed[..])
            .header()
            .cloned()
            .unwrap();
        assert_eq!(header.filename(), Some(&b"original name"[..]));
        assert_eq!(header.comment(), Some(&b"kept"[..]));
        assert_eq!(header.mtime(), 1_234_567_890);
        let again = opened(packed, fixture.format);
        fixture.assert_only_coordinates_differ(again.content());
        assert_eq!(again.mesh(), changed.mesh());
    }
}

#[test]
fn polygons_and_strips_are_cut_into_triangles() {
    let pentagon = "v 0 0 0\nv 1 0 0\nv 2 1 0\nv 1 2 0\nv 0 2 0\nf 1 2 3 4 5\n";
    assert_eq!(
        opened(pentagon.into(), Format::Obj).mesh().triangles(),
        [[0, 1, 2], [0, 2, 3], [0, 3, 4]]
    );
    let strip = "ply\nformat ascii 1.0\nelement vertex 5\nproperty int x\nproperty int y\nproperty int z\n\
                 element tristrips 1\nproperty list int int vertex_indices\nend_header\n\
                 0 0 0\n1 0 0\n0 1 0\n1 1 0\n5 5 5\n8 0 1 2 3 -1 2 3 4\n";
    assert_eq!(
        opened(strip.into(), Format::Ply).mesh().triangles(),
        [[0, 1, 2], [2, 1, 3], [2, 3, 4]]
    );
}

#[test]
fn faces_may_come_before_their_vertices() {
    let text = "f 1 2 3\nv 0 0 0\nv 1 0 0\nv 0 1 0\n";
    assert_eq!(opened(text.into(), Format::Obj).mesh().triangles(), [[0, 1, 2]]);
}

#[test]
fn line_ends_of_three_kinds_byte_order_marks_and_headless_off_are_read() {
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3";
    let off = "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    for end in ["\n", "\r\n", "\r"] {
        assert_eq!(
            opened(obj.replace('\n', end).into(), Format::Obj)
                .mesh()
                .triangle_count(),
            1
        );
        assert_eq!(
            opened(off.replace('\n', end).into(), Format::Off)
                .mesh()
                .triangle_count(),
            1
        );
        let ply = String::from_utf8(files_common::ply_plain(&sample(), "ascii", "float").bytes()).unwrap();
        assert_eq!(
            opened(ply.replace('\n', end).into(), Format::Ply)
                .mesh()
                .vertex_count(),
            sample().vertex_count()
        );
    }
    assert_eq!(
        opened(format!("\u{feff}{obj}").into(), Format::Obj)
            .mesh()
            .triangle_count(),
        1
    );
    assert_eq!(opened(off[4..].into(), Format::Off).mesh().triangle_count(), 1);
}

#[test]
fn obj_geometry_agrees_with_tobj() {
    let fixture = files_common::obj(&sample(), "\n", 6);
    // Joined lines, colours on some vertices alone, and lines beside faces are beyond tobj.
    let text = String::from_utf8(fixture.bytes()).unwrap().replace("\\\n", " ");
    let options = tobj::LoadOptions {
        triangulate: true,
        ..Default::default()
    };
    let plain: String = text
        .lines()
        .filter(|line| !line.starts_with("l "))
        .map(without_colour)
        .collect();
    let (models, _) =
        tobj::load_obj_buf(&mut plain.as_bytes(), &options, |_| Ok(Default::default())).unwrap();
    let theirs = models.iter().flat_map(|m| {
        m.mesh
            .indices
            .iter()
            .map(|&i| m.mesh.positions[3 * i as usize..][..3].to_vec())
    });
    let asset = opened(fixture.bytes(), Format::Obj);
    let mesh = asset.mesh();
    let ours = mesh
        .triangles()
        .as_flattened()
        .iter()
        .map(|&v| mesh.positions()[v as usize].map(|x| x as f32).to_vec());
    assert_eq!(theirs.collect::<Vec<_>>(), ours.collect::<Vec<_>>());
}

fn without_colour(line: &str) -> String {
    let words: Vec<&str> = line.split('#').next().unwrap_or("").split_whitespace().collect();
    let kept = if words.first() == Some(&"v") {
        4
    } else {
        words.len()
    };
    words[..kept].join(" ") + "\n"
}

#[test]
fn a_mesh_survives_a_round_trip_through_every_exported_format() {
    let mesh = sample();
    for format in [Format::Obj, Format::Ply, Format::Off] {
        let asset = opened(write_mesh(&mesh, format, Precision::Double), format);
        assert_eq!(asset.mesh(), &mesh, "{format}");
    }
    for format in [Format::Obj, Format::Ply, Format::Off, Format::Stl] {
        let asset = opened(write_mesh(&mesh, format, Precision::Single), format);
        for t in 0..mesh.triangle_count() {
            let single = |corners: [Vec3; 3]| corners.map(|p| p.0.map(|x| x as f32));
            assert_eq!(
                single(asset.mesh().corners(t)),
                single(mesh.corners(t)),
                "{format}"
            );
        }
    }
}

#[test]
fn saving_is_atomic_and_never_overwrites_unasked() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.PLY");
    std::fs::write(
        &path,
        files_common::ply_plain(&sample(), "ascii", "float").bytes(),
    )
    .unwrap();
    let asset = Asset::open(&path).unwrap();
    let changed = asset.with_positions(&moved(asset.mesh())).unwrap();

    let refusal = changed.save(&path, false).unwrap_err().to_string();
    assert!(refusal.contains("exists already"), "{refusal}");
    assert_eq!(*std::fs::read(&path).unwrap(), *asset.to_bytes());
    changed.save(&path, true).unwrap();
    assert_eq!(Asset::open(&path).unwrap().mesh(), changed.mesh());
    changed.save(folder.path().join("b.ply"), false).unwrap();

    for (name, expected) in [
        ("b.obj", "ends in .ply"),
        ("b.ply.gz", "ends in .ply"),
        ("missing/b.ply", "folder does not exist"),
    ] {
        let refusal = changed
            .save(folder.path().join(name), false)
            .unwrap_err()
            .to_string();
        assert!(refusal.contains(expected) && refusal.contains(name), "{refusal}");
    }
    let mut left: Vec<_> = std::fs::read_dir(folder.path())
        .unwrap()
        .map(|e| e.unwrap().file_name())
        .collect();
    left.sort();
    assert_eq!(left, ["a.PLY", "b.ply"]);
}

#[cfg(unix)]
#[test]
fn overwriting_follows_a_link_and_keeps_permissions() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    let (file, link) = (folder.path().join("a.off"), folder.path().join("link.off"));
    std::fs::write(&file, files_common::off(&sample(), "OFF").bytes()).unwrap();
    std::fs::set_permissions(&file, std::fs::Permissions::from_mode(0o640)).unwrap();
    std::os::unix::fs::symlink("a.off", &link).unwrap();
    let asset = Asset::open(&link).unwrap();
    asset
        .with_positions(&moved(asset.mesh()))
        .unwrap()
        .save(&link, true)
        .unwrap();
    assert!(std::fs::symlink_metadata(&link).unwrap().is_symlink());
    assert_ne!(*std::fs::read(&file).unwrap(), *asset.to_bytes());
    assert_eq!(
        std::fs::metadata(&file).unwrap().permissions().mode() & 0o777,
        0o640
    );
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn the_mesh_after_a_change_is_what_a_reader_of_the_file_sees(
        which in 0..23_usize,
        exponent in -30..30_i32,
        values in prop::collection::vec(-1.0..1.0_f64, 36),
    ) {
        let mut all = fixtures(&shapes::icosphere(0));
        let fixture = all.swap_remove(which % all.len());
        let asset = opened(fixture.bytes(), fixture.format);
        // Vertices apart by more than they move, so that none are welded.
        let place = |(v, p): (usize, &[f64; 3])| p.map(|x| (x + 3.0 * v as f64) * 10_f64.powi(exponent));
        let target: Vec<[f64; 3]> = values.as_chunks::<3>().0.iter().enumerate().map(place).collect();
        let changed = asset.with_positions(&target).unwrap();
        fixture.assert_only_coordinates_differ(&changed.to_bytes());
        let again = opened(changed.to_bytes().into_owned(), fixture.format);
        prop_assert_eq!(again.mesh(), changed.mesh());
        assert_held(changed.mesh().positions(), &target, &fixture);
    }
}
