//! Cull: passes that no output needs do not run.
use super::declare::{Graph, Handle, Pass};
use std::collections::BTreeSet;

/// Which passes run, and why the others do not.
pub(super) struct Culled {
    /// By declared pass.
    pub live: Vec<bool>,
    /// Name of the pass and the reason, in order of declaration.
    pub reasons: Vec<(String, String)>,
}

/// A pass is needed if it makes a version that is an output, or that a needed pass reads or modifies. A version that
/// is only overwritten is not needed.
pub(super) fn cull<W>(graph: &Graph<W>) -> Culled {
    let mut live = vec![false; graph.passes.len()];
    let mut needed: BTreeSet<Handle> = graph.outputs.iter().copied().collect();
    let makes_needed = |index: usize, needed: &BTreeSet<Handle>| {
        graph.passes[index].uses.iter().filter_map(|use_| use_.makes()).any(|made| needed.contains(&made))
    };
    while let Some(index) = (0..live.len()).find(|&index| !live[index] && makes_needed(index, &needed)) {
        live[index] = true;
        needed.extend(graph.passes[index].uses.iter().filter_map(|use_| use_.needs()));
    }
    let dead = graph.passes.iter().zip(&live).filter(|(_, live)| !**live);
    let reasons = dead.map(|(pass, _)| (pass.name.clone(), reason(graph, pass.uses.iter().filter_map(|u| u.makes()))));
    Culled { reasons: reasons.collect(), live }
}

/// Why nobody needs the versions `made`.
fn reason<W>(graph: &Graph<W>, made: impl Iterator<Item = Handle>) -> String {
    let wasted = made.map(|version| {
        let needs = |pass: &&Pass<W>| pass.uses.iter().any(|use_| use_.needs() == Some(version));
        let readers: Vec<_> = graph.passes.iter().filter(needs).map(|pass| pass.name.as_str()).collect();
        let resource = &graph.resources[version.resource].name;
        match readers.as_slice() {
            [] if graph.resources[version.resource].import.is_some() => {
                format!("writes {resource}, which nothing reads and which is no output")
            }
            [] => format!("writes {resource}, which nothing reads"),
            _ => format!("writes {resource}, which only culled passes read ({})", readers.join(", ")),
        }
    });
    wasted.collect::<Vec<_>>().join("; ")
}
