//! Suspects whose parts went different ways: each part is put back by itself.

use job::Job;
use mesh::{Components, Similarity, TriMesh, Vec3, components};

use crate::{AlignOptions, Aligner, Alignment, MatchedBy, PreparedMesh, RegistrationError, matrix::Mat3};

/// A connected part of a suspect that is a part of the original.
#[derive(Clone, Debug)]
pub struct Piece {
    /// Number of the part among the suspect's [`components`].
    pub suspect_part: usize,
    /// Its triangles, by the suspect's vertices.
    pub triangles: Vec<[u32; 3]>,
    /// Its area, in the suspect's unit.
    pub area: f64,
    /// Where it may belong: several places where parts are alike, or symmetric. At least one.
    pub places: Vec<PiecePlace>,
}

/// A place where a piece may belong.
#[derive(Clone, Debug)]
pub struct PiecePlace {
    /// Number of the part among the original's [`components`].
    pub part: usize,
    /// Takes the piece there.
    pub transform: Similarity,
    /// What it rests on.
    pub matched_by: MatchedBy,
    /// Vertices of the original, and those of the suspect that were found to be the same.
    pub pairs: Vec<[u32; 2]>,
}

/// Parts with fewer triangles fit anywhere.
const LEAST_TRIANGLES: usize = 12;

/// How many parts of the original a piece is tried on, the most alike first.
const MOST_CANDIDATES: usize = 8;

/// How many alignments are tried in all, the largest pieces first.
const MOST_ALIGNMENTS: usize = 128;

/// How far figures of shape may differ, relatively, between a part and what became of it.
const ALIKE: f64 = 0.05;

/// How far, in diagonals of the original, pieces that moved together lie apart at most.
const TOGETHER: f64 = 0.01;

impl Aligner {
    /// Puts every connected part of a suspect back by itself, where it is a whole part of the original: moved, turned, mirrored and scaled
    /// alone. Of the original's parts, those count that have a vertex of interest.
    ///
    /// A piece with all vertices of a part is put back by these alone: one that was bent has no place. Where all of the suspect's triangles
    /// are the original's, none is looked for by its surface.
    ///
    /// Where a piece fits several parts, those are taken that lie as another piece does that fits one alone; else all are places.
    ///
    /// # Errors
    /// [`RegistrationError::Job`].
    pub fn pieces(
        &self,
        suspect: &PreparedMesh,
        of_interest: &[bool],
        job: &Job,
    ) -> Result<Vec<Piece>, RegistrationError> {
        let original = self.original().mesh();
        let mut parts = Part::all_of(original);
        let of_suspect = Part::all_of(suspect.mesh());
        let is_same_net = counts(&of_suspect) == counts(&parts) && self.has_same_net(suspect.mesh(), job)?;
        parts.retain(|part| part.vertices.iter().any(|&v| of_interest[v as usize]));
        let aligners = parts
            .iter()
            .map(|part| Self::new(&part.mesh, &AlignOptions::default()));
        let aligners: Vec<Self> = aligners.collect::<Result<_, _>>()?;
        let quiet = job.quiet();
        let mut left = MOST_ALIGNMENTS;
        let mut pieces = Vec::new();
        for piece in of_suspect {
            let mut alike: Vec<usize> = (0..parts.len()).filter(|&i| piece.is_like(&parts[i])).collect();
            alike.sort_by(|&a, &b| piece.unlike(&parts[a]).total_cmp(&piece.unlike(&parts[b])));
            // Who has as many vertices and triangles as a part was not re-meshed: then that is the part, or one like it.
            if is_same_net || alike.iter().any(|&i| piece.counts() == parts[i].counts()) {
                alike.retain(|&i| piece.counts() == parts[i].counts());
            }
            alike.truncate(MOST_CANDIDATES.min(left));
            left -= alike.len();
            let prepared = PreparedMesh::from(&piece.mesh);
            let mut places = Vec::new();
            for i in alike {
                job.go_on()?;
                match aligners[i].align_piece(&prepared, is_same_net, &quiet) {
                    Ok(Some(alignment)) if is_whole(&alignment) => {
                        places.extend(places_of(&parts[i], &piece, &alignment));
                    }
                    Ok(_) | Err(RegistrationError::NoSurface { .. }) => {}
                    Err(error) => return Err(error),
                }
            }
            if !places.is_empty() {
                pieces.push(Piece {
                    suspect_part: piece.number,
                    triangles: piece.triangles(suspect.mesh()),
                    area: piece.area,
                    places,
                });
            }
        }
        self.keep_together(suspect.mesh(), &mut pieces);
        Ok(pieces)
    }

