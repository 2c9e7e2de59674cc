//! The decoder against slow ones.
#![allow(clippy::unwrap_used)] // helpers outside of #[test] functions

mod common;

use code::{CheckNodes, LISTS, PolarCode};
use common::{brute_force, exact, metric, min_sum, multiplied, random, random_bits, received, successive};

fn plain(bits: usize, length: usize) -> PolarCode {
    let positions: Vec<usize> = PolarCode::new(bits, length).unwrap().positions().collect();
    PolarCode::of_positions(length, &positions, 1).unwrap()
}

#[test]
fn a_plain_code_multiplies_by_the_matrix() {
    let code = plain(40, 128);
    let payload = random_bits(40, &mut random(1));
    let mut u = vec![false; 128];
    for (i, &bit) in code.positions().zip(&payload) {
        u[i] = bit;
    }
    assert_eq!(code.encode(&payload).unwrap(), multiplied(&u));
}

/// In how many of 100 frames a list of one says what plain successive cancellation does, and how often that is not the payload.
fn same_and_wrong(check_nodes: CheckNodes, check: fn(f64, f64) -> f64) -> (usize, usize) {
    let code = plain(32, 128).with_check_nodes(check_nodes);
    let carries: Vec<usize> = code.positions().collect();
    let (mut same, mut wrong) = (0, 0);
    for seed in 0..100 {
        let mut random = random(seed);
        let payload = random_bits(32, &mut random);
        let ratios = received(&code.encode(&payload).unwrap(), 0.4, &mut random);
        // Whole numbers have exact sums: min-sum makes many ties, which rounding would break this way or that.
        let whole = check_nodes == CheckNodes::MinSum;
        let ratios: Vec<f64> = ratios
            .iter()
            .map(|ratio| if whole { (16.0 * ratio).round() } else { *ratio })
            .collect();
        let frozen = |before: &[bool]| (!carries.contains(&before.len())).then_some(false);
        let u = successive(&ratios, check, frozen);
        let expected: Vec<bool> = carries.iter().map(|&i| u[i]).collect();
        let given = code.decode(&ratios, 1).unwrap().next().unwrap();
        same += usize::from(given.payload == expected);
        wrong += usize::from(expected != payload);
    }
    (same, wrong)
}

#[test]
fn a_list_of_one_is_successive_cancellation() {
    let (same, wrong) = same_and_wrong(CheckNodes::MinSum, min_sum);
    assert_eq!(same, 100);
    assert!(
        (10..90).contains(&wrong),
        "{wrong} are wrong, and else this proves little"
    );
    // Accurate check nodes are right to within a few hundredths, so that a bit which is nearly even may fall otherwise, and all after it.
    let (same, wrong) = same_and_wrong(CheckNodes::Accurate, exact);
    assert!(
        same >= 93 && (10..90).contains(&wrong),
        "{same} the same, {wrong} wrong"
    );
}

#[test]
fn a_list_with_room_for_all_payloads_is_in_the_order_of_their_likelihood() {
    for (seed, (bits, length)) in [
        (1, 2),
        (1, 16),
        (2, 2),
        (3, 8),
        (5, 16),
        (8, 16),
        (8, 32),
        (1, 128),
    ]
    .into_iter()
    .enumerate()
    {
        let code = PolarCode::new(bits, length).unwrap();
        for draw in 0..20 {
            let mut random = random(100 * seed as u64 + draw);
            let word = code.encode(&random_bits(bits, &mut random)).unwrap();
            let ratios = received(&word, 0.7, &mut random);
            let expected = brute_force(&code, &ratios);
            let given: Vec<_> = code.decode(&ratios, 1 << bits).unwrap().collect();
            assert_eq!(given.len(), expected.len());
            assert!(given.is_sorted_by(|a, b| a.metric <= b.metric));
            for candidate in &given {
                let exact = metric(&code.encode(&candidate.payload).unwrap(), &ratios);
                let bound = 0.02 * (length.ilog2() as usize + 1) as f64 * length as f64 / 2.0;
                assert!(
                    (f64::from(candidate.metric) - exact).abs() < bound.min(1.0),
                    "{} {exact}",
                    candidate.metric
                );
            }
            let exact_of_first = metric(&code.encode(&given[0].payload).unwrap(), &ratios);
            assert!(
                exact_of_first - expected[0].1 < 0.3,
                "the first is as likely as any"
            );
        }
    }
}

#[test]
fn metrics_of_min_sum_count_what_a_codeword_turns() {
    let code = PolarCode::new(64, 256)
        .unwrap()
        .with_check_nodes(CheckNodes::MinSum);
    let mut random = random(7);
    let word = code.encode(&random_bits(64, &mut random)).unwrap();
    let ratios = received(&word, 0.5, &mut random);
    let candidates = code.decode(&ratios, 64).unwrap();
    assert_eq!(candidates.len(), 64);
    for candidate in candidates {
        let word = code.encode(&candidate.payload).unwrap();
        let turned = word
            .iter()
            .zip(&ratios)
            .filter(|(bit, ratio)| **bit == (**ratio > 0.0));
        let sum: f64 = turned.map(|(_, ratio)| ratio.abs()).sum();
        assert!((f64::from(candidate.metric) - sum).abs() < 1e-3 * sum);
    }
}

#[test]
fn a_longer_list_offers_a_likelier_first_payload_and_finds_what_a_short_one_misses() {
    let code = PolarCode::new(128, 1024).unwrap();
    let (mut missed, mut found) = (0, 0);
    for seed in 0..60 {
        let mut random = random(seed);
        let payload = random_bits(128, &mut random);
        let ratios = received(&code.encode(&payload).unwrap(), 16.0 * 16.0 / 1024.0, &mut random);
        let [short, long] = [1, 64].map(|list| code.decode(&ratios, list).unwrap().collect::<Vec<_>>());
        assert!(long[0].metric <= short[0].metric + 1e-3);
        if short[0].payload != payload {
            missed += 1;
            found += usize::from(long.iter().any(|candidate| candidate.payload == payload));
        }
    }
    assert!(missed >= 10 && 2 * found > missed, "{found} of {missed}");
}

#[test]
fn a_search_says_which_list_had_it_and_gives_up_when_none_has() {
    let code = PolarCode::new(128, 1024).unwrap();
    let payload = random_bits(128, &mut random(3));
    let ratios = received(&code.encode(&payload).unwrap(), 0.6, &mut random(4));
    let found = code
        .search(&ratios, &LISTS, |candidate| candidate == payload)
        .unwrap()
        .unwrap();
    assert_eq!((found.payload, found.list, found.tried), (payload, 32, 1));
    let mut asked = 0;
    let none = code.search(&ratios, &[4, 8], |_| {
        asked += 1;
        false
    });
    assert_eq!((none, asked), (Ok(None), 12));
}
