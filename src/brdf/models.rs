// The table of BRDF models: one line each, `glsl_name => RustType`. A model `name` is src/brdf/name.rs, glsl/brdf/name.glsl
// and its line here; its position is the id by which shaders know it. Included by src/brdf/mod.rs (enum and dispatch) and
// by build.rs (the shaders' switch); each defines `brdf_models!` first. (Hence no inner doc comment at the top.)
brdf_models! {
    lambert => Lambert,
    blinn_phong => BlinnPhong,
    conductor => Conductor,
    plastic => Plastic,
    merl => MerlTable,
}
