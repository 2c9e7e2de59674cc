use job::Job;
use mesh::{Edges, TriMesh};
use mhb_core::{Laplacian, Spectrum, SpectrumError, SpectrumOptions, SpectrumStage};
use sigmark::mark::Patch;
use sprs::{CsMat, TriMat};

use crate::BaselineError;

/// Relative residual of the eigenvectors: far below what any attack leaves of a mark.
const TOLERANCE: f64 = 1e-8;

/// K = degree − adjacency, #V by #V (Ohbuchi et al. 2001, section 2.1): xᵀ K x = Σ (xᵢ − xⱼ)² over the edges. Knows the connectivity alone.
pub fn kirchhoff(mesh: &TriMesh) -> CsMat<f64> {
    let n = mesh.vertex_count();
    let edges = Edges::of(mesh);
    let mut entries = TriMat::with_capacity((n, n), 4 * edges.count());
    for &[a, b] in edges.vertices() {
        let (a, b) = (a as usize, b as usize);
        entries.add_triplet(a, a, 1.0);
        entries.add_triplet(b, b, 1.0);
        entries.add_triplet(a, b, -1.0);
        entries.add_triplet(b, a, -1.0);
    }
    entries.to_csr()
}

/// The m lowest eigenvectors of a patch's K, of unit norm.
pub(crate) fn laplacian_basis(
    index: usize,
    patch: &Patch,
    functions: usize,
    job: &Job,
) -> Result<Spectrum, BaselineError> {
    let options = SpectrumOptions {
        count: functions,
        tolerance: TOLERANCE,
        ..Default::default()
    };
    let unit_masses = vec![1.0; patch.vertices().len()];
    Laplacian::new(kirchhoff(patch.mesh()), unit_masses)
        .and_then(|laplacian| {
            Spectrum::of_laplacian(&laplacian, &options, &job.within(SpectrumStage::Solving))
        })
        .map_err(|source| match source {
            SpectrumError::Job(error) => error.into(),
            source => BaselineError::Spectrum { patch: index, source },
        })
}

#[cfg(test)]
mod tests {
    use mesh::shapes;

    use super::*;

    #[test]
    fn the_quadratic_form_sums_squared_differences_over_the_edges() {
        let mesh = shapes::bumpy_torus(12, 7, 1);
        let x: Vec<f64> = mesh
            .positions()
            .iter()
            .map(|p| p[0] - 2.0 * p[1] * p[2])
            .collect();
        let k = kirchhoff(&mesh);
        let form: f64 = k.iter().map(|(&value, (i, j))| value * x[i] * x[j]).sum();
        let edges = Edges::of(&mesh);
        let sum: f64 = edges
            .vertices()
            .iter()
            .map(|&[a, b]| (x[a as usize] - x[b as usize]).powi(2))
            .sum();
        assert!((form - sum).abs() < 1e-12 * sum);
    }

    #[test]
    fn its_trace_is_twice_the_number_of_edges() {
        let mesh = shapes::book(5);
        let k = kirchhoff(&mesh);
        let trace: f64 = (0..mesh.vertex_count()).filter_map(|v| k.get(v, v)).sum();
        assert_eq!(trace, 2.0 * Edges::of(&mesh).count() as f64);
    }
}
