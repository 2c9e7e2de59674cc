//! What is a picture, by its content: a model may name any file, and whoever gets a copy of the model gets what it names.

/// How pictures begin: PNG, JPEG, KTX, DDS, GIF, BMP, TIFF, OpenEXR, Radiance, Photoshop.
const PICTURES: [&[u8]; 12] = [
    b"\x89PNG",
    b"\xFF\xD8\xFF",
    b"\xABKTX ",
    b"DDS ",
    b"GIF8",
    b"BM",
    b"II*\0",
    b"MM\0*",
    b"\x76\x2F\x31\x01",
    b"#?RADIANCE",
    b"#?RGBE",
    b"8BPS",
];

/// Those in containers that hold other things, too: WebP, AVIF.
const CONTAINED: [(usize, &[u8]); 2] = [(8, b"WEBP"), (4, b"ftypavi")];

pub(crate) fn is_picture(name: &str, bytes: &[u8]) -> bool {
    let contained = |(at, name): &(usize, &[u8])| bytes.get(*at..).is_some_and(|rest| rest.starts_with(name));
    PICTURES.iter().any(|first| bytes.starts_with(first))
        || CONTAINED.iter().any(contained)
        || name.to_ascii_lowercase().ends_with(".tga") && is_targa(bytes)
}

/// Whether a header is one of Targa, which begins with no mark of its own: kinds of colour map and of image, and bits of a pixel.
fn is_targa(bytes: &[u8]) -> bool {
    const HEADER: usize = 18;
    bytes.len() > HEADER
        && bytes[1] <= 1
        && matches!(bytes[2], 1..=3 | 9..=11)
        && matches!(bytes[16], 8 | 15 | 16 | 24 | 32)
}
