//! Extremes: empty, edgeless, disconnected, stars, cliques, long paths, uneven weights and numbers out of range.
#![allow(clippy::unwrap_used)] // helpers outside of #[test] functions

use job::Job;
use partition::{Effort, Graph, Method, Options, Partition, PartitionError, read_metis};

fn partition(graph: &Graph, options: &Options) -> Result<Partition, PartitionError> {
    partition::partition(graph, options, &Job::default())
}

fn path(count: u32) -> Graph {
    Graph::from_edges(
        count as usize,
        &(1..count).map(|v| (v - 1, v, 1)).collect::<Vec<_>>(),
    )
    .unwrap()
}

fn star(leaves: u32) -> Graph {
    Graph::from_edges(
        leaves as usize + 1,
        &(1..=leaves).map(|v| (0, v, 1)).collect::<Vec<_>>(),
    )
    .unwrap()
}

fn clique(count: u32) -> Graph {
    let edges: Vec<_> = (0..count).flat_map(|a| (0..a).map(move |b| (a, b, 1))).collect();
    Graph::from_edges(count as usize, &edges).unwrap()
}

fn grid(width: u32, height: u32) -> Graph {
    let at = |x: u32, y: u32| y * width + x;
    let mut edges = Vec::new();
    for y in 0..height {
        for x in 0..width {
            if x + 1 < width {
                edges.push((at(x, y), at(x + 1, y), 1));
            }
            if y + 1 < height {
                edges.push((at(x, y), at(x, y + 1), 1));
            }
        }
    }
    Graph::from_edges((width * height) as usize, &edges).unwrap()
}

fn into(parts: usize) -> Options {
    Options {
        parts,
        ..Default::default()
    }
}

#[test]
fn no_parts_more_parts_than_vertices_and_the_empty_graph_are_refused() {
    let empty = Graph::from_edges(0, &[]).unwrap();
    for (graph, parts) in [(&empty, 0), (&empty, 1), (&path(5), 0), (&path(5), 6)] {
        let vertices = graph.vertex_count();
        assert_eq!(
            partition(graph, &into(parts)),
            Err(PartitionError::Parts { parts, vertices })
        );
    }
}

#[test]
fn one_part_takes_all_and_as_many_parts_as_vertices_take_one_each() {
    for graph in [
        path(30),
        star(29),
        clique(30),
        Graph::from_edges(30, &[]).unwrap(),
    ] {
        assert_eq!(partition(&graph, &into(1)).unwrap().cut, 0);
        let mut single = partition(&graph, &into(30)).unwrap();
        single.part_of.sort_unstable();
        assert_eq!(single.part_of, (0..30).collect::<Vec<_>>());
        assert_eq!(single.cut, graph.edge_count() as i64);
    }
}

#[test]
fn options_out_of_range_are_refused_by_name() {
    let graph = path(10);
    for imbalance in [-0.1, f64::NAN, f64::INFINITY] {
        let result = partition(&graph, &Options { imbalance, ..into(2) });
        assert!(matches!(result, Err(PartitionError::Imbalance { .. })));
    }
    let targets = |weights: &[f64]| {
        partition(
            &graph,
            &Options {
                target_weights: Some(weights.to_vec()),
                ..into(2)
            },
        )
        .unwrap_err()
    };
    assert!(matches!(
        targets(&[1.0]),
        PartitionError::Length {
            given: 1,
            expected: 2,
            ..
        }
    ));
    assert_eq!(
        targets(&[1.0, 0.0]),
        PartitionError::TargetWeight { part: 1, weight: 0.0 }
    );
    assert!(matches!(
        targets(&[f64::NAN, 1.0]),
        PartitionError::TargetWeight { part: 0, .. }
    ));
}

#[test]
fn faulty_rows_are_refused_with_their_place() {
    let rows = |offsets: &[usize], neighbours: &[u32]| {
        Graph::new(offsets.to_vec(), neighbours.to_vec(), None, None).unwrap_err()
    };
    assert!(matches!(rows(&[], &[]), PartitionError::Length { .. }));
    assert_eq!(
        rows(&[1, 1], &[0]),
        PartitionError::Offsets { index: 0, value: 1 }
    );
    assert_eq!(
        rows(&[0, 2, 1], &[1, 0]),
        PartitionError::Offsets { index: 2, value: 1 }
    );
    assert_eq!(
        rows(&[0, 1, 3], &[1, 0]),
        PartitionError::Offsets { index: 2, value: 3 }
    );
    assert_eq!(rows(&[0, 1], &[0]), PartitionError::SelfLoop { vertex: 0 });
    assert_eq!(
        rows(&[0, 1, 2], &[2, 0]),
        PartitionError::NeighbourOutOfRange {
            vertex: 0,
            neighbour: 2,
            count: 2
        }
    );
    assert_eq!(
        rows(&[0, 2, 4], &[1, 1, 0, 0]),
        PartitionError::DuplicateEdge {
            vertex: 0,
            neighbour: 1
        }
    );
    assert_eq!(
        rows(&[0, 1, 1], &[1]),
        PartitionError::Asymmetric {
            vertex: 0,
            neighbour: 1
        }
    );
    assert_eq!(
        rows(&[0, 0, 1], &[0]),
        PartitionError::Asymmetric {
            vertex: 1,
            neighbour: 0
        }
    );
}

