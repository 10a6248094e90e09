// The table of BRDF models: one line each, `glsl_name => RustType`. A model `name` is src/brdf/models/name.rs and its line here, and where
// shaders are to evaluate it glsl/brdf/name.glsl; without that they look it up in a table. Its position is the id by which
// shaders know it. Included by src/brdf/models/mod.rs (enum and dispatch) and
// by build.rs (the shaders' switch); each defines `brdf_models!` first. (Hence no inner doc comment at the top.)
brdf_models! {
    lambert => Lambert,
    blinn_phong => BlinnPhong,
    conductor => Conductor,
    plastic => Plastic,
    merl => MerlTable,
    phong => Phong,
    lafortune => Lafortune,
    ward => Ward,
    ashikhmin_shirley => AshikhminShirley,
    cook_torrance => CookTorrance,
    torrance_sparrow => TorranceSparrow,
    oren_nayar => OrenNayar,
    sgd => Sgd,
    abc => Abc,
    he_torrance => HeTorrance,
    principled => Principled,
    multiscatter_conductor => MultiscatterConductor,
    layered => Layered,
    tabulated => Tabulated,
    tabulated_anisotropic => TabulatedAnisotropic,
    custom => Custom,
    rgl => Rgl,
    goniometric => Goniometric,
}
