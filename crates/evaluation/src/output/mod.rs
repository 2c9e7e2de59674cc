//! What is written: tables as Markdown, CSV and HTML, charts as SVG.

pub mod chart;
pub mod markup;
pub mod table;
