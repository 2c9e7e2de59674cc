//! Bits in a shape, and back.
//!
//! Each patch of a mesh is expanded in its manifold harmonics H; bit t, s″ = ±1, moves low-frequency coefficients by α s″ φ (eqs. 11–14).
//! Whoever has the original reads the bits back from the difference of the coefficients, after taking the suspect onto the original
//! (eqs. 15–17). What the bits mean, and who wrote them, is not known here.

mod balance;
mod basis;
mod bits;
mod chips;
mod detect;
mod error;
mod layout;
mod original;
mod patches;
mod planes;
mod pool;
mod reader;
mod registered;
mod rotation;
mod roughness;
mod settling;
mod sketch;
mod slivers;
mod stage;
mod strength;
mod thickness;
mod traversal;
mod window;

pub(crate) use balance::{Balances, BalancesOfPatch};
pub use basis::PatchBasis;
pub use bits::{SoftBits, correlation, extraction_rate};
pub use chips::{Chip, ChipLayout, ChipPlan};
pub use detect::{
    AttackModel, Bending, CoefficientDetector, Detector, JointEstimate, JointEstimator, JointModel,
};
pub use error::MarkError;
pub use layout::{Levelled, MarkLayout, Written};
pub use original::{Borders, Original};
pub use patches::{LARGEST_PATCH, MOST_FUNCTIONS, Patch, PatchCount, Patches, VERTICES_PER_FUNCTION};
pub use pool::Pool;
pub use reader::{Found, FoundParts, ReadParts, Reader, Reading, ReadingMethod, Readings, Suspect, Wanted};
pub use registered::Registered;
pub use rotation::{PatchRotation, Rotation};
pub(crate) use settling::{Lowest, Settling, SettlingOfPatch};
pub(crate) use sketch::Sketcher;
pub use sketch::{Recognised, Sketch};
pub use stage::MarkStage;
pub use strength::{MOST_DISTORTION, Strength};
