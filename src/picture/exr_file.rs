//! Writes and reads OpenEXR pictures: 32-bit float, linear Rec. 709, the circumstances of the rendering in the header.
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::Path;

use exr::block::chunk::{Chunk, CompressedBlock, CompressedScanLineBlock, CompressedTileBlock};
use exr::meta::attribute::{AttributeValue, Chromaticities, Text};
use exr::meta::{BlockDescription, MetaData};
use exr::prelude::{
    AnyChannel, AnyChannels, Compression, Encoding, FlatImage, FlatSamples, Image, IntegerBounds, Layer,
    LayerAttributes, ReadChannels, ReadLayers, Vec2, WritableImage,
};

use super::{DEFLATED, Format, PictureFile, Primaries, check_pixels};
use crate::error::{Error, Result};
use crate::files::write_whole;

/// DWA deflates four bytes for each block of 8 x 8 samples.
const MAX_SAMPLES_PER_BYTE: u64 = 16 * DEFLATED;

/// Samples of all channels to each byte of a file of this compression, at most. Those that do not deflate make less of a byte.
fn max_samples_per_byte(compression: Compression) -> u64 {
    if is_dwa(compression) { MAX_SAMPLES_PER_BYTE } else { DEFLATED }
}

fn is_dwa(compression: Compression) -> bool {
    matches!(compression, Compression::DWAA(_) | Compression::DWAB(_))
}

/// How a picture was made: written to the header of an EXR, each field under its own name.
#[derive(Clone, Debug, PartialEq)]
pub struct ExrHeader {
    /// Shading method, such as `paper`.
    pub method: String,
    /// Threads, or samples of the other estimators.
    pub threads: u32,
    /// Name or file of the material, or of all of them, separated by commas.
    pub material: String,
    /// Name or file of the environment.
    pub environment: String,
    /// Name of the Vulkan device.
    pub device: String,
    /// Seconds the frame took.
    pub seconds: f64,
    /// Version of Threadlight, `threadlight_version` in the file.
    pub version: String,
    /// Anything else: name and value.
    pub more: Vec<(String, String)>,
}

impl Default for ExrHeader {
    /// Nothing known but the version, which is this one's.
    fn default() -> Self {
        Self {
            method: String::new(),
            threads: 0,
            material: String::new(),
            environment: String::new(),
            device: String::new(),
            seconds: 0.0,
            version: env!("CARGO_PKG_VERSION").into(),
            more: Vec::new(),
        }
    }
}

/// Writes an EXR of `width` x `height` pixels, rows from the top, colour multiplied by alpha as EXR has it; without
/// `alpha` only R, G and B.
///
/// # Panics
/// If `pixels` does not hold one for each pixel.
pub fn write_exr(
    path: &Path,
    width: u32,
    height: u32,
    pixels: &[[f32; 4]],
    alpha: bool,
    header: &ExrHeader,
) -> Result<()> {
    assert_eq!(pixels.len(), width as usize * height as usize, "one value a pixel");
    let channel = |(index, name): (usize, &str)| {
        AnyChannel::new(name, FlatSamples::F32(pixels.iter().map(|pixel| pixel[index]).collect()))
    };
    let names: &[&str] = if alpha { &["R", "G", "B", "A"] } else { &["R", "G", "B"] };
    let channels = AnyChannels::sort(names.iter().copied().enumerate().map(channel).collect());

    let text = |value: &str| AttributeValue::Text(utf8(value));
    let mut attributes = LayerAttributes {
        software_name: Some(utf8(&format!("Threadlight {}", header.version))),
        ..LayerAttributes::default()
    };
    attributes.other.extend([
        (Text::from("method"), text(&header.method)),
        (Text::from("threads"), AttributeValue::I32(header.threads.try_into().unwrap_or(i32::MAX))),
        (Text::from("material"), text(&header.material)),
        (Text::from("environment"), text(&header.environment)),
        (Text::from("device"), text(&header.device)),
        (Text::from("seconds"), AttributeValue::F64(header.seconds)),
        // `version` alone is a name that the format keeps for deep data.
        (Text::from("threadlight_version"), text(&header.version)),
    ]);
    attributes.other.extend(header.more.iter().map(|(name, value)| (utf8(name), text(value))));

    let size = Vec2(width as usize, height as usize);
    let mut image = Image::from_layer(Layer::new(size, attributes, Encoding::SMALL_LOSSLESS, channels));
    let at = |[x, y]: [f32; 2]| Vec2(x, y);
    let Primaries { red, green, blue, white } = Primaries::REC_709;
    image.attributes.chromaticities =
        Some(Chromaticities { red: at(red), green: at(green), blue: at(blue), white: at(white) });
    let mut bytes = Cursor::new(Vec::new());
    image.write().to_buffered(&mut bytes).map_err(|cause| Error::unwritable(path, cause.to_string()))?;
    let mut bytes = bytes.into_inner();
    sort_attributes(&mut bytes);
    write_whole(path, &bytes)
}

