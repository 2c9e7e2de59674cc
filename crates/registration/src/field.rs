use crate::sampled::Sampled;
use crate::vector::{Vec3, squared, sub};
use mesh::{BoundingBox, Similarity};

/// A grid whose cells know a sample of a surface about nearest to them: rough distances in constant time.
///
/// Distances are too long by the samples' spacing, and by up to a cell: fit to rank guesses and for their
/// first steps.
pub(crate) struct Field {
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

impl Field {
    /// `diagonal` is that of the surface.
    pub(crate) fn of(points: &[Vec3], diagonal: f64) -> Self {
        let bounds = BoundingBox::of(points);
        let margin = MARGIN * diagonal;
        let longest = bounds.size().iter().fold(0.0_f64, |m, &s| m.max(s)) + 2.0 * margin;
        let cell = longest / CELLS;
        let size = bounds.size().map(|s| ((s + 2.0 * margin) / cell) as usize + 1);
        let nearest = vec![NONE; size[0] * size[1] * size[2]];
        let mut field = Self {
            origin: bounds.min.map(|x| x - margin),
            cell,
            size,
            nearest,
        };
        for (i, &p) in points.iter().enumerate() {
            if let Some(place) = field.place(p) {
                field.offer(points, place, i as u32);
            }
        }
        // Each sweep carries samples along one diagonal direction; two rounds reach everywhere.
        for sweep in 0..16 {
            field.sweep(points, [0, 1, 2].map(|axis| sweep >> axis & 1 == 1));
        }
        field
    }

    /// A sample near to `p`; none for points far outside.
    pub(crate) fn near(&self, p: Vec3) -> Option<usize> {
        let sample = self.nearest[self.index(self.place(p)?)];
        (sample != NONE).then_some(sample as usize)
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
    fn offer(&mut self, points: &[Vec3], place: [usize; 3], sample: u32) {
        if sample == NONE {
            return;
        }
        let middle: Vec3 = [0, 1, 2].map(|i| self.origin[i] + (place[i] as f64 + 0.5) * self.cell);
        let distance = |i: u32| squared(sub(points[i as usize], middle));
        let index = self.index(place);
        let known = self.nearest[index];
        if known == NONE || distance(sample) < distance(known) {
            self.nearest[index] = sample;
        }
    }

    /// Passes through all cells, along each axis backwards or forwards, and offers every cell what those
    /// before it have.
    fn sweep(&mut self, points: &[Vec3], backwards: [bool; 3]) {
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
                            self.offer(points, place, self.nearest[self.index(before)]);
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
    original: &Sampled,
    suspect: &Sampled,
    transform: &Similarity,
    tolerance: f64,
    samples: usize,
) -> f64 {
    let limit = tolerance * original.diagonal.min(transform.scale * suspect.diagonal);
    let inverse = transform.inverse();
    let share = |from: &Sampled, onto: &Sampled, transform: &Similarity, unit: f64| {
        let soft = |i: usize| {
            let near = onto.near(transform.apply(from.points[i]));
            near.map_or(0.0, |(_, distance)| {
                (1.0 - (distance * unit / limit).powi(2)).max(0.0)
            })
        };
        let picked = from.some(samples);
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
        let sampled = Sampled::of(&(&mesh).into(), 20_000).expect("a torus has area");
        for i in 0..500 {
            // Points spread over the bounding box.
            let place = [0.618, 0.755, 0.570].map(|step| (f64::from(i) * step).fract());
            let bounds = mesh.bounding_box();
            let p = [0, 1, 2].map(|axis| bounds.min[axis] + place[axis] * bounds.size()[axis]);
            let (_, rough) = sampled.near(p).expect("inside the box");
            let exact = sampled.surface.nearest(p).distance;
            assert!(
                rough >= exact && rough < exact + 0.03 * sampled.diagonal,
                "{rough} {exact}"
            );
        }
        assert!(sampled.near([100.0, 0.0, 0.0]).is_none());
    }
}
