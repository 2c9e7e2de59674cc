/// Why a code could not be made, or a word not be encoded or decoded.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CodeError {
    /// The length of the code is no power of two, or out of range.
    #[error("a polar code of length {length}: give a power of two from 2 to {most}")]
    Length {
        /// The length asked for.
        length: usize,
        /// The longest that there is.
        most: usize,
    },
    /// No payload, or more of it than the code has bits.
    #[error("{bits} bits of payload in a code of length {length}: give 1 to {length}")]
    PayloadBits {
        /// The payload asked for.
        bits: usize,
        /// The length of the code.
        length: usize,
    },
    /// A position that the code does not have, or that was given twice.
    #[error(
        "position {position} is out of range or given twice; give each at most once, from 0 to below {length}"
    )]
    Position {
        /// The position.
        position: usize,
        /// The length of the code.
        length: usize,
    },
    /// A convolution whose output does not tell its input.
    #[error("generator {generator:#x} has g_0 = 0; set its lowest bit")]
    Generator {
        /// The coefficients.
        generator: u64,
    },
    /// A payload or a vector of log-likelihood ratios has the wrong length.
    #[error("{given} {what} for a code that takes {expected}; make the code anew or give as many")]
    Count {
        /// What was counted.
        what: &'static str,
        /// How many there are.
        given: usize,
        /// How many the code takes.
        expected: usize,
    },
    /// A log-likelihood ratio is not a number, or infinite.
    #[error("log-likelihood ratio {index} is {value}; give finite numbers, and 0 where nothing is known")]
    NotFinite {
        /// Its position.
        index: usize,
        /// Its value.
        value: f64,
    },
    /// A list without room for a path, or longer than can be kept.
    #[error("a list of {list} paths: give 1 to {most}")]
    List {
        /// The length asked for.
        list: usize,
        /// The longest that there is.
        most: usize,
    },
}
