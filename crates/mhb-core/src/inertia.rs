use crate::SpectrumError;

/// How many eigenvalues lie below a shift σ, proved by Sylvester's law of inertia: A − σ I = L E Lᵀ has as many negative pivots in E.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InertiaCount {
    /// σ.
    pub shift: f64,
    /// The eigenvalues below it.
    pub below: usize,
}

impl InertiaCount {
    /// The count of a surface of that area, of which this is the count at unit area.
    pub(crate) fn scaled(self, area: f64) -> Self {
        let shift = self.shift / area;
        Self { shift, ..self }
    }
}

/// Fails where another number of the ascending `eigenvalues` lies below a shift than was counted.
pub(crate) fn check(counts: &[InertiaCount], eigenvalues: &[f64]) -> Result<(), SpectrumError> {
    for &InertiaCount { shift, below: proven } in counts {
        let found = eigenvalues.partition_point(|&l| l < shift);
        if found != proven {
            return Err(SpectrumError::Incomplete { shift, proven, found });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_pair_and_one_too_many_fail_the_check() {
        let counts = [(1.5, 2), (3.5, 4)].map(|(shift, below)| InertiaCount { shift, below });
        let all = [0.0, 1.0, 2.0, 3.0];
        assert_eq!(check(&counts, &all), Ok(()));
        for missing in 0..all.len() {
            let mut some = all.to_vec();
            some.remove(missing);
            let shift = if missing < 2 { 1.5 } else { 3.5 };
            let failed = check(&counts, &some).unwrap_err();
            assert!(
                matches!(failed, SpectrumError::Incomplete { shift: at, proven, found }
                if at == shift && found + 1 == proven)
            );
        }
        assert!(check(&counts, &[0.0, 1.0, 1.0, 2.0, 3.0]).is_err());
    }
}
