//! What happens to a suspect: the one list of attacks, `attacks/attacks.toml`, and the similarity that moves every suspect.

use std::sync::LazyLock;

use mesh::{Similarity, TriMesh};
use rand_chacha::{
    ChaCha20Rng,
    rand_core::{Rng, SeedableRng},
};
use serde::Deserialize;

/// A column of a table: one script with its strength, or several in a chain.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Attack {
    /// For people: a column's header.
    pub name: String,
    /// As `attacks/attack.py` has it, `crop:50+simplify:10`: what the attack is known by.
    pub spec: String,
    /// Another name by which `attack.py` knows a chain.
    pub short: Option<String>,
    /// The name of the attack of Table 4 that this one does by other means.
    pub instead_of: Option<String>,
}

/// A script of `attacks/`.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Script {
    /// As it stands in a [spec](Attack::spec).
    pub name: String,
    /// In words.
    pub does: String,
    /// What its number means, and its default.
    pub strength: String,
    /// Whether the seed makes a difference.
    pub random: bool,
    /// What is left as it was.
    pub survives: Vec<Survivor>,
}

/// What an attack leaves as it was.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum Survivor {
    /// The same vertices and triangles, in other places.
    Connectivity,
    /// What is left lies exactly where it lay, up to a similarity.
    Surface,
}

/// The columns of each table, in their order.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tables {
    /// The paper's Table 4.
    pub table4: Vec<Attack>,
    /// The paper's Table 5: chains.
    pub table5: Vec<Attack>,
    /// Table 4's decimation by other means.
    pub meshlab: Vec<Attack>,
    /// What the paper has none of.
    pub beyond: Vec<Attack>,
    /// What models meet in the wild.
    pub wild: Vec<Attack>,
    /// The benchmark of the registration.
    pub registration: Vec<Attack>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    script: Vec<Script>,
    tables: Tables,
}

static DOCUMENT: LazyLock<Document> = LazyLock::new(|| {
    toml::from_str(include_str!("../../../attacks/attacks.toml")).expect("a test reads attacks.toml")
});

/// All scripts.
pub fn scripts() -> &'static [Script] {
    &DOCUMENT.script
}

/// Which attacks stand in which table.
pub fn tables() -> &'static Tables {
    &DOCUMENT.tables
}

impl Tables {
    /// What marks are read after, table by table.
    pub fn of_marks(&self) -> impl Iterator<Item = &Attack> {
        [
            &self.table4,
            &self.table5,
            &self.meshlab,
            &self.beyond,
            &self.wild,
        ]
        .into_iter()
        .flatten()
    }
}

impl Attack {
    /// The scripts that run one after the other, with the strengths that the spec gives them.
    pub fn steps(&self) -> impl Iterator<Item = (&'static Script, Option<f64>)> {
        self.spec.split('+').filter_map(|step| {
            let (name, strength) = step.split_once(':').unwrap_or((step, ""));
            let script = scripts().iter().find(|script| script.name == name)?;
            Some((script, strength.parse().ok()))
        })
    }

    /// Whether the seed makes a difference. A crop that keeps all of a mesh draws a plane, but cuts nothing.
    pub fn is_random(&self) -> bool {
        self.spec != "crop:100" && self.steps().any(|(script, _)| script.random)
    }

    /// Whether something is left of the attacked mesh as it was.
    pub fn keeps(&self, survivor: Survivor) -> bool {
        self.steps()
            .all(|(script, _)| script.survives.contains(&survivor))
    }

    /// Whether it only moves the mesh: then nobody knows the true pose.
    pub(crate) fn moves(&self) -> bool {
        self.keeps(Survivor::Connectivity) && self.keeps(Survivor::Surface)
    }
}

/// What moves a suspect to where nobody knows: uniform rotation, scale between 0.01 and 100, shift by up to ten diagonals.
pub fn random_similarity(mesh: &TriMesh, seed: u64) -> Similarity {
    let mut rng = ChaCha20Rng::seed_from_u64(seed);
    let mut uniform = || 2.0 * f64::from(rng.next_u32()) / f64::from(u32::MAX) - 1.0;
    // A point in the unit ball of four dimensions points in a uniformly random direction.
    let quaternion = loop {
        let q: [f64; 4] = std::array::from_fn(|_| uniform());
        if (0.01..=1.0).contains(&q.iter().map(|x| x * x).sum::<f64>()) {
            break q;
        }
    };
    let scale = 100f64.powf(uniform());
    let translation = std::array::from_fn(|_| 10.0 * uniform() * mesh.bounding_box().diagonal());
    Similarity {
        scale,
        translation,
        ..Similarity::from_quaternion(quaternion)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::process::root;
    use std::fs;

    fn all() -> impl Iterator<Item = &'static Attack> {
        tables().of_marks().chain(&tables().registration)
    }

    #[test]
    fn every_attack_is_made_of_scripts_that_are_there() {
        for attack in all() {
            assert_eq!(
                attack.steps().count(),
                attack.spec.split('+').count(),
                "{attack:?}"
            );
            let known = |name: &String| tables().table4.iter().any(|other| other.name == *name);
            assert!(attack.instead_of.as_ref().is_none_or(known), "{attack:?}");
        }
        for script in scripts() {
            let file = root()
                .join("attacks")
                .join(format!("{}.py", script.name.replace('-', "_")));
            assert!(file.is_file(), "{}", file.display());
        }
    }

    #[test]
    fn the_readme_tells_of_every_script_and_chain() {
        let readme = fs::read_to_string(root().join("attacks/README.md")).unwrap();
        let rows: Vec<&str> = readme.lines().filter(|line| line.starts_with("| `")).collect();
        let scripts = scripts().iter().map(|script| {
            let survives: Vec<String> = script
                .survives
                .iter()
                .map(|what| format!("{what:?}").to_lowercase())
                .collect();
            let survives = if survives.is_empty() {
                "–".into()
            } else {
                survives.join(", ")
            };
            format!(
                "| `{}` | {} | {} | {survives} |",
                script.name, script.does, script.strength
            )
        });
        let chains = tables().table5.iter().map(|attack| {
            let short = attack.short.as_deref().unwrap_or_default();
            format!("| `{short}` | `{}` | {} |", attack.spec, attack.name)
        });
        assert_eq!(rows, scripts.chain(chains).collect::<Vec<_>>());
    }

    #[test]
    fn a_chain_keeps_what_all_of_its_steps_keep() {
        let of = |spec: &str| all().find(|attack| attack.spec == spec).unwrap();
        assert!(of("crop:50").is_random() && !of("crop:100").is_random() && !of("loop").is_random());
        assert!(of("crop:50+simplify:10").is_random());
        assert!(of("crop:50").keeps(Survivor::Surface) && !of("crop:50").keeps(Survivor::Connectivity));
        assert!(of("noise:0.5").keeps(Survivor::Connectivity) && !of("noise:0.5").keeps(Survivor::Surface));
        assert!(!of("crop:50+simplify:10").keeps(Survivor::Surface));
    }
}
