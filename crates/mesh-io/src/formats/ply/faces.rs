use crate::error::CUT_SHORT;
use crate::formats::geometry::fan;

/// How an element's list of vertex indices is to be understood.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Faces {
    Polygons,
    Strips,
}

/// Gathers triangles and knows how many vertices they may refer to.
pub(super) struct Triangles {
    vertex_count: usize,
    corners: Vec<u32>,
    pub(super) triangles: Vec<[u32; 3]>,
}

impl Triangles {
    pub(super) fn new(vertex_count: usize) -> Self {
        Self {
            vertex_count,
            corners: Vec::new(),
            triangles: Vec::new(),
        }
    }

    /// Takes an index; −1 ends a strip.
    pub(super) fn push_index(&mut self, index: i64, faces: Faces) -> Result<(), String> {
        if faces == Faces::Strips && index == -1 {
            self.end_list(faces)?;
            return Ok(());
        }
        let valid = u32::try_from(index)
            .ok()
            .filter(|&i| (i as usize) < self.vertex_count);
        self.corners.push(valid.ok_or_else(|| {
            format!(
                "{index} is not one of the {} vertices (counted from 0){CUT_SHORT}",
                self.vertex_count
            )
        })?);
        Ok(())
    }

    /// Ends a polygon or a strip.
    pub(super) fn end_list(&mut self, faces: Faces) -> Result<(), String> {
        match faces {
            Faces::Polygons if self.corners.len() < 3 => {
                return Err(format!(
                    "this face has {} corners, and needs at least 3: remove it",
                    self.corners.len()
                ));
            }
            Faces::Polygons => fan(&self.corners, &mut self.triangles),
            // Every other triangle of a strip is turned round, so that all face one way.
            Faces::Strips => self
                .triangles
                .extend(self.corners.windows(3).enumerate().map(|(i, c)| {
                    if i % 2 == 0 {
                        [c[0], c[1], c[2]]
                    } else {
                        [c[1], c[0], c[2]]
                    }
                })),
        }
        self.corners.clear();
        Ok(())
    }
}
