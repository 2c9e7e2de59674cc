//! The real binary, run in a folder of its own.

pub(crate) mod rigged;

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
    process::{Command, Stdio},
    sync::OnceLock,
};

use mesh::{TriMesh, shapes};
use mesh_io::{Format, Precision, write_mesh};
use tempfile::TempDir;

/// A signature of 512 bits, once each, needs 2 · 172 vertices: this has 642.
pub(crate) fn model() -> TriMesh {
    shapes::bumpy_sphere(3, 1)
}

/// What a run of the binary left behind.
#[derive(Debug)]
pub(crate) struct Run {
    pub(crate) code: Option<i32>,
    pub(crate) out: String,
    pub(crate) err: String,
}

impl Run {
    /// The JSON object of a run that succeeded (or answered no) without a word on standard error.
    pub(crate) fn json(&self) -> serde_json::Value {
        assert_eq!(self.err, "");
        assert_eq!(self.out.lines().count(), 1, "{}", self.out);
        serde_json::from_str(&self.out).expect("one JSON object")
    }
}

/// A folder with files, in which commands run.
pub(crate) struct Folder {
    dir: TempDir,
}

impl Folder {
    pub(crate) fn empty() -> Self {
        Self {
            dir: tempfile::tempdir().expect("a temporary folder"),
        }
    }

    /// With model.ply and its keys owner.pem and other.pem; signed.ply and marked by `other`, theirs.ply; certificates beside.
    pub(crate) fn with_signed_model() -> Self {
        static FILES: OnceLock<BTreeMap<PathBuf, Vec<u8>>> = OnceLock::new();
        let files = FILES.get_or_init(|| {
            let folder = Self::empty();
            folder.write_mesh("model.ply", &model(), Precision::Double);
            for command in [
                "keygen -o owner.pem",
                "keygen -o other.pem",
                "embed model.ply -o signed.ply -k owner.pem -m order-4711 --chip-rate 1 --payload signature",
                "embed model.ply -o theirs.ply -k other.pem -m order-4712 --chip-rate 1 --payload signature",
            ] {
                folder.done(command);
            }
            folder.contents()
        });
        let folder = Self::empty();
        for (name, bytes) in files {
            folder.write(name, bytes);
        }
        folder
    }

    pub(crate) fn path(&self, name: impl AsRef<Path>) -> PathBuf {
        self.dir.path().join(name)
    }

    pub(crate) fn write(&self, name: impl AsRef<Path>, bytes: impl AsRef<[u8]>) {
        fs::write(self.path(name), bytes).expect("a file");
    }

    /// In the format that the name promises, gzipped if it ends in .gz.
    pub(crate) fn write_mesh(&self, name: &str, mesh: &TriMesh, precision: Precision) {
        let bytes = write_mesh(
            mesh,
            Format::of_path(Path::new(name)).expect("a format"),
            precision,
        );
        if name.ends_with(".gz") {
            let mut gzip = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
            std::io::Write::write_all(&mut gzip, &bytes).expect("memory");
            self.write(name, gzip.finish().expect("memory"));
        } else {
            self.write(name, bytes);
        }
    }

    /// A glTF whose buffer lies in a file beside it, as does a picture.
    pub(crate) fn write_gltf(&self, name: &str, mesh: &TriMesh, buffer: &str, picture: &[u8]) {
        let file = write_mesh(mesh, Format::Glb, Precision::Single);
        let length = u32::from_le_bytes(file[12..16].try_into().expect("a number")) as usize;
        let mut json: serde_json::Value = serde_json::from_slice(&file[20..20 + length]).expect("JSON");
        json["buffers"][0]["uri"] = buffer.into();
        json["images"] = serde_json::json!([{"uri": "skin.png"}]);
        let path = self.path(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        fs::write(path.with_file_name(buffer), &file[28 + length..]).expect("a file");
        fs::write(path.with_file_name("skin.png"), picture).expect("a file");
        fs::write(path, json.to_string()).expect("a file");
    }

    pub(crate) fn read(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).expect(name)
    }

    pub(crate) fn text(&self, name: &str) -> String {
        String::from_utf8(self.read(name)).expect(name)
    }

    /// Every file by its name, with what it holds.
    pub(crate) fn contents(&self) -> BTreeMap<PathBuf, Vec<u8>> {
        let entries = fs::read_dir(self.dir.path()).expect("the folder");
        entries
            .map(|entry| entry.expect("an entry"))
            .filter(|entry| entry.path().is_file())
            .map(|entry| (entry.file_name().into(), fs::read(entry.path()).expect("a file")))
            .collect()
    }

    /// `sigmark` with arguments, about to be run here without a terminal.
    pub(crate) fn command<'a>(&self, arguments: impl IntoIterator<Item = &'a str>) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_sigmark"));
        command
            .args(arguments)
            .current_dir(self.dir.path())
            .env_remove("SIGMARK_PASSPHRASE")
            .stdin(Stdio::null());
        command
    }

    /// Runs a command line whose arguments are separated by blanks.
    pub(crate) fn run(&self, line: &str) -> Run {
        finish(self.command(line.split_whitespace()))
    }

    /// Runs a command that must be carried out and answer yes.
    pub(crate) fn done(&self, line: &str) -> Run {
        let run = self.run(line);
        assert_eq!((run.code, run.err.as_str()), (Some(0), ""), "sigmark {line}");
        run
    }

    /// Runs a command that can't be carried out: one line on standard error with all the words, and no file touched.
    pub(crate) fn refused(&self, line: &str, words: &[&str]) {
        self.refused_as(line, self.command(line.split_whitespace()), words);
    }

    /// As `refused`, with a command set up by the caller.
    pub(crate) fn refused_as(&self, line: &str, command: Command, words: &[&str]) {
        let before = self.contents();
        let run = finish(command);
        assert_eq!(run.code, Some(2), "sigmark {line}: {run:?}");
        // What embed is about to do is no answer.
        assert!(
            run.out.is_empty() || run.out.starts_with("Signing "),
            "sigmark {line}: {}",
            run.out
        );
        assert!(run.err.starts_with("sigmark: "), "sigmark {line}: {}", run.err);
        assert!(
            run.err.ends_with('\n') && run.err.lines().count() == 1,
            "sigmark {line}: {}",
            run.err
        );
        for word in words {
            assert!(
                run.err.contains(word),
                "sigmark {line}: no {word:?} in: {}",
                run.err
            );
        }
        let names: Vec<_> = self.contents().into_keys().collect();
        assert_eq!(
            names,
            before.keys().cloned().collect::<Vec<_>>(),
            "sigmark {line}"
        );
        assert!(self.contents() == before, "sigmark {line}: a file was changed");
    }
}

pub(crate) fn finish(mut command: Command) -> Run {
    let output = command.output().expect("the binary");
    let text = |bytes| String::from_utf8(bytes).expect("UTF-8");
    Run {
        code: output.status.code(),
        out: text(output.stdout),
        err: text(output.stderr),
    }
}
