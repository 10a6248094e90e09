//! The materials that come with the program: the files of assets/materials.

macro_rules! materials {
    ($($name:literal)+) => {
        /// (name, TOML text), in the order in which to list them.
        pub(super) const MATERIALS: &[(&str, &str)] =
            &[$(($name, include_str!(concat!("../../assets/materials/", $name, ".toml")))),+];
    };
}

materials! {
    "gold" "silver" "copper" "aluminium" "chrome" "tungsten" "titanium-nitride"
    "red-plastic" "blue-plastic" "white-plastic" "billiard-ball" "clay"
}

/// The TOML text of the built-in material `name`, if there is one.
pub(super) fn text(name: &str) -> Option<&'static str> {
    MATERIALS.iter().find(|(known, _)| *known == name).map(|(_, text)| *text)
}
