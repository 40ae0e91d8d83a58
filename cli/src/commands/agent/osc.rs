//! `posefuse agent osc`: skeletons that another program sends by OSC.

use std::net::{IpAddr, Ipv4Addr, SocketAddr};

use clap::{Args, ValueEnum};
use posefuse_agent::source::osc::{Axes, Layout, OscConfig, Unit};
use posefuse_skeleton::JointSet;

use crate::values;

/// Where messages come, and what they mean.
#[derive(Debug, Args)]
pub(super) struct OscArgs {
    /// The UDP port to listen on
    #[arg(long, value_name = "PORT", default_value = "9000", value_parser = values::whole(1u16, 65535))]
    port: u16,
    /// The address to listen on; another than this computer's own lets others put people into the room
    #[arg(long, value_name = "ADDRESS", default_value_t = IpAddr::V4(Ipv4Addr::LOCALHOST))]
    bind: IpAddr,
    /// Whose messages they are; docs/TRACKERS.md has the addresses, units and axes of each
    #[arg(long, value_enum, default_value_t)]
    layout: LayoutArg,
    /// The joints that they carry [default: the layout's usual]
    #[arg(long, value_name = "SET", value_parser = joint_set)]
    joint_set: Option<JointSet>,
    /// What their numbers are worth [default: the layout's usual]
    #[arg(long, value_enum)]
    unit: Option<UnitArg>,
    /// Where optical x (right), y (down) and z (forward) come from, e.g. --axes=-x,-y,z [default: the layout's usual]
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = axes)]
    axes: Option<String>,
    /// A pause this long ends a frame
    #[arg(long, value_name = "MS", default_value_t = 8.0)]
    gap: f64,
}

/// Whose messages.
#[derive(Clone, Copy, Debug, Default, ValueEnum)]
enum LayoutArg {
    /// `/skel/PERSON/JOINT/pos x y z [confidence]`, `/frame`.
    #[default]
    Posefuse,
    /// `/bodies/PERSON/joints/JOINT x y z state`.
    KinectV2Osc,
    /// `/joint JOINT PERSON x y z`, scaled to 0..1.
    Osceleton,
    /// `/joint JOINT PERSON x y z`, millimetres.
    OsceletonMm,
    /// `/joint JOINT SENSOR PERSON x y z confidence`, centimetres.
    OsceletonKinect,
    /// `/JOINT x y z`, one person.
    NiMate,
}

/// What a number is worth.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum UnitArg {
    /// Metres.
    M,
    /// Centimetres.
    Cm,
    /// Millimetres.
    Mm,
    /// OSCeleton's scaling to 0..1.
    Osceleton,
}

impl OscArgs {
    pub(super) fn config(&self) -> OscConfig {
        OscConfig {
            listen: SocketAddr::new(self.bind, self.port),
            layout: match self.layout {
                LayoutArg::Posefuse => Layout::Posefuse,
                LayoutArg::KinectV2Osc => Layout::KinectV2Osc,
                LayoutArg::Osceleton => Layout::Osceleton,
                LayoutArg::OsceletonMm => Layout::OsceletonMm,
                LayoutArg::OsceletonKinect => Layout::OsceletonKinect,
                LayoutArg::NiMate => Layout::NiMate,
            },
            joint_set: self.joint_set,
            unit: self.unit.map(|unit| match unit {
                UnitArg::M => Unit::M,
                UnitArg::Cm => Unit::Cm,
                UnitArg::Mm => Unit::Mm,
                UnitArg::Osceleton => Unit::Osceleton,
            }),
            axes: self.axes.clone(),
            gap_ms: self.gap,
        }
    }
}

fn joint_set(text: &str) -> Result<JointSet, String> {
    text.parse()
        .map_err(|error: posefuse_skeleton::UnknownJointSet| error.to_string())
}

fn axes(text: &str) -> Result<String, String> {
    text.parse::<Axes>().map(|_| text.to_owned())
}
