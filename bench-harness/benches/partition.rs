//! Division into two and into many parts, at each effort and by each method; its phases one by one; nested dissection.
#![allow(missing_docs)]

use bench_harness::{edge_graph, surface};
use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use partition::bench::{Division, Hierarchy, separator};
use partition::{
    Effort, Graph, Method, Options, OrderingOptions, column_counts, nested_dissection, partition,
};

fn graph() -> Graph {
    edge_graph(&surface(40_000)).expect("the surface has few edges")
}

fn division(criterion: &mut Criterion) {
    let graph = graph();
    let with = |parts| Options {
        parts,
        ..Default::default()
    };
    let cases = [
        ("bisection", with(2)),
        ("64 parts", with(64)),
        (
            "64 parts, fast",
            Options {
                effort: Effort::Fast,
                ..with(64)
            },
        ),
        (
            "64 parts, high effort",
            Options {
                effort: Effort::High,
                ..with(64)
            },
        ),
        (
            "64 parts, recursive bisection",
            Options {
                method: Method::RecursiveBisection,
                ..with(64)
            },
        ),
        (
            "64 parts, connected",
            Options {
                contiguous: true,
                ..with(64)
            },
        ),
        (
            "64 parts, 2 threads",
            Options {
                threads: 2,
                ..with(64)
            },
        ),
    ];
    let mut group = criterion.benchmark_group("division");
    group.sample_size(10);
    for (name, options) in &cases {
        group.bench_function(*name, |bencher| bencher.iter(|| partition(&graph, options)));
    }
    group.finish();
}

/// Each phase as default effort runs it for 64 parts.
fn phases(criterion: &mut Criterion) {
    const PARTS: usize = 64;
    const COARSEST: usize = 30 * PARTS;
    let graph = graph();
    let mut group = criterion.benchmark_group("phase");
    group.sample_size(10);
    for threads in [1, 2] {
        group.bench_function(BenchmarkId::new("coarsening, threads", threads), |bencher| {
            bencher.iter(|| Hierarchy::new(&graph, COARSEST, threads));
        });
    }
    let hierarchy = Hierarchy::new(&graph, COARSEST, 1).expect("one thread is always there");
    let coarsest = hierarchy.coarsest().expect("the surface shrinks");
    for threads in [1, 2] {
        group.bench_function(
            BenchmarkId::new("division of the coarsest graph, threads", threads),
            |bencher| {
                bencher.iter(|| Division::initial(coarsest, PARTS, threads));
            },
        );
        let division = Division::initial(&graph, PARTS, threads).expect("the options are sound");
        group.bench_function(
            BenchmarkId::new("local search on the finest graph, threads", threads),
            |bencher| {
                bencher.iter(|| division.search());
            },
        );
        group.bench_function(
            BenchmarkId::new("flows on the finest graph, threads", threads),
            |bencher| {
                bencher.iter(|| division.flows());
            },
        );
    }
    let division = Division::initial(&graph, PARTS, 1).expect("the options are sound");
    group.bench_function("connection of the parts", |bencher| {
        bencher.iter(|| division.connect());
    });
    group.bench_function("separator", |bencher| {
        bencher.iter(|| separator(&graph, OrderingOptions::default().tries));
    });
    group.finish();
}

fn ordering(criterion: &mut Criterion) {
    let graph = graph();
    let mut group = criterion.benchmark_group("ordering");
    group.sample_size(10);
    for threads in [1, 2] {
        let options = OrderingOptions {
            threads,
            ..Default::default()
        };
        group.bench_function(
            BenchmarkId::new("nested dissection, threads", threads),
            |bencher| {
                bencher.iter(|| nested_dissection(&graph, &options));
            },
        );
    }
    let cases = [
        (
            "separators, one try",
            OrderingOptions {
                tries: 1,
                ..Default::default()
            },
        ),
        (
            "separators, eight tries",
            OrderingOptions {
                tries: 8,
                ..Default::default()
            },
        ),
        (
            "leaves of 400",
            OrderingOptions {
                leaf_size: 400,
                ..Default::default()
            },
        ),
    ];
    for (name, options) in &cases {
        group.bench_function(*name, |bencher| {
            bencher.iter(|| nested_dissection(&graph, options));
        });
    }
    let leaf = edge_graph(&surface(600)).expect("the surface has few edges");
    let whole = OrderingOptions {
        leaf_size: leaf.vertex_count(),
        ..Default::default()
    };
    group.bench_function("minimum fill, 642 vertices", |bencher| {
        bencher.iter(|| nested_dissection(&leaf, &whole));
    });
    let ordering = nested_dissection(&graph, &OrderingOptions::default()).expect("the graph is sound");
    group.bench_function("column counts", |bencher| {
        bencher.iter(|| column_counts(&graph, &ordering));
    });
    group.finish();
}

criterion_group!(benches, division, phases, ordering);
criterion_main!(benches);
