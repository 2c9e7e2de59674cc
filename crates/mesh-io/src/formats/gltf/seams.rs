//! Surfaces that meet though their files' numbers differ.

use std::collections::HashMap;

use mesh::Closed;

use crate::slots::binary::BinaryRun;

/// Moves vertices that the scene places differently, and that lie at the same point but for rounding, to the same position: then welding
/// joins them, and they move together.
pub(super) fn close(runs: &[BinaryRun], triangles: &[[u32; 3]], positions: &mut [[f64; 3]]) {
    let is_alike = |run: &BinaryRun| run.placement == runs[0].placement && run.types == runs[0].types;
    if runs.iter().all(is_alike) {
        return;
    }
    let mut is_used = vec![false; positions.len()];
    triangles
        .as_flattened()
        .iter()
        .for_each(|&v| is_used[v as usize] = true);
    let used = || (0..is_used.len()).filter(|&v| is_used[v]);
    let largest = used()
        .flat_map(|v| positions[v])
        .fold(0.0, |a: f64, x| a.max(x.abs()));
    let tolerance = Closed::PLACED * largest;
    if !(tolerance.is_normal() && largest.is_finite()) {
        return;
    }
    let used: Vec<usize> = used().collect();
    let cell = |p: [f64; 3]| p.map(|x| (x / (2.0 * tolerance)).floor() as i64);
    let mut first: HashMap<[i64; 3], Vec<usize>> = HashMap::new();
    for v in used {
        let own = positions[v];
        match near(own, tolerance)
            .into_iter()
            .flat_map(|p| first.get(&cell(p)).into_iter().flatten())
            .find(|&&w| {
                let other: [f64; 3] = positions[w];
                (0..3).all(|axis| (own[axis] - other[axis]).abs() <= tolerance)
            }) {
            Some(&w) => positions[v] = positions[w],
            None => first.entry(cell(own)).or_default().push(v),
        }
    }
}

/// The corners of the box around a point within which others count as the same.
fn near(point: [f64; 3], tolerance: f64) -> [[f64; 3]; 8] {
    std::array::from_fn(|corner| {
        std::array::from_fn(|axis| {
            point[axis]
                + if corner >> axis & 1 == 1 {
                    tolerance
                } else {
                    -tolerance
                }
        })
    })
}
