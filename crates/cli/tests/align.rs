//! Suspects in unknown position, that lost their vertices or never had a surface to speak of: what `align` and `verify` say.

use crate::common::{Folder, model};
use mesh::{Similarity, TriMesh, Welded, shapes};
use mesh_io::{Asset, Precision};
use serde_json::Value;

const VERIFY: &str = "--original model.ply --certificate signed.ply.cert.json --public-key owner.pub.pem";

fn away() -> Similarity {
    Similarity {
        scale: 25.0,
        translation: [3.0, -70.0, 40.0],
        ..Similarity::from_quaternion([0.25, 0.4, -0.8, 0.3])
    }
}

fn half(mesh: &TriMesh) -> TriMesh {
    let kept =
        (0..mesh.triangle_count()).filter(|&t| mesh.corners(t).iter().all(|p| p[0] + 0.3 * p[1] < 0.1));
    let kept: Vec<[u32; 3]> = kept.map(|t| mesh.triangles()[t]).collect();
    Welded::new(mesh.positions(), &kept)
        .expect("half of it")
        .into_mesh()
}

fn opened(folder: &Folder, name: &str) -> TriMesh {
    Asset::open(folder.path(name)).expect(name).mesh().clone()
}

fn number(object: &Value, key: &str) -> f64 {
    object[key]
        .as_f64()
        .unwrap_or_else(|| panic!("{key} in {object}"))
}

/// The farthest that a vertex of one mesh is from the same vertex of the other.
fn apart(a: &TriMesh, b: &TriMesh) -> f64 {
    let pairs = a.positions().iter().zip(b.positions());
    let distances = pairs.map(|(p, q)| (0..3).map(|i| (p[i] - q[i]).powi(2)).sum::<f64>().sqrt());
    distances.fold(0.0, f64::max)
}

#[test]
fn a_moved_suspect_is_written_where_the_original_lies() {
    let folder = Folder::with_signed_model();
    let cut = half(&model());
    folder.write_mesh("found.obj", &shapes::moved(&cut, &away()), Precision::Double);
    let text = folder.text("found.obj").replace("v ", "# kept\nv ");
    folder.write("found.obj", &text);

    let report = folder
        .done("align found.obj model.ply -o aligned.obj --json")
        .json();
    assert!(apart(&opened(&folder, "aligned.obj"), &cut) < 1e-9);
    assert_eq!(
        folder.text("aligned.obj").matches("# kept").count(),
        text.matches("# kept").count()
    );
    assert_eq!(
        (&report["aligned"], &report["mirrored"], &report["ambiguous"]),
        (&true.into(), &false.into(), &false.into())
    );
    assert_eq!(report["registration"], "surroundings");
    assert_eq!(report["output"], "aligned.obj");
    assert!((25.0 * number(&report, "scale") - 1.0).abs() < 1e-9);
    assert!(number(&report, "overlap") > 0.99 && number(&report, "residual") < 1e-9);
    assert!((0.3..0.7).contains(&number(&report, "coverage")));
    assert_eq!(report["transform"][3], serde_json::json!([0.0, 0.0, 0.0, 1.0]));

    folder.refused(
        "align found.obj model.ply -o aligned.obj",
        &["aligned.obj", "--force"],
    );
    let text = folder
        .done("align found.obj model.ply -o aligned.obj --force")
        .out;
    assert!(text.starts_with("ALIGNED: found.obj lies on model.ply"), "{text}");
    assert!(!text.contains("ambiguous"), "{text}");
}

