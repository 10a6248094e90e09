//! The shading methods: ways to estimate equation (1) that go through one shading interface.
//!
//! A method is one GLSL file in `glsl/methods/` that defines `estimate`, one CPU twin in `shading.rs`, and one line here.
use crate::vulkan::{Shader, compiled};
use crate::{Error, Result};

/// A way to estimate the radiance that leaves a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// The paper's threads: equations (2) to (10), box-filtered lookups.
    Paper,
    /// Quadrature on the CPU: the truth.
    Reference,
}

impl Method {
    /// All of them.
    pub const ALL: &[Self] = &[Self::Paper, Self::Reference];

    /// What the command line and scene files call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Paper => "paper",
            Self::Reference => "reference",
        }
    }

    /// The method of that name.
    ///
    /// # Errors
    /// There is none.
    pub fn from_name(name: &str) -> Result<Self> {
        Self::ALL.iter().copied().find(|method| method.name() == name).ok_or_else(|| {
            let known: Vec<_> = Self::ALL.iter().map(|method| method.name()).collect();
            Error::input(format!("method \"{name}\""), "is not known", format!("use one of: {}", known.join(", ")))
        })
    }

    /// Whether it needs the threads of a material.
    pub fn uses_threads(self) -> bool {
        matches!(self, Self::Paper)
    }

    /// The variant of shade.comp that runs it; none for what runs on the CPU.
    pub fn shader(self) -> Option<&'static Shader> {
        match self {
            Self::Paper => Some(&compiled::SHADE_PAPER),
            Self::Reference => None,
        }
    }
}
