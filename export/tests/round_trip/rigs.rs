//! BVH, GLB and FBX: the bones are where the pose has them, by readers that are not the writers.

use nalgebra::{Matrix4, Quaternion, Translation3, UnitQuaternion, Vector3};
use posefuse_export::{Axes, Format, Names, Options, Preset, USUAL_RATES_HZ};
use posefuse_skeleton::{Joint, Position, Room, Skeleton};
use serde_json::Value;

use crate::take::{
    Exported, FIRST, FRAMES, RATE_HZ, SECOND, SECOND_IS_LOST, SECOND_IS_THERE, moved, walk,
    walk_in_which,
};

/// Room coordinates of a place with Y up and Z forward, metres.
fn room(y_up: Vector3<f64>) -> Vector3<f64> {
    Vector3::new(y_up.z, y_up.x, y_up.y)
}

#[test]
fn our_own_loader_reads_a_bvh_as_it_was_sent() {
    let take = walk();
    let exported = Exported::of(&take, &Options::of_format(Format::Bvh));
    assert_eq!(exported.names(), ["walk-person3.bvh", "walk-person8.bvh"]);
    let clip = posefuse_simulator::load::load(&exported.path("walk-person3.bvh")).unwrap();
    assert_eq!(
        (clip.frames().len(), clip.rate_hz().round()),
        (FRAMES, RATE_HZ)
    );
    let (rig, sent) = moved(&take, FIRST);
    let joints: [(Joint, &str); 9] = [
        (Joint::ShoulderLeft, "LeftUpperArm"),
        (Joint::ElbowLeft, "LeftLowerArm"),
        (Joint::ElbowRight, "RightLowerArm"),
        (Joint::HipLeft, "LeftUpperLeg"),
        (Joint::KneeRight, "RightLowerLeg"),
        (Joint::AnkleLeft, "LeftFoot"),
        (Joint::AnkleRight, "RightFoot"),
        (Joint::FootLeft, "LeftToes"),
        (Joint::SpineShoulder, "Neck"),
    ];
    // The loader puts the lowest feet on the floor.
    let mut lift = None;
    for (found, sent) in clip.frames().iter().zip(sent) {
        for (joint, name) in joints {
            let bone = rig.bones.iter().position(|bone| bone.name == name).unwrap();
            let off = found[joint].unwrap().vector() - sent.as_ref().unwrap()[bone].vector();
            let lift = *lift.get_or_insert(off.z);
            assert!((off - Vector3::z() * lift).norm() < 1e-3, "{joint}: {off}");
        }
    }
    assert!(lift.unwrap().abs() < 0.05, "{lift:?}");
}

#[test]
fn who_shows_no_trunk_in_a_span_has_no_rig_there_and_everybody_else_has() {
    // From 4 s on only the second person's head is seen.
    let only_head = |id, frame, skeleton: Skeleton<Room>| match id == SECOND && frame >= 120 {
        true => skeleton.filter_map(|joint, state| (joint == Joint::Head).then_some(*state)),
        false => skeleton,
    };
    let take = walk_in_which(only_head);
    let spans: [(f64, f64, &[&str]); 2] = [
        (5.0, 7.0, &["walk-person3.bvh"]),
        (3.0, 7.0, &["walk-person3.bvh", "walk-person8.bvh"]),
    ];
    for (from_s, to_s, names) in spans {
        let options = Options {
            from_s: Some(from_s),
            to_s: Some(to_s),
            ..Options::of_format(Format::Bvh)
        };
        let exported = Exported::of(&take, &options);
        assert_eq!(exported.names(), names);
        let without: Vec<String> = exported
            .report
            .without_rig
            .iter()
            .map(|who| who.to_string())
            .collect();
        assert_eq!(without.len(), 2 - names.len(), "{without:?}");
    }
}

