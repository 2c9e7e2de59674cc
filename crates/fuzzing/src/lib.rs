//! What is fuzzed, and what must hold for every input.
//!
//! A [`Target`] is a function that takes any bytes and panics where something is wrong, and seeds to begin from. `fuzz/` hands them to
//! libFuzzer, which needs a nightly compiler; `tests/seeds.rs` runs the same functions over the seeds and over mangled ones, on any.

mod claims;
mod corpus;
mod graphs;
mod keys;
mod meshes;
mod seeds;
mod stamps;

use mesh_io::Format;

pub use corpus::write_seeds;

/// Something that reads files from strangers.
pub struct Target {
    /// Its name on the command line, and of its program, corpus and dictionary in `fuzz/`.
    pub name: &'static str,
    check: fn(&[u8]),
    seeds: fn() -> Vec<Vec<u8>>,
}

/// A target that reads files of one format of meshes.
macro_rules! mesh_target {
    ($name:literal, $format:expr) => {
        Target {
            name: $name,
            check: |bytes| meshes::check(bytes, Some($format)),
            seeds: || seeds::of_format($format),
        }
    };
}

/// All targets.
pub const TARGETS: &[Target] = &[
    mesh_target!("obj", Format::Obj),
    mesh_target!("ply", Format::Ply),
    mesh_target!("stl", Format::Stl),
    mesh_target!("off", Format::Off),
    mesh_target!("gltf", Format::Gltf),
    mesh_target!("glb", Format::Glb),
    mesh_target!("threemf", Format::ThreeMf),
    Target {
        name: "gzip",
        check: gzip,
        seeds: seeds::gzipped,
    },
    Target {
        name: "certificate",
        check: claims::check_text,
        seeds: claims::certificates,
    },
    Target {
        name: "claim",
        check: claims::check_issued,
        seeds: claims::choices,
    },
    Target {
        name: "keys",
        check: keys::check,
        seeds: keys::seeds,
    },
    Target {
        name: "stamp",
        check: stamps::check_reply,
        seeds: stamps::replies,
    },
    Target {
        name: "roots",
        check: stamps::check_roots,
        seeds: stamps::roots,
    },
    Target {
        name: "graph",
        check: graphs::check,
        seeds: graphs::seeds,
    },
];

impl Target {
    /// The target of a name.
    pub fn named(name: &str) -> Option<&'static Self> {
        TARGETS.iter().find(|target| target.name == name)
    }

    /// Reads `bytes` as what the target reads.
    ///
    /// # Panics
    /// When something does not hold that must hold for every input.
    pub fn check(&self, bytes: &[u8]) {
        (self.check)(bytes);
    }

    /// Small inputs of every kind that the target knows.
    pub fn seeds(&self) -> Vec<Vec<u8>> {
        (self.seeds)()
    }
}

/// Bytes that are gzipped, if they are, and the same bytes as the content of a gzipped file.
fn gzip(bytes: &[u8]) {
    meshes::check(bytes, None);
    meshes::check(&seeds::gzip(bytes), None);
}
