//! Clients that are not ours to trust.
