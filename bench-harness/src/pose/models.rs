//! Which models, and the poses in which they come back.

use std::{
    fmt,
    path::{Path, PathBuf},
};

use anyhow::{Context, Result};
use evaluation::python::Python;
use mesh::TriMesh;
use mesh_io::{Asset, Format, Precision, write_mesh};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::{blender::Blender, handles, reading::Signed, skinning};
use crate::suspects::attacked;

/// A model of the page.
pub(super) struct Model {
    pub(super) name: &'static str,
    /// What the name of its file begins with.
    pub(super) file: &'static str,
    /// Whether it has a skeleton or morph targets of its own; else it is given one.
    pub(super) is_asset: bool,
    pub(super) is_animated: bool,
    /// What happens to a scan before it is given its skeleton, as attacks are written.
    simplified: Option<&'static str>,
    /// The pose of which a picture is drawn.
    pub(super) drawn: Option<fn() -> Pose>,
}

/// How a model is posed, and by whom.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Pose {
    /// As the page calls it.
    pub(super) group: String,
    pub(super) name: String,
    pub(super) by: By,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) enum By {
    /// What `pose.py` is asked for, what happens to it afterwards, the format in which it comes back, and by which of our attacks it is changed then, if any.
    Blender {
        pose: Value,
        after: Value,
        format: String,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        attack: Option<String>,
    },
    /// Our own linear blend skinning: every joint turned about its middle by up to so many degrees, every target taken at random; rounded to so many bits, if any.
    Own {
        degrees: f64,
        seed: u64,
        bits: Option<u32>,
    },
    /// One end of it turned by so many degrees, the other held, and the rest as rigid as possible.
    Handles { degrees: u32 },
}

pub(super) const OWN_RIG: &str = "by its rig";
pub(super) const FRAMES: &str = "its own animation";
pub(super) const NO_RIG: &str = "without a rig";
pub(super) const OTHER_VERTICES: &str = "by its rig, and then other vertices";
pub(super) const BENT_OTHERS: &str = "without a rig, and then other vertices";

/// The order in which scans come back: every format in turn.
const FORMATS: [&str; 4] = ["obj", "stl", "glb", "ply"];

pub(super) fn all() -> impl Iterator<Item = Model> {
    let asset = |name| Model {
        name,
        file: name,
        is_asset: true,
        is_animated: false,
        simplified: None,
        drawn: None,
    };
    let scan = |name, file, simplified| Model {
        is_asset: false,
        file,
        simplified,
        ..asset(name)
    };
    [
        Model {
            is_animated: true,
            drawn: Some(|| frame(0, 20)),
            ..asset("CesiumMan")
        },
        Model {
            is_animated: true,
            ..asset("Fox")
        },
        asset("riggedMesh"),
        asset("webxr_generic-hand_left"),
        Model {
            drawn: Some(|| targets(1, "obj")),
            ..asset("MorphStressTest")
        },
        scan("horse 3k", "horse", Some("simplify:6.2")),
        scan("horse 20k", "horse", Some("simplify:41.5")),
        Model {
            drawn: Some(|| bones(60, true, "stl")),
            ..scan("horse 48k", "horse", None)
        },
        scan("armadillo 43k", "armadillo_43k", None),
        scan("laurana 25k", "laurana_25k", None),
    ]
    .into_iter()
}

impl Model {
    /// The original: the file itself, or a scan with a skeleton.
    pub(super) fn make(&self, file: &Path, blender: &Blender, attacks: &Python) -> Result<PathBuf> {
        if self.is_asset {
            return Ok(file.into());
        }
        let mut mesh = Asset::open(file)?.mesh().clone();
        if let Some(spec) = self.simplified {
            mesh = attacked(attacks, &mesh, &self.name.replace(' ', "-"), spec, 0)?;
        }
        blender.rigged(self.name, &write_mesh(&mesh, Format::Ply, Precision::Double))
    }

