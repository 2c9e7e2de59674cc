//! Surfaces dragged by handles, as rigid as possible (Sorkine and Alexa 2007).

use evaluation::attacks::random_similarity;
use mesh::{
    TriMesh, Vec3,
    shapes::{self, turned},
};

/// So large a share of the length is held at either end.
const HELD: f64 = 0.1;

/// A model of which one end is held, along its longest side, and the other is turned by so many degrees about a line across the middle; moved, turned and scaled as a whole, its vertices in another order.
pub(super) fn posed(mesh: &TriMesh, degrees: f64, seed: u64) -> TriMesh {
    let bounds = mesh.bounding_box();
    let size = bounds.size();
    let longest = (0..3).fold(
        0,
        |longest, axis| if size[axis] > size[longest] { axis } else { longest },
    );
    let (mut across, centre) = (Vec3::ZERO, Vec3(bounds.centre()));
    across[(longest + 1) % 3] = degrees.to_radians();
    let held = |v: usize| {
        let p = mesh.point(v);
        let height = (p[longest] - bounds.min[longest]) / size[longest];
        let turned = || centre + turned(p - centre, across);
        if height < HELD {
            Some(p)
        } else {
            (height > 1.0 - HELD).then(turned)
        }
    };
    let held: Vec<Option<Vec3>> = (0..mesh.vertex_count()).map(held).collect();
    let posed = shapes::dragged(mesh, &held);
    shapes::shuffled(&shapes::moved(&posed, &random_similarity(&posed, seed)), seed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_end_stays_and_the_other_is_turned_and_edges_keep_their_lengths_nearly() {
        let mesh = shapes::bumpy_torus(48, 24, 1);
        let posed = posed(&mesh, 60.0, 1);
        let lengths = |mesh: &TriMesh| {
            let edges = mesh::Edges::of(mesh);
            let unit = mesh.area().sqrt();
            let length = |&[v, w]: &[u32; 2]| (mesh.point(v as usize) - mesh.point(w as usize)).norm() / unit;
            let mut lengths: Vec<f64> = edges.vertices().iter().map(length).collect();
            lengths.sort_by(f64::total_cmp);
            lengths
        };
        let pairs = lengths(&mesh).into_iter().zip(lengths(&posed));
        let off: Vec<f64> = pairs.map(|(a, b)| (b / a - 1.0).abs()).collect();
        assert!(off.iter().sum::<f64>() / (off.len() as f64) < 0.05);
    }
}
