//! Polar codes for short payloads at low rates, decoded by successive cancellation with a list.
//!
//! A payload of k bits becomes N code bits, x = u F^⊗n with F = (1 0; 1 1) over GF(2) and N = 2ⁿ. u is a convolution of v, v holds the payload
//! at the k most reliable positions and zeros elsewhere. The decoder takes what a channel says of each code bit and returns a list of payloads, the
//! likeliest first; the caller knows the right one when he sees it, by a signature that checks or a digest that was committed to. So the code spends
//! no bits on a check of its own.
//!
//! ```
//! use code::{LISTS, PolarCode};
//!
//! // 1500 chips fill a code of length 1024; 476 code bits are sent twice.
//! let chips = 1500;
//! let code = PolarCode::for_chips(128, chips)?;
//! assert_eq!(code.length(), 1024);
//!
//! let payload: Vec<bool> = (0..128).map(|i| i % 3 == 0).collect();
//! let word = code.encode(&payload)?;
//! let sent: Vec<f64> = (0..chips).map(|t| if word[t % word.len()] { -1.0 } else { 1.0 }).collect();
//!
//! // A channel that turns every fifth chip, so that a chip says ln(0.8 / 0.2) for the bit it shows.
//! let received = sent.iter().enumerate().map(|(t, chip)| if t % 5 == 0 { -chip } else { *chip });
//! let ratios: Vec<f64> = received.map(|chip| 4f64.ln() * chip).collect();
//!
//! let best = code.decode(&code.fold(&ratios), 32)?.next().unwrap();
//! assert_eq!(best.payload, payload);
//!
//! // With a check, lists may grow until something passes it.
//! let found = code.search(&code.fold(&ratios), &LISTS, |candidate| candidate == payload)?.unwrap();
//! assert_eq!((found.list, found.tried), (32, 1));
//! # Ok::<(), code::CodeError>(())
//! ```
//!
//! # Conventions
//! Log-likelihood ratios are ln P(0) / P(1), natural logarithm: **positive for 0**, 0 where nothing is known. A code bit is sent as +1 for 0 and −1
//! for 1; in Gaussian noise of variance σ² around ±a, the ratio of y is 2 a y / σ². Positions count from 0, a payload's bits stand in ascending
//! positions, and chip t carries code bit t mod N. Equal input gives equal output on every platform: ties go to the payload whose bits were 0
//! first, and the arithmetic is single precision without fused or reordered operations. Nothing is random, nothing runs on other threads.
//!
//! What a code can do is counted in T₀ = √(n · a²/σ²) for n chips, the matched filter's signal-to-noise ratio, which repetition leaves as it is.
//!
//! # Method
//! Positions by β-expansion (He et al. 2017); a convolution before the transform, so that frozen bits are parities of the payload (Arıkan 2019, PAC
//! codes); lists (Tal and Vardy 2015) in the domain of ratios (Balatsoukas-Stimming, Bastani Parizi and Burg 2015); nodes without payload and with one
//! bit of it at their end are decoded at once (Sarkis et al. 2014).
//!
//! # Cost
//! O(L N log N) time and 4 L N bytes for a list of L paths. `results/code.md`, written by `cargo xtask bench code`, has seconds, error rates beside
//! the bounds for this length, and what other constructions did.
//!
//! # Where is what
//! | | |
//! |---|---|
//! | `polar.rs` | the code: made, encoding, decoding |
//! | `reliability.rs`, `precode.rs`, `transform.rs` | positions, convolution, polar transform |
//! | `plan.rs` | the tree of a code as a list of steps |
//! | `list/`, `kernels.rs` | the paths that take them; forks; the loops over ratios |
//! | `candidates.rs`, `search.rs` | what comes out, and lists that grow until something is accepted |
//!
//! # Source
//! Arıkan, *Channel polarization*, IEEE Trans. Inf. Theory 55 (2009); Tal and Vardy, *List decoding of polar codes*, ibid. 61 (2015).

mod candidates;
mod error;
mod kernels;
mod list;
mod plan;
mod polar;
mod precode;
mod reliability;
mod search;
mod transform;

pub use candidates::{Candidate, Candidates};
pub use error::CodeError;
pub use polar::{CheckNodes, PolarCode};
pub use search::{Found, LISTS};
