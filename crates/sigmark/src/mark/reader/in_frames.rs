//! Reading a suspect that was bent, dragged or posed, whatever did it: at its vertices, each seen from its own surroundings.

use std::ops::Range;

use job::Job;
use mesh::{TriMesh, Vec3};
use registration::{Correspondence, Degree, FrameOptions, LocalFrames, PreparedMesh, bearable};

use super::{Reading, ReadingMethod};
use crate::mark::{MarkError, MarkLayout, Patch, PatchBasis, Registered};

/// A suspect in local frames, those of each patch by themselves.
pub(super) struct InFrames {
    /// By the numbers of patches; none where nothing of a patch was seen.
    frames: Vec<Option<LocalFrames>>,
    /// The suspect as the frames leave it: each vertex of the original, and what it has beside it there.
    registered: Registered,
    /// The same for all vertices of which enough was seen to say whether they are the same shape, whether or not they are read.
    shape: Registered,
    /// Whether each vertex was stretched by little enough to be the same shape in another pose, #V; none where too little was seen around it.
    bearable: Vec<Option<bool>>,
}

/// How far surroundings go, in wavelengths of a patch's highest harmonic: what varies over much more is taken for the pose.
const REACH: f64 = 1.0;

/// And where that leaves too little of a mark, because few vertices lie so near to each other, or a bend is sharp. There cubics are fitted, which follow a bend farther.
const OTHER_REACHES: [f64; 3] = [1.5, 2.0, 3.0];

/// What is taken for noise whatever is seen, as a share of the squares of a mark.
const LEAST_NOISE: f64 = 0.1;

/// Squares of a mark to those of noise, beyond which nothing else is tried.
const ENOUGH: f64 = 1.0;

/// What frames tell is an estimate: others, the most alike first, are taken only if they tell so many times as much as those taken so far. By less than that they read worse as often as better.
const MUCH_MORE: f64 = 3.0;

/// Forces in a surface that was dragged are taken if they leave so many times as much of a mark's coefficients untold as other frames.
const FAR_LESS: f64 = 0.5;

/// They are not asked in patches of more vertices: there the shortest wave is twenty edges long, and from one vertex to the next little of it is left.
const MOST_VERTICES: usize = 20_000;

/// What lies beside parts that moved as a whole is read with them only if it is this share of a patch or more: of a few vertices nobody can say how far they are off.
const LEAST_ELSEWHERE: f64 = 0.1;

/// Of the maps that no similarity tells apart so many are tried: each takes as long as one.
const MOST_MAPS: usize = 8;

/// What is left by a similarity has to be so many times as large as a mark, or nothing was bent.
const MORE_THAN_A_MARK: f64 = 3.0;

/// And so many times as large as what it varies by from a vertex to its neighbours, or it is noise, of which that is larger than itself. Of low-poly models that were bent it is twice or thrice as large.
const SMOOTHER_THAN_NOISE: f64 = 1.5;

/// Whether a suspect lies beside its original, in the best pose, as if it was bent: by more than a mark, and nearly as its neighbours do. No bits are looked at.
pub(super) fn is_bent(layout: &MarkLayout, suspect: &PreparedMesh, map: &Correspondence) -> bool {
    let original = layout.original().mesh();
    let Ok(fit) = map.fit(original, suspect.mesh()) else {
        return false;
    };
    let beside: Vec<Option<Vec3>> = map
        .carry(suspect.mesh())
        .into_iter()
        .enumerate()
        .map(|(v, place)| Some(Vec3(fit.transform.apply(place?)) - original.point(v)))
        .collect();
    let (mut off, mut varying) = (Vec::new(), Vec::new());
    for &[a, b, c] in original.triangles() {
        if let [Some(a), Some(b), Some(c)] = [a, b, c].map(|v| beside[v as usize]) {
            off.push(a.norm());
            varying.push((a - (b + c) * 0.5).norm());
        }
    }
    if off.is_empty() {
        return false;
    }
    let off = median(off);
    let mark = layout.distortion_rms() * original.bounding_box().diagonal();
    off > MORE_THAN_A_MARK * mark && off > SMOOTHER_THAN_NOISE * median(varying)
}

/// A bit that follows no pattern.
fn any_bit(t: u64) -> bool {
    (t + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15).count_ones() % 2 == 1
}

