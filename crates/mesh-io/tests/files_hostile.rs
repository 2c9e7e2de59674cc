//! Files that were made to cost time or memory, or to pass for what they are not. Each was found by a fuzzer, or by thinking like one.

#[cfg(unix)]
use mesh_io::LARGEST;
use mesh_io::{Asset, AssetError, AssetProblem, Format};

const TRIANGLE: &str = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n\
                        property list uchar int vertex_indices\n";

fn refusal(format: Format, bytes: impl Into<Vec<u8>>) -> AssetError {
    Asset::from_bytes(bytes, format).expect_err("a bad file")
}

/// A decimal that is declared as single precision and is too small for it reads as what it says.
#[test]
fn a_number_beyond_single_precision_does_not_stand_for_another() {
    let header = format!("ply\nformat ascii 1.0\n{TRIANGLE}end_header\n");
    let asset = Asset::from_bytes(header + "0 0 0\n1e-60 0 0\n0 1 0\n3 0 1 2\n", Format::Ply).unwrap();
    let mut positions = asset.mesh().positions().to_vec();
    assert_eq!(positions[1][0], 1e-60);
    assert_eq!(
        asset.with_positions(&positions).unwrap().to_bytes(),
        asset.to_bytes()
    );
    positions[1][0] = 0.5;
    assert_eq!(
        asset.with_positions(&positions).unwrap().mesh().positions()[1][0],
        0.5
    );
}

/// Each name in a header is compared with all before it: by looking them up, or this takes hours.
#[test]
fn a_header_of_a_million_names_is_read_in_no_time() {
    let mut properties = String::from("ply\nformat ascii 1.0\nelement other 1\n");
    let mut elements = String::from("ply\nformat ascii 1.0\n");
    for number in 0..1_000_000 {
        properties += &format!("property int {number:06}\n");
        elements += &format!("element {number:06} 0\n");
    }
    for header in [&properties, &elements] {
        let problem = refusal(Format::Ply, header.clone() + "end_header\n").to_string();
        assert!(problem.contains("declares no element vertex"), "{problem}");
    }
    let twice = refusal(Format::Ply, properties + "property int 000007\n").to_string();
    assert!(twice.contains("this property is declared twice"), "{twice}");
    let twice = refusal(Format::Ply, elements + "element 000007 1\n").to_string();
    assert!(twice.contains("this element is declared twice"), "{twice}");
}

/// Such a file takes no room on most disks, and none in memory.
#[cfg(unix)]
#[test]
fn files_larger_than_the_largest_are_refused_unread() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["a.obj", "a.ply", "a.stl", "a.off", "a.obj.gz", "a"] {
        let path = folder.path().join(name);
        let file = std::fs::File::create(&path).unwrap();
        file.set_len(LARGEST + 1).unwrap();
        let error = Asset::open(&path).unwrap_err();
        assert!(matches!(error.problem, AssetProblem::TooLarge { .. }), "{error}");
        let message = error.to_string();
        assert!(
            message.contains(name) && message.contains("simplify the model"),
            "{message}"
        );
    }
}

/// A face may name one vertex as often as the file is long: that is as many triangles, and no more.
#[test]
fn faces_of_a_million_corners_are_read_in_no_time() {
    let corners = 1_000_000;
    let vertices = "0 0 0\n1 0 0\n0 1 0\n";
    let same = " 1".repeat(corners);
    let obj = format!(
        "v {}f 1 2 3\nf{same}\n",
        vertices.trim_end().replace('\n', "\nv ") + "\n"
    );
    let off = format!("OFF\n3 2 0\n{vertices}3 0 1 2\n{corners}{same}\n");
    let ply = format!("ply\nformat ascii 1.0\n{TRIANGLE}end_header\n{vertices}3 0 1 2\n{corners}{same}\n")
        .replace("element face 1", "element face 2");
    for (format, text) in [(Format::Obj, obj), (Format::Off, off), (Format::Ply, ply)] {
        let asset = Asset::from_bytes(text, format).unwrap();
        assert_eq!(asset.welded().summary().file_triangles, corners - 1, "{format}");
        assert_eq!(asset.mesh().triangle_count(), 1, "{format}");
    }
}

/// What a vertex may lack is not told of each.
#[test]
fn a_million_vertices_without_their_colours_are_read_in_no_time() {
    let count = 1_000_000;
    let header = format!(
        "ply\nformat ascii 1.0\nelement vertex {count}\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
    );
    let vertices = "0 0 0\n1 0 0\n0 1 0\n".to_owned() + &"0 0 0\n".repeat(count - 3);
    let asset = Asset::from_bytes(header + &vertices + "3 0 1 2\n", Format::Ply).unwrap();
    assert_eq!(asset.mesh().triangle_count(), 1);
}

/// A line may be as long as the file, and so may a word, a comment, and what is joined of lines.
#[test]
fn long_lines_and_words_are_read_in_no_time() {
    let count = 4_000_000;
    let triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    for filler in [
        "#".repeat(count),
        "x".repeat(count),
        "\\\n".repeat(count / 2),
        " \\\r\n".repeat(count / 4),
        "\n".repeat(count),
        "\r".repeat(count),
        "\u{FEFF}".repeat(count / 3),
    ] {
        let text = format!("{filler}\n{triangle}{filler}");
        let asset = Asset::from_bytes(text, Format::Obj).unwrap();
        assert_eq!(asset.mesh().triangle_count(), 1);
    }
    let digits = format!("v 0.{} 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "1".repeat(count));
    let asset = Asset::from_bytes(digits, Format::Obj).unwrap();
    assert_eq!(asset.mesh().positions()[0][0], 1.0 / 9.0);
    let word = refusal(Format::Off, "x".repeat(count)).to_string();
    assert!(word.len() < 300, "{}", word.len());
}

/// Vertices at one place, however many.
#[test]
fn a_million_vertices_at_one_place_are_welded_in_no_time() {
    let count = 1_000_000;
    let text = "v 0 0 0\n".repeat(count) + "v 1 0 0\nv 0 1 0\n";
    let faces: String = (1..=count)
        .map(|v| format!("f {v} {} {}\n", count + 1, count + 2))
        .collect();
    let asset = Asset::from_bytes(text + &faces, Format::Obj).unwrap();
    assert_eq!(asset.mesh().vertex_count(), 3);
    let mut positions = asset.mesh().positions().to_vec();
    positions[0][2] = 0.5;
    let moved = asset.with_positions(&positions).unwrap();
    assert_eq!(moved.content().len(), asset.content().len() + 2 * count);
}
