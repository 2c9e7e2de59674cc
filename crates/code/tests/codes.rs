//! What holds for every code, and for hard input.
#![allow(clippy::unwrap_used)] // helpers outside of #[test] functions

mod common;

use code::{CheckNodes, CodeError, PolarCode};
use common::{random, random_bits, received};
use proptest::prelude::*;

/// Codes of up to 512 bits, of our positions and convolution or of any.
fn codes() -> impl Strategy<Value = PolarCode> {
    let sizes = (1u32..=9).prop_flat_map(|n| (Just(1usize << n), 1..=1usize << n));
    (sizes, prop::option::of(any::<u64>())).prop_map(|((length, bits), seed)| match seed {
        None => PolarCode::new(bits, length).unwrap(),
        Some(seed) => {
            let mut positions: Vec<usize> = (0..length).collect();
            positions.sort_by_key(|&i| (i as u64 ^ seed).wrapping_mul(0x9E37_79B9_7F4A_7C15));
            positions.truncate(bits);
            PolarCode::of_positions(length, &positions, seed | 1).unwrap()
        }
    })
}

fn certain(word: &[bool], ratio: f64) -> Vec<f64> {
    word.iter().map(|&bit| if bit { -ratio } else { ratio }).collect()
}

fn sum(a: &[bool], b: &[bool]) -> Vec<bool> {
    a.iter().zip(b).map(|(a, b)| a ^ b).collect()
}

proptest! {
    #[test]
    fn encoding_is_linear(code in codes(), seed in any::<u64>()) {
        let mut random = random(seed);
        let [a, b] = [0, 1].map(|_| random_bits(code.payload_bits(), &mut random));
        let encode = |payload: &[bool]| code.encode(payload).unwrap();
        prop_assert_eq!(encode(&sum(&a, &b)), sum(&encode(&a), &encode(&b)));
    }

    #[test]
    fn what_is_received_without_noise_is_the_payload(code in codes(), seed in any::<u64>(), list in 1usize..40, scale in -3i32..12) {
        let payload = random_bits(code.payload_bits(), &mut random(seed));
        let ratios = certain(&code.encode(&payload).unwrap(), 10f64.powi(scale));
        for check_nodes in [CheckNodes::Accurate, CheckNodes::MinSum] {
            let code = code.clone().with_check_nodes(check_nodes);
            let best = code.decode(&ratios, list).unwrap().next().unwrap();
            if scale >= 1 || check_nodes == CheckNodes::MinSum {
                prop_assert_eq!(&best.payload, &payload);
            }
        }
    }

    #[test]
    fn candidates_differ_and_their_metrics_ascend(code in codes(), seed in any::<u64>(), list in 1usize..70, most in prop::sample::select(vec![0.0, 1e-30, 1.0, 50.0, 1e9, f64::MAX])) {
        let mut random = random(seed);
        let noise = received(&vec![false; code.length()], 0.01, &mut random);
        let ratios: Vec<f64> = noise.iter().map(|x| (x / 0.04).clamp(-1.0, 1.0) * most).collect();
        let candidates: Vec<_> = code.decode(&ratios, list).unwrap().collect();
        let all = 1usize.checked_shl(code.payload_bits() as u32).unwrap_or(usize::MAX);
        prop_assert_eq!(candidates.len(), list.min(all));
        prop_assert!(candidates.iter().all(|candidate| candidate.metric.is_finite() && candidate.metric >= 0.0));
        prop_assert!(candidates.is_sorted_by(|a, b| a.metric <= b.metric));
        let mut payloads: Vec<_> = candidates.into_iter().map(|candidate| candidate.payload).collect();
        payloads.sort();
        payloads.dedup();
        prop_assert_eq!(payloads.len(), list.min(all));
    }

    #[test]
    fn chips_of_a_bit_add_up(code in codes(), chips in 0usize..2000) {
        let ratios: Vec<f64> = (0..chips).map(|t| t as f64).collect();
        let folded = code.fold(&ratios);
        for (j, &ratio) in folded.iter().enumerate() {
            prop_assert_eq!(ratio, (j..chips).step_by(code.length()).map(|t| t as f64).sum::<f64>());
        }
    }
}

