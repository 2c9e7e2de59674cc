//! A surface that was dragged as something elastic: as rigid as possible (Sorkine and Alexa 2007).
//!
//! Handles take a surface p to the places y that have the least energy Σ wᵢⱼ |yᵢ − yⱼ − Rᵢ (pᵢ − pⱼ)|², over both ends of all edges with their cotangent weights and a rotation Rᵢ a vertex. Nothing says that y is smooth: where triangles are large it is not, and no polynomial follows it. But wherever nothing is held,
//! forces balance:
//!
//! Σⱼ wᵢⱼ (yᵢ − yⱼ − ½ (Rᵢ + Rⱼ)(pᵢ − pⱼ)) = 0.
//!
//! Of p = x + δ the original x is known. With x in place of p some force is left. Turned back by Rᵢ and divided by Σⱼ wᵢⱼ it is, to first order in δ,
//!
//! Σⱼ ½ wᵢⱼ ((I + Qᵢⱼ)(δᵢ − δⱼ) + ωᵢ × xᵢⱼ + Qᵢⱼ (ωⱼ × xᵢⱼ)) / Σⱼ wᵢⱼ,
//!
//! for Qᵢⱼ = Rᵢᵀ Rⱼ, xᵢⱼ = xᵢ − xⱼ, and ωᵢ by which Rᵢ turns: (tr Sᵢ − Sᵢ) ωᵢ = Σⱼ wᵢⱼ (δᵢ − δⱼ) × uᵢⱼ, where uᵢⱼ = Rᵢᵀ (yᵢ − yⱼ) and Sᵢ = Σⱼ wᵢⱼ uᵢⱼ xᵢⱼᵀ, which is symmetric. It is δ beside its neighbours less what turns with them, and couples the axes.
//!
//! Programs that take another elastic energy (Chao and others 2010) leave other forces, which are still small.

use mesh::{Edges, TriMesh, Vec3};

use crate::matrix::{Mat3, Svd, svd};

/// The forces in a region.
#[derive(Clone, Debug)]
pub(super) struct Elastic {
    /// Those of each vertex, one vertex after the other.
    spokes: Vec<Spoke>,
    /// Where they end.
    ends: Vec<usize>,
    /// (tr Sᵢ − Sᵢ)⁻¹.
    yielding: Vec<Mat3>,
    /// Whether all of a vertex's forces are known: it and all around it tell how they were turned.
    is_told: Vec<bool>,
}

/// From a vertex i to a neighbour j.
#[derive(Clone, Copy, Debug)]
struct Spoke {
    to: u32,
    /// wᵢⱼ / Σⱼ wᵢⱼ.
    weight: f64,
    /// xᵢ − xⱼ.
    here: Vec3,
    /// Rᵢᵀ (yᵢ − yⱼ).
    there: Vec3,
    /// Qᵢⱼ; of no meaning where j tells no turn.
    turn: Mat3,
}

/// How the surroundings of a vertex were turned.
struct Turn {
    rotation: Mat3,
    yielding: Mat3,
}

/// Cotangent weights of needles are lowered to this.
const MOST_WEIGHT: f64 = 1e3;

/// Surroundings that are so much narrower than long tell no turn about their length.
const NARROWEST: f64 = 1e-6;

/// Where so many times the median of what is left of forces is left, a vertex was held.
const HELD: f64 = 4.0;

/// Rounds in which the scale and the weights of forces follow from each other.
const ROUNDS: usize = 30;

impl Elastic {
    /// The forces in a region, given where its vertices are seen and −1 for mirrored suspects; and what is left of them at each vertex, in the region's unit. None at borders, where a vertex was held, and where not all around it is seen.
    pub(super) fn of(region: &TriMesh, seen: &[Option<[f64; 3]>], hand: f64) -> (Self, Vec<Option<Vec3>>) {
        let rings = Rings::of(region);
        let turns: Vec<Option<Turn>> = (0..seen.len())
            .map(|v| Turn::of(rings.closed(v)?, region, seen, v, hand))
            .collect();
        let mut elastic = Self {
            spokes: Vec::new(),
            ends: Vec::with_capacity(seen.len()),
            yielding: turns
                .iter()
                .map(|turn| turn.as_ref().map_or(Mat3::ZERO, |turn| turn.yielding))
                .collect(),
            is_told: Vec::with_capacity(seen.len()),
        };
        for (v, turn) in turns.iter().enumerate() {
            if let (Some(turn), Some(ring)) = (turn, rings.closed(v)) {
                let back = turn.rotation.transposed();
                let spoke = |&(to, weight): &(u32, f64)| {
                    let [own, other] = [v, to as usize].map(|v| seen[v].map(Vec3));
                    let turned = turns[to as usize].as_ref();
                    Some(Spoke {
                        to,
                        weight,
                        here: region.point(v) - region.point(to as usize),
                        there: back * (own? - other?),
                        turn: turned.map_or(Mat3::IDENTITY, |turned| back * turned.rotation),
                    })
                };
                elastic.spokes.extend(ring.iter().filter_map(spoke));
            }
            let is_turned = |&(to, _): &(u32, f64)| turns[to as usize].is_some();
            let is_told = turn.is_some() && rings.closed(v).is_some_and(|ring| ring.iter().all(is_turned));
            elastic.is_told.push(is_told);
            elastic.ends.push(elastic.spokes.len());
        }
        let left = elastic.forces();
        (elastic, left)
    }

