//! What is tried on every mesh: the kinds of suspects, which are the rows of the tables.

use evaluation::attacks::{self, Attack, Survivor};

/// The attacks of this benchmark, from the one list of attacks.
pub(crate) fn attacks() -> &'static [Attack] {
    &attacks::tables().registration
}

/// Of attacks that are random, so many seeds are used in turn.
pub(crate) const VARIANTS: u64 = 4;

/// One stranger for so many draws of an attack: another pose of it says little that is new.
const DRAWS_A_STRANGER: u64 = 5;

/// A kind of suspect.
#[derive(Clone, Copy)]
pub(crate) enum PoseTrial {
    Attacked(&'static Attack),
    /// The mirror image, of each attack in turn.
    Mirrored,
    /// Another model.
    Stranger,
}

impl PoseTrial {
    /// All of them, in the order of the tables.
    pub(crate) fn all() -> impl Iterator<Item = Self> {
        let attacked = attacks().iter().map(Self::Attacked);
        attacked.chain([Self::Mirrored, Self::Stranger])
    }

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Attacked(attack) => &attack.name,
            Self::Mirrored => "mirrored",
            Self::Stranger => "another model",
        }
    }

    /// Whether unmarked suspects lie exactly on the original.
    pub(crate) fn is_exact(self) -> bool {
        matches!(self, Self::Attacked(attack) if attack.keeps(Survivor::Surface))
    }

    pub(crate) fn is_mirrored(self) -> bool {
        matches!(self, Self::Mirrored)
    }

    pub(crate) fn is_stranger(self) -> bool {
        matches!(self, Self::Stranger)
    }

    /// The attack of a draw, and its seed; none for strangers.
    pub(crate) fn attack(self, draw: u64) -> Option<(&'static Attack, u64)> {
        let (attack, turn) = match self {
            Self::Attacked(attack) => (attack, draw),
            Self::Mirrored => (&attacks()[draw as usize % attacks().len()], 0),
            Self::Stranger => return None,
        };
        Some((attack, if attack.is_random() { turn % VARIANTS } else { 0 }))
    }

    /// How many draws there are of it for so many of each attack.
    pub(crate) fn draws(self, wanted: u64) -> u64 {
        match self {
            Self::Stranger => wanted.div_ceil(DRAWS_A_STRANGER),
            _ => wanted,
        }
    }
}