    /// Of the places of a piece, keeps the one to which it goes together with another that has no choice.
    fn keep_together(&self, suspect: &TriMesh, pieces: &mut [Piece]) {
        let reach = TOGETHER * self.original().mesh().bounding_box().diagonal();
        let has_one = |piece: &&Piece| piece.places.len() == 1;
        let settled: Vec<Similarity> = pieces
            .iter()
            .filter(has_one)
            .map(|piece| piece.places[0].transform)
            .collect();
        for piece in pieces.iter_mut().filter(|piece| piece.places.len() > 1) {
            let corners = || {
                piece
                    .triangles
                    .iter()
                    .flatten()
                    .map(|&v| suspect.point(v as usize))
            };
            let agrees = |place: &PiecePlace| {
                settled.iter().any(|other| {
                    corners().all(|p| (place.transform.apply(p) - other.apply(p)).norm() <= reach)
                })
            };
            if let Some(at) = piece.places.iter().position(agrees) {
                piece.places = vec![piece.places.swap_remove(at)];
            }
        }
    }
}

/// Whether a piece is all of a part, and no more.
fn is_whole(alignment: &Alignment) -> bool {
    alignment.aligned && alignment.coverage >= AlignOptions::default().least_overlap
}

fn places_of(part: &Part, piece: &Part, alignment: &Alignment) -> Vec<PiecePlace> {
    let pairs = alignment
        .correspondence
        .iter()
        .flat_map(|map| map.suspect_of.iter().zip(&part.vertices));
    let pairs = pairs.filter_map(|(of_piece, &v)| of_piece.map(|w| [v, piece.vertices[w as usize]]));
    let first = PiecePlace {
        part: part.number,
        transform: alignment.transform,
        matched_by: alignment.matched_by,
        pairs: pairs.collect(),
    };
    let others = alignment.alternatives.iter().map(|&transform| PiecePlace {
        transform,
        matched_by: MatchedBy::Surface,
        pairs: Vec::new(),
        ..first
    });
    let others: Vec<PiecePlace> = others.collect();
    std::iter::once(first).chain(others).collect()
}

/// A connected part of a mesh.
struct Part {
    number: usize,
    /// Vertices of the whole, ascending.
    vertices: Vec<u32>,
    mesh: TriMesh,
    area: f64,
    /// Figures that no similarity changes.
    figures: [f64; 3],
}

impl Part {
    /// The parts of a mesh that have a shape, by their area, the largest first.
    fn all_of(mesh: &TriMesh) -> Vec<Self> {
        let Components { count, of_vertex, .. } = components(mesh);
        let mut triangles = vec![Vec::new(); count];
        for &corners in mesh.triangles() {
            triangles[of_vertex[corners[0] as usize] as usize].push(corners);
        }
        let parts = triangles.into_iter().enumerate();
        let mut parts: Vec<Self> = parts
            .filter_map(|(number, triangles)| Self::of(mesh, number, &triangles))
            .collect();
        parts.sort_by(|a, b| b.area.total_cmp(&a.area).then(a.number.cmp(&b.number)));
        parts
    }

    fn of(mesh: &TriMesh, number: usize, triangles: &[[u32; 3]]) -> Option<Self> {
        if triangles.len() < LEAST_TRIANGLES {
            return None;
        }
        let mut vertices: Vec<u32> = triangles.as_flattened().to_vec();
        vertices.sort_unstable();
        vertices.dedup();
        let within = |v: u32| vertices.binary_search(&v).unwrap_or_default() as u32;
        let positions = vertices.iter().map(|&v| mesh.positions()[v as usize]).collect();
        let triangles = triangles.iter().map(|corners| corners.map(within)).collect();
        let part = TriMesh::new(positions, triangles).ok()?;
        let (area, figures) = figures(&part)?;
        Some(Self {
            number,
            vertices,
            mesh: part,
            area,
            figures,
        })
    }

