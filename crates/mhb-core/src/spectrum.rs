use faer::{Mat, MatRef};
use job::Job;
use mesh::TriMesh;
use sprs::CsMat;

use crate::canonical::{References, clusters, reference_of_signs};
use crate::kernel::kernel;
use crate::operator::Operator;
use crate::{InertiaCount, Laplacian, SpectrumError, SpectrumOptions, SpectrumStage, dense, solver};

/// The m lowest eigenpairs of S h = λ B h: with lumped mass, B = D, the manifold harmonics basis (eq. 5).
#[derive(Clone, Debug)]
pub struct Spectrum {
    eigenvalues: Vec<f64>,
    eigenfunctions: Mat<f64>,
    mass: Vec<f64>,
    full_mass: Option<CsMat<f64>>,
    residuals: Vec<f64>,
    inertia: Vec<InertiaCount>,
}

impl Spectrum {
    /// The spectrum of a mesh, in the mesh's unit: eigenvalues scale as 1/s².
    ///
    /// # Errors
    /// See [`SpectrumError`]: what is wrong with the options or the mesh, and where; that a pair is missing; or that the job was
    /// cancelled.
    pub fn compute(mesh: &TriMesh, options: &SpectrumOptions, job: &Job) -> Result<Self, SpectrumError> {
        options.checked(mesh.vertex_count())?;
        job.begin(SpectrumStage::Assembly)?;
        let laplacian = Laplacian::of(mesh, options.laplacian, options.mass)?;
        Self::of_laplacian(&laplacian, options, job)
    }

    /// The spectrum of functions on a mesh that are zero at `fixed` vertices (Dirichlet's condition) and free elsewhere, the mesh's own
    /// boundary included. Eigenfunctions have a value at every vertex; no eigenvalue is 0, but for components without a fixed vertex.
    ///
    /// # Errors
    /// As [`compute`](Self::compute); [`SpectrumError::Count`] where fewer vertices are free than pairs are asked for.
    ///
    /// # Panics
    /// If there is not one value a vertex.
    pub fn with_fixed(
        mesh: &TriMesh,
        fixed: &[bool],
        options: &SpectrumOptions,
        job: &Job,
    ) -> Result<Self, SpectrumError> {
        assert_eq!(fixed.len(), mesh.vertex_count(), "one value a vertex");
        if !fixed.contains(&true) {
            return Self::compute(mesh, options, job);
        }
        let free: Vec<u32> = (0u32..)
            .zip(fixed)
            .filter(|(_, fixed)| !**fixed)
            .map(|(v, _)| v)
            .collect();
        options.checked(free.len())?;
        job.begin(SpectrumStage::Assembly)?;
        let laplacian = Laplacian::of(mesh, options.laplacian, options.mass)?;
        let of_free = Self::of_laplacian(&laplacian.restricted(&free)?, options, job)?;
        let mut eigenfunctions = Mat::zeros(mesh.vertex_count(), of_free.eigenvalues.len());
        for k in 0..eigenfunctions.ncols() {
            let column = eigenfunctions.col_as_slice_mut(k);
            let values = of_free.eigenfunction(k).iter();
            values
                .zip(&free)
                .for_each(|(&value, &v)| column[v as usize] = value);
        }
        Ok(Self {
            eigenfunctions,
            mass: laplacian.mass().to_vec(),
            full_mass: laplacian.full_mass().cloned(),
            ..of_free
        })
    }

    /// The spectrum of any Laplacian; [`SpectrumOptions::laplacian`] and
    /// [`mass`](SpectrumOptions::mass) are not looked at.
    ///
    /// # Errors
    /// As [`compute`](Self::compute).
    pub fn of_laplacian(
        laplacian: &Laplacian,
        options: &SpectrumOptions,
        job: &Job,
    ) -> Result<Self, SpectrumError> {
        let vertices = laplacian.mass().len();
        let options = options.checked(vertices)?;
        check_memory(vertices, options.count)?;
        let operator = Operator::new(laplacian);
        let kernel = kernel(&operator, |v| laplacian.is_grounded(v), options.count, job)?;
        let solution = solver::lowest(&operator, kernel.as_ref(), &options, job)?;
        finish(laplacian, &operator, kernel.ncols(), solution, options.count, job)
    }

