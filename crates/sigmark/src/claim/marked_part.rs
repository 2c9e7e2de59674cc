use mesh::{Components, components};

use super::FoundPart;
use crate::mark::Original;

/// A connected part of the original that carries the mark.
#[derive(Clone, Debug)]
pub(super) struct MarkedPart {
    pub(super) number: usize,
    /// Its first vertex.
    pub(super) vertex: usize,
    vertices: Vec<u32>,
}

impl MarkedPart {
    /// The largest first.
    pub(super) fn all_of(original: &Original) -> Vec<Self> {
        let Components { count, of_vertex, .. } = components(original.mesh());
        let mut parts: Vec<Self> = (0..count)
            .map(|number| Self {
                number,
                vertex: 0,
                vertices: Vec::new(),
            })
            .collect();
        for (v, &part) in of_vertex.iter().enumerate() {
            parts[part as usize].vertices.push(v as u32);
        }
        let labels = original.patches().labels();
        parts.retain(|part| part.vertices.iter().any(|&v| labels[v as usize] > 0));
        parts.sort_by_key(|part| std::cmp::Reverse(part.vertices.len()));
        for part in &mut parts {
            part.vertex = part.vertices[0] as usize;
        }
        parts
    }

    /// What is to be said of it if at least half of it was seen.
    pub(super) fn found(&self, seen: &[bool]) -> Option<FoundPart> {
        let count = self.vertices.iter().filter(|&&v| seen[v as usize]).count();
        let share = count as f64 / self.vertices.len() as f64;
        (share >= 0.5).then_some(FoundPart {
            part: self.number,
            vertex: self.vertex,
            seen: share,
            transform: None,
        })
    }
}
