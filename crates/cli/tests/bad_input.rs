//! Whatever is wrong with what a command is given, it ends with exit code 2 and one line that names the file, the place and
//! the remedy; no file is left, none is changed, and no memory is taken because a header says so.

use crate::common::{Folder, model};
use mesh::{TriMesh, shapes};
use mesh_io::Precision;
use serde_json::Value;

const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
                   element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
const OBJ: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
const OFF: &str = "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
const STL: &str = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid a\n";

const EMBED: &str = "embed model.ply -o out.ply --key owner.pem --chip-rate 1";
const VERIFY: &str =
    "verify signed.ply --original model.ply --certificate signed.ply.cert.json --public-key owner.pub.pem";

/// One option of `VERIFY` with another file.
fn verify_with(option: &str, file: &str) -> String {
    let mut words: Vec<&str> = VERIFY.split(' ').collect();
    let at = words
        .iter()
        .position(|word| *word == option)
        .expect("an option of VERIFY");
    words[at + 1] = file;
    words.join(" ")
}

/// In every command, as every mesh that the command reads.
fn refused_everywhere(folder: &Folder, name: &str, words: &[&str]) {
    let extension = name.rsplit('.').next().unwrap_or_default();
    let words: Vec<&str> = [&[name], words].concat();
    for line in [
        format!("inspect {name}"),
        format!("inspect {name} --json"),
        format!("spectrum {name} -k 2 -o out.npz"),
        format!("compare {name} model.ply"),
        format!("compare model.ply {name} --heatmap out.png"),
        format!("embed {name} -o out.{extension} --key owner.pem"),
        VERIFY.replacen("signed.ply", name, 1),
        verify_with("--original", name),
        format!("align {name} model.ply -o out.{extension}"),
        format!("align model.ply {name} -o out.ply"),
    ] {
        folder.refused(&line, &words);
    }
}

