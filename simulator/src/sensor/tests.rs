//! Each error source does what its number says, and nothing else.
