//! What can be wrong with a graph.
use super::access::Access;

/// Why a graph has no plan.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs)] // The messages say what the fields are.
pub enum GraphError {
    #[error(
        "pass `{pass}` reads `{resource}` before anything has written it; write it first, or import it with contents"
    )]
    ReadBeforeWrite { pass: String, resource: String },
    #[error(
        "passes `{first}` and `{second}` both write the same version of `{resource}`; give `{second}` the handle that `{first}` returns"
    )]
    TwoWriters { resource: String, first: String, second: String },
    #[error("pass `{pass}` uses `{resource}` as {access:?}: {problem}")]
    WrongUsage { pass: String, resource: String, access: Access, problem: &'static str },
    #[error("`{resource}` is imported as {access:?}: {problem}")]
    WrongImport { resource: String, access: Access, problem: &'static str },
    #[error(
        "pass `{pass}` uses `{resource}` as {first:?} and as {second:?}; only reads of one version in one layout go together"
    )]
    Conflict { pass: String, resource: String, first: Access, second: Access },
    #[error("pass `{pass}`, `{resource}` of shader {shader}: {problem}")]
    WrongBinding { pass: String, resource: String, shader: String, problem: &'static str },
    #[error("pass `{pass}` uses `{resource}`, which it has not declared; declare a read, a write or a modify of it")]
    Undeclared { pass: String, resource: String },
    #[error("pass `{pass}` draws without a colour and a depth target; declare both")]
    NoTarget { pass: String },
    #[error("pass `{pass}` writes nothing, so it has no effect; declare what it writes or remove it")]
    NoEffect { pass: String },
    #[error("pass `{pass}` records nothing; call `record`")]
    NoWork { pass: String },
    #[error("`{user}` uses a handle that is not of this graph")]
    UnknownHandle { user: String },
    #[error("the graph has no output, so no pass is needed; call `output`")]
    NoOutput,
    #[error("output `{resource}` is never written; output the handle that the last pass to write it returns")]
    OutputNotWritten { resource: String },
    #[error("output `{resource}` is overwritten by pass `{pass}`; output the handle that this pass returns")]
    OutputOverwritten { resource: String, pass: String },
    #[error(
        "output `{resource}` is transient, so nobody sees it after the frame; import it, or copy it to something imported"
    )]
    OutputTransient { resource: String },
    #[error("`{resource}` has no size; all of its dimensions must be at least 1")]
    ZeroSize { resource: String },
    #[error("`{resource}` is imported, and nothing is given for it")]
    NotImported { resource: String },
    #[error("two {what} are named `{name}`; names must differ")]
    DuplicateName { what: &'static str, name: String },
    #[error("cycle: {}; read the newer version, or copy the older one first", steps.join(", "))]
    Cycle { steps: Vec<String> },
}

impl From<GraphError> for crate::Error {
    fn from(error: GraphError) -> Self {
        Self::Graph(Box::new(error))
    }
}
