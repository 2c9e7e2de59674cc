use mesh::TriMesh;
use sprs::CsMat;

use crate::SpectrumError;
use crate::intrinsic::{MOLLIFICATION, tufted_delaunay};
use crate::triangle::{Triangle, edge_lengths};

/// A discrete Laplace–Beltrami operator: stiffness S and mass (both #V by #V).
///
/// S is positive semidefinite, the negative of the paper's Q; its rows sum to zero, but where neighbours are held fixed. The lumped mass D is diagonal and positive; the full mass
/// B, where there is one, has the same row sums.
#[derive(Clone, Debug)]
pub struct Laplacian {
    stiffness: CsMat<f64>,
    mass: Vec<f64>,
    full_mass: Option<CsMat<f64>>,
    /// Vertices beside one that is held fixed; none where all are free.
    grounded: Option<Vec<bool>>,
}

/// Which Laplacian a mesh is given.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum LaplacianKind {
    /// Cotangent weights of the mesh's own triangles, as in the paper. See [`Laplacian::cotangent`].
    #[default]
    Cotangent,
    /// Cotangent weights of the intrinsic Delaunay triangulation of the tufted cover (Sharp and Crane 2020).
    ///
    /// The same surface, better triangles: no weight between neighbours is negative, whatever the mesh's triangles
    /// look like, and non-manifold edges have a meaning. On a Delaunay mesh without degenerate triangles it equals
    /// the cotangent one; elsewhere eigenvalues differ by the error of discretisation. Degenerate meshes have
    /// all edges lengthened by some 1e-5 of the mean edge.
    Intrinsic,
}

/// The mass matrix of linear finite elements.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Mass {
    /// D of eq. 4, diagonal: the row sums of B. The choice for manifold harmonics (eq. 5).
    #[default]
    Lumped,
    /// B of eq. 3, which couples neighbours: the paper's choice for Shape-DNA (eq. 22).
    Full,
}

impl Laplacian {
    /// The Laplacian of the given kind.
    ///
    /// # Errors
    /// [`SpectrumError::Area`] if the surface has none, [`SpectrumError::Mass`] if a vertex has no triangle.
    pub fn of(mesh: &TriMesh, kind: LaplacianKind, mass: Mass) -> Result<Self, SpectrumError> {
        let triangles = measure(mesh)?;
        let n = mesh.vertex_count();
        match kind {
            LaplacianKind::Cotangent => Self::assemble(n, mesh.triangles(), &triangles, mass),
            LaplacianKind::Intrinsic => {
                let (corners, triangles) = tufted_delaunay(mesh);
                Self::assemble(n, &corners, &triangles, mass)
            }
        }
    }

    /// Linear finite elements: cotangent stiffness S = −Q (eq. 3) and lumped mass D (eq. 4).
    ///
    /// A triangle whose height is below 1e-10 of its longest edge has no cotangents; its edges alone are lengthened by
    /// some 1e-5 of the mesh's mean edge (Sharp and Crane 2020). All other triangles enter exactly as the equations say.
    ///
    /// # Errors
    /// As [`of`](Self::of).
    pub fn cotangent(mesh: &TriMesh) -> Result<Self, SpectrumError> {
        Self::of(mesh, LaplacianKind::Cotangent, Mass::Lumped)
    }

    fn assemble(
        n: usize,
        corners: &[[u32; 3]],
        triangles: &[Triangle],
        mass: Mass,
    ) -> Result<Self, SpectrumError> {
        Ok(Self {
            stiffness: assemble_stiffness(n, corners, triangles),
            mass: checked(assemble_lumped_mass(n, corners, triangles))?,
            full_mass: (mass == Mass::Full).then(|| assemble_full_mass(n, corners, triangles)),
            grounded: None,
        })
    }