#[test]
fn a_table_of_bones_has_them_where_the_pose_has_them() {
    let take = walk();
    let options = Options {
        axes: Some(Axes::Unity),
        names: Some(Names::Humanoid),
        ..Options::of_format(Format::CsvBones)
    };
    let exported = Exported::of(&take, &options);
    assert_eq!(exported.names(), ["walk.bones.csv"]);
    let (rig, sent) = moved(&take, FIRST);
    let text = exported.text("walk.bones.csv");
    let rows: Vec<Vec<&str>> = text
        .lines()
        .skip(1)
        .map(|line| line.split(',').collect())
        .filter(|row: &Vec<&str>| row[4] == "person3")
        .collect();
    assert_eq!(rows.len(), FRAMES * rig.bones.len());
    let number = |cell: &str| cell.parse::<f64>().unwrap();
    let vector = |row: &[&str], from: usize| Vector3::from_fn(|axis, _| number(row[from + axis]));
    for (frame, rows) in rows.chunks(rig.bones.len()).enumerate() {
        let sent = sent[frame].as_ref().unwrap();
        for (bone, (row, at)) in rig.bones.iter().zip(rows.iter().zip(sent)) {
            assert_eq!((row[0], row[5]), (&*frame.to_string(), &*bone.name));
            let unity = Axes::Unity.from_room();
            assert!((unity * at.vector() - vector(row, 7)).norm() < 2e-6);
            // What a bone carries is where its parent's turn puts it.
            if let Some(parent) = bone.parent {
                let turn = vector(rows[parent].as_slice(), 10);
                let turn = Quaternion::from_parts(number(rows[parent][13]), turn);
                let along = UnitQuaternion::new_normalize(turn) * (unity * bone.offset);
                let reached = vector(rows[parent].as_slice(), 7) + along;
                assert!((reached - vector(row, 7)).norm() < 5e-6, "{}", bone.name);
            }
        }
    }
}

#[test]
fn a_bvh_in_line_with_the_others_holds_its_poses_where_nobody_is_seen() {
    let take = walk();
    let options = Options {
        whole: true,
        ..Options::of_format(Format::Bvh)
    };
    let exported = Exported::of(&take, &options);
    let text = exported.text("walk-person8.bvh");
    let lines: Vec<&str> = text
        .lines()
        .skip_while(|line| !line.starts_with("Frame Time"))
        .collect();
    let frames = &lines[1..];
    assert_eq!(frames.len(), FRAMES);
    let begin = *SECOND_IS_THERE.start();
    assert!(frames[..begin].iter().all(|line| *line == frames[begin]));
    let lost = &frames[SECOND_IS_LOST];
    assert!(
        lost.iter()
            .all(|line| *line == frames[SECOND_IS_LOST.start - 1])
    );
    assert!(
        frames[*SECOND_IS_THERE.end() + 1..]
            .iter()
            .all(|line| *line == frames[FRAMES - 1])
    );
    assert_ne!(frames[begin], frames[FRAMES - 1]);
}

/// Worst distance between bones as found and as sent, metres.
fn worst(found: &[Vector3<f64>], sent: &[Position<Room>]) -> f64 {
    let off =
        |(found, sent): (&Vector3<f64>, &Position<Room>)| (room(*found) - sent.vector()).norm();
    assert_eq!(found.len(), sent.len());
    found.iter().zip(sent).map(off).fold(0.0, f64::max)
}

