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
}

impl Method {
    /// All of them.
    pub const ALL: &[Self] = &[Self::Paper];

    /// What the command line and scene files call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Paper => "paper",
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

    /// The variant of shade.comp that runs it.
    pub fn shader(self) -> &'static Shader {
        match self {
            Self::Paper => &compiled::SHADE_PAPER,
        }
    }
}
