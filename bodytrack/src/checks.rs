//! Settings, cameras and images that cannot be, told before anything is done with them.

use posefuse_skeleton::{DepthImage, Intrinsics};

use crate::{TrackerConfig, TrackerError};

pub(crate) fn check_config(config: &TrackerConfig) -> Result<(), TrackerError> {
    let wrong = |field, expected, found| {
        Err(TrackerError::Config {
            field,
            expected,
            found,
        })
    };
    let [near, far] = config.range_m;
    if !(64..=1024).contains(&config.width) {
        return wrong("width", "from 64 to 1024 pixels", config.width.to_string());
    }
    if !(1..=16).contains(&config.people) {
        return wrong("people", "from 1 to 16", config.people.to_string());
    }
    // Written so that no number at all is wrong, too.
    if !(near >= 0.0 && far > near && far <= 30.0) {
        let found = format!("[{near}, {far}]");
        return wrong("range_m", "with 0 <= nearest < furthest <= 30 m", found);
    }
    Ok(())
}

pub(crate) fn check_camera(camera: &Intrinsics) -> Result<(), TrackerError> {
    let &Intrinsics {
        width,
        height,
        fx,
        fy,
        ..
    } = camera;
    let sides = [width, height]
        .iter()
        .all(|side| (32..=4096).contains(side));
    let focal = [fx, fy]
        .iter()
        .all(|focal| focal.is_finite() && *focal > 1.0);
    let centre = camera.cx.is_finite() && camera.cy.is_finite();
    if sides && focal && centre {
        return Ok(());
    }
    Err(TrackerError::Camera {
        width,
        height,
        fx,
        fy,
    })
}

pub(crate) fn check_image(camera: &Intrinsics, image: &DepthImage) -> Result<(), TrackerError> {
    let (expected, found) = ([camera.width, camera.height], [image.width, image.height]);
    let values = image.millimetres.len();
    if expected == found && values == image.width as usize * image.height as usize {
        return Ok(());
    }
    Err(TrackerError::Size {
        expected,
        found,
        values,
    })
}
