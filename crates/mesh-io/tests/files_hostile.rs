//! Files that were made to cost time or memory, or to pass for what they are not. Each was found by a fuzzer, or by thinking like one.

use mesh_io::{Asset, AssetError, AssetProblem, Format};

const TRIANGLE: &str = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n\
                        property list uchar int vertex_indices\n";

fn refusal(format: Format, bytes: impl Into<Vec<u8>>) -> AssetError {
    Asset::from_bytes(bytes, format).expect_err("a bad file")
}

/// A decimal that is declared as single precision and lies beyond it reads as what it says; another such number can't be written.
#[test]
fn a_number_beyond_single_precision_does_not_stand_for_another() {
    let header = format!("ply\nformat ascii 1.0\n{TRIANGLE}end_header\n");
    let asset = Asset::from_bytes(header + "0 0 0\n1e200 0 0\n0 1 0\n3 0 1 2\n", Format::Ply).unwrap();
    let mut positions = asset.mesh().positions().to_vec();
    assert_eq!(positions[1][0], 1e200);
    assert_eq!(
        asset.with_positions(&positions).unwrap().to_bytes(),
        asset.to_bytes()
    );
    positions[1][0] = 2e200;
    let refused = asset.with_positions(&positions).unwrap_err().problem;
    assert!(
        matches!(refused, AssetProblem::Unwritable { vertex: 1, .. }),
        "{refused}"
    );
    positions[1][0] = 0.5;
    assert_eq!(asset.with_positions(&positions).unwrap().mesh().positions()[1][0], 0.5);
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
