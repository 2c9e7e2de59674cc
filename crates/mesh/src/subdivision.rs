//! Undoing a subdivision. One that splits each triangle in four leaves *tiles*: a centre whose corners are new vertices, and three triangles around it that have an old vertex each.
//! Which triangle is what follows for a whole component from one of them (Taubin 2002, "Detecting and reconstructing subdivision connectivity"). Old places are those of which the rule makes places nearest to the new ones.

use std::{collections::HashMap, f64::consts::TAU};

use crate::{Edges, TriMesh, Vec3, shapes, topology::edge_lengths};

/// Where a subdivision puts vertices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Subdivision {
    /// New ones at midpoints of edges, old ones where they were.
    Midpoint,
    /// By Loop's masks (1987): new ones at 3/8 of the edge's ends and 1/8 of the two corners across, old ones drawn to their neighbours. On borders by those of the cubic B-spline.
    Loop,
}

/// A mesh, and what had been done to it.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Undivided {
    /// As it was before: its vertices in the order in which they were found.
    pub mesh: TriMesh,
    /// The rule that fits better.
    pub rule: Subdivision,
    /// How far vertices are from where the rule puts them, root mean square, in its mean edges.
    pub residual: f64,
}

/// The mesh that was subdivided to make this one, if each of its components can be cut into tiles. Whether vertices lie where a rule would put them is for the caller to say, by the residual.
///
/// ```
/// use mesh::{Subdivision, shapes, undivided};
/// let torus = shapes::bumpy_torus(9, 7, 1);
/// let found = undivided(&Subdivision::Loop.of(&torus)).unwrap();
/// assert_eq!((found.mesh.triangle_count(), found.rule), (torus.triangle_count(), Subdivision::Loop));
/// assert!(found.residual < 1e-9);
/// assert!(undivided(&torus).is_none());
/// ```
pub fn undivided(mesh: &TriMesh) -> Option<Undivided> {
    if mesh.triangle_count() == 0 || !mesh.triangle_count().is_multiple_of(4) {
        return None;
    }
    let edges = Edges::of(mesh);
    let ways = (0..GUESSES.len()).map_while(|way| roles(mesh, &edges, way));
    ways.filter_map(|roles| Undivided::of(mesh, &edges, &roles))
        .min_by(|a, b| a.residual.total_cmp(&b.residual))
}

impl Undivided {
    /// What there was before if triangles have these roles; none if that is no mesh.
    fn of(mesh: &TriMesh, edges: &Edges, roles: &[Role]) -> Option<Self> {
        let tiles = Tiles::of(mesh, edges, roles)?;
        let old = tiles.old.iter().map(|&v| mesh.positions()[v]).collect();
        let coarse = TriMesh::new(old, tiles.triangles).ok()?;
        let edges = Edges::of(&coarse);
        let new = edges.vertices().iter().map(|pair| tiles.new.get(pair).copied());
        let new: Vec<usize> = new.collect::<Option<_>>()?;
        let wanted: Vec<Vec3> = tiles.old.iter().chain(&new).map(|&v| mesh.point(v)).collect();
        let fit = |rule| (Masks::of(&coarse, &edges, rule).nearest(&wanted), rule);
        let (midpoint, by_loop) = (fit(Subdivision::Midpoint), fit(Subdivision::Loop));
        let better = if midpoint.0.1 <= by_loop.0.1 {
            midpoint
        } else {
            by_loop
        };
        let ((places, residual), rule) = better;
        let mesh = coarse
            .with_positions(places.into_iter().map(|p| p.0).collect())
            .ok()?;
        let [_, mean_edge, _] = edge_lengths(&mesh, &edges);
        let residual = residual / mean_edge.max(f64::MIN_POSITIVE);
        Some(Self { mesh, rule, residual })
    }
}

/// What a triangle is in its tile.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Role {
    Centre,
    /// Which of its corners is an old vertex.
    Corner(usize),
}

