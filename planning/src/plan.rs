//! A whole plan: coverage, interference, and what to do next.

use crate::interference::interferences;
use crate::suggest::suggest;
use crate::{Area, AreaError, Coverage, Interference, Model, Severity, Suggestion, View};

/// Most sensors that are placed at once.
pub const MAX_PLACED: usize = 8;

/// What is asked.
#[derive(Clone, Debug, Default)]
pub struct Request {
    /// The sensors that count, there or planned.
    pub views: Vec<View>,
    /// The floor that matters; `None`: 4 m by 4 m about where the sensors look.
    pub area: Option<Area>,
    /// Of which model one more sensor would be; `None`: none is suggested.
    pub suggest: Option<Model>,
    /// So many sensors of that model are placed first, [`MAX_PLACED`] at most.
    pub place: usize,
}

/// What is answered.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// The floor that was looked at.
    pub area: Area,
    /// How many sensors see each place of it.
    pub coverage: Coverage,
    /// The sensors that count, with those that were placed.
    pub views: Vec<View>,
    /// Pairs that can disturb each other, the worst first.
    pub interferences: Vec<Interference>,
    /// Where one more sensor is of most use.
    pub suggestion: Option<Suggestion>,
    /// What to know and what to do, in words.
    pub notes: Vec<String>,
}

/// Looks at a room. Errors if the sensors look at no place that an area can be about.
pub fn plan(request: Request) -> Result<Plan, AreaError> {
    let Request {
        mut views,
        area,
        suggest: model,
        place,
    } = request;
    let area = match area {
        Some(area) => area,
        None => usual_area(&views)?,
    };
    let mut placed = 0;
    if let Some(model) = &model {
        while placed < place.min(MAX_PLACED) {
            let Some(found) = suggest(&views, &area, model, &unused_name(&views)) else {
                break;
            };
            views.push(found.view);
            placed += 1;
        }
    }
    let suggestion = model.and_then(|model| suggest(&views, &area, &model, &unused_name(&views)));
    let coverage = Coverage::of(&views, &area);
    let interferences = interferences(&views);
    let mut notes = notes(&views, &interferences);
    if placed < place.min(MAX_PLACED) && model.is_some() {
        notes.push(format!(
            "{placed} sensors were placed; a further one would add nothing to this area."
        ));
    } else if model.is_some() && suggestion.is_none() && !views.is_empty() {
        notes.push("One more sensor would add nothing to speak of to this area.".to_owned());
    }
    Ok(Plan {
        area,
        coverage,
        views,
        interferences,
        suggestion,
        notes,
    })
}

/// About where the sensors look on average, half way of their range.
fn usual_area(views: &[View]) -> Result<Area, AreaError> {
    let mut middle = [0.0; 2];
    for view in views {
        let [near, far] = view.range_m;
        let at = view.room_from_sensor.origin().vector() + view.forward() * ((near + far) / 2.0);
        middle = [middle[0] + at.x, middle[1] + at.y];
    }
    // To half a metre, so that it does not creep when a sensor is calibrated anew.
    let [x, y] = middle.map(|sum| (sum / views.len().max(1) as f64 * 2.0).round() / 2.0);
    Area::about(x, y)
}

fn unused_name(views: &[View]) -> String {
    let taken = |name: &String| views.iter().any(|view| view.name == *name);
    (1..=views.len() + 1)
        .map(|number| format!("plan-{number}"))
        .find(|name| !taken(name))
        .unwrap_or_default()
}

fn notes(views: &[View], interferences: &[Interference]) -> Vec<String> {
    let mut notes = Vec::new();
    if views.is_empty() {
        notes.push(
            "No sensor stands anywhere yet: calibrate the room, or plan with sensors of a model."
                .to_owned(),
        );
    }
    let assumed: Vec<_> = views.iter().filter(|view| view.assumed).collect();
    if !assumed.is_empty() {
        let names: Vec<_> = assumed.iter().map(|view| view.name.as_str()).collect();
        notes.push(format!(
            "What {} can see is not known; a view of 70 by 60 degrees and a range of 0.5 to 4.5 m are taken.",
            names.join(", ")
        ));
    }
    let strong = interferences
        .iter()
        .filter(|pair| pair.severity == Severity::Strong)
        .count();
    if strong > 0 {
        let (pairs, disturb) = match strong {
            1 => ("pair of sensors", "disturbs"),
            _ => ("pairs of sensors", "disturb"),
        };
        notes.push(format!(
            "{strong} {pairs} with structured light {disturb} each other; directions at right angles, or sensors that \
             measure light's travel time, avoid it."
        ));
    }
    notes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::MODELS;

    #[test]
    fn sensors_can_be_placed_in_an_empty_room() {
        let request = Request {
            suggest: Some(MODELS[0]),
            place: 4,
            area: Some(Area::about(0.0, 0.0).unwrap()),
            ..Request::default()
        };
        let plan = plan(request).unwrap();
        let names: Vec<_> = plan.views.iter().map(|view| view.name.as_str()).collect();
        assert_eq!(names, ["plan-1", "plan-2", "plan-3", "plan-4"]);
        assert!(plan.coverage.whole.share(2) > 0.8);
        assert!(plan.views.iter().all(|view| view.planned));
    }

    #[test]
    fn an_empty_room_says_what_to_do_and_the_area_is_where_sensors_look() {
        let empty = plan(Request::default()).unwrap();
        assert!(empty.notes[0].contains("calibrate"), "{:?}", empty.notes);
        assert_eq!(empty.coverage.whole.share(1), 0.0);
        assert_eq!(empty.area.middle(), [0.0, 0.0]);
        let placed = Request {
            suggest: Some(MODELS[0]),
            place: 4,
            area: Some(Area::about(10.0, 5.0).unwrap()),
            ..Request::default()
        };
        let views = plan(placed).unwrap().views;
        let again = plan(Request {
            views,
            ..Request::default()
        });
        let [x, y] = again.unwrap().area.middle();
        assert!((x - 10.0).abs() <= 1.0 && (y - 5.0).abs() <= 1.0, "{x} {y}");
    }

    #[test]
    fn more_than_eight_are_not_placed() {
        let request = Request {
            suggest: Some(MODELS[0]),
            place: usize::MAX,
            area: Some(Area::new([0.0, 0.0], [20.0, 20.0]).unwrap()),
            ..Request::default()
        };
        assert_eq!(plan(request).unwrap().views.len(), MAX_PLACED);
    }
}
