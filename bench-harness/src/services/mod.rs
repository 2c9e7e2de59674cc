//! What runs around the library: the shop of `bindings/python/examples/downloads` under load, and batches of `sigmark.batch`.
//!
//! `services/downloads.py` and `services/batches.py` measure, in the Python of their users; `page.rs` writes.

mod page;

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::Args;
use evaluation::{
    inputs::{mesh_files, name_of, named},
    process::root,
    python::Python,
};
use serde::{Deserialize, de::DeserializeOwned};

use crate::{kept, wheel};

/// The models that are sold unless others are asked for.
const MODELS: [&str; 2] = ["turbine_blade_100k", "ct_skull_1081k_closed"];

/// What to measure, and on what.
#[derive(Args)]
pub struct ServicesBench {
    /// Mesh files
    #[arg(long, value_name = "DIR")]
    pub meshes: PathBuf,
    /// Files of these names, in this order; may be given again. The first is the one of the batches
    #[arg(long, value_name = "NAME", default_values = MODELS)]
    pub only: Vec<String>,
    /// The wheel; by default the latest that `cargo xtask wheel` wrote
    #[arg(long, value_name = "FILE")]
    pub wheel: Option<PathBuf>,
}

/// A model that is sold. Times are seconds of the wall.
#[derive(Deserialize)]
struct Sold {
    vertices: usize,
    bytes: usize,
    /// All that does not depend on the buyer.
    prepare: f64,
    /// A copy after that, the median.
    embed: f64,
    /// The first answer of the service.
    first: f64,
    loads: Vec<Load>,
    killed: Killed,
}

/// So many buyers at once.
#[derive(Deserialize)]
struct Load {
    clients: usize,
    answered: usize,
    asked: usize,
    p50: f64,
    p99: f64,
    per_second: f64,
}

/// A service that was killed in the middle of a load, and started again.
#[derive(Deserialize)]
struct Killed {
    orders: usize,
    answered_before: usize,
    answered_after: usize,
    same_bytes: usize,
    seconds_until_all_are_answered: f64,
    without_certificate: usize,
    certificates: usize,
    leak_named: bool,
}

/// What batches of one model cost.
#[derive(Deserialize)]
struct Batches {
    vertices: usize,
    embed: Batch,
    verify: Batch,
}

/// The same rows one after the other, and by Daft.
#[derive(Deserialize)]
struct Batch {
    serial: Cost,
    native: Cost,
    /// Whether the results are the same.
    same: bool,
}

#[derive(Deserialize)]
struct Cost {
    rows: usize,
    errors: usize,
    wall: f64,
    /// How many rows were worked on at once, each on one core.
    cores: usize,
}

impl Cost {
    /// Core hours of a thousand rows, cores that waited included.
    fn of_a_thousand(&self) -> f64 {
        1000.0 * self.wall * self.cores as f64 / self.rows.max(1) as f64 / 3600.0
    }
}

impl ServicesBench {
    /// Measures, and writes `results/services.md`.
    ///
    /// # Errors
    /// Without Python, without the wheel, and where a service loses something.
    pub fn run(&self) -> Result<()> {
        let folder = kept::folder("services")?;
        let scripts = root().join("bench-harness/services");
        let python = Python::prepare_in(scripts, folder.join("venv"))?;
        wheel::install(&python, self.wheel.as_deref())?;
        let files = mesh_files(&self.meshes)?;
        let service = root().join("bindings/python/examples/downloads");
        let (mut sold, mut batches) = (Vec::new(), None);
        for name in &self.only {
            let Some(path) = named(&files, name) else {
                println!("{name}: not in {}, left out", self.meshes.display());
                continue;
            };
            let work = folder.join("work");
            if batches.is_none() {
                batches = Some((
                    name_of(path),
                    measured::<Batches>(&python, "batches.py", &[path, &work])?,
                ));
                println!("{name}: batches done");
            }
            let report: Sold = measured(&python, "downloads.py", &[path, &work, &service])?;
            println!("{name}: downloads done");
            sold.push((name_of(path), report));
        }
        let Some((name, batches)) = batches else {
            bail!(
                "{}: no mesh file there has a name that was asked for",
                self.meshes.display()
            );
        };
        page::write(&sold, (&name, &batches))?;
        for (name, Sold { killed, loads, .. }) in &sold {
            let lost = killed.without_certificate > 0
                || killed.same_bytes < killed.answered_before
                || killed.answered_after < killed.orders
                || !killed.leak_named
                || loads.iter().any(|load| load.answered < load.asked);
            if lost {
                bail!("{name}: the service lost something; results/services.md has what");
            }
        }
        match batches.embed.same && batches.verify.same {
            true => Ok(()),
            false => bail!("{name}: a batch is not the serial run"),
        }
    }
}

/// What a script prints of a model.
fn measured<T: DeserializeOwned>(python: &Python, script: &str, arguments: &[&Path]) -> Result<T> {
    let report = python.run(script, arguments)?;
    let last = report.lines().last().unwrap_or_default();
    serde_json::from_str(last).with_context(|| format!("{script}: {report}"))
}
