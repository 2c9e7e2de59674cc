//! Two claims on one model: which came first?

#![allow(clippy::unwrap_used)] // in the helpers of tests, too

use job::Job;
use mesh::{TriMesh, Welded, shapes};
use rand_chacha::{ChaCha20Rng, rand_core::SeedableRng};
use registration::PreparedMesh;
use sigmark::{Curve, Dispute, Embedder, Precedence, Signed, SigningKey, Strength, Verifier, claim::Tie};

/// Anna made the model, and gives away what she signed.
const ANNA: u8 = 1;
/// Bert has nothing but that.
const BERT: u8 = 2;

fn model() -> TriMesh {
    shapes::bumpy_sphere(4, 9)
}

fn sign(mesh: &TriMesh, who: u8, strength: f64) -> Signed {
    sign_with_rate(mesh, who, strength, 1)
}

fn sign_with_rate(mesh: &TriMesh, who: u8, strength: f64, chip_rate: usize) -> Signed {
    let key = SigningKey::generate(Curve::P256, &mut ChaCha20Rng::from_seed([who; 32]));
    let embedder = Embedder::new(&key)
        .chip_rate(chip_rate)
        .strength(Strength::Distortion(strength));
    embedder.embed(mesh, &Job::default()).unwrap()
}

fn verifier(claim: &Signed) -> Verifier {
    let certificate = claim.certificate();
    Verifier::with_original(claim.original(), certificate, certificate.public_key()).unwrap()
}

fn dispute(first: &Signed, second: &Signed, suspect: Option<&TriMesh>) -> Dispute {
    let suspect = suspect.map(PreparedMesh::from);
    Dispute::between(
        &verifier(first),
        &verifier(second),
        suspect.as_ref(),
        &Job::default(),
    )
    .unwrap()
}

/// Anna's claim and one of Bert's; the same answer from either side.
fn assert_annas(anna: &Signed, bert: &Signed, suspect: &TriMesh, what: &str) {
    assert_eq!(
        dispute(anna, bert, Some(suspect)).outcome,
        Precedence::First,
        "{what}"
    );
    assert_eq!(dispute(bert, anna, None).outcome, Precedence::Second, "{what}");
}

#[test]
fn who_overwrites_a_mark_comes_second() {
    let anna = sign(&model(), ANNA, 4e-4);
    for strength in [1e-5, 4e-4, 8e-4] {
        let bert = sign(anna.mesh(), BERT, strength);
        assert_annas(&anna, &bert, bert.mesh(), &format!("at {strength}"));
        // Bert's mark is in the suspect, too: that decides nothing.
        let bears = dispute(&anna, &bert, Some(bert.mesh())).suspect_bears().unwrap();
        assert!(bears[1], "at {strength}");
    }
}

#[test]
fn who_takes_a_mark_off_for_an_original_comes_second() {
    let anna = sign(&model(), ANNA, 4e-4);
    for strength in [1e-5, 1e-4, 4e-4] {
        let mark = sign(anna.mesh(), BERT, strength);
        let pairs = anna.positions().iter().zip(mark.positions());
        let taken_off = pairs
            .map(|(s, m)| std::array::from_fn(|i| 2.0 * s[i] - m[i]))
            .collect();
        let bert = sign(&anna.mesh().with_positions(taken_off).unwrap(), BERT, strength);
        assert_annas(&anna, &bert, anna.mesh(), &format!("at {strength}"));
        let bears = dispute(&anna, &bert, Some(anna.mesh())).suspect_bears();
        assert_eq!(bears, Some([true, false]), "at {strength}");
    }
}

/// At four times her strength Bert spoils the "original" until her mark can't be proven in it. That makes him no second, but not the first
/// either: the published model bears her mark alone.
#[test]
fn an_original_that_was_spoiled_does_not_come_first() {
    let anna = sign(&model(), ANNA, 4e-4);
    let mark = sign(anna.mesh(), BERT, 6.4e-3);
    let pairs = anna.positions().iter().zip(mark.positions());
    let spoiled = pairs
        .map(|(s, m)| std::array::from_fn(|i| 2.0 * s[i] - m[i]))
        .collect();
    let bert = sign(&anna.mesh().with_positions(spoiled).unwrap(), BERT, 4e-4);
    let dispute = dispute(&anna, &bert, Some(anna.mesh()));
    assert!(
        !matches!(dispute.outcome, Precedence::Second),
        "{:?}",
        dispute.outcome
    );
    assert_eq!(dispute.suspect_bears(), Some([true, false]));
}

#[test]
fn a_cropped_original_comes_second() {
    let anna = sign(&shapes::bumpy_sphere(5, 9), ANNA, 4e-4);
    let mesh = anna.mesh();
    let kept = mesh
        .triangles()
        .iter()
        .filter(|t| t.iter().all(|&v| mesh.positions()[v as usize][0] < 0.3));
    let kept: Vec<[u32; 3]> = kept.copied().collect();
    let cropped = Welded::new(mesh.positions(), &kept).unwrap().into_mesh();
    let bert = sign(&cropped, BERT, 4e-4);
    assert_annas(&anna, &bert, bert.mesh(), "cropped");
}

#[test]
fn a_decimated_original_comes_second() {
    let anna = sign_with_rate(&shapes::bumpy_sphere(5, 9), ANNA, 8e-4, 3);
    // The vertices of the level below, with its triangles.
    let net = shapes::icosphere(4);
    let positions = anna.positions()[..net.vertex_count()].to_vec();
    let bert = sign(&net.with_positions(positions).unwrap(), BERT, 4e-4);
    assert_annas(&anna, &bert, bert.mesh(), "decimated");
}

#[test]
fn two_claims_on_the_same_unmarked_original_are_undecided() {
    let (anna, bert) = (sign(&model(), ANNA, 4e-4), sign(&model(), BERT, 4e-4));
    for suspect in [anna.mesh(), bert.mesh()] {
        let dispute = dispute(&anna, &bert, Some(suspect));
        assert_eq!(dispute.outcome, Precedence::Undecided(Tie::Neither));
    }
    let bears = |suspect| dispute(&anna, &bert, Some(suspect)).suspect_bears();
    assert_eq!(bears(anna.mesh()), Some([true, false]));
    assert_eq!(bears(bert.mesh()), Some([false, true]));
}

#[test]
fn two_claims_on_copies_that_the_other_signed_by_another_claim_are_undecided() {
    // Each has a copy that the other signed before, and signs it again.
    let anna = sign(sign(&model(), BERT, 4e-4).mesh(), ANNA, 4e-4);
    let earlier = sign(&model(), ANNA, 4e-4);
    let bert = sign(earlier.mesh(), BERT, 4e-4);
    let outcome = dispute(&anna, &bert, None).outcome;
    // Claims are by statement: another statement of hers stands in his original, so none of these two is in the other's.
    assert_eq!(outcome, Precedence::Undecided(Tie::Neither));
}

#[test]
fn honest_claims_on_different_models_are_unrelated() {
    let (anna, bert) = (
        sign(&model(), ANNA, 4e-4),
        sign(&shapes::bumpy_torus(60, 36, 2), BERT, 4e-4),
    );
    let dispute = dispute(&anna, &bert, Some(anna.mesh()));
    assert_eq!(dispute.outcome, Precedence::Undecided(Tie::Unrelated));
    assert_eq!(dispute.suspect_bears(), Some([true, false]));
}