    /// Of each vertex that was not held, and whose forces are known, what is left of them in the scale that leaves least.
    fn forces(&self) -> Vec<Option<Vec3>> {
        let pulls: Vec<(Vec3, Vec3)> = (0..self.ends.len())
            .filter(|&v| self.is_told[v])
            .map(|v| {
                let weighted = |spoke: &Spoke, pull: Vec3| pull * spoke.weight;
                let spokes = self.spokes_of(v).iter();
                let there = spokes.clone().map(|s| weighted(s, s.there)).sum();
                let here = spokes
                    .map(|s| weighted(s, (s.here + s.turn * s.here) * 0.5))
                    .sum();
                (there, here)
            })
            .collect();
        let scale = scale_between(&pulls);
        let left: Vec<Vec3> = pulls
            .into_iter()
            .map(|(there, here)| there * scale - here)
            .collect();
        let mut sizes: Vec<f64> = left.iter().map(|left| left.norm()).collect();
        let middle = sizes.len() / 2;
        let most = match sizes.is_empty() {
            true => 0.0,
            false => HELD * *sizes.select_nth_unstable_by(middle, f64::total_cmp).1,
        };
        let mut left = left.into_iter();
        let is_free = |left: &Vec3| left.norm() <= most;
        self.is_told
            .iter()
            .map(|&is_told| {
                if is_told {
                    left.next().filter(is_free)
                } else {
                    None
                }
            })
            .collect()
    }

    fn spokes_of(&self, vertex: usize) -> &[Spoke] {
        let start = vertex.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.spokes[start..self.ends[vertex]]
    }

    /// What is left of a field δ; 0 where not all forces are known.
    pub(super) fn left_of(&self, field: &[Vec3]) -> Vec<Vec3> {
        let apart = |v: usize, spoke: &Spoke| field[v] - field[spoke.to as usize];
        let turning: Vec<Vec3> = (0..field.len())
            .map(|v| {
                let spokes = self.spokes_of(v).iter();
                let moments = spokes.map(|s| apart(v, s).cross(s.there) * s.weight);
                self.yielding[v] * moments.sum::<Vec3>()
            })
            .collect();
        let left = |v: usize| {
            let of_spoke = |spoke: &Spoke| {
                let apart = apart(v, spoke);
                let own = apart + turning[v].cross(spoke.here);
                let other = apart + turning[spoke.to as usize].cross(spoke.here);
                (own + spoke.turn * other) * (0.5 * spoke.weight)
            };
            self.spokes_of(v).iter().map(of_spoke).sum()
        };
        (0..field.len())
            .map(|v| if self.is_told[v] { left(v) } else { Vec3::ZERO })
            .collect()
    }
}

/// The neighbours of each vertex, with weights that sum to 1.
struct Rings(Vec<Option<Vec<(u32, f64)>>>);

impl Rings {
    fn of(region: &TriMesh) -> Self {
        let edges = Edges::of(region);
        let weights = region.cotangent_weights(&edges);
        let ring = |v: u32, star: &[u32]| {
            let is_closed = star.iter().all(|&e| edges.triangles(e as usize).len() == 2);
            let weight = |e: u32| weights[e as usize].clamp(0.0, MOST_WEIGHT);
            let total: f64 = star.iter().map(|&e| weight(e)).sum();
            let spoke = |&e: &u32| (edges.other_end(e as usize, v), weight(e) / total);
            (is_closed && total.is_normal()).then(|| star.iter().map(spoke).collect())
        };
        let stars = edges.at_vertices();
        let rings = (0..region.vertex_count()).map(|v| ring(v as u32, stars.of(v)));
        Self(rings.collect())
    }

    /// The ring around a vertex inside the surface.
    fn closed(&self, vertex: usize) -> Option<&[(u32, f64)]> {
        self.0[vertex].as_deref()
    }
}

