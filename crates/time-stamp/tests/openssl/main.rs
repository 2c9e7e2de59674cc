//! A second opinion: queries, replies and verdicts of OpenSSL beside ours, of good stamps and of bad ones.
#![allow(clippy::unwrap_used)] // in the helpers of tests, too

mod authority;
mod certificates;
mod changed;
mod comparison;
mod stamps;
mod statements;
