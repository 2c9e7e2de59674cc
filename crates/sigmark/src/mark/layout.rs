use std::{ops::Range, sync::Arc};

use job::Job;
use mesh::{TriMesh, Vec3};
use sha2::{Digest, Sha256};

use super::{
    Chip, ChipPlan, MarkError, Original, Patch, PatchBasis, PatchRotation, Rotation, Strength,
    slivers::{level, turned_by_rounding, turns_many},
    strength::distortion,
};

/// Where a mark lies in an original, in which order, and how strong it is in each patch, whatever its bits are.
#[derive(Clone, Debug)]
pub struct MarkLayout {
    original: Arc<Original>,
    plan: ChipPlan,
    chips: Arc<[Vec<Chip>]>,
    rotation: Option<Arc<Rotation>>,
    alphas: Vec<f64>,
    /// The patches that are read, ascending.
    read: Arc<[usize]>,
}

impl MarkLayout {
    /// A mark with strength α for each patch, α belonging to unit area.
    ///
    /// # Errors
    /// [`MarkError::Patches`] when there is not one α a patch; [`MarkError::Room`].
    pub fn new(original: Arc<Original>, plan: ChipPlan, alphas: Vec<f64>) -> Result<Self, MarkError> {
        original.check_patches(alphas.len())?;
        Ok(Self {
            chips: plan.chips(original.functions())?.into(),
            rotation: plan.rotation(original.functions()).map(Arc::new),
            read: (0..alphas.len()).collect(),
            original,
            plan,
            alphas,
        })
    }

    /// The same mark, of which only some patches are read, numbered from 0 and ascending.
    pub(crate) fn among(&self, patches: &[usize]) -> Self {
        Self {
            read: patches.into(),
            ..self.clone()
        }
    }

    /// Whether each vertex of the original is of a patch that is read, #V.
    pub(crate) fn is_read(&self) -> Vec<bool> {
        let patches = self.original.patches();
        let mut is_read = vec![false; self.original.mesh().vertex_count()];
        for &patch in self.read.iter() {
            patches[patch]
                .vertices()
                .iter()
                .for_each(|&v| is_read[v as usize] = true);
        }
        is_read
    }

    /// A mark of a strength that was asked for.
    ///
    /// # Errors
    /// As [`new`](Self::new) and [`Strength::alphas`].
    pub fn with_strength(
        original: Arc<Original>,
        plan: ChipPlan,
        strength: Strength,
    ) -> Result<Self, MarkError> {
        let alphas = strength.alphas(&original, &plan)?;
        Self::new(original, plan, alphas)
    }

    /// Which bits are where.
    pub fn plan(&self) -> &ChipPlan {
        &self.plan
    }

    /// l, the number of bits.
    pub fn bits(&self) -> usize {
        self.plan.bits()
    }

    /// The chips of a patch, by its number from 0.
    pub fn chips(&self, patch: usize) -> &[Chip] {
        &self.chips[patch]
    }

    /// What spreads the chips of a patch over its harmonics; none where each sits on one.
    pub fn rotation(&self, patch: usize) -> Option<PatchRotation> {
        let rotation = self.rotation.as_ref()?;
        Some(PatchRotation::new(rotation, patch))
    }

    /// What bits add to the coefficients of a patch (eqs. 12, 13): α φ s″ of each chip along its axis, where need be through the [rotation](Rotation); m by 3.
    pub fn modulation(&self, patch: usize, bits: &[bool]) -> Vec<[f64; 3]> {
        let chips = self.chips(patch);
        let signs = chips.iter().map(|chip| if bits[chip.bit] { 1.0 } else { -1.0 });
        let signs: Vec<f64> = signs.collect();
        let spread = match self.rotation(patch) {
            Some(rotation) => rotation.coefficients(&signs),
            None => signs,
        };
        let amplitude = self.amplitude(patch);
        let mut added = vec![[0.0; 3]; self.original.functions()[patch]];
        for (chip, u) in chips.iter().zip(spread) {
            added[chip.frequency][chip.axis] = amplitude[chip.axis] * u;
        }
        added
    }

