use super::Picture;
use crate::QualityError;

impl Picture {
    /// The picture as a PNG file.
    ///
    /// # Errors
    /// [`QualityError::Picture`] if it is too large for the format.
    pub fn to_png(&self) -> Result<Vec<u8>, QualityError> {
        let failed = |e: png::EncodingError| QualityError::Picture {
            reason: e.to_string(),
        };
        let side = |pixels: usize| {
            u32::try_from(pixels).map_err(|e| QualityError::Picture {
                reason: e.to_string(),
            })
        };
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, side(self.width)?, side(self.height)?);
        encoder.set_color(png::ColorType::Rgba);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_compression(png::Compression::High);
        let mut writer = encoder.write_header().map_err(failed)?;
        writer.write_image_data(&self.pixels).map_err(failed)?;
        writer.finish().map_err(failed)?;
        Ok(bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_become_png_files_unless_they_have_no_pixels() {
        let png = Picture::blank(40, 20, [1.0; 3]).to_png().unwrap();
        assert!(png.starts_with(b"\x89PNG\r\n\x1a\n"));
        let nothing = Picture::blank(0, 1, [1.0; 3]).to_png();
        assert!(matches!(nothing, Err(QualityError::Picture { .. })));
    }
}
