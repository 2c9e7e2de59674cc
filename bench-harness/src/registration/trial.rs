//! What is tried on every mesh: the kinds of suspects, which are the rows of the tables.

/// What happens to a suspect before it is moved.
pub(crate) struct PoseAttack {
    pub(crate) name: &'static str,
    /// As `attacks/attack.py` has it.
    pub(crate) spec: &'static str,
    /// Whether the seed makes a difference.
    random: bool,
    /// Whether what is left of the surface lies exactly on the original's, but for the mark.
    exact: bool,
}

const fn attack(name: &'static str, spec: &'static str, random: bool, exact: bool) -> PoseAttack {
    PoseAttack {
        name,
        spec,
        random,
        exact,
    }
}

pub(crate) const POSE_ATTACKS: [PoseAttack; 8] = [
    // Keeping all is the crop that changes nothing.
    attack("none", "crop:100", false, true),
    attack("crop to 50 %", "crop:50", true, true),
    attack("crop to 25 %", "crop:25", true, true),
    attack("noise 0.5 %", "noise:0.5", true, false),
    attack("simplification to 5 %", "simplify:5", false, false),
    attack("isotropic re-meshing", "remesh:100", false, false),
    attack("Laplacian x5", "laplacian:5", false, false),
    attack("Loop", "loop:1", false, false),
];

/// Of attacks that are random, so many seeds are used in turn.
pub(crate) const VARIANTS: u64 = 4;

/// One stranger for so many draws of an attack: another pose of it says little that is new.
const DRAWS_A_STRANGER: u64 = 5;

/// A kind of suspect.
#[derive(Clone, Copy)]
pub(crate) enum PoseTrial {
    Attacked(&'static PoseAttack),
    /// The mirror image, of each attack in turn.
    Mirrored,
    /// Another model.
    Stranger,
}

impl PoseTrial {
    /// All of them, in the order of the tables.
    pub(crate) fn all() -> impl Iterator<Item = Self> {
        let attacked = POSE_ATTACKS.iter().map(Self::Attacked);
        attacked.chain([Self::Mirrored, Self::Stranger])
    }

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Attacked(attack) => attack.name,
            Self::Mirrored => "mirrored",
            Self::Stranger => "another model",
        }
    }

    /// Whether unmarked suspects lie exactly on the original.
    pub(crate) fn is_exact(self) -> bool {
        matches!(self, Self::Attacked(attack) if attack.exact)
    }

    pub(crate) fn is_mirrored(self) -> bool {
        matches!(self, Self::Mirrored)
    }

    pub(crate) fn is_stranger(self) -> bool {
        matches!(self, Self::Stranger)
    }

    /// The attack of a draw, and its seed; none for strangers.
    pub(crate) fn attack(self, draw: u64) -> Option<(&'static PoseAttack, u64)> {
        let (attack, turn) = match self {
            Self::Attacked(attack) => (attack, draw),
            Self::Mirrored => (&POSE_ATTACKS[draw as usize % POSE_ATTACKS.len()], 0),
            Self::Stranger => return None,
        };
        Some((attack, if attack.random { turn % VARIANTS } else { 0 }))
    }

    /// How many draws there are of it for so many of each attack.
    pub(crate) fn draws(self, wanted: u64) -> u64 {
        match self {
            Self::Stranger => wanted.div_ceil(DRAWS_A_STRANGER),
            _ => wanted,
        }
    }
}