    /// What coefficients of a patch, m by 3, say of each of its chips: those that it sits on, or its part in those that the [rotation](Rotation) spreads it over.
    pub fn received(&self, patch: usize, coefficients: &[[f64; 3]]) -> Vec<f64> {
        let of_chip = |chip: &Chip| coefficients[chip.frequency][chip.axis];
        let received: Vec<f64> = self.chips(patch).iter().map(of_chip).collect();
        match self.rotation(patch) {
            Some(rotation) => rotation.chips(&received),
            None => received,
        }
    }

    /// How many chips there are in all.
    pub fn chip_count(&self) -> usize {
        self.chips.iter().map(Vec::len).sum()
    }

    /// α φ of a patch: what a chip adds to a coefficient along each axis.
    pub fn amplitude(&self, patch: usize) -> [f64; 3] {
        let size = self.plan.size(&self.original.patches()[patch]);
        size.map(|phi| self.alphas[patch] * phi)
    }

    /// The original with its patches.
    pub fn original(&self) -> &Arc<Original> {
        &self.original
    }

    /// α of each patch.
    pub fn alphas(&self) -> &[f64] {
        &self.alphas
    }

    /// α when it is the same for every patch, else its root mean square over the marked surface.
    pub fn alpha(&self) -> f64 {
        let areas = self.original.patches().iter().map(|patch| patch.mesh().area());
        let squares = areas.clone().zip(&self.alphas);
        let square: f64 = squares.map(|(area, alpha)| area * alpha * alpha).sum();
        (square / areas.sum::<f64>()).sqrt()
    }

    /// Root mean square displacement of the marked surface, as a fraction of the bounding box's diagonal.
    pub fn distortion_rms(&self) -> f64 {
        distortion(&self.original, &self.plan, &self.alphas)
    }

    /// T₀, the signal-to-noise ratio of the whole mark, if every vertex is found again and each of its coordinates is off by a uniform amount of up to
    /// so many of the bounding box's edges: T₀² = Σ n (α φ)² / σ² over the chips, of patches with n vertices.
    pub fn margin(&self, noise: f64) -> f64 {
        self.margin_of(noise, |_| [Kept::ALL; 3])
    }

    /// The same of a mark that was [levelled](Self::level_slivers): of what is left, with what is missing as noise.
    pub fn margin_levelled(&self, noise: f64, levelled: &Levelled) -> f64 {
        self.margin_of(noise, |patch| levelled.kept[patch])
    }

    fn margin_of(&self, noise: f64, kept: impl Fn(usize) -> [Kept; 3]) -> f64 {
        let edges = self.original.mesh().bounding_box().size();
        let of_patch = |(index, patch): (usize, &Patch)| -> f64 {
            let (amplitude, kept) = (self.amplitude(index), kept(index));
            let chips = self.chips[index].iter();
            let signal: f64 = chips
                .filter(|chip| edges[chip.axis] > 0.0)
                .map(|chip| {
                    let Kept { share, square } = kept[chip.axis];
                    let variance = (noise * edges[chip.axis]).powi(2) / 3.0 + square;
                    (share * amplitude[chip.axis]).powi(2) / variance
                })
                .sum();
            signal * patch.vertices().len() as f64
        };
        let patches = self.original.patches().iter().enumerate();
        patches.map(of_patch).sum::<f64>().sqrt()
    }