    /// All poses, those of animations of every so manieth frame.
    pub(super) fn poses(&self, animations: &[[i64; 2]], every: usize) -> impl Iterator<Item = Pose> {
        let frames = animations.iter().enumerate();
        let frames = frames.flat_map(move |(action, [first, last])| {
            (*first..=*last).step_by(every).map(move |at| frame(action, at))
        });
        let mut poses: Vec<Pose> = match self.is_animated {
            true => frames.collect(),
            false => Vec::new(),
        };
        let turned = [30, 60, 110].into_iter().zip(FORMATS.into_iter().cycle());
        if self.name == "MorphStressTest" {
            poses.extend((1..=4).map(|seed| targets(seed, FORMATS[seed as usize - 1])));
        } else {
            for (i, (degrees, format)) in turned.enumerate() {
                poses.push(bones(degrees, false, format));
                poses.push(bones(degrees, true, FORMATS[(i + 1) % 4]));
            }
            poses.push(rounded(60));
        }
        // Its pieces are alike, and told by the order of a file's triangles alone, which ours does not keep.
        if self.name != "MorphStressTest" {
            poses.extend([own(30.0, None), own(60.0, Some(14))]);
        }
        for (method, degrees) in [("twist", 90), ("twist", 180), ("bend", 90), ("bend", 180)] {
            poses.push(deformed(method, degrees));
        }
        poses.extend(["lattice", "proportional"].map(shaped));
        poses.extend([60, 120].map(handles));
        if !self.is_asset {
            poses.extend([30, 60, 110].map(|degrees| decimated(degrees, false)));
            poses.extend([30, 60, 110].map(|degrees| decimated(degrees, true)));
            poses.push(changed(60, false, "cropped to half", json!({"crop": true})));
            poses.push(changed(60, false, "subdivided", json!({"subdivide": 1})));
            poses.extend([false, true].map(remeshed));
            poses.extend(bent_others());
        }
        poses.into_iter()
    }
}

fn blender(group: &str, name: String, pose: Value, after: Value, format: &str) -> Pose {
    Pose {
        group: group.into(),
        name,
        by: By::Blender {
            pose,
            after,
            format: format.into(),
            attack: None,
        },
    }
}

fn frame(action: usize, frame: i64) -> Pose {
    let pose = json!({"kind": "frame", "action": action, "frame": frame});
    let format = FORMATS[frame as usize % 2];
    blender(
        FRAMES,
        format!("animation {}, frame {frame}", action + 1),
        pose,
        json!({}),
        format,
    )
}

fn bones(degrees: u32, preserve_volume: bool, format: &str) -> Pose {
    let way = if preserve_volume {
        "dual quaternions"
    } else {
        "linear"
    };
    let pose =
        json!({"kind": "bones", "degrees": degrees, "seed": degrees, "preserve_volume": preserve_volume});
    let name = format!("bones up to {degrees}°, {way}");
    blender(OWN_RIG, name, pose, json!({"shuffle": degrees}), format)
}

fn rounded(degrees: u32) -> Pose {
    let pose = json!({"kind": "bones", "degrees": degrees, "seed": 7});
    let after = json!({"weld": true, "shuffle": 7, "bits": 14});
    let name = format!("bones up to {degrees}°, linear; welded, 14 bits");
    blender(OWN_RIG, name, pose, after, "obj")
}

fn targets(seed: u64, format: &str) -> Pose {
    let pose = json!({"kind": "targets", "seed": seed});
    blender(
        OWN_RIG,
        format!("morph targets, seed {seed}"),
        pose,
        json!({}),
        format,
    )
}

fn own(degrees: f64, bits: Option<u32>) -> Pose {
    let rounded = bits.map_or(String::new(), |bits| format!(", {bits} bits"));
    Pose {
        group: OWN_RIG.into(),
        name: format!("our skinning, up to {degrees}°{rounded}"),
        by: By::Own {
            degrees,
            seed: degrees as u64,
            bits,
        },
    }
}

fn deformed(method: &str, degrees: u32) -> Pose {
    let pose = json!({"kind": method, "degrees": degrees});
    blender(
        NO_RIG,
        format!("{method} by {degrees}°"),
        pose,
        json!({"shuffle": degrees}),
        "ply",
    )
}

fn shaped(kind: &str) -> Pose {
    let name = match kind {
        "lattice" => "lattice",
        _ => "proportional edits",
    };
    blender(
        NO_RIG,
        name.into(),
        json!({"kind": kind, "seed": 3}),
        json!({"shuffle": 3}),
        "obj",
    )
}

fn handles(degrees: u32) -> Pose {
    Pose {
        group: NO_RIG.into(),
        name: format!("handles turned by {degrees}°"),
        by: By::Handles { degrees },
    }
}