/// What one triangle of a component may be.
const GUESSES: [Role; 4] = [Role::Centre, Role::Corner(0), Role::Corner(1), Role::Corner(2)];

/// The roles of all triangles, in the first way, the second, … that components can be cut into tiles: where six triangles meet at every vertex there may be four. None where a component has no way, or none has so many.
fn roles(mesh: &TriMesh, edges: &Edges, way: usize) -> Option<Vec<Role>> {
    let mut roles = vec![None; mesh.triangle_count()];
    let mut has_so_many = false;
    for seed in 0..roles.len() {
        if roles[seed].is_some() {
            continue;
        }
        let mut ways = Vec::new();
        for guess in GUESSES {
            if let Some(given) = spread(mesh, edges, seed, guess, &mut roles) {
                ways.push(guess);
                if ways.len() > way {
                    break;
                }
                given.iter().for_each(|&triangle| roles[triangle] = None);
            }
        }
        has_so_many |= ways.len() > way;
        if roles[seed].is_none() {
            spread(mesh, edges, seed, *ways.first()?, &mut roles)?;
        }
    }
    has_so_many.then_some(())?;
    roles.into_iter().collect()
}

/// Gives roles to all triangles that hang together with one whose role is a guess, and says which; to none where that is a contradiction.
fn spread(
    mesh: &TriMesh,
    edges: &Edges,
    seed: usize,
    guess: Role,
    roles: &mut [Option<Role>],
) -> Option<Vec<usize>> {
    roles[seed] = Some(guess);
    let (mut given, mut next) = (vec![seed], 0);
    while next < given.len() {
        let triangle = given[next];
        next += 1;
        for side in 0..3 {
            let agrees = match across(mesh, edges, triangle, side, roles[triangle]) {
                Across::Nothing => true,
                Across::Impossible => false,
                Across::Is(other, role) => match roles[other] {
                    Some(had) => had == role,
                    None => {
                        roles[other] = Some(role);
                        given.push(other);
                        true
                    }
                },
            };
            if !agrees {
                given.iter().for_each(|&triangle| roles[triangle] = None);
                return None;
            }
        }
    }
    Some(given)
}

/// What lies beyond a side of a triangle.
enum Across {
    Nothing,
    Impossible,
    Is(usize, Role),
}

fn across(mesh: &TriMesh, edges: &Edges, triangle: usize, side: usize, role: Option<Role>) -> Across {
    let edge = edges.of_triangle()[triangle][side] as usize;
    let old = match role {
        Some(Role::Corner(corner)) if corner == side || corner == (side + 1) % 3 => {
            Some(mesh.triangles()[triangle][corner])
        }
        _ => None,
    };
    match *edges.triangles(edge) {
        [_] if old.is_some() => Across::Nothing,
        [a, b] => {
            let other = if a as usize == triangle { b } else { a } as usize;
            let corners = mesh.triangles()[other];
            let ends = edges.vertices()[edge];
            let is_centre = matches!(role, Some(Role::Corner(_))) && old.is_none();
            let corner = match old {
                Some(old) => corners.iter().position(|&v| v == old),
                None => corners.iter().position(|v| !ends.contains(v)),
            };
            match (is_centre, corner) {
                (true, _) => Across::Is(other, Role::Centre),
                (false, Some(corner)) => Across::Is(other, Role::Corner(corner)),
                (false, None) => Across::Impossible,
            }
        }
        _ => Across::Impossible,
    }
}

/// A mesh's tiles.
struct Tiles {
    /// The vertices that were there before.
    old: Vec<usize>,
    /// Triangles of these, by their places in `old`.
    triangles: Vec<[u32; 3]>,
    /// The new vertex between two, the smaller first.
    new: HashMap<[u32; 2], usize>,
}

