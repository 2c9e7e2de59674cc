/// How a model is posed: which joints move which vertices, and how much (linear blend skinning: Σⱼ wⱼ Aⱼ x for a vertex x, Aⱼ affine).
///
/// It says nothing of where the joints are.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rig {
    joints: usize,
    /// Where the weights of each vertex begin; one more than there are vertices.
    starts: Vec<usize>,
    /// Joint and weight.
    weights: Vec<(u32, f64)>,
}

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
            own.sort_unstable_by_key(|&(joint, _)| joint);
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
        }
    }

    /// How many joints move anything.
    pub fn joints(&self) -> usize {
        self.joints
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
}
