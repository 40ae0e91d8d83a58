//! One sensor's depth previews: who watches, how many the agent is asked for, the newest one.
//!
//! Previews go from the agent's stream straight to those who watch. They are never recorded, never queued (whoever is
//! slow gets the newest), and come nowhere near the fusion thread. The agent is asked for them only while somebody
//! watches, for as many as whoever wants most.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use bytes::Bytes;
use futures_util::stream;
use posefuse_proto::{bodies_from_agent, observation_to_wire, v1};
use posefuse_skeleton::{AgentTime, JointSet, Observation, Timestamp};
use prost::Message;
use tokio::sync::{OwnedSemaphorePermit, watch};
use tokio_util::sync::CancellationToken;
use tonic::Status;

use super::Sensor;
use crate::Clock;
use crate::net::EncodedStream;
use crate::sinks::Pace;

/// Most previews a second, whatever is asked for.
pub(crate) const MAX_RATE_HZ: f64 = 10.0;
/// Largest preview.
const MAX_SIZE: [u32; 2] = [320, 240];

/// The previews of one sensor.
#[derive(Debug)]
pub(crate) struct Depth {
    watchers: Mutex<Watchers>,
    /// Previews a second that the agent is to send; 0: none.
    wanted_hz: watch::Sender<f64>,
    newest: watch::Sender<Newest>,
}

#[derive(Debug, Default)]
struct Watchers {
    next: u64,
    rates_hz: BTreeMap<u64, f64>,
}

#[derive(Clone, Debug)]
enum Newest {
    /// None has come, or its agent left.
    Nothing,
    /// Encoded.
    Preview(Bytes),
    /// The sensor's agent came back without previews.
    NoMore,
}

impl Default for Depth {
    fn default() -> Self {
        Self {
            watchers: Mutex::default(),
            wanted_hz: watch::Sender::new(0.0),
            newest: watch::Sender::new(Newest::Nothing),
        }
    }
}

impl Depth {
    /// How many previews a second the agent is to send now.
    pub(crate) fn wanted_hz(&self) -> f64 {
        *self.wanted_hz.borrow()
    }

    /// An agent greeted, with previews to give or without.
    pub(crate) fn greeted(&self, has_previews: bool) {
        self.newest.send_replace(if has_previews {
            Newest::Nothing
        } else {
            Newest::NoMore
        });
    }

    /// Hands a preview to those who watch.
    pub(crate) fn publish(&self, preview: &v1::DepthPreview) {
        let encoded = preview.encode_to_vec().into();
        self.newest.send_replace(Newest::Preview(encoded));
    }

    fn change(&self, change: impl FnOnce(&mut Watchers)) {
        let mut watchers = self.watchers.lock().unwrap_or_else(PoisonError::into_inner);
        change(&mut watchers);
        let largest = watchers.rates_hz.values().copied().fold(0.0, f64::max);
        self.wanted_hz.send_replace(largest);
    }
}

/// One subscriber's wish; dropping it takes it back.
struct Watching {
    sensor: Arc<Sensor>,
    number: u64,
    _place: Arc<OwnedSemaphorePermit>,
}

impl Watching {
    fn new(sensor: Arc<Sensor>, rate_hz: f64, place: Arc<OwnedSemaphorePermit>) -> Self {
        let mut number = 0;
        sensor.depth().change(|watchers| {
            number = watchers.next;
            watchers.next += 1;
            watchers.rates_hz.insert(number, rate_hz);
        });
        Self {
            sensor,
            number,
            _place: place,
        }
    }
}

impl Drop for Watching {
    fn drop(&mut self) {
        self.sensor.depth().change(|watchers| {
            watchers.rates_hz.remove(&self.number);
        });
    }
}

/// A subscriber's stream, at most `max_rate_hz` previews a second (0 or nonsense: as many as there may be).
///
/// It lives on while the agent is away, and ends when the server stops or the agent comes back without previews.
pub(crate) fn watch(
    sensor: Arc<Sensor>,
    max_rate_hz: f64,
    place: Arc<OwnedSemaphorePermit>,
    clock: Arc<dyn Clock>,
    stop: CancellationToken,
) -> Result<EncodedStream, Status> {
    let has_previews = sensor
        .greeting()
        .camera
        .is_some_and(|camera| camera.depth_preview);
    if !has_previews {
        return Err(none(&sensor));
    }
    let asked = max_rate_hz.is_finite() && max_rate_hz > 0.0;
    let rate_hz = if asked { max_rate_hz } else { MAX_RATE_HZ }.min(MAX_RATE_HZ);
    let newest = sensor.depth().newest.subscribe();
    let watching = Watching::new(sensor, rate_hz, place);
    let open = Some((watching, newest, Pace::new(rate_hz)));
    Ok(Box::pin(stream::unfold(open, move |open| {
        next(open, clock.clone(), stop.clone())
    })))
}

