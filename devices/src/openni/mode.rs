//! Depth modes: how many pixels, how often, in which unit.

use std::fmt;
use std::str::FromStr;

use super::c::{OniVideoMode, PIXEL_DEPTH_1_MM, PIXEL_DEPTH_100_UM};

/// One way in which a device can give depth.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Mode {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Frames a second.
    pub fps: u32,
    /// What one step of a pixel means, micrometres: 1000 or 100.
    pub unit_um: u32,
}

/// Which mode is wanted. Written `320x240@30` or `320x240`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WantedMode {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Frames a second; `None` is the one nearest to 30.
    pub fps: Option<u32>,
}

/// As many pixels as body tracking makes use of: half the data of 640x480 a quarter of which is looked at.
const USUAL: WantedMode = WantedMode {
    width: 320,
    height: 240,
    fps: None,
};
const USUAL_FPS: u32 = 30;

/// More pixels in a row, or rows, than any depth sensor has: what says so is broken, and memory is not asked for it.
const MOST: u32 = 4096;

impl Mode {
    pub(super) fn from_c(mode: &OniVideoMode) -> Option<Self> {
        let unit_um = match mode.pixel_format {
            PIXEL_DEPTH_1_MM => 1000,
            PIXEL_DEPTH_100_UM => 100,
            _ => return None,
        };
        let number = |number: i32| u32::try_from(number).ok().filter(|&number| number > 0);
        let side = |side: i32| number(side).filter(|&side| side <= MOST);
        Some(Self {
            width: side(mode.resolution_x)?,
            height: side(mode.resolution_y)?,
            fps: number(mode.fps)?,
            unit_um,
        })
    }

    pub(super) fn to_c(self) -> OniVideoMode {
        let format = match self.unit_um {
            100 => PIXEL_DEPTH_100_UM,
            _ => PIXEL_DEPTH_1_MM,
        };
        OniVideoMode {
            pixel_format: format,
            resolution_x: self.width as i32,
            resolution_y: self.height as i32,
            fps: self.fps as i32,
        }
    }

    /// The mode that does best what is wanted. Without a wish: the one nearest to 320x240 with 30 frames a second.
    /// Millimetres go before tenths of them. `None`: nothing offered is as wanted.
    pub fn choose(offered: &[Self], wanted: Option<WantedMode>) -> Option<Self> {
        let fits = |mode: &&Self| wanted.is_none_or(|wanted| wanted.fits(mode));
        let wish = wanted.unwrap_or(USUAL);
        let distance = |mode: &Self| {
            let pixels = i64::from(mode.width) * i64::from(mode.height);
            let wished = i64::from(wish.width) * i64::from(wish.height);
            let fps = wish.fps.unwrap_or(USUAL_FPS).abs_diff(mode.fps);
            (pixels.abs_diff(wished), fps, mode.unit_um != 1000)
        };
        let fitting = offered.iter().filter(fits);
        fitting.min_by_key(|mode| distance(mode)).copied()
    }
}

impl WantedMode {
    fn fits(&self, mode: &Mode) -> bool {
        let size = (mode.width, mode.height) == (self.width, self.height);
        size && self.fps.is_none_or(|fps| fps == mode.fps)
    }
}

impl fmt::Display for Mode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}x{}@{}", self.width, self.height, self.fps)?;
        match self.unit_um {
            1000 => Ok(()),
            unit_um => write!(f, " ({unit_um} um)"),
        }
    }
}

impl fmt::Display for WantedMode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}x{}", self.width, self.height)?;
        self.fps.map_or(Ok(()), |fps| write!(f, "@{fps}"))
    }
}

impl FromStr for WantedMode {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("expected a mode such as 320x240@30 or 640x480, found `{text}`");
        let number = |part: &str| part.parse().ok().filter(|&number| number > 0u32);
        let (size, fps) = match text.split_once('@') {
            Some((size, fps)) => (size, Some(number(fps).ok_or_else(wrong)?)),
            None => (text, None),
        };
        let (width, height) = size.split_once('x').ok_or_else(wrong)?;
        Ok(Self {
            width: number(width).ok_or_else(wrong)?,
            height: number(height).ok_or_else(wrong)?,
            fps,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mode(width: u32, height: u32, fps: u32, unit_um: u32) -> Mode {
        Mode {
            width,
            height,
            fps,
            unit_um,
        }
    }

    #[test]
    fn without_a_wish_the_usual_mode_is_taken_and_a_wish_is_never_bent() {
        let offered = [
            mode(640, 480, 30, 1000),
            mode(320, 240, 60, 1000),
            mode(320, 240, 30, 100),
            mode(320, 240, 30, 1000),
        ];
        assert_eq!(Mode::choose(&offered, None), Some(mode(320, 240, 30, 1000)));
        let wish = |text: &str| Some(text.parse().unwrap());
        assert_eq!(
            Mode::choose(&offered, wish("320x240@60")),
            Some(mode(320, 240, 60, 1000))
        );
        assert_eq!(Mode::choose(&offered, wish("640x480@60")), None);
        assert_eq!(
            Mode::choose(&offered[..1], None),
            Some(mode(640, 480, 30, 1000))
        );
        assert_eq!(Mode::choose(&[], None), None);
    }

    #[test]
    fn modes_that_no_sensor_has_are_not_taken() {
        let of = |resolution_x, resolution_y, fps| {
            Mode::from_c(&OniVideoMode {
                pixel_format: PIXEL_DEPTH_1_MM,
                resolution_x,
                resolution_y,
                fps,
            })
        };
        assert_eq!(of(640, 480, 30), Some(mode(640, 480, 30, 1000)));
        assert_eq!(of(4096, 1, 1), Some(mode(4096, 1, 1, 1000)));
        let wrong = [
            [0, 480, 30],
            [640, 0, 30],
            [640, -480, 30],
            [640, 480, 0],
            [4097, 480, 30],
            [640, i32::MAX, 30],
        ];
        for [width, height, fps] in wrong {
            assert_eq!(of(width, height, fps), None, "{width}x{height}@{fps}");
        }
    }

    #[test]
    fn wishes_are_read_as_they_are_written() {
        for text in ["320x240@30", "640x480"] {
            assert_eq!(text.parse::<WantedMode>().unwrap().to_string(), text);
        }
        for wrong in [
            "",
            "x",
            "320",
            "320x",
            "0x240",
            "320x240@",
            "320x240@0",
            "-1x2",
        ] {
            let error = wrong.parse::<WantedMode>().unwrap_err();
            assert!(error.contains("320x240@30"), "{wrong}: {error}");
        }
    }
}
