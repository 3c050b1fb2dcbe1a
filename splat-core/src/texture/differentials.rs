//! Ray differentials: how a ray's hit, direction and texture coordinates change from pixel to pixel. Seed 3.