#[test]
fn normals_turn_with_the_suspect_and_what_is_left_is_said_in_one_line() {
    let folder = Folder::with_signed_model();
    folder.write_mesh("found.obj", &shapes::moved(&model(), &away()), Precision::Double);
    let text = folder.text("found.obj");
    folder.write("found.obj", format!("vn 0 0.6 -0.8\n{text}"));
    let report = folder
        .done("align found.obj model.ply -o aligned.obj --json")
        .json();
    let aligned = folder.text("aligned.obj");
    let words: Vec<&str> = aligned.lines().next().expect("a line").split(' ').collect();
    assert_eq!(words[0], "vn");
    for axis in 0..3 {
        let row = |i: usize| report["rotation"][axis][i].as_f64().expect("a number");
        let wanted = 0.6 * row(1) - 0.8 * row(2);
        let held: f64 = words[axis + 1].parse().expect("a number");
        assert!((held - wanted).abs() < 1e-6, "{held} for {wanted}");
    }
    assert_eq!(report["not_turned"], serde_json::json!([]));

    folder.write("found.obj", format!("vn up\n{text}"));
    let run = folder.run("align found.obj model.ply -o left.obj");
    assert_eq!(run.code, Some(0), "{run:?}");
    assert_eq!(
        run.err,
        "sigmark: left.obj: not turned with the mesh: 1 of the lines vn (they hold no three numbers)\n"
    );
    assert!(folder.text("left.obj").starts_with("vn up\n"));
    let report = folder
        .run("align found.obj model.ply -o left.obj --force --json")
        .out;
    assert!(
        report.contains(r#""not_turned":["1 of the lines vn (they hold"#),
        "{report}"
    );
}

#[test]
fn points_that_are_given_take_the_place_of_guesses() {
    let folder = Folder::with_signed_model();
    let net = shapes::moved(&shapes::flipped(&model(), 3), &away());
    folder.write_mesh("found.ply", &net, Precision::Double);
    let place = |mesh: &TriMesh, v: usize| mesh.positions()[v].map(|x| format!("{x:.3}")).join(",");
    let points = [0, 200, 400].map(|v| (place(&net, v), place(&model(), v)));
    folder.write(
        "points.txt",
        format!("# suspect, original\n{}\n\n600 600\n", {
            let (a, b) = &points[0];
            format!("{} {}", a.replace(',', " "), b.replace(',', " "))
        }),
    );
    let [_, (a, b), (c, d)] = &points;
    let by_points =
        format!("align found.ply model.ply -o a.ply --point {a}={b} --point {c}={d} --points points.txt");
    let report = folder.done(&format!("{by_points} --json")).json();
    assert_eq!(report["aligned"], true);
    assert!((25.0 * number(&report, "scale") - 1.0).abs() < 1e-2, "{report}");
    assert!(
        folder
            .done(&format!("{by_points} --force"))
            .out
            .starts_with("ALIGNED: ")
    );
}

#[test]
fn points_that_say_too_little_are_refused() {
    let folder = Folder::with_signed_model();
    folder.write("line.txt", "0 0 0  0 0 0\n1 0 0  1 0 0\n2 0 0  2 0 0\n");
    folder.write("words.txt", "0 0 0  0 0 0\nnose nose nose\n");
    folder.write("none.txt", "# nothing yet\n");
    folder.write("beyond.txt", "0 0\n1 1\n642 2\n");
    let table: &[(&str, &[&str])] = &[
        ("--point 1=1 --point 2=2", &["2", "three"]),
        ("--points line.txt", &["line"]),
        ("--points words.txt", &["words.txt", "line 2", "A=B"]),
        ("--points none.txt", &["none.txt", "three"]),
        ("--points beyond.txt", &["signed.ply", "642"]),
        ("--points owner.pem", &["owner.pem", "a key"]),
        ("--points nowhere.txt", &["nowhere.txt"]),
    ];
    for (options, words) in table {
        folder.refused(&format!("align signed.ply model.ply -o out.ply {options}"), words);
    }
}

#[test]
fn a_mirrored_copy_and_a_symmetric_shape_are_said_to_be_what_they_are() {
    let folder = Folder::with_signed_model();
    folder.write_mesh("mirrored.ply", &shapes::mirrored(&model()), Precision::Double);
    let text = folder.done("align mirrored.ply model.ply -o m.ply").out;
    assert!(text.contains("as its mirror image"), "{text}");
    assert!(apart(&opened(&folder, "m.ply"), &model()) < 1e-9);

    folder.write_mesh("ball.ply", &shapes::icosphere(2), Precision::Double);
    let text = folder.done("align ball.ply ball.ply -o b.ply").out;
    assert!(text.contains("symmetric") && text.contains("119"), "{text}");
    folder.write_mesh("finer.ply", &shapes::icosphere(3), Precision::Double);
    let text = folder.done("align finer.ply ball.ply -o f.ply").out;
    assert!(text.contains("ambiguous"), "{text}");
}

#[test]
fn what_does_not_align_is_answered_with_no_and_nothing_is_written() {
    let folder = Folder::with_signed_model();
    let suspects = [
        ("torus.stl", shapes::bumpy_torus(20, 20, 1)),
        ("triangle.ply", shapes::rectangle(1, 1, 1.0, 1.0)),
        ("pieces.ply", shapes::soup(60, 1)),
    ];
    for (name, mesh) in suspects {
        folder.write_mesh(name, &mesh, Precision::Double);
        let extension = name.rsplit('.').next().unwrap_or_default();
        let before = folder.contents();
        let run = folder.run(&format!("align {name} model.ply -o out.{extension} --json"));
        let report = run.json();
        assert_eq!((run.code, &report["aligned"]), (Some(1), &false.into()), "{name}");
        assert!(
            number(&report, "overlap") < 0.8 || name == "triangle.ply",
            "{name} {report}"
        );
        assert!(report["output"].is_null());
        let run = folder.run(&format!("align {name} model.ply -o out.{extension}"));
        assert!(
            run.code == Some(1) && run.out.starts_with("DOES NOT ALIGN: "),
            "{name}: {run:?}"
        );
        assert_eq!(folder.contents(), before);
    }
}

#[test]
fn suspects_that_lost_the_triangles_are_judged() {
    let folder = Folder::with_signed_model();
    let signed = opened(&folder, "signed.ply");
    let suspects = [
        ("cropped.ply", half(&signed), "detected verified", "surroundings"),
        (
            "flipped.ply",
            shapes::flipped(&signed, 3),
            "detected verified",
            "surroundings surface",
        ),
        ("unmarked.ply", half(&model()), "not_found", "surroundings"),
        (
            "inside_out.ply",
            shapes::inside_out(&shapes::flipped(&model(), 3)),
            "not_found",
            "surroundings surface",
        ),
    ];
    for (name, mesh, outcomes, ways) in suspects {
        folder.write_mesh(name, &shapes::moved(&mesh, &away()), Precision::Double);
        let run = folder.run(&format!("verify {name} {VERIFY} --json"));
        let report = run.json();
        let [outcome, way] = ["outcome", "registration"].map(|key| report[key].as_str().expect(key));
        assert!(
            outcomes.contains(outcome) && ways.contains(way),
            "{name}: {report}"
        );
        assert_eq!(run.code, Some(i32::from(outcome == "not_found")));
        assert!(number(&report, "overlap") > 0.9 && report["remark"].is_null());
        assert!(number(&report["seconds"], "resampling") >= 0.0);
    }
    let text = folder.done(&format!("verify cropped.ply {VERIFY}")).out;
    assert!(
        text.contains("by the vertices that are left")
            && text.contains("of the original's vertices were seen"),
        "{text}"
    );
}

#[test]
fn degenerate_suspects_get_defined_answers() {
    let folder = Folder::with_signed_model();
    let suspects = [
        (
            "triangle.obj",
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n".to_owned(),
            1,
        ),
        ("needle.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n".to_owned(), 2),
        ("points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n".to_owned(), 2),
        ("nan.obj", "v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n".to_owned(), 2),
    ];
    for (name, text, code) in suspects {
        folder.write(name, text);
        for line in [
            format!("verify {name} {VERIFY}"),
            format!("align {name} model.ply -o out.obj"),
        ] {
            let run = folder.run(&line);
            assert_eq!(run.code, Some(code), "{line}: {run:?}");
        }
    }
    folder.refused(
        &format!("verify points.obj {VERIFY}"),
        &["points.obj", "point cloud"],
    );
    folder.refused(&format!("verify needle.obj {VERIFY}"), &["needle.obj", "area"]);
    folder.write_mesh(
        "ball.ply",
        &shapes::scaled(&shapes::icosphere(3), 1000.0),
        Precision::Single,
    );
    let report = folder.run(&format!("verify ball.ply {VERIFY} --json")).json();
    assert_eq!(report["outcome"], "not_found");
}

/// Sketchfab calls every model scene.gltf, and its buffer scene.bin.
#[test]
fn what_a_strangers_file_names_replaces_nothing_that_is_read() {
    let folder = Folder::empty();
    folder.write_gltf("mine/scene.gltf", &model(), "scene.bin", b"\x89PNG mine");
    let suspect = shapes::moved(&model(), &away());
    folder.write_gltf("found/scene.gltf", &suspect, "scene.bin", b"\x89PNG found");
    for name in ["mine/scene.bin", "mine/skin.png", "found/scene.bin"] {
        let (kept, folder_of) = (folder.read(name), name.split('/').next().expect("a folder"));
        folder.refused(
            &format!("align found/scene.gltf mine/scene.gltf -o {folder_of}/aligned.gltf --force"),
            &["the suspect refers to", "which is read; write to another folder"],
        );
        assert!(folder.read(name) == kept, "{name}");
    }
    std::fs::create_dir(folder.path("out")).expect("a folder");
    folder.done("align found/scene.gltf mine/scene.gltf -o out/aligned.gltf");
    assert!(
        apart(
            &opened(&folder, "out/aligned.gltf"),
            &opened(&folder, "mine/scene.gltf")
        ) < 1e-5
    );
    assert_eq!(folder.read("out/skin.png"), b"\x89PNG found");
}

#[test]
fn a_time_limit_ends_the_work() {
    let folder = Folder::with_signed_model();
    folder.write_mesh("torus.ply", &shapes::bumpy_torus(60, 60, 1), Precision::Double);
    for line in [
        format!("verify torus.ply {VERIFY} --time-limit 1e-6"),
        "align torus.ply model.ply -o out.ply --time-limit 1e-6".to_owned(),
    ] {
        folder.refused(&line, &["time limit", "--time-limit"]);
    }
}
