//! A frame as samples, one a slot, and what streams say of their channels. Pure.
//!
//! Channels: of each canonical joint X, Y, Z (metres) and confidence (0 to 1), then the person's id. What is missing is NaN,
//! in an empty slot everything. Described as the MoCap meta-data of XDF has it:
//! <https://github.com/sccn/xdf/wiki/MoCap-Meta-Data>.

use posefuse_devices::lsl::{Node, Stream};
use posefuse_skeleton::{JOINT_COUNT, Joint, TrackId};

use super::Settings;
use crate::slots::Slots;
use crate::{Axes, Joints, LiveFrame};

/// Of each joint.
const OF_JOINT: usize = 4;
/// Of a stream.
pub(super) const CHANNELS: usize = OF_JOINT * JOINT_COUNT + 1;

/// Makes samples, and remembers who has which slot.
pub(super) struct Sampler {
    slots: Slots,
    axes: Axes,
    joints: Joints,
}

impl Sampler {
    pub(super) fn new(settings: &Settings) -> Self {
        Self {
            slots: Slots::new(settings.people),
            axes: settings.axes,
            joints: settings.joints,
        }
    }

    /// Of each slot the sample.
    pub(super) fn samples(&mut self, frame: &LiveFrame) -> Vec<Vec<f32>> {
        let people = self.joints.people(frame);
        let ids: Vec<TrackId> = people.iter().map(|(track, _)| track.id).collect();
        self.slots.update(frame.frame.time, &ids, &ids);
        let samples = self.slots.holders().map(|holder| {
            let mut sample = vec![f32::NAN; CHANNELS];
            let person = people.iter().find(|(track, _)| Some(track.id) == holder);
            let Some(person) = person else {
                return sample;
            };
            for (joint, values) in Joint::ALL.iter().zip(sample.chunks_mut(OF_JOINT)) {
                if let Some(at) = self.joints.of(*person, *joint) {
                    let at = self.axes.from_room() * at.vector();
                    for (value, coordinate) in values.iter_mut().zip(at.iter()) {
                        *value = *coordinate as f32;
                    }
                }
                if let Some(state) = &person.0.skeleton[*joint] {
                    values[3] = state.confidence.get();
                }
            }
            sample[CHANNELS - 1] = person.0.id.0 as f32;
            sample
        });
        samples.collect()
    }
}

/// The stream of a slot.
pub(super) fn stream(settings: &Settings, slot: usize) -> Stream {
    let name = format!("{} {}", settings.name, slot + 1);
    let text = |name, text: &str| Node::Text(name, text.to_owned());
    let channel = |label: String, marker: &str, kind: &str, unit: &str| {
        let mut nodes = vec![Node::Text("label", label)];
        if !marker.is_empty() {
            nodes.push(text("marker", marker));
        }
        nodes.push(Node::Text("object", name.clone()));
        nodes.extend([text("type", kind), text("unit", unit)]);
        Node::Group("channel", nodes)
    };
    let mut channels = Vec::with_capacity(CHANNELS);
    for joint in Joint::ALL {
        for axis in ["X", "Y", "Z"] {
            let (label, kind) = (format!("{joint}.{axis}"), format!("Position{axis}"));
            channels.push(channel(label, joint.name(), &kind, "meters"));
        }
        let label = format!("{joint}.Confidence");
        channels.push(channel(label, joint.name(), "Confidence", "normalized"));
    }
    channels.push(channel("Person".to_owned(), "", "Id", "none"));
    let system = vec![
        text("manufacturer", "Posefuse"),
        text("model", concat!("posefuse ", env!("CARGO_PKG_VERSION"))),
        Node::Group("settings", vec![text("axes", settings.axes.in_words())]),
    ];
    Stream {
        source_id: format!("posefuse {name}"),
        name,
        content: "MoCap".to_owned(),
        channels: CHANNELS,
        description: vec![
            Node::Group("channels", channels),
            Node::Group("acquisition", system),
        ],
    }
}
