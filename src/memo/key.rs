//! Keys: names of outputs, made of all that an output is a function of.

/// Two outputs of one key are the same: the key is a digest of the step's name, of the settings and of the contents that the output is
/// a function of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Key([u8; blake3::OUT_LEN]);

impl Key {
    /// Begins the key of what is called `name`.
    pub fn builder(name: &str) -> KeyBuilder {
        KeyBuilder(blake3::Hasher::new()).text(name)
    }

    /// The key of something with this digest of its contents.
    pub fn of_digest(digest: blake3::Hash) -> Self {
        Self(digest.into())
    }

    /// The key of these bytes.
    pub fn of_bytes(bytes: &[u8]) -> Self {
        Self(blake3::hash(bytes).into())
    }
}

/// In hexadecimal: good as the name of a file.
impl std::fmt::Display for Key {
    fn fmt(&self, formatter: &mut std::fmt::Formatter) -> std::fmt::Result {
        blake3::Hash::from(self.0).fmt(formatter)
    }
}

/// A key that is being made, part by part.
#[derive(Clone, Debug)]
pub struct KeyBuilder(blake3::Hasher);

impl KeyBuilder {
    /// Adds a text.
    pub fn text(self, text: &str) -> Self {
        self.bytes(text.as_bytes())
    }

    /// Adds bytes, and how many: "ab" and "c" are not "a" and "bc".
    pub fn bytes(mut self, bytes: &[u8]) -> Self {
        self.0.update(&(bytes.len() as u64).to_le_bytes()).update(bytes);
        self
    }

    /// Adds a number.
    pub fn number(mut self, number: impl Into<u64>) -> Self {
        self.0.update(&number.into().to_le_bytes());
        self
    }

    /// Adds a number to its last bit.
    pub fn real(self, number: f64) -> Self {
        self.number(number.to_bits())
    }

    /// Adds the key of something else.
    pub fn key(mut self, key: Key) -> Self {
        self.0.update(&key.0);
        self
    }

    /// Adds keys, and how many.
    pub fn keys(self, keys: impl IntoIterator<Item = Key>) -> Self {
        let keys: Vec<_> = keys.into_iter().collect();
        let counted = self.number(keys.len() as u64);
        keys.into_iter().fold(counted, Self::key)
    }

    /// The key.
    pub fn build(self) -> Key {
        Key(self.0.finalize().into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_tells_names_numbers_and_where_one_part_ends_apart() {
        let keys = [
            Key::builder("a").build(),
            Key::builder("b").build(),
            Key::builder("a").number(0_u32).build(),
            Key::builder("a").real(-0.0).build(),
            Key::builder("ab").text("c").build(),
            Key::builder("a").text("bc").build(),
            Key::builder("a").keys([]).key(Key::of_bytes(b"")).build(),
            Key::builder("a").keys([Key::of_bytes(b"")]).build(),
        ];
        for (i, key) in keys.iter().enumerate() {
            assert!(keys[..i].iter().all(|other| other != key), "{i}");
        }
        // Unsigned zero is the same number whatever its type, so the third is also what a real 0 gives.
        assert_eq!(keys[2], Key::builder("a").real(0.0).build());
    }
}
