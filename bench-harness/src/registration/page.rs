//! The page of the registration.

use anyhow::Result;
use evaluation::{machine, python::Python, sources};

use super::{
    draw::{EXACT, LOST_RATE, RIGHT_POSE, TrialDraws},
    tables::{by_attack, by_mesh, by_mesh_and_attack},
    trial::VARIANTS,
};
use crate::results;

/// Writes the page, with what there is about `peers`, and its CSV file. `code`: the digest of what the draws depend on.
pub(crate) fn write(all: &[TrialDraws], attacks: &Python, peers: &str, code: &str) -> Result<()> {
    let results = results::folder()?;
    by_mesh_and_attack(all).write_csv(&results.join("registration.csv"))?;
    let page = format!(
        "# Registration\n\nWritten by `cargo xtask bench registration`. Every original is marked as `sigmark embed` does it by default: with P-256, whose signatures have 512 bits. \
         The suspect is attacked, then rotated at random, scaled by 0.01 to 100 and shifted by up to ten diagonals. Of crops and noise, {VARIANTS} variants are used in turn; mirrored \
         copies are of each attack in turn. A run can be ended early and go on later: the tables count the draws that are finished.\n\n\
         A draw is right when the suspect is reported as aligned, mirrored or not as it is, lies within {RIGHT_POSE} of where it belongs, and least squares, by which `sigmark verify` reads \
         such marks from surfaces, reads no more than {:.1} points less of the bits with the transform that was found than with the true one. Least squares leaves a small misalignment free; the paper's rule, \
         which does not, is the stricter judge of a pose, and the share that is right by it stands beside. Where geometry is unchanged, the unmarked suspect must also come back to {EXACT:e} of the diagonal. \
         For the paper's rule, found transforms are bettered in view of the mark before bits are read, as `sigmark verify` does it for marks of the paper's profile. With another model in the suspect's place, a draw is right when it is \
         reported as not aligned.\n\n\
         Errors are root mean square distances of the suspect's vertices from where they belong, over the original's diagonal, as the alignment found them. The mark is part of the suspect, \
         and smoothing and simplification change the surface by more than a mark does: there the pose that fits best is not the one before the attack. Rates are percentages of bits. \
         Seconds are CPU seconds of an alignment on one thread, the original being prepared once. Single meshes are in [registration.csv](registration.csv).\n\n{}\n{}\n{peers}{}, {}; {}. Code {}, sources' digest {}.\n",
        100.0 * LOST_RATE,
        by_attack(all).markdown(),
        by_mesh(all).markdown(),
        machine::description(),
        attacks.versions()?,
        machine::load(),
        sources::commit(),
        code,
    );
    results::write_page(&results.join("registration.md"), &page)
}
