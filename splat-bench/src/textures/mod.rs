//! Texture lookups: what is looked up, and what each filter makes of it in how much time.

pub mod images;
pub mod measure;