#[test]
fn ufbx_finds_every_bone_of_an_fbx_where_it_was_sent() {
    let take = walk();
    let exported = Exported::of(&take, &Options::of_preset(Preset::Unreal));
    assert_eq!(exported.names(), ["walk-person3.fbx", "walk-person8.fbx"]);
    for person in [FIRST, SECOND] {
        let (rig, sent) = moved(&take, person);
        let first = if person == FIRST {
            0
        } else {
            *SECOND_IS_THERE.start()
        };
        let bytes = std::fs::read(exported.path(&format!("walk-person{person}.fbx"))).unwrap();
        let options = ufbx::LoadOpts {
            target_axes: ufbx::CoordinateAxes::right_handed_y_up(),
            target_unit_meters: 1.0,
            ..Default::default()
        };
        let scene = ufbx::load_memory(&bytes, options).unwrap();
        assert_eq!(scene.settings.unit_meters, 0.01);
        assert_eq!((scene.skin_deformers.len(), scene.meshes.len()), (1, 1));
        assert!((scene.settings.frames_per_second - RATE_HZ).abs() < 1e-9);
        let names = rig
            .bones
            .iter()
            .map(|bone| Names::Unreal.of_bone(&bone.name));
        let names: Vec<String> = names.collect();
        let at = |frame: f64| {
            let seconds = (frame - first as f64) / RATE_HZ;
            let now =
                ufbx::evaluate_scene(&scene, &scene.anim, seconds, Default::default()).unwrap();
            let found = names.iter().map(|name| {
                let place = &now.find_node(name).unwrap().node_to_world;
                Vector3::new(place.m03, place.m13, place.m23)
            });
            found.collect::<Vec<_>>()
        };
        for frame in (first..FRAMES - 1).step_by(7) {
            let (Some(here), Some(next)) = (&sent[frame], &sent[frame + 1]) else {
                continue;
            };
            let off = worst(&at(frame as f64), here);
            assert!(off < 1e-3, "person {person} frame {frame}: {off} m");
            // Between frames the cubics go on: no spin where angles pass 180 degrees. Three angles do not take the
            // shortest way, so a fast turn is off by more than a slow one.
            let middle = here
                .iter()
                .zip(next)
                .map(|(here, next)| here.lerp(*next, 0.5));
            let off = worst(&at(frame as f64 + 0.5), &middle.collect::<Vec<_>>());
            assert!(off < 3e-2, "person {person} after frame {frame}: {off} m");
        }
    }
}

#[test]
fn ufbx_finds_the_rate_of_an_fbx_whatever_it_is() {
    let take = walk();
    for rate in USUAL_RATES_HZ.into_iter().chain([37.5, 1000.0 / 33.0]) {
        let options = Options {
            people: vec![FIRST],
            to_s: Some(0.5),
            rate_hz: Some(rate),
            ..Options::of_format(Format::Fbx)
        };
        let exported = Exported::of(&take, &options);
        let bytes = std::fs::read(exported.path("walk-person3.fbx")).unwrap();
        let scene = ufbx::load_memory(&bytes, ufbx::LoadOpts::default()).unwrap();
        let found = scene.settings.frames_per_second;
        assert!((found - rate).abs() < 1e-9, "{rate}: {found}");
        let frames = exported.report.files[0].frames as f64;
        let end = scene.anim.time_end * rate;
        assert!((end - (frames - 1.0)).abs() < 1e-3, "{rate}: {end}");
    }
}

/// A GLB, read by the rules of its standard.
struct Glb {
    json: Value,
    bin: Vec<u8>,
}

impl Glb {
    fn read(path: &std::path::Path) -> Self {
        let bytes = std::fs::read(path).unwrap();
        let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
        assert_eq!(
            (&bytes[..4], word(4), word(8)),
            (&b"glTF"[..], 2, bytes.len())
        );
        let text = word(12);
        let json = serde_json::from_slice(&bytes[20..20 + text]).unwrap();
        assert_eq!(word(20 + text), bytes.len() - 28 - text);
        Self {
            json,
            bin: bytes[28 + text..].to_vec(),
        }
    }