#[test]
fn weights_that_are_negative_zero_unequal_or_too_heavy_are_refused() {
    let edge = |vertex_weights: Vec<i32>, edge_weights: Vec<i32>| {
        Graph::new(
            vec![0, 1, 2],
            vec![1, 0],
            Some(vertex_weights),
            Some(edge_weights),
        )
    };
    assert!(edge(vec![0, 3], vec![2, 2]).is_ok());
    assert_eq!(
        edge(vec![1, -1], vec![1, 1]),
        Err(PartitionError::VertexWeight {
            vertex: 1,
            weight: -1
        })
    );
    let zero = PartitionError::EdgeWeight {
        vertex: 0,
        neighbour: 1,
        weight: 0,
    };
    assert_eq!(edge(vec![1, 1], vec![0, 0]), Err(zero));
    assert_eq!(
        edge(vec![1, 1], vec![1, 2]),
        Err(PartitionError::Asymmetric {
            vertex: 0,
            neighbour: 1
        })
    );
    let heavy = PartitionError::WeightSum {
        what: "vertices",
        total: 1 << 31,
    };
    assert_eq!(edge(vec![i32::MAX, 1], vec![1, 1]), Err(heavy));
    let doubled = Graph::from_edges(2, &[(0, 1, i32::MAX), (0, 1, 1)]);
    assert_eq!(
        doubled,
        Err(PartitionError::WeightSum {
            what: "edges",
            total: 1 << 31
        })
    );
    assert!(edge(vec![i32::MAX, 0], vec![i32::MAX, i32::MAX]).is_ok());
}

#[test]
fn edge_lists_are_made_symmetric_and_repetitions_add_up() {
    let graph = Graph::from_edges(3, &[(0, 1, 2), (1, 0, 2), (2, 2, 7), (2, 1, 1), (2, 1, 4)]).unwrap();
    assert_eq!(graph.edge_count(), 2);
    assert_eq!(graph.edge_weights(1), &[2, 5]);
    let outside = PartitionError::NeighbourOutOfRange {
        vertex: 0,
        neighbour: 3,
        count: 3,
    };
    assert_eq!(Graph::from_edges(3, &[(0, 3, 1)]), Err(outside));
}

#[test]
fn a_long_path_is_cut_once_between_parts() {
    let result = partition(
        &path(200_000),
        &Options {
            contiguous: true,
            ..into(8)
        },
    )
    .unwrap();
    assert_eq!((result.cut, result.balanced), (7, true));
    assert_eq!(result.components, vec![1; 8]);
}

#[test]
fn a_large_star_is_balanced_or_when_connected_parts_are_asked_for_keeps_its_hub_part() {
    let graph = star(100_000);
    let free = partition(&graph, &into(4)).unwrap();
    assert!(free.balanced);
    let connected = partition(
        &graph,
        &Options {
            contiguous: true,
            ..into(4)
        },
    )
    .unwrap();
    assert_eq!(connected.components, vec![1; 4]);
    assert!(!connected.balanced && connected.cut == 3);
}

#[test]
fn cliques_are_divided_evenly() {
    let result = partition(&clique(90), &into(3)).unwrap();
    assert_eq!((result.weights, result.cut), (vec![30; 3], 3 * 900));
}

#[test]
fn graphs_without_edges_and_of_many_components_are_balanced() {
    let none = partition(
        &Graph::from_edges(1000, &[]).unwrap(),
        &Options {
            contiguous: true,
            ..into(7)
        },
    )
    .unwrap();
    assert!(none.balanced && none.cut == 0);
    let triangles: Vec<_> = (0..300u32)
        .flat_map(|t| {
            [
                (3 * t, 3 * t + 1, 1),
                (3 * t + 1, 3 * t + 2, 1),
                (3 * t, 3 * t + 2, 1),
            ]
        })
        .collect();
    let result = partition(&Graph::from_edges(900, &triangles).unwrap(), &into(10)).unwrap();
    assert!(result.balanced && result.cut <= 20, "cut {}", result.cut);
}

