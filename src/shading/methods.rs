// The table of shading methods: an entry each, `name => Variant: properties`, or `name | older_name`, by which older scene files and scripts call
// it. A method `name` is glsl/methods/name.glsl, its twin src/shading/name.rs and its entry here. Included by src/scene/method.rs (names),
// src/method.rs (properties) and src/shading/mod.rs (modules and dispatch); each defines `methods!` first. (Hence no inner doc comment at the top.)
methods! {
    fitted => Fitted: Properties {
        threads: Some(ThreadKind::Fitted),
        shares_surface: true,
        ..Properties::new("Threads fitted to the BRDF: directions, kernel widths and colours whose sum answers any light as the BRDF does.", BLURRED)
    },
    paper => Paper: Properties {
        threads: Some(ThreadKind::Paper),
        ..Properties::new("Sample threads as published by Kim, Kyung and Lee (2010), box-filtered lookups.", BOX_FILTERED)
    },
    gaussian => Gaussian: Properties {
        threads: Some(ThreadKind::Gaussian),
        shares_surface: true,
        ..Properties::new("Spherical Gaussians fitted to the BRDF itself (Green, Kautz and Durand 2007), looked up as fitted threads.", BLURRED)
    },
    split_sum => SplitSum: Properties {
        shares_surface: true,
        ..Properties::new("The split sum of engines (Karis 2013): the light filtered by the GGX that suits the BRDF best, times the BRDF's albedo.", SPLIT_SUM)
    },
    uniform => Uniform: Properties::new("Monte Carlo, uniform over the hemisphere.", MAP),
    cosine => Cosine: Properties::new("Monte Carlo, by the cosine to the normal.", MAP),
    importance => Importance: Properties {
        has_pattern: true,
        ..Properties::new("Monte Carlo by a 2D CDF of BRDF times cosine (Matusik et al. 2003).", MAP.and_slices())
    },
    filtered => Filtered: Properties {
        has_pattern: true,
        ..Properties::new("As importance, with filtered lookups (Colbert and Krivanek 2007); biased.", BOX_FILTERED.and_slices())
    },
    environment => Environment: Properties::new("Monte Carlo by the environment's light (Agarwal et al. 2003).", MAP_BY_LIGHT),
    ris | resampled => Ris: Properties::new("Resampled importance sampling of the whole product (Talbot et al. 2005).", MAP_BY_LIGHT.and_slices()),
    mis | combined => Mis: Properties::new("Multiple importance sampling of lobe and light (Veach and Guibas 1995) at Sobol's points: the reference's form on the GPU.", MAP_BY_LIGHT.and_slices()),
}
