//! Quadric bias: where decimation puts a vertex.
//!
//! Collapses of edges put a vertex where the quadrics of all that went into it are least (Garland and Heckbert 1997): off the surface, on its outer side, by more than a
//! mark. Where that is on the original follows from the vertex's [region](super::regions): so the bias of the suspect's flat triangles is known
//! better than from the original's surface alone. Planes weigh alike in some programs and by area in others; both are fields of the joint estimate.
//!
//! A vertex whose region is right lies, but for the mark, on the valley of its quadric, in its lowest point. How far off it is along the valley
//! tells how much its region is to be trusted, and which of several it has, and hardly depends on the mark, which moves it across. What a mark does to the lowest points themselves is [`Settling`].
//!
//! Where regions are drawn, many of them say more than one: the suspect's vertices are seen by the [balance](Balances) of their planes, too.

use std::{borrow::Cow, ops::Range, sync::Arc};

use decimation::Quadric;
use job::Job;
use mesh::{Similarity, TriMesh, Vec3};
use registration::PreparedMesh;

use super::{
    ReadingMethod,
    regions::{self, Draws, Overlay, Place, Regions},
    suspect::Sampled,
};
use crate::mark::{Balances, Lowest, MarkError, MarkLayout, Registered, Settling, settling::barycentric};

/// Suspects with more triangles than this share of those that the original has there have hardly been decimated.
const COARSER: f64 = 0.6;

/// Of the weight of a quadric, with which a vertex is held in its place along the surface: where that is flat, the quadric says nothing of it.
const HOLD: f64 = 0.02;

/// The same, for telling how far off a vertex is.
const WEAK_HOLD: f64 = 1e-4;

/// In diagonals: the misfit of what has no region.
const UNKNOWN: f64 = 1.0;

/// In diagonals: smaller misfits say no more for a region.
const EXACT: f64 = 1e-6;

/// How many draws tell how planes weigh.
const JUDGES: usize = 4;

/// Fewer vertices are not worth to be shared by threads.
const VERTICES_A_TASK: usize = 1024;

/// What is asked of a suspect.
#[derive(Clone, Copy)]
pub(super) struct Asked<'a> {
    /// At which vertices of the reference (#V).
    pub(super) vertices: &'a [bool],
    /// Where its mark would be, if it is worth a while to tell regions by it.
    pub(super) layout: Option<&'a MarkLayout>,
}

impl<'a> Asked<'a> {
    /// What a method asks at vertices that it reads.
    pub(super) fn by(method: &'a ReadingMethod, vertices: &'a [bool]) -> Self {
        let layout = method.layout();
        Self {
            vertices,
            // Before all patches are looked at, more of them are the quicker way to more bits.
            layout: (method.detector().is_none() && layout.reads_all()).then_some(layout),
        }
    }
}

/// A suspect as it lies on its original.
struct Lying<'a> {
    original: &'a TriMesh,
    suspect: TriMesh,
    /// Of the suspect's vertices, #V.
    normals: Vec<Vec3>,
    /// Where the original's vertices were seen that are asked for, or are around those (#V).
    places: Vec<Option<Place>>,
}

impl<'a> Lying<'a> {
    /// None where the suspect is not clearly coarser.
    fn of(
        original: &'a TriMesh,
        suspect: &PreparedMesh,
        sampled: &Sampled,
        is_asked: &[bool],
        job: &Job,
    ) -> Result<Option<Self>, MarkError> {
        let Sampled {
            pose,
            registered,
            surface,
        } = sampled;
        let Some(surface) = surface
            .as_ref()
            .filter(|_| is_coarser(original, suspect.mesh(), registered))
        else {
            return Ok(None);
        };
        let lying = lying(suspect, pose)?;
        let place = |v: usize| -> Option<Place> {
            registered.along[v]?;
            let (t, seen) = (surface.triangles[v]?, Vec3(registered.positions[v]?));
            Some((t, barycentric(lying.corners(t as usize), seen)))
        };
        let places = job.map(original.vertex_count(), VERTICES_A_TASK, place)?;
        let places = around(&lying, places, is_asked);
        let turned = |&n: &[f64; 3]| Vec3(pose.rotation.map(|row| Vec3(row).dot(Vec3(n))));
        Ok(Some(Self {
            original,
            normals: suspect.vertex_normals().iter().map(turned).collect(),
            suspect: lying,
            places,
        }))
    }