impl Turn {
    /// By the polar decomposition of Σⱼ wᵢⱼ (yᵢ − yⱼ)(xᵢ − xⱼ)ᵀ.
    fn of(
        ring: &[(u32, f64)],
        region: &TriMesh,
        seen: &[Option<[f64; 3]>],
        vertex: usize,
        hand: f64,
    ) -> Option<Self> {
        let own = Vec3(seen[vertex]?);
        let mut covariance = Mat3::ZERO;
        for &(to, weight) in ring {
            let there = own - Vec3(seen[to as usize]?);
            let here = region.point(vertex) - region.point(to as usize);
            covariance += Mat3::outer(there * weight, here);
        }
        let Svd {
            values: [a, b, c],
            left: Mat3(left),
            right: Mat3(right),
        } = svd(&covariance);
        let sign = (Mat3(left).determinant() * Mat3(right).determinant() * hand).signum();
        let mut turn = Self {
            rotation: Mat3::ZERO,
            yielding: Mat3::ZERO,
        };
        let stiffness = [b + sign * c, a + sign * c, a + b];
        if stiffness[0] <= NARROWEST * a || a.is_nan() {
            return None;
        }
        for (i, sign) in [1.0, 1.0, sign].into_iter().enumerate() {
            turn.rotation += Mat3::outer(left[i] * sign, right[i]);
            turn.yielding += Mat3::outer(right[i] * (1.0 / stiffness[i]), right[i]);
        }
        Some(turn)
    }
}

/// The s for which Σ |s a − c| over pairs (a, c) is least, by least squares that are weighted again and again.
fn scale_between(pairs: &[(Vec3, Vec3)]) -> f64 {
    let mut scale = 1.0;
    let mut weights = vec![1.0; pairs.len()];
    for _ in 0..ROUNDS {
        let (mut both, mut squares) = (0.0, 0.0);
        for (&(a, c), weight) in pairs.iter().zip(&weights) {
            both += weight * a.dot(c);
            squares += weight * a.squared();
        }
        scale = both / squares.max(f64::MIN_POSITIVE);
        let off: Vec<f64> = pairs.iter().map(|&(a, c)| (a * scale - c).norm()).collect();
        let least = 1e-3 * off.iter().sum::<f64>() / pairs.len().max(1) as f64;
        for (weight, off) in weights.iter_mut().zip(off) {
            *weight = 1.0 / (off + least).max(f64::MIN_POSITIVE);
        }
    }
    scale
}

#[cfg(test)]
mod tests {
    use mesh::shapes::{self, turned};

    use crate::{
        Degree, FrameOptions, LocalFrames,
        local_frames::{LeftOfScalar, elastic::Elastic},
    };
    use mesh::{TriMesh, Vec3};

    fn fitted(region: &TriMesh, seen: &[Option<[f64; 3]>]) -> LocalFrames {
        let options = FrameOptions {
            reach: 0.5,
            noise: 1e-3,
            degree: Degree::Quadratic,
        };
        LocalFrames::fit(region, seen, &options)
    }

    fn seen(mesh: &TriMesh) -> Vec<Option<[f64; 3]>> {
        mesh.positions().iter().copied().map(Some).collect()
    }

    fn low_poly() -> TriMesh {
        shapes::bumpy_torus(24, 16, 1)
    }

    fn field(mesh: &TriMesh) -> Vec<Vec3> {
        let wave = |v: usize| {
            let Vec3([x, y, z]) = mesh.point(v);
            Vec3([(9.0 * y + 1.0).sin(), (8.0 * z).cos(), (10.0 * x).sin()]) * 1e-3
        };
        (0..mesh.vertex_count()).map(wave).collect()
    }

    fn displaced(mesh: &TriMesh, by: &[Vec3]) -> TriMesh {
        let places = (0..by.len()).map(|v| (mesh.point(v) + by[v]).into()).collect();
        mesh.with_positions(places).unwrap()
    }

    fn is_held(p: Vec3) -> bool {
        p[0].abs() > 0.9
    }

    /// One side held, and the other turned.
    fn dragged(mesh: &TriMesh) -> TriMesh {
        let held = |v: usize| {
            let p = mesh.point(v);
            let is_far = p[0] > 0.0;
            let there = if is_far {
                turned(p, Vec3([0.9, 0.3, -0.2]))
            } else {
                p
            };
            is_held(p).then_some(there)
        };
        let held: Vec<Option<Vec3>> = (0..mesh.vertex_count()).map(held).collect();
        shapes::scaled(&shapes::dragged(mesh, &held), 7.0)
    }