/// Strings of an EXR are UTF-8; by itself the crate takes their bytes for letters of Latin-1.
fn utf8(text: &str) -> Text {
    Text::from_slice_unchecked(text.as_bytes())
}

/// The same the other way round; what other programs wrote may be anything.
fn string(text: &Text) -> Cow<'_, str> {
    String::from_utf8_lossy(text.as_slice())
}

/// Puts the attributes in a single-part EXR's header into the order of their names. The crate keeps them in a hash map
/// and writes them in a new order each time, but the same picture is to have the same bytes.
fn sort_attributes(bytes: &mut [u8]) {
    const MAGIC_AND_VERSION: usize = 8;
    let text_end = |start: usize| bytes[start..].iter().position(|&byte| byte == 0).map(|length| start + length + 1);
    let mut attributes = Vec::new();
    let mut start = MAGIC_AND_VERSION;
    // An attribute is its name and type, each ended by 0, the length of its value (u32), and the value; a 0 ends all.
    while bytes.get(start).is_some_and(|&byte| byte != 0) {
        let Some(value) = text_end(start).and_then(text_end) else { return };
        let Some(length) = bytes.get(value..value + 4) else { return };
        let end = value + 4 + u32::from_le_bytes([length[0], length[1], length[2], length[3]]) as usize;
        let Some(attribute) = bytes.get(start..end) else { return };
        attributes.push(attribute.to_vec());
        start = end;
    }
    attributes.sort();
    bytes[MAGIC_AND_VERSION..start].copy_from_slice(&attributes.concat());
}

