//! Keep: results that outlive the frame, so that passes that would only make the same again do not run.
//!
//! The *fingerprint* of a version says what its contents are a function of: the pass that makes it, what that pass
//! depends on besides resources ([`super::PassBuilder::depends_on`]; compute and raster passes find it in their pipeline, their
//! push constants and what they are given), and the fingerprints of all versions that it looks at.
//! Two versions of one fingerprint have the same contents, so a kept resource that still holds what a frame would make of it
//! is as good as made.
use super::declare::{Graph, Resource};
use super::kept::{Held, Kept};
use super::resource::{Handle, ResourceInfo};
use std::collections::{BTreeSet, HashMap};
use std::hash::{DefaultHasher, Hash, Hasher};

/// The fingerprint of every version that a pass makes. None where something that it depends on is not known: a pass that does
/// not say what it depends on, contents that someone else owns.
pub(super) fn fingerprints<W>(graph: &Graph<W>) -> HashMap<Handle, Option<u64>> {
    let mut known: HashMap<Handle, Option<u64>> = HashMap::new();
    // A handle is had from the pass that makes it, so makers are declared before users.
    for pass in &graph.passes {
        let of_pass = pass.inputs.as_ref().filter(|_| !pass.depends_on_unknown).and_then(|inputs| {
            let mut hasher = DefaultHasher::new();
            (&pass.name, inputs).hash(&mut hasher);
            for needed in pass.uses.iter().filter_map(|use_| use_.needs()) {
                known.get(&needed).copied().flatten()?.hash(&mut hasher);
            }
            Some(hasher)
        });
        for (index, use_) in pass.uses.iter().enumerate() {
            let (Some(made), Some(resource)) = (use_.makes(), graph.resources.get(use_.handle.resource)) else {
                continue;
            };
            let fingerprint = of_pass.clone().map(|mut hasher| {
                (index, &resource.kind).hash(&mut hasher);
                hasher.finish()
            });
            known.insert(made, fingerprint);
        }
    }
    known
}

/// What resource number `index` of `graph`, to be kept, is from now on: what it was, and whatever this graph uses it as.
pub(super) fn info<W>(kept: &Kept, graph: &Graph<W>, index: usize) -> ResourceInfo {
    let mut info = graph.info(index);
    if let Some(held) = graph.resources[index].held(Some(kept)) {
        info.image_usage |= held.info.image_usage;
        info.buffer_usage |= held.info.buffer_usage;
    }
    info
}

impl Resource {
    /// What this resource, declared to be kept, has been kept as.
    fn held<'k>(&self, kept: Option<&'k Kept>) -> Option<&'k Held> {
        let held = kept?.0.get(&self.name).filter(|_| self.keep)?;
        (held.info.kind == self.kind).then_some(held)
    }
}

/// The versions that kept resources hold since an earlier frame.
pub(super) fn still_good<W>(
    graph: &Graph<W>,
    kept: Option<&Kept>,
    fingerprints: &HashMap<Handle, Option<u64>>,
) -> BTreeSet<Handle> {
    let mut good: BTreeSet<Handle> = BTreeSet::new();
    for (version, fingerprint) in fingerprints {
        let held = graph.resources[version.resource].held(kept);
        // What is to be used in another way than before has to be made anew for that.
        let fits = |held: &&Held| kept.is_some_and(|kept| info(kept, graph, version.resource) == held.info);
        if fingerprint.is_some() && held.filter(fits).is_some_and(|held| held.fingerprint == *fingerprint) {
            good.insert(*version);
        }
    }
    good
}

impl<W> Graph<W> {
    /// Whether `handle` is what `kept` holds already, so that nothing has to run to make it.
    pub fn is_still_good(&self, handle: impl Into<Handle>, kept: &Kept) -> bool {
        still_good(self, Some(kept), &fingerprints(self)).contains(&handle.into())
    }
}
