use crate::TriMesh;
use crate::vector::{add, cross, dot, norm, scale, sub, unit};

/// See [`TriMesh::vertex_normals`].
pub(crate) fn vertex_normals(mesh: &TriMesh) -> Vec<[f64; 3]> {
    let mut normals = vec![[0.0; 3]; mesh.vertex_count()];
    for (t, triangle) in mesh.triangles().iter().enumerate() {
        let p = mesh.corners(t);
        let normal = unit(cross(sub(p[1], p[0]), sub(p[2], p[0])));
        for i in 0..3 {
            let n = &mut normals[triangle[i] as usize];
            *n = add(*n, scale(angle(p[i], p[(i + 1) % 3], p[(i + 2) % 3]), normal));
        }
    }
    // What rounding leaves of normals that cancel is no direction.
    normals
        .into_iter()
        .map(|n| if norm(n) > 1e-12 { unit(n) } else { [0.0; 3] })
        .collect()
}

/// The angle at `apex` between the directions to `p` and `q`, in radians; accurate for slivers, too.
pub(crate) fn angle(apex: [f64; 3], p: [f64; 3], q: [f64; 3]) -> f64 {
    let (u, v) = (sub(p, apex), sub(q, apex));
    norm(cross(u, v)).atan2(dot(u, v))
}
