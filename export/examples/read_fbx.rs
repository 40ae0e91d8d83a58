//! Reads exported FBX files with ufbx and says where their bones are, for `tests/readers`.
//!
//! `read_fbx EXPECTED.json OUT.json`: the description that `tests/readers/make.py` wrote, and where the readings go.

use std::collections::BTreeMap;
use std::error::Error;

use serde_json::{Value, json};

/// The presets whose files are FBX.
const EXPORTS: [&str; 4] = ["motionbuilder", "mixamo", "unity", "unreal"];

/// For each bone of the rig its places, metres, Y up, one a frame.
type Places = BTreeMap<String, Vec<[f64; 3]>>;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let (Some(expected), Some(out)) = (arguments.next(), arguments.next()) else {
        return Err("usage: read_fbx EXPECTED.json OUT.json".into());
    };
    let expected: Value = serde_json::from_str(&std::fs::read_to_string(expected)?)?;
    let readings: Result<Vec<Value>, Box<dyn Error>> = EXPORTS
        .iter()
        .map(|export| reading(&expected, export))
        .collect();
    std::fs::write(out, serde_json::to_string(&readings?)?)?;
    Ok(())
}

/// All people of an export.
fn reading(expected: &Value, export: &str) -> Result<Value, Box<dyn Error>> {
    let mut people = BTreeMap::new();
    for file in list(&expected["files"][export])? {
        let (path, who) = (text(&file["path"])?, text(&file["people"][0])?);
        people.insert(who.to_owned(), places(expected, export, path)?);
    }
    let what = format!("FBX ({export}) by ufbx");
    Ok(
        json!({"what": what, "kind": "bones", "people": people, "axes": "y-up", "metres": 1.0, "frames": null, "sent": null}),
    )
}

/// Where the bones of a file's person are at the frames that are looked at.
fn places(expected: &Value, export: &str, path: &str) -> Result<Places, Box<dyn Error>> {
    let options = ufbx::LoadOpts {
        target_axes: ufbx::CoordinateAxes::right_handed_y_up(),
        target_unit_meters: 1.0,
        ..Default::default()
    };
    let scene = ufbx::load_memory(&std::fs::read(path)?, options)
        .map_err(|error| format!("{path}: {error:?}"))?;
    let rate_hz = expected["rate_hz"].as_f64().ok_or("no rate")?;
    let (called, bones) = (
        list(&expected["bone_names"][export])?,
        list(&expected["names"]["bones"])?,
    );
    let mut found = Places::new();
    for frame in list(&expected["sampled"])? {
        let seconds = frame.as_f64().ok_or("a frame is no number")? / rate_hz;
        let now = ufbx::evaluate_scene(&scene, &scene.anim, seconds, Default::default())
            .map_err(|error| format!("{path}: {error:?}"))?;
        for (called, bone) in called.iter().zip(bones) {
            let node = now.find_node(text(called)?);
            let place = &node
                .ok_or_else(|| format!("{path} has no node {called}"))?
                .node_to_world;
            let places = found.entry(text(bone)?.to_owned()).or_default();
            places.push([place.m03, place.m13, place.m23]);
        }
    }
    Ok(found)
}

fn list(value: &Value) -> Result<&Vec<Value>, Box<dyn Error>> {
    value
        .as_array()
        .ok_or_else(|| format!("expected a list, found {value}").into())
}

fn text(value: &Value) -> Result<&str, Box<dyn Error>> {
    value
        .as_str()
        .ok_or_else(|| format!("expected a text, found {value}").into())
}