/// Reads an EXR: the channels R, G and B (perhaps with a common prefix, such as `beauty.R`), or else Y, which then stands for all three. Of
/// several such layers it is the picture itself, if one is called so, and the first if not; a warning tells which. Half, float and integer samples,
/// any compression that the crate knows. The picture is what the display window shows: black, and transparent if there is alpha, where the
/// layer has no data; an error where that is everywhere. Colours of other primaries become those of Rec. 709.
pub fn parse_exr(path: &Path, bytes: &[u8]) -> Result<PictureFile> {
    let broken = |cause: exr::error::Error| {
        Error::in_file(
            path,
            format!("is not an EXR that can be read ({cause})"),
            "save it again, with channels R, G, B and compression ZIP",
        )
    };
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(broken)?;
    if let Some([left, top, right, bottom]) = stored_display_window(bytes).filter(|[l, t, r, b]| r < l || b < t) {
        let problem = format!("has a display window without a pixel, from {left}, {top} to {right}, {bottom}");
        return Err(Error::in_file(path, problem, "save it again, with the display window around the picture"));
    }
    check_sizes(path, &meta, bytes.len())?;
    check_dwa_chunks(&meta, bytes).map_err(broken)?;
    let image: FlatImage = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))
        .map_err(broken)?;

    let groups: Vec<Group> = image.layer_data.iter().flat_map(Group::all).collect();
    let has_colour = groups.iter().any(|group| group.colour().is_some());
    let colours_of = |group| if has_colour { Group::colour(group) } else { Group::grey(group) };
    let shown: Vec<_> = groups.iter().filter_map(|group| Some((group, colours_of(group)?))).collect();
    // The first of those that are equally good.
    let (group, colours) = shown.iter().min_by_key(|(group, _)| group.rank()).ok_or_else(|| {
        let channels = image.layer_data.iter().flat_map(|layer| &layer.channel_data.list);
        let names: Vec<_> = channels.map(|channel| string(&channel.name)).collect();
        Error::in_file(
            path,
            format!("has no channels R, G, B, only {}", names.join(", ")),
            "give an EXR with colour in R, G, B",
        )
    })?;
    if shown.len() > 1 {
        let taken = match &*group.name() {
            "" => "the one without a name".to_owned(),
            name => format!("{name:?}"),
        };
        tracing::warn!("{}: of its {} layers with colour {taken} is taken", path.display(), shown.len());
    }
    let (layer, alpha) = (group.layer, group.channels[3]);
    let mut rgba = vec![[1.0; 4]; area(layer.size)];
    for (index, channel) in colours.iter().chain(&alpha).enumerate() {
        rgba.iter_mut().zip(channel.sample_data.values_as_f32()).for_each(|(pixel, value)| pixel[index] = value);
    }
    if let Some(Chromaticities { red, green, blue, white }) = image.attributes.chromaticities.filter(|_| has_colour) {
        let at = |of: Vec2<f32>| [of.0, of.1];
        Primaries { red: at(red), green: at(green), blue: at(blue), white: at(white) }
            .convert(path, rgba.iter_mut().map(|[colour @ .., _]| colour));
    }
    let window = image.attributes.display_window;
    if !overlap(window, IntegerBounds::new(layer.attributes.layer_position, layer.size)) {
        let problem = "shows nothing, as its data window is outside of its display window";
        return Err(Error::in_file(path, problem, "save it again, with the display window around the picture"));
    }
    Ok(PictureFile {
        width: window.size.0 as u32,
        height: window.size.1 as u32,
        rgba: within(window, layer, rgba, [0.0, 0.0, 0.0, if alpha.is_some() { 0.0 } else { 1.0 }]),
        alpha: alpha.is_some(),
        format: Format::Exr,
        attributes: attribute_texts(&image, layer),
    })
}

/// The display window as it is stored: left, top, right and bottom. The crate takes one without a pixel for another.
fn stored_display_window(bytes: &[u8]) -> Option<[i32; 4]> {
    // Its name, its kind and its size.
    const ATTRIBUTE: &[u8] = b"displayWindow\0box2i\0\x10\0\0\0";
    let at = bytes.windows(ATTRIBUTE.len()).position(|window| window == ATTRIBUTE)? + ATTRIBUTE.len();
    let numbers: [[u8; 4]; 4] = bytes.get(at..at + 16)?.as_chunks().0.try_into().ok()?;
    Some(numbers.map(i32::from_le_bytes))
}

/// Columns times rows.
fn area(size: Vec2<usize>) -> usize {
    size.0.saturating_mul(size.1)
}

/// An error for a picture, or a layer of it, that claims to be larger than a file of so many bytes can hold.
fn check_sizes(path: &Path, meta: &MetaData, file_bytes: usize) -> Result<()> {
    // Every layer is read before one is chosen, tile by tile; a tile may claim to be larger than the picture.
    let samples = meta.headers.iter().flat_map(|header| {
        let tile = match &header.blocks {
            BlockDescription::Tiles(tiles) => area(tiles.tile_size),
            BlockDescription::ScanLines => 0,
        };
        std::iter::repeat_n(area(header.layer_size).max(tile) as u64, header.channels.list.len().max(1))
    });
    let most = meta.headers.iter().map(|header| max_samples_per_byte(header.compression)).max().unwrap_or_default();
    check_pixels(path, samples, file_bytes, most)?;
    // However small the part is that has data.
    let shown = meta.headers.first().map_or(0, |header| area(header.shared_attributes.display_window.size));
    check_pixels(path, [shown as u64], file_bytes, MAX_SAMPLES_PER_BYTE)
}

