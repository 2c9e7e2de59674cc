use job::Job;
use mesh::{Components, Edges, TriMesh, components};
use partition::{Graph, Options, PartitionError, PartitionStage, partition};

use super::{
    MarkError,
    pool::{IMBALANCE, share},
};

/// A connected piece of a mesh that carries chips, with the mesh vertices that it covers.
#[derive(Clone, Debug)]
pub struct Patch {
    vertices: Vec<u32>,
    mesh: TriMesh,
    /// Vertices of the patch with neighbours that are not of it.
    at_border: Vec<bool>,
}

impl Patch {
    /// The mesh vertex of each patch vertex, ascending.
    pub fn vertices(&self) -> &[u32] {
        &self.vertices
    }

    /// The patch as a mesh of its own; a triangle belongs to a patch if its three vertices do.
    pub fn mesh(&self) -> &TriMesh {
        &self.mesh
    }

    /// Whether each vertex of the patch has a neighbour in the mesh that is not of the patch: there it borders on another patch, or on what is
    /// unmarked. The mesh's own boundary is no such border.
    pub fn at_border(&self) -> &[bool] {
        &self.at_border
    }

    /// φ, the edges of the patch's bounding box.
    pub fn size(&self) -> [f64; 3] {
        self.mesh.bounding_box().size()
    }

    /// The values of the patch's vertices in a field over the whole mesh.
    pub fn gather<T: Copy>(&self, field: &[T]) -> Vec<T> {
        self.vertices.iter().map(|&v| field[v as usize]).collect()
    }
}

/// Into how many patches a mesh is cut.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum PatchCount {
    /// As few as keep every patch below 30 000 vertices, as the paper has it.
    #[default]
    Paper,
    /// So many in all, shared out among the components by their size; a component is at least one.
    Exactly(usize),
}

/// Patches of `Paper` stay below this.
const PAPER_LIMIT: usize = 30_000;

/// The largest patch: the basis of a larger one costs more memory and time than a user expects.
pub const LARGEST_PATCH: usize = 60_000;

/// The most functions in a patch. What is solved for a patch has three unknowns to each, so that a certificate of a kilobyte could ask for any memory:
/// with so many it is some 1.3 GB.
pub const MOST_FUNCTIONS: usize = 2048;

/// A basis of m functions says something about a surface only if that has clearly more vertices.
pub const VERTICES_PER_FUNCTION: usize = 2;

/// Which patch each vertex of a mesh belongs to, and the patches.
///
/// Patches are cut from connected components. In [`cut`](Self::cut) a component with fewer than twice as many vertices as the basis has
/// functions stays unmarked, and so do vertices at the borders of patches that no triangle of their patch uses, or that
/// only a piece of it apart from the rest does.
#[derive(Clone, Debug)]
pub struct Patches {
    labels: Vec<u32>,
    patches: Vec<Patch>,
}

impl Patches {
    /// Cuts a mesh.
    ///
    /// # Errors
    /// When no component has room for `functions` manifold harmonics, or a patch would be too small or too large.
    pub fn cut(mesh: &TriMesh, functions: usize, count: PatchCount, job: &Job) -> Result<Self, MarkError> {
        let components = components(mesh);
        let least = functions.saturating_mul(VERTICES_PER_FUNCTION);
        let largest = components.sizes.iter().copied().max().unwrap_or(0);
        if largest < least {
            return Err(MarkError::TooFewVertices {
                largest,
                least,
                functions,
            });
        }
        let eligible: usize = components.sizes.iter().filter(|&&size| size >= least).sum();
        let parts: Vec<usize> = components
            .sizes
            .iter()
            .map(|&size| parts(size, functions, eligible, count))
            .collect();
        let labels = label(mesh, &components, &parts, usize::MAX, job)?;
        let cut = Self::from_labels(mesh, &labels)?;
        for patch in &cut.patches {
            let vertices = patch.vertices.len();
            if vertices < least {
                return Err(MarkError::PatchTooSmall {
                    vertices,
                    least,
                    functions,
                });
            }
            if vertices > LARGEST_PATCH {
                let enough = mesh.vertex_count().div_ceil(PAPER_LIMIT) + 1;
                return Err(MarkError::PatchTooLarge {
                    vertices,
                    most: LARGEST_PATCH,
                    enough,
                });
            }
        }
        Ok(cut)
    }

