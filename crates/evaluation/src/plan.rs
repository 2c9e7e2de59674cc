//! What a run does on each model: algorithms, attacks, strengths, pictures; and how much work that is.

use anyhow::{Result, bail};
use baselines::{AlgorithmId, entries};

use crate::{
    attacks::{self, Attack},
    models::Candidate,
    options::Options,
    paper::{Model, ModelId},
    progress::Progress,
    study::{
        ByBits, Marking, Target,
        product::{Product, SIGMARK, SIGMARK_TAG},
    },
};

/// Multiples of Table 4's α in the sweep of Fig. 2.
pub(crate) const SWEEP: [f64; 6] = [0.25, 0.5, 1.0, 2.0, 4.0, 8.0];

/// Larger models are left to fast-simplification: MeshLab's decimation takes half a minute of a million vertices (attacks/README.md).
const MOST_BY_MESHLAB: f64 = 5e5;

/// Models with more patches are left to the paper's algorithms.
const MOST_PATCHES_BEYOND: usize = 5;

/// Pixels of an attacked mesh's picture.
const PICTURE: usize = 420;

/// Figs. 6–10: which figure shows which attacks on which model.
pub(crate) const SERIES: [(&str, ModelId, &[&str]); 5] = [
    (
        "Fig. 6",
        ModelId::Armadillo,
        &["simplify:50", "simplify:10", "simplify:5", "simplify:1"],
    ),
    ("Fig. 7", ModelId::Dragon, &["noise:0.1", "noise:0.5"]),
    ("Fig. 8", ModelId::Teddy, &["remesh"]),
    ("Fig. 9", ModelId::Bunny, &["taubin", "laplacian:5"]),
    (
        "Fig. 10",
        ModelId::Eros,
        &[
            "crop:50+simplify:10",
            "simplify:30+loop",
            "crop:50+simplify:10+loop",
        ],
    ),
];

/// What marks a model: the paper's three algorithms, on small models those that the paper did not try, and Sigmark; MHBs alone on a model that is
/// there again.
pub(crate) fn markings(model: &Model, options: &Options) -> Vec<Box<dyn Marking>> {
    let beyond = options.full && model.patches <= MOST_PATCHES_BEYOND;
    let wanted = |id: AlgorithmId| {
        let asked = options.algorithm.is_empty() || options.algorithm.contains(&id.to_string());
        let is_sigmark = id == SIGMARK || id == SIGMARK_TAG;
        let usual = (beyond || is_sigmark || model.printed(&id).is_some()) && !model.again;
        asked && (usual || id == AlgorithmId::MHB)
    };
    let all = all_markings(model.functions).into_iter();
    all.filter(|marking| wanted(marking.id())).collect()
}

/// All that there are; `functions` is m of LBFs.
pub(crate) fn all_markings(functions: usize) -> Vec<Box<dyn Marking>> {
    let by_bits = entries(functions).into_iter();
    let by_bits = by_bits.map(|algorithm| Box::new(ByBits(algorithm)) as Box<dyn Marking>);
    let product = Product::ALL.map(|product| Box::new(product) as Box<dyn Marking>);
    by_bits.chain(product).collect()
}

/// Fails if an algorithm was asked for by an id that none has.
pub(crate) fn check_algorithms(asked: &[String]) -> Result<()> {
    let known: Vec<String> = all_markings(1)
        .iter()
        .map(|marking| marking.id().to_string())
        .collect();
    match asked.iter().find(|id| !known.contains(id)) {
        Some(id) => bail!(
            "--algorithm {id}: there is none of that name; there are {}",
            known.join(", ")
        ),
        None => Ok(()),
    }
}

/// The paper's attacks, decimation by other means where it does not take long, and on the bunny all else.
pub(crate) fn all_attacks(model: &Model) -> impl Iterator<Item = &'static Attack> {
    let tables = attacks::tables();
    let (small, bunny) = (model.size < MOST_BY_MESHLAB, model.id == ModelId::Bunny);
    let by_meshlab = tables.meshlab.iter().filter(move |_| small);
    let others = tables.table5.iter().chain(&tables.beyond).filter(move |_| bunny);
    model.attacks().chain(by_meshlab).chain(others)
}

