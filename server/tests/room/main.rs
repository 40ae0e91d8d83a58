//! A real server on loopback, agents and clients with the generated code.

#![allow(clippy::unwrap_used)]

mod agents;
mod calibration;
mod calibrations;
mod depth;
mod fixture;
mod plan;
mod repair;
mod takes;
mod walk;
mod watching;
mod web;