    /// Any symmetric `stiffness` with rows that sum to zero, positive semidefinite, and any positive lumped `mass`.
    /// A graph's Laplacian (degree − adjacency, masses 1) is one.
    ///
    /// # Errors
    /// Says which entry, row or mass breaks these conditions. Definiteness is not checked here; the solver finds out.
    pub fn new(stiffness: CsMat<f64>, mass: Vec<f64>) -> Result<Self, SpectrumError> {
        let (rows, columns) = stiffness.shape();
        if rows != columns || rows != mass.len() || rows == 0 {
            return Err(SpectrumError::Shape {
                rows,
                columns,
                masses: mass.len(),
            });
        }
        let stiffness = stiffness.into_csr();
        for (row, entries) in stiffness.outer_iterator().enumerate() {
            let (mut sum, mut size) = (0.0, 0.0);
            for (column, &value) in entries.iter() {
                let mirrored = stiffness.get(column, row).copied().unwrap_or(0.0);
                if !value.is_finite() || (value - mirrored).abs() > 1e-12 * value.abs() {
                    return Err(SpectrumError::Entry { row, column });
                }
                sum += value;
                size += value.abs();
            }
            if sum.abs() > 1e-9 * size {
                return Err(SpectrumError::RowSum { row, sum });
            }
        }
        Ok(Self {
            stiffness,
            mass: checked(mass)?,
            full_mass: None,
            grounded: None,
        })
    }

    /// The Laplacian of functions that are zero at all vertices but the `free` ones (ascending): their rows and columns.
    ///
    /// # Errors
    /// [`SpectrumError::Count`] if none is free.
    pub(crate) fn restricted(&self, free: &[u32]) -> Result<Self, SpectrumError> {
        if free.is_empty() {
            return Err(SpectrumError::Count {
                count: 1,
                vertices: 0,
            });
        }
        let mut place = vec![None; self.mass.len()];
        for (i, &v) in free.iter().enumerate() {
            place[v as usize] = Some(i);
        }
        let among_free = |matrix: &CsMat<f64>| {
            let mut kept = Rows::of(free.len(), matrix.nnz());
            for &v in free {
                let row = matrix.outer_view(v as usize);
                for (w, &value) in row.iter().flat_map(|row| row.iter()) {
                    if let Some(j) = place[w] {
                        kept.add(j, value);
                    }
                }
                kept.end_row();
            }
            kept.matrix()
        };
        let beside_fixed = |&v: &u32| {
            let row = self.stiffness.outer_view(v as usize);
            row.is_some_and(|row| row.iter().any(|(w, _)| place[w].is_none()))
        };
        Ok(Self {
            stiffness: among_free(&self.stiffness),
            mass: free.iter().map(|&v| self.mass[v as usize]).collect(),
            full_mass: self.full_mass.as_ref().map(among_free),
            grounded: Some(free.iter().map(beside_fixed).collect()),
        })
    }

    /// Whether a vertex lies beside one that is held fixed.
    pub(crate) fn is_grounded(&self, vertex: usize) -> bool {
        self.grounded.as_ref().is_some_and(|grounded| grounded[vertex])
    }

    /// S, #V by #V, in compressed rows.
    pub fn stiffness(&self) -> &CsMat<f64> {
        &self.stiffness
    }

    /// The diagonal of D, #V, in squared units of the mesh.
    pub fn mass(&self) -> &[f64] {
        &self.mass
    }

    /// B, #V by #V, in squared units of the mesh; `None` where the mass is lumped.
    pub fn full_mass(&self) -> Option<&CsMat<f64>> {
        self.full_mass.as_ref()
    }
}

/// The diagonal of D of eq. 4, #V: a third of the area of the triangles around each vertex.
///
/// # Errors
/// [`SpectrumError::Area`] if the surface has none.
pub fn lumped_mass(mesh: &TriMesh) -> Result<Vec<f64>, SpectrumError> {
    let triangles = measure(mesh)?;
    Ok(assemble_lumped_mass(
        mesh.vertex_count(),
        mesh.triangles(),
        &triangles,
    ))
}

/// Masses that a spectrum can be computed with: positive, and of a sum that double precision holds.
fn checked(mass: Vec<f64>) -> Result<Vec<f64>, SpectrumError> {
    if let Some(vertex) = mass.iter().position(|m| !m.is_normal() || *m < 0.0) {
        let mass = mass[vertex];
        return Err(SpectrumError::Mass { vertex, mass });
    }
    let area: f64 = mass.iter().sum();
    match area.is_normal() {
        true => Ok(mass),
        false => Err(SpectrumError::Area { area }),
    }
}

