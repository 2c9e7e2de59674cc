//! How evenly a mesh samples its surface, which says how much noise at the vertices disturbs coefficients of harmonics.
//!
//! ```text
//! cargo run --release -p sigmark-mhb-core --example evenness -- MESH...
//! ```
//!
//! Independent noise of variance σ² at every vertex has variance σ² Σ Dᵢ² φᵢ² in the coefficient of φ, about σ² Σ Dᵢ² / Σ Dᵢ, D being the lumped
//! mass. As much comes of (Σ Dᵢ)² / Σ Dᵢ² vertices of equal mass: this number is printed, and its share of the vertices.

#![allow(clippy::print_stdout)]

use mesh_io::Asset;
use mhb_core::lumped_mass;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    for path in std::env::args().skip(1) {
        let asset = Asset::open(&path)?;
        let mass = lumped_mass(asset.mesh())?;
        let sum: f64 = mass.iter().sum();
        let squares: f64 = mass.iter().map(|m| m * m).sum();
        let even = sum * sum / squares;
        println!(
            "{path}: {even:.0} of {} vertices, {:.1} %",
            mass.len(),
            100.0 * even / mass.len() as f64
        );
    }
    Ok(())
}