    /// The patches that `labels` describe: 0 for an unmarked vertex, patch numbers from 1. Vertices that a patch can't hold
    /// (see above) become unmarked, so that the labels of the result describe it exactly.
    ///
    /// # Errors
    /// When there is not one label a vertex, or a patch has no triangle.
    pub fn from_labels(mesh: &TriMesh, labels: &[u32]) -> Result<Self, MarkError> {
        if labels.len() != mesh.vertex_count() {
            return Err(MarkError::Labels {
                given: labels.len(),
                vertices: mesh.vertex_count(),
            });
        }
        let count = labels.iter().copied().max().unwrap_or(0) as usize;
        if count > mesh.triangle_count() {
            // More patches than triangles: some have none. Labels may come from a file, so nothing is allocated for them.
            return Err(MarkError::EmptyPatch { patch: count - 1 });
        }
        let (labels, mut patches) = (largest_pieces(mesh, labels, count)?, Vec::with_capacity(count));
        let (mut vertices, mut triangles) = (vec![Vec::new(); count], vec![Vec::new(); count]);
        let mut place = vec![0u32; labels.len()];
        for (v, &label) in labels.iter().enumerate().filter(|(_, label)| **label > 0) {
            let vertices: &mut Vec<u32> = &mut vertices[label as usize - 1];
            place[v] = vertices.len() as u32;
            vertices.push(v as u32);
        }
        for triangle in mesh.triangles() {
            if let Some(patch) = patch_of(triangle, &labels) {
                triangles[patch].push(triangle.map(|v| place[v as usize]));
            }
        }
        for (vertices, triangles) in vertices.into_iter().zip(triangles) {
            let positions = vertices.iter().map(|&v| mesh.positions()[v as usize]).collect();
            patches.push(Patch {
                mesh: TriMesh::new(positions, triangles)?,
                at_border: vec![false; vertices.len()],
                vertices,
            });
        }
        let mut at_border = vec![false; labels.len()];
        for triangle in mesh.triangles() {
            let [a, b, c] = triangle.map(|v| labels[v as usize]);
            if a != b || b != c {
                triangle.iter().for_each(|&v| at_border[v as usize] = true);
            }
        }
        for patch in &mut patches {
            patch.at_border = patch.gather(&at_border);
        }
        Ok(Self { labels, patches })
    }

    /// 0 for an unmarked vertex, otherwise the number of its patch from 1: #V.
    pub fn labels(&self) -> &[u32] {
        &self.labels
    }

    /// How many vertices carry no mark.
    pub fn unmarked_vertices(&self) -> usize {
        self.labels.iter().filter(|&&label| label == 0).count()
    }
}

impl std::ops::Deref for Patches {
    type Target = [Patch];

    fn deref(&self) -> &[Patch] {
        &self.patches
    }
}

/// How many patches a component of `size` vertices becomes; none if it is too small.
fn parts(size: usize, functions: usize, eligible: usize, count: PatchCount) -> usize {
    match count {
        _ if size < functions.saturating_mul(VERTICES_PER_FUNCTION) => 0,
        PatchCount::Paper if size < PAPER_LIMIT => 1,
        PatchCount::Paper => ((1.0 + IMBALANCE) * size as f64 / (PAPER_LIMIT - 1) as f64).ceil() as usize,
        PatchCount::Exactly(count) => {
            (count as f64 * size as f64 / eligible as f64).round().max(1.0) as usize
        }
    }
}