/// An error if a chunk that DWA has compressed claims more than can be deflated to its size: the crate allocates whatever such a chunk says.
fn check_dwa_chunks(meta: &MetaData, bytes: &[u8]) -> exr::error::UnitResult {
    if !meta.headers.iter().any(|header| is_dwa(header.compression)) {
        return Ok(());
    }
    for chunk in exr::block::read(Cursor::new(bytes), false)?.filter_chunks(false, |_, _, _| true)? {
        let Chunk { layer_index, compressed_block } = chunk?;
        let Some(header) = meta.headers.get(layer_index).filter(|header| is_dwa(header.compression)) else { continue };
        let place = header.get_block_data_indices(&compressed_block)?;
        let pixels = header.get_absolute_block_pixel_coordinates(place)?.size.area();
        let (CompressedBlock::ScanLine(CompressedScanLineBlock { compressed_pixels_le: data, .. })
        | CompressedBlock::Tile(CompressedTileBlock { compressed_pixels_le: data, .. })) = compressed_block
        else {
            continue;
        };
        // What gets no smaller is stored as it is.
        if data.len() == pixels * header.channels.bytes_per_pixel {
            continue;
        }
        // It begins with a version and ten numbers, of which these are the lengths of what is inflated.
        let mut numbers = data.as_chunks().0.iter().map(|&number| u64::from_le_bytes(number)).enumerate();
        let most = DEFLATED * data.len() as u64;
        if numbers.any(|(place, number)| [1, 6, 8, 9].contains(&place) && number > most) {
            return Err(exr::error::Error::Invalid("size of a DWA chunk".into()));
        }
    }
    Ok(())
}

/// Whether any pixel is in both.
fn overlap(a: IntegerBounds, b: IntegerBounds) -> bool {
    let starts_before_end = |a: i32, b: i32, size: usize| i64::from(a) < i64::from(b) + size as i64;
    [(a, b), (b, a)].into_iter().all(|(a, b)| {
        starts_before_end(a.position.0, b.position.0, b.size.0)
            && starts_before_end(a.position.1, b.position.1, b.size.1)
    })
}

/// `pixels` of `layer` where `window` shows them, `nothing` where it has none.
fn within(window: IntegerBounds, layer: &FlatLayer, pixels: Vec<[f32; 4]>, nothing: [f32; 4]) -> Vec<[f32; 4]> {
    let at = layer.attributes.layer_position;
    if (at, layer.size) == (window.position, window.size) {
        return pixels;
    }
    let Vec2(width, height) = window.size;
    let place = |index: usize, window: i32, layer: i32, size: usize| {
        usize::try_from(index as i64 + i64::from(window) - i64::from(layer)).ok().filter(|place| *place < size)
    };
    let mut shown = vec![nothing; width * height];
    for (row, shown) in shown.chunks_exact_mut(width.max(1)).enumerate() {
        let Some(y) = place(row, window.position.1, at.1, layer.size.1) else { continue };
        for (column, pixel) in shown.iter_mut().enumerate() {
            if let Some(x) = place(column, window.position.0, at.0, layer.size.0) {
                *pixel = pixels[y * layer.size.0 + x];
            }
        }
    }
    shown
}

type FlatLayer = Layer<AnyChannels<FlatSamples>>;

type FlatChannel = AnyChannel<FlatSamples>;

/// What red, green, blue, alpha, luminance, and what makes that a colour, are called, in any case, after the last dot of a channel's name.
const COMPONENTS: [&[&str]; 6] =
    [&["r", "red"], &["g", "green"], &["b", "blue"], &["a", "alpha"], &["y"], &["x", "ry", "by"]];

/// What renderers call the picture itself, in any case, beside its passes.
const PICTURES: [&str; 3] = ["combined", "rgba", "beauty"];

/// The channels of a layer that begin with the same prefix.
struct Group<'a> {
    layer: &'a FlatLayer,
    /// Without its last dot; may be empty.
    prefix: String,
    /// In the order of [`COMPONENTS`].
    channels: [Option<&'a FlatChannel>; COMPONENTS.len()],
}

impl<'a> Group<'a> {
    /// All of them, in the order of their prefixes.
    fn all(layer: &'a FlatLayer) -> impl Iterator<Item = Self> {
        let mut groups = BTreeMap::<String, [Option<&FlatChannel>; COMPONENTS.len()]>::new();
        for channel in &layer.channel_data.list {
            let name = string(&channel.name);
            let (prefix, last) = name.rsplit_once('.').unwrap_or(("", &name));
            let is_called = |names: &&[&str]| names.iter().any(|name| last.eq_ignore_ascii_case(name));
            if let Some(component) = COMPONENTS.iter().position(is_called) {
                groups.entry(prefix.to_owned()).or_default()[component].get_or_insert(channel);
            }
        }
        groups.into_iter().map(move |(prefix, channels)| Group { layer, prefix, channels })
    }

