//! From a point of a surface to texture coordinates, with their derivatives. Seed 3, section 11.2.
