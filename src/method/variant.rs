//! A method together with where it draws its samples, by one name.
use super::{Method, Pattern};
use crate::error::Result;

/// A method, and where it draws its samples: what tables have a row for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Variant {
    /// How radiance is estimated.
    pub method: Method,
    /// Where samples are drawn; [`Pattern::PerPixel`] of methods that have no choice.
    pub pattern: Pattern,
}

/// What the names of variants with a fixed pattern end in.
const FIXED: &str = "_fixed";

impl Variant {
    /// `method`, with `pattern` if it has a choice.
    pub fn new(method: Method, pattern: Pattern) -> Self {
        Self { method, pattern: if method.has_pattern() { pattern } else { Pattern::PerPixel } }
    }

    /// The name of the method, followed by `_fixed` if the pattern is.
    pub fn name(self) -> String {
        let suffix = if self.pattern == Pattern::Fixed { FIXED } else { "" };
        format!("{}{suffix}", self.method.name())
    }

    /// The variant of that name.
    ///
    /// # Errors
    /// There is none.
    pub fn from_name(name: &str) -> Result<Self> {
        let fixed = name.strip_suffix(FIXED).map(Method::from_name).and_then(Result::ok);
        match fixed.filter(|method| method.has_pattern()) {
            Some(method) => Ok(Self { method, pattern: Pattern::Fixed }),
            None => Method::from_name(name).map(Self::from).map_err(|_| {
                let fixed = Method::ALL.iter().filter(|method| method.has_pattern());
                let fixed = fixed.map(|method| Self::new(*method, Pattern::Fixed));
                Method::unknown(name, Method::on_gpu().map(Self::from).chain(fixed).map(Self::name).collect())
            }),
        }
    }
}

impl From<Method> for Variant {
    fn from(method: Method) -> Self {
        Self::new(method, Pattern::PerPixel)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn variants_of_methods_that_have_a_pattern_are_named_by_it() {
        for &method in Method::ALL {
            assert_eq!(method.name().parse::<Method>().unwrap(), method);
            for pattern in Pattern::ALL {
                let variant = Variant::new(method, pattern);
                assert_eq!(Variant::from_name(&variant.name()).unwrap(), variant);
                let is_fixed = variant.name() == format!("{}_fixed", method.name());
                assert_eq!(is_fixed, pattern == Pattern::Fixed && method.has_pattern());
            }
        }
        assert!(Variant::from_name("paper_fixed").unwrap_err().to_string().contains("paper_fixed"));
    }
}