impl Tiles {
    fn of(mesh: &TriMesh, edges: &Edges, roles: &[Role]) -> Option<Self> {
        let mut place = vec![None; mesh.vertex_count()];
        let mut old = Vec::new();
        for (corners, role) in mesh.triangles().iter().zip(roles) {
            if let Role::Corner(corner) = *role {
                let v = corners[corner] as usize;
                place[v].get_or_insert_with(|| {
                    old.push(v);
                    old.len() as u32 - 1
                });
            }
        }
        let mut tiles = Self {
            old,
            triangles: Vec::new(),
            new: HashMap::new(),
        };
        for centre in (0..roles.len()).filter(|&t| roles[t] == Role::Centre) {
            let middle = mesh.triangles()[centre];
            // Beyond side i, from corner i to corner i + 1, lies the old vertex that both are next to.
            let mut beyond = [0; 3];
            for (side, beyond) in beyond.iter_mut().enumerate() {
                let Across::Is(other, Role::Corner(corner)) =
                    across(mesh, edges, centre, side, Some(Role::Centre))
                else {
                    return None;
                };
                *beyond = place[mesh.triangles()[other][corner] as usize]?;
            }
            for (i, &v) in middle.iter().enumerate() {
                let (a, b) = (beyond[(i + 2) % 3], beyond[i]);
                let known = tiles.new.insert([a.min(b), a.max(b)], v as usize);
                if place[v as usize].is_some() || known.is_some_and(|known| known != v as usize) {
                    return None;
                }
            }
            tiles.triangles.push([beyond[2], beyond[0], beyond[1]]);
        }
        (4 * tiles.triangles.len() == mesh.triangle_count()).then_some(tiles)
    }
}

/// How places after a subdivision follow from those before it: of old vertices first, then of one on each edge. Weights of a row add up to 1.
struct Masks {
    starts: Vec<usize>,
    entries: Vec<(u32, f64)>,
    columns: usize,
}

/// Steps of conjugate gradients: masks are well conditioned.
const STEPS: usize = 60;
/// What is left, squared, beside what there was.
const SMALL: f64 = 1e-24;

impl Masks {
    fn of(mesh: &TriMesh, edges: &Edges, rule: Subdivision) -> Self {
        let mut masks = Self {
            starts: vec![0],
            entries: Vec::new(),
            columns: mesh.vertex_count(),
        };
        let is_border = |edge: usize| edges.triangles(edge).len() != 2;
        let at_vertices = edges.at_vertices();
        for v in 0..mesh.vertex_count() {
            let around = at_vertices.of(v).iter().map(|&edge| edge as usize);
            let border: Vec<usize> = around.clone().filter(|&edge| is_border(edge)).collect();
            let (drawn_by, pull): (Vec<usize>, f64) = match (rule, border.is_empty()) {
                (Subdivision::Midpoint, _) => (Vec::new(), 0.0),
                (Subdivision::Loop, false) => (border, 0.25),
                (Subdivision::Loop, true) => {
                    let around: Vec<usize> = around.collect();
                    let turn = TAU / around.len().max(1) as f64;
                    let pull = 0.625 - (0.375 + 0.25 * libm::cos(turn)).powi(2);
                    (around, pull)
                }
            };
            let pull = if drawn_by.is_empty() { 0.0 } else { pull };
            masks.entries.push((v as u32, 1.0 - pull));
            let each = pull / drawn_by.len().max(1) as f64;
            masks.entries.extend(
                drawn_by
                    .iter()
                    .map(|&edge| (edges.other_end(edge, v as u32), each)),
            );
            masks.starts.push(masks.entries.len());
        }
        for (edge, &[a, b]) in edges.vertices().iter().enumerate() {
            let is_drawn = rule == Subdivision::Loop && !is_border(edge);
            let ends = if is_drawn { 0.375 } else { 0.5 };
            masks.entries.extend([(a, ends), (b, ends)]);
            if is_drawn {
                let corners = edges
                    .triangles(edge)
                    .iter()
                    .flat_map(|&t| mesh.triangles()[t as usize]);
                masks
                    .entries
                    .extend(corners.filter(|v| ![a, b].contains(v)).map(|v| (v, 0.125)));
            }
            masks.starts.push(masks.entries.len());
        }
        masks
    }

