//! Distances between surfaces (eq. 21).

use job::Job;
use mesh::{BoundingBox, Surface, TriMesh};
use serde::Serialize;

use crate::sampling::{Samples, sample};

use crate::{Figure, Measurement, Metric, Needs, QualityError, Side};

/// How surfaces are sampled.
#[derive(Clone, Debug, PartialEq)]
pub struct DistanceOptions {
    /// About the distance between neighbouring samples, as a fraction of the sampled mesh's diagonal, above 0 and at most 1. The
    /// paper's is 0.05 %.
    pub interval: f64,
}

impl Default for DistanceOptions {
    fn default() -> Self {
        Self { interval: 5e-4 }
    }
}

/// The distance d(p, M) of the points p of one surface from another, M, in figures. Lengths are in the meshes' unit.
///
/// Not symmetric: a surface that has lost a part is near to the whole, but the whole is not near to it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SurfaceDistance {
    /// √(1/|S| ∬ d(p, M)² dS): d_rmse of eq. 21.
    pub rmse: f64,
    /// 1/|S| ∬ d(p, M) dS.
    pub mean: f64,
    /// The greatest d(p, M) over samples and vertices: the forward Hausdorff distance, from below. The supremum over the
    /// surface is greater by less than the distance from a point to the nearest sample.
    pub maximum: f64,
    /// Where that is.
    pub farthest: [f64; 3],
    /// How many points were measured.
    pub samples: usize,
    /// |S|.
    pub area: f64,
    /// About the distance between neighbouring samples.
    pub interval: f64,
}

/// The distances both ways between a reference and another mesh.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SymmetricDistance {
    /// From the other mesh to the reference: d_rmse of a marked mesh is `forward.rmse`.
    pub forward: SurfaceDistance,
    /// From the reference to the other mesh.
    pub backward: SurfaceDistance,
    /// Diagonal of the reference's bounding box: what relative distances are fractions of.
    pub diagonal: f64,
}

impl SymmetricDistance {
    /// Measures both ways.
    ///
    /// # Errors
    /// As [`surface_distance`], with the mesh that is the reason.
    pub fn between(
        other: &TriMesh,
        reference: &TriMesh,
        options: &DistanceOptions,
        job: &Job,
    ) -> Result<Self, QualityError> {
        Ok(Self {
            forward: surface_distance(other, reference, options, &job.part(0.0, 0.5))
                .map_err(|error| error.of(Side::Other))?,
            backward: surface_distance(reference, other, options, &job.part(0.5, 1.0))
                .map_err(|error| error.of(Side::Reference))?,
            diagonal: reference.bounding_box().diagonal(),
        })
    }

    /// The symmetric Hausdorff distance: the greater of the two maxima.
    pub fn hausdorff(&self) -> f64 {
        self.forward.maximum.max(self.backward.maximum)
    }

    /// Maximum root mean square distance, the greater of the two d_rmse.
    ///
    /// The geometric measure of the LIRIS benchmark (Wang, Lavoué, Denis, Baskurt, He, *A benchmark for 3D mesh watermarking*,
    /// SMI 2010), which divides it by the diagonal of the bounding box.
    pub fn mrms(&self) -> f64 {
        self.forward.rmse.max(self.backward.rmse)
    }

    /// The mean of the two mean distances.
    pub fn mean(&self) -> f64 {
        0.5 * (self.forward.mean + self.backward.mean)
    }
}

/// More samples than this, or than there are triangles, are refused: at about 0.2 µs each they take hours.
const MOST_SAMPLES: f64 = 1e11;

/// Triangles that one task samples, or vertices that it measures; fixed, so that sums do not depend on the number of threads.
const CHUNK: usize = 512;

/// Samples that are measured together, and how wide the box of those of several triangles may be, in intervals.
const MOST_TOGETHER: usize = 32;
const WIDEST: f64 = 4.0;

