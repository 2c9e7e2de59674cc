//! Hands libFuzzer's inputs to the target that is named as this program is.
#![no_main]

use std::sync::LazyLock;

use fuzzing::Target;

static TARGET: LazyLock<&Target> =
    LazyLock::new(|| Target::named(env!("CARGO_BIN_NAME")).expect("each program is named after a target"));

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| TARGET.check(bytes));