#[test]
fn target_weights_are_met() {
    let graph = grid(60, 60);
    for method in [Method::Direct, Method::RecursiveBisection] {
        let targets = vec![1.0, 2.0, 3.0, 6.0];
        let options = Options {
            target_weights: Some(targets.clone()),
            method,
            contiguous: true,
            ..into(4)
        };
        let result = partition(&graph, &options).unwrap();
        assert!(result.balanced, "{:?}", result.weights);
        for (weight, target) in result.weights.iter().zip(targets) {
            assert!((*weight as f64) <= 1.03 * target * 300.0 && (*weight as f64) > 0.8 * target * 300.0);
        }
    }
}

#[test]
fn a_vertex_heavier_than_a_part_is_reported_and_the_others_fill_the_rest() {
    let graph = grid(10, 10)
        .with_vertex_weights((0..100).map(|v| if v == 0 { 1000 } else { 1 }).collect())
        .unwrap();
    let result = partition(&graph, &into(4)).unwrap();
    assert!(!result.balanced);
    assert_eq!(result.weights.iter().max(), Some(&1000));
}

#[test]
fn weightless_vertices_are_divided_too() {
    let graph = grid(8, 8).with_vertex_weights(vec![0; 64]).unwrap();
    let result = partition(&graph, &into(5)).unwrap();
    assert!(result.balanced && result.imbalance == 0.0);
    assert!((0..5).all(|part| result.part_of.contains(&part)));
}

#[test]
fn grids_are_cut_near_their_shortest_lines_at_every_effort() {
    let graph = grid(64, 64);
    for (effort, bound) in [(Effort::Fast, 90), (Effort::Default, 80), (Effort::High, 64)] {
        let result = partition(&graph, &Options { effort, ..into(2) }).unwrap();
        assert!(
            result.balanced && result.cut <= bound,
            "{effort:?}: {}",
            result.cut
        );
    }
}

#[test]
fn faulty_files_are_refused_with_their_line() {
    let line = |text: &str| match read_metis(text) {
        Err(PartitionError::Format { line, .. }) => line,
        other => panic!("{other:?}"),
    };
    assert_eq!(line(""), 1);
    assert_eq!(line("% only a comment\n"), 1);
    assert_eq!(line("3\n"), 1);
    assert_eq!(line("2 1 2\n2\n1\n"), 1);
    assert_eq!(line("2 1 011 3\n1 2 1\n1 1 1\n"), 1);
    assert_eq!(line("99999999999 1\n"), 1);
    assert_eq!(line("2 1\n2\n"), 1);
    assert_eq!(line("2 1\n2\nx\n"), 3);
    assert_eq!(line("2 1\n3\n1\n"), 2);
    assert_eq!(line("% comment\n2 1\n2\n0\n"), 4);
    assert_eq!(line("2 1\n2\n1\n1\n"), 4);
    assert_eq!(line("2 1 1\n2\n1 5\n"), 2);
    assert_eq!(line("2 1 1\n2 99999999999\n1 5\n"), 2);
    assert_eq!(line("3 1\n2\n1 3\n2\n"), 1);
    let weighted = read_metis("2 1 111 1\n9 4 2 7\n9 5 1 7\n").unwrap();
    assert_eq!(
        (weighted.vertex_weights(), weighted.edge_weights(0)),
        (&[4, 5][..], &[7][..])
    );
}

#[test]
fn the_heaviest_weights_that_are_allowed_do_not_overflow() {
    let share = i32::MAX / 20;
    let edges: Vec<_> = (1..20).map(|v| (v - 1, v, share)).collect();
    let heavy = Graph::from_edges(20, &edges)
        .unwrap()
        .with_vertex_weights(vec![share; 20])
        .unwrap();
    for method in [Method::Direct, Method::RecursiveBisection] {
        let result = partition(&heavy, &Options { method, ..into(4) }).unwrap();
        assert!(result.balanced);
        assert_eq!(result.cut, 3 * i64::from(share));
    }
    let single = Graph::from_edges(3, &[(0, 1, i32::MAX)]).unwrap();
    assert_eq!(partition(&single, &into(2)).unwrap().cut, 0);
}

#[test]
fn thousands_of_parts_are_balanced_and_none_is_empty() {
    let graph = grid(100, 100);
    let result = partition(&graph, &into(3000)).unwrap();
    assert!(result.balanced && result.weights.iter().all(|&w| w > 0));
}