    /// Takes the mark back around triangles that it would turn by more than 15 degrees, which a shader would show. Where somebody chose a [strength](Strength) in figures and it turns more
    /// than one in fifty that far, it is left as it is.
    pub fn level_slivers(&self, written: &mut Written, strength: Strength) -> Levelled {
        let exact = written.displacement.clone();
        let mesh = self.original.mesh();
        if matches!(strength, Strength::Level(_)) || !turns_many(mesh, &exact) {
            level(mesh, &[], &mut written.displacement);
        }
        let pairs = written.displacement.iter().zip(&exact);
        let vertices = pairs.filter(|(now, before)| now != before).count();
        let mut taken = vec![[0.0; 3]; self.alphas.len()];
        let mut kept = vec![[Kept::ALL; 3]; self.alphas.len()];
        let patches = self.original.patches().iter().enumerate();
        for (index, patch) in patches.filter(|_| vertices > 0) {
            let field = |of: &[[f64; 3]]| patch.gather(of).into_iter().map(Vec3).collect::<Vec<_>>();
            let (whole, left) = (field(&exact), field(&written.displacement));
            taken[index] = apart(patch, &whole, &left);
            let (all, both) = (
                mean_products(patch, &whole, &whole),
                mean_products(patch, &whole, &left),
            );
            let remaining = mean_products(patch, &left, &left);
            for axis in (0..3).filter(|&axis| all[axis] > 0.0) {
                let share = both[axis] / all[axis];
                let square = (remaining[axis] - share * both[axis]).max(0.0);
                kept[index][axis] = Kept { share, square };
            }
        }
        Levelled {
            vertices,
            taken,
            kept,
        }
    }

    /// Takes the mark back around triangles that a file turns by more than 20 degrees, which holds `held` in place of the marked positions: they are so small that rounding turns them, and their
    /// corners stay where they were. Where they are more than one in fifty, the file is too coarse for the model, and nothing is done. Tells whether anything was, and adds what it took to `levelled`.
    pub fn level_rounded(&self, marked: &mut [[f64; 3]], held: &[[f64; 3]], levelled: &mut Levelled) -> bool {
        let mesh = self.original.mesh();
        let moved = |to: &[[f64; 3]]| -> Vec<[f64; 3]> {
            let pairs = to.iter().zip(mesh.positions());
            pairs.map(|(&to, &at)| (Vec3(to) - Vec3(at)).into()).collect()
        };
        let corners = turned_by_rounding(mesh, &moved(held));
        if corners.is_empty() {
            return false;
        }
        let before = moved(marked);
        let mut displacement = before.clone();
        level(mesh, &corners, &mut displacement);
        for (index, patch) in self.original.patches().iter().enumerate() {
            let field = |of: &[[f64; 3]]| patch.gather(of).into_iter().map(Vec3).collect::<Vec<_>>();
            let more = apart(patch, &field(&before), &field(&displacement));
            levelled.taken[index] = std::array::from_fn(|axis| levelled.taken[index][axis] + more[axis]);
        }
        let mut is_changed = false;
        for (v, (now, before)) in displacement.iter().zip(&before).enumerate() {
            if now != before {
                marked[v] = (mesh.point(v) + Vec3(*now)).into();
                is_changed = true;
            }
        }
        is_changed
    }

    /// What `f` makes of each patch that is read and of which something was seen.
    ///
    /// # Errors
    /// As [`Original::map_bases`].
    pub(crate) fn map_seen<T: Send, S>(
        &self,
        seen: &[Option<S>],
        f: impl Fn(usize, &Patch, &PatchBasis) -> T + Sync + Send,
        job: &Job,
    ) -> Result<Vec<T>, MarkError> {
        self.original.map_bases_of(&self.patches_seen(seen), f, job)
    }

    /// The patches that are read and of which something was seen.
    pub(crate) fn patches_seen<S>(&self, seen: &[Option<S>]) -> Vec<usize> {
        let patches = self.original.patches();
        let is_seen = |i: &usize| patches[*i].vertices().iter().any(|&v| seen[v as usize].is_some());
        self.read.iter().copied().filter(is_seen).collect()
    }

    /// Whether all patches are read.
    pub(crate) fn reads_all(&self) -> bool {
        self.read.len() == self.alphas.len()
    }