    fn overlay(&self) -> Overlay<'_> {
        Overlay {
            original: self.original,
            suspect: &self.suspect,
            places: &self.places,
        }
    }
}

/// What was sampled, with [`Registered::quadric_bias`], [`Registered::misfit`] and [`Registered::settling`] at vertices that are asked for, if the suspect is clearly coarser than the original.
pub(super) fn foretold<'s>(
    reference: &PreparedMesh,
    suspect: &PreparedMesh,
    sampled: &'s Sampled,
    asked: Asked<'_>,
    job: &Job,
) -> Result<Cow<'s, Registered>, MarkError> {
    let original = reference.mesh();
    let mut registered = Cow::Borrowed(&sampled.registered);
    let Some((lying, surface)) =
        Lying::of(original, suspect, sampled, asked.vertices, job)?.zip(sampled.surface.as_ref())
    else {
        return Ok(registered);
    };
    let overlay = lying.overlay();
    let places = overlay.places;
    let alternatives = regions::regions(overlay, asked.layout, job)?;
    let (settled, regions) = settle(overlay, &lying.normals, alternatives, job)?;
    let unknown = UNKNOWN * diagonal(original);
    let of_vertex = |v: usize| {
        let (place, along) = (places[v].as_ref()?, registered.along[v]?);
        let offset = surface.offsets[v].unwrap_or(0.0);
        let told = settled
            .each_ref()
            .map(|settled| seen(&lying.suspect, place, settled));
        let bias = told.map(|told| {
            told.map_or(registered.tessellation_bias[v], |(way, _)| {
                offset + Vec3(along).dot(way)
            })
        });
        let misfits = told.iter().flatten().map(|&(_, misfit)| misfit);
        Some((bias, misfits.fold(unknown, f64::min)))
    };
    let if_asked = |v: usize| asked.vertices[v].then(|| of_vertex(v)).flatten();
    let told = job.map(places.len(), VERTICES_A_TASK, if_asked)?;
    let foretold = registered.to_mut();
    for (v, told) in told.into_iter().enumerate() {
        if let Some((bias, misfit)) = told {
            (foretold.quadric_bias[v], foretold.misfit[v]) = (bias, misfit);
        }
    }
    foretold.settling = Some(Arc::new(settling(overlay, regions, &settled[0])));
    Ok(registered)
}

/// Draws of the suspect's regions; none where it is not of the decimator that draws them. Which they are hardly depends on the pose.
pub(super) fn draws(
    reference: &PreparedMesh,
    suspect: &PreparedMesh,
    sampled: &Sampled,
    asked: Asked<'_>,
    job: &Job,
) -> Result<Option<Vec<Regions>>, MarkError> {
    let Some(layout) = asked.layout else {
        return Ok(None);
    };
    let Some(lying) = Lying::of(reference.mesh(), suspect, sampled, asked.vertices, job)? else {
        return Ok(None);
    };
    let suit =
        |draws: &Draws| draws.is_sure || suit_planes_alike(lying.overlay(), &lying.normals, &draws.regions);
    let draws = regions::draws(lying.overlay(), layout, job)?.filter(suit);
    Ok(draws.map(|draws| draws.regions))
}

/// What the suspect's vertices say of the planes that went into them, by draws of regions.
pub(super) fn balances(
    reference: &PreparedMesh,
    suspect: &PreparedMesh,
    pose: &Similarity,
    layout: &MarkLayout,
    draws: &[Regions],
    job: &Job,
) -> Result<Balances, MarkError> {
    let original = reference.mesh();
    let lying = lying(suspect, pose)?;
    let mark = layout.distortion_rms() * diagonal(original);
    Ok(Balances::of(original, &lying, draws, mark, job)?)
}

