//! What one sees of a mark, and what is read of it: layouts beside each other on the same models.
//!
//! `layouts.rs` has the layouts, `trial.rs` what is measured of one on a model, `equal.rs` how strong one has to be to outlast as much as another; `page.rs` writes.

mod equal;
mod layouts;
mod page;
mod trial;

use std::path::PathBuf;

use anyhow::{Result, bail, ensure};
use clap::Args;
use evaluation::{
    attacks::{Attack, tables},
    inputs::{is_chosen, mesh_files_below, name_of},
    python::Python,
    sources::{self, digest},
};
use mesh_io::Asset;
use sigmark::mark::JointModel;

pub use layouts::TriedLayout;

use self::{
    page::Page,
    trial::{DRAWS, Marked, Outlasted},
};
use crate::kept::{self, Key};

/// Models whose marks are attacked in every way of Tables 4 and 5, where they are there.
const ATTACKED: [&str; 4] = [
    "armadillo_43k",
    "stanford_bunny_bun_zipper_36k",
    "horse_48k",
    "laurana_25k_boundary",
];

/// Models on which the seamed mark and today's are compared where they outlast as much, where they are there.
const EQUAL: [&str; 6] = [
    "stanford_bunny_bun_zipper_36k",
    "igea_134k",
    "armadillo_43k",
    "horse_48k",
    "turbine_blade_100k",
    "elephant_refined_44k",
];

/// Which models, layouts and attacks.
#[derive(Args)]
pub struct VisibilityBench {
    /// A folder of mesh files, and of folders of them; may be given again
    #[arg(long, value_name = "DIR", required = true)]
    pub meshes: Vec<PathBuf>,
    /// Only files whose name begins so; may be given again
    #[arg(long, value_name = "NAME")]
    pub only: Vec<String>,
    /// Meshes with more vertices have no MSDM2, whose time grows with their square
    #[arg(long, value_name = "N", default_value_t = 200_000)]
    pub most_vertices: usize,
    /// A layout as KIND:PATCHES:CHIP_RATE:RMS, such as free:2:3:4e-4, or pooled:auto:auto:4e-4; may be given again [default: those of the page]
    #[arg(long, value_name = "LAYOUT")]
    pub layout: Vec<TriedLayout>,
    /// Only these attacks, such as simplify:1, and no marks that outlast as much; may be given again [default: those of the paper's tables]
    #[arg(long, value_name = "ATTACK")]
    pub attack: Vec<String>,
    /// How often bits and attacks are drawn where little is read
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = clap::value_parser!(u8).range(i64::from(DRAWS)..))]
    pub draws: u8,
    /// Only what is seen, without attacks
    #[arg(long)]
    pub no_attacks: bool,
}

impl VisibilityBench {
    /// Measures, and writes `results/visibility.md` and its CSV files.
    pub fn run(&self) -> Result<()> {
        let attackers = if self.no_attacks {
            None
        } else {
            Some(Python::prepare()?)
        };
        let (code, commit) = (sources::digest_of_all_but(&NO_PART)?, sources::commit());
        let folder = kept::folder(&format!("visibility/{code}"))?;
        let (layouts, attacked) = match &self.layout[..] {
            [] => (&layouts::PAGE[..], &layouts::ATTACKED[..]),
            given => (given, given),
        };
        let attacks = self.attacks()?;
        let specs = || attacks.iter().map(|attack| attack.spec.as_str());
        let mut page = Page {
            attacks: attacks.clone(),
            draws: self.draws,
            ..Page::default()
        };
        let mut files = Vec::new();
        for folder in &self.meshes {
            files.extend(mesh_files_below(folder)?);
        }
        files.retain(|file| self.only.is_empty() || is_chosen(&name_of(file), &self.only));
        ensure!(!files.is_empty(), "no such mesh file there");
        for file in files {
            let name = name_of(&file);
            let asset = match Asset::open(&file) {
                Ok(asset) => asset,
                Err(refused) => {
                    println!("{name}: passed over, {refused}");
                    continue;
                }
            };
            let key = |what: &str| Key::new(format!("{name}-{what}")).of_asset(&asset);
            let key_of = |layout: &TriedLayout, what: &str| {
                key(&format!("{}-{what}", layout.to_string().replace(':', "-")))
            };
            // Whether there is MSDM2.
            let seen = format!("seen-{}", self.most_vertices);
            for layout in layouts {
                let seen = kept::figures(&folder, &key_of(layout, &seen), || {
                    println!("{name}, {layout}: what is seen");
                    Ok(match Marked::new(&name, &asset, layout) {
                        Ok(marked) => Ok(marked.seen(self.most_vertices)?),
                        Err(refused) => Err(format!("{refused:#}")),
                    })
                })?;
                match seen {
                    Ok(seen) => page.seen.push(seen),
                    Err(refused) => page.refused.push([name.clone(), layout.to_string(), refused]),
                }
            }
            if let Some(attackers) = attackers.as_ref().filter(|_| ATTACKED.contains(&name.as_str())) {
                for layout in attacked {
                    let asked = specs().collect::<Vec<_>>().join(" ");
                    let outlasted = format!("outlasted-{}-{}", self.draws, digest(asked.as_bytes()));
                    let outlasted = kept::figures(&folder, &key_of(layout, &outlasted), || {
                        println!("{name}, {layout}: what it outlasts");
                        let marked = Marked::new(&name, &asset, layout)?;
                        Ok(Outlasted {
                            model: name.clone(),
                            layout: *layout,
                            read: marked.read(specs(), self.draws, JointModel::default(), attackers)?,
                        })
                    })?;
                    page.outlasted.push(outlasted);
                }
            }
            if let Some(attackers) = attackers
                .as_ref()
                .filter(|_| self.attack.is_empty() && EQUAL.contains(&name.as_str()))
            {
                let equal = kept::figures(&folder, &key(&format!("equal-{}", self.draws)), || {
                    println!("{name}: what is seen of marks that outlast as much");
                    equal::of(&name, &asset, self.draws, attackers)
                })?;
                page.equal.extend(equal);
            }
        }
        page.write(attackers.as_ref(), &commit, &code)
    }

    /// Those of Tables 4 and 5 that are asked for.
    fn attacks(&self) -> Result<Vec<&'static Attack>> {
        let all = || tables().table4.iter().chain(&tables().table5);
        let is_known = |spec: &&String| all().any(|attack| attack.spec == **spec);
        if let Some(unknown) = self.attack.iter().find(|spec| !is_known(spec)) {
            let known: Vec<&str> = all().map(|attack| attack.spec.as_str()).collect();
            bail!("--attack {unknown}: there are {}", known.join(", "));
        }
        Ok(all()
            .filter(|attack| self.attack.is_empty() || self.attack.contains(&attack.spec))
            .collect())
    }
}

/// What has no part in the figures.
const NO_PART: [&str; 13] = [
    "crates/baselines",
    "crates/cli",
    "crates/evaluation/src/pages",
    "crates/library",
    "crates/sigmark/tests",
    "bench-harness/src/eigen",
    "bench-harness/src/partition",
    "bench-harness/src/quality",
    "bench-harness/src/registration",
    "bench-harness/src/seconds",
    "bench-harness/src/security",
    "bench-harness/src/tracing",
    "bench-harness/src/visibility/page.rs",
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_has_no_part_is_there() {
        kept::assert_is_there(&NO_PART);
    }
}
