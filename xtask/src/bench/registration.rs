//! `cargo xtask bench registration`

use std::{path::PathBuf, time::Duration};

use anyhow::Result;
use bench_harness::registration::RegistrationBench;
use clap::Args;

#[derive(Args)]
pub(crate) struct Registration {
    /// Mesh files
    #[arg(long, value_name = "DIR")]
    meshes: PathBuf,
    /// Only files whose name begins so; may be given again
    #[arg(long, value_name = "NAME")]
    only: Vec<String>,
    /// Only attacks whose name begins so; may be given again
    #[arg(long, value_name = "NAME")]
    attack: Vec<String>,
    /// Random poses of each mesh after each attack
    #[arg(long, value_name = "N", default_value_t = 20)]
    draws: u64,
    /// Meshes with more vertices are passed over
    #[arg(long, value_name = "N", default_value_t = usize::MAX, hide_default_value = true)]
    most_vertices: usize,
    /// Begin no draw after so many minutes, and write what there is; 0: what is finished
    #[arg(long, value_name = "MINUTES")]
    minutes: Option<f64>,
    /// Leave out the peers, and the times of a million vertices
    #[arg(long)]
    no_peers: bool,
}

impl Registration {
    pub(crate) fn run(self) -> Result<()> {
        let time = |minutes| Duration::try_from_secs_f64(60.0 * minutes);
        RegistrationBench {
            meshes: self.meshes,
            only: self.only,
            attacks: self.attack,
            draws: self.draws,
            most_vertices: self.most_vertices,
            with_peers: !self.no_peers,
            time: self.minutes.map(time).transpose()?,
        }
        .run()
    }
}
