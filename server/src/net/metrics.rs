//! `/metrics`: the room's state in Prometheus' text form, made from the same status that everybody else sees.

use std::collections::BTreeMap;
use std::sync::atomic::AtomicU64;

use posefuse_fusion::RejectionReason;
use posefuse_proto::v1;
use prometheus_client::encoding::text::encode;
use prometheus_client::metrics::counter::Counter;
use prometheus_client::metrics::family::Family;
use prometheus_client::metrics::gauge::Gauge;
use prometheus_client::registry::Registry;

use super::Connections;
use crate::fusion_thread::Snapshot;

type Labels = Vec<(&'static str, String)>;
type Totals = Family<Labels, Counter>;
type Values = Family<Labels, Gauge<f64, AtomicU64>>;

/// The page's text.
pub(super) fn text(
    status: &v1::RoomStatus,
    snapshot: &Snapshot,
    connections: &Connections,
) -> String {
    let mut page = Page(Registry::with_prefix("posefuse"));
    sensors(&mut page, status, snapshot);
    page.total("frames", "Fused frames", snapshot.frames);
    room(&mut page, status, connections);
    if let Some(repair) = &status.repair {
        repaired(&mut page, repair);
    }
    let mut text = String::new();
    // Writing to a String cannot fail.
    let _ = encode(&mut text, &page.0);
    text
}

struct Page(Registry);

impl Page {
    fn values(&mut self, name: &str, help: &str, values: impl IntoIterator<Item = (Labels, f64)>) {
        let family = Values::default();
        for (labels, value) in values {
            family.get_or_create(&labels).set(value);
        }
        self.0.register(name, help, family);
    }

    fn value(&mut self, name: &str, help: &str, value: f64) {
        let gauge = Gauge::<f64, AtomicU64>::default();
        gauge.set(value);
        self.0.register(name, help, gauge);
    }

    fn total(&mut self, name: &str, help: &str, total: u64) {
        let counter = Counter::<u64>::default();
        counter.inc_by(total);
        self.0.register(name, help, counter);
    }

    fn totals(&mut self, name: &str, help: &str, totals: impl IntoIterator<Item = (Labels, u64)>) {
        let family = Totals::default();
        for (labels, total) in totals {
            family.get_or_create(&labels).inc_by(total);
        }
        self.0.register(name, help, family);
    }
}

fn of(sensor: &v1::SensorStatus) -> Labels {
    let name = sensor.info.as_ref().map(|info| info.name.clone());
    vec![("sensor", name.unwrap_or_default())]
}

/// One gauge of a sensor; absent while it is not known.
type SensorValue = (
    &'static str,
    &'static str,
    fn(&v1::SensorStatus) -> Option<f64>,
);

const SENSOR_VALUES: [SensorValue; 7] = [
    (
        "sensor_connected",
        "Whether the sensor's agent is connected",
        |s| truth(s.state() != v1::SensorState::Disconnected),
    ),
    ("sensor_live", "Whether the sensor delivers frames", |s| {
        truth(s.state() == v1::SensorState::Live)
    }),
    (
        "sensor_frames_per_second",
        "Frames per second over the last two seconds",
        |s| Some(s.frames_per_second),
    ),
    (
        "sensor_latency_seconds",
        "From capture to the server, median",
        |s| Some(s.latency_ms? * 1e-3),
    ),
    (
        "sensor_clock_offset_seconds",
        "Agent clock against server clock",
        |s| Some(s.clock_offset_ms? * 1e-3),
    ),
    (
        "sensor_clock_error_seconds",
        "Bound of the offset's error",
        |s| Some(s.clock_error_ms? * 1e-3),
    ),
    (
        "sensor_residual_meters",
        "Median distance of the sensor's joints to the fused ones",
        |s| Some(s.residual_mm? * 1e-3),
    ),
];

fn truth(is_so: bool) -> Option<f64> {
    Some(f64::from(u8::from(is_so)))
}

fn sensors(page: &mut Page, status: &v1::RoomStatus, snapshot: &Snapshot) {
    for (name, help, value) in SENSOR_VALUES {
        let sensors = status.sensors.iter();
        page.values(
            name,
            help,
            sensors.filter_map(|sensor| Some((of(sensor), value(sensor)?))),
        );
    }
    let sensors = status.sensors.iter();
    let received = sensors.clone().map(|s| (of(s), s.frames_received));
    page.totals("sensor_frames_received", "Frames that came", received);
    let lost = sensors.clone().map(|s| (of(s), s.frames_lost));
    page.totals("sensor_frames_lost", "Gaps in the sequence numbers", lost);
    let refused = sensors.flat_map(|sensor| {
        let of_reason = |(reason, count)| {
            let mut labels = of(sensor);
            labels.push(("reason", reason));
            (labels, count)
        };
        rejected(sensor, snapshot).into_iter().map(of_reason)
    });
    page.totals("rejected", "Frames and joints refused", refused);
}

/// What was refused, by reason; here also what came before there was a calibration.
fn rejected(sensor: &v1::SensorStatus, snapshot: &Snapshot) -> BTreeMap<String, u64> {
    let shown = sensor.rejected.iter();
    let mut all: BTreeMap<String, u64> =
        shown.map(|(name, count)| (name.clone(), *count)).collect();
    let id = sensor.info.as_ref().map(|info| info.id as usize);
    let view = id.and_then(|id| snapshot.sensors.get(id));
    if let Some(early) = view
        .map(|view| view.before_calibration)
        .filter(|early| *early > 0)
    {
        *all.entry(RejectionReason::Uncalibrated.name().to_owned())
            .or_default() += early;
    }
    all
}

/// What the model beside the engine was asked and how it answered.
fn repaired(page: &mut Page, repair: &v1::RepairStatus) {
    let v1::RepairStatus { model, runtime, .. } = repair;
    let about = vec![("model", model.clone()), ("runtime", runtime.clone())];
    let help = "What fills in joints that no sensor sees";
    page.values("repair_model", help, [(about, 1.0)]);
    for (name, help, total) in [
        (
            "repair_requests",
            "Windows that the repair model was asked to fill",
            repair.requests,
        ),
        (
            "repair_answers",
            "Windows that it filled in time",
            repair.answers,
        ),
        (
            "repair_late",
            "Windows whose answer came too late",
            repair.late,
        ),
        (
            "repair_failed",
            "Windows that it gave no answer to",
            repair.failed,
        ),
    ] {
        page.total(name, help, total);
    }
    let quantile =
        |share: &str, ms: Option<f64>| Some((vec![("quantile", share.to_owned())], ms? * 1e-3));
    let latencies = [
        quantile("0.5", repair.p50_ms),
        quantile("0.99", repair.p99_ms),
    ];
    let help = "From the engine's question to the repair model's answer";
    page.values("repair_seconds", help, latencies.into_iter().flatten());
}

fn room(page: &mut Page, status: &v1::RoomStatus, connections: &Connections) {
    let gauges = [
        ("people", "People in the room", f64::from(status.people)),
        (
            "frames_per_second",
            "Fused frames per second",
            status.frames_per_second,
        ),
        (
            "engine_seconds",
            "Engine time per fused frame",
            status.engine_us * 1e-6,
        ),
        (
            "calibrated",
            "Whether a calibration is in force",
            f64::from(u8::from(status.calibration.is_some())),
        ),
        (
            "recording",
            "Whether a take is being recorded",
            f64::from(u8::from(status.recording.is_some())),
        ),
        (
            "troubles",
            "Things that are wrong with the room",
            status.troubles.len() as f64,
        ),
        (
            "disk_free_bytes",
            "Free bytes where takes go",
            status.disk_free_bytes as f64,
        ),
        ("connections", "Open connections", connections.open() as f64),
    ];
    for (name, help, value) in gauges {
        page.value(name, help, value);
    }
    let quantile = |share: &str, ms: f64| (vec![("quantile", share.to_owned())], ms * 1e-3);
    let latencies = [
        quantile("0.5", status.latency_p50_ms),
        quantile("0.99", status.latency_p99_ms),
    ];
    page.values(
        "latency_seconds",
        "From a frame's arrival to the subscribers",
        latencies,
    );
    let sink = |sink: &v1::SinkStatus| vec![("sink", sink.name.clone())];
    let delivered = status.sinks.iter().map(|s| (sink(s), s.delivered));
    page.totals("sink_delivered", "Messages handed to a sink", delivered);
    let dropped = status.sinks.iter().map(|s| (sink(s), s.dropped));
    page.totals("sink_dropped", "Messages a sink had no room for", dropped);
    page.total(
        "connections_refused",
        "Connections closed because there were too many",
        connections.refused(),
    );
}