    fn rows(&self) -> impl Iterator<Item = &[(u32, f64)]> {
        self.starts.windows(2).map(|ends| &self.entries[ends[0]..ends[1]])
    }

    /// Places after, A x.
    fn places(&self, before: &[Vec3]) -> Vec<Vec3> {
        let row = |row: &[(u32, f64)]| {
            row.iter()
                .fold(Vec3::ZERO, |sum, &(v, weight)| sum + before[v as usize] * weight)
        };
        self.rows().map(row).collect()
    }

    /// Aᵀ y.
    fn transposed(&self, after: &[Vec3]) -> Vec<Vec3> {
        let mut sums = vec![Vec3::ZERO; self.columns];
        for (row, &y) in self.rows().zip(after) {
            row.iter().for_each(|&(v, weight)| sums[v as usize] += y * weight);
        }
        sums
    }

    /// The places before of which A makes those nearest to the wanted ones, by conjugate gradients on the normal equations, from the old vertices' own; and how far these are, root mean square.
    fn nearest(&self, wanted: &[Vec3]) -> (Vec<Vec3>, f64) {
        let square = |of: &[Vec3]| of.iter().map(|v| v.squared()).sum::<f64>();
        let mut x = wanted[..self.columns].to_vec();
        let mut rest: Vec<Vec3> = wanted.iter().zip(self.places(&x)).map(|(&y, z)| y - z).collect();
        let mut gradient = self.transposed(&rest);
        let mut direction = gradient.clone();
        let mut steepness = square(&gradient);
        let enough = SMALL * square(wanted);
        for _ in 0..STEPS {
            if steepness <= enough {
                break;
            }
            let along = self.places(&direction);
            let step = steepness / square(&along).max(f64::MIN_POSITIVE);
            x.iter_mut().zip(&direction).for_each(|(x, &d)| *x += d * step);
            rest.iter_mut().zip(&along).for_each(|(r, &a)| *r -= a * step);
            gradient = self.transposed(&rest);
            let next = square(&gradient);
            let keeps = next / steepness;
            direction
                .iter_mut()
                .zip(&gradient)
                .for_each(|(d, &g)| *d = g + *d * keeps);
            steepness = next;
        }
        (x, (square(&rest) / wanted.len() as f64).sqrt())
    }
}

