//! Which points of a cloud lie near a place.

use mesh::Vec3;

/// Cells at most, in all and to a point: most would be empty, and making them takes longer than a look at some points more.
const CELLS: usize = 1 << 16;
const CELLS_TO_A_POINT: usize = 8;

/// Points that are compared at a time.
const AT_ONCE: usize = 64;

/// Balls touch cells so many times their radius away.
const GENEROUS: f64 = 1.0 + 1e-9;

/// Points by cells at least as wide as the radius that is asked for.
#[derive(Debug)]
pub(crate) struct Grid {
    /// Cell by cell.
    points: Vec<Vec3>,
    numbers: Vec<u32>,
    radius: f64,
    least: Vec3,
    width: f64,
    /// Cells along each axis.
    counts: [usize; 3],
    /// Where the points of each cell begin, and the end.
    starts: Vec<u32>,
}

impl Grid {
    pub(crate) fn new(points: &[Vec3], radius: f64) -> Self {
        let corner = |pick: fn(f64, f64) -> f64, start: f64| {
            let of = |axis: usize| points.iter().fold(start, |m, p| pick(m, p.0[axis]));
            Vec3([of(0), of(1), of(2)])
        };
        let (least, most) = match points.is_empty() {
            true => (Vec3::ZERO, Vec3::ZERO),
            false => (
                corner(f64::min, f64::INFINITY),
                corner(f64::max, f64::NEG_INFINITY),
            ),
        };
        let extent = most - least;
        let cells = (CELLS_TO_A_POINT * points.len()).clamp(1, CELLS);
        let along = |width: f64| extent.0.map(|x| (x / width).min(CELLS as f64) as usize + 1);
        let mut width = radius;
        // A needle has cells wider than the radius.
        while along(width).iter().product::<usize>() > cells && width < f64::MAX / 2.0 {
            width *= 1.3;
        }
        let mut grid = Self {
            points: vec![Vec3::ZERO; points.len()],
            numbers: vec![0; points.len()],
            radius,
            least,
            width,
            counts: match extent.squared().is_finite() {
                true => along(width),
                false => [1; 3],
            },
            starts: Vec::new(),
        };
        let cells: Vec<usize> = points.iter().map(|&p| grid.cell_of(p)).collect();
        let mut starts = vec![0_u32; grid.counts.iter().product::<usize>() + 1];
        cells.iter().for_each(|&cell| starts[cell + 1] += 1);
        for i in 1..starts.len() {
            starts[i] += starts[i - 1];
        }
        let mut next = starts.clone();
        for (i, &cell) in cells.iter().enumerate() {
            let place = next[cell] as usize;
            (grid.points[place], grid.numbers[place]) = (points[i], i as u32);
            next[cell] += 1;
        }
        grid.starts = starts;
        grid
    }

    /// The cell of a point that is in the grid.
    fn cell_of(&self, p: Vec3) -> usize {
        let along = |axis: usize| {
            let place = (p.0[axis] - self.least.0[axis]) / self.width;
            (place as usize).min(self.counts[axis] - 1)
        };
        (along(2) * self.counts[1] + along(1)) * self.counts[0] + along(0)
    }

    /// Calls with every point within the radius, and its number, in an order that depends on the points alone.
    pub(crate) fn near(&self, p: Vec3, mut visit: impl FnMut(Vec3, usize)) {
        let limit = self.radius * self.radius;
        // Which of some points are near is written down first: nobody can foretell it, and a wrong guess takes longer than the rest.
        let mut near = [0_u8; AT_ONCE];
        self.in_cells(p, self.radius, |points, numbers| {
            for (points, numbers) in points.chunks(AT_ONCE).zip(numbers.chunks(AT_ONCE)) {
                let mut count = 0;
                for (k, &point) in points.iter().enumerate() {
                    near[count % AT_ONCE] = k as u8;
                    count += usize::from((point - p).squared() <= limit);
                }
                for &k in &near[..count] {
                    visit(points[usize::from(k)], numbers[usize::from(k)] as usize);
                }
            }
            false
        });
    }

    /// Whether something is true of any point within the radius.
    pub(crate) fn any_near(&self, p: Vec3, mut is_so: impl FnMut(usize) -> bool) -> bool {
        let limit = self.radius * self.radius;
        self.in_cells(p, self.radius, |points, numbers| {
            let mut near = points.iter().zip(numbers);
            near.any(|(&point, &number)| (point - p).squared() <= limit && is_so(number as usize))
        })
    }

    /// The nearest of the points that are asked for, less than `reach` away, which is at most the radius.
    pub(crate) fn nearest(&self, p: Vec3, reach: f64, is_asked: impl Fn(usize) -> bool) -> Option<usize> {
        let (mut least, mut nearest) = (reach * reach, None);
        self.in_cells(p, reach, |points, numbers| {
            for (&point, &number) in points.iter().zip(numbers) {
                let square = (point - p).squared();
                if square < least && is_asked(number as usize) {
                    (least, nearest) = (square, Some(number as usize));
                }
            }
            false
        });
        nearest
    }

    /// Hands over the points of all cells that a ball touches, row by row, until it is enough: whether it was.
    fn in_cells(&self, p: Vec3, radius: f64, mut is_enough: impl FnMut(&[Vec3], &[u32]) -> bool) -> bool {
        let [xs, ys, zs]: [[usize; 2]; 3] = std::array::from_fn(|axis| {
            let place = |x: f64| ((x - self.least.0[axis]) / self.width).floor();
            // Rounding may put a point on a cell's border into either.
            let (first, last) = (
                place(p.0[axis] - GENEROUS * radius),
                place(p.0[axis] + GENEROUS * radius),
            );
            let end = (last + 1.0).clamp(0.0, self.counts[axis] as f64) as usize;
            [(first.max(0.0) as usize).min(end), end]
        });
        if xs[0] == xs[1] {
            return false;
        }
        for z in zs[0]..zs[1] {
            for y in ys[0]..ys[1] {
                let row = (z * self.counts[1] + y) * self.counts[0];
                let range = self.starts[row + xs[0]] as usize..self.starts[row + xs[1]] as usize;
                if is_enough(&self.points[range.clone()], &self.numbers[range]) {
                    return true;
                }
            }
        }
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_points_near_a_place_are_those_within_the_radius(points in prop::collection::vec(prop::array::uniform3(-2.0..2.0_f64), 1..200), place in prop::array::uniform3(-3.0..3.0_f64), radius in 0.01..1.0_f64) {
            let points: Vec<Vec3> = points.into_iter().map(Vec3).collect();
            let grid = Grid::new(&points, radius);
            for place in [points[0], Vec3(place)] {
                let mut near = Vec::new();
                grid.near(place, |_, i| near.push(i));
                near.sort_unstable();
                let all: Vec<usize> = (0..points.len()).filter(|&i| (points[i] - place).squared() <= radius * radius).collect();
                prop_assert_eq!(near, all);
                let (reach, is_asked) = (0.7 * radius, |i: usize| !i.is_multiple_of(3));
                let asked = (0..points.len()).filter(|&i| is_asked(i) && (points[i] - place).squared() < reach * reach);
                let square = |i: usize| (points[i] - place).squared();
                let least = asked.map(square).min_by(f64::total_cmp);
                prop_assert_eq!(grid.nearest(place, reach, is_asked).map(square), least);
            }
        }
    }
}
