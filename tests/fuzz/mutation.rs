//! Changes bytes as damage and malice do: bits, numbers, lengths, words of the format, pieces of other files.

/// A generator of changes: the same seed makes the same ones.
pub struct Mutator {
    state: u64,
}

/// Whole numbers at which readers break.
const NUMBERS: [u64; 16] =
    [0, 1, 2, 3, 7, 127, 128, 255, 256, 65535, 65536, 0x7fff_ffff, 0x8000_0000, 0xffff_ffff, u64::MAX / 2, u64::MAX];

/// Numbers in text.
const NUMERALS: [&str; 16] = [
    "0",
    "-0",
    "1",
    "-1",
    "3",
    "255",
    "65536",
    "4294967296",
    "9223372036854775807",
    "-9223372036854775808",
    "1e38",
    "1e39",
    "1e-46",
    "nan",
    "inf",
    "0.5",
];

/// The longest file that a change makes of a shorter one.
const MAX_BYTES: usize = 1 << 16;

impl Mutator {
    pub fn new(seed: u64) -> Self {
        Self { state: seed.wrapping_mul(2).wrapping_add(1) }
    }

    /// A number below `end`.
    pub fn below(&mut self, end: usize) -> usize {
        // Knuth's MMIX generator; its high bits are the good ones.
        self.state = self.state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.state >> 33) as usize % end.max(1)
    }

    /// Most of them short, some long.
    fn length(&mut self) -> usize {
        let bits = self.below(12);
        self.below(1 << bits)
    }

    fn pick<'a, T>(&mut self, of: &'a [T]) -> &'a T {
        &of[self.below(of.len())]
    }

    /// One of `corpus`, as a rule one of the first `whole`, changed in one to sixteen places, mostly in few.
    pub fn change(&mut self, corpus: &[Vec<u8>], whole: usize, words: &[&str]) -> Vec<u8> {
        let kinds = if whole > 0 && self.below(3) > 0 { whole } else { corpus.len() };
        let mut bytes = self.pick(&corpus[..kinds]).clone();
        let most = bytes.len().max(MAX_BYTES);
        let doublings = self.below(5);
        for _ in 0..1 << self.below(doublings + 1) {
            self.change_once(&mut bytes, corpus, words);
        }
        bytes.truncate(most);
        bytes
    }

    fn change_once(&mut self, bytes: &mut Vec<u8>, corpus: &[Vec<u8>], words: &[&str]) {
        let length = bytes.len();
        // Headers are where most decisions are made.
        let place = if self.below(2) == 0 { self.below(length.min(256)) } else { self.below(length) };
        let end = (place + 1 + self.length()).min(length);
        match self.below(13) {
            0 if length > 0 => bytes[place] ^= 1 << self.below(8),
            1 if length > 0 => bytes[place] = self.below(256) as u8,
            2 | 3 => {
                let number = match self.below(3) {
                    0 => length as u64 + self.below(9) as u64,
                    1 => self.below(64) as u64,
                    _ => *self.pick(&NUMBERS),
                };
                let size = 1 << self.below(4);
                overwrite(bytes, place, &number.to_le_bytes()[..size]);
            }
            4 => {
                let number = *self.pick(&[0.0, -0.0, -1.0, 1e-45, 1e30, f32::MAX, f32::INFINITY, f32::NAN]);
                match self.below(2) {
                    0 => overwrite(bytes, place, &number.to_le_bytes()),
                    _ => overwrite(bytes, place, &f64::from(number).to_le_bytes()),
                }
            }
            5 if length > 0 => drop(bytes.drain(place..end)),
            6 if length > 0 => drop(bytes.splice(place..place, bytes[place..end].to_vec())),
            7 => bytes.truncate(place),
            8 => {
                let other = &corpus[self.below(corpus.len())];
                let from = self.below(other.len());
                let to = (from + self.length()).min(other.len());
                bytes.splice(place..place, other[from..to].iter().copied());
            }
            9 => {
                let word = self.pick(words);
                bytes.splice(place..place, word.bytes());
            }
            10 => {
                // Much of one thing: nesting, long lines, many fields.
                let word = self.pick(words).repeat(1 << self.below(12));
                bytes.splice(place..place, word.bytes());
            }
            _ => self.change_numeral(bytes, place),
        }
    }

    /// Puts another number in the place of the first that is written out after `place`.
    fn change_numeral(&mut self, bytes: &mut Vec<u8>, place: usize) {
        let is_part = |byte: &u8| byte.is_ascii_digit() || b"+-.".contains(byte);
        let Some(start) = bytes.iter().skip(place).position(is_part).map(|steps| place + steps) else { return };
        let length = bytes[start..].iter().take_while(|byte| is_part(byte)).count();
        let numeral = self.pick(&NUMERALS);
        bytes.splice(start..start + length, numeral.bytes());
    }
}

fn overwrite(bytes: &mut [u8], place: usize, by: &[u8]) {
    let count = by.len().min(bytes.len() - place.min(bytes.len()));
    if count > 0 {
        bytes[place..place + count].copy_from_slice(&by[..count]);
    }
}
