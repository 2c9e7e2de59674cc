//! The tree of a code as a list of steps, written down once.
//!
//! The node at stage s above position i covers u_i, …, u_{i+2^s−1}. Its left child is decoded from check nodes, its right child
//! from variable nodes, and their code bits are combined. Nodes whose bits are all frozen, or all but the last, are leaves: the one
//! has a single word, the other two (Sarkis et al. 2014, *Fast polar decoders*).

/// A step of the decoder. `stage` is that of what the step writes; `left` tells whether the node is a left child.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Step {
    /// Ratios of a left child from those of its parent.
    Check { stage: usize },
    /// Ratios of a right child from those of its parent and the bits of its sister.
    Variable { stage: usize },
    /// A leaf without payload.
    Frozen { stage: usize, left: bool },
    /// A leaf whose last bit is payload: every path forks. `position` is the first that it covers.
    Fork { stage: usize, position: usize },
    /// Bits of a node from those of its children.
    Combine { stage: usize, left: bool },
}

/// Code bits of leaves are kept in a word.
const LARGEST_LEAF: usize = 6;

/// The steps for a code whose position i holds payload where `carries[i]`.
pub(crate) fn plan(carries: &[bool]) -> Vec<Step> {
    let mut steps = Vec::new();
    node(carries, carries.len().trailing_zeros() as usize, 0, &mut steps);
    steps
}

fn node(carries: &[bool], stage: usize, position: usize, steps: &mut Vec<Step>) {
    let size = 1 << stage;
    let covered = &carries[position..position + size];
    let left = position >> stage & 1 == 0;
    let count = covered.iter().filter(|&&carries| carries).count();
    match count {
        0 if stage <= LARGEST_LEAF => steps.push(Step::Frozen { stage, left }),
        1 if stage <= LARGEST_LEAF && covered[size - 1] => steps.push(Step::Fork { stage, position }),
        _ => {
            let below = stage - 1;
            steps.push(Step::Check { stage: below });
            node(carries, below, position, steps);
            steps.push(Step::Variable { stage: below });
            node(carries, below, position + size / 2, steps);
            steps.push(Step::Combine { stage, left });
        }
    }
}