fn changed(degrees: u32, preserve_volume: bool, name: &str, after: Value) -> Pose {
    let mut pose = json!({"kind": "bones", "degrees": degrees, "seed": degrees});
    let mut way = "";
    if preserve_volume {
        pose["preserve_volume"] = true.into();
        way = ", dual quaternions";
    }
    blender(
        OTHER_VERTICES,
        format!("bones up to {degrees}°{way}, {name}"),
        pose,
        after,
        "obj",
    )
}

fn decimated(degrees: u32, preserve_volume: bool) -> Pose {
    changed(
        degrees,
        preserve_volume,
        "decimated to 30 %",
        json!({"decimate": 0.3}),
    )
}

/// With triangles as even as MeshLab makes them, as many as before.
fn remeshed(preserve_volume: bool) -> Pose {
    changed(60, preserve_volume, "re-meshed", json!({})).with_attack("remesh:100")
}

/// What no rig does, to copies that then get other vertices.
fn bent_others() -> Vec<Pose> {
    let decimated = |pose: Pose| pose.and_then("decimated to 30 %", json!({"decimate": 0.3}));
    let bent = || deformed("bend", 90);
    vec![
        decimated(deformed("twist", 60)),
        decimated(deformed("twist", 90)),
        decimated(deformed("bend", 60)),
        decimated(bent()),
        decimated(shaped("lattice")),
        decimated(shaped("proportional")),
        deformed("twist", 90).and_then("cropped to half", json!({"crop": true})),
        bent().and_then("cropped to half", json!({"crop": true})),
        bent().and_then("subdivided", json!({"subdivide": 1})),
        bent().and_then("re-meshed", json!({})).with_attack("remesh:100"),
    ]
}

impl Pose {
    /// The same, changed by one of our attacks then.
    fn with_attack(mut self, spec: &str) -> Self {
        if let By::Blender { attack, .. } = &mut self.by {
            *attack = Some(spec.into());
        }
        self
    }

    /// The same without a rig, and its vertices changed then.
    fn and_then(mut self, name: &str, change: Value) -> Self {
        self.group = BENT_OTHERS.into();
        self.name = format!("{}, {name}", self.name);
        if let By::Blender { after, .. } = &mut self.by {
            *after = change;
        }
        self
    }

    /// What tells it from others of a model.
    pub(super) fn key(&self) -> String {
        serde_json::to_string(&self.by).unwrap_or_default()
    }

    /// Blender, with the format, or us.
    pub(super) fn made_by(&self) -> String {
        match &self.by {
            By::Blender { format, .. } => format!("Blender, {}", format.to_uppercase()),
            By::Own { .. } => "our skinning".into(),
            By::Handles { .. } => "as rigid as possible".into(),
        }
    }

    /// The suspect after the attack that it is put through, if any.
    pub(super) fn attacked(&self, suspect: TriMesh, attacks: &Python, model: &str) -> Result<TriMesh> {
        match &self.by {
            By::Blender {
                attack: Some(spec), ..
            } => {
                let name = format!("posed-{}", model.replace(' ', "-"));
                attacked(attacks, &suspect, &name, spec, 0)
            }
            _ => Ok(suspect),
        }
    }

    /// The suspect as it is read from its file, or made by us.
    pub(super) fn suspect(&self, signed: &Signed, file: Option<&Path>) -> Result<TriMesh> {
        match (&self.by, file) {
            (By::Own { degrees, seed, bits }, _) => {
                let rig = signed.rig().context("the model has no rig")?;
                skinning::posed(signed.marked(), rig, *degrees, *seed, *bits)
            }
            (By::Handles { degrees }, _) => {
                let (degrees, seed) = (f64::from(*degrees), u64::from(*degrees));
                Ok(handles::posed(signed.marked(), degrees, seed))
            }
            (By::Blender { .. }, Some(file)) => Ok(Asset::open(file)?.mesh().clone()),
            (By::Blender { .. }, None) => anyhow::bail!("Blender made no file"),
        }
    }
}

impl fmt::Display for Pose {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.by {
            By::Blender { format, .. } => write!(f, "{}, {format}", self.name),
            By::Own { .. } | By::Handles { .. } => f.write_str(&self.name),
        }
    }
}
