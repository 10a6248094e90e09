//! The materials that come with the program: the files of assets/materials, by family.

/// A name and the TOML text of its file.
type Material = (&'static str, &'static str);

macro_rules! materials {
    ($($family:literal: $($name:literal)+;)+) => {
        /// Families and their materials, in the order in which to list them.
        pub(super) const FAMILIES: &[(&str, &[Material])] = &[$((
            $family,
            &[$(($name, include_str!(concat!("../../assets/materials/", $name, ".toml")))),+],
        )),+];
    };
}

materials! {
    "metals": "gold" "silver" "copper" "aluminium" "chrome" "tungsten" "titanium-nitride" "nickel" "sandblasted-aluminium"
        "ground-chromium" "brushed-aluminium" "brushed-steel" "anodised-aluminium" "lacquered-copper";
    "plastics": "red-plastic" "blue-plastic" "white-plastic" "billiard-ball";
    "paints": "flat-white-paint" "grey-primer" "green-enamel" "red-car-paint" "blue-flake-paint" "bronze-flake-paint"
        "varnished-oak" "lacquered-walnut";
    "fabrics": "linen" "satin" "silk" "blue-velvet" "reflective-tape";
    "ceramics": "clay" "terracotta" "wet-terracotta" "celadon" "porcelain";
    "others": "skin" "black-rubber" "eraser" "moon-dust";
}

/// All of them, family by family.
pub(super) fn materials() -> impl Iterator<Item = &'static Material> {
    FAMILIES.iter().flat_map(|(_, materials)| materials.iter())
}

/// The TOML text of the built-in material `name`, if there is one.
pub(super) fn text(name: &str) -> Option<&'static str> {
    materials().find(|(known, _)| *known == name).map(|(_, text)| *text)
}
