//! Averages of a pyramid over a footprint. Seeds 1 and 2.
