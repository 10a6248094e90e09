//! Lifetimes: which resources the plan uses, for what, and from which pass to which.
use super::declare::Graph;
use super::keep;
use super::kept::Kept;
use super::plan::{Lifetime, PlannedResource};
use super::resource::ResourceInfo;

/// The resources that some pass of `order` uses, in order of declaration: no other is ever made.
///
/// Those to be kept are transient where nothing is `kept`.
pub(super) fn lifetimes<W>(graph: &Graph<W>, order: &[usize], kept: Option<&Kept>) -> Vec<PlannedResource> {
    let planned = graph.resources.iter().enumerate().filter_map(|(declared, resource)| {
        let uses = order.iter().enumerate().flat_map(|(position, &pass)| {
            let of_resource = graph.passes[pass].uses.iter().filter(|use_| use_.handle.resource == declared);
            of_resource.map(move |use_| (position, use_.access))
        });
        let lifetime = Lifetime { first: uses.clone().next()?.0, last: uses.clone().last()?.0 };
        let import = resource.import.as_ref();
        let by_owner = import.into_iter().flat_map(|import| [import.before, import.after]).flatten();
        let kept = kept.filter(|_| resource.keep);
        let info = match kept {
            // Passes that do not run in this frame will in another.
            Some(kept) => keep::info(kept, graph, declared),
            None => {
                let accesses = uses.map(|(_, access)| access).chain(by_owner);
                ResourceInfo::used_as(&resource.name, resource.kind, accesses)
            }
        };
        Some(PlannedResource {
            info,
            imported: import.is_some(),
            kept: kept.is_some(),
            lifetime,
            placement: None,
            declared,
        })
    });
    planned.collect()
}
