//! Planning the room: what its sensors see, with those that are only planned.

use std::sync::Arc;
use std::time::Duration;

use posefuse_planning::{
    Area, Coverage, Interference, Layer, MODELS, Model, Plan, Request, Suggestion, USUAL, View,
    look_at, plan,
};
use posefuse_proto::{pose_to_wire, v1};
use posefuse_skeleton::{Position, Room as RoomAxes};
use tokio::sync::Semaphore;
use tonic::Status;

use super::Room;
use super::sensors::camera;

/// Most sensors that one may plan with.
const MAX_PLANNED: usize = 32;
/// Longest names, bytes.
const MAX_TEXT: usize = 128;
/// Planned sensors stand within this of the origin, metres.
const MAX_M: f64 = 1000.0;
/// How long a request waits for its turn.
const PATIENCE: Duration = Duration::from_secs(10);

/// Answers a request; takes milliseconds, of a large room a second. One plan is made at a time, the others wait: whoever
/// edits a plan asks anew with each change and wants the last answer, not an error.
pub(super) async fn plan_room(
    room: &Room,
    request: v1::PlanRoomRequest,
) -> Result<v1::RoomPlan, Status> {
    if request.planned.len() > MAX_PLANNED {
        return Err(Status::invalid_argument(format!(
            "`planned` names {} sensors, at most {MAX_PLANNED} are taken",
            request.planned.len()
        )));
    }
    let mut views = if request.planned_only {
        Vec::new()
    } else {
        standing(room)
    };
    for sensor in &request.planned {
        let view = planned(sensor)?;
        if views.iter().any(|other| other.name == view.name) {
            return Err(Status::invalid_argument(format!(
                "two sensors of the plan are called `{}`",
                view.name
            )));
        }
        views.push(view);
    }
    let area = request
        .area
        .map(|area| Area::new([area.min_x, area.min_y], [area.max_x, area.max_y]))
        .transpose()
        .map_err(|error| Status::invalid_argument(error.to_string()))?;
    let suggest = match request.suggest_model.as_str() {
        "" => None,
        name => Some(model(name)?),
    };
    let request = Request {
        views,
        area,
        suggest,
        place: request.place as usize,
    };
    in_turn(&room.planning, PATIENCE, move || plan(request))
        .await?
        .map(|plan| to_wire(&plan))
        .map_err(|error| Status::failed_precondition(error.to_string()))
}

/// Runs `work` on a thread of its own once it has the turn, which it keeps to its end whether or not anybody still waits.
async fn in_turn<T: Send + 'static>(
    turn: &Arc<Semaphore>,
    patience: Duration,
    work: impl FnOnce() -> T + Send + 'static,
) -> Result<T, Status> {
    let turn = tokio::time::timeout(patience, turn.clone().acquire_owned())
        .await
        .map_err(|_| Status::resource_exhausted("a plan is being made; ask again"))?
        .map_err(|_| Status::unavailable("the server is stopping"))?;
    let done = tokio::task::spawn_blocking(move || {
        let done = work();
        drop(turn);
        done
    });
    done.await
        .map_err(|error| Status::internal(error.to_string()))
}

/// The sensors that the calibration knows.
fn standing(room: &Room) -> Vec<View> {
    let Some(calibration) = room.calibration.current() else {
        return Vec::new();
    };
    let sensors = room.registry.sensors();
    let mut views = Vec::new();
    for (name, pose) in &calibration.sensors {
        let known = sensors.iter().find(|sensor| sensor.name() == name);
        let (device, told) = known.map_or_else(Default::default, |sensor| {
            let greeting = sensor.greeting();
            (greeting.info.model.clone(), greeting.camera)
        });
        let camera = camera(&device, told.as_ref());
        views.push(View {
            name: name.clone(),
            room_from_sensor: pose.room_from_sensor,
            planned: false,
            view_deg: camera.view_deg,
            range_m: camera.range_m,
            light: Model::of(&device).unwrap_or(&USUAL).light,
            assumed: camera.assumed,
            model: device,
        });
    }
    views
}

fn planned(sensor: &v1::PlannedSensor) -> Result<View, Status> {
    let refused = |what: String| Status::invalid_argument(what);
    let name = &sensor.name;
    if name.is_empty() || name.len() > MAX_TEXT {
        return Err(refused(format!(
            "a planned sensor's name has 1 to {MAX_TEXT} bytes, `{name}` has {}",
            name.len()
        )));
    }
    let model = model(&sensor.model)?;
    let at = |place: &Option<v1::Vector3>, field: &str| {
        let place = place.unwrap_or_default();
        let near = [place.x, place.y, place.z].iter().all(|v| v.abs() <= MAX_M);
        near.then(|| Position::<RoomAxes>::new(place.x, place.y, place.z))
            .ok_or_else(|| {
                refused(format!(
                    "`{field}` of `{name}` is further than {MAX_M} m away: {place:?}"
                ))
            })
    };
    let (from, target) = (
        at(&sensor.position, "position")?,
        at(&sensor.looks_at, "looks_at")?,
    );
    let room_from_sensor = look_at(from, target).ok_or_else(|| {
        refused(format!(
            "`{name}` stands where it looks: `position` and `looks_at` must be two places"
        ))
    })?;
    Ok(View {
        name: name.clone(),
        model: model.name.to_owned(),
        planned: true,
        room_from_sensor,
        view_deg: model.view_deg,
        range_m: model.range_m,
        light: model.light,
        assumed: false,
    })
}