    /// The original with each of some marks of random bits, by their numbers, in the patches that are read and of which something was seen: what whoever decimated a copy may have had. None where bases are too
    /// large to be [kept](Original::keeps).
    pub(crate) fn likenesses<S>(
        &self,
        numbers: Range<usize>,
        seen: &[Option<S>],
        job: &Job,
    ) -> Result<Vec<TriMesh>, MarkError> {
        let (mesh, patches) = (self.original.mesh(), self.original.patches());
        let seen = self.patches_seen(seen);
        if !self.original.keeps(&seen) {
            return Ok(Vec::new());
        }
        let marks: Vec<Vec<bool>> = numbers.map(|i| random_bits(i, self.bits())).collect();
        let of_patch = |index: usize, _: &Patch, basis: &PatchBasis| -> Vec<_> {
            let marks = marks.iter().map(|bits| self.modulation(index, bits));
            marks.map(|added| basis.inverse_transform(&added)).collect()
        };
        let mut marked = vec![mesh.positions().to_vec(); marks.len()];
        let added = self.original.map_bases_of(&seen, of_patch, job)?;
        for (&patch, added) in seen.iter().zip(added) {
            for (marked, added) in marked.iter_mut().zip(added) {
                for (&v, added) in patches[patch].vertices().iter().zip(added) {
                    let marked = &mut marked[v as usize];
                    *marked = (Vec3(*marked) + Vec3(added)).into();
                }
            }
        }
        let meshes = marked
            .into_iter()
            .map(|positions| Ok(mesh.with_positions(positions)?));
        meshes.collect()
    }

    /// Writes bits (eq. 26).
    ///
    /// # Errors
    /// [`MarkError::Bits`]; as [`Original::map_bases`].
    pub fn write(&self, bits: &[bool], job: &Job) -> Result<Written, MarkError> {
        Ok(self.write_and(bits, |_, _| (), job)?.0)
    }

    /// As [`write`](Self::write), with what `f` makes of each patch and its basis.
    ///
    /// # Errors
    /// As [`write`](Self::write).
    pub(crate) fn write_and<T: Send>(
        &self,
        bits: &[bool],
        f: impl Fn(&Patch, &PatchBasis) -> T + Sync + Send,
        job: &Job,
    ) -> Result<(Written, Vec<T>), MarkError> {
        let (wanted, given) = (self.bits(), bits.len());
        if given != wanted {
            return Err(MarkError::Bits { given, wanted });
        }
        let of_patch = |index: usize, patch: &Patch, basis: &PatchBasis| {
            // Adding the reconstruction difference (eqs. 8, 14) to the modulated reconstruction leaves the original plus the
            // reconstruction of the modulation alone (eq. 26, Theorem 1).
            let added = basis.inverse_transform(&self.modulation(index, bits));
            (added, basis.last_eigenvalue(), f(patch, basis))
        };
        let mut written = Written {
            displacement: vec![[0.0; 3]; self.original.mesh().vertex_count()],
            last_eigenvalues: Vec::new(),
        };
        let mut made = Vec::with_capacity(self.alphas.len());
        let patches = self.original.map_bases(of_patch, job)?;
        for (patch, (added, eigenvalue, of_patch)) in self.original.patches().iter().zip(patches) {
            for (&v, value) in patch.vertices().iter().zip(added) {
                written.displacement[v as usize] = value;
            }
            written.last_eigenvalues.push(eigenvalue);
            made.push(of_patch);
        }
        Ok((written, made))
    }
}

/// So many bits, the same wherever they are drawn.
fn random_bits(draw: usize, count: usize) -> Vec<bool> {
    let hash = |i: usize| {
        let hash = Sha256::new_with_prefix(b"sigmark likeness\0");
        let hash = hash.chain_update((draw as u64).to_le_bytes());
        hash.chain_update((i as u64).to_le_bytes()).finalize()
    };
    let bytes = (0..count.div_ceil(256)).flat_map(hash);
    let bits = bytes.flat_map(|byte| (0..8).map(move |i| byte >> i & 1 == 1));
    bits.take(count).collect()
}