#[test]
fn files_that_hold_no_mesh_are_refused_by_every_command() {
    let binary_ply = |count: u64| {
        let header = format!(
            "ply\nformat binary_little_endian 1.0\nelement vertex {count}\nproperty float x\nproperty float y\n\
             property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
        );
        [header.as_bytes(), &[0; 36]].concat()
    };
    let gzipped = {
        let folder = Folder::empty();
        folder.write_mesh("model.ply.gz", &model(), Precision::Double);
        folder.read("model.ply.gz")
    };
    let stl_of =
        |count: u32, facets: usize| [&[b' '; 80][..], &count.to_le_bytes(), &vec![0; 50 * facets]].concat();
    type Case<'a> = (&'a str, Vec<u8>, &'a [&'a str]);
    let table: &[Case<'_>] = &[
        // Empty.
        ("empty.obj", vec![], &["the file is empty", "write it again"]),
        ("empty.ply.gz", vec![], &["the file is empty"]),
        // Truncated.
        (
            "cut.ply",
            PLY[..PLY.len() - 12].into(),
            &["do not fit", "cut short", "export it again"],
        ),
        ("cut_header.ply", PLY[..60].into(), &["header"]),
        (
            "cut_binary.ply",
            binary_ply(3)[..binary_ply(3).len() - 20].into(),
            &["byte"],
        ),
        (
            "cut.off",
            OFF[..OFF.len() - 10].into(),
            &["line 5", "cut short", "export it again"],
        ),
        ("cut.stl", STL[..90].into(), &["line", "end"]),
        ("cut_binary.stl", stl_of(9, 8), &["facets"]),
        (
            "cut.ply.gz",
            gzipped[..gzipped.len() / 2].into(),
            &["gzip", "cut short", "again"],
        ),
        // Counts beyond what the file can hold.
        (
            "huge.ply",
            PLY.replace("vertex 3", "vertex 4294967295").into(),
            &["4294967295"],
        ),
        (
            "huge_faces.ply",
            PLY.replace("face 1", "face 99999999999").into(),
            &["99999999999"],
        ),
        ("huge_binary.ply", binary_ply(4_000_000_000), &["4000000000"]),
        (
            "beyond.ply",
            PLY.replace("vertex 3", "vertex 99999999999999999999999").into(),
            &["line 3"],
        ),
        (
            "huge.off",
            OFF.replace("3 1 0", "4000000000 1 0").into(),
            &["4000000000"],
        ),
        ("huge.stl", stl_of(u32::MAX, 1), &["4294967295"]),
        // Numbers that are none.
        (
            "nan.obj",
            OBJ.replace("v 1 0 0", "v nan 0 0").into(),
            &["line 2", "nan"],
        ),
        (
            "infinite.obj",
            OBJ.replace("v 1 0 0", "v 1 inf 0").into(),
            &["line 2", "inf"],
        ),
        (
            "overflow.obj",
            OBJ.replace("v 1 0 0", "v 1 1e999 0").into(),
            &["line 2"],
        ),
        (
            "nan.ply",
            PLY.replace("1 0 0\n", "nan 0 0\n").into(),
            &["line 11", "nan"],
        ),
        (
            "infinite.off",
            OFF.replace("1 0 0\n", "-inf 0 0\n").into(),
            &["line 4", "inf"],
        ),
        (
            "nan.stl",
            STL.replace("vertex 1 0 0", "vertex NaN 0 0").into(),
            &["line 5", "NaN"],
        ),
        (
            "word.obj",
            OBJ.replace("v 1 0 0", "v one 0 0").into(),
            &["line 2", "one"],
        ),
        // Indices of vertices that there are not.
        (
            "index.obj",
            OBJ.replace("f 1 2 3", "f 1 2 4").into(),
            &["line 4", "4"],
        ),
        (
            "zero.obj",
            OBJ.replace("f 1 2 3", "f 0 1 2").into(),
            &["line 4", "0"],
        ),
        (
            "negative.obj",
            OBJ.replace("f 1 2 3", "f -1 -2 -4").into(),
            &["line 4", "-4"],
        ),
        (
            "index.ply",
            PLY.replace("3 0 1 2", "3 0 1 3").into(),
            &["line 13", "3"],
        ),
        (
            "index.off",
            OFF.replace("3 0 1 2", "3 0 1 3").into(),
            &["line 6", "3"],
        ),
        // Nothing with a surface.
        (
            "points.obj",
            OBJ.replace("f 1 2 3\n", "").into(),
            &["no triangles", "point cloud"],
        ),
        (
            "points.ply",
            PLY.replace("face 1", "face 0").replace("3 0 1 2\n", "").into(),
            &["no triangles"],
        ),
        (
            "points.off",
            "OFF\n3 0 0\n0 0 0\n1 0 0\n0 1 0\n".into(),
            &["no triangles"],
        ),
        (
            "point.obj",
            OBJ.replace("1 0 0", "0 0 0").replace("0 1 0", "0 0 0").into(),
            &["same point", "precision"],
        ),
        // Names that promise something else.
        ("really_ply.obj", PLY.into(), &["PLY", "rename it to end in .ply"]),
        ("really_off.stl", OFF.into(), &["OFF", "rename it to end in .off"]),
        (
            "model.blend",
            b"BLENDER-v300".to_vec(),
            &[".blend", "OBJ, PLY, STL, OFF and 3MF are read"],
        ),
        (
            "model.glb",
            b"glTF\x02\0\0\0".to_vec(),
            &["GLB chunk", "export it again"],
        ),
        (
            "noise.ply",
            (0..999u32)
                .map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8)
                .collect(),
            &["ply"],
        ),
    ];
    let folder = Folder::with_signed_model();
    for (name, bytes, words) in table {
        folder.write(name, bytes);
        refused_everywhere(&folder, name, words);
    }
}

#[test]
fn files_that_are_missing_or_no_files_are_refused_by_every_command() {
    let folder = Folder::with_signed_model();
    std::fs::create_dir(folder.path("folder.ply")).unwrap();
    refused_everywhere(&folder, "missing.ply", &["cannot be read", "check the spelling"]);
    refused_everywhere(&folder, "folder.ply", &["directory", "name a file"]);
    refused_everywhere(&folder, "owner.pem", &["is a key", "a mesh belongs here"]);
    refused_everywhere(
        &folder,
        "signed.ply.cert.json",
        &["is a certificate", "a mesh belongs here"],
    );
}