fn model(device: &str) -> Result<Model, Status> {
    Model::of(device).copied().ok_or_else(|| {
        let known = MODELS.map(|model| model.name).join(", ");
        Status::invalid_argument(format!(
            "no model called `{device}` is known; known are {known}"
        ))
    })
}

fn to_wire(plan: &Plan) -> v1::RoomPlan {
    let area = &plan.area;
    let Coverage {
        layers,
        whole,
        crossed_share,
    } = &plan.coverage;
    v1::RoomPlan {
        area: Some(v1::PlanArea {
            min_x: area.min[0],
            max_x: area.max[0],
            min_y: area.min[1],
            max_y: area.max[1],
        }),
        cell_m: area.cell_m,
        columns: area.columns as u32,
        rows: area.rows as u32,
        layers: layers.iter().map(layer).collect(),
        whole: Some(layer(whole)),
        sensors: plan.views.iter().map(sensor).collect(),
        interferences: plan
            .interferences
            .iter()
            .map(|pair| interference(pair, &plan.views))
            .collect(),
        suggestion: plan.suggestion.as_ref().map(suggestion),
        notes: plan.notes.clone(),
        models: MODELS.iter().map(|model| model.name.to_owned()).collect(),
        crossed_share: *crossed_share,
    }
}

fn layer(layer: &Layer) -> v1::PlanLayer {
    v1::PlanLayer {
        height_m: layer.height_m,
        counts: layer.counts.clone(),
        shares: [1, 2, 3].map(|sensors| layer.share(sensors)).to_vec(),
    }
}

fn sensor(view: &View) -> v1::PlanSensor {
    v1::PlanSensor {
        name: view.name.clone(),
        model: view.model.clone(),
        planned: view.planned,
        room_from_sensor: Some(pose_to_wire(&view.room_from_sensor)),
        fov_horizontal_deg: view.view_deg[0],
        fov_vertical_deg: view.view_deg[1],
        near_m: view.range_m[0],
        far_m: view.range_m[1],
        light: view.light.name().to_owned(),
        assumed: view.assumed,
    }
}

fn interference(pair: &Interference, views: &[View]) -> v1::Interference {
    let [a, b] = pair.pair.map(|index| views[index].name.clone());
    v1::Interference {
        a,
        b,
        share_of_a: pair.shares[0],
        share_of_b: pair.shares[1],
        facing: pair.facing,
        severity: pair.severity.name().to_owned(),
        advice: pair.advice.clone(),
    }
}

fn suggestion(found: &Suggestion) -> v1::Suggestion {
    let target = found.looks_at.vector();
    v1::Suggestion {
        sensor: Some(sensor(&found.view)),
        looks_at: Some(v1::Vector3 {
            x: target.x,
            y: target.y,
            z: target.z,
        }),
        one_before: found.before[0],
        one_after: found.after[0],
        two_before: found.before[1],
        two_after: found.after[1],
        words: found.words(),
        crossed_before: found.crossed[0],
        crossed_after: found.crossed[1],
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::channel;

    use tonic::Code;

    use super::*;

    #[tokio::test]
    async fn a_plan_keeps_its_turn_even_if_whoever_asked_has_gone_and_the_next_waits() {
        let turn = Arc::new(Semaphore::new(1));
        let (begun, has_begun) = channel();
        let (end, may_end) = channel::<()>();
        let first = tokio::spawn({
            let turn = turn.clone();
            async move {
                let work = move || {
                    begun.send(()).unwrap();
                    may_end.recv().unwrap();
                };
                in_turn(&turn, PATIENCE, work).await
            }
        });
        let begun = tokio::task::spawn_blocking(move || has_begun.recv());
        begun.await.unwrap().unwrap();
        first.abort();
        assert!(first.await.unwrap_err().is_cancelled());

        let soon = Duration::from_millis(20);
        let refused = in_turn(&turn, soon, || ()).await.unwrap_err();
        assert_eq!(refused.code(), Code::ResourceExhausted);
        assert!(refused.message().contains("ask again"));

        let waits = in_turn(&turn, PATIENCE, || 2);
        let (second, ()) = tokio::join!(waits, async { end.send(()).unwrap() });
        assert_eq!(second.unwrap(), 2);
    }
}
