//! What an OBJ or a PLY refers to goes with it, and nothing else does.

use std::fs;
use std::path::Path;

use mesh::{Similarity, shapes};
use mesh_io::{Asset, Format, Precision, companions_of, write_mesh};

const PNG: &[u8] = b"\x89PNG and so on";
const TGA: [u8; 20] = {
    let mut bytes = [0; 20];
    (bytes[2], bytes[16]) = (2, 24);
    bytes
};

fn obj(head: &str) -> Vec<u8> {
    let mesh = write_mesh(&shapes::bumpy_sphere(1, 7), Format::Obj, Precision::Single);
    [head.as_bytes(), &mesh].concat()
}

fn names(path: &Path) -> Vec<String> {
    let asset = Asset::open(path).expect("a model");
    asset.companions().map(|(name, _)| name.into()).collect()
}

#[test]
fn materials_and_their_pictures_go_with_an_obj() {
    let folder = tempfile::tempdir().unwrap();
    let beside = |name: &str| folder.path().join(name);
    fs::create_dir(beside("tex")).unwrap();
    for name in ["skin.png", "old wood.png", "tex/bump.png", "unnamed.png"] {
        fs::write(beside(name), PNG).unwrap();
    }
    fs::write(beside("sky.tga"), TGA).unwrap();
    let materials = "# by hand\r\nnewmtl body\r\n\tmap_Kd skin.png\r\n  map_Ka -s 1 1 1 -o 0.5 0 0 old wood.png\r\nbump -bm 0.3 tex\\bump.png\r\nrefl -type sphere sky.tga\r\nmap_d gone.png\r\n";
    fs::write(beside("my materials.mtl"), materials).unwrap();
    fs::write(beside("b.mtl"), "newmtl b\nmap_Kd skin.png\n").unwrap();
    let model = beside("model.obj");
    fs::write(
        &model,
        obj("\u{feff}mtllib my materials.mtl\nmtllib b.mtl c.mtl\n"),
    )
    .unwrap();
    let expected = [
        "my materials.mtl",
        "b.mtl",
        "skin.png",
        "old wood.png",
        "tex/bump.png",
        "sky.tga",
    ];
    assert_eq!(names(&model), expected);
    let listed = companions_of(&model).unwrap().into_iter();
    assert!(listed.clone().all(|companion| !companion.is_buffer));
    assert!(listed.map(|companion| companion.name).eq(expected));

    let other = tempfile::tempdir().unwrap();
    let asset = Asset::open(&model).unwrap();
    let moved: Vec<_> = asset
        .mesh()
        .positions()
        .iter()
        .map(|p| p.map(|x| 1.5 * x))
        .collect();
    let signed = asset.with_positions(&moved).unwrap();
    signed.save(other.path().join("signed.obj"), false).unwrap();
    assert_eq!(names(&other.path().join("signed.obj")), expected);
    assert_eq!(fs::read(other.path().join("tex/bump.png")).unwrap(), PNG);
    // Beside the original all of it is there already.
    signed.save(beside("signed.obj"), false).unwrap();

    fs::write(&model, obj("mtllib b.mtl\nvn 0 0 1\n")).unwrap();
    let turned = Similarity {
        rotation: [[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]],
        ..Similarity::IDENTITY
    };
    let moved = Asset::open(&model).unwrap().moved_by(&turned).unwrap();
    assert!(moved.asset.content().windows(9).any(|line| line == b"vn 0 -1 0"));
    assert!(
        moved
            .asset
            .companions()
            .map(|(name, _)| name)
            .eq(["b.mtl", "skin.png"])
    );
}

#[test]
fn pictures_that_a_comment_names_go_with_a_ply() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = write_mesh(&shapes::bumpy_sphere(1, 7), Format::Ply, Precision::Single);
    let header = b"ply\nformat binary_little_endian 1.0\n";
    let rest = mesh.strip_prefix(header).unwrap();
    let text = [
        header,
        &b"comment TextureFile my skin.png\ncomment skin.png\n"[..],
        rest,
    ]
    .concat();
    let path = folder.path().join("model.ply");
    fs::write(&path, text).unwrap();
    fs::write(folder.path().join("my skin.png"), PNG).unwrap();
    assert_eq!(names(&path), ["my skin.png"]);
}

/// Whoever gets a copy gets all that goes with it.
#[test]
fn nothing_goes_with_a_strangers_obj_that_is_no_material_and_no_picture() {
    let outside = tempfile::tempdir().unwrap();
    let folder = outside.path().join("models");
    fs::create_dir(&folder).unwrap();
    fs::write(outside.path().join("secret.png"), PNG).unwrap();
    fs::write(folder.join("owner.pem"), "-----BEGIN PRIVATE KEY-----\n").unwrap();
    fs::write(folder.join(".env"), "PASSWORD=1\n").unwrap();
    fs::write(
        folder.join("notes.tga"),
        "a letter that is longer than any header",
    )
    .unwrap();
    fs::write(
        folder.join("a.mtl"),
        "newmtl a\nmap_Kd ../secret.png\nmap_Kd .env\nmap_Kd notes.tga\n",
    )
    .unwrap();
    let path = folder.join("model.obj");
    let absolute = outside.path().join("secret.png");
    let head = format!(
        "mtllib owner.pem .env ../secret.png {} model.obj a.mtl\n",
        absolute.display()
    );
    fs::write(&path, obj(&head)).unwrap();
    assert_eq!(names(&path), ["a.mtl"]);
    // Whoever signs is told where a model names the key.
    let listed: Vec<String> = companions_of(&path)
        .unwrap()
        .into_iter()
        .map(|c| c.name)
        .collect();
    assert!(listed.contains(&"owner.pem".into()), "{listed:?}");
}

#[test]
fn a_flood_of_names_is_soon_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("model.obj");
    let many: String = (0..200_000).map(|i| format!("mtllib {i} a b c\n")).collect();
    let long = format!("mtllib {}\n", "a ".repeat(1 << 20));
    fs::write(&path, obj(&(many + &long))).unwrap();
    assert_eq!(names(&path), [""; 0]);
}