/// What a mark meets. Of Sigmark's tag only what Fig. 11 counts is asked.
pub(crate) fn attacks_on(algorithm: &AlgorithmId, model: &Model) -> Vec<&'static Attack> {
    match *algorithm == SIGMARK_TAG {
        true => model.attacks().collect(),
        false => all_attacks(model).collect(),
    }
}

/// How many of the signatures are written.
pub(crate) fn signatures(algorithm: &AlgorithmId, signatures: usize) -> usize {
    match *algorithm == SIGMARK_TAG {
        true => 1,
        false => signatures,
    }
}

/// Unmarked meshes are read by MHBs and by Sigmark for Fig. 11, and on the bunny by all but the tag's reader, which is Sigmark's.
pub(crate) fn reads_unmarked(algorithm: &AlgorithmId, model: &Model) -> bool {
    let in_figure = *algorithm == AlgorithmId::MHB || *algorithm == SIGMARK;
    let is_bunny = model.id == ModelId::Bunny && *algorithm != SIGMARK_TAG;
    (in_figure && !model.again) || is_bunny
}

/// Whether plainer readers are asked, too: of Sigmark's marks on the bunny, under the attacks of Table 4.
pub(crate) fn reads_by_steps(
    algorithm: &AlgorithmId,
    model: &Model,
    target: Target,
    attack: &Attack,
) -> bool {
    let is_bunny = model.id == ModelId::Bunny && !model.again;
    is_bunny && *algorithm == SIGMARK && target.is_marked && attacks::tables().table4.contains(attack)
}

/// The model whose α is swept: the paper's eros, or the bunny where it is alone.
pub(crate) fn is_swept(algorithm: &AlgorithmId, model: &Model, options: &Options) -> bool {
    let swept = match options.full {
        true => ModelId::Eros,
        false => ModelId::Bunny,
    };
    *algorithm == AlgorithmId::MHB && model.id == swept
}

/// The attacks under which strengths are compared: those that leave something to tell apart.
pub(crate) fn swept_attacks() -> impl Iterator<Item = &'static Attack> {
    let telling = ["noise:0.5", "laplacian:5", "simplify:5", "simplify:1"];
    let all = attacks::tables().table4.iter();
    all.filter(move |attack| telling.contains(&attack.spec.as_str()))
}

/// The size of the picture that a figure wants of a suspect, if it wants one: the first signature's, marked by MHBs.
pub(crate) fn picture_size(
    model: &Model,
    algorithm: &AlgorithmId,
    target: Target,
    attack: &Attack,
) -> Option<usize> {
    let mut series = SERIES.iter().filter(|(_, id, _)| *id == model.id && !model.again);
    let shown = series.any(|(_, _, attacks)| attacks.contains(&attack.spec.as_str()));
    (shown && *algorithm == AlgorithmId::MHB && target.is_first()).then_some(PICTURE)
}

/// The pieces of work that a run has, before it is known which are finished.
pub(crate) fn progress(candidates: &[Candidate], options: &Options) -> Progress {
    let (mut pieces, mut vertices) = (0, 0.0);
    for candidate in candidates {
        let model = &candidate.model;
        for marking in markings(model, options) {
            let id = marking.id();
            let mut cells = signatures(&id, options.signatures.max(1)) * attacks_on(&id, model).len();
            if reads_unmarked(&id, model) {
                cells += model.attacks().count();
            }
            if is_swept(&id, model, options) {
                cells += SWEEP.len() * swept_attacks().count();
            }
            pieces += cells;
            vertices += cells as f64 * model.size;
        }
    }
    Progress::new(pieces, vertices, options.closing())
}

/// The memory that a cell needs at most, in bytes: MeshLab's structures, and ours.
pub(crate) fn bytes_of(vertices: f64, attack: &Attack) -> u64 {
    const A_VERTEX: f64 = 3000.0;
    let growth = if attack.spec == "loop" { 3.0 } else { 1.0 };
    (growth * A_VERTEX * vertices) as u64 + (256 << 20)
}
