//! What `--json` prints is what docs/json.md and the help say, for every command and key.

#![allow(clippy::unwrap_used)] // in the helpers of tests, too

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::Path,
};

use crate::common::{Folder, finish, model};
use mesh::shapes;
use mesh_io::{Asset, Precision};
use serde_json::Value;

const COMMANDS: [&str; 15] = [
    "keygen",
    "embed",
    "verify",
    "trace",
    "dispute",
    "library add",
    "library list",
    "library search",
    "stamp request",
    "stamp attach",
    "align",
    "compare",
    "inspect",
    "spectrum",
    "partition",
];

/// The keys of a command with their types.
type Keys = BTreeMap<String, BTreeSet<String>>;

/// What the page says, by command.
fn documented() -> BTreeMap<String, Keys> {
    let page = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/json.md"))
        .expect("docs/json.md");
    let mut commands = BTreeMap::new();
    for section in page.split("\n## `sigmark ").skip(1) {
        let (command, rest) = section.split_once('`').unwrap();
        let mut keys = Keys::new();
        for line in rest.lines().filter(|line| line.starts_with("| `")) {
            let cells: Vec<&str> = line.split('|').map(str::trim).collect();
            let [_, key, types, _, _] = cells[..] else {
                panic!("not a row of three: {line}");
            };
            let types = types.split(" or ").map(str::to_string).collect();
            let twice = keys.insert(key.trim_matches('`').to_string(), types);
            assert!(twice.is_none(), "{command}: {key} stands there twice");
        }
        commands.insert(command.to_string(), keys);
    }
    commands
}

fn type_of(value: &Value) -> &'static str {
    match value {
        Value::Null => "null",
        Value::Bool(_) => "boolean",
        Value::Number(number) if number.is_f64() => "number",
        Value::Number(_) => "integer",
        Value::String(_) => "string",
        Value::Array(_) => "array",
        Value::Object(_) => "object",
    }
}

/// Looks up every value of an object by its path, and notes which rows of the page were needed.
fn look_up(command: &str, path: &str, value: &Value, keys: &Keys, seen: &mut BTreeSet<String>) {
    if !path.is_empty() {
        let any = path.rsplit_once('.').map(|(parent, _)| format!("{parent}.*"));
        let row = [Some(path.to_string()), any]
            .into_iter()
            .flatten()
            .find(|row| keys.contains_key(row));
        let row = row.unwrap_or_else(|| panic!("{command}: {path} is not in docs/json.md"));
        let (types, found) = (&keys[&row], type_of(value));
        let fits = |kind: &String| kind == found || (kind == "number" && found == "integer") || kind == "any";
        assert!(
            types.iter().any(fits),
            "{command}: {path} is {found}, not {types:?}: {value}"
        );
        seen.insert(row);
        if types.contains("any") {
            return;
        }
    }
    match value {
        Value::Object(members) => members.iter().for_each(|(key, value)| {
            let path = if path.is_empty() {
                key.clone()
            } else {
                format!("{path}.{key}")
            };
            look_up(command, &path, value, keys, seen);
        }),
        Value::Array(items) => items
            .iter()
            .for_each(|item| look_up(command, &format!("{path}[]"), item, keys, seen)),
        _ => {}
    }
}

/// What a command prints of this and that; every line an object.
fn printed(folder: &Folder, lines: &[&str]) -> Vec<Value> {
    let runs = lines.iter().map(|line| {
        let run = finish(folder.command(format!("{line} --json").split_whitespace()));
        assert!(!run.out.is_empty(), "sigmark {line}: {run:?}");
        run.out
    });
    let objects = runs.flat_map(|out| {
        out.lines()
            .map(|line| serde_json::from_str(line).unwrap())
            .collect::<Vec<_>>()
    });
    objects.collect()
}

