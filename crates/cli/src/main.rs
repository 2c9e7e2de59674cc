//! The command line of Sigmark.
fn main() {}
