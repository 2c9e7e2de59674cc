use crate::{TriMesh, Vec3};

impl TriMesh {
    /// Unit normals of the vertices, #V by 3: the normals of the triangles around, weighted by their angles there.
    ///
    /// They do not depend on how flat regions are triangulated (Thürmer and Wüthrich 1998). Zero where undefined: at
    /// vertices that have no triangle of non-zero area, or whose weighted normals cancel.
    pub fn vertex_normals(&self) -> Vec<[f64; 3]> {
        let mut normals = vec![Vec3::ZERO; self.vertex_count()];
        for (t, triangle) in self.triangles().iter().enumerate() {
            let p = self.corners(t);
            let normal = (p[1] - p[0]).cross(p[2] - p[0]).unit();
            for i in 0..3 {
                normals[triangle[i] as usize] += normal * angle(p[i], p[(i + 1) % 3], p[(i + 2) % 3]);
            }
        }
        // What rounding leaves of normals that cancel is no direction.
        let unit = |n: Vec3| if n.norm() > 1e-12 { n.unit() } else { Vec3::ZERO };
        normals.into_iter().map(|n| unit(n).into()).collect()
    }

    /// Unit normals of the triangles, #F by 3; zero for those without area.
    pub fn triangle_normals(&self) -> Vec<[f64; 3]> {
        let triangles = 0..self.triangle_count();
        triangles.map(|t| self.triangle_normal(t).into()).collect()
    }

    /// The unit normal of a triangle; zero if it has no area.
    pub fn triangle_normal(&self, triangle: usize) -> Vec3 {
        let [a, b, c] = self.corners(triangle);
        (b - a).cross(c - a).unit()
    }
}

/// The angle at `apex` between the directions to `p` and `q`, in radians; accurate for slivers, too.
fn angle(apex: Vec3, p: Vec3, q: Vec3) -> f64 {
    let (u, v) = (p - apex, q - apex);
    u.cross(v).norm().atan2(u.dot(v))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes;
    use proptest::prelude::*;

    fn close(a: [f64; 3], b: [f64; 3]) -> bool {
        (Vec3(a) - Vec3(b)).norm() < 1e-14
    }

    proptest! {
        #[test]
        fn the_normals_of_a_cube_do_not_depend_on_which_diagonals_cut_its_faces(cut in prop::array::uniform6(any::<bool>())) {
            let cube = shapes::cube(2.0);
            let mut triangles = cube.triangles().to_vec();
            for face in (0..6).filter(|&face| cut[face]) {
                let ([a, b, c], [_, _, d]) = (triangles[2 * face], triangles[2 * face + 1]);
                (triangles[2 * face], triangles[2 * face + 1]) = ([b, c, d], [b, d, a]);
            }
            let cube = TriMesh::new(cube.positions().to_vec(), triangles).unwrap();
            for (&normal, &p) in cube.vertex_normals().iter().zip(cube.positions()) {
                prop_assert!(close(normal, (Vec3(p) - Vec3([1.0; 3])).unit().into()));
            }
        }
    }

    #[test]
    fn normals_of_a_sphere_approach_its_radii_as_the_square_of_the_edge_length() {
        for level in 1..5 {
            let mesh = shapes::icosphere(level);
            let edge = 2.0 / f64::from(1 << level);
            for (&normal, &p) in mesh.vertex_normals().iter().zip(mesh.positions()) {
                assert!((Vec3(normal) - Vec3(p)).norm() < 0.5 * edge * edge);
            }
        }
    }

    #[test]
    fn normals_are_zero_where_they_are_undefined_and_unit_elsewhere() {
        let positions = vec![
            [0., 0., 0.],
            [1., 0., 0.],
            [2., 0., 0.],
            [5., 5., 5.],
            [0., 0., 1.],
            [0., 1., 1.],
            [1., 0., 1.],
        ];
        let line_and_both_sides = vec![[0, 1, 2], [4, 5, 6], [6, 5, 4]];
        let mesh = TriMesh::new(positions, line_and_both_sides).unwrap();
        assert_eq!(mesh.vertex_normals(), [[0.0; 3]; 7]);
        assert!(
            shapes::bumpy_torus(16, 8, 1)
                .vertex_normals()
                .iter()
                .all(|&n| (Vec3(n).norm() - 1.0).abs() < 1e-14)
        );
    }

    #[test]
    fn normals_of_tiny_and_huge_models_are_the_same() {
        let mesh = shapes::bumpy_sphere(2, 1);
        for s in [1e-29, 1e29] {
            let scaled = shapes::scaled(&mesh, s).vertex_normals();
            assert!(
                scaled
                    .iter()
                    .zip(mesh.vertex_normals())
                    .all(|(&a, b)| (Vec3(a) - Vec3(b)).norm() < 1e-12)
            );
        }
    }
}