/// The maps that stretch edges least, but for one scale, the least first. What was posed keeps lengths nearly; where triangles repeat, as those of a sphere that somebody sculpted, another map than the right one lays them on others. No
/// bits are looked at.
pub(super) fn least_stretching(
    original: &TriMesh,
    suspect: &TriMesh,
    maps: &[Correspondence],
) -> Vec<Correspondence> {
    let mut order: Vec<(f64, &Correspondence)> = maps
        .iter()
        .map(|map| (stretching(original, suspect, map), map))
        .collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0));
    order
        .into_iter()
        .take(MOST_MAPS)
        .map(|(_, map)| map.clone())
        .collect()
}

/// The mean of |ln (length there / length here)| less the median, over the edges of triangles; infinite where there is none.
fn stretching(original: &TriMesh, suspect: &TriMesh, map: &Correspondence) -> f64 {
    let quotient = |v: u32, w: u32| -> Option<f64> {
        let [there, other] = [v, w].map(|v| map.suspect_of[v as usize]);
        let there = (suspect.point(there? as usize) - suspect.point(other? as usize)).norm();
        let here = (original.point(v as usize) - original.point(w as usize)).norm();
        Some((there / here).ln()).filter(|quotient| quotient.is_finite())
    };
    let edges = original
        .triangles()
        .iter()
        .flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]);
    let quotients: Vec<f64> = edges.filter_map(|(v, w)| quotient(v, w)).collect();
    if quotients.is_empty() {
        return f64::INFINITY;
    }
    let median = median(quotients.iter().copied());
    let sum: f64 = quotients.iter().map(|quotient| (quotient - median).abs()).sum();
    sum / quotients.len() as f64
}

/// Bands of frequencies that are judged apart.
const BANDS: usize = 4;

/// A mark as it may be in a patch, whichever its bits are, per vertex.
struct AMark {
    whole: Vec<Vec3>,
    /// What it has of each band of frequencies, the lowest first.
    bands: [Vec<Vec3>; BANDS],
    vertices_a_harmonic: f64,
}

impl AMark {
    fn of(layout: &MarkLayout, index: usize, basis: &PatchBasis) -> Self {
        let bits: Vec<bool> = (0..layout.bits() as u64).map(any_bit).collect();
        let added = layout.modulation(index, &bits);
        let among = |frequencies: Range<usize>| -> Vec<Vec3> {
            let mut some = vec![[0.0; 3]; added.len()];
            some[frequencies.clone()].copy_from_slice(&added[frequencies]);
            basis.inverse_transform(&some).into_iter().map(Vec3).collect()
        };
        let start = |band: usize| band * added.len() / BANDS;
        let whole = among(0..added.len());
        Self {
            vertices_a_harmonic: whole.len() as f64 / added.len().max(1) as f64,
            whole,
            bands: std::array::from_fn(|band| among(start(band)..start(band + 1))),
        }
    }
}

/// A patch of a suspect whose vertices were found again.
struct SeenPatch<'a> {
    region: &'a TriMesh,
    places: Vec<Option<[f64; 3]>>,
    wavelength: f64,
    /// How large marks are, in the unit of positions.
    noise: f64,
}

/// A patch in frames of its own.
struct PatchInFrames {
    frames: LocalFrames,
    /// What each vertex has beside its surroundings, and how far these are stretched, whether or not it is read.
    beside: Vec<Option<Vec3>>,
    stretch: Vec<[f64; 2]>,
}

impl From<LocalFrames> for PatchInFrames {
    fn from(frames: LocalFrames) -> Self {
        Self {
            beside: frames.beside().to_vec(),
            stretch: frames.stretch().to_vec(),
            frames,
        }
    }
}