/// A suspect in a pose.
fn lying(suspect: &PreparedMesh, pose: &Similarity) -> Result<TriMesh, MarkError> {
    let mesh = suspect.mesh();
    Ok(mesh.with_positions(pose.apply_all(mesh.positions()))?)
}

/// Of each vertex of the suspect (#V); none where it has no region, or the quadric of that doesn't tell.
type AllSettled = Vec<Option<Settled>>;

fn diagonal(mesh: &TriMesh) -> f64 {
    mesh.bounding_box().diagonal()
}

/// What the three vertices around a place tell of it: its mean way to the original, and how far they are off; none where one of them has no region.
fn seen(lying: &TriMesh, (t, weights): &Place, settled: &[Option<Settled>]) -> Option<(Vec3, f64)> {
    let [a, b, c] = lying.triangles()[*t as usize].map(|w| settled[w as usize]);
    let corners = [a?, b?, c?];
    let [x, y, z] = std::array::from_fn(|k| corners[k].way * weights[k]);
    let squares = (0..3).map(|k| weights[k].clamp(0.0, 1.0) * corners[k].misfit.powi(2));
    Some((x + y + z, squares.sum::<f64>().sqrt()))
}

/// Of some alternatives, each vertex of the suspect takes its own: where it would be on the original, by planes that weigh alike and by area, and what is left of each alternative.
fn settle(
    overlay: Overlay<'_>,
    normals: &[Vec3],
    alternatives: Vec<Regions>,
    job: &Job,
) -> Result<([AllSettled; Weights::ALL.len()], Vec<Regions>), MarkError> {
    let Overlay {
        original, suspect, ..
    } = overlay;
    // In a frame around the original squares are exact to more digits.
    let centre = Vec3(original.bounding_box().centre());
    let count = alternatives.len();
    let of = |i: usize| -> AllSettled {
        let (weights, regions) = (Weights::ALL[i / count], &alternatives[i % count]);
        let sums = weights.quadrics(original, centre, regions, suspect.vertex_count());
        let at = |w: usize| Settled::of(&sums[w], suspect.point(w) - centre, normals[w]);
        (0..sums.len()).map(at).collect()
    };
    let all = job.map(Weights::ALL.len() * count, 1, of)?;
    let taken = taken(&all, count, diagonal(original));
    let settled = std::array::from_fn(|kind| {
        let own = taken.iter().enumerate().map(|(w, &i)| all[kind * count + i][w]);
        own.collect()
    });
    let own = |(i, regions): (usize, Regions)| -> Regions {
        let is_taken = |&w: &u32| taken[w as usize] == i;
        regions.into_iter().map(|w| w.filter(is_taken)).collect()
    };
    Ok((settled, alternatives.into_iter().enumerate().map(own).collect()))
}

/// Which of some alternatives each vertex of the suspect takes: all the first, or each the one of the others from which it is least off along the surface. Whichever of the two is less off
/// in the mean logarithm counts, by planes of whichever weights suit. All alternatives by the first weights come first, then all by the next.
fn taken(settled: &[AllSettled], alternatives: usize, diagonal: f64) -> Vec<usize> {
    let misfit = |settled: &Option<Settled>| {
        let misfit = settled.map_or(UNKNOWN, |settled| settled.misfit / diagonal);
        misfit.max(EXACT)
    };
    let least_of = |of_kind: &[AllSettled], from: Range<usize>| -> Option<(f64, Vec<usize>)> {
        let of_vertex = |w: usize| -> Option<(usize, f64)> {
            let misfits = from.clone().map(|i| (i, misfit(&of_kind[i][w])));
            misfits.min_by(|(_, a), (_, b)| a.total_cmp(b))
        };
        let taken = (0..of_kind[0].len()).map(of_vertex).collect::<Option<Vec<_>>>()?;
        let off = taken.iter().map(|(_, misfit)| misfit.ln()).sum();
        Some((off, taken.into_iter().map(|(i, _)| i).collect()))
    };
    let ways = settled.chunks(alternatives).flat_map(|of_kind| {
        let ranges = [0..1, 1..alternatives];
        ranges.into_iter().filter_map(|from| least_of(of_kind, from))
    });
    let least = ways.min_by(|(a, _), (b, _)| a.total_cmp(b));
    least.map_or_else(Vec::new, |(_, taken)| taken)
}

