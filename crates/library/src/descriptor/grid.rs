//! Which points of a cloud lie near a place.

use mesh::Vec3;

/// Buckets of the table of cells; points of other cells that fall into the same are passed over.
const BUCKETS: usize = 1 << 13;

/// Points by cells as wide as the radius that is asked for.
#[derive(Debug)]
pub(crate) struct Grid {
    points: Vec<Vec3>,
    radius: f64,
    cells: Vec<[i32; 3]>,
    /// Where each bucket begins in `order`, and the end.
    starts: Vec<u32>,
    order: Vec<u32>,
}

impl Grid {
    pub(crate) fn new(points: Vec<Vec3>, radius: f64) -> Self {
        let cells: Vec<[i32; 3]> = points.iter().map(|&p| cell(p, radius)).collect();
        let mut starts = vec![0_u32; BUCKETS + 1];
        for &cell in &cells {
            starts[bucket(cell) + 1] += 1;
        }
        for i in 0..BUCKETS {
            starts[i + 1] += starts[i];
        }
        let mut next = starts.clone();
        let mut order = vec![0_u32; points.len()];
        for (i, &cell) in cells.iter().enumerate() {
            let place = &mut next[bucket(cell)];
            order[*place as usize] = i as u32;
            *place += 1;
        }
        Self {
            points,
            radius,
            cells,
            starts,
            order,
        }
    }

    /// Calls with every point within the radius, in an order that depends on the points alone.
    pub(crate) fn near(&self, p: Vec3, mut visit: impl FnMut(usize)) {
        let centre = cell(p, self.radius);
        let limit = self.radius * self.radius;
        for dx in -1..=1 {
            for dy in -1..=1 {
                for dz in -1..=1 {
                    let wanted = [
                        centre[0].saturating_add(dx),
                        centre[1].saturating_add(dy),
                        centre[2].saturating_add(dz),
                    ];
                    let bucket = bucket(wanted);
                    let range = self.starts[bucket] as usize..self.starts[bucket + 1] as usize;
                    for &i in &self.order[range] {
                        let i = i as usize;
                        if self.cells[i] == wanted && (self.points[i] - p).squared() <= limit {
                            visit(i);
                        }
                    }
                }
            }
        }
    }
}

fn cell(p: Vec3, radius: f64) -> [i32; 3] {
    p.0.map(|x| (x / radius).floor() as i32)
}

fn bucket([x, y, z]: [i32; 3]) -> usize {
    let hash = (x as u32).wrapping_mul(73_856_093)
        ^ (y as u32).wrapping_mul(19_349_663)
        ^ (z as u32).wrapping_mul(83_492_791);
    hash as usize % BUCKETS
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_points_near_a_place_are_those_within_the_radius(points in prop::collection::vec(prop::array::uniform3(-2.0..2.0_f64), 1..200), radius in 0.05..1.0_f64) {
            let points: Vec<Vec3> = points.into_iter().map(Vec3).collect();
            let grid = Grid::new(points.clone(), radius);
            let mut near = Vec::new();
            grid.near(points[0], |i| near.push(i));
            near.sort_unstable();
            let all: Vec<usize> = (0..points.len()).filter(|&i| (points[i] - points[0]).squared() <= radius * radius).collect();
            prop_assert_eq!(near, all);
        }
    }
}
