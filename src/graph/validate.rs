//! Validate: everything that makes a graph meaningless is an error that names the pass and the resource.
use super::access::{Access, Mode};
use super::declare::{Graph, Pass, Resource, Use};
use super::error::GraphError;
use super::resource::{Handle, ResourceKind};
use crate::vulkan::is_depth;
use std::collections::{HashMap, HashSet};

/// Checks all passes, also those that will be culled: whether a graph is wrong does not depend on what is asked of it.
pub(super) fn validate<W>(graph: &Graph<W>) -> Result<(), GraphError> {
    graph.problem.clone().map_or(Ok(()), Err)?;
    distinct("resources", graph.resources.iter().map(|resource| &resource.name))?;
    distinct("passes", graph.passes.iter().map(|pass| &pass.name))?;
    graph.resources.iter().try_for_each(check_resource)?;
    let writers = writers(graph)?;
    for pass in &graph.passes {
        check_pass(graph, pass, &writers)?;
    }
    check_outputs(graph, &writers)
}

/// Which pass makes which version.
type Writers<'a> = HashMap<Handle, &'a str>;

fn distinct<'a>(what: &'static str, names: impl Iterator<Item = &'a String>) -> Result<(), GraphError> {
    let mut seen = HashSet::new();
    for name in names {
        if !seen.insert(name) {
            return Err(GraphError::DuplicateName { what, name: name.clone() });
        }
    }
    Ok(())
}

fn check_resource(resource: &Resource) -> Result<(), GraphError> {
    let empty = match resource.kind {
        ResourceKind::Image(desc) => desc.width == 0 || desc.height == 0,
        ResourceKind::Buffer(desc) => desc.size_bytes == 0,
    };
    if empty {
        return Err(GraphError::ZeroSize { resource: resource.name.clone() });
    }
    for access in resource.import.iter().flat_map(|import| [import.before, import.after]).flatten() {
        misfit(access, &resource.kind).map_or(Ok(()), |problem| {
            Err(GraphError::WrongImport { resource: resource.name.clone(), access, problem })
        })?;
    }
    Ok(())
}

fn writers<W>(graph: &Graph<W>) -> Result<Writers<'_>, GraphError> {
    let mut writers = Writers::new();
    for pass in &graph.passes {
        for made in pass.uses.iter().filter_map(|use_| use_.makes()) {
            let first = writers.insert(made, &pass.name);
            if let Some(first) = first.filter(|first| *first != pass.name) {
                let resource = graph.resources.get(made.resource).map_or(String::new(), |r| r.name.clone());
                return Err(GraphError::TwoWriters { resource, first: first.to_owned(), second: pass.name.clone() });
            }
        }
    }
    Ok(writers)
}

fn check_pass<W>(graph: &Graph<W>, pass: &Pass<W>, writers: &Writers) -> Result<(), GraphError> {
    let name = || pass.name.clone();
    for (index, use_) in pass.uses.iter().enumerate() {
        let Some(resource) = existing(graph, use_.handle, writers) else {
            return Err(GraphError::UnknownHandle { user: name() });
        };
        if let Some(problem) = wrong_usage(*use_, &resource.kind) {
            let (pass, resource) = (name(), resource.name.clone());
            return Err(GraphError::WrongUsage { pass, resource, access: use_.access, problem });
        }
        if let Some(other) = pass.uses[..index].iter().find(|other| !go_together(**other, *use_, &resource.kind)) {
            let (pass, resource) = (name(), resource.name.clone());
            return Err(GraphError::Conflict { pass, resource, first: other.access, second: use_.access });
        }
        if use_.mode != Mode::Write && !has_contents(use_.handle, resource) {
            return Err(GraphError::ReadBeforeWrite { pass: name(), resource: resource.name.clone() });
        }
    }
    if pass.uses.iter().all(|use_| use_.mode == Mode::Read) {
        return Err(GraphError::NoEffect { pass: name() });
    }
    pass.work.as_ref().map_or(Err(GraphError::NoWork { pass: name() }), |_| Ok(()))
}

fn check_outputs<W>(graph: &Graph<W>, writers: &Writers) -> Result<(), GraphError> {
    for output in &graph.outputs {
        let Some(resource) = existing(graph, *output, writers) else {
            return Err(GraphError::UnknownHandle { user: "output".to_owned() });
        };
        let name = resource.name.clone();
        if resource.import.is_none() && !resource.keep {
            return Err(GraphError::OutputTransient { resource: name });
        }
        if let Some(pass) = writers.get(&output.next()) {
            return Err(match output.version {
                0 => GraphError::OutputNotWritten { resource: name },
                _ => GraphError::OutputOverwritten { resource: name, pass: pass.to_string() },
            });
        }
        if !has_contents(*output, resource) {
            return Err(GraphError::OutputNotWritten { resource: name });
        }
    }
    if graph.outputs.is_empty() { Err(GraphError::NoOutput) } else { Ok(()) }
}

fn existing<'a, W>(graph: &'a Graph<W>, handle: Handle, writers: &Writers) -> Option<&'a Resource> {
    graph.resources.get(handle.resource).filter(|_| handle.version == 0 || writers.contains_key(&handle))
}

fn has_contents(handle: Handle, resource: &Resource) -> bool {
    handle.version > 0 || resource.import.as_ref().is_some_and(|import| import.before.is_some())
}

/// Two uses of one resource in one pass are not ordered against each other, and an image has one layout at a time.
fn go_together(a: Use, b: Use, kind: &ResourceKind) -> bool {
    let same_layout = matches!(kind, ResourceKind::Buffer(_)) || a.access.info().layout == b.access.info().layout;
    let reads = a.mode == Mode::Read && b.mode == Mode::Read;
    a.handle.resource != b.handle.resource || (reads && a.handle == b.handle && same_layout)
}

fn wrong_usage(use_: Use, kind: &ResourceKind) -> Option<&'static str> {
    let writes = !use_.access.info().writes.is_empty();
    if use_.access.is_outside_frame() {
        Some("only the owner of an imported resource does that; say so when importing it")
    } else if use_.mode == Mode::Read && writes {
        Some("that access writes; declare a write or a modify")
    } else if use_.mode != Mode::Read && !writes {
        Some("that access only reads; declare a read")
    } else {
        misfit(use_.access, kind)
    }
}

/// Why `access` cannot be made to such a resource.
fn misfit(access: Access, kind: &ResourceKind) -> Option<&'static str> {
    let info = access.info();
    match kind {
        ResourceKind::Buffer(_) => {
            info.buffer_usage.is_none().then_some("that access is for images, and this is a buffer")
        }
        ResourceKind::Image(_) if info.image_usage.is_none() => {
            Some("that access is for buffers, and this is an image")
        }
        ResourceKind::Image(desc) => match (access, is_depth(desc.format)) {
            (Access::DepthAttachment, false) => Some("its format has no depth"),
            (Access::ColorAttachment, true) => Some("its format is a depth format"),
            (Access::StorageReadCompute | Access::StorageWriteCompute, true) => {
                Some("depth formats cannot be storage images")
            }
            _ => None,
        },
    }
}
