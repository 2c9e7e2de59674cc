//! What is fuzzed, without a fuzzer: every seed, and some thousand mangled ones.

use fuzzing::{TARGETS, Target};
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::Index;
use proptest::test_runner::{Config, TestRunner};

/// What happens to a file on its way.
#[derive(Clone, Debug)]
enum Change {
    Byte(Index, u8),
    Cut(Index, usize),
    Twice(Index, usize),
    /// Bytes of another seed in the place of one's own.
    Splice(Index, Index, usize),
    Word(Index, &'static [u8]),
}

/// Words at which readers of numbers and of lengths have stumbled.
const WORDS: [&[u8]; 12] = [
    b"-1",
    b"0",
    b"4294967296",
    b"18446744073709551615",
    b"1e999",
    b"nan",
    b"-0",
    b"1e-46",
    b"\xFF\xFF\xFF\xFF",
    b"\0\0\0\0",
    b"\n",
    b"\xC3",
];

fn change() -> impl Strategy<Value = Change> {
    let at = any::<Index>;
    prop_oneof![
        (at(), any::<u8>()).prop_map(|(at, byte)| Change::Byte(at, byte)),
        (at(), 1..40_usize).prop_map(|(at, length)| Change::Cut(at, length)),
        (at(), 1..200_usize).prop_map(|(at, length)| Change::Twice(at, length)),
        (at(), at(), 1..200_usize).prop_map(|(at, from, length)| Change::Splice(at, from, length)),
        (at(), prop::sample::select(&WORDS[..])).prop_map(|(at, word)| Change::Word(at, word)),
    ]
}

impl Change {
    fn apply(&self, bytes: &mut Vec<u8>, other: &[u8]) {
        let place = |at: &Index, length: usize, of: usize| {
            let start = at.index(of + 1);
            start..(start + length).min(of)
        };
        let count = bytes.len();
        match self {
            Self::Byte(at, byte) => drop(bytes.splice(place(at, 1, count), [*byte])),
            Self::Cut(at, length) => drop(bytes.drain(place(at, *length, count))),
            Self::Twice(at, length) => {
                let range = place(at, *length, count);
                let copy = bytes[range.clone()].to_vec();
                drop(bytes.splice(range.start..range.start, copy));
            }
            Self::Splice(at, from, length) => {
                let copy = other[place(from, *length, other.len())].to_vec();
                drop(bytes.splice(place(at, *length, count), copy));
            }
            Self::Word(at, word) => drop(bytes.splice(place(at, 1, count), word.iter().copied())),
        }
    }
}

/// A target whose inputs take longer is tried on fewer of them. With `PROPTEST_CASES=2560` it is ten times as many.
fn cases(target: &Target) -> u32 {
    let cases = match target.name {
        "claim" => 100,
        "keys" => 300,
        "stamp" | "roots" | "gzip" => 1000,
        _ => 3000,
    };
    cases * Config::default().cases / 256
}

fn check_mangled(target: &Target) {
    let seeds = target.seeds();
    let mut runner = TestRunner::new(Config {
        cases: cases(target),
        failure_persistence: None,
        ..Config::default()
    });
    let strategy = (any::<Index>(), any::<Index>(), vec(change(), 1..6));
    let checked = runner.run(&strategy, |(seed, other, changes)| {
        let (mut bytes, other) = (seed.get(&seeds).clone(), other.get(&seeds));
        for change in changes {
            change.apply(&mut bytes, other);
        }
        target.check(&bytes);
        Ok(())
    });
    if let Err(error) = checked {
        panic!("{}: {error}", target.name);
    }
}

#[test]
fn seeds_hold_what_must_hold() {
    for target in TARGETS {
        let seeds = target.seeds();
        assert!(!seeds.is_empty(), "{}", target.name);
        for seed in seeds {
            target.check(&seed);
        }
    }
}

#[test]
fn mangled_seeds_hold_what_must_hold() {
    // Side by side, as tests are.
    std::thread::scope(|scope| {
        for target in TARGETS {
            scope.spawn(|| check_mangled(target));
        }
    });
}

/// cargo-fuzz has a program for each target, and no other.
#[test]
fn every_target_is_a_program_of_cargo_fuzz() {
    let manifest = include_str!("../../../fuzz/Cargo.toml");
    let (_, programs) = manifest.split_once("[[bin]]").expect("programs");
    let names = programs.lines().filter_map(|line| line.strip_prefix("name = "));
    let names: Vec<_> = names.map(|name| name.trim_matches('"')).collect();
    let targets: Vec<_> = TARGETS.iter().map(|target| target.name).collect();
    assert_eq!(names, targets);
}
