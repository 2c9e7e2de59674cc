/// How a model is posed: by how much morph targets may move its vertices, and which joints move which vertices then, and how much (linear blend skinning:
/// Σⱼ wⱼ Aⱼ (x + Σₖ cₖ dₖ) for a vertex x with the offsets dₖ, Aⱼ affine).
///
/// It says nothing of where the joints are, nor how far a target is taken.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rig {
    joints: usize,
    /// Where the weights of each vertex begin; one more than there are vertices.
    starts: Vec<usize>,
    /// Joint and weight.
    weights: Vec<(u32, f64)>,
    targets: Vec<MorphTarget>,
}

/// The vertices that a morph target moves, ascending, and where to, from where they are.
pub type MorphTarget = Vec<(u32, [f64; 3])>;

impl Rig {
    /// A rig of weights, some (joint, weight) for each vertex. Those of a vertex are brought to a sum of 1; weights that are not finite and positive are passed over. Joints
    /// are numbered anew, in the order of their numbers, without those that move nothing.
    pub fn new(of_vertices: &[Vec<(u32, f64)>]) -> Self {
        let counts = |&(_, weight): &(u32, f64)| weight.is_finite() && weight > 0.0;
        let mut used: Vec<u32> = of_vertices
            .iter()
            .flatten()
            .filter(|own| counts(own))
            .map(|&(joint, _)| joint)
            .collect();
        used.sort_unstable();
        used.dedup();
        let (mut starts, mut weights) = (vec![0], Vec::new());
        for own in of_vertices {
            let mut own: Vec<(u32, f64)> = own.iter().filter(|own| counts(own)).copied().collect();
            own.sort_by_key(|&(joint, _)| joint);
            own.dedup_by(|again, first| {
                let is_same = again.0 == first.0;
                first.1 += if is_same { again.1 } else { 0.0 };
                is_same
            });
            let sum: f64 = own.iter().map(|&(_, weight)| weight).sum();
            let number = |joint| used.partition_point(|&other| other < joint) as u32;
            weights.extend(
                own.into_iter()
                    .map(|(joint, weight)| (number(joint), weight / sum)),
            );
            starts.push(weights.len());
        }
        Self {
            joints: used.len(),
            starts,
            weights,
            targets: Vec::new(),
        }
    }

    /// The same with morph targets. Of two offsets of a vertex the first counts; those that are not finite, are zero, or are of no vertex are passed over, and targets that move nothing.
    pub fn with_targets(mut self, targets: impl IntoIterator<Item = MorphTarget>) -> Self {
        let vertices = self.vertices();
        let counts = |&(vertex, offset): &(u32, [f64; 3])| {
            (vertex as usize) < vertices && offset.iter().all(|x| x.is_finite()) && offset != [0.0; 3]
        };
        let cleaned = targets.into_iter().map(|mut target| {
            target.retain(counts);
            target.sort_by_key(|&(vertex, _)| vertex);
            target.dedup_by_key(|&mut (vertex, _)| vertex);
            target
        });
        self.targets = cleaned.filter(|target| !target.is_empty()).collect();
        self
    }

    /// How many joints move anything.
    pub fn joints(&self) -> usize {
        self.joints
    }

    /// The morph targets, each of which moves some vertex.
    pub fn targets(&self) -> &[MorphTarget] {
        &self.targets
    }

    /// Whether it moves nothing.
    pub fn is_empty(&self) -> bool {
        self.joints == 0 && self.targets.is_empty()
    }

    /// How many vertices there are.
    pub fn vertices(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    /// The joints that move a vertex, ascending, with their weights, whose sum is 1; none of a vertex that no joint moves.
    pub fn weights_of(&self, vertex: usize) -> &[(u32, f64)] {
        let [from, to] = [vertex, vertex + 1].map(|i| self.starts[i]);
        &self.weights[from..to]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_brought_to_one_and_joints_that_move_nothing_are_left_out() {
        let rig = Rig::new(&[
            vec![(7, 1.0), (3, 3.0)],
            vec![(3, 0.0), (9, f64::NAN)],
            vec![(7, 0.25), (7, 0.25), (1, -1.0)],
        ]);
        assert_eq!((rig.joints(), rig.vertices()), (2, 3));
        assert_eq!(rig.weights_of(0), [(0, 0.75), (1, 0.25)]);
        assert_eq!(rig.weights_of(1), []);
        assert_eq!(rig.weights_of(2), [(1, 1.0)]);
        assert_eq!(Rig::default().vertices(), 0);
    }

    #[test]
    fn targets_are_sorted_and_those_that_move_nothing_are_left_out() {
        let rig = Rig::new(&vec![vec![(0, 1.0)]; 3]).with_targets([
            vec![(2, [1.0, 0.0, 0.0]), (0, [0.0, 2.0, 0.0]), (2, [5.0, 0.0, 0.0])],
            vec![(1, [0.0; 3]), (1, [0.0, f64::NAN, 0.0]), (3, [1.0; 3])],
        ]);
        assert_eq!(rig.targets(), [vec![(0, [0.0, 2.0, 0.0]), (2, [1.0, 0.0, 0.0])]]);
        assert!(!rig.is_empty() && Rig::default().is_empty());
    }
}