/// Labels of all vertices before borders are cleaned, for so many patches of each component, which is cut into regions first if it is to have more than `at_once`: what cutting
/// a large graph costs grows with vertices times parts.
pub(super) fn label(
    mesh: &TriMesh,
    components: &Components,
    parts: &[usize],
    at_once: usize,
    job: &Job,
) -> Result<Vec<u32>, MarkError> {
    let mut place = vec![0u32; mesh.vertex_count()];
    let mut sizes = vec![0u32; components.count];
    for (v, &component) in components.of_vertex.iter().enumerate() {
        place[v] = sizes[component as usize];
        sizes[component as usize] += 1;
    }
    let mut edges: Vec<Vec<WeightedEdge>> = vec![Vec::new(); components.count];
    for &[a, b] in Edges::of(mesh).vertices() {
        let component = components.of_vertex[a as usize] as usize;
        if parts[component] > 1 {
            edges[component].push((place[a as usize], place[b as usize], 1));
        }
    }
    let mut first = 1;
    let mut labels_of: Vec<Vec<u32>> = Vec::with_capacity(components.count);
    for (component, edges) in edges.iter().enumerate() {
        let size = sizes[component] as usize;
        let job = job.within(PartitionStage::Refinement);
        let part_of = match parts[component] {
            0 => {
                labels_of.push(vec![0; size]);
                continue;
            }
            1 => vec![0; size],
            parts if parts <= at_once => cut_at_once(size, edges, parts, &job)?,
            parts => cut_by_regions(size, edges, parts, parts.div_ceil(at_once), &job)?,
        };
        let next = first + part_of.iter().max().map_or(0, |part| part + 1);
        labels_of.push(part_of.into_iter().map(|part| first + part).collect());
        first = next;
    }
    let label = |v: usize| labels_of[components.of_vertex[v] as usize][place[v] as usize];
    Ok((0..mesh.vertex_count()).map(label).collect())
}

/// Two vertices, and a weight.
type WeightedEdge = (u32, u32, i32);

/// The part of each vertex.
fn cut_at_once(
    size: usize,
    edges: &[WeightedEdge],
    parts: usize,
    job: &Job,
) -> Result<Vec<u32>, PartitionError> {
    let options = Options {
        parts,
        imbalance: IMBALANCE,
        contiguous: true,
        ..Options::default()
    };
    let graph = Graph::from_edges(size, edges)?;
    Ok(partition(&graph, &options, job)?.part_of)
}

/// The same, of which each lies in one of so many regions. These have as many parts as their size asks for, and one at least.
fn cut_by_regions(
    size: usize,
    edges: &[WeightedEdge],
    parts: usize,
    regions: usize,
    job: &Job,
) -> Result<Vec<u32>, PartitionError> {
    let region_of = cut_at_once(size, edges, regions, job)?;
    let mut place = vec![0; size];
    let mut sizes = vec![0; regions];
    for (place, &region) in place.iter_mut().zip(&region_of) {
        *place = sizes[region as usize];
        sizes[region as usize] += 1;
    }
    let mut inside: Vec<Vec<WeightedEdge>> = vec![Vec::new(); regions];
    for &(a, b, weight) in edges {
        let region = region_of[a as usize];
        if region == region_of[b as usize] {
            inside[region as usize].push((place[a as usize], place[b as usize], weight));
        }
    }
    let vertices: Vec<f64> = sizes.iter().map(|&size| f64::from(size)).collect();
    let most: Vec<usize> = sizes.iter().map(|&size| size as usize).collect();
    let mut parts_of = share(parts, &vertices, &most);
    parts_of.iter_mut().for_each(|parts| *parts = (*parts).max(1));
    let quiet = job.quiet();
    let cut = job.map(regions, 1, |region| {
        cut_at_once(most[region], &inside[region], parts_of[region], &quiet)
    })?;
    let cut: Vec<Vec<u32>> = cut.into_iter().collect::<Result<_, _>>()?;
    let before = parts_of.iter().scan(0, |sum, &parts| {
        *sum += parts as u32;
        Some(*sum - parts as u32)
    });
    let before: Vec<u32> = before.collect();
    let part =
        |(&region, &place): (&u32, &u32)| before[region as usize] + cut[region as usize][place as usize];
    Ok(region_of.iter().zip(&place).map(part).collect())
}

