//! Leaving a sensor out of fusing, and taking it in again.

use posefuse_fusion::Input;
use posefuse_proto::v1;
use tonic::Status;

use super::Room;

impl Room {
    /// Tells the engine, in order with all it is told, so that a running take has it, too.
    pub(super) async fn mute_sensor(
        &self,
        request: v1::MuteSensorRequest,
    ) -> Result<v1::MuteSensorResponse, Status> {
        let sensors = self.registry.sensors();
        let found = sensors.iter().find(|known| known.name() == request.sensor);
        let sensor = found.ok_or_else(|| self.unknown_sensor(&request.sensor))?;
        // One at a time, so that the status and the engine agree at the end.
        let _muting = self.muting.lock().await;
        let (id, muted) = (sensor.id(), request.muted);
        self.inputs.send(Input::Mute { sensor: id, muted }).await?;
        sensor.set_muted(muted);
        tracing::info!(
            sensor = sensor.name(),
            muted,
            "a sensor was muted or taken in again"
        );
        Ok(v1::MuteSensorResponse {})
    }

    /// The refusal of a name that no sensor has.
    pub(crate) fn unknown_sensor(&self, name: &str) -> Status {
        let sensors = self.registry.sensors();
        let known: Vec<_> = sensors
            .iter()
            .map(|sensor| format!("`{}`", sensor.name()))
            .collect();
        let known = if known.is_empty() {
            "no agent has connected yet".to_owned()
        } else {
            format!("there are {}", known.join(", "))
        };
        Status::not_found(format!("no sensor is called `{name}`; {known}"))
    }
}