/// Whether vertices are less off from where draws have them by planes that weigh alike than by area, in the mean logarithm.
fn suit_planes_alike(overlay: Overlay<'_>, normals: &[Vec3], draws: &[Regions]) -> bool {
    let Overlay {
        original, suspect, ..
    } = overlay;
    let centre = Vec3(original.bounding_box().centre());
    let diagonal = diagonal(original);
    let [alike, by_area] = Weights::ALL.map(|weights| {
        let of_draw = |regions: &Regions| {
            let sums = weights.quadrics(original, centre, regions, suspect.vertex_count());
            let at = |w: usize| Settled::of(&sums[w], suspect.point(w) - centre, normals[w]);
            let off = |w: usize| at(w).map_or(UNKNOWN, |settled| settled.misfit / diagonal);
            (0..sums.len()).map(|w| off(w).max(EXACT).ln()).sum::<f64>()
        };
        draws.iter().take(JUDGES).map(of_draw).sum::<f64>()
    });
    alike <= by_area
}

/// How the vertices of a suspect follow the original's, by planes that weigh alike: those that weigh by area tell the same.
fn settling(overlay: Overlay<'_>, regions: Vec<Regions>, settled: &[Option<Settled>]) -> Settling {
    let Overlay { suspect, places, .. } = overlay;
    let lowest = |(w, settled): (usize, &Option<Settled>)| {
        let settled = settled.as_ref()?;
        Some(Lowest {
            point: suspect.point(w) + settled.way,
            inverse: settled.inverse?,
        })
    };
    let corners = |&(t, weights): &Place| (suspect.triangles()[t as usize], weights);
    Settling {
        places: places.iter().map(|place| place.as_ref().map(corners)).collect(),
        regions,
        lowest: settled.iter().enumerate().map(lowest).collect(),
    }
}

/// Rings of the suspect's triangles around what is asked for, whose regions end where they should only if those beyond are there.
const RINGS: usize = 2;

/// The places that have a part in the regions of vertices that are asked for.
fn around(suspect: &TriMesh, places: Vec<Option<Place>>, is_asked: &[bool]) -> Vec<Option<Place>> {
    if is_asked.iter().all(|&is_asked| is_asked) {
        return places;
    }
    let mut is_near = vec![false; suspect.triangle_count()];
    for (place, _) in places.iter().zip(is_asked).filter(|(_, is_asked)| **is_asked) {
        if let Some((t, _)) = place {
            is_near[*t as usize] = true;
        }
    }
    let mut is_corner = vec![false; suspect.vertex_count()];
    for _ in 0..RINGS {
        for (corners, _) in suspect
            .triangles()
            .iter()
            .zip(&is_near)
            .filter(|(_, is_near)| **is_near)
        {
            corners.iter().for_each(|&w| is_corner[w as usize] = true);
        }
        for (corners, is_near) in suspect.triangles().iter().zip(&mut is_near) {
            *is_near |= corners.iter().any(|&w| is_corner[w as usize]);
        }
    }
    let near = |place: Option<Place>| place.filter(|(t, _)| is_near[*t as usize]);
    places.into_iter().map(near).collect()
}

/// Whether the suspect has clearly fewer triangles than the original has where it was seen.
pub(super) fn is_coarser(original: &TriMesh, suspect: &TriMesh, registered: &Registered) -> bool {
    let is_seen = |corners: &&[u32; 3]| {
        corners
            .iter()
            .any(|&v| registered.positions[v as usize].is_some())
    };
    let seen = original.triangles().iter().filter(is_seen).count();
    (suspect.triangle_count() as f64) < COARSER * seen as f64
}