/// Area and cotangents of every triangle, degenerate ones mollified.
fn measure(mesh: &TriMesh) -> Result<Vec<Triangle>, SpectrumError> {
    let shapes: Vec<_> = (0..mesh.triangle_count())
        .map(|t| Triangle::from_corners(mesh.corners(t)))
        .collect();
    let mollified = shapes.iter().filter(|s| s.is_none()).count();
    if mollified == shapes.len() {
        return Err(SpectrumError::Area { area: 0.0 });
    }
    let delta = match mollified {
        0 => 0.0,
        _ => MOLLIFICATION * mean_edge(mesh),
    };
    let mollify = |t: usize| Triangle::mollified(mesh.corners(t), delta);
    let triangles = shapes.into_iter().enumerate();
    let triangles: Vec<_> = triangles
        .map(|(t, shape)| shape.unwrap_or_else(|| mollify(t)))
        .collect();
    let area: f64 = triangles.iter().map(|t| t.area).sum();
    match area.is_normal() {
        true => Ok(triangles),
        false => Err(SpectrumError::Area { area }),
    }
}

fn mean_edge(mesh: &TriMesh) -> f64 {
    let total: f64 = (0..mesh.triangle_count())
        .flat_map(|t| edge_lengths(mesh.corners(t)))
        .sum();
    total / (3 * mesh.triangle_count()) as f64
}

/// S = −Q of eq. 3, #V by #V: S_ij = −(cot β + cot β′)/2 for an edge, S_ii = −Σ_j S_ij. Positive semidefinite.
fn assemble_stiffness(n: usize, corners: &[[u32; 3]], triangles: &[Triangle]) -> CsMat<f64> {
    let of_edge = |t: usize, k: usize| triangles[t].cotangents[k] / 2.0;
    assembled(n, corners, |t, k| (-of_edge(t, k), of_edge(t, k)))
}

/// The diagonal of D of eq. 4, #V: a third of the area of the triangles around each vertex.
fn assemble_lumped_mass(n: usize, corners: &[[u32; 3]], triangles: &[Triangle]) -> Vec<f64> {
    let mut mass = vec![0.0; n];
    for (corner, triangle) in corners.iter().zip(triangles) {
        for &i in corner {
            mass[i as usize] += triangle.area / 3.0;
        }
    }
    mass
}

/// B of eq. 3, #V by #V: B_ij = (|t| + |t′|)/12 for an edge, B_ii = Σ|t|/6. Its rows sum to the lumped mass.
fn assemble_full_mass(n: usize, corners: &[[u32; 3]], triangles: &[Triangle]) -> CsMat<f64> {
    let of_edge = |t: usize| triangles[t].area / 12.0;
    assembled(n, corners, |t, _| (of_edge(t), of_edge(t)))
}

/// The symmetric matrix, n by n, of what the edge opposite corner k of triangle t adds, (t, k): beside the diagonal, and to the diagonal at each of its ends.
fn assembled(n: usize, corners: &[[u32; 3]], of_edge: impl Fn(usize, usize) -> (f64, f64)) -> CsMat<f64> {
    let edges = || {
        let triangles = corners.iter().enumerate();
        triangles.flat_map(|(t, &[a, b, c])| [(t, 0, [b, c]), (t, 1, [c, a]), (t, 2, [a, b])])
    };
    let mut starts = vec![0; n + 1];
    for v in edges().flat_map(|(.., ends)| ends) {
        starts[v as usize + 1] += 1;
    }
    for row in 0..n {
        starts[row + 1] += starts[row];
    }
    let row = |row: usize| starts[row]..starts[row + 1];
    let (mut diagonal, mut next) = (vec![0.0; n], starts.clone());
    let mut in_any_order = vec![(0, 0.0); starts[n]];
    for (t, k, [i, j]) in edges() {
        let (beside, on) = of_edge(t, k);
        for (row, column) in [(i as usize, j), (j as usize, i)] {
            diagonal[row] += on;
            in_any_order[next[row]] = (column, beside);
            next[row] += 1;
        }
    }
    // Row by row into the columns: the matrix is its own transpose, and so columns come to ascend.
    let (mut ascending, mut next) = (vec![(0, 0.0); starts[n]], starts.clone());
    for i in 0..n {
        for &(column, value) in &in_any_order[row(i)] {
            let next = &mut next[column as usize];
            ascending[*next] = (i, value);
            *next += 1;
        }
    }
    let mut rows = Rows::of(n, n + starts[n] / 2);
    for i in 0..n {
        let beside = &ascending[row(i)];
        let (before, after) = beside.split_at(beside.partition_point(|&(column, _)| column < i));
        let diagonal = [(i, diagonal[i])];
        let all = before.iter().chain(&diagonal).chain(after);
        all.for_each(|&(column, value)| rows.add(column, value));
        rows.end_row();
    }
    rows.matrix()
}

