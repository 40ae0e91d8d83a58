//! How good fused people are.

mod compare;

pub use compare::{Comparison, FURTHEST_MATCH_M, Pair, compare};