#[test]
fn a_third_of_the_bits_may_be_missing() {
    for (bits, length) in [(128, 1024), (512, 2048)] {
        let code = PolarCode::new(bits, length).unwrap();
        for seed in 0..5 {
            let mut random = random(seed);
            let payload = random_bits(bits, &mut random);
            let mut ratios = certain(&code.encode(&payload).unwrap(), 5.0);
            let gone = random_bits(2 * length, &mut random);
            for j in 0..length {
                if gone[j] && (gone[length + j] || j % 3 == 0) {
                    ratios[j] = 0.0;
                }
            }
            let found = code
                .search(&ratios, &[8, 64], |candidate| candidate == payload)
                .unwrap();
            assert!(found.is_some(), "{bits} bits, draw {seed}");
        }
    }
}

#[test]
fn no_knowledge_at_all_gives_the_first_payloads() {
    let code = PolarCode::new(3, 64).unwrap();
    let payloads: Vec<_> = code
        .decode(&[0.0; 64], 8)
        .unwrap()
        .map(|candidate| candidate.payload)
        .collect();
    assert_eq!(payloads[0], [false; 3]);
    assert_eq!(payloads[1], [false, false, true]);
    assert_eq!(payloads[7], [true; 3]);
}

#[test]
fn codes_never_change() {
    // What is in a shape was written by the code of its day.
    let digest = |bits: usize, length: usize| {
        let code = PolarCode::new(bits, length).unwrap();
        let word = code.encode(&random_bits(bits, &mut random(2012))).unwrap();
        let step = |hash: u64, bit: &bool| (hash ^ u64::from(*bit)).wrapping_mul(0x0100_0000_01B3);
        word.iter().fold(0xCBF2_9CE4_8422_2325, step)
    };
    let digests = [digest(128, 1024), digest(512, 2048), digest(512, 8192)];
    assert_eq!(
        digests,
        [
            8_843_944_581_793_159_545,
            11_873_017_902_480_715_733,
            12_340_475_349_366_437_477
        ]
    );
}

#[test]
fn lengths_follow_the_chips() {
    let length = |bits, chips| PolarCode::for_chips(bits, chips).map(|code| code.length());
    for (bits, chips, expected) in [
        (128, 128, 256),
        (128, 300, 256),
        (128, 1536, 1024),
        (128, 50_000, 2048),
        (512, 600, 1024),
        (512, 1536, 1024),
        (512, 7680, 4096),
        (512, 50_000, 8192),
        (1, 1, 2),
    ] {
        assert_eq!(length(bits, chips), Ok(expected), "{bits} in {chips}");
    }
    assert_eq!(
        length(128, 127),
        Err(CodeError::PayloadBits {
            bits: 128,
            length: 127
        })
    );
    assert!(length(0, 10).is_err() && length(10_000, 100_000).is_err());
}

#[test]
fn what_makes_no_sense_is_refused() {
    let most = PolarCode::LONGEST;
    for length in [0, 1, 3, 1000, 2 * most] {
        assert_eq!(
            PolarCode::new(1, length).err(),
            Some(CodeError::Length { length, most })
        );
    }
    for bits in [0, 17] {
        assert_eq!(
            PolarCode::new(bits, 16).err(),
            Some(CodeError::PayloadBits { bits, length: 16 })
        );
    }
    for (positions, wrong) in [([0, 16], 16), ([5, 5], 5)] {
        let refused = PolarCode::of_positions(16, &positions, 1).err();
        assert_eq!(
            refused,
            Some(CodeError::Position {
                position: wrong,
                length: 16
            })
        );
    }
    assert_eq!(
        PolarCode::of_positions(16, &[15], 2).err(),
        Some(CodeError::Generator { generator: 2 })
    );

    let code = PolarCode::new(4, 16).unwrap();
    assert!(matches!(
        code.encode(&[true; 5]),
        Err(CodeError::Count {
            given: 5,
            expected: 4,
            ..
        })
    ));
    assert!(matches!(
        code.decode(&[0.0; 15], 1),
        Err(CodeError::Count {
            given: 15,
            expected: 16,
            ..
        })
    ));
    for list in [0, PolarCode::LONGEST_LIST + 1] {
        assert!(matches!(
            code.decode(&[0.0; 16], list),
            Err(CodeError::List { .. })
        ));
    }
    for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let mut ratios = [1.0; 16];
        ratios[3] = value;
        assert!(matches!(
            code.decode(&ratios, 1),
            Err(CodeError::NotFinite { index: 3, .. })
        ));
    }
}