impl SeenPatch<'_> {
    fn options(&self, reach: f64, degree: Degree) -> FrameOptions {
        FrameOptions {
            reach: reach * self.wavelength,
            noise: self.noise,
            degree,
        }
    }

    /// In the frames that leave most of a mark, as it may be there, beside what else they leave.
    fn in_best_frames(&self, a_mark: &AMark) -> PatchInFrames {
        let usual = self.options(REACH, Degree::Quadratic);
        let first = LocalFrames::fit(self.region, &self.places, &usual);
        let (mut beside, mut stretch) = (first.beside().to_vec(), first.stretch().to_vec());
        let mut best = Judged::new(first, &a_mark.whole);
        if best.tells < ENOUGH {
            let parts = best.frames.of_parts(self.region, &self.places, &usual);
            for reach in OTHER_REACHES {
                let options = self.options(reach, Degree::Cubic);
                let frames = LocalFrames::fit(self.region, &self.places, &options);
                // Where too few vertices were near to say anything, more may.
                for (v, wider) in frames.stretch().iter().enumerate() {
                    if stretch[v][0] == 0.0 {
                        (beside[v], stretch[v]) = (frames.beside()[v], *wider);
                    }
                }
                best = best.or(Judged::new(frames, &a_mark.whole));
            }
            if a_mark.whole.len() <= MOST_VERTICES
                && let Some(elastic) = best.frames.of_elastic_surface(self.region, &self.places)
            {
                best = best.or_by_forces(Judged::new(elastic, &a_mark.whole), a_mark);
            }
            // What handles dragged looks as if it was pulled wherever it was turned by little.
            let parts = parts
                .into_iter()
                .filter(|parts| !(best.frames.is_elastic() && parts.is_part_hidden()))
                .map(|frames| best.with_parts(Judged::new(frames, &a_mark.whole), &a_mark.whole));
            if let Some(parts) = parts.max_by(|a, b| a.tells.total_cmp(&b.tells)) {
                best = best.or(parts);
            }
        }
        PatchInFrames {
            frames: best.frames,
            beside,
            stretch,
        }
    }
}

/// Frames, and how much they tell: the squares of what they leave of a mark beside those of what else they leave, as often as there are vertices.
struct Judged {
    frames: LocalFrames,
    told: Told,
    tells: f64,
}

impl Judged {
    fn new(frames: LocalFrames, a_mark: &[Vec3]) -> Self {
        let told = Told::by(&frames, a_mark, |_| true);
        Self {
            tells: told.alone(),
            frames,
            told,
        }
    }

    /// These, or others that tell much more.
    fn or(self, other: Self) -> Self {
        if other.tells > MUCH_MORE * self.tells {
            other
        } else {
            self
        }
    }

    /// These, or forces in a surface that was dragged, if they leave far less of a mark's coefficients untold. They see much of high frequencies and little of low ones, so that squares alone say too much of them.
    fn or_by_forces(self, forces: Self, a_mark: &AMark) -> Self {
        let untold = |judged: &Self| 1.0 - judged.told.coefficients(&judged.frames, a_mark);
        if untold(&forces) < FAR_LESS * untold(&self) {
            forces
        } else {
            self
        }
    }

    /// Others that see parts alone, elsewhere with these where that tells more.
    fn with_parts(&self, parts: Self, a_mark: &[Vec3]) -> Self {
        let elsewhere = Told::by(&self.frames, a_mark, |v| parts.frames.beside()[v].is_none());
        let tells = parts.told.with(&elsewhere);
        if tells > parts.tells && elsewhere.share > LEAST_ELSEWHERE {
            Self {
                frames: parts.frames.or_elsewhere(&self.frames),
                tells,
                ..parts
            }
        } else {
            parts
        }
    }
}

/// What frames tell at some vertices. That looks at no bits: it asks how large a mark would be, not whether it is there.
struct Told {
    /// The share of these vertices among all.
    share: f64,
    /// The squares of what is left of a mark there, and of what else is left: medians.
    of_mark: f64,
    beside_mark: f64,
    /// The latter, with what is always taken for noise.
    noise: f64,
}

impl Told {
    fn by(frames: &LocalFrames, a_mark: &[Vec3], is_asked: impl Fn(usize) -> bool) -> Self {
        let left = frames.left_of(a_mark);
        let seen: Vec<(Vec3, Vec3)> = frames
            .beside()
            .iter()
            .zip(left)
            .enumerate()
            .filter(|&(v, _)| is_asked(v))
            .filter_map(|(_, (beside, left))| Some(((*beside)?, left)))
            .collect();
        let of_mark = median(seen.iter().map(|(_, left)| left.squared()));
        let of_all = median(seen.iter().map(|(beside, _)| beside.squared()));
        let whole = median(a_mark.iter().map(|mark| mark.squared()));
        let beside_mark = (of_all - of_mark).max(0.0);
        let noise = beside_mark + LEAST_NOISE * whole;
        Self {
            share: seen.len() as f64 / a_mark.len().max(1) as f64,
            of_mark,
            beside_mark,
            noise: noise.max(f64::MIN_POSITIVE),
        }
    }

