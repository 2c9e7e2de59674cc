//! METIS' text format for graphs.

use std::fmt::Write;

use crate::{Graph, PartitionError};

/// Reads a graph in METIS' text format: a line "#V #E \[fmt \[ncon\]\]", then a line per vertex with its weight (when
/// the second digit of fmt is 1) and its neighbours from 1, each followed by the edge's weight (when the last digit is
/// 1). Lines that begin with % are comments. Vertex sizes (first digit) are read over; one weight per vertex at most.
///
/// ```
/// let text = "% a triangle\n3 3\n2 3\n1 3\n1 2\n";
/// assert_eq!(partition::read_metis(text)?.edge_count(), 3);
/// # Ok::<(), partition::PartitionError>(())
/// ```
///
/// # Errors
/// [`PartitionError::Format`] with the line; or what [`Graph::new`] says of the graph.
pub fn read_metis(text: &str) -> Result<Graph, PartitionError> {
    let mut lines = text
        .lines()
        .enumerate()
        .filter(|(_, line)| !line.starts_with('%'));
    let header = lines.by_ref().find(|(_, line)| !line.trim().is_empty());
    let Some((first, header)) = header else {
        return Err(problem(
            0,
            "no header; expected \"vertices edges [format [weights per vertex]]\"",
        ));
    };
    let header = Header::parse(first, header)?;
    // Two bytes are the least that a vertex (its line's end) or an entry takes: counts beyond the text are refused.
    if header.vertices > text.len() || header.edges > text.len() {
        return Err(problem(
            first,
            "the header promises more vertices or edges than the file can hold",
        ));
    }
    let mut offsets = Vec::with_capacity(header.vertices + 1);
    offsets.push(0);
    let (mut neighbours, mut edge_weights, mut vertex_weights) = (Vec::new(), Vec::new(), Vec::new());
    for vertex in 0..header.vertices {
        let Some((number, line)) = lines.next() else {
            let message = format!("only {vertex} of {} vertices follow", header.vertices);
            return Err(problem(first, &message));
        };
        let mut fields = line.split_ascii_whitespace().map(|field| integer(number, field));
        if header.sizes {
            fields.next().transpose()?;
        }
        if header.vertex_weights {
            let weight = fields
                .next()
                .unwrap_or_else(|| Err(problem(number, "the vertex weight is missing")))?;
            vertex_weights.push(weight_of(number, weight)?);
        }
        while let Some(neighbour) = fields.next() {
            neighbours.push(neighbour_of(number, neighbour?, header.vertices)?);
            if header.edge_weights {
                let weight = fields
                    .next()
                    .unwrap_or_else(|| Err(problem(number, "an edge weight is missing")))?;
                edge_weights.push(weight_of(number, weight)?);
            }
        }
        offsets.push(neighbours.len());
    }
    if let Some((number, _)) = lines.find(|(_, line)| !line.trim().is_empty()) {
        return Err(problem(number, "more lines than vertices"));
    }
    if neighbours.len() != 2 * header.edges {
        let found = neighbours.len();
        let message = format!(
            "{} edges promised, but {found} entries found, not twice as many",
            header.edges
        );
        return Err(problem(first, &message));
    }
    let vertex_weights = header.vertex_weights.then_some(vertex_weights);
    Graph::new(
        offsets,
        neighbours,
        vertex_weights,
        header.edge_weights.then_some(edge_weights),
    )
}

/// Writes a graph in METIS' text format, with weights only where one differs from 1.
pub fn write_metis(graph: &Graph) -> String {
    let vertex_weights = graph.vertex_weights.iter().any(|&w| w != 1);
    let edge_weights = graph.edge_weights.iter().any(|&w| w != 1);
    let mut text = format!("{} {}", graph.vertex_count(), graph.edge_count());
    if vertex_weights || edge_weights {
        let _ = write!(text, " 0{}{}", u8::from(vertex_weights), u8::from(edge_weights));
    }
    text.push('\n');
    for v in 0..graph.vertex_count() {
        let mut fields: Vec<String> = Vec::new();
        if vertex_weights {
            fields.push(graph.vertex_weights[v].to_string());
        }
        for (u, weight) in graph.edges(v) {
            fields.push((u + 1).to_string());
            if edge_weights {
                fields.push(weight.to_string());
            }
        }
        text.push_str(&fields.join(" "));
        text.push('\n');
    }
    text
}

struct Header {
    vertices: usize,
    edges: usize,
    sizes: bool,
    vertex_weights: bool,
    edge_weights: bool,
}

impl Header {
    fn parse(line: usize, text: &str) -> Result<Self, PartitionError> {
        let fields: Vec<&str> = text.split_ascii_whitespace().collect();
        if !(2..=4).contains(&fields.len()) {
            return Err(problem(
                line,
                "the header has the form \"vertices edges [format [weights per vertex]]\"",
            ));
        }
        let count = |field: &str| {
            usize::try_from(integer(line, field)?).map_err(|_| problem(line, "a count is negative"))
        };
        let format = fields.get(2).copied().unwrap_or("0");
        if format.len() > 3 || !format.bytes().all(|b| b == b'0' || b == b'1') {
            return Err(problem(
                line,
                "the format field consists of at most three digits 0 or 1",
            ));
        }
        let flag = |from_right: usize| format.bytes().rev().nth(from_right) == Some(b'1');
        if fields.get(3).is_some_and(|&n| n != "1") {
            return Err(problem(line, "only one weight per vertex is supported"));
        }
        let (vertices, edges) = (count(fields[0])?, count(fields[1])?);
        Ok(Self {
            vertices,
            edges,
            sizes: flag(2),
            vertex_weights: flag(1),
            edge_weights: flag(0),
        })
    }
}

fn problem(line: usize, what: &str) -> PartitionError {
    PartitionError::Format {
        line: line + 1,
        problem: what.to_owned(),
    }
}

fn integer(line: usize, field: &str) -> Result<i64, PartitionError> {
    field
        .parse()
        .map_err(|_| problem(line, &format!("{field:?} is not an integer")))
}

fn weight_of(line: usize, weight: i64) -> Result<i32, PartitionError> {
    i32::try_from(weight).map_err(|_| problem(line, &format!("weight {weight} does not fit in 32 bits")))
}

fn neighbour_of(line: usize, neighbour: i64, vertices: usize) -> Result<u32, PartitionError> {
    match usize::try_from(neighbour) {
        Ok(from_one) if (1..=vertices).contains(&from_one) => Ok(from_one as u32 - 1),
        _ => Err(problem(
            line,
            &format!("neighbour {neighbour} is not in 1..={vertices}"),
        )),
    }
}
