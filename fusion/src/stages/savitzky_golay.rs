//! Savitzky-Golay over one joint.

use nalgebra::Vector3;
use posefuse_skeleton::Timestamp;
use serde::{Deserialize, Serialize};
use sgfilter::{Spec, Stream};

use super::JointFilter;

/// A stream of one joint's places.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct SavitzkyGolay {
    stream: Stream<3>,
}

impl SavitzkyGolay {
    /// `None` for settings no filter can have.
    pub(super) fn new(window: usize, order: usize, look_ahead: usize) -> Option<Self> {
        let spec = Spec::new(window, order, look_ahead, 0).ok()?;
        Some(Self {
            stream: Stream::new(spec),
        })
    }

    /// Gives what is held back and starts afresh.
    pub(super) fn flush(&mut self, give: &mut dyn FnMut(Timestamp, Vector3<f64>)) {
        for sample in self.stream.flush() {
            give(Timestamp::from_ns(sample.t_ns), sample.value.into());
        }
    }
}

impl JointFilter for SavitzkyGolay {
    fn push(
        &mut self,
        time: Timestamp,
        position: Vector3<f64>,
    ) -> Option<(Timestamp, Vector3<f64>)> {
        // Times of frames increase and places are finite, so a refusal cannot occur; if it did the raw place stays.
        let sample = self
            .stream
            .push(time.ns(), position.into())
            .ok()
            .flatten()?;
        Some((Timestamp::from_ns(sample.t_ns), sample.value.into()))
    }
}
