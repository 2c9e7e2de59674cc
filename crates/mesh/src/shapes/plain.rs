use crate::{Edges, Similarity, TriMesh, Vec3, Welded};
use std::f64::consts::TAU;

/// Makes a mesh of what a shape has computed.
///
/// # Panics
/// When it is not a mesh: the shape was asked for with parameters that it does not support.
#[track_caller]
pub(super) fn built(positions: Vec<[f64; 3]>, triangles: Vec<[u32; 3]>) -> TriMesh {
    TriMesh::new(positions, triangles)
        .unwrap_or_else(|error| panic!("these parameters make no mesh: {error}"))
}

/// A regular tetrahedron with its corners at every other corner of the cube from −1 to 1.
pub fn tetrahedron() -> TriMesh {
    let corners = vec![[1., 1., 1.], [1., -1., -1.], [-1., 1., -1.], [-1., -1., 1.]];
    built(corners, vec![[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])
}

/// The cube from 0 to `side`; vertex i has coordinates by the bits of i, x first.
pub fn cube(side: f64) -> TriMesh {
    let corner = |i: usize| [0, 1, 2].map(|axis| if i >> axis & 1 == 1 { side } else { 0.0 });
    let faces = [
        [0, 4, 6, 2],
        [1, 3, 7, 5],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 2, 3, 1],
        [4, 5, 7, 6],
    ];
    let triangles = faces.into_iter().flat_map(halves);
    built((0..8).map(corner).collect(), triangles.collect())
}

/// The two triangles of a quadrilateral a, b, c, d, cut from a to c.
pub(super) fn halves([a, b, c, d]: [u32; 4]) -> [[u32; 3]; 2] {
    [[a, b, c], [a, c, d]]
}

/// The icosahedron with its triangles split in four `level` times, on the unit sphere.
pub fn icosphere(level: u32) -> TriMesh {
    (0..level).fold(icosahedron(), |mesh, _| split_in_four(&mesh, Vec3::unit))
}

fn icosahedron() -> TriMesh {
    let g = (1.0 + 5.0_f64.sqrt()) / 2.0;
    let corners = [[-1., g, 0.], [1., g, 0.], [-1., -g, 0.], [1., -g, 0.]];
    let cyclic = |turn: usize| corners.map(|p| std::array::from_fn(|axis| p[(axis + 3 - turn) % 3]));
    let positions: Vec<Vec3> = (0..3).flat_map(cyclic).map(|p| Vec3(p).unit()).collect();
    // The 20 triples of mutually nearest corners, each turned outward.
    let near = |a: usize, b: usize| positions[a].dot(positions[b]) > 0.4;
    let mut triangles = Vec::new();
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if near(a, b) && near(b, c) && near(c, a) {
                    let [p, q, r] = [a, b, c].map(|v| positions[v]);
                    let outward = p.dot(q.cross(r)) > 0.0;
                    triangles.push(if outward { [a, b, c] } else { [a, c, b] }.map(|v| v as u32));
                }
            }
        }
    }
    built(positions.into_iter().map(Into::into).collect(), triangles)
}

/// The mesh with every triangle split in four at the midpoints of its edges: the same surface. Vertices keep their indices, the midpoints
/// come behind them.
pub fn divided(mesh: &TriMesh) -> TriMesh {
    split_in_four(mesh, |sum| 0.5 * sum)
}

/// Splits every triangle in four; `between` is where a new vertex lies, of the sum of an edge's ends.
fn split_in_four(mesh: &TriMesh, between: impl Fn(Vec3) -> Vec3) -> TriMesh {
    let edges = Edges::of(mesh);
    let at = |v: u32| mesh.point(v as usize);
    let midpoint = |&[a, b]: &[u32; 2]| between(at(a) + at(b)).into();
    let midpoints = edges.vertices().iter().map(midpoint);
    let positions = mesh.positions().iter().copied().chain(midpoints).collect();
    let first_midpoint = mesh.vertex_count() as u32;
    let split = |(&[a, b, c], sides): (&[u32; 3], &[u32; 3])| {
        let [ab, bc, ca] = sides.map(|e| first_midpoint + e);
        [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]
    };
    let triangles = mesh.triangles().iter().zip(edges.of_triangle());
    built(positions, triangles.flat_map(split).collect())
}

