use crate::sampled::Sampled;
use crate::vector::{Vec3, norm, squared, sub};
use mesh::{BoundingBox, Similarity};

/// A grid whose cells know a sample of a surface about nearest to them: rough distances in constant time.
///
/// Distances are too long by the samples' spacing, and by up to a cell: fit to rank guesses, not to refine
/// them.
pub(crate) struct Field<'a> {
    of: &'a Sampled,
    origin: Vec3,
    cell: f64,
    size: [usize; 3],
    nearest: Vec<u32>,
}

/// Cells along the longest side.
const CELLS: f64 = 64.0;

/// Space around the surface, as a fraction of the diagonal: points farther out count as far from it.
const MARGIN: f64 = 0.1;

const NONE: u32 = u32::MAX;

impl<'a> Field<'a> {
    pub(crate) fn of(of: &'a Sampled) -> Self {
        let bounds = BoundingBox::of(&of.points);
        let margin = MARGIN * of.diagonal;
        let longest = bounds.size().iter().fold(0.0_f64, |m, &s| m.max(s)) + 2.0 * margin;
        let cell = longest / CELLS;
        let size = bounds.size().map(|s| ((s + 2.0 * margin) / cell) as usize + 1);
        let nearest = vec![NONE; size[0] * size[1] * size[2]];
        let mut field = Self {
            of,
            origin: bounds.min.map(|x| x - margin),
            cell,
            size,
            nearest,
        };
        for (i, &p) in of.points.iter().enumerate() {
            if let Some(place) = field.place(p) {
                field.offer(place, i as u32);
            }
        }
        // Each sweep carries samples along one diagonal direction; two rounds reach everywhere.
        for sweep in 0..16 {
            field.sweep([0, 1, 2].map(|axis| sweep >> axis & 1 == 1));
        }
        field
    }

    /// A sample near to `p` and its distance; none for points far outside.
    pub(crate) fn near(&self, p: Vec3) -> Option<(usize, f64)> {
        let [x, y, z] = self.place(p)?;
        let sample = self.nearest[self.index([x, y, z])];
        (sample != NONE).then(|| (sample as usize, norm(sub(self.of.points[sample as usize], p))))
    }

    fn place(&self, p: Vec3) -> Option<[usize; 3]> {
        let mut place = [0; 3];
        for axis in 0..3 {
            let x = (p[axis] - self.origin[axis]) / self.cell;
            if !(x >= 0.0 && x < self.size[axis] as f64) {
                return None;
            }
            place[axis] = x as usize;
        }
        Some(place)
    }

    fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.size[1] + y) * self.size[0] + x
    }

    /// Gives a cell a sample, if it is nearer than what the cell has.
    fn offer(&mut self, place: [usize; 3], sample: u32) {
        if sample == NONE {
            return;
        }
        let middle: Vec3 = [0, 1, 2].map(|i| self.origin[i] + (place[i] as f64 + 0.5) * self.cell);
        let distance = |i: u32| squared(sub(self.of.points[i as usize], middle));
        let index = self.index(place);
        let known = self.nearest[index];
        if known == NONE || distance(sample) < distance(known) {
            self.nearest[index] = sample;
        }
    }

    /// Passes through all cells, along each axis backwards or forwards, and offers every cell what those
    /// before it have.
    fn sweep(&mut self, backwards: [bool; 3]) {
        let size = self.size;
        for k in 0..size[2] {
            for j in 0..size[1] {
                for i in 0..size[0] {
                    let step = [i, j, k];
                    let place = [0, 1, 2].map(|a| {
                        if backwards[a] {
                            size[a] - 1 - step[a]
                        } else {
                            step[a]
                        }
                    });
                    for axis in 0..3 {
                        if step[axis] > 0 {
                            let mut before = place;
                            before[axis] = if backwards[axis] {
                                place[axis] + 1
                            } else {
                                place[axis] - 1
                            };
                            self.offer(place, self.nearest[self.index(before)]);
                        }
                    }
                }
            }
        }
    }
}

/// A rough likeness of the score of [`Overlap`](crate::overlap::Overlap), for wide tolerances: `tolerance` is
/// a fraction of the smaller diagonal.
pub(crate) fn rough_score(
    original: &Field<'_>,
    suspect: &Field<'_>,
    transform: &Similarity,
    tolerance: f64,
    samples: usize,
) -> f64 {
    let limit = tolerance * original.of.diagonal.min(transform.scale * suspect.of.diagonal);
    let inverse = transform.inverse();
    let share = |from: &Field<'_>, onto: &Field<'_>, transform: &Similarity, unit: f64| {
        let soft = |i: usize| {
            let near = onto.near(transform.apply(from.of.points[i]));
            near.map_or(0.0, |(_, distance)| {
                (1.0 - (distance * unit / limit).powi(2)).max(0.0)
            })
        };
        let picked = from.of.some(samples);
        picked.clone().map(soft).sum::<f64>() / picked.count().max(1) as f64
    };
    share(suspect, original, transform, 1.0) + 0.25 * share(original, suspect, &inverse, transform.scale)
}

#[cfg(test)]
mod tests {
    use super::*;
    use mesh::shapes;

    #[test]
    fn rough_distances_are_near_the_true_ones() {
        let mesh = shapes::bumpy_torus(40, 24, 1);
        let sampled = Sampled::of(&mesh, "original", 20_000).expect("a torus has area");
        let field = Field::of(&sampled);
        for i in 0..500 {
            // Points spread over the bounding box.
            let place = [0.618, 0.755, 0.570].map(|step| (f64::from(i) * step).fract());
            let bounds = mesh.bounding_box();
            let p = [0, 1, 2].map(|axis| bounds.min[axis] + place[axis] * bounds.size()[axis]);
            let (_, rough) = field.near(p).expect("inside the box");
            let exact = sampled.surface.nearest(p).distance;
            assert!(
                rough >= exact && rough < exact + 0.03 * sampled.diagonal,
                "{rough} {exact}"
            );
        }
        assert!(field.near([100.0, 0.0, 0.0]).is_none());
    }
}
