//! Colours of curves, red, green and blue of 255.

/// Distinguishable with any kind of colour vision (Okabe and Ito 2008), with grey for their yellow, which is too pale for lines.
pub const CURVES: [[u8; 3]; 8] = [
    [213, 94, 0],
    [0, 114, 178],
    [0, 158, 115],
    [204, 121, 167],
    [86, 180, 233],
    [230, 159, 0],
    [0, 0, 0],
    [128, 130, 136],
];

/// Place of grey among them.
pub const GREY: usize = 7;
