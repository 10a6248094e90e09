//! The container of RGL's `.bsdf` files: named arrays.
//!
//! All numbers are little-endian: the 12 bytes `tensor_file\0`, the version as two u8 (1, 0), a u32 count of fields; then for each a u16
//! length of its name, the name, a u16 number of dimensions, a u8 type (1 = u8, 10 = f32, others are passed over), a u64 offset of its values
//! in the file, and a u64 for each dimension, the last of which varies fastest. (The format of the database's own loader, rgl-epfl/brdf-loader.)
use std::ops::RangeInclusive;

const MAGIC: &[u8] = b"tensor_file\0";

/// Fields of a file: the database's have twelve. A bound on what a list of them takes.
const MAX_FIELDS: u32 = 256;

/// Type of a field of bytes.
const U8: u8 = 1;
/// Type of a field of single-precision numbers.
const F32: u8 = 10;

/// The arrays in the bytes of a file. Nothing is copied.
pub(super) struct TensorFile<'a> {
    bytes: &'a [u8],
    fields: Vec<Field<'a>>,
}

struct Field<'a> {
    name: &'a [u8],
    kind: u8,
    offset: u64,
    /// Eight bytes a dimension.
    shape: &'a [[u8; 8]],
}

/// The numbers of a field, and its dimensions.
pub(super) struct Tensor<'a, const DIMENSIONS: usize> {
    values: &'a [[u8; 4]],
    pub shape: [usize; DIMENSIONS],
}

impl<'a> TensorFile<'a> {
    pub fn parse(bytes: &'a [u8]) -> Result<Self, String> {
        let mut rest = bytes.strip_prefix(MAGIC).ok_or("is no tensor file")?;
        let version = take(&mut rest, 2)?;
        if version[0] != 1 {
            return Err(format!("is of version {}.{}, not 1.0", version[0], version[1]));
        }
        let count = u32::from_le_bytes(array(&mut rest)?);
        if count > MAX_FIELDS {
            return Err(format!("claims to have {count} fields, more than {MAX_FIELDS}"));
        }
        let mut fields = Vec::new();
        for _ in 0..count {
            let length = u16::from_le_bytes(array(&mut rest)?);
            let name = take(&mut rest, length.into())?;
            let dimensions = u16::from_le_bytes(array(&mut rest)?);
            let [kind] = array(&mut rest)?;
            let offset = u64::from_le_bytes(array(&mut rest)?);
            let shape = take(&mut rest, 8 * usize::from(dimensions))?.as_chunks().0;
            fields.push(Field { name, kind, offset, shape });
        }
        Ok(Self { bytes, fields })
    }

    /// Whether there is a field of this name.
    pub fn has(&self, name: &str) -> bool {
        self.fields.iter().any(|field| field.name == name.as_bytes())
    }

    /// The field `name`, of single-precision numbers within `range` and `N` dimensions, none of them 0.
    pub fn numbers<const N: usize>(&self, name: &str, range: RangeInclusive<f32>) -> Result<Tensor<'a, N>, String> {
        let (shape, bytes) = self.field(name, F32, 4)?;
        let values: &[[u8; 4]] = bytes.as_chunks().0;
        let mut numbers = values.iter().map(|&value| f32::from_le_bytes(value)).enumerate();
        if let Some((place, value)) = numbers.find(|(_, value)| !range.contains(value)) {
            let (least, most) = range.into_inner();
            return Err(format!("holds {value:e} in {name}, at position {place}, beyond {least:e} to {most:e}"));
        }
        Ok(Tensor { values, shape })
    }

    /// The first byte of the field `name`.
    pub fn byte(&self, name: &str) -> Result<u8, String> {
        self.field::<1>(name, U8, 1).map(|(_, bytes)| bytes[0])
    }

    /// Dimensions and bytes of the field `name`, whose type is `kind`, of values of `size` bytes. There is at least one.
    fn field<const N: usize>(&self, name: &str, kind: u8, size: usize) -> Result<([usize; N], &'a [u8]), String> {
        let found = self.fields.iter().find(|field| field.name == name.as_bytes());
        let field = found.ok_or_else(|| format!("has no field {name}"))?;
        if field.kind != kind {
            return Err(format!("has a field {name} of type {} instead of {kind}", field.kind));
        }
        let sizes: &[[u8; 8]; N] = field
            .shape
            .try_into()
            .map_err(|_| format!("has a field {name} of {} dimensions instead of {N}", field.shape.len()))?;
        let sizes = sizes.map(u64::from_le_bytes);
        // What lies in the file is no longer than the file, so no product of sizes is allocated unseen.
        let length = sizes.iter().try_fold(size as u64, |product, &size| product.checked_mul(size));
        let end = length.and_then(|length| field.offset.checked_add(length));
        let end = end.filter(|&end| end <= self.bytes.len() as u64);
        let end = end.ok_or_else(|| format!("ends before its field {name} does"))?;
        if sizes.contains(&0) {
            return Err(format!("has an empty field {name}"));
        }
        Ok((sizes.map(|size| size as usize), &self.bytes[field.offset as usize..end as usize]))
    }
}

impl<const N: usize> Tensor<'_, N> {
    /// `count` values from `start` on.
    pub fn slice(&self, start: usize, count: usize) -> impl Iterator<Item = f32> {
        self.values[start..start + count].iter().map(|&value| f32::from_le_bytes(value))
    }

    /// All values.
    pub fn all(&self) -> impl Iterator<Item = f32> {
        self.slice(0, self.values.len())
    }
}

/// The first `count` bytes of `rest`, which goes on behind them.
fn take<'a>(rest: &mut &'a [u8], count: usize) -> Result<&'a [u8], String> {
    rest.split_off(..count).ok_or_else(|| "ends within its list of fields".to_owned())
}

fn array<const N: usize>(rest: &mut &[u8]) -> Result<[u8; N], String> {
    take(rest, N).map(|bytes| bytes.try_into().expect("as many bytes"))
}
