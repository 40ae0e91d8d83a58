//! The methods of the service, each handed to the module that does it.

use std::pin::Pin;
use std::time::Duration;

use futures_util::{Stream, StreamExt, stream};
use posefuse_proto::{calibration_from_wire, calibration_to_wire, v1};
use tonic::{Request, Response, Status};

use super::{RoomService, calibrate, plan, replay, status};
use crate::net::decoded;

/// A stream of answers.
pub(super) type Answers<T> = Pin<Box<dyn Stream<Item = Result<T, Status>> + Send>>;

type Answer<T> = Result<Response<T>, Status>;

#[tonic::async_trait]
impl v1::room_server::Room for RoomService {
    type WatchStream = Answers<v1::RoomFrame>;
    type WatchSensorsStream = Answers<v1::Observation>;
    type WatchDepthStream = Answers<v1::DepthPreview>;
    type WatchStatusStream = Answers<v1::RoomStatus>;
    type ReplayTakeStream = Answers<v1::ReplayEvent>;
    type CalibrateStream = Answers<v1::CalibrateEvent>;

    // Over the network the next three are served from shared bytes, see `net::shared_bytes`.
    async fn watch(&self, request: Request<v1::WatchRequest>) -> Answer<Self::WatchStream> {
        Ok(Response::new(Box::pin(
            self.open_watch(request)?.map(decoded),
        )))
    }

    async fn watch_sensors(
        &self,
        request: Request<v1::WatchSensorsRequest>,
    ) -> Answer<Self::WatchSensorsStream> {
        Ok(Response::new(Box::pin(
            self.open_watch_sensors(request)?.map(decoded),
        )))
    }

    async fn watch_depth(
        &self,
        request: Request<v1::WatchDepthRequest>,
    ) -> Answer<Self::WatchDepthStream> {
        Ok(Response::new(Box::pin(
            self.open_watch_depth(request)?.map(decoded),
        )))
    }

    async fn watch_status(
        &self,
        request: Request<v1::WatchStatusRequest>,
    ) -> Answer<Self::WatchStatusStream> {
        let changes = status::changes(self.0.clone(), request.into_inner().max_rate_hz);
        Ok(Response::new(Box::pin(changes)))
    }

    async fn get_status(&self, _: Request<v1::GetStatusRequest>) -> Answer<v1::RoomStatus> {
        Ok(Response::new(self.status()))
    }

    async fn start_take(&self, request: Request<v1::StartTakeRequest>) -> Answer<v1::Take> {
        self.0
            .start_take(request.into_inner())
            .await
            .map(Response::new)
    }

    async fn stop_take(&self, _: Request<v1::StopTakeRequest>) -> Answer<v1::Take> {
        self.0.stop_take().await.map(Response::new)
    }

    async fn list_takes(&self, _: Request<v1::ListTakesRequest>) -> Answer<v1::ListTakesResponse> {
        let takes = self.0.list_takes().await?;
        Ok(Response::new(v1::ListTakesResponse { takes }))
    }

    async fn replay_take(
        &self,
        request: Request<v1::ReplayTakeRequest>,
    ) -> Answer<Self::ReplayTakeStream> {
        let events = replay::replay(self.0.clone(), request.into_inner()).await?;
        Ok(Response::new(events))
    }

    async fn update_take(&self, request: Request<v1::UpdateTakeRequest>) -> Answer<v1::Take> {
        self.0
            .update_take(request.into_inner())
            .await
            .map(Response::new)
    }

    async fn calibrate(
        &self,
        request: Request<v1::CalibrateRequest>,
    ) -> Answer<Self::CalibrateStream> {
        let events = calibrate::calibrate(self.0.clone(), request.into_inner()).await?;
        Ok(Response::new(events))
    }

    async fn get_calibration(
        &self,
        _: Request<v1::GetCalibrationRequest>,
    ) -> Answer<v1::Calibration> {
        match self.0.calibration.current() {
            Some(calibration) => Ok(Response::new(calibration_to_wire(&calibration))),
            None => Err(Status::not_found(format!(
                "no calibration is in force; {}",
                super::calibration::REMEDY
            ))),
        }
    }