/// Distances of the surface `from`, sampled, from the surface `to`.
///
/// Samples lie on the triangles of `from`, in rows, about an interval apart, each with the area that it stands for, so that
/// sums over samples are integrals over the surface; and, without area, at the vertices that triangles use. MeshLab's filter
/// and Metro (Cignoni, Rocchini, Scopigno 1998) draw samples at random with equal weights: as many give the same figures up to
/// chance. Takes 0.1 to 0.3 µs a sample.
///
/// ```
/// use job::Job;
/// use quality::{DistanceOptions, surface_distance};
/// let inner = mesh::shapes::cube(1.0);
/// let outer = mesh::shapes::translated(&mesh::shapes::cube(3.0), [-1.0; 3]);
/// let distance = surface_distance(&inner, &outer, &DistanceOptions::default(), &Job::new(2))?;
/// assert!((distance.rmse - 1.0).abs() < 1e-12 && (distance.maximum - 1.0).abs() < 1e-12);
/// # Ok::<(), quality::QualityError>(())
/// ```
///
/// # Errors
/// [`QualityError::Option`] and [`QualityError::TooManySamples`] of an interval that makes no sense,
/// [`QualityError::NoSurface`] if `from` has no area, [`QualityError::Job`].
pub fn surface_distance(
    from: &TriMesh,
    to: &TriMesh,
    options: &DistanceOptions,
    job: &Job,
) -> Result<SurfaceDistance, QualityError> {
    let interval = interval(from, options)?;
    let surface = Surface::new(to);
    let owners = owners(from);
    let measure = |triangles: std::ops::Range<usize>| {
        let (mut piece, mut batch) = (Samples::default(), Batch::new(&surface, interval));
        for t in triangles {
            for v in from.triangles()[t] {
                if owners[v as usize] == t as u32 {
                    piece.add_point(from.positions()[v as usize]);
                }
            }
            sample(from.corners(t), interval, &mut piece, &mut |piece| {
                batch.add(piece);
            });
        }
        batch.finish()
    };
    let chunks = job.map_chunks(from.triangle_count(), CHUNK, measure)?;
    let total = chunks.into_iter().fold(Sums::default(), Sums::plus);
    Ok(SurfaceDistance {
        rmse: (total.squares / total.area).sqrt(),
        mean: total.distances / total.area,
        maximum: total.maximum,
        farthest: total.farthest,
        samples: total.samples,
        area: total.area,
        interval,
    })
}

/// The interval in the mesh's unit.
fn interval(mesh: &TriMesh, options: &DistanceOptions) -> Result<f64, QualityError> {
    if !(options.interval > 0.0 && options.interval <= 1.0) {
        return Err(QualityError::Option {
            name: "interval",
            value: options.interval,
            range: "above 0 and at most 1",
        });
    }
    let area = mesh.area();
    if !area.is_normal() {
        return Err(QualityError::NoSurface { area });
    }
    let diagonal = mesh.bounding_box().diagonal();
    let interval = options.interval * diagonal;
    let samples = area / interval / interval;
    if samples.is_nan() || samples > MOST_SAMPLES {
        return Err(QualityError::TooManySamples {
            interval: options.interval,
            samples,
            least: (area / MOST_SAMPLES).sqrt() / diagonal,
        });
    }
    Ok(interval)
}

/// The first triangle of each vertex, which measures it; `u32::MAX` for a vertex that no triangle uses.
fn owners(mesh: &TriMesh) -> Vec<u32> {
    let mut owners = vec![u32::MAX; mesh.vertex_count()];
    for (t, triangle) in mesh.triangles().iter().enumerate() {
        for &v in triangle {
            let owner = &mut owners[v as usize];
            *owner = (*owner).min(t as u32);
        }
    }
    owners
}

/// Samples of triangles that follow each other, measured together while they lie close together. Sums don't depend on how they are grouped.
struct Batch<'a> {
    surface: &'a Surface,
    /// The longest side of the box of what is measured together.
    longest: f64,
    samples: Samples,
    bounds: BoundingBox,
    distances: Vec<f64>,
    sums: Sums,
}

impl<'a> Batch<'a> {
    fn new(surface: &'a Surface, interval: f64) -> Self {
        Self {
            surface,
            longest: WIDEST * interval,
            samples: Samples::default(),
            bounds: BoundingBox::EMPTY,
            distances: Vec::new(),
            sums: Sums::default(),
        }
    }

    fn add(&mut self, piece: &Samples) {
        let bounds = BoundingBox::of(&piece.points);
        let mut joint = self.bounds;
        joint.include(&bounds);
        let full = self.samples.points.len() + piece.points.len() > MOST_TOGETHER;
        let wide = joint.size().into_iter().any(|side| side > self.longest);
        if full || wide {
            self.measure();
            joint = bounds;
        }
        self.bounds = joint;
        self.samples.append(piece);
    }

    fn measure(&mut self) {
        self.distances.resize(self.samples.points.len(), 0.0);
        self.surface.distances(&self.samples.points, &mut self.distances);
        self.sums.add(&self.samples, &self.distances);
        self.samples.clear();
    }

    fn finish(mut self) -> Sums {
        self.measure();
        self.sums
    }
}