#[cfg(unix)]
#[test]
fn a_header_that_promises_billions_takes_no_memory() {
    let folder = Folder::empty();
    let stl = [&[b' '; 80][..], &u32::MAX.to_le_bytes(), &[0; 50]].concat();
    for (name, bytes) in [
        (
            "ascii.ply",
            PLY.replace("vertex 3", "vertex 4000000000").into_bytes(),
        ),
        (
            "binary.ply",
            PLY.replace("ascii", "binary_little_endian")
                .replace("vertex 3", "vertex 4000000000")
                .into_bytes(),
        ),
        ("faces.ply", PLY.replace("face 1", "face 4000000000").into_bytes()),
        (
            "a.off",
            OFF.replace("3 1 0", "4000000000 4000000000 0").into_bytes(),
        ),
        ("a.stl", stl),
    ] {
        folder.write(name, bytes);
        let line = format!(
            "ulimit -v 300000; exec {} inspect {name}",
            env!("CARGO_BIN_EXE_sigmark")
        );
        let mut command = std::process::Command::new("sh");
        command.args(["-c", &line]).current_dir(folder.path(""));
        folder.refused_as(&line, command, &[name]);
    }
}

#[test]
fn meshes_that_can_carry_no_signature_are_refused_with_the_reason() {
    let folder = Folder::with_signed_model();
    let flat: Vec<[f64; 3]> = model().positions().iter().map(|p| [p[0], 0.0, 0.0]).collect();
    folder.write_mesh(
        "thin.ply",
        &TriMesh::new(flat, model().triangles().to_vec()).unwrap(),
        Precision::Double,
    );
    folder.write_mesh(
        "large.ply",
        &shapes::rectangle(250, 240, 1.0, 1.0),
        Precision::Single,
    );
    folder.write("tiny.obj", OBJ.replace('1', "1e-170").replace("f 1e-170", "f 1"));
    folder.write("huge.obj", OBJ.replace("v 1", "v 1e170"));
    folder.write("triangle.obj", OBJ);
    folder.write("two.graph", "2 1\n2\n1\n");
    folder.write("torn.graph", "2 1\n7\n1\n");
    // So far from the origin that single precision has no digits left for the mark.
    folder.write_mesh(
        "far.ply",
        &shapes::translated(&model(), [1e5; 3]),
        Precision::Single,
    );
    let embed = |name: &str, options: &str| {
        let extension = &name[name.len() - 3..];
        format!("embed {name} -o out.{extension} --key owner.pem {options}")
    };
    let table: &[(String, &[&str])] = &[
        (
            embed("triangle.obj", ""),
            &["triangle.obj", "room for 0 chips", "128", "finer mesh"],
        ),
        (
            embed("large.ply", "--patches 1"),
            &[
                "large.ply",
                "60491 vertices",
                "60000",
                "ask for 4 patches or more",
            ],
        ),
        (
            embed("model.ply", "--patches 40 --payload signature"),
            &["model.ply", "chips, but the mark takes 512", "fewer patches"],
        ),
        (embed("thin.ply", "--chip-rate 1"), &["thin.ply", "area"]),
        (
            embed("tiny.obj", ""),
            &["tiny.obj", "1e-170 units large", "scale it up"],
        ),
        (
            embed("huge.obj", ""),
            &["huge.obj, line 2", "coordinate 1e170", "scale the model down"],
        ),
        (
            embed("far.ply", "--chip-rate 1"),
            &["out.ply", "precision of this file", "--distortion"],
        ),
        (
            embed("model.ply", "--chip-rate 1 --alpha 3"),
            &["model.ply", "alpha is 3", "the most"],
        ),
        (
            embed("model.ply", "--chip-rate 1 --paper-alpha 3"),
            &["model.ply", "alpha is 3", "the most"],
        ),
        (
            "partition model.ply -k 643 -o out.ply".into(),
            &["model.ply", "643 parts", "1 to 642"],
        ),
        (
            "partition two.graph -k 2 -o out.ply".into(),
            &["out.ply", "no shape to colour", "leave out -o"],
        ),
        (
            "partition torn.graph -k 2 --labels out.txt".into(),
            &["torn.graph", "line 2"],
        ),
        (
            "partition model.ply -k 2 -o both.ply --labels both.ply --force".into(),
            &["both.ply", "both the coloured mesh and the labels"],
        ),
        (
            "partition model.ply -k 2 --labels model.ply --force".into(),
            &["model.ply", "is the input"],
        ),
        ("spectrum thin.ply -k 2 -o out.npz".into(), &["thin.ply", "area"]),
        (
            "spectrum triangle.obj -k 4 -o out.npz".into(),
            &["triangle.obj", "4 eigenpairs", "1 to 3"],
        ),
        (
            "spectrum large.ply -k 60000".into(),
            &["large.ply", "27 GiB", "-k, 35500 at most"],
        ),
    ];
    for (line, words) in table {
        folder.refused(line, words);
    }
    // A suspect with the original's triangles, but all on a line, lies nowhere on the original.
    let line = VERIFY.replacen("signed.ply", "thin.ply", 1);
    folder.refused(&line, &["thin.ply", "on one line", "rotation is undetermined"]);
    // None of them is so bad that nothing can be said about it.
    for name in ["triangle.obj", "thin.ply", "large.ply", "far.ply"] {
        folder.done(&format!("inspect {name}"));
    }
}

