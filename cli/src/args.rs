//! The command line: the list of subcommands. Each subcommand's own options stand in its file.

use clap::{Parser, Subcommand};

use crate::commands::{
    agent, calibrate, calibrations, completions, demo, devices, doctor, evaluate, export, record,
    refuse, server, simulate, sinks, takes, watch,
};
use crate::global::Global;

/// One motion-capture system out of a room of cheap depth sensors.
#[derive(Debug, Parser)]
#[command(
    name = "posefuse",
    version,
    about,
    long_about = "One motion-capture system out of a room of cheap depth sensors.\n\n\
        Try it without any sensor: `posefuse demo`. With sensors: `posefuse server` on one computer, `posefuse agent` \
        beside each sensor, `posefuse calibrate` once, then `posefuse record`.\n\n\
        Exit codes: 0 done, 1 failed, 2 wrong usage or configuration, 3 done with loss.",
    propagate_version = true,
    arg_required_else_help = true
)]
pub(crate) struct Cli {
    #[command(flatten)]
    pub(crate) global: Global,
    #[command(subcommand)]
    pub(crate) command: Command,
}

/// What to do.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Show everything at once: a server and simulated sensors, calibrated, recorded, on a dashboard
    Demo(demo::DemoArgs),
    /// Run the server of a room
    Server(server::ServerArgs),
    /// Run the agent of one sensor
    Agent(agent::AgentArgs),
    /// List the depth sensors of this computer
    Devices(devices::DevicesArgs),
    /// Find out where the sensors stand, from one person's walk
    Calibrate(calibrate::CalibrateArgs),
    /// List, compare, restore, export and import calibrations
    Calibrations(calibrations::CalibrationsArgs),
    /// Record a take; Ctrl-C ends it
    Record(record::RecordArgs),
    /// List, show and repair takes
    Takes(takes::TakesArgs),
    /// Fuse a take again, with the same or other settings
    Refuse(refuse::RefuseArgs),
    /// Write takes as files that other tools read: BVH, FBX, GLB, TRC, C3D, tables
    Export(export::ExportArgs),
    /// Make a take from simulated sensors, faster than real time, and measure the error against the truth
    Simulate(simulate::SimulateArgs),
    /// Say how good fused people are: methods side by side, on simulated rooms, takes or recordings
    Evaluate(evaluate::EvaluateArgs),
    /// List a server's live outputs, and switch them on and off
    Sinks(sinks::SinksArgs),
    /// Print the fused people as they move
    Watch(watch::WatchArgs),
    /// Say what is wrong with this machine or room, and what to do
    Doctor(doctor::DoctorArgs),
    /// Print shell completions
    Completions(completions::CompletionsArgs),
}

impl Command {
    /// What is logged unless `-v` or POSEFUSE_LOG says otherwise: services tell of their doings, tools of trouble.
    pub(crate) fn default_log_level(&self) -> tracing::Level {
        match self {
            Self::Server(_) | Self::Agent(_) => tracing::Level::INFO,
            _ => tracing::Level::WARN,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }
}