    /// The rows of an accessor of floats.
    fn floats(&self, accessor: &Value) -> Vec<Vec<f64>> {
        let accessor = &self.json["accessors"][accessor.as_u64().unwrap() as usize];
        let view = &self.json["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
        let width = match accessor["type"].as_str().unwrap() {
            "SCALAR" => 1,
            "VEC3" => 3,
            "VEC4" => 4,
            other => panic!("{other}"),
        };
        let begin = view["byteOffset"].as_u64().unwrap() as usize;
        let length = 4 * width * accessor["count"].as_u64().unwrap() as usize;
        let numbers = self.bin[begin..begin + length].chunks(4);
        let numbers: Vec<f64> = numbers
            .map(|b| f64::from(f32::from_le_bytes(b.try_into().unwrap())))
            .collect();
        numbers.chunks(width).map(<[f64]>::to_vec).collect()
    }

    /// The places of all nodes at `seconds`, and the scales of those that have one.
    fn at(&self, seconds: f64) -> Vec<Matrix4<f64>> {
        let nodes = self.json["nodes"].as_array().unwrap();
        let mut local: Vec<(Vector3<f64>, UnitQuaternion<f64>, f64)> = nodes
            .iter()
            .map(|node| {
                let at = |axis: usize| node["translation"][axis].as_f64().unwrap_or(0.0);
                (
                    Vector3::new(at(0), at(1), at(2)),
                    UnitQuaternion::identity(),
                    1.0,
                )
            })
            .collect();
        let animation = &self.json["animations"][0];
        for channel in animation["channels"].as_array().unwrap() {
            let sampler = &animation["samplers"][channel["sampler"].as_u64().unwrap() as usize];
            let times = self.floats(&sampler["input"]);
            let key = times
                .iter()
                .rposition(|time| time[0] <= seconds + 1e-4)
                .unwrap_or(0);
            let value = &self.floats(&sampler["output"])[key];
            let node = &mut local[channel["target"]["node"].as_u64().unwrap() as usize];
            match channel["target"]["path"].as_str().unwrap() {
                "translation" => node.0 = Vector3::new(value[0], value[1], value[2]),
                "rotation" => {
                    let turn = Quaternion::new(value[3], value[0], value[1], value[2]);
                    assert!((turn.norm() - 1.0).abs() < 1e-5);
                    node.1 = UnitQuaternion::from_quaternion(turn);
                }
                "scale" => node.2 = value[0],
                other => panic!("{other}"),
            }
        }
        let local: Vec<Matrix4<f64>> = local
            .into_iter()
            .map(|(at, turn, scale)| {
                Translation3::from(at).to_homogeneous()
                    * turn.to_homogeneous()
                    * Matrix4::new_scaling(scale)
            })
            .collect();
        let mut world = local.clone();
        for (index, node) in nodes.iter().enumerate() {
            for child in node["children"].as_array().into_iter().flatten() {
                let child = child.as_u64().unwrap() as usize;
                assert!(child > index, "nodes are told before what they carry");
                world[child] = world[index] * local[child];
            }
        }
        world
    }
}

#[test]
fn a_glb_moves_both_people_in_one_animation_and_hides_who_is_not_there() {
    let take = walk();
    let exported = Exported::of(&take, &Options::of_preset(Preset::Blender));
    assert_eq!(exported.names(), ["walk.glb"]);
    let glb = Glb::read(&exported.path("walk.glb"));
    assert_eq!(glb.json["animations"].as_array().unwrap().len(), 1);
    assert_eq!(
        glb.json["asset"]["extras"]["startUtc"],
        exported.report.files[0].from_utc
    );
    assert_eq!(glb.json["asset"]["extras"]["startTimecode"], "14:15:00:00");
    for (index, person) in [FIRST, SECOND].into_iter().enumerate() {
        let (_, sent) = moved(&take, person);
        let joints = glb.json["skins"][index]["joints"].as_array().unwrap();
        let joints: Vec<usize> = joints
            .iter()
            .map(|joint| joint.as_u64().unwrap() as usize)
            .collect();
        for (frame, sent) in sent.iter().enumerate().step_by(29) {
            let world = glb.at(frame as f64 / RATE_HZ);
            let found: Vec<Vector3<f64>> = joints
                .iter()
                .map(|&joint| world[joint].fixed_view::<3, 1>(0, 3).into())
                .collect();
            match sent {
                Some(sent) => {
                    let off = worst(&found, sent);
                    assert!(off < 1e-3, "person {person} frame {frame}: {off} m");
                }
                None => assert!(found.iter().all(|at| at.norm() < 1e-9), "shrunk to nothing"),
            }
        }
    }
}