    #[test]
    fn what_is_left_of_forces_is_what_is_left_of_what_was_there_before_a_drag_of_either_hand() {
        let mesh = low_poly();
        let field = field(&mesh);
        let posed = dragged(&displaced(&mesh, &field));
        for posed in [posed.clone(), shapes::mirrored(&posed)] {
            let frames = fitted(&mesh, &seen(&posed));
            let forces = frames.of_elastic_surface(&mesh, &seen(&posed)).unwrap();
            assert_eq!(forces.stretch(), frames.stretch());
            let left = forces.left_of(&field);
            let (mut off, mut size, mut told) = (0.0, 0.0, 0);
            for (v, (beside, left)) in forces.beside().iter().zip(left).enumerate() {
                if let Some(beside) = beside.filter(|_| !is_held(mesh.point(v))) {
                    off += (beside - left).squared();
                    size += left.squared();
                    told += 1;
                }
            }
            assert!(off < 0.1 * size && size > 0.0, "{off} of {size}");
            let free = (0..mesh.vertex_count()).filter(|&v| !is_held(mesh.point(v)));
            assert!(10 * told > 9 * free.count(), "{told}");
        }
    }

    #[test]
    fn nothing_is_left_of_what_turned_and_moved_as_a_whole() {
        let most = |left: &[Vec3]| left.iter().map(|left| left.norm()).fold(0.0, f64::max);
        let open = shapes::bumped(&shapes::rectangle(12, 12, 1.0, 1.0), 0.05, 1);
        for mesh in [low_poly(), open] {
            let larger = shapes::scaled(&mesh, 3.0);
            for posed in [dragged(&mesh), larger.clone()] {
                let (forces, _) = Elastic::of(&mesh, &seen(&posed), 1.0);
                let whole = |v: usize| Vec3([0.3, -0.2, 0.5]).cross(mesh.point(v)) + Vec3([1.0, 2.0, 3.0]);
                let whole: Vec<Vec3> = (0..mesh.vertex_count()).map(whole).collect();
                assert!(most(&forces.left_of(&whole)) < 1e-9);
            }
            let (_, left) = Elastic::of(&mesh, &seen(&larger), 1.0);
            let left: Vec<Vec3> = left.into_iter().flatten().collect();
            assert!(!left.is_empty() && most(&left) < 1e-9);
        }
    }

    #[test]
    fn forces_are_not_told_at_borders_nor_beside_what_is_not_seen() {
        let mesh = shapes::bumped(&shapes::rectangle(12, 12, 1.0, 1.0), 0.05, 1);
        let mut places = seen(&mesh);
        let hole = 6 * 13 + 6;
        places[hole] = None;
        let (_, left) = Elastic::of(&mesh, &places, 1.0);
        for (v, left) in left.iter().enumerate() {
            let near = |v: usize| mesh.point(v).0[..2].iter().any(|&x| !(0.1..=0.9).contains(&x));
            let beside_hole = (mesh.point(v) - mesh.point(hole)).norm() < 0.1;
            assert!(left.is_none() || !(near(v) || beside_hole), "{v}");
        }
        let nowhere = vec![Some([1.0; 3]); mesh.vertex_count()];
        for places in [vec![None; mesh.vertex_count()], nowhere] {
            let (forces, left) = Elastic::of(&mesh, &places, 1.0);
            assert!(left.iter().all(Option::is_none));
            let zero = forces.left_of(&field(&mesh));
            assert!(zero.iter().all(|left| *left == Vec3::ZERO));
        }
    }

    #[test]
    fn a_field_is_the_sum_of_what_it_is_along_the_axes() {
        let mesh = low_poly();
        let places = seen(&dragged(&mesh));
        let frames = fitted(&mesh, &places);
        let forces = frames.of_elastic_surface(&mesh, &places).unwrap();
        let field = field(&mesh);
        for frames in [
            forces.clone(),
            forces.or_elsewhere(&frames),
            frames.or_elsewhere(&forces),
        ] {
            let whole = frames.left_of(&field);
            for axis in 0..3 {
                let of_axis: Vec<f64> = field.iter().map(|f| f[axis]).collect();
                let mut along = vec![Vec3::ZERO; field.len()];
                along
                    .iter_mut()
                    .zip(&of_axis)
                    .for_each(|(along, &f)| along[axis] = f);
                let LeftOfScalar::OfAxes(left) = frames.left_of_scalar(&of_axis) else {
                    panic!("forces couple the axes");
                };
                assert_eq!(left[axis], frames.left_of(&along));
            }
            let sum = |v: usize| {
                let parts = (0..3).map(|axis| {
                    let of_axis: Vec<f64> = field.iter().map(|f| f[axis]).collect();
                    match frames.left_of_scalar(&of_axis) {
                        LeftOfScalar::OfAxes(left) => left[axis][v],
                        _ => Vec3::ZERO,
                    }
                });
                parts.sum::<Vec3>()
            };
            for v in (0..field.len()).step_by(37) {
                assert!((sum(v) - whole[v]).norm() < 1e-12, "{v}");
            }
        }
    }
}
