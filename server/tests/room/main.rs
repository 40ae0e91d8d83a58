//! A real server on loopback, agents and clients with the generated code.

#![allow(clippy::unwrap_used)]

mod agents;
mod calibration;
mod fixture;
mod takes;
mod watching;
mod web;
