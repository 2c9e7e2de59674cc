/// Which paths were kept at each fork.
#[derive(Clone, Debug, Default)]
pub(crate) struct History {
    /// 2 p + v: the path before and the payload bit.
    kept: Vec<u32>,
    /// Where each fork begins in `kept`.
    starts: Vec<usize>,
}

impl History {
    pub(crate) fn push(&mut self, kept: &[u32]) {
        self.starts.push(self.kept.len());
        self.kept.extend_from_slice(kept);
    }

    fn payload(&self, mut path: usize) -> Vec<bool> {
        let mut payload = vec![false; self.starts.len()];
        for (bit, &start) in payload.iter_mut().zip(&self.starts).rev() {
            let kept = self.kept[start + path];
            *bit = kept & 1 == 1;
            path = kept as usize >> 1;
        }
        payload
    }
}

/// What a list holds in the end, the most likely payload first: an iterator of [`Candidate`]s.
///
/// Payloads are put together when they are asked for, so that whoever finds his among the first does not wait for the others.
#[derive(Clone, Debug)]
pub struct Candidates {
    history: History,
    metrics: Vec<f32>,
    /// Paths that are still to come, the last first.
    order: Vec<u32>,
}

/// A payload, and how well it fits.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Candidate {
    /// As it was given to `encode`.
    pub payload: Vec<bool>,
    /// −ln P(codeword | ratios), natural logarithm, where all words of the code's length are equally likely before. The difference of two is the
    /// logarithm of how many times likelier the one is.
    pub metric: f32,
}

impl Candidates {
    pub(crate) fn new(history: History, metrics: Vec<f32>) -> Self {
        let mut order: Vec<u32> = (0..metrics.len() as u32).collect();
        order.sort_by(|&a, &b| {
            metrics[b as usize]
                .total_cmp(&metrics[a as usize])
                .then(b.cmp(&a))
        });
        Self {
            history,
            metrics,
            order,
        }
    }
}

impl Iterator for Candidates {
    type Item = Candidate;

    fn next(&mut self) -> Option<Candidate> {
        let path = self.order.pop()? as usize;
        Some(Candidate {
            payload: self.history.payload(path),
            metric: self.metrics[path],
        })
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        (self.order.len(), Some(self.order.len()))
    }
}

impl ExactSizeIterator for Candidates {}
