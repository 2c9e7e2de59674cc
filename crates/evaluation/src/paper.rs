//! What the paper prints, `data/paper.toml`: its models, and Tables 1–5 of them.

use std::sync::LazyLock;

use baselines::AlgorithmId;
use serde::Deserialize;

use crate::attacks::{self, Attack};

/// One of the six models.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum ModelId {
    Bunny,
    Teddy,
    Lion,
    Armadillo,
    Eros,
    Dragon,
}

/// A model of the paper.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Model {
    pub(crate) id: ModelId,
    pub(crate) name: String,
    /// As the paper prints it.
    pub(crate) vertices: String,
    /// The same as a number, for estimates of time.
    pub(crate) size: f64,
    /// n_p of MHBs and LBFs.
    pub(crate) patches: usize,
    /// m of LBFs.
    pub(crate) functions: usize,
    /// RBFs, LBFs, MHBs, as in Table 4.
    printed: Vec<Printed>,
    /// Whether it is one of the six for a second time, with another mesh.
    #[serde(skip)]
    pub(crate) again: bool,
}

/// What is printed of one algorithm on one model.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Printed {
    algorithm: AlgorithmId,
    /// Per cent of the diagonal.
    pub(crate) d_rmse: f64,
    pub(crate) d_2_50: f64,
    /// Extraction rates in per cent under the attacks of Table 4.
    rates: Vec<f64>,
    /// Under those of Table 5, for its models.
    combined: Option<Vec<f64>>,
    pub(crate) seconds: Seconds,
}

/// Of Tables 1–3.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Seconds {
    pub(crate) basis: f64,
    pub(crate) embedding: f64,
    pub(crate) extraction: f64,
}

#[derive(Deserialize)]
struct Document {
    model: Vec<Model>,
}

static DOCUMENT: LazyLock<Document> =
    LazyLock::new(|| toml::from_str(include_str!("../data/paper.toml")).expect("a test reads paper.toml"));

impl Model {
    pub(crate) fn of(id: ModelId) -> &'static Self {
        let mut models = DOCUMENT.model.iter();
        models.find(|model| model.id == id).expect("a test finds all six")
    }

    /// The same for a second time, with another mesh.
    pub(crate) fn of_another_mesh(&self, name: &str) -> Self {
        Self {
            name: name.into(),
            again: true,
            ..self.clone()
        }
    }

    /// What is printed of an algorithm; none of those that the paper did not try.
    pub(crate) fn printed(&self, algorithm: &AlgorithmId) -> Option<&Printed> {
        let mut printed = self.printed.iter();
        printed.find(|printed| printed.algorithm == *algorithm)
    }

    /// The printed rate of an algorithm under an attack, or under the one that it stands for.
    pub(crate) fn printed_rate(&self, algorithm: &AlgorithmId, attack: &Attack) -> Option<f64> {
        self.printed(algorithm)?.rate(attack)
    }

    /// The attacks that the paper prints for this model.
    pub(crate) fn attacks(&self) -> impl Iterator<Item = &'static Attack> {
        let tables = attacks::tables();
        let combined = self.printed.iter().any(|printed| printed.combined.is_some());
        let of_table5 = tables.table5.iter().filter(move |_| combined);
        tables.table4.iter().chain(of_table5)
    }
}

impl Printed {
    fn rate(&self, attack: &Attack) -> Option<f64> {
        let tables = attacks::tables();
        let name = attack.instead_of.as_ref().unwrap_or(&attack.name);
        let at = |table: &[Attack]| table.iter().position(|known| known.name == *name);
        let single = at(&tables.table4).and_then(|column| self.rates.get(column));
        let combined = || self.combined.as_ref()?.get(at(&tables.table5)?);
        single.or_else(combined).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [ModelId; 6] = [
        ModelId::Bunny,
        ModelId::Teddy,
        ModelId::Lion,
        ModelId::Armadillo,
        ModelId::Eros,
        ModelId::Dragon,
    ];

    #[test]
    fn every_model_has_whole_rows_of_the_papers_three() {
        assert_eq!(
            ALL.map(|id| Model::of(id).id).as_slice(),
            DOCUMENT.model.iter().map(|model| model.id).collect::<Vec<_>>()
        );
        let tables = attacks::tables();
        for model in &DOCUMENT.model {
            let algorithms: Vec<_> = model.printed.iter().map(|printed| &printed.algorithm).collect();
            assert_eq!(
                algorithms,
                [&AlgorithmId::RBF, &AlgorithmId::LBF, &AlgorithmId::MHB],
                "{}",
                model.name
            );
            let is_combined = matches!(model.id, ModelId::Eros | ModelId::Dragon);
            for printed in &model.printed {
                assert_eq!(printed.rates.len(), tables.table4.len(), "{}", model.name);
                let combined = printed.combined.as_ref().map(Vec::len);
                assert_eq!(
                    combined,
                    is_combined.then_some(tables.table5.len()),
                    "{}",
                    model.name
                );
            }
        }
    }

    #[test]
    fn decimation_by_meshlab_stands_beside_what_is_printed_of_decimation() {
        let rates = attacks::tables().meshlab.iter();
        let rates = rates.map(|attack| Model::of(ModelId::Bunny).printed_rate(&AlgorithmId::MHB, attack));
        assert_eq!(rates.collect::<Vec<_>>(), [91.67, 81.79, 75.31, 51.23].map(Some));
    }

    #[test]
    fn the_tables_have_74_meshes_and_whole_numbers_of_bits_but_for_two_misprints() {
        let models = || ALL.into_iter().map(Model::of);
        assert_eq!(models().flat_map(Model::attacks).count(), 74);
        let mut odd = Vec::new();
        for model in models() {
            for printed in &model.printed {
                for attack in model.attacks() {
                    let rate = printed.rate(attack).unwrap();
                    assert!((50.0..=100.0).contains(&rate));
                    // A rate is a whole number of 324 bits, rounded to a hundredth of a per cent.
                    let bits = 3.24 * rate;
                    if (bits - bits.round()).abs() > 3.24 * 0.0051 {
                        odd.push((model.id, &printed.algorithm, attack.spec.as_str(), rate));
                    }
                }
            }
        }
        let misprints = [
            (ModelId::Teddy, &AlgorithmId::MHB, "loop", 78.74),
            (ModelId::Eros, &AlgorithmId::RBF, "noise:0.5", 76.3),
        ];
        assert_eq!(odd, misprints);
    }
}