#[test]
fn numbers_out_of_bounds_are_refused_before_any_work_is_done() {
    let folder = Folder::with_signed_model();
    // The model does not even exist: nothing was opened.
    let embed = "embed nowhere.ply -o out.ply --key owner.pem";
    let table: &[(&str, &str, &str)] = &[
        (embed, "--chip-rate", "0 -1 3.5 x 99999999999999999999"),
        (embed, "--distortion", "0 -0.1 NaN inf 1e9 0.2 x"),
        (embed, "--alpha", "0 -1 nan inf"),
        (embed, "--paper-alpha", "0 -1 nan inf"),
        (embed, "--threads", "0 -1 1000000"),
        (VERIFY, "--p-bound", "0 1 -1 nan x"),
        (VERIFY, "--enough", "0 1 -1 nan x"),
        (VERIFY, "--time-limit", "0 -1 nan inf 1e300"),
        (
            "align nowhere.ply model.ply -o out.ply",
            "--point",
            "1 1=x 1,2=3 1,2,nan=4 -1=2",
        ),
        ("compare nowhere.ply model.ply", "--interval", "0 1 -1 nan x"),
        ("compare nowhere.ply model.ply", "--eigenvalues", "0 -1 x"),
        ("compare nowhere.ply model.ply", "--norm", "0.5 -1 nan inf"),
        ("compare nowhere.ply model.ply", "--heatmap-max", "0 -1 nan x"),
        ("spectrum nowhere.ply", "--count", "0 -1 x"),
        ("partition nowhere.ply", "--parts", "0 -1 x"),
        ("spectrum nowhere.ply", "--tolerance", "0 1 -1 nan"),
    ];
    for (line, option, values) in table {
        let command = line.split(' ').next().unwrap_or_default();
        for value in values.split(' ') {
            let (quoted, help) = (format!("'{value}'"), format!("see `sigmark {command} --help`"));
            let words = [*option, &quoted, "give a ", &help];
            folder.refused(&format!("{line} {option} {value}"), &words);
        }
    }
}

#[test]
fn meshes_that_can_not_be_compared_as_asked_are_refused_with_the_reason() {
    let folder = Folder::with_signed_model();
    folder.write_mesh("cube.ply", &shapes::cube(1.0), Precision::Double);
    let line = [[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]];
    let flat = TriMesh::new(line.to_vec(), vec![[0, 1, 2]]).unwrap();
    folder.write_mesh("flat.ply", &flat, Precision::Double);
    let table: &[(&str, &[&str])] = &[
        (
            "model.ply cube.ply --metrics dame",
            &["cube.ply", "connectivity differs", "8"],
        ),
        (
            "model.ply cube.ply --metrics shape-dna",
            &["cube.ply", "50 non-zero eigenvalues", "have 7"],
        ),
        ("cube.ply flat.ply --metrics distance", &["flat.ply", "area"]),
        ("flat.ply cube.ply", &["flat.ply", "area"]),
        (
            "model.ply signed.ply --metrics distance --interval 1e-9",
            &["interval", "samples", "at least"],
        ),
    ];
    for (files, words) in table {
        folder.refused(&format!("compare {files}"), words);
    }
}

