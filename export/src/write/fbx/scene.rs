//! The objects of a scene: bones, a figure bound to them, and their motion.

use std::io;

use nalgebra::Vector3;
use posefuse_kinematics::Rig;

use super::Turn;
use super::curve::{curve, tick};
use super::document::{Attribute::*, Document};
use crate::write::Sheet;
use crate::write::figure::Mesh;
use crate::write::tree::{Tree, rest_origins};

/// The ids of what the parts refer to.
struct Ids {
    bones: Vec<i64>,
    mesh: i64,
}

pub(super) fn write(
    document: &mut Document,
    sheet: &Sheet,
    places: &[Vec<f32>; 3],
    turns: &[Turn],
) -> io::Result<()> {
    let rig = sheet.rig(0)?;
    definitions(document, rig, turns)?;
    document.open("Objects", &[])?;
    let ids = Ids {
        bones: rig.bones.iter().map(|_| document.id()).collect(),
        mesh: document.id(),
    };
    bones(document, sheet, rig, &ids)?;
    figure(document, sheet, rig, &ids)?;
    motion(document, sheet, &ids, places, turns)?;
    document.close()
}

/// How many objects of each kind there are.
fn definitions(document: &mut Document, rig: &Rig, turns: &[Turn]) -> io::Result<()> {
    let bones = rig.bones.len() as i32;
    let channels = turns.len() as i32 + 1;
    let kinds = [
        ("GlobalSettings", 1),
        ("NodeAttribute", bones),
        ("Model", bones + 1),
        ("Geometry", 1),
        ("Deformer", bones + 1),
        ("Pose", 1),
        ("AnimationStack", 1),
        ("AnimationLayer", 1),
        ("AnimationCurveNode", channels),
        ("AnimationCurve", 3 * channels),
    ];
    document.node("Definitions", &[], |document| {
        document.leaf("Version", &[Int(100)])?;
        document.leaf("Count", &[Int(kinds.iter().map(|(_, count)| count).sum())])?;
        for (kind, count) in kinds {
            document.node("ObjectType", &[Text(kind)], |document| {
                document.leaf("Count", &[Int(count)])
            })?;
        }
        Ok(())
    })
}

fn bones(document: &mut Document, sheet: &Sheet, rig: &Rig, ids: &Ids) -> io::Result<()> {
    for (bone, &id) in rig.bones.iter().zip(&ids.bones) {
        let name = sheet.names.of_bone(&bone.name);
        let limb = document.id();
        document.object(
            "NodeAttribute",
            (limb, &name, "NodeAttribute", "LimbNode"),
            |document| document.leaf("TypeFlags", &[Text("Skeleton")]),
        )?;
        let at = sheet.space.vector(bone.offset);
        document.object("Model", (id, &name, "Model", "LimbNode"), |document| {
            model(document, at)
        })?;
        document.connect(limb, id, None);
        document.connect(id, bone.parent.map_or(0, |parent| ids.bones[parent]), None);
    }
    Ok(())
}

/// The inside of a model at this place against what carries it, not turned.
fn model(document: &mut Document, at: Vector3<f64>) -> io::Result<()> {
    document.leaf("Version", &[Int(232)])?;
    document.properties(|document| {
        // Scale does not come in between.
        document.property(["InheritType", "enum", "", ""], &[Int(1)])?;
        let at = [Double(at.x), Double(at.y), Double(at.z)];
        document.property(["Lcl Translation", "Lcl Translation", "", "A"], &at)?;
        document.property(["Lcl Rotation", "Lcl Rotation", "", "A"], &[Double(0.0); 3])?;
        document.property(["Lcl Scaling", "Lcl Scaling", "", "A"], &[Double(1.0); 3])
    })?;
    document.leaf("Culling", &[Text("CullingOff")])
}

/// A matrix that only moves, columns in turn.
fn moved(by: Vector3<f64>) -> [f64; 16] {
    let mut matrix = [0.0; 16];
    for diagonal in [0, 5, 10, 15] {
        matrix[diagonal] = 1.0;
    }
    matrix[12..15].copy_from_slice(by.as_slice());
    matrix
}

/// The figure, its skin, and the pose in which the two belong together.
fn figure(document: &mut Document, sheet: &Sheet, rig: &Rig, ids: &Ids) -> io::Result<()> {
    let who = sheet
        .who()
        .map(|who| format!("{who}-figure"))
        .collect::<String>();
    let mesh = Mesh::of(rig, &Tree::of(rig));
    let (geometry, skin, pose) = (document.id(), document.id(), document.id());
    shape(document, sheet, &mesh, (geometry, &who))?;
    document.object("Model", (ids.mesh, &who, "Model", "Mesh"), |document| {
        model(document, Vector3::zeros())
    })?;
    document.connect(ids.mesh, 0, None);
    document.connect(geometry, ids.mesh, None);
    document.object("Deformer", (skin, &who, "Deformer", "Skin"), |document| {
        document.leaf("Version", &[Int(101)])?;
        document.leaf("Link_DeformAcuracy", &[Double(50.0)])
    })?;
    document.connect(skin, geometry, None);
    let origins: Vec<Vector3<f64>> = rest_origins(rig)
        .iter()
        .map(|origin| sheet.space.vector(*origin))
        .collect();
    for (bone, origin) in origins.iter().enumerate() {
        let of_bone = (0..mesh.bones.len()).filter(|vertex| mesh.bones[*vertex] == bone);
        let vertices: Vec<i32> = of_bone.map(|vertex| vertex as i32).collect();
        let cluster = document.id();
        let name = sheet.names.of_bone(&rig.bones[bone].name);
        document.object(
            "Deformer",
            (cluster, &name, "SubDeformer", "Cluster"),
            |document| {
                document.leaf("Version", &[Int(100)])?;
                document.leaf("UserData", &[Text(""), Text("")])?;
                if !vertices.is_empty() {
                    document.ints("Indexes", &vertices)?;
                    document.doubles("Weights", &vec![1.0; vertices.len()])?;
                }
                document.doubles("Transform", &moved(-origin))?;
                document.doubles("TransformLink", &moved(*origin))
            },
        )?;
        document.connect(cluster, skin, None);
        document.connect(ids.bones[bone], cluster, None);
    }
    document.object("Pose", (pose, &who, "Pose", "BindPose"), |document| {
        document.leaf("Type", &[Text("BindPose")])?;
        document.leaf("Version", &[Int(100)])?;
        document.leaf("NbPoseNodes", &[Int(origins.len() as i32 + 1)])?;
        let bones = ids.bones.iter().copied().zip(origins);
        for (node, origin) in bones.chain([(ids.mesh, Vector3::zeros())]) {
            document.node("PoseNode", &[], |document| {
                document.leaf("Node", &[Long(node)])?;
                document.doubles("Matrix", &moved(origin))
            })?;
        }
        Ok(())
    })
}

