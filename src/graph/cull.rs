//! Cull: passes that no output needs, or whose results are still good, do not run.
use super::declare::{Graph, Pass};
use super::resource::Handle;
use std::collections::BTreeSet;

/// Which passes run, and why the others do not.
pub(super) struct Culled {
    /// By declared pass.
    pub live: Vec<bool>,
    /// Name of the pass and the reason, in order of declaration.
    pub reasons: Vec<(String, String)>,
}

/// A pass is needed if it makes a version that is an output, or that a needed pass reads or modifies, and that is not among
/// those `still_good`. A version that is only overwritten is not needed. What a needed pass overwrites is good no longer,
/// and is taken out of them.
pub(super) fn cull<W>(graph: &Graph<W>, still_good: &mut BTreeSet<Handle>) -> Culled {
    let live = loop {
        let live = live(graph, still_good);
        let made = |pass: usize| graph.passes[pass].uses.iter().filter_map(|use_| use_.makes());
        let made: Vec<Handle> = (0..live.len()).filter(|&pass| live[pass]).flat_map(made).collect();
        let overwritten =
            |good: &Handle| made.iter().any(|made| made.resource == good.resource && made.version <= good.version);
        let before = still_good.len();
        still_good.retain(|good| !overwritten(good));
        if still_good.len() == before {
            break live;
        }
    };
    let dead = graph.passes.iter().zip(&live).filter(|(_, live)| !**live);
    let made = |pass: &Pass<W>| pass.uses.iter().filter_map(|use_| use_.makes()).collect::<Vec<_>>();
    let reasons = dead.map(|(pass, _)| (pass.name.clone(), reason(graph, still_good, &made(pass))));
    Culled { reasons: reasons.collect(), live }
}

/// The passes that are needed to make the outputs out of what is still good.
fn live<W>(graph: &Graph<W>, still_good: &BTreeSet<Handle>) -> Vec<bool> {
    let mut live = vec![false; graph.passes.len()];
    let mut needed: BTreeSet<Handle> = graph.outputs.iter().copied().collect();
    let makes_needed = |index: usize, needed: &BTreeSet<Handle>| {
        let mut made = graph.passes[index].uses.iter().filter_map(|use_| use_.makes());
        made.any(|made| needed.contains(&made) && !still_good.contains(&made))
    };
    while let Some(index) = (0..live.len()).find(|&index| !live[index] && makes_needed(index, &needed)) {
        live[index] = true;
        needed.extend(graph.passes[index].uses.iter().filter_map(|use_| use_.needs()));
    }
    live
}

/// Why nobody needs the versions `made`.
fn reason<W>(graph: &Graph<W>, still_good: &BTreeSet<Handle>, made: &[Handle]) -> String {
    let is_still_good =
        |made: &Handle| still_good.iter().any(|good| good.resource == made.resource && good.version >= made.version);
    let kept: Vec<_> = made.iter().filter(|made| is_still_good(made)).collect();
    if !kept.is_empty() {
        let names: Vec<_> = kept.iter().map(|made| graph.resources[made.resource].name.as_str()).collect();
        return format!("{} still good", names.join(", "));
    }
    let wasted = made.iter().map(|&version| {
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