#[test]
fn command_lines_that_are_wrong_are_refused_in_one_line() {
    let folder = Folder::with_signed_model();
    let table: &[(&str, &[&str])] = &[
        ("sing model.ply", &["sing", "see `sigmark --help`"]),
        (
            "library verify a.obj --loud",
            &["--loud", "see `sigmark library verify --help`"],
        ),
        ("embd model.ply", &["embd", "'embed'"]),
        ("--verbose", &["--verbose", "see `sigmark --help`"]),
        (
            "embed",
            &[
                "--output <PATH>",
                "--key <PEM>",
                "<MODEL>",
                "see `sigmark embed --help`",
            ],
        ),
        ("embed model.ply", &["--output <PATH>, --key <PEM>"]),
        (
            "verify signed.ply --original model.ply",
            &["--certificate <FILE>"],
        ),
        (
            "verify signed.ply --certificate signed.ply.cert.json --dispute",
            &["--original <FILE>, --public-key <PEM>"],
        ),
        ("keygen", &["--output <FILE>", "see `sigmark keygen --help`"]),
        ("keygen -o x.pem --profile best", &["best", "standard, paper"]),
        ("keygen -o x.pem --encrypted", &["--encrypted", "--encrypt"]),
        ("inspect model.ply signed.ply", &["signed.ply"]),
        (
            "compare model.ply",
            &["<DISTORTED>", "see `sigmark compare --help`"],
        ),
        (
            "compare model.ply signed.ply --metrics beauty",
            &["beauty", "distance, shape-dna, msdm2, dame"],
        ),
        (
            "embed model.ply -o out.ply --key owner.pem --alpha 1 --distortion 0.1",
            &["--alpha", "--distortion"],
        ),
    ];
    for (line, words) in table {
        folder.refused(line, words);
    }
}

#[test]
fn keys_that_are_none_or_the_wrong_ones_are_refused() {
    let folder = Folder::with_signed_model();
    let pem = folder.text("owner.pem");
    folder.write("garbage.pem", (0..=255).collect::<Vec<u8>>());
    folder.write("empty.pem", "");
    folder.write("text.pem", "my key is under the mat\n");
    folder.write("cut.pem", &pem[..100]);
    folder.write("damaged.pem", pem.replace("MI", "M!"));
    std::fs::create_dir(folder.path("folder.pem")).unwrap();
    folder.done("keygen -o paper.pem --profile paper");
    let mut locked = folder.command("keygen -o locked.pem --encrypt".split(' '));
    assert!(
        locked
            .env("SIGMARK_PASSPHRASE", "open sesame")
            .output()
            .unwrap()
            .status
            .success()
    );

    let private: &[(&str, &[&str])] = &[
        ("missing.pem", &["can't be read", "check the spelling"]),
        ("folder.pem", &["directory", "sigmark keygen"]),
        ("empty.pem", &["empty", "sigmark keygen"]),
        ("garbage.pem", &["not text (byte 128)", "sigmark keygen"]),
        ("text.pem", &["no PEM block"]),
        ("cut.pem", &["PEM block is damaged", "copy the key file again"]),
        ("damaged.pem", &["damaged"]),
        ("owner.pub.pem", &["private key is needed", "PUBLIC KEY"]),
        ("model.ply", &["not text", "a private key"]),
        (
            "signed.ply.cert.json",
            &["is a certificate", ".pem file that `sigmark keygen` wrote"],
        ),
        (
            "locked.pem",
            &[
                "locked by a passphrase",
                "run in a terminal, or set SIGMARK_PASSPHRASE",
            ],
        ),
    ];
    for (name, words) in private {
        folder.refused(&EMBED.replace("owner.pem", name), &[&[*name], *words].concat());
    }
    let public: &[(&str, &[&str])] = &[
        ("missing.pem", &["can't be read", "check the spelling"]),
        ("folder.pem", &["directory", "sigmark keygen"]),
        ("empty.pem", &["empty", "sigmark keygen"]),
        ("garbage.pem", &["not text", "sigmark keygen"]),
        ("text.pem", &["no PEM block"]),
        (
            "owner.pem",
            &["public key is needed", "PRIVATE KEY", "keep it secret"],
        ),
        ("locked.pem", &["public key is needed"]),
        (
            "other.pub.pem",
            &["issued by the key", "use the public key of the signer"],
        ),
        (
            "paper.pub.pem",
            &["issued by the key", "use the public key of the signer"],
        ),
        (
            "signed.ply.cert.json",
            &["is a certificate", ".pub.pem file that `sigmark keygen` wrote"],
        ),
    ];
    for (name, words) in public {
        folder.refused(&verify_with("--public-key", name), &[&[*name], *words].concat());
    }

    folder.refused(
        &format!("{EMBED} --profile paper"),
        &["owner.pem", "P-256", "sigmark keygen --profile paper"],
    );
    let paper = EMBED.replace("owner.pem", "paper.pem");
    folder.refused(
        &format!("{paper} --profile standard"),
        &["paper.pem", "B-163", "sigmark keygen --profile standard"],
    );
    folder.refused(
        "keygen -o x.pem --encrypt",
        &["x.pem", "passphrase is needed", "set SIGMARK_PASSPHRASE"],
    );
    for (line, passphrase, words) in [
        (
            EMBED.replace("owner.pem", "locked.pem"),
            "shut sesame",
            ["locked.pem", "passphrase is wrong", "try again"],
        ),
        (
            EMBED.replace("owner.pem", "locked.pem"),
            "",
            ["locked.pem", "passphrase is wrong", "try again"],
        ),
        (
            "keygen -o x.pem --encrypt".into(),
            "",
            ["x.pem", "passphrase is empty", "leave out --encrypt"],
        ),
    ] {
        let mut command = folder.command(line.split(' '));
        command.env("SIGMARK_PASSPHRASE", passphrase);
        folder.refused_as(&line, command, &words);
    }
    #[cfg(unix)]
    {
        use std::{ffi::OsStr, os::unix::ffi::OsStrExt};
        let mut command = folder.command("keygen -o x.pem --encrypt".split(' '));
        command.env("SIGMARK_PASSPHRASE", OsStr::from_bytes(b"caf\xe9"));
        folder.refused_as("keygen", command, &["SIGMARK_PASSPHRASE", "not UTF-8"]);
    }
}

