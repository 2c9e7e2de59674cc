//! One program of all tests: it is linked once, and its tests share the processor to the end.

mod align;
mod bad_input;
mod batches;
mod claims;
mod commands;
mod common;
mod copies;
mod interrupted;
mod json;
mod library;
mod poses;
mod report;
mod scenes;
mod stamps;
mod terminal;
mod trace;