/// How much the plane of a triangle weighs.
#[derive(Clone, Copy)]
enum Weights {
    Alike,
    ByArea,
}

impl Weights {
    const ALL: [Self; 2] = [Self::Alike, Self::ByArea];

    /// Of each of so many regions of a mesh: those of the planes of the triangles around its vertices.
    fn quadrics(self, mesh: &TriMesh, centre: Vec3, regions: &[Option<u32>], count: usize) -> Vec<Quadric> {
        let mut quadrics = vec![Quadric::ZERO; count];
        for (t, corners) in mesh.triangles().iter().enumerate() {
            let regions = corners.map(|v| regions[v as usize]);
            if regions.iter().all(Option::is_none) {
                continue;
            }
            let [a, b, c] = mesh.corners(t).map(|p| p - centre);
            let normal = (b - a).cross(c - a);
            let normal = match self {
                Self::Alike => normal.unit(),
                Self::ByArea => normal.unit() * normal.norm().sqrt(),
            };
            let quadric = Quadric::of_plane(normal, normal.dot(a));
            let regions = regions.into_iter().flatten();
            regions.for_each(|region| quadrics[region as usize] += quadric);
        }
        quadrics
    }
}

/// Where a vertex of the suspect would be on the original.
#[derive(Clone, Copy)]
struct Settled {
    /// The way from where it is.
    way: Vec3,
    /// A⁻¹ of its quadric, held in its place along the surface.
    inverse: Option<[Vec3; 3]>,
    /// How far it is from the lowest point of its quadric, apart from its way along its normal: the root of what that costs to the quadric's weight.
    misfit: f64,
}

impl Settled {
    /// None where the quadric doesn't tell.
    fn of(quadric: &Quadric, place: Vec3, normal: Vec3) -> Option<Self> {
        let weight = quadric.weight();
        let across = Quadric::of_plane(normal, normal.dot(place));
        let held = |share: f64| *quadric + (Quadric::of_point(place, 1.0) + across * -1.0) * (share * weight);
        let firm = held(HOLD);
        let way = firm.minimum()? - place;
        let weak = held(WEAK_HOLD);
        let in_valley = place + normal * quadric.way_along(place, normal)?;
        let cost = (quadric.at(in_valley) - weak.at(weak.minimum()?)).max(0.0);
        Some(Self {
            way,
            inverse: firm.inverse(),
            misfit: (cost / weight).sqrt(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn off_by(misfits: [f64; 3]) -> AllSettled {
        let settled = misfits.map(|misfit| Settled {
            way: Vec3::ZERO,
            inverse: None,
            misfit,
        });
        settled.map(Some).to_vec()
    }

    #[test]
    fn vertices_take_all_the_first_or_each_the_best_of_the_others() {
        let again = [off_by([1e-3, 2e-3, 5e-3]), off_by([4e-3, 1e-4, 1e-3])];
        let far = vec![off_by([0.1; 3]); 3];
        let with = |first: [f64; 3]| vec![off_by(first), again[0].clone(), again[1].clone()];
        let of_two = |a: &[AllSettled], b: &[AllSettled]| taken(&[a, b].concat(), a.len(), 1.0);
        // The first is the best for one vertex, but not for all.
        assert_eq!(of_two(&with([5e-4, 0.1, 0.1]), &far), [1, 2, 2]);
        assert_eq!(of_two(&with([5e-4; 3]), &far), [1, 2, 2]);
        assert_eq!(of_two(&with([4e-4; 3]), &far), [0; 3]);
        // By whichever weights vertices are less off.
        assert_eq!(of_two(&far, &with([0.1; 3])), [1, 2, 2]);
        let mut lost = with([0.1; 3]);
        lost[1][0] = None;
        assert_eq!(of_two(&lost, &lost), [2, 2, 2]);
        let alone = [off_by([1e-3; 3])];
        assert_eq!(of_two(&alone, &alone), [0; 3]);
    }
}
