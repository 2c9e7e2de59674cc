use mesh::{BoundingBox, Vec3};

/// A grid whose cells know a sample of a surface about nearest to them: rough distances in constant time.
///
/// Distances are too long by the samples' spacing, and by up to a cell: fit to rank hypotheses and for their first
/// steps.
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
            origin: Vec3(bounds.min.map(|x| x - margin)),
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
        let middle = Vec3([0, 1, 2].map(|i| self.origin[i] + (place[i] as f64 + 0.5) * self.cell));
        let distance = |i: u32| (points[i as usize] - middle).squared();
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
