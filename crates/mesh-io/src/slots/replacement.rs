use crate::scalar::Scalar;

/// A coordinate that a file cannot hold.
#[derive(Debug)]
pub(crate) struct Refusal {
    pub(crate) file_vertex: usize,
    pub(crate) value: f64,
    pub(crate) problem: &'static str,
}

const OVERFLOW: &str = "the file holds 32-bit floating point numbers, up to 3.4e38: scale the model down";
const INTEGERS: &str = "the file holds its coordinates as integers: convert them to float or double first";

/// What to write where `old` stands so that it becomes `value`, rounded to `kind`; `None` where it is that already.
pub(super) fn replacement(old: f64, value: f64, kind: Scalar) -> Result<Option<f64>, &'static str> {
    match kind {
        _ if value == old => Ok(None),
        // Before they are compared as what they are rounded to: all that overflow become the same.
        Scalar::F32 if (value as f32).is_infinite() => Err(OVERFLOW),
        Scalar::F32 if value as f32 == old as f32 => Ok(None),
        Scalar::F32 => Ok(Some(f64::from(value as f32))),
        Scalar::F64 => Ok(Some(value)),
        _ => Err(INTEGERS),
    }
}

/// The axes in the order in which their numbers stand.
pub(super) fn axes_in_order(starts: [usize; 3]) -> [usize; 3] {
    let mut axes = [0, 1, 2];
    axes.sort_by_key(|&axis| starts[axis]);
    axes
}