/// Weighted sums over samples.
#[derive(Default)]
struct Sums {
    squares: f64,
    distances: f64,
    area: f64,
    maximum: f64,
    farthest: [f64; 3],
    samples: usize,
}

impl Sums {
    fn add(&mut self, samples: &Samples, distances: &[f64]) {
        for ((&p, &w), &d) in samples.points.iter().zip(&samples.weights).zip(distances) {
            self.squares += w * d * d;
            self.distances += w * d;
            self.area += w;
            if d > self.maximum || self.samples == 0 {
                (self.maximum, self.farthest) = (d, p);
            }
            self.samples += 1;
        }
    }

    fn plus(self, other: Self) -> Self {
        let (maximum, farthest) = if other.maximum > self.maximum || self.samples == 0 {
            (other.maximum, other.farthest)
        } else {
            (self.maximum, self.farthest)
        };
        Self {
            squares: self.squares + other.squares,
            distances: self.distances + other.distances,
            area: self.area + other.area,
            maximum,
            farthest,
            samples: self.samples + other.samples,
        }
    }
}

/// The distance of each vertex of `from` from the surface of `to`, #V: what heat maps show.
///
/// # Errors
/// [`QualityError::Job`].
pub fn vertex_distances(from: &TriMesh, to: &TriMesh, job: &Job) -> Result<Vec<f64>, QualityError> {
    let surface = Surface::new(to);
    Ok(job.map_reported(from.vertex_count(), CHUNK, |v| {
        surface.nearest(from.positions()[v]).distance
    })?)
}

/// d_rmse (eq. 21), mean and greatest distance, and with both ways the Hausdorff distance and MRMS too, as fractions of the reference's
/// diagonal.
#[derive(Clone, Debug, PartialEq)]
pub struct DistanceMetric {
    /// How surfaces are sampled.
    pub options: DistanceOptions,
    /// Whether the way back, from the reference to the other mesh, is measured too.
    pub both_ways: bool,
}

impl Default for DistanceMetric {
    fn default() -> Self {
        Self {
            options: DistanceOptions::default(),
            both_ways: true,
        }
    }
}