/// The patch whose label all corners of a triangle have.
fn patch_of(triangle: &[u32; 3], labels: &[u32]) -> Option<usize> {
    let [a, b, c] = triangle.map(|v| labels[v as usize]);
    (a == b && b == c).then(|| (a as usize).checked_sub(1)).flatten()
}

/// The labels that are left when each of `count` patches keeps the vertices of its largest connected piece, the first of equals, and no others.
///
/// # Errors
/// When a patch has no triangle.
fn largest_pieces(mesh: &TriMesh, labels: &[u32], count: usize) -> Result<Vec<u32>, MarkError> {
    let inside = mesh
        .triangles()
        .iter()
        .filter(|triangle| patch_of(triangle, labels).is_some());
    let pairs = inside.flat_map(|&[a, b, c]| [[a, b], [b, c]]);
    let pieces = Components::of_pairs(labels.len(), pairs);
    let size = |piece: u32| pieces.sizes[piece as usize];
    let mut largest: Vec<Option<u32>> = vec![None; count];
    for (&label, &piece) in labels
        .iter()
        .zip(&pieces.of_vertex)
        .filter(|(label, _)| **label > 0)
    {
        let largest = &mut largest[label as usize - 1];
        // A vertex alone is in no triangle.
        if size(piece) > largest.map_or(1, size) {
            *largest = Some(piece);
        }
    }
    if let Some(patch) = largest.iter().position(Option::is_none) {
        return Err(MarkError::EmptyPatch { patch });
    }
    let is_kept = |label: u32, piece| label > 0 && largest[label as usize - 1] == Some(piece);
    let kept = labels.iter().zip(&pieces.of_vertex);
    Ok(kept
        .map(|(&label, &piece)| if is_kept(label, piece) { label } else { 0 })
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use mesh::shapes;

    #[test]
    fn every_large_component_becomes_a_patch_and_small_ones_stay_unmarked() {
        let mesh = shapes::disjoint_union(&[
            shapes::icosphere(3),
            shapes::tetrahedron(),
            shapes::translated(&shapes::icosphere(3), [5.0, 0.0, 0.0]),
        ]);
        let patches = Patches::cut(&mesh, 100, PatchCount::Paper, &Job::default()).unwrap();
        assert_eq!((patches.len(), patches.unmarked_vertices()), (2, 4));
        for patch in patches.iter() {
            assert_eq!(
                (patch.mesh().vertex_count(), patch.mesh().triangle_count()),
                (642, 1280)
            );
            assert_eq!(patch.gather(mesh.positions()), patch.mesh().positions());
        }
    }

    #[test]
    fn parts_of_regions_are_connected_and_nearly_equal() {
        let mesh = shapes::disjoint_union(&[shapes::bumpy_sphere(4, 3), shapes::torus(60, 40, 3.0, 1.0)]);
        let components = mesh::components(&mesh);
        let parts = [20, 13];
        let labels = |at_once| label(&mesh, &components, &parts, at_once, &Job::default()).unwrap();
        let cut = labels(6);
        assert_ne!(cut, labels(20));
        let patches = Patches::from_labels(&mesh, &cut).unwrap();
        assert_eq!(patches.len(), 33);
        for (index, patch) in patches.iter().enumerate() {
            let (component, of_component) = if index < 20 { (0, 20) } else { (1, 13) };
            let given = cut.iter().filter(|&&label| label == index as u32 + 1).count() as f64;
            let mean = components.sizes[component] as f64 / f64::from(of_component);
            // A region may be larger by 3 %, get a part less than it deserves, and its parts be larger again.
            assert!(given < 1.03 * 1.03 * 1.25 * mean, "{given} of {mean}");
            // What borders leave to no patch, or to a piece of one, is little.
            assert!(patch.vertices().len() as f64 > 0.8 * given);
        }
    }

    #[test]
    fn a_mesh_without_a_large_enough_component_is_refused() {
        let error = Patches::cut(&shapes::icosphere(2), 325, PatchCount::Paper, &Job::default()).unwrap_err();
        assert!(matches!(
            error,
            MarkError::TooFewVertices {
                largest: 162,
                least: 650,
                functions: 325
            }
        ));
        let error = Patches::cut(
            &shapes::icosphere(3),
            100,
            PatchCount::Exactly(6),
            &Job::default(),
        )
        .unwrap_err();
        assert!(matches!(error, MarkError::PatchTooSmall { least: 200, .. }));
    }

    #[test]
    fn labels_that_describe_no_patches_are_refused() {
        let mesh = shapes::icosphere(2);
        let of = |labels: &[u32]| Patches::from_labels(&mesh, labels).map(|patches| patches.len());
        assert!(matches!(
            of(&[1; 161]),
            Err(MarkError::Labels {
                given: 161,
                vertices: 162
            })
        ));
        assert!(matches!(of(&[u32::MAX; 162]), Err(MarkError::EmptyPatch { .. })));
        assert!(matches!(of(&[2; 162]), Err(MarkError::EmptyPatch { patch: 0 })));
        assert_eq!(of(&[1; 162]).unwrap(), 1);
    }

    #[test]
    fn the_papers_count_keeps_every_patch_below_thirty_thousand_vertices() {
        let mesh = shapes::rectangle(300, 300, 1.0, 1.0);
        let patches = Patches::cut(&mesh, 10, PatchCount::Paper, &Job::default()).unwrap();
        assert_eq!(patches.len(), 4);
        assert!(
            patches
                .iter()
                .all(|patch| (15_000..30_000).contains(&patch.vertices().len()))
        );
    }

    /// What borders on another patch is held; what borders on nothing is not.
    #[test]
    fn borders_lie_between_patches_and_not_at_the_edge_of_the_mesh() {
        let mesh = shapes::rectangle(20, 10, 2.0, 1.0);
        let left: Vec<u32> = mesh
            .positions()
            .iter()
            .map(|p| if p[0] < 1.0 { 1 } else { 2 })
            .collect();
        let patches = Patches::from_labels(&mesh, &left).unwrap();
        for patch in patches.iter() {
            let pairs = patch.mesh().positions().iter().zip(patch.at_border());
            for (p, &at_border) in pairs {
                assert_eq!(at_border, (p[0] - 0.95).abs() < 0.06, "{p:?}");
            }
        }
        let whole = Patches::from_labels(&mesh, &vec![1; mesh.vertex_count()]).unwrap();
        assert!(whole[0].at_border().iter().all(|at_border| !at_border));
    }

    #[test]
    fn patches_are_connected_disjoint_and_described_by_their_labels() {
        let mesh = shapes::bumpy_torus(90, 40, 3);
        let patches = Patches::cut(&mesh, 20, PatchCount::Exactly(7), &Job::new(2)).unwrap();
        assert_eq!(patches.len(), 7);
        let mut seen = vec![0; mesh.vertex_count()];
        for (index, patch) in patches.iter().enumerate() {
            assert_eq!(components(patch.mesh()).count, 1);
            let used: std::collections::HashSet<u32> =
                patch.mesh().triangles().iter().flatten().copied().collect();
            assert_eq!(used.len(), patch.vertices().len());
            for &v in patch.vertices() {
                seen[v as usize] = index as u32 + 1;
            }
        }
        assert_eq!(seen, patches.labels());
        let again = Patches::from_labels(&mesh, patches.labels()).unwrap();
        assert_eq!(again.labels(), patches.labels());
        assert_eq!(
            Patches::cut(&mesh, 20, PatchCount::Exactly(7), &Job::default())
                .unwrap()
                .labels(),
            patches.labels()
        );
        assert!(patches.unmarked_vertices() < mesh.vertex_count() / 100);
    }
}
