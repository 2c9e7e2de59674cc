//! Where in an asset's buffers the coordinates of its vertices lie, and how they are written.
//!
//! Binary numbers keep their size and are overwritten in place ([`binary`]). A new decimal may be longer than the old one, so
//! that text is spliced together anew ([`text`]). Normals and what else turns with a mesh lie in slots of the same kinds ([`directions`]).

pub(crate) mod binary;
pub(crate) mod directions;
pub(crate) mod placement;
mod replacement;
pub(crate) mod scene;
pub(crate) mod text;

use crate::buffer::Buffer;
use crate::error::Place;
use crate::formats;
use binary::BinaryRun;
use replacement::Refusal;
use scene::SceneSlots;
use text::TextSlots;

/// The places of all coordinates, vertex by vertex.
#[derive(Clone, Debug)]
pub(crate) enum Slots {
    /// Decimals in the first buffer.
    Text(TextSlots),
    /// Runs of numbers, each in some buffer: together all vertices, in their order.
    Binary(Vec<BinaryRun>),
    /// Runs of numbers in the buffers of a scene description, which says their bounds.
    Scene(SceneSlots),
}

impl Slots {
    /// How many vertices the file has.
    pub(crate) fn len(&self) -> usize {
        match self {
            Self::Text(text) => text.starts.len(),
            Self::Binary(runs) | Self::Scene(SceneSlots { runs, .. }) => {
                runs.iter().map(|run| run.count).sum()
            }
        }
    }

    /// The coordinates that the buffers hold, one row a vertex.
    pub(crate) fn positions(&self, buffers: &[impl AsRef<[u8]>]) -> Vec<[f64; 3]> {
        match self {
            Self::Text(text) => text.positions(buffers[0].as_ref()).collect(),
            Self::Binary(runs) | Self::Scene(SceneSlots { runs, .. }) => runs
                .iter()
                .flat_map(|run| run.positions(buffers[run.buffer].as_ref()))
                .collect(),
        }
    }

    /// Whether the numbers are integers that stand for −1 to 1.
    pub(crate) fn is_normalised(&self) -> bool {
        match self {
            Self::Text(_) => false,
            Self::Binary(runs) | Self::Scene(SceneSlots { runs, .. }) => runs.iter().any(|run| {
                run.quantisation
                    .is_some_and(|quantisation| quantisation.normalised)
            }),
        }
    }

    /// Where a coordinate lies, for messages.
    pub(crate) fn place(&self, buffers: &[Buffer], vertex: usize, axis: usize) -> Place {
        match self {
            Self::Text(text) => text.place(&buffers[0].bytes, vertex, axis),
            Self::Binary(runs) | Self::Scene(SceneSlots { runs, .. }) => {
                let mut first = 0;
                let holds = |run: &&BinaryRun| {
                    first += run.count;
                    vertex < first
                };
                let offset = runs.iter().find(holds).map_or(0, |run| {
                    let [x, y, z] = run.place(vertex + run.count - first);
                    [x, y, z][axis]
                });
                Place::Byte {
                    offset,
                    what: format!("vertex {vertex}, {}", ["x", "y", "z"][axis]),
                }
            }
        }
    }

    /// The buffers with new coordinates where `target` gives some, and where they lie then. A buffer of which no byte changes
    /// stays the [same](Buffer::is_same).
    pub(crate) fn rewrite(
        &self,
        old: &[Buffer],
        target: impl Fn(usize) -> Option<[f64; 3]>,
    ) -> Result<(Vec<Buffer>, Self), Refusal> {
        let mut buffers = old.to_vec();
        let slots = match self {
            Self::Text(text) => Self::Text(text.rewrite(&mut buffers[0].bytes, target)?),
            Self::Binary(runs) => {
                overwrite(runs, &mut buffers, target)?;
                self.clone()
            }
            Self::Scene(scene) => {
                overwrite(&scene.runs, &mut buffers, target)?;
                if old.iter().zip(&buffers).all(|(old, new)| new.is_same(old)) {
                    return Ok((buffers, self.clone()));
                }
                let rewritten = formats::gltf::rewrite(old, buffers, scene);
                let (buffers, scene) = rewritten.expect("a document that was read can be read again");
                return Ok((buffers, Self::Scene(scene)));
            }
        };
        Ok((buffers, slots))
    }

    /// Puts the numbers of `target` into the buffers: all of them, or none and why. Decimals lie elsewhere then, and of a scene description
    /// the text is not yet brought up to the new numbers.
    pub(crate) fn overwrite(
        &self,
        buffers: &mut [Buffer],
        target: &impl Fn(usize) -> Option<[f64; 3]>,
    ) -> Result<(), &'static str> {
        match self {
            Self::Text(text) => {
                let rewritten = text.rewrite(&mut buffers[0].bytes, target);
                rewritten.map(drop).map_err(|refusal| refusal.problem)
            }
            Self::Binary(runs) | Self::Scene(SceneSlots { runs, .. }) => {
                let mut first = 0;
                for run in runs {
                    run.check(&buffers[run.buffer].bytes, &|i| target(first + i))?;
                    first += run.count;
                }
                overwrite(runs, buffers, target).map_err(|refusal| refusal.problem)
            }
        }
    }
}

/// Overwrites the numbers of all runs for which `target` gives others.
fn overwrite(
    runs: &[BinaryRun],
    buffers: &mut [Buffer],
    target: impl Fn(usize) -> Option<[f64; 3]>,
) -> Result<(), Refusal> {
    let mut first = 0;
    for run in runs {
        run.rewrite(&mut buffers[run.buffer].bytes, first, &target)?;
        first += run.count;
    }
    Ok(())
}