    fn counts(&self) -> (usize, usize) {
        (self.mesh.vertex_count(), self.mesh.triangle_count())
    }

    fn triangles(&self, mesh: &TriMesh) -> Vec<[u32; 3]> {
        let of_whole = |v: u32| self.vertices[v as usize];
        debug_assert!(self.vertices.len() <= mesh.vertex_count());
        self.mesh
            .triangles()
            .iter()
            .map(|corners| corners.map(of_whole))
            .collect()
    }

    /// The largest relative difference of the figures.
    fn unlike(&self, other: &Self) -> f64 {
        let pairs = self.figures.iter().zip(other.figures);
        pairs.map(|(a, b)| (a / b).ln().abs()).fold(0.0, f64::max)
    }

    fn is_like(&self, other: &Self) -> bool {
        self.unlike(other) <= ALIKE
    }
}

/// The numbers of vertices and triangles of parts, ascending.
fn counts(parts: &[Part]) -> Vec<(usize, usize)> {
    let mut counts: Vec<_> = parts.iter().map(Part::counts).collect();
    counts.sort_unstable();
    counts
}

/// A surface's area, and of its covariance C, area-weighted: area / tr C, tr C² / (tr C)², and (1 + det C / (tr C)³ · 27): what a similarity
/// keeps. `None` of a surface without area.
fn figures(mesh: &TriMesh) -> Option<(f64, [f64; 3])> {
    let area = mesh.area();
    let weighted = || (0..mesh.triangle_count()).map(|t| (mesh.triangle_area(t), mesh.corners(t)));
    let centre: Vec3 = weighted()
        .map(|(w, [a, b, c])| (a + b + c) * (w / 3.0))
        .sum::<Vec3>()
        / area;
    let mut covariance = Mat3::ZERO;
    for (weight, corners) in weighted() {
        // Exact for a triangle: the midpoints of its sides.
        for k in 0..3 {
            let p = (corners[k] + corners[(k + 1) % 3]) / 2.0 - centre;
            covariance += Mat3::outer(p, p * (weight / (3.0 * area)));
        }
    }
    let (trace, square) = (covariance.trace(), (covariance * covariance).trace());
    let figures = [
        area / trace,
        square / (trace * trace),
        1.0 + 27.0 * covariance.determinant() / trace.powi(3),
    ];
    let is_shape = area.is_normal() && figures.iter().all(|figure| figure.is_normal());
    is_shape.then_some((area, figures))
}

#[cfg(test)]
mod tests {
    use super::*;
    use mesh::shapes;

    fn turned(by: f64, scale: f64, translation: [f64; 3]) -> Similarity {
        Similarity {
            scale,
            translation,
            ..Similarity::from_quaternion([1.0, by, -0.4, 0.2])
        }
    }

    /// A sphere, a torus and a block, far apart; one vertex in two is of interest, so all parts are.
    fn scene() -> TriMesh {
        shapes::disjoint_union(&[
            shapes::bumpy_sphere(3, 1),
            shapes::translated(&shapes::bumpy_torus(24, 16, 2), [6.0, 0.0, 0.0]),
            shapes::translated(&shapes::bumpy_block(1, 3, 3), [0.0, 9.0, 0.0]),
        ])
    }

    fn pieces_of(original: &TriMesh, suspect: &TriMesh) -> Vec<Piece> {
        let aligner = Aligner::new(original, &AlignOptions::default()).unwrap();
        let all = vec![true; original.vertex_count()];
        aligner.pieces(&suspect.into(), &all, &Job::default()).unwrap()
    }

    fn largest_error(original: &TriMesh, suspect: &TriMesh, piece: &Piece) -> f64 {
        let place = &piece.places[0];
        let off = |&[v, w]: &[u32; 2]| {
            (place.transform.apply(suspect.point(w as usize)) - original.point(v as usize)).norm()
        };
        assert!(!place.pairs.is_empty());
        place.pairs.iter().map(off).fold(0.0, f64::max)
    }

