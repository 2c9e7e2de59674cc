//! What SVG and HTML pages share.

/// Of words.
pub const INK: &str = "#1f2933";
/// Of axes and their numbers.
pub const PALE_INK: &str = "#616e7c";
/// Of our own figures.
pub const OURS: &str = "#d9480f";

/// Text that markup takes for nothing else, in quotation marks too.
pub fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}
