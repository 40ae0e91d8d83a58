//! Replaying a take: its frames and observations in the order they were recorded, paced by their own time.

use std::sync::Arc;

use posefuse_fusion::Input;
use posefuse_proto::{
    calibration_to_wire, observation_to_wire, room_frame_to_wire, sensor_info_to_wire, v1,
};
use posefuse_session::{Recorded, TakeError, TakeReader, Topic};
use posefuse_skeleton::{TimecodeZone, Timestamp};
use tokio::sync::mpsc;
use tonic::Status;

use super::Room;
use super::catalogue::{refused, take_to_wire};
use super::service::{Answers, answers};
use super::timecode::stamp;
use v1::replay_event::Event;

/// Messages read ahead of the client.
const AHEAD: usize = 64;

/// What one message of a take becomes.
type Step = Result<(Timestamp, Event), TakeError>;

/// What civil time and timecode a take's frames have.
#[derive(Clone, Copy)]
struct Civil {
    unix_offset_ns: i64,
    timecode: Option<TimecodeZone>,
}

/// Opens a take and streams it.
pub(super) async fn replay(
    room: Arc<Room>,
    request: v1::ReplayTakeRequest,
) -> Result<Answers<v1::ReplayEvent>, Status> {
    let speed = request.speed;
    if !speed.is_finite() || !(0.0..=1000.0).contains(&speed) {
        return Err(Status::invalid_argument(format!(
            "`speed` must be a number from 0 (as fast as you read) to 1000, found {speed}"
        )));
    }
    let name = request.name;
    let (take, start) = room
        .with_storage(move |storage| {
            let take = TakeReader::open(&**storage, &name)?;
            let start = start(&take)?;
            Ok((take, start))
        })
        .await?;
    let zero = take.header().start.unwrap_or(Timestamp::ZERO);
    let civil = Civil {
        unix_offset_ns: take.header().unix_offset_ns,
        timecode: take.header().timecode,
    };
    let from = zero.plus_ns(request.start_ns.max(0));
    let (steps, read) = mpsc::channel(AHEAD);
    let (answer, queue) = mpsc::channel(1);
    let reader = room.clone();
    room.tasks
        .spawn(async move { read_ahead(&reader, take, civil, from, steps).await });
    let pacer = room.clone();
    room.tasks.spawn(async move {
        let first = v1::ReplayEvent {
            offset_ns: from.since_ns(zero),
            event: Some(Event::Start(start)),
        };
        if answer.send(Ok(first)).await.is_ok() {
            pace(&pacer, read, answer, zero, from, speed).await;
        }
    });
    Ok(answers(queue))
}

/// What the take is, with the sensors it began with.
fn start(take: &TakeReader) -> Result<v1::ReplayStart, TakeError> {
    let (_, preamble) = take.beginning()?;
    let sensor = |input: &Input| match input {
        Input::Sensor(info) => Some(sensor_info_to_wire(info)),
        _ => None,
    };
    Ok(v1::ReplayStart {
        take: Some(take_to_wire(take.info())),
        sensors: preamble.iter().filter_map(sensor).collect(),
        calibration: take.header().calibration.as_ref().map(calibration_to_wire),
    })
}

/// Reads chunk by chunk, away from the connections, as far ahead as the queue allows.
async fn read_ahead(
    room: &Room,
    take: TakeReader,
    civil: Civil,
    from: Timestamp,
    steps: mpsc::Sender<Step>,
) {
    let mut entries = take.entries(&[Topic::Frames, Topic::Inputs], Some(from));
    loop {
        let read = room.threads.blocking(move || {
            let batch: Vec<_> = entries
                .by_ref()
                .take(AHEAD)
                .map(|entry| entry?.decode())
                .collect();
            (batch, entries)
        });
        let Ok((batch, rest)) = read.await else {
            return;
        };
        entries = rest;
        if batch.is_empty() {
            return;
        }
        for message in batch {
            let step = match message {
                Ok(message) => match step(message, civil) {
                    Some(step) => Ok(step),
                    None => continue,
                },
                Err(error) => Err(error),
            };
            let is_end = step.is_err();
            if steps.send(step).await.is_err() || is_end {
                return;
            }
        }
    }
}

fn step(message: Recorded, civil: Civil) -> Option<(Timestamp, Event)> {
    match message {
        Recorded::Frame(frame) => {
            let mut wire = room_frame_to_wire(&frame);
            let unix_ns = frame.time.ns().saturating_add(civil.unix_offset_ns);
            stamp(&mut wire, unix_ns, civil.timecode);
            Some((frame.time, Event::Frame(wire)))
        }
        Recorded::Input(Input::Observation(seen)) => Some((
            seen.received,
            Event::Observation(observation_to_wire(&seen)),
        )),
        _ => None,
    }
}

/// Hands each message on when its time has come.
async fn pace(
    room: &Room,
    mut read: mpsc::Receiver<Step>,
    answer: mpsc::Sender<Result<v1::ReplayEvent, Status>>,
    zero: Timestamp,
    from: Timestamp,
    speed: f64,
) {
    let began = room.clock.now();
    loop {
        let step = tokio::select! {
            step = read.recv() => step,
            () = answer.closed() => return,
            () = room.stop.cancelled() => {
                let _ = answer.send(Err(Status::unavailable("the server is stopping"))).await;
                return;
            }
        };
        let (time, event) = match step {
            None => return,
            Some(Ok(step)) => step,
            Some(Err(error)) => {
                let _ = answer.send(Err(refused(error))).await;
                return;
            }
        };
        if speed > 0.0 {
            let due = began.plus_ns((time.since_ns(from) as f64 / speed) as i64);
            tokio::select! {
                () = room.clock.sleep_until(due) => {}
                () = answer.closed() => return,
                () = room.stop.cancelled() => return,
            }
        }
        let event = v1::ReplayEvent {
            offset_ns: time.since_ns(zero),
            event: Some(event),
        };
        if answer.send(Ok(event)).await.is_err() {
            return;
        }
    }
}
