//! The shading methods by their names; what there is to know of each is in src/method.rs.
use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};

/// Makes the enum from the table in shading/methods.rs.
macro_rules! methods {
    ($($name:ident $(| $older:ident)? => $Method:ident: $properties:expr,)+) => {
        /// A way to estimate the radiance that leaves a surface; [`Method::summary`] says which.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
        #[serde(try_from = "String", into = "&'static str")]
        pub enum Method {
            $(#[doc = concat!("Method `", stringify!($name), "`.")] $Method,)+
            /// Quadrature on the CPU: the truth.
            Reference,
        }

        impl Method {
            /// All of them.
            pub const ALL: &[Self] = &[$(Self::$Method,)+ Self::Reference];

            /// What the command line and scene files call it.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$Method => stringify!($name),)+
                    Self::Reference => "reference",
                }
            }

            /// Its name in older scene files and scripts, if it had another.
            pub fn older_name(self) -> Option<&'static str> {
                match self {
                    $($(Self::$Method => Some(stringify!($older)),)?)+
                    _ => None,
                }
            }
        }
    };
}
include!("../shading/methods.rs");

impl Method {
    /// The method of that name.
    ///
    /// # Errors
    /// There is none.
    pub fn from_name(name: &str) -> Result<Self> {
        let is_called = |method: &Self| method.name() == name || method.older_name() == Some(name);
        let known = || Self::ALL.iter().map(|method| method.name().to_owned()).collect();
        Self::ALL.iter().copied().find(is_called).ok_or_else(|| Self::unknown(name, known()))
    }

    /// An error for the `name` of none of those that are `known`.
    pub(crate) fn unknown(name: &str, known: Vec<String>) -> Error {
        Error::input(format!("method \"{name}\""), "is not known", format!("use one of: {}", known.join(", ")))
    }
}

impl std::fmt::Display for Method {
    fn fmt(&self, formatter: &mut std::fmt::Formatter) -> std::fmt::Result {
        self.name().fmt(formatter)
    }
}

impl std::str::FromStr for Method {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        Self::from_name(name)
    }
}

impl TryFrom<String> for Method {
    type Error = Error;

    fn try_from(name: String) -> Result<Self> {
        Self::from_name(&name)
    }
}

impl From<Method> for &'static str {
    fn from(method: Method) -> Self {
        method.name()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn older_names_are_still_read() {
        assert_eq!(Method::from_name("resampled").unwrap(), Method::Ris);
        assert_eq!("combined".parse::<Method>().unwrap(), Method::Mis);
        assert!(Method::from_name("resample").unwrap_err().to_string().contains("fitted, paper"));
    }
}
