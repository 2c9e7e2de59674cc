use crate::boundary::boundary_curves;
use crate::union_find::UnionFind;
use crate::{BoundingBox, Edges, TriMesh, WeldSummary, Welded, components};
use std::fmt;

/// Everything there is to say about how a mesh hangs together, and its size.
///
/// Vertices that no triangle uses count in `unused_vertices` and nowhere else. Lengths are in the model's unit, areas in
/// its square, volumes in its cube. Serialises to one object; `Display` shows it to people.
///
/// ```
/// let report = mesh::TopologyReport::of(&mesh::shapes::torus(12, 8, 2.0, 0.5));
/// assert_eq!((report.euler_characteristic, report.genus), (0, Some(1)));
/// assert!(report.closed && report.remarks().is_empty());
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct TopologyReport {
    /// What welding did to the file's geometry; absent when the report is of a bare [`TriMesh`].
    pub welding: Option<WeldSummary>,
    /// #V: vertices that triangles use.
    pub vertices: usize,
    /// #E.
    pub edges: usize,
    /// #F.
    pub triangles: usize,
    /// Vertices that no triangle uses (none after welding).
    pub unused_vertices: usize,
    /// Parts that no path of edges joins.
    pub components: usize,
    /// Edges with one triangle.
    pub boundary_edges: usize,
    /// Curves that these edges form.
    pub boundary_loops: usize,
    /// Edges with three triangles or more.
    pub non_manifold_edges: usize,
    /// Vertices whose triangles, joined across edges, form more than one fan.
    pub non_manifold_vertices: usize,
    /// Whether there are neither non-manifold edges nor vertices.
    pub manifold: bool,
    /// Whether every edge has exactly two triangles.
    pub closed: bool,
    /// Edges whose two triangles run along them in the same direction, so that one faces the other way.
    pub inconsistent_edges: usize,
    /// Whether triangles can be turned so that `inconsistent_edges` becomes zero; false of a Möbius strip.
    pub orientable: bool,
    /// Which way the triangles of a closed, consistently oriented mesh face as a whole, by its volume's sign.
    pub facing: Option<Facing>,
    /// χ = #V − #E + #F.
    pub euler_characteristic: i64,
    /// Handles of one connected, orientable manifold, (2 − χ − boundary loops) / 2; absent where that is not defined.
    pub genus: Option<u64>,
    /// Triangles over the same three vertices as an earlier one.
    pub duplicated_triangles: usize,
    /// Triangles of no area: at most [`DEGENERATE_AREA`] of the longest edge squared.
    pub degenerate_triangles: usize,
    /// Sum of the triangles' areas.
    pub area: f64,
    /// Enclosed volume, where `facing` is known; positive.
    pub volume: Option<f64>,
    /// The smallest axis-aligned box around the used vertices.
    pub bounding_box: BoundingBox,
    /// Length of that box's diagonal.
    pub diagonal: f64,
    /// Shortest edge.
    pub shortest_edge: f64,
    /// Mean length of the edges.
    pub mean_edge: f64,
    /// Longest edge.
    pub longest_edge: f64,
}

/// Which side the triangles of a closed surface turn counter-clockwise to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum Facing {
    /// Outward, as is usual: positive volume.
    Outward,
    /// Inward: negative volume.
    Inward,
}

/// The area of a triangle, relative to its longest edge squared, up to which it counts as degenerate.
pub const DEGENERATE_AREA: f64 = 1e-12;

impl TopologyReport {
    /// Reports on a mesh as it is indexed: copies of a vertex at one position are different vertices.
    ///
    /// O(#V + #F) time, apart from sorting the triangles.
    pub fn of(mesh: &TriMesh) -> Self {
        let edges = Edges::of(mesh);
        let counts = (0..edges.count()).map(|e| edges.triangles(e).len());
        let with = |wanted: fn(&usize) -> bool| counts.clone().filter(wanted).count();
        let (boundary_edges, non_manifold_edges) = (with(|count| *count == 1), with(|count| *count > 2));
        let non_manifold_vertices = vertices_with_several_fans(mesh, &edges);
        let (inconsistent_edges, orientable) = orientation(mesh, &edges);
        let boundary_loops = boundary_curves(mesh, &edges);
        let is_used = mesh.used_vertices();
        let used = mesh.positions().iter().zip(is_used).filter(|(_, used)| *used);
        let used: Vec<[f64; 3]> = used.map(|(&p, _)| p).collect();
        let unused_vertices = mesh.vertex_count() - used.len();
        let bounding_box = BoundingBox::of(&used);
        let [shortest_edge, mean_edge, longest_edge] = edge_lengths(mesh, &edges);

        let components = components(mesh).count - unused_vertices;
        let euler_characteristic = used.len() as i64 - edges.count() as i64 + mesh.triangle_count() as i64;
        let manifold = non_manifold_edges == 0 && non_manifold_vertices == 0;
        let closed = boundary_edges == 0 && non_manifold_edges == 0;
        let genus = (manifold && orientable && components == 1)
            .then(|| (2 - euler_characteristic - boundary_loops as i64) as u64 / 2);
        let volume = (closed && inconsistent_edges == 0).then(|| mesh.signed_volume());

        Self {
            welding: None,
            vertices: used.len(),
            edges: edges.count(),
            triangles: mesh.triangle_count(),
            unused_vertices,
            components,
            boundary_edges,
            boundary_loops,
            non_manifold_edges,
            non_manifold_vertices,
            manifold,
            closed,
            inconsistent_edges,
            orientable,
            facing: volume.map(|v| if v < 0.0 { Facing::Inward } else { Facing::Outward }),
            euler_characteristic,
            genus,
            duplicated_triangles: duplicated_triangles(mesh),
            degenerate_triangles: (0..mesh.triangle_count())
                .filter(|&t| is_degenerate(mesh, t))
                .count(),
            area: mesh.area(),
            volume: volume.map(f64::abs),
            bounding_box,
            diagonal: bounding_box.diagonal(),
            shortest_edge,
            mean_edge,
            longest_edge,
        }
    }

