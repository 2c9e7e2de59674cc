//! Graphs in METIS' format: what is read is written alike, and can be divided.

use job::Job;
use partition::{Effort, Graph, Options, partition, read_metis, write_metis};

/// Larger graphs are read, but not divided: that takes longer than a fuzzer has.
const MOST_VERTICES: usize = 500;

pub(crate) fn check(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else {
        return;
    };
    let Ok(graph) = read_metis(text) else {
        return;
    };
    let again = read_metis(&write_metis(&graph)).expect("a graph that we wrote ourselves");
    assert_eq!(again, graph);
    if graph.vertex_count() <= MOST_VERTICES {
        for parts in [2, 5] {
            divide(&graph, parts);
        }
    }
}

fn divide(graph: &Graph, parts: usize) {
    let options = Options {
        parts,
        contiguous: parts == 2,
        effort: Effort::Fast,
        ..Default::default()
    };
    if let Ok(division) = partition(graph, &options, &Job::default()) {
        assert_eq!(division.part_of.len(), graph.vertex_count());
        assert!(division.part_of.iter().all(|&part| (part as usize) < parts));
    }
}

pub(crate) fn seeds() -> Vec<Vec<u8>> {
    let texts = [
        "% a triangle\n3 3\n2 3\n1 3\n1 2\n",
        "3 2 001\n2 7\n1 7 3 2\n2 2\n",
        "3 2 011\n4 2 7\n5 1 7 3 2\n6 2 2\n",
        "3 2 111 1\n1 4 2 7\n1 5 1 7 3 2\n1 6 2 2\n",
        "4 0\n\n\n\n\n",
        "1 0\n",
    ];
    let ladder = (0..20).flat_map(|i| [(i, i + 1, 1), (21 + i, 22 + i, 1), (i, 21 + i, 3)]);
    let ladder = Graph::from_edges(42, &ladder.collect::<Vec<_>>()).expect("a ladder");
    let mut seeds = texts.map(|text| text.as_bytes().to_vec()).to_vec();
    seeds.push(write_metis(&ladder).into_bytes());
    seeds
}