    /// λ_0 = 0 ≤ λ_1 ≤ …, m of them, in the inverse square of the mesh's unit.
    pub fn eigenvalues(&self) -> &[f64] {
        &self.eigenvalues
    }

    /// H, #V by m, column-major: column k belongs to eigenvalue k, Hᵀ B H = I, where B is the mass, D if it is lumped. The basis is canonical: it depends on
    /// the mesh alone, and the first columns do not depend on how many were asked for. Column 0 is a positive constant, unless vertices are fixed.
    pub fn eigenfunctions(&self) -> MatRef<'_, f64> {
        self.eigenfunctions.as_ref()
    }

    /// Eigenfunction k, #V values.
    ///
    /// # Panics
    /// If there is no such pair.
    pub fn eigenfunction(&self, k: usize) -> &[f64] {
        self.eigenfunctions.col_as_slice(k)
    }

    /// The diagonal of D, #V.
    pub fn mass(&self) -> &[f64] {
        &self.mass
    }

    /// B, #V by #V, if the mass is full.
    pub fn full_mass(&self) -> Option<&CsMat<f64>> {
        self.full_mass.as_ref()
    }

    /// Relative residual of each pair, ‖S h − λ B h‖_{D⁻¹} / max(λ, 1 / area), recomputed from the final vectors.
    pub fn residuals(&self) -> &[f64] {
        &self.residuals
    }

    /// For each pair, whether the same mesh with its vertices in another order has the opposite eigenfunction: `order` lists those that are not
    /// fixed as they follow each other there. Of lumped mass; inside clusters of eigenvalues more than signs depend on the order, and the
    /// answer means nothing.
    pub fn opposite_in(&self, order: &[u32]) -> Vec<bool> {
        let references: Vec<f64> = reference_of_signs(order.len())
            .zip(order)
            .map(|(noise, &v)| noise * self.mass[v as usize].sqrt())
            .collect();
        let opposite = |k: usize| {
            let function = self.eigenfunction(k);
            let values = order.iter().map(|&v| function[v as usize]);
            let overlap: f64 = values.zip(&references).map(|(h, f)| h * f).sum();
            // Constants are positive in every order.
            self.eigenvalues[k] > 0.0 && overlap < 0.0
        };
        (0..self.eigenvalues.len()).map(opposite).collect()
    }

    /// The same spectrum with some eigenfunctions turned into their opposites, which are eigenfunctions just as well.
    ///
    /// # Panics
    /// If there is not one value a pair.
    pub fn with_opposites(mut self, opposite: &[bool]) -> Self {
        assert_eq!(opposite.len(), self.eigenvalues.len(), "one value a pair");
        for (k, _) in opposite.iter().enumerate().filter(|(_, opposite)| **opposite) {
            let column = self.eigenfunctions.col_as_slice_mut(k);
            column.iter_mut().for_each(|h| *h = -*h);
        }
        self
    }

    /// Every function multiplied, vertex by vertex, by a window: no eigenfunctions any more, nor orthonormal. Eigenvalues and residuals are those of the eigenfunctions.
    ///
    /// # Panics
    /// If there is not one value a vertex.
    pub fn windowed(mut self, window: &[f64]) -> Self {
        assert_eq!(window.len(), self.mass.len(), "one value a vertex");
        for k in 0..self.eigenfunctions.ncols() {
            let column = self.eigenfunctions.col_as_slice_mut(k);
            column.iter_mut().zip(window).for_each(|(h, w)| *h *= w);
        }
        self
    }

    /// Proof that no pair is missing: shifts, ascending, with the number of eigenvalues below each, which is how many were found there.
    /// The last shift may lie beyond the pairs that were asked for. Where all of these are 0, one shift proves that there are none below.
    pub fn inertia(&self) -> &[InertiaCount] {
        &self.inertia
    }
}