/// A square matrix that is written row by row, in compressed rows.
struct Rows {
    offsets: Vec<usize>,
    columns: Vec<usize>,
    values: Vec<f64>,
}

impl Rows {
    /// With room for so many rows and entries.
    fn of(rows: usize, entries: usize) -> Self {
        let mut offsets = Vec::with_capacity(rows + 1);
        offsets.push(0);
        Self {
            offsets,
            columns: Vec::with_capacity(entries),
            values: Vec::with_capacity(entries),
        }
    }

    /// Adds to an entry of the row that is written; columns may not descend.
    fn add(&mut self, column: usize, value: f64) {
        let is_begun = self.offsets.last() < Some(&self.columns.len());
        match self.values.last_mut() {
            Some(last) if is_begun && self.columns.last() == Some(&column) => *last += value,
            _ => {
                self.columns.push(column);
                self.values.push(value);
            }
        }
    }

    fn end_row(&mut self) {
        self.offsets.push(self.columns.len());
    }

    fn matrix(self) -> CsMat<f64> {
        let count = self.offsets.len() - 1;
        CsMat::new((count, count), self.offsets, self.columns, self.values)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mesh::shapes;
    use sprs::TriMat;

    #[test]
    fn matrices_are_the_sums_of_what_triangles_add() {
        let mesh = shapes::disjoint_union(&[shapes::bumpy_sphere(2, 3), shapes::rectangle(3, 2, 1.0, 2.0)]);
        let n = mesh.vertex_count();
        let triangles = measure(&mesh).unwrap();
        let (mut stiffness, mut mass) = (TriMat::new((n, n)), TriMat::new((n, n)));
        for (corners, triangle) in mesh.triangles().iter().zip(&triangles) {
            for (a, b) in (0..3).flat_map(|a| (0..3).map(move |b| (a, b))) {
                let [i, j] = [a, b].map(|k| corners[k] as usize);
                let beside = |k: usize| triangle.cotangents[k] / 2.0;
                let [added, share] = match a == b {
                    true => [beside((a + 1) % 3) + beside((a + 2) % 3), 6.0],
                    false => [-beside(3 - a - b), 12.0],
                };
                stiffness.add_triplet(i, j, added);
                mass.add_triplet(i, j, triangle.area / share);
            }
        }
        let laplacian = Laplacian::of(&mesh, LaplacianKind::Cotangent, Mass::Full).unwrap();
        let pairs = [
            (laplacian.stiffness(), stiffness),
            (laplacian.full_mass().unwrap(), mass),
        ];
        for (matrix, expected) in pairs {
            let expected = expected.to_csr::<usize>();
            assert_eq!(
                (matrix.indptr().raw_storage(), matrix.indices()),
                (expected.indptr().raw_storage(), expected.indices())
            );
            for (value, expected) in matrix.data().iter().zip(expected.data()) {
                assert!(
                    (value - expected).abs() < 1e-14 * (1.0 + expected.abs()),
                    "{value}, {expected}"
                );
            }
        }
    }

    /// In an intrinsic triangulation an edge may begin and end at one vertex.
    #[test]
    fn an_edge_from_a_vertex_to_itself_changes_no_sum_of_a_row() {
        let corners = [[0, 0, 1], [0, 1, 2], [0, 2, 0], [1, 1, 1]];
        let edges = [[1.0, 1.0, 0.5], [0.9, 0.8, 1.0], [0.5, 0.9, 0.9], [0.3, 0.4, 0.5]];
        let triangles = edges.map(Triangle::from_lengths);
        let sums = |matrix: CsMat<f64>| -> Vec<f64> {
            let rows = matrix.outer_iterator();
            rows.map(|row| row.iter().map(|(_, value)| value).sum()).collect()
        };
        let lumped = assemble_lumped_mass(3, &corners, &triangles);
        let full = sums(assemble_full_mass(3, &corners, &triangles));
        let stiffness = sums(assemble_stiffness(3, &corners, &triangles));
        for i in 0..3 {
            assert!((full[i] - lumped[i]).abs() < 1e-14, "{full:?}, {lumped:?}");
            assert!(stiffness[i].abs() < 1e-14, "{stiffness:?}");
        }
    }
}
