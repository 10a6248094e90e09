//! Colours of pictures whose red, green and blue are not those of Rec. 709.
use glam::{DMat3, DVec2, DVec3, Vec2};
use std::path::Path;

/// Which colours red, green and blue are, and which one white is that all three make: x and y of the CIE (1931).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Primaries {
    pub red: [f32; 2],
    pub green: [f32; 2],
    pub blue: [f32; 2],
    pub white: [f32; 2],
}

/// From X, Y and Z to what cones see, by which whites are adapted: Lam, "Metamerism and colour constancy" (1985), in columns.
const BRADFORD: DMat3 = DMat3::from_cols(
    DVec3::new(0.8951, -0.7502, 0.0389),
    DVec3::new(0.2664, 1.7135, -0.0685),
    DVec3::new(-0.1614, 0.0367, 1.0296),
);

impl Primaries {
    /// ITU-R BT.709-6, section 1: those of pictures here.
    pub const REC_709: Self =
        Self { red: [0.64, 0.33], green: [0.30, 0.60], blue: [0.15, 0.06], white: [0.3127, 0.3290] };

    /// X, Y and Z of the CIE themselves. White is equal parts of them, as in Radiance's pictures.
    pub const XYZ: Self = Self { red: [1.0, 0.0], green: [0.0, 1.0], blue: [0.0, 0.0], white: [1.0 / 3.0, 1.0 / 3.0] };

    /// Makes `pixels` of these primaries, from the file at `path`, ones of Rec. 709, with white as white (by Bradford's adaptation).
    /// Where a colour that is not negative leaves Rec. 709, it is cut off at 0. Primaries that make no colours are warned of.
    pub fn convert<'a>(self, path: &Path, pixels: impl IntoIterator<Item = &'a mut [f32; 3]>) {
        if self.is_rec_709() {
            return;
        }
        let Some(matrix) = self.to_rec_709() else {
            tracing::warn!("{}: its primaries make no colours; it is taken for Rec. 709", path.display());
            return;
        };
        tracing::info!("{}: converted to Rec. 709 from the primaries that it names", path.display());
        for pixel in pixels {
            let colour = DVec3::from_array(pixel.map(f64::from));
            // What is done about NaN and infinity is for whoever reads the picture.
            if !colour.is_finite() {
                continue;
            }
            let mut converted = matrix * colour;
            if colour.min_element() >= 0.0 {
                converted = converted.max(DVec3::ZERO);
            }
            *pixel = converted.as_vec3().to_array();
        }
    }

    /// Whether they are told from those of Rec. 709 by no more than digits that were left off.
    fn is_rec_709(self) -> bool {
        let all = |of: Self| [of.red, of.green, of.blue, of.white].concat();
        all(self).iter().zip(all(Self::REC_709)).all(|(value, of_709)| (value - of_709).abs() < 1e-3)
    }

    /// What takes linear colours of these primaries to those of Rec. 709; none where they lie on a line, or white is without light.
    fn to_rec_709(self) -> Option<DMat3> {
        let [red, green, blue] = [self.red, self.green, self.blue].map(Vec2::from);
        // Twice the area between them: 0.22 of Rec. 709. Those nearly on a line leave nothing but noise, as white without light does.
        if (green - red).perp_dot(blue - red).abs() < 1e-3 || self.white[1] < 1e-3 {
            return None;
        }
        let adapted = (BRADFORD * Self::REC_709.white_xyz()) / (BRADFORD * self.white_xyz());
        let to_d65 = BRADFORD.inverse() * DMat3::from_diagonal(adapted) * BRADFORD;
        let matrix = Self::REC_709.to_xyz().inverse() * to_d65 * self.to_xyz();
        matrix.is_finite().then_some(matrix)
    }

    /// What takes linear colours to X, Y and Z, white to Y = 1: SMPTE RP 177-1993, section 3.
    pub(crate) fn to_xyz(self) -> DMat3 {
        let primaries = DMat3::from_cols(xyz(self.red), xyz(self.green), xyz(self.blue));
        primaries * DMat3::from_diagonal(primaries.inverse() * self.white_xyz())
    }

    /// Of Y = 1.
    fn white_xyz(self) -> DVec3 {
        xyz(self.white) / f64::from(self.white[1])
    }
}

