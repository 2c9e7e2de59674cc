//! What is fuzzed, without a fuzzer: every seed, and some thousand mangled ones.

use fuzzing::TARGETS;
use proptest::prelude::*;
use proptest::test_runner::{Config, TestRunner};

#[test]
fn seeds_are_good() {
    for target in TARGETS {
        let seeds = target.seeds();
        assert!(!seeds.is_empty(), "{}", target.name);
        for seed in seeds {
            target.check(&seed);
        }
    }
}