/// A file that may not be read; for root there is none.
#[cfg(unix)]
#[test]
fn files_that_may_not_be_read_are_named_with_the_remedy() {
    use std::os::unix::fs::PermissionsExt;
    let folder = Folder::with_signed_model();
    for (name, line) in [
        ("owner.pem", EMBED.to_owned()),
        ("owner.pub.pem", VERIFY.to_owned()),
        ("model.ply", "inspect model.ply".to_owned()),
    ] {
        std::fs::set_permissions(folder.path(name), std::fs::Permissions::from_mode(0o000)).unwrap();
        if std::fs::read(folder.path(name)).is_err() {
            let run = folder.run(&line);
            assert_eq!(run.code, Some(2));
            assert!(
                run.err.starts_with(&format!("sigmark: {name}: ")) && run.err.contains("chmod"),
                "{}",
                run.err
            );
        }
        std::fs::set_permissions(folder.path(name), std::fs::Permissions::from_mode(0o600)).unwrap();
    }
}

#[test]
fn certificates_that_are_none_are_refused() {
    let folder = Folder::with_signed_model();
    let json = folder.text("signed.ply.cert.json");
    folder.write("empty.json", "");
    folder.write("cut.json", &json[..json.len() / 2]);
    folder.write("other.json", "{\"asset\": {\"version\": \"2.0\"}}");
    folder.write("next.json", json.replace("\"version\": 8", "\"version\": 9"));
    folder.write("before.json", json.replace("\"version\": 8", "\"version\": 2"));
    folder.write("extra.json", json.replacen('{', "{\"note\": \"mine\",", 1));
    folder.write("deep.json", "[".repeat(100_000));
    let remedy = ".cert.json file that `sigmark embed` wrote";
    let table: &[(&str, &[&str])] = &[
        ("missing.json", &["can't be read", "check the spelling"]),
        ("empty.json", &["empty", remedy]),
        ("cut.json", &["line", remedy]),
        ("other.json", &["\"format\"", remedy]),
        ("deep.json", &["not a Sigmark certificate", remedy]),
        (
            "next.json",
            &["version 9", "reads version 8", "use the Sigmark that wrote it"],
        ),
        (
            "before.json",
            &["version 2", "a rival could forge", "sign the original again"],
        ),
        ("extra.json", &["note", "line 1", remedy]),
        ("owner.pem", &["is a key, not a certificate", remedy]),
        ("signed.ply", &["not text", remedy]),
    ];
    for (name, words) in table {
        folder.refused(&verify_with("--certificate", name), &[&[*name], *words].concat());
    }
}

