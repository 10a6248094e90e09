//! Order: a topological order of the passes that run, the order of declaration wherever there is a choice.
use super::access::Mode;
use super::declare::Graph;
use super::error::GraphError;

/// `before` must run earlier than `after` because of `resource`.
struct Edge {
    before: usize,
    after: usize,
    resource: usize,
}

/// The declared indices of the live passes in the order in which they run.
///
/// Only passes that run count: a cycle among passes that do not run is not found.
pub(super) fn order<W>(graph: &Graph<W>, live: &[bool]) -> Result<Vec<usize>, GraphError> {
    let edges = edges(graph, live);
    let mut waiting: Vec<usize> = (0..live.len()).filter(|&pass| live[pass]).collect();
    let mut order = Vec::with_capacity(waiting.len());
    while !waiting.is_empty() {
        let blocked = |pass| edges.iter().any(|edge| edge.after == pass && waiting.contains(&edge.before));
        let Some(next) = waiting.iter().position(|&pass| !blocked(pass)) else {
            return Err(cycle(graph, &edges, &waiting));
        };
        order.push(waiting.remove(next));
    }
    Ok(order)
}

/// Per resource, its live writers run by version, and a reader runs between the writer of its version (read after
/// write) and the next live writer (write after read).
fn edges<W>(graph: &Graph<W>, live: &[bool]) -> Vec<Edge> {
    let mut edges = Vec::new();
    for resource in 0..graph.resources.len() {
        let uses = || {
            let live_passes = graph.passes.iter().enumerate().filter(|(pass, _)| live[*pass]);
            live_passes.flat_map(|(pass, declared)| declared.uses.iter().map(move |use_| (pass, use_)))
        };
        let of_resource = || uses().filter(|(_, use_)| use_.handle.resource == resource);
        let mut writers: Vec<(u32, usize)> =
            of_resource().filter_map(|(pass, use_)| use_.makes().map(|made| (made.version, pass))).collect();
        writers.sort_unstable();
        edges.extend(writers.windows(2).map(|pair| Edge { before: pair[0].1, after: pair[1].1, resource }));
        for (reader, use_) in of_resource().filter(|(_, use_)| use_.mode == Mode::Read) {
            let newer = writers.partition_point(|(version, _)| *version <= use_.handle.version);
            let producer = newer.checked_sub(1).map(|index| writers[index].1);
            edges.extend(producer.map(|before| Edge { before, after: reader, resource }));
            edges.extend(writers.get(newer).map(|&(_, after)| Edge { before: reader, after, resource }));
        }
    }
    edges
}

/// Every waiting pass waits for another waiting one, so following these leads into a cycle.
fn cycle<W>(graph: &Graph<W>, edges: &[Edge], waiting: &[usize]) -> GraphError {
    let cause_of = |pass: usize| edges.iter().find(|edge| edge.after == pass && waiting.contains(&edge.before));
    let (mut visited, mut steps, mut pass) = (Vec::new(), Vec::new(), waiting[0]);
    while let Some(edge) = cause_of(pass).filter(|_| !visited.contains(&pass)) {
        visited.push(pass);
        let (before, after) = (&graph.passes[edge.before].name, &graph.passes[edge.after].name);
        let resource = &graph.resources[edge.resource].name;
        steps.push(format!("`{before}` must run before `{after}` because of `{resource}`"));
        pass = edge.before;
    }
    let start = visited.iter().position(|&earlier| earlier == pass).unwrap_or(0);
    GraphError::Cycle { steps: steps.split_off(start) }
}