    async fn set_calibration(
        &self,
        request: Request<v1::SetCalibrationRequest>,
    ) -> Answer<v1::Calibration> {
        let wire = request.into_inner().calibration;
        let wire =
            wire.ok_or_else(|| Status::invalid_argument("the message lacks `calibration`"))?;
        let calibration = calibration_from_wire(&wire)
            .map_err(|error| Status::invalid_argument(error.to_string()))?;
        if calibration.sensors.is_empty() {
            return Err(Status::invalid_argument("the calibration names no sensor"));
        }
        self.0.put_in_force(calibration.clone()).await?;
        Ok(Response::new(calibration_to_wire(&calibration)))
    }

    async fn list_calibrations(
        &self,
        _: Request<v1::ListCalibrationsRequest>,
    ) -> Answer<v1::ListCalibrationsResponse> {
        self.0.list_calibrations().await.map(Response::new)
    }

    async fn restore_calibration(
        &self,
        request: Request<v1::RestoreCalibrationRequest>,
    ) -> Answer<v1::Calibration> {
        let name = request.into_inner().name;
        self.0.restore_calibration(name).await.map(Response::new)
    }

    async fn compare_calibrations(
        &self,
        request: Request<v1::CompareCalibrationsRequest>,
    ) -> Answer<v1::CompareCalibrationsResponse> {
        let request = request.into_inner();
        self.0
            .compare_calibrations(request)
            .await
            .map(Response::new)
    }

    async fn export_calibration(
        &self,
        request: Request<v1::ExportCalibrationRequest>,
    ) -> Answer<v1::CalibrationFile> {
        let request = request.into_inner();
        self.0.export_calibration(request).await.map(Response::new)
    }

    async fn import_calibration(
        &self,
        request: Request<v1::ImportCalibrationRequest>,
    ) -> Answer<v1::Calibration> {
        let request = request.into_inner();
        self.0.import_calibration(request).await.map(Response::new)
    }

    async fn recalibrate_sensor(
        &self,
        request: Request<v1::RecalibrateSensorRequest>,
    ) -> Answer<v1::CalibrateResult> {
        crate::drift::recalibrate(&self.0, request.into_inner())
            .await
            .map(Response::new)
    }

    async fn mute_sensor(
        &self,
        request: Request<v1::MuteSensorRequest>,
    ) -> Answer<v1::MuteSensorResponse> {
        self.0
            .mute_sensor(request.into_inner())
            .await
            .map(Response::new)
    }

    async fn plan_room(&self, request: Request<v1::PlanRoomRequest>) -> Answer<v1::RoomPlan> {
        plan::plan_room(&self.0, request.into_inner())
            .await
            .map(Response::new)
    }

    async fn switch_sink(&self, request: Request<v1::SwitchSinkRequest>) -> Answer<v1::SinkStatus> {
        let v1::SwitchSinkRequest { name, on } = request.into_inner();
        self.0.switch_sink(&name, on).map(Response::new)
    }

    async fn get_config(&self, _: Request<v1::GetConfigRequest>) -> Answer<v1::GetConfigResponse> {
        let toml = self.0.config.to_toml();
        Ok(Response::new(v1::GetConfigResponse { toml }))
    }
}

/// Answers that arrive over `queue` until its sender is dropped.
pub(super) fn answers<T: Send + 'static>(
    queue: tokio::sync::mpsc::Receiver<Result<T, Status>>,
) -> Answers<T> {
    Box::pin(stream::unfold(queue, |mut queue| async move {
        let answer = queue.recv().await?;
        Some((answer, queue))
    }))
}

/// The pause between two messages of at most `max_rate_hz`, within `slowest`.
pub(super) fn pause(max_rate_hz: f64, usual_hz: f64, slowest: Duration) -> Duration {
    let rate = if max_rate_hz.is_finite() && max_rate_hz > 0.0 {
        max_rate_hz.min(50.0)
    } else {
        usual_hz
    };
    Duration::try_from_secs_f64(1.0 / rate).map_or(slowest, |pause| pause.min(slowest))
}