/// Vertices, triangles and normals.
fn shape(
    document: &mut Document,
    sheet: &Sheet,
    mesh: &Mesh,
    (id, name): (i64, &str),
) -> io::Result<()> {
    let places = mesh
        .places
        .iter()
        .flat_map(|place| <[f64; 3]>::from(sheet.space.vector(*place)));
    let places: Vec<f64> = places.collect();
    let turned = sheet.space.axes.from_room();
    let normals = mesh
        .normals
        .iter()
        .flat_map(|normal| <[f64; 3]>::from(turned * normal));
    let normals: Vec<f64> = normals.collect();
    // The last corner of a polygon is told by its complement.
    let corner = |vertex: i32| if vertex % 3 == 2 { !vertex } else { vertex };
    let corners: Vec<i32> = (0..mesh.places.len() as i32).map(corner).collect();
    document.object("Geometry", (id, name, "Geometry", "Mesh"), |document| {
        document.leaf("GeometryVersion", &[Int(124)])?;
        document.doubles("Vertices", &places)?;
        document.ints("PolygonVertexIndex", &corners)?;
        document.node("LayerElementNormal", &[Int(0)], |document| {
            document.leaf("Version", &[Int(101)])?;
            document.leaf("Name", &[Text("")])?;
            document.leaf("MappingInformationType", &[Text("ByPolygonVertex")])?;
            document.leaf("ReferenceInformationType", &[Text("Direct")])?;
            document.doubles("Normals", &normals)
        })?;
        document.node("Layer", &[Int(0)], |document| {
            document.leaf("Version", &[Int(100)])?;
            document.node("LayerElement", &[], |document| {
                document.leaf("Type", &[Text("LayerElementNormal")])?;
                document.leaf("TypedIndex", &[Int(0)])
            })
        })
    })
}

fn motion(
    document: &mut Document,
    sheet: &Sheet,
    ids: &Ids,
    places: &[Vec<f32>; 3],
    turns: &[Turn],
) -> io::Result<()> {
    let rate = sheet.plan.grid.rate_hz;
    let stop = tick(sheet.frames() - 1, rate);
    let (stack, layer) = (document.id(), document.id());
    let name = &sheet.plan.header.name;
    document.object(
        "AnimationStack",
        (stack, name, "AnimStack", ""),
        |document| {
            document.properties(|document| {
                for (name, time) in [
                    ("LocalStart", 0),
                    ("LocalStop", stop),
                    ("ReferenceStart", 0),
                    ("ReferenceStop", stop),
                ] {
                    document.property([name, "KTime", "Time", ""], &[Long(time)])?;
                }
                Ok(())
            })
        },
    )?;
    document.object(
        "AnimationLayer",
        (layer, "BaseLayer", "AnimLayer", ""),
        |_| Ok(()),
    )?;
    document.connect(layer, stack, None);
    channel(
        document,
        (layer, ids.bones[0]),
        ("T", "Lcl Translation"),
        places,
        rate,
    )?;
    for turn in turns {
        let bone = ids.bones[turn.bone];
        channel(
            document,
            (layer, bone),
            ("R", "Lcl Rotation"),
            &turn.keys,
            rate,
        )?;
    }
    Ok(())
}

/// Three curves that move a property of a bone.
fn channel(
    document: &mut Document,
    (layer, bone): (i64, i64),
    (name, property): (&str, &'static str),
    keys: &[Vec<f32>; 3],
    rate_hz: f64,
) -> io::Result<()> {
    let node = document.id();
    const AXES: [&str; 3] = ["d|X", "d|Y", "d|Z"];
    document.object(
        "AnimationCurveNode",
        (node, name, "AnimCurveNode", ""),
        |document| {
            document.properties(|document| {
                for (axis, keys) in AXES.into_iter().zip(keys) {
                    document.property([axis, "Number", "", "A"], &[Double(f64::from(keys[0]))])?;
                }
                Ok(())
            })
        },
    )?;
    document.connect(node, layer, None);
    document.connect(node, bone, Some(property));
    for (axis, keys) in AXES.into_iter().zip(keys) {
        let id = curve(document, rate_hz, keys)?;
        document.connect(id, node, Some(axis));
    }
    Ok(())
}
