//! The outputs of the server: how each is, and on and off.

use posefuse_proto::v1;
use posefuse_sinks::{SinkState, SinkStatus};
use tonic::Status;

use super::Room;

impl Room {
    /// What is always there, then what can be switched.
    pub(super) fn sink_statuses(&self) -> Vec<v1::SinkStatus> {
        let always = self.counters.all();
        let always = always.into_iter().map(|(name, meter)| v1::SinkStatus {
            name: name.to_owned(),
            delivered: meter.delivered(),
            dropped: meter.dropped(),
            ..Default::default()
        });
        let [delivered, dropped] = self.sinks.solved_and_missed();
        let bodies = v1::SinkStatus {
            name: "bodies".to_owned(),
            delivered,
            dropped,
            ..Default::default()
        };
        always
            .chain([bodies])
            .chain(self.sinks.statuses().into_iter().map(to_wire))
            .collect()
    }

    /// Switches a live stream on or off.
    pub(super) fn switch_sink(&self, name: &str, on: bool) -> Result<v1::SinkStatus, Status> {
        let status = self.sinks.switch(name, on);
        status
            .map(to_wire)
            .map_err(|error| Status::not_found(error.to_string()))
    }
}

fn to_wire(status: SinkStatus) -> v1::SinkStatus {
    let state = match status.state {
        SinkState::Off => v1::SinkState::Off,
        SinkState::Running => v1::SinkState::Running,
        SinkState::Failing => v1::SinkState::Failing,
    };
    v1::SinkStatus {
        name: status.kind.to_string(),
        delivered: status.delivered,
        dropped: status.dropped,
        state: state.into(),
        place: status.place,
        rate_hz: status.rate_hz,
        clients: status.clients,
        p50_ms: status.p50_ms,
        p99_ms: status.p99_ms,
        trouble: status.trouble,
    }
}