/// A grid of nu by nv vertices over (u, v) in [0, 1]², closed in u and v as asked; quads cut along one diagonal.
fn grid(nu: u32, nv: u32, close_u: bool, close_v: bool, at: impl Fn(f64, f64) -> [f64; 3]) -> TriMesh {
    let columns = if close_u { nu } else { nu + 1 };
    let rows = if close_v { nv } else { nv + 1 };
    let index = |i: u32, j: u32| (j % rows) * columns + i % columns;
    let cells = (0..nv).flat_map(|j| (0..nu).map(move |i| (i, j)));
    let vertices = (0..rows).flat_map(|j| (0..columns).map(move |i| (i, j)));
    let quad = |(i, j)| halves([index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1)]);
    let place = |(i, j)| at(f64::from(i) / f64::from(nu), f64::from(j) / f64::from(nv));
    built(vertices.map(place).collect(), cells.flat_map(quad).collect())
}

/// The rectangle from (0, 0, 0) to (width, height, 0), facing +z, in nx by ny cells cut along their rising diagonals.
/// Vertex (i, j) has index j (nx + 1) + i.
pub fn rectangle(nx: u32, ny: u32, width: f64, height: f64) -> TriMesh {
    grid(nx, ny, false, false, |u, v| [u * width, v * height, 0.0])
}

/// A torus around the z axis, `nu` ≥ 3 vertices around the ring of radius R = `ring` and `nv` ≥ 3 around the tube of
/// radius r = `tube` < R.
pub fn torus(nu: u32, nv: u32, ring: f64, tube: f64) -> TriMesh {
    grid(nu, nv, true, true, |u, v| {
        let ((sin_u, cos_u), (sin_v, cos_v)) = ((TAU * u).sin_cos(), (TAU * v).sin_cos());
        let distance = ring + tube * cos_v;
        [distance * cos_u, distance * sin_u, tube * sin_v]
    })
}

/// A tube around the z axis without caps, from z = 0 to `height`, facing outward: `nu` ≥ 3 vertices around, `nz` cells high.
pub fn cylinder(nu: u32, nz: u32, radius: f64, height: f64) -> TriMesh {
    grid(nu, nz, true, false, |u, v| {
        [radius * (TAU * u).cos(), radius * (TAU * u).sin(), height * v]
    })
}

/// A Möbius strip of width ½ around the unit circle, of n ≥ 3 cells.
pub fn moebius_strip(n: u32) -> TriMesh {
    let at = |i: u32, side: f64| {
        let angle = TAU * f64::from(i) / f64::from(n);
        let (across, up) = (
            0.25 * side * (angle / 2.0).cos(),
            0.25 * side * (angle / 2.0).sin(),
        );
        [(1.0 + across) * angle.cos(), (1.0 + across) * angle.sin(), up]
    };
    let quad = |i: u32| {
        let (a, b) = (2 * i, 2 * i + 1);
        let (c, d) = if i + 1 == n { (1, 0) } else { (a + 2, b + 2) };
        halves([a, c, d, b])
    };
    let positions = (0..n).flat_map(|i| [at(i, -1.0), at(i, 1.0)]).collect();
    built(positions, (0..n).flat_map(quad).collect())
}

/// Square pages of side 1 that share the edge from the origin to (0, 0, 1); not a manifold from three pages on.
pub fn book(pages: u32) -> TriMesh {
    let mut positions = vec![[0.0; 3], [0.0, 0.0, 1.0]];
    let mut triangles = Vec::new();
    for page in 0..pages {
        let (sin, cos) = (TAU * f64::from(page) / f64::from(pages)).sin_cos();
        let outer = 2 + 2 * page;
        positions.extend([[cos, sin, 0.0], [cos, sin, 1.0]]);
        triangles.extend(halves([0, outer, outer + 1, 1]));
    }
    built(positions, triangles)
}

/// A flat strip in z = 0 of `n` rectangles, 1 long and tan(`angle`) thin, each cut in two slivers: right triangles whose
/// smallest angle is `angle`, in radians.
pub fn book_of_slivers(n: u32, angle: f64) -> TriMesh {
    rectangle(1, n, 1.0, f64::from(n) * angle.tan())
}

