//! How many threads are made, in how many sets, each of which does alone: the partition of the paper's section 4.2.
use super::table::FittedTable;
use crate::brdf::LobeShape;

/// Threads asked for, for each set of an anisotropic BRDF, if there are as many: fewer leave gaps in a long lobe. Of a metal of roughness_alpha
/// 0.05 x 0.3, sets of 4 threads err by 0.066 of the radiance, of 8 by 0.024, of 16 by 0.010.
const ASKED_FOR_OF_LONG_LOBE: usize = 8;

/// Where there are half as many such sets as sums of a pixel, or fewer, each is looked up by two or more of these, and a pixel would make twice as many
/// lookups as were asked for, or more. So three of 16 threads are left out: four brushed materials in three maps err by 0.0019 in the place of 0.0014,
/// and take 1.3 to 1.5 times the time of isotropic ones in the place of 1.6 to 1.8. With 12 of 16 they err by 0.0020, and the worst of 24 pictures by
/// 0.0082 in the place of 0.0072.
const LEFT_OUT_OF_16: usize = 3;

/// Most threads of a set, and part of a lobe's width in half vectors that normals may deviate by, of those that share one sum where normals are
/// not nearly the same. Wide lobes on a sphere of 80 x 60 err by 0.0016, 0.0008 and 0.0006 in sets of 4, 8 and 12 threads, and by
/// 0.0012, 0.0007 and 0.0006 in one sum over all of them; by 0.0006 and 0.0007 with 16.
const FEW_THREADS: usize = 8;
const PART_OF_LOBE: f64 = 0.2;

/// How many of the `subpixels` x `subpixels` of a pixel within one surface are sums of their own: of more than 2 x 2 one in each row and column. If
/// all of 4 x 4 were, 16 threads would be one for each, and a sphere of GGX 0.2 would err by 0.030 in the place of 0.004. Twin in
/// glsl/shared_sum.glsl.
pub fn sums_of_pixel(subpixels: u32) -> u32 {
    if subpixels > 2 { subpixels } else { subpixels * subpixels }
}

/// Which sub-pixel sum `j` of these is, counted row by row. Twin in glsl/shared_sum.glsl.
pub fn place_of_sum(j: u32, subpixels: u32) -> u32 {
    if subpixels > 2 { j + (2 * j + 1) % (subpixels | 1) * subpixels } else { j }
}

/// How many threads are made, and in how many sets, where `count` are asked for of a BRDF of this lobe and a pixel has `subpixels` x `subpixels`: a
/// set for each sum as far as there are threads, so that they are `count` lookups of the pixel. Long lobes have fewer sets, and threads.
pub fn count_and_sets(lobe: &LobeShape, count: usize, subpixels: u32) -> [usize; 2] {
    let sums = sums_of_pixel(subpixels) as usize;
    if lobe.is_isotropic {
        return [count, count.clamp(1, sums)];
    }
    let sets = (count / ASKED_FOR_OF_LONG_LOBE).clamp(1, sums);
    let left_out = if 2 * sets <= sums { LEFT_OUT_OF_16 * count / 16 } else { 0 };
    [count - left_out, sets]
}

/// Deviation of the normals within a pixel, in radians, up to which a sum over threads at their mean errs less than one for each sub-pixel
/// over its set of `table`, if the view is along them; it falls with cos theta_o, as the width of lobes does. 0 if it never does so.
pub fn shared_deviation(lobe: &LobeShape, table: &FittedTable) -> f64 {
    let FittedTable { count, sets, .. } = *table.for_subpixels();
    if count <= FEW_THREADS * sets { PART_OF_LOBE * lobe.width_rad } else { 0.0 }
}

/// Up to this deviation of their normals, in radians, sub-pixels are one surface to any lobe that is not narrower in half vectors across the
/// plane of incidence. Normals are farther apart in the pixels of most meshes, so that of narrower lobes these have a sum for each sub-pixel.
pub const NEARLY_FLAT_RAD: f64 = 0.01;

/// Whether pixels that share one sum have threads of their own, not in sets. Not of a narrow lobe, for which there are few such pixels, and whose
/// free threads are so sharp that all pixels pay for looking that up: 26 ms became 35 with 16 threads of alumina-oxide on a dragon, when its
/// kernels were as sharp as its cusp. Nor of an anisotropic BRDF, whose fits take ten times as long.
pub fn pixels_have_own(lobe: &LobeShape) -> bool {
    lobe.is_isotropic && lobe.width_rad >= NEARLY_FLAT_RAD
}

/// How much the squared residuals of sets alone, in their mean, count beside those of all together. With less, sub-pixels whose normals are
/// so far apart that their errors do not cancel err more; with more, all others do. So it is more for narrow lobes, which are those of isotropic
/// BRDFs whose pixels have no threads of their own. Of 40 measured materials in three maps at 80 x 60, with 16 threads, narrow
/// lobes on a dragon have 0.0020, 0.0019, 0.0018, 0.0017 and 0.0017 with 0.4, 0.7, 1.5, 2 and 3, on a sphere 0.00155, 0.00157, 0.00161,
/// 0.00164 and 0.00169, the worst 0.0063, 0.0053, 0.0047, 0.0038 and 0.0039 (from one start of the first row); wide ones hardly change on a
/// dragon, and on a sphere have 0.00098 with 0.7, 0.00102 and 0.00104 with 1.5 and 3.
pub fn share_of_sets(azimuths: usize, pixels_have_own: bool) -> f32 {
    if azimuths == 1 && !pixels_have_own { 2.0 } else { 0.7 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::Brdf;

    #[test]
    fn sums_of_a_pixel_are_all_of_few_subpixels_and_else_one_in_each_row_and_column() {
        let places =
            |subpixels| (0..sums_of_pixel(subpixels)).map(move |j| place_of_sum(j, subpixels)).collect::<Vec<_>>();
        assert_eq!([1, 2].map(places), [vec![0], vec![0, 1, 2, 3]]);
        for subpixels in [3, 4] {
            for of in [|place: u32, side: u32| place % side, |place: u32, side: u32| place / side] {
                let mut lines: Vec<_> = places(subpixels).into_iter().map(|place| of(place, subpixels)).collect();
                lines.sort();
                assert_eq!(lines, (0..subpixels).collect::<Vec<_>>());
            }
        }
    }

    #[test]
    fn there_is_a_set_for_each_sum_as_far_as_there_are_threads_and_for_eight_of_them_in_a_long_lobe() {
        let counts = |material: &str, subpixels: u32| {
            let lobe = LobeShape::of(&Brdf::builtin(material).unwrap());
            [1, 3, 7, 16, 40].map(|count| count_and_sets(&lobe, count, subpixels))
        };
        assert_eq!(counts("gold", 2), [[1, 1], [3, 3], [7, 4], [16, 4], [40, 4]]);
        assert_eq!(counts("gold", 3), [[1, 1], [3, 3], [7, 3], [16, 3], [40, 3]]);
        assert_eq!(counts("gold", 4), counts("gold", 2));
        assert_eq!(counts("brushed-steel", 2), [[1, 1], [3, 1], [6, 1], [13, 2], [40, 4]]);
        assert_eq!(counts("brushed-steel", 3), [[1, 1], [3, 1], [6, 1], [16, 2], [40, 3]]);
        assert_eq!([counts("gold", 1), counts("brushed-steel", 1)], [[1, 3, 7, 16, 40].map(|count| [count, 1]); 2]);
    }
}