    /// Reports on a welded surface, and on what welding did.
    pub fn of_welded(welded: &Welded) -> Self {
        Self {
            welding: Some(welded.summary()),
            ..Self::of(welded.mesh())
        }
    }

    /// What is unusual about the mesh, and what it means for someone who works with it: one sentence each.
    pub fn remarks(&self) -> Vec<String> {
        let several = if self.components > 1 { self.components } else { 0 };
        let inside_out = usize::from(self.facing == Some(Facing::Inward));
        let (strays, dropped) = self
            .welding
            .map_or((0, 0), |w| (w.unused_vertices, w.dropped_triangles));
        let opposite = if self.orientable {
            "normals are unreliable there; reorient the faces in a mesh editor"
        } else {
            "the surface has one side only, so normals cannot be made consistent"
        };
        let remarks = [
            (
                several,
                "component",
                "components",
                "each has a spectrum of its own",
            ),
            (
                self.non_manifold_edges,
                "edge with three or more triangles",
                "edges with three or more triangles",
                "walls meet there; split the surface along them if results nearby look wrong",
            ),
            (
                self.non_manifold_vertices,
                "vertex between separate fans of triangles",
                "vertices between separate fans of triangles",
                "parts that touch only at a point move together there",
            ),
            (
                self.inconsistent_edges,
                "edge between triangles that face opposite ways",
                "edges between triangles that face opposite ways",
                opposite,
            ),
            (
                inside_out,
                "surface turned inside out",
                "",
                "normals point into the solid; turn the faces over in a mesh editor if they should not",
            ),
            (
                self.degenerate_triangles,
                "triangle of no area",
                "triangles of no area",
                "without a normal, and adding nothing to areas",
            ),
            (
                self.duplicated_triangles,
                "triangle that repeats another",
                "triangles that repeat others",
                "counted twice in areas",
            ),
            (
                self.unused_vertices,
                "vertex that no triangle uses",
                "vertices that no triangle uses",
                "not part of the surface",
            ),
            (
                strays,
                "file vertex that no triangle uses",
                "file vertices that no triangle uses",
                "not part of the surface, and never moved",
            ),
            (
                dropped,
                "file triangle with two corners at one point",
                "file triangles with two corners at one point",
                "left out of the surface",
            ),
        ];
        let present = remarks.into_iter().filter(|&(count, ..)| count > 0);
        let sentence = |(count, one, many, meaning)| format!("{}: {meaning}.", counted(count, one, many));
        present.map(sentence).collect()
    }
}

/// "1 edge", "2 edges".
fn counted(count: usize, one: &str, many: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { many })
}

/// Joins corners of triangles that share an edge there; a vertex with several sets of corners has several fans.
fn vertices_with_several_fans(mesh: &TriMesh, edges: &Edges) -> usize {
    let corner_at = |t: u32, v: u32| {
        let corner = mesh.triangles()[t as usize]
            .iter()
            .position(|&w| w == v)
            .unwrap_or_default();
        3 * t + corner as u32
    };
    let mut fans = UnionFind::new(3 * mesh.triangle_count());
    for (e, ends) in edges.vertices().iter().enumerate() {
        for pair in edges.triangles(e).windows(2) {
            for &v in ends {
                fans.join(corner_at(pair[0], v), corner_at(pair[1], v));
            }
        }
    }
    let mut fans_at = vec![0_u32; mesh.vertex_count()];
    for (corner, &v) in (0..).zip(mesh.triangles().as_flattened()) {
        fans_at[v as usize] += u32::from(fans.find(corner) == corner);
    }
    fans_at.iter().filter(|&&fans| fans > 1).count()
}