/// X, Y and Z of this x and y, for X + Y + Z = 1.
fn xyz([x, y]: [f32; 2]) -> DVec3 {
    DVec2::new(x.into(), y.into()).extend(1.0 - f64::from(x) - f64::from(y))
}

#[cfg(test)]
mod tests {
    use super::*;

    const ACES_CG: Primaries =
        Primaries { red: [0.713, 0.293], green: [0.165, 0.830], blue: [0.128, 0.044], white: [0.32168, 0.33767] };

    /// As the Academy's own configurations of OpenColorIO have it.
    #[test]
    fn aces_cg_becomes_rec_709_by_the_published_matrix() {
        let published = [[1.70505, -0.62179, -0.08326], [-0.13026, 1.14080, -0.01055], [-0.02400, -0.12897, 1.15297]];
        let matrix = ACES_CG.to_rec_709().unwrap();
        for (row, expected) in matrix.transpose().to_cols_array_2d().iter().zip(published) {
            assert!(row.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 2e-4), "{matrix}");
        }
    }

    /// As IEC 61966-2-1 (sRGB) has it.
    #[test]
    fn x_y_and_z_themselves_are_primaries() {
        let xyz = Primaries { white: Primaries::REC_709.white, ..Primaries::XYZ };
        let white = DVec3::new(0.3127, 0.3290, 0.3583) / 0.3290;
        let published = [[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]];
        let matrix = xyz.to_rec_709().unwrap();
        // Of X, Y and Z over those of white.
        let matrix = matrix * DMat3::from_diagonal(white.recip());
        for (row, expected) in matrix.transpose().to_cols_array_2d().iter().zip(published) {
            assert!(row.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 5e-4), "{matrix}");
        }
    }

    #[test]
    fn white_stays_white_and_rec_709_stays_as_it_is_to_the_bit() {
        let path = Path::new("test.exr");
        let before = [[0.1, 0.7, 3.0], [f32::NAN, 1.0, -2.0]];
        let mut pixels = before;
        Primaries::REC_709.convert(path, &mut pixels);
        assert_eq!(pixels.map(|pixel| pixel.map(f32::to_bits)), before.map(|pixel| pixel.map(f32::to_bits)));
        let mut white = [[2.0; 3]];
        ACES_CG.convert(path, &mut white);
        assert!(white[0].iter().all(|value| (value - 2.0).abs() < 1e-4), "{white:?}");
    }

    #[test]
    fn colours_outside_are_cut_off_and_what_was_no_colour_is_left_to_the_reader() {
        let mut pixels = [[0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [f32::INFINITY, 0.0, 0.0]];
        ACES_CG.convert(Path::new("test.exr"), &mut pixels);
        let [outside, negative, infinite] = pixels;
        assert!(outside[0] == 0.0 && outside[2] == 0.0 && (outside[1] - 1.1408).abs() < 1e-3, "{outside:?}");
        assert!(negative[0] > 0.0 && negative[1] < -1.0, "{negative:?}");
        assert_eq!(infinite, [f32::INFINITY, 0.0, 0.0]);
    }

    #[test]
    fn primaries_that_make_no_colours_change_nothing() {
        for of in [
            Primaries { red: [0.0; 2], green: [0.0; 2], blue: [0.0; 2], white: [0.0; 2] },
            Primaries { white: [0.3, 0.0], ..ACES_CG },
            Primaries { red: [0.1, 0.1], green: [0.2, 0.2], blue: [0.3, 0.3], ..ACES_CG },
            Primaries { green: [f32::NAN, 0.8], ..ACES_CG },
            Primaries { green: ACES_CG.red, ..ACES_CG },
        ] {
            let mut pixels = [[0.1, 0.7, 3.0]];
            of.convert(Path::new("test.exr"), &mut pixels);
            assert_eq!(pixels, [[0.1, 0.7, 3.0]], "{of:?}");
        }
    }
}