/// Every number and text in the JSON, by its path.
fn leaves(value: &Value, path: &str, found: &mut Vec<String>) {
    match value {
        Value::Object(map) => map
            .iter()
            .for_each(|(key, value)| leaves(value, &format!("{path}/{key}"), found)),
        Value::Array(list) => list
            .iter()
            .enumerate()
            .for_each(|(i, value)| leaves(value, &format!("{path}/{i}"), found)),
        _ => found.push(path.into()),
    }
}

/// Another value of the same kind: a digit or letter changed in the middle, the next number, another word of two.
fn edited(value: &Value) -> Value {
    match value {
        Value::Number(number) => match number.as_u64() {
            Some(whole) => (whole + 1).into(),
            None => number.as_f64().map(f64::next_up).into(),
        },
        Value::String(text) => match text.as_str() {
            "ecdsa-p256-sha256" => "ecdsa-p256-sha1".into(),
            "message-and-geometry" => "message".into(),
            "cotangent" => "intrinsic".into(),
            text => {
                let mut bytes = text.as_bytes().to_vec();
                let middle = bytes.len() / 2;
                bytes[middle] = if bytes[middle] == b'a' { b'b' } else { b'a' };
                String::from_utf8(bytes).expect("ASCII").into()
            }
        },
        other => panic!("{other} is in no certificate"),
    }
}

#[test]
fn no_field_of_a_certificate_can_be_edited_or_left_out_unnoticed() {
    let folder = Folder::with_signed_model();
    let whole: Value = serde_json::from_str(&folder.text("signed.ply.cert.json")).unwrap();
    let mut fields = Vec::new();
    leaves(&whole, "", &mut fields);
    assert!(fields.len() >= 15, "{fields:?}");
    let line = verify_with("--certificate", "edited.json");
    for field in &fields {
        let mut certificate = whole.clone();
        let value = certificate.pointer_mut(field).unwrap();
        *value = edited(value);
        folder.write("edited.json", serde_json::to_string_pretty(&certificate).unwrap());
        let noticed = match field.as_str() {
            "/version" => "version 8",
            "/format" | "/public_key" => "not a Sigmark certificate",
            "/mark/payload" | "/mark/laplacian" | "/mark/scheme" | "/mark/carrier" => "certificate",
            "/original/name" | "/original/sketch" | "/seal" | "/mark/patches/0/last_eigenvalue" => "seal",
            "/mark/patches/0/vertices" => "patches",
            "/original/vertices" | "/mark/labels" => "labels",
            _ => "not one by its key over what it states",
        };
        folder.refused(&line, &["edited.json", noticed]);

        let (parent, name) = field.rsplit_once('/').unwrap();
        certificate = whole.clone();
        certificate
            .pointer_mut(parent)
            .unwrap()
            .as_object_mut()
            .unwrap()
            .remove(name);
        folder.write("edited.json", serde_json::to_string_pretty(&certificate).unwrap());
        // The name of the original is a help, and may be empty; but what was sealed is sealed.
        let noticed = match field.as_str() {
            "/original/name" | "/original/sketch" => "seal",
            _ => "not a Sigmark certificate",
        };
        folder.refused(&line, &["edited.json", noticed]);
    }
    // Only spelled otherwise, it is the same certificate.
    folder.write("edited.json", serde_json::to_string(&whole).unwrap());
    folder.done(&line);
}

#[test]
fn files_that_do_not_belong_together_are_refused() {
    let folder = Folder::with_signed_model();
    folder.write_mesh(
        "model.obj",
        &shapes::jittered(&model(), 0.05, 1),
        Precision::Double,
    );
    let table: &[(String, &[&str])] = &[
        (
            verify_with("--original", "model.obj"),
            &["model.obj", "not the original", "the very file that was signed"],
        ),
        (
            verify_with("--original", "theirs.ply"),
            &["theirs.ply", "not the original"],
        ),
        (
            verify_with("--certificate", "theirs.ply.cert.json"),
            &["owner.pub.pem", "issued by the key"],
        ),
        (
            VERIFY
                .replacen("signed.ply", "model.ply", 1)
                .replace("--original model.ply", "--original signed.ply"),
            &[
                "model.ply: is the original",
                "wrong way round",
                "verify signed.ply --original model.ply",
            ],
        ),
    ];
    for (line, words) in table {
        folder.refused(line, words);
    }
}