/// Models and claims for all that commands can have to say.
fn folder() -> Folder {
    let folder = Folder::with_signed_model();
    let signed = Asset::open(folder.path("signed.ply")).unwrap();
    folder.write_mesh(
        "worn.ply",
        &shapes::jittered(signed.mesh(), 0.03, 9),
        Precision::Double,
    );
    folder.write_mesh("torus.ply", &shapes::bumpy_torus(20, 20, 1), Precision::Double);
    folder.write_mesh("ball.ply", &shapes::icosphere(2), Precision::Double);
    folder.write_mesh(
        "brick.ply",
        &shapes::scaled(&shapes::icosphere(1), 2.0),
        Precision::Single,
    );
    folder.write("sheet.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 9\nf 1 2 3\n");
    folder.write("bad.ply", "ply");
    let rigged = crate::common::rigged::rigged(&shapes::bumpy_torus(20, 20, 1));
    folder.write("rigged.glb", rigged);
    folder.write("list.csv", "Anna\nBert\n");
    folder.write_mesh("odd.obj", &model(), Precision::Double);
    let odd = folder.text("odd.obj") + "vn up\n";
    folder.write("odd.obj", odd);
    folder.done("embed signed.ply -o stolen.ply -k other.pem --chip-rate 1");
    // What another signed in the name of the owner, and what is none.
    let seal = |name: &str| -> Value {
        let certificate: Value = serde_json::from_str(&folder.text(name)).unwrap();
        certificate["seal"].clone()
    };
    folder.done("embed model.ply --recipients list.csv -o sold -k owner.pem --chip-rate 1");
    let [anna, bert] = ["anna", "bert"].map(|name| {
        let sold = fs::read_dir(folder.path("sold"))
            .unwrap()
            .map(|entry| entry.unwrap().file_name());
        let mut sold = sold.map(|name| name.into_string().unwrap());
        format!(
            "sold/{}/model.ply.cert.json",
            sold.find(|found| found.starts_with(name)).unwrap()
        )
    });
    let (own, other) = (seal(&bert), seal(&anna));
    let edited = folder
        .text(&bert)
        .replace(own.as_str().unwrap(), other.as_str().unwrap());
    folder.write(&bert, edited);
    fs::copy(
        folder.path(&bert).with_extension("").with_extension(""),
        folder.path("leak.ply"),
    )
    .unwrap();
    folder.write("sold/bad.cert.json", "{}");
    for (name, original, signed, key) in [
        ("mine", "model", "signed", "owner"),
        ("theirs", "signed", "stolen", "other"),
    ] {
        let claim = format!(
            r#"{{"original": "{original}.ply", "certificate": "{signed}.ply.cert.json", "public_key": "{key}.pub.pem"}}"#
        );
        folder.write(format!("{name}.claim.json"), claim);
    }
    folder.done("library add model.ply brick.ply signed.ply.cert.json --library lib.sigmark");
    folder
}