/// Whether there is memory for the eigenfunctions. It is given back at once: an allocation that fails where they are made would end the process.
fn check_memory(vertices: usize, count: usize) -> Result<(), SpectrumError> {
    Mat::<f64>::new()
        .try_reserve(vertices, count)
        .map_err(|_| SpectrumError::Eigenfunctions { count, vertices })
}

/// Canonical choice, cut to `count`, units of the mesh, residuals.
fn finish(
    laplacian: &Laplacian,
    operator: &Operator,
    zeros: usize,
    solution: solver::Solution,
    count: usize,
    job: &Job,
) -> Result<Spectrum, SpectrumError> {
    let solver::Solution {
        eigenvalues,
        mut vectors,
        counts,
    } = solution;
    let mut references = References::new(operator.size());
    for cluster in clusters(&eigenvalues) {
        if cluster.end > zeros && cluster.start < count {
            let start = cluster.start.max(zeros);
            references.canonicalise(vectors.as_mut().subcols_mut(start, cluster.end - start))?;
        }
    }
    vectors.truncate(operator.size(), count);
    let residuals = residuals(operator, vectors.as_ref(), &eigenvalues[..count], job)?;
    job.progress(0.9)?;
    let area = operator.total_mass();
    let root_mass = operator.root_mass().iter();
    let unscale: Vec<f64> = root_mass.map(|root| 1.0 / (root * area.sqrt())).collect();
    let mut columns: Vec<_> = vectors.col_iter_mut().map(dense::contiguous).collect();
    job.for_chunks(&mut columns, LANES, |_, columns| {
        for column in columns {
            column.iter_mut().zip(&unscale).for_each(|(y, s)| *y *= s);
        }
    })?;
    job.progress(1.0)?;
    Ok(Spectrum {
        eigenvalues: eigenvalues[..count].iter().map(|l| l / area).collect(),
        eigenfunctions: vectors,
        mass: laplacian.mass().to_vec(),
        full_mass: laplacian.full_mass().cloned(),
        residuals,
        inertia: counts.into_iter().map(|count| count.scaled(area)).collect(),
    })
}

/// Columns whose residuals are computed together, so that the entries of A are read once for all of them.
const LANES: usize = 8;

/// ‖A y − λ M y‖ / max(λ, 1) of each column.
fn residuals(
    operator: &Operator,
    vectors: MatRef<'_, f64>,
    eigenvalues: &[f64],
    job: &Job,
) -> Result<Vec<f64>, SpectrumError> {
    let residual = |chunk: usize| {
        let first = chunk * LANES;
        let lambdas = &eigenvalues[first..(first + LANES).min(eigenvalues.len())];
        let mut rows = vec![[0.0; LANES]; operator.size()];
        for lane in 0..lambdas.len() {
            let column = dense::column(vectors, first + lane);
            rows.iter_mut().zip(column).for_each(|(row, &y)| row[lane] = y);
        }
        let mut squares = [0.0; LANES];
        let lambda: [f64; LANES] = std::array::from_fn(|lane| lambdas.get(lane).copied().unwrap_or(0.0));
        let weighted = operator.mass_times::<LANES>(rows.as_flattened());
        for (j, own) in weighted.as_chunks::<LANES>().0.iter().enumerate() {
            let mut difference: [f64; LANES] = std::array::from_fn(|lane| -lambda[lane] * own[lane]);
            for (i, a) in operator.column(j) {
                let row = &rows[i];
                (0..LANES).for_each(|lane| difference[lane] += a * row[lane]);
            }
            (0..LANES).for_each(|lane| squares[lane] += difference[lane] * difference[lane]);
        }
        (0..lambdas.len())
            .map(|lane| squares[lane].sqrt() / lambda[lane].max(1.0))
            .collect::<Vec<_>>()
    };
    Ok(job.map(eigenvalues.len().div_ceil(LANES), 1, residual)?.concat())
}