/// The mean product of two fields over a patch, along each axis, a vertex standing for a third of the triangles around it.
fn mean_products(patch: &Patch, one: &[Vec3], other: &[Vec3]) -> [f64; 3] {
    let mesh = patch.mesh();
    let mut sums = [0.0; 3];
    for (t, triangle) in mesh.triangles().iter().enumerate() {
        let third = mesh.triangle_area(t) / 3.0;
        for v in triangle.map(|v| v as usize) {
            for (axis, sum) in sums.iter_mut().enumerate() {
                *sum += third * one[v][axis] * other[v][axis];
            }
        }
    }
    sums.map(|sum| sum / mesh.area())
}

/// How far two fields over a patch are apart along each axis: the root mean square.
fn apart(patch: &Patch, one: &[Vec3], other: &[Vec3]) -> [f64; 3] {
    let difference: Vec<Vec3> = one.iter().zip(other).map(|(&one, &other)| one - other).collect();
    mean_products(patch, &difference, &difference).map(f64::sqrt)
}

/// What [levelling slivers](MarkLayout::level_slivers) changed.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Levelled {
    /// How many vertices are not where the mark alone would have them.
    pub vertices: usize,
    /// Of each patch along each axis, the root mean square of what it took: what is read of a chip changes by no more than that. Where that is much, which chips it took is only known
    /// by reading; what moves at few vertices spreads over all frequencies, of which chips have the fewest.
    pub taken: Vec<[f64; 3]>,
    /// Of each patch, along each axis.
    kept: Vec<[Kept; 3]>,
}

/// A levelled mark as a share of the whole one and what can't be told from noise: its projection onto it, and the mean square of the rest.
#[derive(Clone, Copy, Debug)]
struct Kept {
    share: f64,
    square: f64,
}

impl Kept {
    const ALL: Self = Self {
        share: 1.0,
        square: 0.0,
    };
}

/// A mark as it was written.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Written {
    /// What it adds to the positions of the whole mesh, #V; zero outside the patches.
    pub displacement: Vec<[f64; 3]>,
    /// [Of each patch's basis](PatchBasis::last_eigenvalue); who reads the mark [expects](Original::expecting) the same.
    pub last_eigenvalues: Vec<f64>,
}

impl Written {
    /// The marked positions, #V.
    pub fn positions(&self, original: &Original) -> Vec<[f64; 3]> {
        let pairs = original.mesh().positions().iter().zip(&self.displacement);
        pairs
            .map(|(p, d)| std::array::from_fn(|axis| p[axis] + d[axis]))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mark::Pool;
    use mesh::shapes;

    #[test]
    fn likenesses_have_as_large_a_mark_each_its_own() {
        let (mesh, bits, job) = (shapes::bumpy_sphere(4, 3), 64, Job::default());
        let original = Original::pooled(mesh, bits, Pool::default(), &job).unwrap();
        let plan = ChipPlan::pooled(bits, [1; 32]);
        let layout = MarkLayout::with_strength(original.into(), plan, Strength::default()).unwrap();
        let (original, seen) = (
            layout.original(),
            vec![Some(()); layout.original().mesh().vertex_count()],
        );
        assert!(layout.likenesses(0..2, &seen, &job).unwrap().is_empty());

        original.keep_a_gigabyte();
        let marked = layout.likenesses(0..2, &seen, &job).unwrap();
        let written: Vec<Written> = (0..2)
            .map(|draw| layout.write(&random_bits(draw, bits), &job).unwrap())
            .collect();
        assert_ne!(written[0].displacement, written[1].displacement);
        for (marked, written) in marked.iter().zip(&written) {
            assert_eq!(marked.positions(), written.positions(original));
        }
        let unseen = vec![None::<()>; seen.len()];
        let unmarked = layout.likenesses(0..1, &unseen, &job).unwrap().remove(0);
        assert_eq!(unmarked.positions(), original.mesh().positions());
    }

    #[test]
    fn random_bits_are_as_often_one_as_zero() {
        for draw in 0..4 {
            let bits = random_bits(draw, 2000);
            let ones = bits.iter().filter(|&&bit| bit).count();
            assert!(bits.len() == 2000 && ones.abs_diff(1000) < 112, "{ones}");
        }
    }
}