/// Counts the edges whose two triangles run the same way, and tells whether turning triangles could mend them all.
///
/// Node 2t stands for triangle t as it is, node 2t + 1 for t turned. What goes together is joined; the surface has one
/// side only if some triangle goes together with itself turned. Edges with more than two triangles join nothing.
fn orientation(mesh: &TriMesh, edges: &Edges) -> (usize, bool) {
    let mut sides = UnionFind::new(2 * mesh.triangle_count());
    let mut inconsistent = 0;
    for e in 0..edges.count() {
        if let [t, u] = *edges.triangles(e) {
            let same_way = runs_forward(mesh, edges, e, t) == runs_forward(mesh, edges, e, u);
            inconsistent += usize::from(same_way);
            let turn = u32::from(same_way);
            sides.join(2 * t, 2 * u + turn);
            sides.join(2 * t + 1, 2 * u + 1 - turn);
        }
    }
    let orientable = (0..mesh.triangle_count() as u32).all(|t| sides.find(2 * t) != sides.find(2 * t + 1));
    (inconsistent, orientable)
}

/// Whether a triangle on an edge passes it from its smaller vertex to its larger one.
fn runs_forward(mesh: &TriMesh, edges: &Edges, edge: usize, triangle: u32) -> bool {
    let [a, b] = edges.vertices()[edge];
    let corners = mesh.triangles()[triangle as usize];
    (0..3).any(|i| [corners[i], corners[(i + 1) % 3]] == [a, b])
}

fn duplicated_triangles(mesh: &TriMesh) -> usize {
    let mut sets = mesh.triangles().to_vec();
    sets.iter_mut().for_each(|t| t.sort_unstable());
    sets.sort_unstable();
    sets.windows(2).filter(|pair| pair[0] == pair[1]).count()
}

fn is_degenerate(mesh: &TriMesh, triangle: usize) -> bool {
    let [a, b, c] = mesh.corners(triangle);
    let longest = (b - a).norm().max((c - b).norm()).max((a - c).norm());
    mesh.triangle_area(triangle) <= DEGENERATE_AREA * longest * longest
}

/// The shortest, mean and longest length of the edges.
pub(crate) fn edge_lengths(mesh: &TriMesh, edges: &Edges) -> [f64; 3] {
    let (mut shortest, mut total, mut longest) = (f64::INFINITY, 0.0, 0.0_f64);
    for ends in edges.vertices() {
        let [a, b] = ends.map(|v| mesh.point(v as usize));
        let length = (b - a).norm();
        shortest = shortest.min(length);
        longest = longest.max(length);
        total += length;
    }
    [shortest, total / edges.count() as f64, longest]
}

impl fmt::Display for TopologyReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut line = |label: &str, value: String| writeln!(f, "{label:<13}{value}");
        let counts = format!(
            "{} vertices, {} edges, {} triangles",
            self.vertices, self.edges, self.triangles
        );
        line("surface", counts)?;
        if let Some(welding) = self.welding.filter(|w| w.merged_vertices > 0) {
            line(
                "welded",
                format!(
                    "{} of {} file vertices repeat a position",
                    welding.merged_vertices, welding.file_vertices
                ),
            )?;
        }
        line("components", self.components.to_string())?;
        line(
            "boundary",
            match self.boundary_edges {
                0 => "none".to_string(),
                edges => format!(
                    "{} in {}",
                    counted(edges, "edge", "edges"),
                    counted(self.boundary_loops, "loop", "loops")
                ),
            },
        )?;
        line("manifold", yes_or_no(self.manifold))?;
        line("closed", yes_or_no(self.closed))?;
        line("orientation", self.orientation_in_words().to_string())?;
        let genus = self
            .genus
            .map_or(String::new(), |genus| format!(", genus {genus}"));
        line("Euler char.", format!("{}{genus}", self.euler_characteristic))?;
        line("area", number(self.area))?;
        if let Some(volume) = self.volume {
            line("volume", number(volume))?;
        }
        let [x, y, z] = self.bounding_box.size().map(number);
        line(
            "size",
            format!("{x} × {y} × {z}, diagonal {}", number(self.diagonal)),
        )?;
        let [shortest, mean, longest] = [self.shortest_edge, self.mean_edge, self.longest_edge].map(number);
        line("edge lengths", format!("{shortest} to {longest}, mean {mean}"))?;
        self.remarks()
            .iter()
            .try_for_each(|remark| writeln!(f, "note         {remark}"))
    }
}

impl TopologyReport {
    fn orientation_in_words(&self) -> &'static str {
        match (self.facing, self.inconsistent_edges, self.orientable) {
            (Some(Facing::Outward), ..) => "consistent, outward",
            (Some(Facing::Inward), ..) => "consistent, inward",
            (None, 0, _) => "consistent",
            (None, _, true) => "inconsistent",
            (None, _, false) => "one-sided",
        }
    }
}

fn yes_or_no(yes: bool) -> String {
    if yes { "yes" } else { "no" }.to_string()
}

/// Six significant digits, without an exponent where that reads well.
fn number(x: f64) -> String {
    if x != 0.0 && !(1e-4..1e7).contains(&x.abs()) {
        return format!("{x:.5e}");
    }
    let digits = if x == 0.0 {
        0
    } else {
        (5 - x.abs().log10().floor() as i32).max(0) as usize
    };
    let text = format!("{x:.digits$}");
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_string()
    } else {
        text
    }
}