impl Subdivision {
    /// The mesh with every triangle split in four: its own vertices first, then one for each of its [`Edges`].
    pub fn of(self, mesh: &TriMesh) -> TriMesh {
        let edges = Edges::of(mesh);
        let before: Vec<Vec3> = (0..mesh.vertex_count()).map(|v| mesh.point(v)).collect();
        let places = Masks::of(mesh, &edges, self).places(&before);
        let divided = shapes::divided(mesh);
        divided
            .with_positions(places.into_iter().map(|p| p.0).collect())
            .unwrap_or(divided)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const RULES: [Subdivision; 2] = [Subdivision::Midpoint, Subdivision::Loop];

    /// Its corners, sorted by triangles' places, whatever their order was.
    fn sorted(mesh: &TriMesh) -> Vec<[[i64; 3]; 3]> {
        let rounded = |p: Vec3| p.0.map(|x| (x * 1e6).round() as i64);
        let mut triangles: Vec<_> = (0..mesh.triangle_count())
            .map(|t| {
                let mut corners = mesh.corners(t).map(rounded);
                let least = (0..3).min_by_key(|&i| corners[i]).unwrap_or(0);
                corners.rotate_left(least);
                corners
            })
            .collect();
        triangles.sort_unstable();
        triangles
    }

    fn meshes() -> Vec<TriMesh> {
        vec![
            shapes::tetrahedron(),
            shapes::bumpy_sphere(2, 3),
            shapes::bumpy_torus(7, 5, 1),
            shapes::rectangle(3, 2, 3.0, 1.0),
            shapes::cylinder(5, 3, 1.0, 2.0),
            shapes::bumpy_block(2, 1, 4),
            shapes::disjoint_union(&[
                shapes::cube(1.0),
                shapes::translated(&shapes::icosphere(0), [5.0; 3]),
            ]),
        ]
    }

    proptest! {
        #[test]
        fn what_was_subdivided_is_as_it_was_before(which in 0..7_usize, by_loop in any::<bool>(), times in 1..3_usize, seed in any::<u64>()) {
            let mesh = &meshes()[which];
            let rule = RULES[usize::from(by_loop)];
            let mut found = (0..times).fold(mesh.clone(), |mesh, _| rule.of(&mesh));
            found = shapes::shuffled(&found, seed);
            found = (0..times).fold(found, |fine, _| {
                let found = undivided(&fine).unwrap();
                assert!(found.residual < 1e-9, "{}", found.residual);
                found.mesh
            });
            prop_assert_eq!(found.triangle_count(), mesh.triangle_count());
            prop_assert!((found.area() - mesh.area()).abs() < 1e-6 * mesh.area());
        }
    }

    #[test]
    fn triangles_keep_their_places_and_face_as_they_did() {
        for mesh in meshes() {
            for rule in RULES {
                let found = undivided(&shapes::shuffled(&rule.of(&mesh), 9)).unwrap();
                assert_eq!(sorted(&found.mesh), sorted(&mesh), "{rule:?}");
            }
        }
    }

    #[test]
    fn masks_are_those_of_loop() {
        // The octahedron's vertices are drawn by 5/8 − (3/8)² to a mean that is 0; the corners across an edge cancel out.
        let corners = [
            [1.0, 0.0, 0.0],
            [-1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, -1.0, 0.0],
            [0.0, 0.0, 1.0],
            [0.0, 0.0, -1.0],
        ];
        let faces = [
            [0, 2, 4],
            [2, 1, 4],
            [1, 3, 4],
            [3, 0, 4],
            [2, 0, 5],
            [1, 2, 5],
            [3, 1, 5],
            [0, 3, 5],
        ];
        let octahedron = TriMesh::new(corners.to_vec(), faces.to_vec()).unwrap();
        let divided = Subdivision::Loop.of(&octahedron);
        assert!((divided.point(0) - Vec3([0.515625, 0.0, 0.0])).norm() < 1e-15);
        let first = Edges::of(&octahedron).find(0, 2).unwrap();
        assert!((divided.point(6 + first) - Vec3([0.375, 0.375, 0.0])).norm() < 1e-15);
        // Borders are cubic B-splines.
        let square = Subdivision::Loop.of(&shapes::rectangle(1, 1, 8.0, 8.0));
        assert!((square.point(0) - Vec3([1.0, 1.0, 0.0])).norm() < 1e-12);
    }

    #[test]
    fn what_nobody_subdivided_is_left_alone() {
        let sphere = Subdivision::Loop.of(&shapes::bumpy_sphere(2, 3));
        let without_one =
            TriMesh::new(sphere.positions().to_vec(), sphere.triangles()[4..].to_vec()).unwrap();
        let turned_edges = shapes::soup(40, 1);
        for mesh in [
            shapes::cube(1.0),
            shapes::bumpy_torus(9, 7, 1),
            shapes::book(4),
            turned_edges,
        ] {
            assert!(undivided(&mesh).is_none());
        }
        // Of a crop that goes through tiles nothing is known; one along them is what a crop before would have been.
        assert!(undivided(&without_one).is_some());
        let through = TriMesh::new(
            sphere.positions().to_vec(),
            sphere.triangles()[2..sphere.triangle_count() - 2].to_vec(),
        );
        assert!(undivided(&through.unwrap()).is_none());
    }

    #[test]
    fn what_was_changed_since_is_further_from_the_rule() {
        let sphere = Subdivision::Loop.of(&shapes::bumpy_sphere(3, 3));
        let residual = |amount: f64| undivided(&shapes::jittered(&sphere, amount, 1)).unwrap().residual;
        assert!(residual(0.0) < 1e-9 && residual(0.001) < residual(0.01) && residual(0.01) < residual(0.1));
    }
}