impl Metric for DistanceMetric {
    fn name(&self) -> &'static str {
        "distance"
    }

    fn needs(&self) -> Needs {
        Needs::SamePlace
    }

    fn measure(&self, reference: &TriMesh, other: &TriMesh, job: &Job) -> Result<Measurement, QualityError> {
        let options = &self.options;
        let diagonal = reference.bounding_box().diagonal();
        let part = |length: f64| Figure::Number(length / diagonal);
        if !self.both_ways {
            let forward = surface_distance(other, reference, options, job);
            let forward = forward.map_err(|error| error.of(Side::Other))?;
            return Ok(Measurement::new([
                ("d_rmse", part(forward.rmse)),
                ("mean", part(forward.mean)),
                ("hausdorff_forward", part(forward.maximum)),
                ("samples", forward.samples.into()),
                ("interval", options.interval.into()),
            ]));
        }
        let both = SymmetricDistance::between(other, reference, options, job)?;
        let (forward, backward) = (both.forward, both.backward);
        Ok(Measurement::new([
            ("d_rmse", part(forward.rmse)),
            ("mean", part(forward.mean)),
            ("hausdorff_forward", part(forward.maximum)),
            ("hausdorff_backward", part(backward.maximum)),
            ("hausdorff", part(both.hausdorff())),
            ("rmse_backward", part(backward.rmse)),
            ("mean_backward", part(backward.mean)),
            ("mrms", part(both.mrms())),
            ("samples", [forward.samples, backward.samples].into()),
            ("interval", options.interval.into()),
        ]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mesh::{Similarity, shapes};
    use proptest::prelude::*;

    fn options(interval: f64) -> DistanceOptions {
        DistanceOptions { interval }
    }

    #[test]
    fn a_plate_over_a_plate_is_as_far_as_it_is_high_and_a_tilted_one_as_the_integral_says() {
        let floor = shapes::rectangle(5, 3, 4.0, 4.0);
        let height = 0.75;
        let lifted = shapes::translated(&shapes::rectangle(2, 7, 2.0, 2.0), [1.0, 1.0, height]);
        let distance = surface_distance(&lifted, &floor, &options(0.01), &Job::new(2)).unwrap();
        for figure in [distance.rmse, distance.mean, distance.maximum] {
            assert!((figure - height).abs() < 1e-12);
        }
        // z from 0 to 1 over a plate: the mean of z is 1/2, that of z² is 1/3.
        let tilted: Vec<[f64; 3]> = shapes::rectangle(4, 4, 1.0, 1.0)
            .positions()
            .iter()
            .map(|&[x, y, _]| [1.0 + x, 1.0 + y, x])
            .collect();
        let tilted = shapes::rectangle(4, 4, 1.0, 1.0).with_positions(tilted).unwrap();
        let distance = surface_distance(&tilted, &floor, &options(0.005), &Job::new(2)).unwrap();
        assert!((distance.mean - 0.5).abs() < 1e-12);
        assert!((distance.rmse - (1.0_f64 / 3.0).sqrt()).abs() < 1e-5);
        assert!((distance.maximum - 1.0).abs() < 1e-12);
        assert!((distance.area - 2.0_f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn a_part_is_near_to_the_whole_but_the_whole_is_not_near_to_the_part() {
        let whole = shapes::rectangle(8, 8, 2.0, 1.0);
        let part = shapes::rectangle(4, 8, 1.0, 1.0);
        let distance = SymmetricDistance::between(&part, &whole, &options(0.01), &Job::new(2)).unwrap();
        assert_eq!(distance.forward.maximum, 0.0);
        // The half without a partner is at most 1 away; its squares average to 1/3, over the whole to 1/6.
        assert!((distance.backward.maximum - 1.0).abs() < 1e-12);
        assert!((distance.mrms() - (1.0_f64 / 6.0).sqrt()).abs() < 1e-4);
        assert!((distance.mean() - 0.125).abs() < 1e-12);
        assert_eq!(distance.hausdorff(), 1.0);
        assert!((distance.diagonal - 5.0_f64.sqrt()).abs() < 1e-15);
    }

    #[test]
    fn results_do_not_depend_on_the_number_of_threads() {
        let (a, b) = (shapes::bumpy_sphere(4, 1), shapes::bumpy_sphere(4, 2));
        let by = |threads| surface_distance(&a, &b, &options(0.01), &Job::new(threads)).unwrap();
        assert_eq!(by(1), by(3));
    }

    #[test]
    fn intervals_that_make_no_sense_and_surfaces_without_area_are_refused() {
        let ball = shapes::icosphere(1);
        for interval in [0.0, -1.0, 1.5, f64::NAN] {
            assert!(matches!(
                surface_distance(&ball, &ball, &options(interval), &Job::new(2)),
                Err(QualityError::Option { .. })
            ));
        }
        let too_fine = surface_distance(&ball, &ball, &options(1e-9), &Job::new(2));
        assert!(matches!(too_fine, Err(QualityError::TooManySamples { .. })));
        let flat = TriMesh::new(vec![[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]], vec![[0, 1, 2]]).unwrap();
        assert!(matches!(
            surface_distance(&flat, &ball, &options(0.1), &Job::new(2)),
            Err(QualityError::NoSurface { .. })
        ));
        assert!(surface_distance(&ball, &flat, &options(0.1), &Job::new(2)).is_ok());
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        #[test]
        fn distances_do_not_change_when_both_surfaces_move_and_scale_with_both(seed in 0..9_u64, angles in prop::array::uniform4(-1.0..1.0_f64), scale in 0.01..100.0_f64) {
            let (a, b) = (shapes::bumpy_sphere(2, seed), shapes::bumpy_sphere(2, seed + 1));
            let moved = Similarity { scale, translation: [1.0, 2.0, 3.0], ..Similarity::from_quaternion(angles) };
            let before = SymmetricDistance::between(&a, &b, &options(0.02), &Job::new(2)).unwrap();
            let after = SymmetricDistance::between(&shapes::moved(&a, &moved), &shapes::moved(&b, &moved), &options(0.02), &Job::new(2)).unwrap();
            // The diagonal turns with the box, and the interval with it: the figures agree to the accuracy of the sampling.
            for (x, y) in [(before.mrms(), after.mrms()), (before.mean(), after.mean()), (before.hausdorff(), after.hausdorff())] {
                prop_assert!((y / scale - x).abs() < 0.02 * x, "{x} {}", y / scale);
            }
        }

        #[test]
        fn the_mean_is_below_the_root_mean_square_and_that_below_the_maximum(seed in any::<u64>()) {
            let (a, b) = (shapes::soup(6, seed), shapes::bumpy_sphere(1, seed));
            let d = surface_distance(&a, &b, &options(0.02), &Job::new(2)).unwrap();
            prop_assert!(d.mean <= d.rmse && d.rmse <= d.maximum);
            let itself = surface_distance(&a, &a, &options(0.02), &Job::new(2)).unwrap();
            prop_assert!(itself.maximum < 1e-14 * a.bounding_box().diagonal());
        }
    }
}
