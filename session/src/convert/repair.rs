//! What a model beside the engine answered, to and from a take, bit for bit.

use nalgebra::{Quaternion, UnitQuaternion, Vector3, Vector4};
use posefuse_fusion::{Fill, Needs, RepairAnswer, RepairModel};
use posefuse_proto::v1;
use posefuse_skeleton::{Joint, JointMap, Timestamp};

use crate::error::ContentError;

/// How far from 1 a rotation's norm may be.
const NORM_TOLERANCE: f64 = 1e-6;

pub(super) fn model_to_wire(model: Option<&RepairModel>) -> v1::RepairModel {
    model.map_or_else(v1::RepairModel::default, |model| v1::RepairModel {
        name: model.name.clone(),
        before: u32::try_from(model.needs.before).unwrap_or(u32::MAX),
        after: u32::try_from(model.needs.after).unwrap_or(u32::MAX),
        rate_hz: model.needs.rate_hz,
    })
}

pub(super) fn model_from_wire(wire: v1::RepairModel) -> Option<RepairModel> {
    (!wire.name.is_empty()).then_some(RepairModel {
        name: wire.name,
        needs: Needs {
            before: wire.before as usize,
            after: wire.after as usize,
            rate_hz: wire.rate_hz,
        },
    })
}

pub(super) fn answer_to_wire(answer: &RepairAnswer) -> v1::RepairAnswer {
    v1::RepairAnswer {
        number: answer.number,
        received_ns: answer.received.ns(),
        fills: answer.fills.iter().map(fill_to_wire).collect(),
    }
}

pub(super) fn answer_from_wire(wire: &v1::RepairAnswer) -> Result<RepairAnswer, ContentError> {
    Ok(RepairAnswer {
        number: wire.number,
        received: Timestamp::from_ns(wire.received_ns),
        fills: wire
            .fills
            .iter()
            .map(fill_from_wire)
            .collect::<Result<_, _>>()?,
    })
}

fn fill_to_wire(fills: &JointMap<Fill>) -> v1::RepairFill {
    let rotations = || {
        fills
            .iter()
            .filter_map(|(joint, f)| Some((joint, f.rotation?)))
    };
    v1::RepairFill {
        joints: fills.iter().map(|(joint, _)| joint as u8).collect(),
        positions: fills
            .iter()
            .flat_map(|(_, fill)| fill.position.data.0[0])
            .collect(),
        sigmas: fills.iter().map(|(_, fill)| fill.sigma_m).collect(),
        rotated: rotations().map(|(joint, _)| joint as u8).collect(),
        rotations: rotations()
            .flat_map(|(_, turned)| turned.coords.data.0[0])
            .collect(),
    }
}

fn fill_from_wire(wire: &v1::RepairFill) -> Result<JointMap<Fill>, ContentError> {
    let v1::RepairFill {
        joints,
        positions,
        sigmas,
        rotated,
        rotations,
    } = wire;
    let fits = positions.len() == 3 * joints.len()
        && sigmas.len() == joints.len()
        && rotations.len() == 4 * rotated.len();
    if !fits {
        return Err(ContentError::Value(format!(
            "a repaired pose: 3 numbers and 1 sigma for each of {} joints and 4 for each of {} rotations are needed, \
             found {}, {} and {}",
            joints.len(),
            rotated.len(),
            positions.len(),
            sigmas.len(),
            rotations.len()
        )));
    }
    let mut fills = JointMap::empty();
    for ((number, at), sigma_m) in joints.iter().zip(positions.chunks_exact(3)).zip(sigmas) {
        fills[joint(*number)?] = Some(Fill {
            position: Vector3::from_column_slice(at),
            sigma_m: *sigma_m,
            rotation: None,
        });
    }
    for (number, turned) in rotated.iter().zip(rotations.chunks_exact(4)) {
        let turned = Quaternion::from_vector(Vector4::from_column_slice(turned));
        let norm = turned.norm();
        let fill = fills[joint(*number)?].as_mut();
        match fill {
            Some(fill) if (norm - 1.0).abs() <= NORM_TOLERANCE => {
                fill.rotation = Some(UnitQuaternion::new_unchecked(turned));
            }
            Some(_) => {
                let problem =
                    format!("a repaired joint's rotation: norm 1 is needed, found {norm}");
                return Err(ContentError::Value(problem));
            }
            None => {
                let problem = format!("joint {number} is turned and has no place");
                return Err(ContentError::Value(problem));
            }
        }
    }
    Ok(fills)
}

fn joint(number: u8) -> Result<Joint, ContentError> {
    let found = Joint::ALL.get(usize::from(number)).copied();
    found.ok_or_else(|| ContentError::Value(format!("a joint's number is 0 to 24, found {number}")))
}