type Open = Option<(Watching, watch::Receiver<Newest>, Pace)>;

async fn next(
    open: Open,
    clock: Arc<dyn Clock>,
    stop: CancellationToken,
) -> Option<(Result<Bytes, Status>, Open)> {
    let (watching, mut newest, mut pace) = open?;
    loop {
        let changed = tokio::select! {
            biased;
            () = stop.cancelled() => false,
            changed = newest.changed() => changed.is_ok(),
        };
        if !changed {
            return Some((Err(Status::unavailable("the server is stopping")), None));
        }
        let latest = newest.borrow_and_update().clone();
        match latest {
            Newest::Preview(bytes) if pace.is_due(clock.now()) => {
                return Some((Ok(bytes), Some((watching, newest, pace))));
            }
            Newest::Preview(_) | Newest::Nothing => {}
            Newest::NoMore => return Some((Err(none(&watching.sensor)), None)),
        }
    }
}

fn none(sensor: &Sensor) -> Status {
    let model = sensor.greeting().info.model.clone();
    Status::failed_precondition(format!(
        "sensor `{}` ({model}) has no depth previews: its agent passes on the skeletons of a tracker and has no depth \
         images to show",
        sensor.name()
    ))
}

/// A preview as it goes to those who watch: checked, with its sensor's name and canonical joints. The error says what
/// is wrong with it.
pub(crate) fn checked(
    sensor: &Sensor,
    joint_set: JointSet,
    preview: v1::DepthPreview,
    now: Timestamp,
) -> Result<v1::DepthPreview, String> {
    let (width, height) = (preview.width, preview.height);
    let [most_wide, most_high] = MAX_SIZE;
    if width == 0 || height == 0 || width > most_wide || height > most_high {
        return Err(format!(
            "it is {width} x {height} pixels, at most {most_wide} x {most_high} are taken"
        ));
    }
    let (needed, found) = (2 * (width * height) as usize, preview.millimetres.len());
    if found != needed {
        return Err(format!(
            "{width} x {height} pixels need {needed} bytes, it has {found}"
        ));
    }
    let camera = preview.camera.as_ref().ok_or("it lacks `camera`")?;
    let focal = [camera.fx, camera.fy];
    let finite = [camera.cx, camera.cy].iter().all(|at| at.is_finite());
    if !finite || !focal.iter().all(|f| f.is_finite() && *f > 0.0) {
        return Err(format!("no camera is like this: {camera:?}"));
    }
    let bodies = bodies_from_agent(sensor.id(), joint_set, &preview.bodies)
        .map_err(|error| error.to_string())?;
    let canonical = observation_to_wire(&Observation {
        sensor: sensor.id(),
        sequence: 0,
        captured: AgentTime::from_ns(preview.captured_ns),
        received: now,
        bodies,
    });
    Ok(v1::DepthPreview {
        sensor: sensor.name().to_owned(),
        bodies: canonical.bodies,
        ..preview
    })
}

/// What an agent says of its camera, where it can be true; numbers that cannot are taken for not known.
pub(crate) fn sane(camera: Option<v1::CameraInfo>) -> Option<v1::CameraInfo> {
    let mut camera = camera?;
    let view = |degrees: f64| degrees > 0.0 && degrees < 180.0;
    if !view(camera.fov_horizontal_deg) || !view(camera.fov_vertical_deg) {
        (camera.fov_horizontal_deg, camera.fov_vertical_deg) = (0.0, 0.0);
    }
    let range = camera.near_m >= 0.0 && camera.far_m > camera.near_m && camera.far_m.is_finite();
    if !range {
        (camera.near_m, camera.far_m) = (0.0, 0.0);
    }
    Some(camera)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_camera_that_cannot_be_is_not_known() {
        let camera = v1::CameraInfo {
            fov_horizontal_deg: 70.0,
            fov_vertical_deg: 60.0,
            near_m: 0.5,
            far_m: 4.5,
            depth_preview: true,
        };
        assert_eq!(sane(Some(camera)), Some(camera));
        assert_eq!(sane(None), None);
        let blind = v1::CameraInfo {
            fov_horizontal_deg: f64::NAN,
            far_m: f64::INFINITY,
            ..camera
        };
        let known = sane(Some(blind)).unwrap();
        assert_eq!(
            (known.fov_horizontal_deg, known.fov_vertical_deg),
            (0.0, 0.0)
        );
        assert_eq!((known.near_m, known.far_m), (0.0, 0.0));
        assert!(known.depth_preview);
    }
}
