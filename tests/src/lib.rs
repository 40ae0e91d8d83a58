//! End-to-end, network, golden and third-party-reader tests.
