//! One program of all tests: it is linked once, and its tests share the processor to the end. `signature.rs` stands apart, since CI runs it with
//! the default features, too.

mod bent;
mod certificate;
mod copies;
mod dispute;
mod forgery;
mod models;
mod null;
mod posed;
mod reexported;
mod scenes;
mod small;
mod subdivided;
mod suspects;
mod trace;
mod watermark;