/// Many meshes in one, side by side in the lists of vertices and triangles.
pub fn disjoint_union(meshes: &[TriMesh]) -> TriMesh {
    let mut positions = Vec::new();
    let mut triangles = Vec::new();
    for mesh in meshes {
        let first = positions.len() as u32;
        positions.extend_from_slice(mesh.positions());
        triangles.extend(mesh.triangles().iter().map(|t| t.map(|v| first + v)));
    }
    built(positions, triangles)
}

/// The mesh after a similarity transform. One that mirrors also turns the triangles, so that they face as before.
pub fn moved(mesh: &TriMesh, transform: &Similarity) -> TriMesh {
    let turn = |&[a, b, c]: &[u32; 3]| if transform.mirrors() { [a, c, b] } else { [a, b, c] };
    let triangles = mesh.triangles().iter().map(turn).collect();
    built(transform.apply_all(mesh.positions()), triangles)
}

/// The mesh `s` times as large.
pub fn scaled(mesh: &TriMesh, s: f64) -> TriMesh {
    moved(
        mesh,
        &Similarity {
            scale: s,
            ..Similarity::IDENTITY
        },
    )
}

/// The mesh moved by `offset`.
pub fn translated(mesh: &TriMesh, offset: [f64; 3]) -> TriMesh {
    moved(
        mesh,
        &Similarity {
            translation: offset,
            ..Similarity::IDENTITY
        },
    )
}

/// The mesh in a mirror, x ↦ −x, facing as before.
pub fn mirrored(mesh: &TriMesh) -> TriMesh {
    moved(
        mesh,
        &Similarity {
            rotation: [[-1., 0., 0.], [0., 1., 0.], [0., 0., 1.]],
            ..Similarity::IDENTITY
        },
    )
}

/// The mesh with every triangle turned over.
pub fn inside_out(mesh: &TriMesh) -> TriMesh {
    let triangles = mesh.triangles().iter().map(|&[a, b, c]| [a, c, b]);
    built(mesh.positions().to_vec(), triangles.collect())
}

/// The mesh with a copy of its own of every corner of every triangle, as STL files have it; welding undoes it.
pub fn exploded(mesh: &TriMesh) -> TriMesh {
    let corners = mesh.triangles().as_flattened().iter();
    let positions = corners.map(|&v| mesh.positions()[v as usize]).collect();
    let triangles = (0..mesh.triangle_count() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]);
    built(positions, triangles.collect())
}

/// A block of (2 `holes` + 1) × 3 × 1 unit cubes with `holes` square holes through it: a closed surface of that genus, each
/// unit square of it in `resolution`² cells.
pub fn block(holes: u32, resolution: u32) -> TriMesh {
    let n = resolution as i64;
    let length = 2 * i64::from(holes) + 1;
    let solid = |[x, y, z]: [i64; 3]| {
        (0..length).contains(&x) && (0..3).contains(&y) && z == 0 && !(y == 1 && x % 2 == 1)
    };
    let mut positions = Vec::new();
    let mut triangles = Vec::new();
    let mut square = |corner: [i64; 3], u: usize, v: usize| {
        for cell in 0..n * n {
            let quad = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(du, dv)| {
                let mut p = corner.map(|x| x * n);
                p[u] += cell % n + du;
                p[v] += cell / n + dv;
                positions.push(p.map(|x| x as f64 / n as f64));
                positions.len() as u32 - 1
            });
            triangles.extend(halves(quad));
        }
    };
    for cube in (0..length)
        .flat_map(|x| (0..3).map(move |y| [x, y, 0]))
        .filter(|&cube| solid(cube))
    {
        for axis in 0..3 {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let beside = |step: i64| {
                let mut next = cube;
                next[axis] += step;
                next
            };
            if !solid(beside(1)) {
                square(beside(1), u, v);
            }
            if !solid(beside(-1)) {
                square(cube, v, u);
            }
        }
    }
    match Welded::new(&positions, &triangles) {
        Ok(welded) => welded.into_mesh(),
        Err(error) => panic!("these parameters make no mesh: {error}"),
    }
}
