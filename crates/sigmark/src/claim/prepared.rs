use std::sync::{Arc, OnceLock};

use job::Job;

use super::{
    Certificate, Embedder, Prediction, SigmarkError, Signed, certificate::Contents, statement::Statement,
};
use crate::mark::{MarkError, MarkLayout, MarkStage, Original, Patch, PatchBasis, Sketcher, Written};

/// A model to be signed for any number of recipients: what does not depend on them is computed once.
///
/// Copies are what [`Embedder::embed`] makes for each recipient alone, bit for bit, in any order and from several threads at once.
#[derive(Debug)]
pub struct Prepared {
    embedder: Embedder,
    original: Arc<Original>,
    /// For nobody.
    statement: Statement,
    /// With the chips in nobody's order.
    layout: MarkLayout,
    /// The text of the original's sketch, once all bases were seen.
    sketch: OnceLock<String>,
}

impl Prepared {
    pub(super) fn new(embedder: &Embedder, original: &Arc<Original>) -> Result<Self, SigmarkError> {
        embedder.strength.checked()?;
        original.check_borders(embedder.carrier().borders())?;
        let (payload, layout) = embedder.payload_and_layout(original)?;
        Ok(Self {
            statement: embedder.statement(original, payload, layout.alphas().to_vec()),
            embedder: embedder.clone(),
            original: Arc::clone(original),
            layout,
            sketch: OnceLock::new(),
        })
    }

    /// The original with its patches.
    pub fn original(&self) -> &Arc<Original> {
        &self.original
    }

    /// Where the marks will lie, and how strong they are. The order of the chips is that of no mark: each has its own.
    pub fn layout(&self) -> &MarkLayout {
        &self.layout
    }

    /// How strong the marks will be, and what they survive.
    pub fn prediction(&self) -> Prediction {
        self.embedder.predict_of(&self.layout, self.statement.payload)
    }

    /// What the certificate of a recipient's copy states: the same, whenever and by whatever run it was issued.
    pub fn statement_for(&self, recipient: &str) -> Statement {
        Statement {
            recipient: recipient.into(),
            ..self.statement.clone()
        }
    }

    /// Computes the bases, and keeps a gigabyte of them, which is more than marks have by default; others are computed for every copy anew.
    ///
    /// # Errors
    /// As [`Original::map_bases`].
    pub fn keep_bases(&self, job: &Job) -> Result<(), SigmarkError> {
        self.original.keep_a_gigabyte();
        let sketcher = Sketcher::new(&self.original);
        let of_patch = |_, patch: &Patch, basis: &PatchBasis| sketcher.opposite(patch, basis);
        let opposite = self.original.map_bases(of_patch, job)?;
        self.sketch.get_or_init(|| text(sketcher, opposite));
        Ok(())
    }

    /// Signs a copy for a recipient; "" is nobody.
    ///
    /// # Errors
    /// As [`Embedder::embed_in`].
    pub fn embed_for(&self, recipient: &str, job: &Job) -> Result<Signed, SigmarkError> {
        let statement = self.statement_for(recipient);
        let (key, original) = (&self.embedder.key, &self.original);
        let hash = statement.hash()?;
        let signature = key.sign(statement.scheme, &statement.signed_bytes(&hash))?;
        let plan = statement.plan(hash)?;
        let layout = MarkLayout::new(Arc::clone(original), plan, statement.alphas.clone())?;
        let bits = statement.coded(hash)?.bits(&signature);
        let (mut written, sketch) = self.write(&layout, &bits, job)?;
        job.begin(MarkStage::Embedding)?;
        let levelled = statement
            .binds_original()
            .then(|| layout.level_slivers(&mut written, self.embedder.strength));
        let payload = statement.payload;
        let marked = original.mesh().with_positions(written.positions(original));
        let contents = Contents {
            statement,
            name: self.embedder.original_name.clone(),
            signature,
            eigenvalues: written.last_eigenvalues,
            sketch,
        };
        let certificate = Certificate::issue(key, contents)?;
        let prediction = match &levelled {
            Some(levelled) => self.embedder.predict_levelled(&layout, payload, levelled),
            None => self.embedder.predict_of(&layout, payload),
        };
        Ok(Signed {
            marked: marked.map_err(MarkError::from)?,
            certificate,
            layout: Arc::new(layout),
            levelled,
            prediction,
        })
    }

    /// Writes the bits. The first copy draws the sketch as well, if nobody did: its bases may be gone after that.
    fn write(
        &self,
        layout: &MarkLayout,
        bits: &[bool],
        job: &Job,
    ) -> Result<(Written, String), SigmarkError> {
        if let Some(sketch) = self.sketch.get() {
            return Ok((layout.write(bits, job)?, sketch.clone()));
        }
        let sketcher = Sketcher::new(&self.original);
        let opposite = |patch: &Patch, basis: &PatchBasis| sketcher.opposite(patch, basis);
        let (written, opposite) = layout.write_and(bits, opposite, job)?;
        let sketch = self.sketch.get_or_init(|| text(sketcher, opposite));
        Ok((written, sketch.clone()))
    }
}

/// The text of a sketch; nothing where there is none.
fn text(sketcher: Sketcher<'_>, opposite: Vec<Vec<bool>>) -> String {
    let sketch = sketcher.sketch(opposite);
    sketch.map_or_else(String::new, |sketch| sketch.to_text())
}
