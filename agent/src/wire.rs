//! What an agent has, as the wire says it.

use posefuse_proto::{agent_body, hands_to_wire, v1};

use crate::{Camera, DepthPreview, SourceBody};

/// The camera as greeted; `previews`: whether it can be looked through. `None`: there is nothing to tell.
pub(crate) fn camera(camera: Option<Camera>, previews: bool) -> Option<v1::CameraInfo> {
    let known = camera.map(|camera| v1::CameraInfo {
        fov_horizontal_deg: camera.view_deg[0],
        fov_vertical_deg: camera.view_deg[1],
        near_m: camera.range_m[0],
        far_m: camera.range_m[1],
        depth_preview: previews,
    });
    let unknown = previews.then(|| v1::CameraInfo {
        depth_preview: true,
        ..v1::CameraInfo::default()
    });
    known.or(unknown)
}

/// A body in the order of its joint set.
pub(crate) fn body(body: &SourceBody) -> v1::Body {
    let mut wire = agent_body(body.tracking_id, &body.joints);
    wire.orientations.extend(body.orientations.iter().flatten());
    wire.hands_closed = hands_to_wire(body.hands_closed);
    wire
}

/// A depth preview; the server knows whose it is.
pub(crate) fn preview(preview: &DepthPreview) -> v1::DepthPreview {
    let camera = &preview.camera;
    v1::DepthPreview {
        sensor: String::new(),
        captured_ns: preview.captured.ns(),
        width: preview.image.width,
        height: preview.image.height,
        millimetres: preview
            .image
            .millimetres
            .iter()
            .flat_map(|depth| depth.to_le_bytes())
            .collect(),
        camera: Some(v1::Intrinsics {
            fx: camera.fx,
            fy: camera.fy,
            cx: camera.cx,
            cy: camera.cy,
        }),
        bodies: preview.bodies.iter().map(body).collect(),
    }
}