    fn colour(&self) -> Option<[&'a FlatChannel; 3]> {
        let [r, g, b, ..] = self.channels;
        Some([r?, g?, b?])
    }

    /// The luminance, in the place of colour: not that of luminance and chroma, or of X, Y and Z.
    fn grey(&self) -> Option<[&'a FlatChannel; 3]> {
        let [.., luminance, of_colour] = self.channels;
        luminance.filter(|_| of_colour.is_none()).map(|luminance| [luminance; 3])
    }

    /// That of the channels, or else of the part of the file.
    fn name(&self) -> Cow<'_, str> {
        match &self.layer.attributes.layer_name {
            Some(name) if self.prefix.is_empty() => string(name),
            _ => self.prefix.as_str().into(),
        }
    }

    /// Least for the picture itself: no prefix, then a name that renderers give it.
    fn rank(&self) -> (bool, bool) {
        let name = self.name();
        let last = name.rsplit('.').next().unwrap_or_default();
        (!self.prefix.is_empty(), !PICTURES.iter().any(|picture| last.eq_ignore_ascii_case(picture)))
    }
}

/// The texts and numbers among the attributes of image and layer that the format does not define.
fn attribute_texts(image: &FlatImage, layer: &FlatLayer) -> BTreeMap<String, String> {
    let all = image.attributes.other.iter().chain(&layer.attributes.other);
    all.filter_map(|(name, value)| {
        let value = match value {
            AttributeValue::Text(text) => string(text).into_owned(),
            AttributeValue::I32(number) => number.to_string(),
            AttributeValue::F32(number) => number.to_string(),
            AttributeValue::F64(number) => number.to_string(),
            _ => return None,
        };
        Some((string(name).into_owned(), value))
    })
    .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use exr::prelude::{ImageAttributes, Layers, SpecificChannels, f16};

    /// The picture that an EXR of 2 x 1 pixels, the first at (3, -1), shows in a window of this place and size.
    fn shown(
        position: (i32, i32),
        size: (usize, usize),
        chromaticities: Option<Chromaticities>,
    ) -> Result<PictureFile> {
        let attributes = LayerAttributes { layer_position: Vec2(3, -1), ..LayerAttributes::default() };
        let colours = SpecificChannels::rgba(|Vec2(x, _): Vec2<usize>| (1.0 + x as f32, 0.5, 0.25, 0.75_f32));
        let layer = Layer::new((2, 1), attributes, Encoding::UNCOMPRESSED, colours);
        let mut image = Image::from_layer(layer);
        image.attributes.display_window = IntegerBounds::new(position, size);
        image.attributes.chromaticities = chromaticities;
        let mut bytes = Cursor::new(Vec::new());
        image.write().to_buffered(&mut bytes).unwrap();
        parse_exr(Path::new("test.exr"), &bytes.into_inner())
    }

    #[test]
    fn a_picture_is_what_its_display_window_shows() {
        let [first, second, nothing] = [[1.0, 0.5, 0.25, 0.75], [2.0, 0.5, 0.25, 0.75], [0.0; 4]];
        for (position, size, rgba) in [
            ((3, -1), (2, 1), vec![first, second]),
            ((2, -2), (3, 2), vec![nothing, nothing, nothing, nothing, first, second]),
            ((4, -1), (1, 1), vec![second]),
            ((4, -1), (2, 1), vec![second, nothing]),
        ] {
            let picture = shown(position, size, None).unwrap();
            assert_eq!((picture.width as usize, picture.height as usize), size);
            assert_eq!(picture.rgba, rgba, "{position:?} {size:?}");
        }
    }

    #[test]
    fn a_display_window_beside_the_data_is_an_error() {
        for (position, size) in
            [((-5, 7), (2, 1)), ((1, -1), (2, 1)), ((5, -1), (9, 9)), ((3, -9), (2, 8)), ((3, 0), (2, 1))]
        {
            let error = shown(position, size, None).unwrap_err().to_string();
            assert!(error.starts_with("test.exr: shows nothing"), "{error}");
        }
    }

    #[test]
    fn a_display_window_without_a_pixel_is_an_error() {
        let picture =
            Image::from_channels((2, 1), SpecificChannels::rgb(|_: Vec2<usize>| (1.0_f32, 0.5_f32, 0.25_f32)));
        let mut bytes = Cursor::new(Vec::new());
        picture.write().to_buffered(&mut bytes).unwrap();
        let bytes = bytes.into_inner();
        assert_eq!(stored_display_window(&bytes), Some([0, 0, 1, 0]));
        let name = b"displayWindow";
        let at = bytes.windows(name.len()).position(|window| window == name).unwrap() + name.len() + 1 + 6 + 4;
        for window in [[0, 0, -1, 0], [0, 0, 1, -1], [1, 0, 0, 0]] {
            let mut bytes = bytes.clone();
            bytes[at..at + 16].copy_from_slice(&window.map(i32::to_le_bytes).concat());
            let error = parse_exr(Path::new("test.exr"), &bytes).unwrap_err().to_string();
            assert!(error.contains("has a display window without a pixel"), "{window:?}: {error}");
        }
    }

    #[test]
    fn luminance_is_grey_only_where_there_is_no_colour_beside_it() {
        assert_eq!(red_of(&[(None, &["Y", "Z", "A"])]), 1.0);
        for colour in [&["X", "Y", "Z"][..], &["Y", "RY", "BY"]] {
            let error = picture_of(&[(None, colour)]).unwrap_err().to_string();
            assert!(error.contains("has no channels R, G, B"), "{colour:?}: {error}");
        }
    }

    #[test]
    fn colours_of_other_primaries_are_converted_and_alpha_is_not() {
        let red = Vec2(0.713, 0.293);
        let (green, blue, white) = (Vec2(0.165, 0.830), Vec2(0.128, 0.044), Vec2(0.32168, 0.33767));
        let picture = shown((3, -1), (1, 1), Some(Chromaticities { red, green, blue, white })).unwrap();
        // ACEScg's published matrix times (1, 0.5, 0.25).
        let expected = [1.37334, 0.43750, 0.19976, 0.75];
        assert!(picture.rgba[0].iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-3), "{:?}", picture.rgba);
    }

    /// A picture of one pixel, of channels of these names in parts of these names, whose values are 1, 2, 3 and so on.
    fn picture_of(parts: &[(Option<&str>, &[&str])]) -> Result<PictureFile> {
        let mut value = 0.0;
        let layer = |(name, channels): &(Option<&str>, &[&str])| {
            let channel = |name: &&str| {
                value += 1.0;
                AnyChannel::new(utf8(name), FlatSamples::F32(vec![value]))
            };
            let channels = AnyChannels::sort(channels.iter().map(channel).collect());
            let attributes = LayerAttributes { layer_name: name.map(utf8), ..LayerAttributes::default() };
            Layer::new((1, 1), attributes, Encoding::UNCOMPRESSED, channels)
        };
        let layers: Layers<_> = parts.iter().map(layer).collect();
        let image = Image::from_layers(ImageAttributes::with_size((1, 1)), layers);
        let mut bytes = Cursor::new(Vec::new());
        image.write().to_buffered(&mut bytes).unwrap();
        parse_exr(Path::new("test.exr"), &bytes.into_inner())
    }

    fn red_of(parts: &[(Option<&str>, &[&str])]) -> f32 {
        picture_of(parts).unwrap().rgba[0][0]
    }

    #[test]
    fn of_several_layers_the_picture_itself_is_taken_and_letters_may_be_of_any_case() {
        let ao = ["ViewLayer.AO.R", "ViewLayer.AO.G", "ViewLayer.AO.B"];
        let blender = [&ao[..], &["ViewLayer.Combined.R", "ViewLayer.Combined.G", "ViewLayer.Combined.B"]].concat();
        let of_one_part = |channels: &[&str]| red_of(&[(Some("all"), channels)]);
        assert_eq!(of_one_part(&blender), 4.0);
        assert_eq!(of_one_part(&[&blender[..], &["red", "Green", "BLUE"]].concat()), 7.0);
        assert_eq!(of_one_part(&["a.r", "a.g", "a.b", "x.Beauty.Red", "x.Beauty.Green", "x.Beauty.Blue"]), 4.0);
        // Nothing says which, and then the first; depth and directions are no pictures.
        assert_eq!(of_one_part(&["p.Y", "d.R", "d.G", "d.B", "c.R", "c.G", "c.B"]), 5.0);
        assert_eq!(of_one_part(&["é.Y"]), 1.0);
        // Parts are layers too.
        let rgb = &["R", "G", "B"][..];
        assert_eq!(red_of(&[(Some("Depth"), &["Z", "Y"]), (Some("AO"), rgb), (Some("RGBA"), rgb)]), 6.0);
        assert_eq!(red_of(&[(Some("b"), rgb), (Some("a"), rgb)]), 1.0);
    }

    /// An EXR of one colour, all half floats.
    fn of_one_colour(size: (usize, usize), compression: Compression) -> Vec<u8> {
        let colour = [1.0, 0.5, 0.25].map(f16::from_f32);
        let channels = SpecificChannels::rgb(|_| (colour[0], colour[1], colour[2]));
        let encoding = Encoding { compression, ..Encoding::UNCOMPRESSED };
        let mut bytes = Cursor::new(Vec::new());
        Image::from_encoded_channels(size, encoding, channels).write().to_buffered(&mut bytes).unwrap();
        bytes.into_inner()
    }

    #[test]
    fn a_picture_of_one_colour_is_read_however_small_compression_made_it() {
        use Compression::{B44, B44A, DWAA, DWAB, PIZ, PXR24, RLE, Uncompressed, ZIP1, ZIP16};
        // The small one gets no smaller, and is stored as it is.
        for (width, height) in [(8192, 256), (4, 2)] {
            for compression in [Uncompressed, RLE, ZIP1, ZIP16, PIZ, PXR24, B44, B44A, DWAA(None), DWAB(None)] {
                let picture = parse_exr(Path::new("test.exr"), &of_one_colour((width, height), compression)).unwrap();
                assert_eq!(picture.rgba.len(), width * height);
                let near = |(found, expected): (&f32, f32)| (found - expected).abs() < 0.01;
                let is_colour = |pixel: &[f32; 4]| pixel.iter().zip([1.0, 0.5, 0.25, 1.0]).all(near);
                assert!(picture.rgba.iter().all(is_colour), "{compression}");
            }
        }
    }

    #[test]
    fn a_window_may_show_far_more_than_the_data_but_not_more_than_a_file_can_hold() {
        assert_eq!(shown((0, -2), (1000, 1000), None).unwrap().rgba[1000 + 3], [1.0, 0.5, 0.25, 0.75]);
        let mut bytes = of_one_colour((2, 1), Compression::Uncompressed);
        let name = b"displayWindow\0box2i\0";
        let place = bytes.windows(name.len()).position(|bytes| bytes == name).unwrap();
        // After the size of the value and the first pixel, the last one.
        bytes[place + name.len() + 12..][..8].copy_from_slice(&[9999_i32; 2].map(i32::to_le_bytes).concat());
        let error = parse_exr(Path::new("test.exr"), &bytes).unwrap_err().to_string();
        assert!(error.contains("more than 16512 pixels for each"), "{error}");
    }

    #[test]
    fn a_chunk_of_dwa_that_claims_more_than_memory_is_refused() {
        let whole = of_one_colour((64, 64), Compression::DWAB(None));
        let number = |place: usize| u64::from_le_bytes(*whole[place..].first_chunk().unwrap());
        // The table of the only chunk is where the chunk begins, and stands before it; its own place and size do before its data.
        let table = (0..whole.len() - 8).find(|&place| number(place) == place as u64 + 8).unwrap();
        for counter in [1, 6, 8, 9] {
            let mut bytes = whole.clone();
            bytes[table + 16 + 8 * counter..][..8].copy_from_slice(&(1_u64 << 60).to_le_bytes());
            let error = parse_exr(Path::new("test.exr"), &bytes).map(drop).unwrap_err().to_string();
            assert!(error.contains("size of a DWA chunk"), "{error}");
        }
    }
}
