use crate::{CodeError, PolarCode};

/// The lists that [`PolarCode::search`] is best asked for: most words are read by the first, and the last takes a hundred times as long.
pub const LISTS: [usize; 3] = [32, 256, 4096];

/// A payload that was accepted.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Found {
    /// As it was given to `encode`.
    pub payload: Vec<bool>,
    /// Of how many paths the list was.
    pub list: usize,
    /// How many payloads were tried, this one and those of shorter lists among them.
    pub tried: usize,
    /// As [`Candidate::metric`](crate::Candidate::metric).
    pub metric: f32,
}

impl PolarCode {
    /// The first payload that `accepts`, of lists that grow: a signature that checks, a digest that is the one committed to. `None` if none of any list does.
    ///
    /// The code has no check of its own. Of ratios that have nothing to do with the code each list offers as many payloads as it has paths, so that
    /// an acceptance which one payload in 2^k passes is granted by mistake with a probability of at most Σ lists · 2^−k: for [`LISTS`] and k = 128, 1.3 · 10⁻³⁵.
    ///
    /// # Errors
    /// As [`Self::decode`].
    pub fn search(
        &self,
        ratios: &[f64],
        lists: &[usize],
        mut accepts: impl FnMut(&[bool]) -> bool,
    ) -> Result<Option<Found>, CodeError> {
        let mut tried = 0;
        for &list in lists {
            for candidate in self.decode(ratios, list)? {
                tried += 1;
                if accepts(&candidate.payload) {
                    return Ok(Some(Found {
                        payload: candidate.payload,
                        list,
                        tried,
                        metric: candidate.metric,
                    }));
                }
            }
        }
        Ok(None)
    }
}
