//! A digest behind the content of a file, by which damage is found.

/// `content`, and its BLAKE3 digest of 32 bytes behind it.
pub(crate) fn sealed(mut content: Vec<u8>) -> Vec<u8> {
    let digest = blake3::hash(&content);
    content.extend(digest.as_bytes());
    content
}

/// The content of what [`sealed`] made; none if it is damaged.
pub(crate) fn unsealed(bytes: &[u8]) -> Option<&[u8]> {
    let (content, digest) = bytes.split_last_chunk::<{ blake3::OUT_LEN }>()?;
    (blake3::hash(content).as_bytes() == digest).then_some(content)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_damaged_or_cut_short_has_no_content() {
        let content = b"compiled".to_vec();
        let file = sealed(content.clone());
        assert_eq!(unsealed(&file), Some(&content[..]));
        for at in 0..file.len() {
            let mut damaged = file.clone();
            damaged[at] ^= 1;
            assert_eq!(unsealed(&damaged), None);
            assert_eq!(unsealed(&file[..at]), None);
        }
    }
}