    #[test]
    fn parts_that_went_different_ways_are_all_put_back() {
        let original = scene();
        let moves = [
            turned(0.3, 2.0, [1.0, 2.0, 3.0]),
            turned(-1.0, 0.5, [-20.0, 0.0, 4.0]),
            turned(2.0, 1.0, [0.0; 3]),
        ];
        let parts = Part::all_of(&original);
        let moved: Vec<TriMesh> = (0..3)
            .map(|number| {
                let part = parts.iter().find(|part| part.number == number).unwrap();
                shapes::shuffled(&shapes::moved(&part.mesh, &moves[number]), 7)
            })
            .collect();
        let suspect = shapes::disjoint_union(&[moved[2].clone(), moved[0].clone(), moved[1].clone()]);
        let pieces = pieces_of(&original, &suspect);
        let mut parts: Vec<usize> = pieces.iter().map(|piece| piece.places[0].part).collect();
        parts.sort_unstable();
        assert_eq!(parts, [0, 1, 2]);
        for piece in &pieces {
            assert!(largest_error(&original, &suspect, piece) < 1e-9);
        }
    }

    #[test]
    fn a_part_among_strangers_is_found_and_strangers_are_not() {
        let original = scene();
        let torus = shapes::moved(&shapes::bumpy_torus(24, 16, 2), &turned(0.7, 3.0, [1.0; 3]));
        let suspect = shapes::disjoint_union(&[shapes::bumpy_sphere(3, 99), torus, shapes::cube(1.0)]);
        let pieces = pieces_of(&original, &suspect);
        assert_eq!(pieces.len(), 1);
        assert_eq!((pieces[0].suspect_part, pieces[0].places[0].part), (1, 1));
        assert!(pieces_of(&original, &shapes::bumpy_sphere(3, 99)).is_empty());
    }

    #[test]
    fn of_parts_that_moved_and_parts_that_were_bent_those_that_moved_are_put_back() {
        let original = scene();
        let motion = turned(0.3, 2.0, [1.0, 2.0, 3.0]);
        // Two parts go round with the third, and are bent on their way.
        let place = |p: &[f64; 3]| {
            let [x, y, z] = motion.apply(*p);
            let bend = if p[0].abs() + p[1].abs() > 3.5 {
                0.1 * x * x
            } else {
                0.0
            };
            [x, y, z + bend]
        };
        let suspect = original
            .with_positions(original.positions().iter().map(place).collect())
            .unwrap();
        let pieces = pieces_of(&original, &suspect);
        assert_eq!(pieces.len(), 1);
        assert_eq!((pieces[0].suspect_part, pieces[0].places[0].part), (0, 0));
        assert!(largest_error(&original, &suspect, &pieces[0]) < 1e-9);
    }

    #[test]
    fn of_parts_that_are_alike_the_one_is_taken_that_lies_as_others_do() {
        let wheel = shapes::bumpy_torus(24, 16, 2);
        let wheels = [0.0, 6.0, 12.0].map(|x| shapes::translated(&wheel, [x, 0.0, 0.0]));
        let original = shapes::disjoint_union(&[
            shapes::translated(&shapes::bumpy_sphere(3, 1), [0.0, 5.0, 0.0]),
            wheels[0].clone(),
            wheels[1].clone(),
            wheels[2].clone(),
        ]);
        let alone = pieces_of(&original, &shapes::scaled(&wheel, 4.0));
        assert_eq!(alone[0].places.len(), 3, "any of the three wheels");
        let turned = turned(0.3, 2.0, [1.0, 2.0, 3.0]);
        let together = pieces_of(&original, &shapes::moved(&original, &turned));
        let places: Vec<(usize, usize)> = together
            .iter()
            .map(|piece| (piece.suspect_part, piece.places[0].part))
            .collect();
        assert!(together.iter().all(|piece| piece.places.len() == 1));
        assert!(places.iter().all(|(piece, part)| piece == part), "{places:?}");
    }
}
