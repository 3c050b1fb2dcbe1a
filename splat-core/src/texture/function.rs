//! Textures that are functions, and how their detail is limited to what a footprint can show. Seed 3, section 11.1.2.