#[test]
fn outputs_that_would_harm_or_can_not_be_written_are_refused() {
    let folder = Folder::with_signed_model();
    std::fs::create_dir(folder.path("folder.ply")).unwrap();
    let embed = |output: &str, more: &str| {
        format!("embed model.ply -o {output} --key owner.pem --chip-rate 1 {more}")
    };
    let table: &[(String, &[&str])] = &[
        (
            embed("signed.ply", ""),
            &["signed.ply", "exists already", "--force"],
        ),
        (
            embed("out.ply", "--certificate signed.ply.cert.json"),
            &["signed.ply.cert.json", "exists already", "--force"],
        ),
        (embed("out.obj", ""), &["out.obj", "stays PLY", ".ply"]),
        (embed("out.ply.gz", ""), &["out.ply.gz", "stays PLY", ".ply"]),
        (embed("out", ""), &["out", "stays PLY", ".ply"]),
        (
            embed("folder.ply", "--force"),
            &["folder.ply", "directory", "name a file in it"],
        ),
        (
            embed("nowhere/out.ply", ""),
            &["nowhere/out.ply", "there is no folder nowhere", "make it first"],
        ),
        (
            embed("out.ply", "--certificate nowhere/c.json"),
            &["nowhere/c.json", "make it first"],
        ),
        (
            embed("model.ply", "--force"),
            &["model.ply", "is the model", "another file"],
        ),
        (
            embed("./folder.ply/../model.ply", "--force"),
            &["is the model", "another file"],
        ),
        (
            embed("out.ply", "--certificate model.ply --force"),
            &["model.ply", "is the model"],
        ),
        (
            embed("out.ply", "--certificate owner.pem --force"),
            &["owner.pem", "is the private key"],
        ),
        (
            embed("out.ply", "--certificate ./out.ply"),
            &["out.ply", "both", "another file"],
        ),
        (embed("", "").replace(" -o ", " -o= "), &["--output"]),
        (
            "keygen -o owner.pem".into(),
            &["owner.pem", "exists already", "--force"],
        ),
        (
            "keygen -o folder.ply --force".into(),
            &["folder.ply", "directory", "name a file in it"],
        ),
        (
            "keygen -o nowhere/new.pem".into(),
            &["nowhere/new.pem", "make it first"],
        ),
        (
            "spectrum model.ply -k 2 -o owner.pem".into(),
            &["owner.pem", "exists already", "--force"],
        ),
        (
            "spectrum model.ply -k 2 -o model.ply --force".into(),
            &["model.ply", "is the model", "another file"],
        ),
        (
            "spectrum model.ply -k 2 -o nowhere/b.npz".into(),
            &["nowhere/b.npz", "make it first"],
        ),
        (
            "compare model.ply signed.ply --heatmap theirs.ply".into(),
            &["theirs.ply", "exists already", "--force"],
        ),
        (
            "compare model.ply signed.ply --heatmap model.ply --force".into(),
            &["model.ply", "is the reference", "another file"],
        ),
        (
            "compare model.ply signed.ply --heatmap signed.ply --force".into(),
            &["signed.ply", "is the mesh compared", "another file"],
        ),
        (
            "compare model.ply signed.ply --heatmap difference.jpg".into(),
            &["difference.jpg", ".png", ".ply"],
        ),
        (
            "compare model.ply signed.ply --heatmap nowhere/d.png".into(),
            &["nowhere/d.png", "make it first"],
        ),
    ];
    for (line, words) in table {
        folder.refused(line, words);
    }
    // The public key alone stands in the way of a pair.
    std::fs::rename(folder.path("owner.pem"), folder.path("elsewhere.pem")).unwrap();
    folder.refused(
        "keygen -o owner.pem",
        &["owner.pub.pem", "exists already", "--force"],
    );
}