    /// About which share of a mark's coefficients frames tell: of each band of frequencies 1 − v, where v is the variance that observations leave to what had the variance 1.
    fn coefficients(&self, frames: &LocalFrames, a_mark: &AMark) -> f64 {
        let noise = (self.beside_mark + LEAST_NOISE * self.of_mark).max(f64::MIN_POSITIVE);
        let observations = self.share * a_mark.vertices_a_harmonic;
        let of_band = |band: &Vec<Vec3>| {
            let left = frames.left_of(band).into_iter().zip(frames.beside());
            let seen = left.filter(|(_, beside)| beside.is_some());
            let squares = BANDS as f64 * median(seen.map(|(left, _)| left.squared()));
            let told = observations * squares / noise;
            told / (1.0 + told)
        };
        a_mark.bands.iter().map(of_band).sum::<f64>() / BANDS as f64
    }

    /// The squares of the mark to those of the rest, as often as there are such vertices.
    fn alone(&self) -> f64 {
        self.share * self.of_mark / self.noise
    }

    /// The same of these vertices and others together, where least squares weigh all alike: (Σ m)² / Σ m n of marks m and noise n.
    fn with(&self, others: &Self) -> f64 {
        let marks = [self, others].map(|told| told.share * told.of_mark);
        let noise = marks[0] * self.noise + marks[1] * others.noise;
        marks.iter().sum::<f64>().powi(2) / noise.max(f64::MIN_POSITIVE)
    }
}

/// The middle one; 0 of none.
fn median(values: impl IntoIterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.into_iter().collect();
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

impl InFrames {
    /// A suspect under a map of its vertices.
    pub(super) fn of(
        layout: &MarkLayout,
        suspect: &PreparedMesh,
        map: &Correspondence,
        job: &Job,
    ) -> Result<Self, MarkError> {
        Self::seen(layout, Registered::by_vertices(map.carry(suspect.mesh())), job)
    }

    /// A suspect whose surface was brought back.
    pub(super) fn seen(layout: &MarkLayout, registered: Registered, job: &Job) -> Result<Self, MarkError> {
        let original = layout.original();
        let seen = &registered.positions;
        let fit = |index: usize, patch: &Patch, basis: &PatchBasis| {
            let functions = original.functions()[index].max(1) as f64;
            let seen = SeenPatch {
                region: patch.mesh(),
                places: patch.gather(seen),
                wavelength: (std::f64::consts::PI * patch.mesh().area() / functions).sqrt(),
                noise: layout.distortion_rms() * original.mesh().bounding_box().diagonal(),
            };
            let along = patch.gather(&registered.along);
            if along.iter().all(Option::is_none) {
                return (index, seen.in_best_frames(&AMark::of(layout, index, basis)));
            }
            let line = |v: usize| {
                let u = Vec3(along[v]?);
                Some((u, u.dot(Vec3(seen.places[v]?) - patch.mesh().point(v))))
            };
            let lines: Vec<Option<(Vec3, f64)>> = (0..along.len()).map(line).collect();
            let options = seen.options(REACH, Degree::Quadratic);
            let frames = LocalFrames::fit_along(patch.mesh(), &lines, &options);
            (index, frames.into())
        };
        let mut fitted: Vec<Option<PatchInFrames>> = Vec::new();
        fitted.resize_with(original.patches().len(), || None);
        for (index, patch) in layout.map_seen(seen, fit, job)? {
            fitted[index] = Some(patch);
        }
        let count = original.mesh().vertex_count();
        let (mut positions, mut of_shape) = (vec![None; count], vec![None; count]);
        let mut stretch = vec![[0.0; 2]; count];
        for (patch, fitted) in original.patches().iter().zip(&fitted) {
            let Some(fitted) = fitted else { continue };
            for (i, &v) in patch.vertices().iter().enumerate() {
                let v = v as usize;
                let place = |beside: Vec3| (original.mesh().point(v) + beside).into();
                positions[v] = fitted.frames.beside()[i].map(place);
                of_shape[v] = fitted.beside[i].map(place);
                stretch[v] = fitted.stretch[i];
            }
        }
        Ok(Self {
            frames: fitted.into_iter().map(|patch| Some(patch?.frames)).collect(),
            bearable: bearable(&stretch),
            shape: Registered::by_vertices(of_shape),
            registered: Registered {
                positions,
                ..registered
            },
        })
    }

    /// The bits by the joint estimate.
    pub(super) fn read(&self, method: &ReadingMethod, job: &Job) -> Result<Reading, MarkError> {
        let estimate = method
            .estimator()
            .estimate_in_frames(&self.registered, &self.frames, job)?;
        let reading = Reading::of(method.layout(), &self.shape, estimate.misalignment, &estimate);
        Ok(reading.where_it_is_one_shape(&self.bearable))
    }
}
