//! The calibrations that are kept, and calibrations to and from other programs: list, restore, compare, export, import.

use std::io;
use std::sync::Arc;

use posefuse_calibration::formats::{self, Format};
use posefuse_calibration::{Change, SensorMove, compare};
use posefuse_proto::{calibration_to_wire, check_sensor_name, v1};
use posefuse_session::Storage;
use posefuse_skeleton::Calibration;
use tonic::Status;

use super::calibration::REMEDY;
use super::{Room, history};

/// Longest text that is read, bytes.
const MAX_TEXT: usize = 1 << 20;

impl Room {
    pub(super) async fn list_calibrations(&self) -> Result<v1::ListCalibrationsResponse, Status> {
        let kept = self.with_history(history::list).await?;
        let is_any_in_force = self.calibration.current().is_some();
        let entry = |kept: history::Kept| {
            let (calibration, trouble) = match kept.calibration {
                Ok(calibration) => (Some(calibration_to_wire(&calibration)), String::new()),
                Err(trouble) => (None, trouble),
            };
            v1::StoredCalibration {
                name: kept.name,
                in_force: kept.in_force && is_any_in_force,
                calibration,
                trouble,
            }
        };
        Ok(v1::ListCalibrationsResponse {
            calibrations: kept.into_iter().map(entry).collect(),
        })
    }

    pub(super) async fn restore_calibration(
        self: &Arc<Self>,
        name: String,
    ) -> Result<v1::Calibration, Status> {
        let (text, calibration) = self.kept(name).await?;
        let wire = calibration_to_wire(&calibration);
        self.put_text_in_force(calibration, text).await?;
        Ok(wire)
    }

    pub(super) async fn compare_calibrations(
        &self,
        request: v1::CompareCalibrationsRequest,
    ) -> Result<v1::CompareCalibrationsResponse, Status> {
        let before = self.named(request.before).await?;
        let after = self.named(request.after).await?;
        let moves = compare(&before, &after).into_iter().map(move_to_wire);
        Ok(v1::CompareCalibrationsResponse {
            moves: moves.collect(),
        })
    }

    pub(super) async fn export_calibration(
        &self,
        request: v1::ExportCalibrationRequest,
    ) -> Result<v1::CalibrationFile, Status> {
        let format = format_from_wire(request.format()).unwrap_or(Format::Toml);
        let calibration = self.named(request.name.clone()).await?;
        let name = match request.name.as_str() {
            "" => calibration.created.as_str(),
            name => name,
        };
        let is_plain = |c: &char| c.is_ascii_alphanumeric() || matches!(c, '.' | '_' | '-');
        let name: String = name.replace(':', "-").chars().filter(is_plain).collect();
        let head = if name.is_empty() {
            "calibration"
        } else {
            "calibration-"
        };
        Ok(v1::CalibrationFile {
            file_name: format!("{head}{name}{}", format.file_ending()),
            text: formats::export(&calibration, format),
        })
    }

    pub(super) async fn import_calibration(
        self: &Arc<Self>,
        request: v1::ImportCalibrationRequest,
    ) -> Result<v1::Calibration, Status> {
        let format = format_from_wire(request.format());
        if request.text.len() > MAX_TEXT {
            return Err(Status::invalid_argument(format!(
                "`text` has {} bytes, far too many for a calibration",
                request.text.len()
            )));
        }
        let refused = |error: &dyn std::fmt::Display| Status::invalid_argument(error.to_string());
        let mut calibration =
            formats::import(&request.text, format).map_err(|error| refused(&error))?;
        for name in calibration.sensors.keys() {
            check_sensor_name(name).map_err(|error| refused(&error))?;
        }
        if calibration.created.is_empty() {
            calibration.created = self.clock.rfc3339();
        }
        self.check_is_of_this_room(&calibration)?;
        let wire = calibration_to_wire(&calibration);
        if !request.dry_run {
            self.put_in_force(calibration).await?;
        }
        Ok(wire)
    }

    /// Refuses a calibration that places none of the sensors that have connected, if any has.
    fn check_is_of_this_room(&self, calibration: &Calibration) -> Result<(), Status> {
        let sensors = self.registry.sensors();
        let here: Vec<&str> = sensors.iter().map(|sensor| sensor.name()).collect();
        if here.is_empty()
            || here
                .iter()
                .any(|name| calibration.sensors.contains_key(*name))
        {
            return Ok(());
        }
        Err(Status::failed_precondition(format!(
            "this calibration is of other sensors: it places {}, this room has {}; give the sensors in it the names of \
             this room's, or calibrate; the calibration in force is as it was",
            listed(calibration.sensors.keys().map(String::as_str)),
            listed(here)
        )))
    }

    /// The one that is kept under `name`; an empty name: the one in force.
    async fn named(&self, name: String) -> Result<Calibration, Status> {
        if !name.is_empty() {
            return Ok(self.kept(name).await?.1);
        }
        let current = self.calibration.current();
        let current = current.map(|calibration| (*calibration).clone());
        current.ok_or_else(|| Status::not_found(format!("no calibration is in force; {REMEDY}")))
    }

    async fn kept(&self, name: String) -> Result<(String, Calibration), Status> {
        let wanted = name.clone();
        let found = self
            .with_history(move |storage, file| history::find(storage, file, &wanted))
            .await?;
        let shown: String = name.chars().take(80).collect();
        let (text, calibration) = found.ok_or_else(|| {
            Status::not_found(format!(
                "no calibration is kept as `{shown}`; `posefuse calibrations` lists them"
            ))
        })?;
        match calibration {
            Ok(calibration) => Ok((text, calibration)),
            Err(trouble) => Err(Status::failed_precondition(format!(
                "the calibration `{shown}` cannot be used: {trouble}"
            ))),
        }
    }

    /// Work on the folder of calibrations, away from the connections.
    async fn with_history<T: Send + 'static>(
        &self,
        work: impl FnOnce(&dyn Storage, &str) -> io::Result<T> + Send + 'static,
    ) -> Result<T, Status> {
        let (storage, file) = self.calibration.place();
        let place = storage.place();
        let done = self.threads.blocking(move || work(&*storage, &file)).await;
        done.map_err(|error| Status::internal(error.to_string()))?
            .map_err(|error| {
                Status::failed_precondition(format!(
                    "the calibrations in {place} cannot be read: {error}"
                ))
            })
    }
}

/// Names in a sentence.
pub(super) fn listed<'a>(names: impl IntoIterator<Item = &'a str>) -> String {
    let quoted: Vec<String> = names.into_iter().map(|name| format!("`{name}`")).collect();
    quoted.join(", ")
}

fn format_from_wire(format: v1::CalibrationFormat) -> Option<Format> {
    match format {
        v1::CalibrationFormat::Unspecified => None,
        v1::CalibrationFormat::Toml => Some(Format::Toml),
        v1::CalibrationFormat::Json => Some(Format::Json),
        v1::CalibrationFormat::Tf2Yaml => Some(Format::Tf2Yaml),
        v1::CalibrationFormat::OpencvYaml => Some(Format::OpenCvYaml),
    }
}

fn move_to_wire(row: SensorMove) -> v1::SensorMove {
    let mut wire = v1::SensorMove {
        sensor: row.sensor,
        ..Default::default()
    };
    match row.change {
        Change::Moved { mm, deg, ms } => {
            (wire.moved_mm, wire.moved_deg, wire.moved_ms) = (Some(mm), Some(deg), Some(ms));
        }
        Change::MissingBefore => wire.missing_in = "before".to_owned(),
        Change::MissingAfter => wire.missing_in = "after".to_owned(),
    }
    wire
}
