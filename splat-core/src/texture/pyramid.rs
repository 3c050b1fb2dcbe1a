//! An image in levels of falling resolution. Seed 1.