/// Command lines that between them print everything; what takes an authority is tested with time stamps.
fn lines(command: &str) -> &'static [&'static str] {
    match command {
        "keygen" => &["keygen -o new.pem", "keygen -o paper.pem --profile paper"],
        "embed" => &[
            "embed model.ply -o alone.ply -k owner.pem --chip-rate 1",
            "embed model.ply bad.ply -o out -k owner.pem --chip-rate 1",
            "embed model.ply --recipients list.csv -o copies -k owner.pem --chip-rate 1",
            "embed model.ply --recipients list.csv -o copies -k owner.pem --chip-rate 1",
        ],
        "verify" => &[
            "verify signed.ply --certificate signed.ply.cert.json",
            "verify worn.ply torus.ply bad.ply --certificate signed.ply.cert.json",
            "library verify signed.ply --library lib.sigmark",
        ],
        "trace" => &[
            "trace signed.ply --original model.ply --certificates signed.ply.cert.json",
            "trace worn.ply torus.ply bad.ply --original model.ply --certificates sold --certificates signed.ply.cert.json",
            "trace leak.ply --original model.ply --certificates sold",
            "trace model.ply --original model.ply --certificates sold",
        ],
        "dispute" => &[
            "dispute mine.claim.json theirs.claim.json",
            "dispute mine.claim.json theirs.claim.json --suspect stolen.ply",
        ],
        "library add" => &[
            "library add model.ply signed.ply.cert.json --library new.sigmark",
            "library add bad.ply sheet.obj --library new.sigmark",
        ],
        "library list" => &["library list --library lib.sigmark"],
        "library search" => &[
            "library search signed.ply --library lib.sigmark",
            "library search leak.ply torus.ply bad.ply --library lib.sigmark",
            "library search torus.ply --library lib.sigmark",
        ],
        "stamp request" => &["stamp request signed.ply.cert.json -o query.tsq"],
        "align" => &[
            "align signed.ply model.ply -o aligned.ply",
            "align torus.ply model.ply -o never.ply",
            "align ball.ply ball.ply -o round.ply",
            "align odd.obj model.ply -o even.obj",
            "align rigged.glb rigged.glb -o unposed.glb --pose",
        ],
        "compare" => &[
            "compare model.ply signed.ply --heatmap map.png --interval 0.01",
            "compare model.ply torus.ply --metrics distance,dame --interval 0.01",
        ],
        "inspect" => &["inspect model.ply", "inspect sheet.obj", "inspect torus.ply"],
        "spectrum" => &["spectrum model.ply -k 4", "spectrum model.ply -k 4 -o basis.npz"],
        "partition" => &[
            "partition model.ply -k 2",
            "partition model.ply -k 2 -o parts.ply --labels parts.txt",
        ],
        _ => &[],
    }
}

#[test]
fn the_page_says_what_is_printed_and_nothing_else() {
    let folder = folder();
    let documented = documented();
    assert_eq!(
        documented.keys().map(String::as_str).collect::<BTreeSet<_>>(),
        BTreeSet::from(COMMANDS)
    );
    // An authority is needed for these: `tests/stamps.rs` has one.
    let elsewhere = [
        "stamps[]",
        "stamps[].time",
        "stamps[].authority",
        "stamps[].serial",
        "stamps[].*",
        "stamps_refused[]",
        "stamps_refused[].number",
        "stamps_refused[].reason",
        "stamps_refused[].*",
    ];
    for command in COMMANDS.into_iter().filter(|command| *command != "stamp attach") {
        let keys = &documented[command];
        let mut seen = BTreeSet::new();
        for object in printed(&folder, lines(command)) {
            look_up(command, "", &object, keys, &mut seen);
        }
        let unseen: Vec<&String> = keys
            .keys()
            .filter(|key| !seen.contains(*key) && !elsewhere.contains(&key.as_str()))
            .collect();
        assert!(
            unseen.is_empty(),
            "{command}: docs/json.md has {unseen:?}, which was never printed"
        );
    }
}

/// Words of the help that are keys for sure: those with an underscore.
fn is_key(word: &str) -> bool {
    word.contains('_')
        && word
            .chars()
            .all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_')
}

#[test]
fn the_help_names_the_keys_of_the_page() {
    let folder = Folder::empty();
    for (command, keys) in documented() {
        let help = folder.done(&format!("{command} --help")).out;
        let (_, printed) = help
            .split_once("--json prints: ")
            .unwrap_or_else(|| panic!("{command}: {help}"));
        let words: BTreeSet<&str> = printed
            .split(|c: char| !(c.is_ascii_alphanumeric() || c == '_'))
            .filter(|word| !word.is_empty())
            .collect();
        for key in keys.keys().filter(|key| !key.contains(['.', '['])) {
            assert!(
                words.contains(key.as_str()),
                "{command}: the help does not name {key}"
            );
        }
        let names: BTreeSet<&str> = keys.keys().flat_map(|key| key.split(['.', '['])).collect();
        // Outcomes, stages and ways to recognise look like keys.
        for word in words.into_iter().filter(|word| {
            is_key(word)
                && ![
                    "not_found",
                    "another_shape",
                    "local_frames",
                    "rig_surface",
                    "bent_surface",
                ]
                .contains(word)
        }) {
            assert!(
                names.contains(word),
                "{command}: the help names {word}, which docs/json.md does not have"
            );
        }
    }
}
