//! The engine's settings: plain data, read from TOML, the defaults are what ships.
//!
//! Units are in the names (`_ms`, `_s`, `_m`, `_hz`, `_mps` for m/s). Unknown keys are refused; use
//! [`crate::parse_toml`] to get a suggestion with the refusal.

use serde::{Deserialize, Serialize};

use crate::config_check::Checker;
use crate::repair::RepairConfig;
use crate::stages::Stage;
use crate::toml_text::ConfigError;

/// Everything the engine can be told.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// When a fused frame is made.
    pub intake: IntakeConfig,
    /// How agents' clocks are mapped to the server's.
    pub clock: ClockConfig,
    /// Which bodies are the same person.
    pub associate: AssociateConfig,
    /// How several sensors' joints become one.
    pub fuse: FuseConfig,
    /// What is made up where no sensor saw a joint.
    pub repair: RepairConfig,
    /// The ordered list of what happens before (gate) and after (bones, smooth) fusing.
    pub stages: Vec<Stage>,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            intake: IntakeConfig::default(),
            clock: ClockConfig::default(),
            associate: AssociateConfig::default(),
            fuse: FuseConfig::default(),
            repair: RepairConfig::default(),
            stages: Stage::shipped(),
        }
    }
}

impl Config {
    /// Checks every number.
    ///
    /// # Errors
    /// The first key whose value cannot work, with what was expected.
    pub fn validate(&self) -> Result<(), ConfigError> {
        let mut check = Checker::default();
        self.intake.check(&mut check);
        self.clock.check(&mut check);
        self.associate.check(&mut check);
        check.within("fuse.min_confidence", self.fuse.min_confidence, 0.0, 1.0);
        check.within(
            "fuse.look_ahead",
            self.fuse.look_ahead as f64,
            0.0,
            MAX_LOOK_AHEAD,
        );
        self.repair.check(&mut check);
        let gates = self.stages.iter().filter(|s| matches!(s, Stage::Gate(_)));
        check.that("stages", gates.count() <= 1, || {
            "at most one stage of kind `gate`, found several".into()
        });
        for (index, stage) in self.stages.iter().enumerate() {
            stage.check(&format!("stages[{index}]"), &mut check);
        }
        check.finish()
    }

    /// How many frames later a frame comes out because fusing or a stage looks ahead.
    pub fn look_ahead_frames(&self) -> usize {
        let stages = self.stages.iter().map(Stage::look_ahead_frames);
        self.fuse.look_ahead_frames() + stages.sum::<usize>()
    }
}

/// When a fused frame is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum IntakeMode {
    /// At the capture time of the newest observation, when one came and enough time has passed.
    Async,
    /// On a fixed grid of times, each sensor interpolated to it, once every live sensor has passed it.
    Window,
}

/// `[intake]`: when a fused frame is made.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct IntakeConfig {
    /// `async` or `window`.
    pub mode: IntakeMode,
    /// Fused frames per second: the grid of `window`, an upper bound for `async`.
    pub rate_hz: f64,
    /// The oldest sample of a sensor that still goes into a frame, moved there by velocity.
    pub max_age_ms: f64,
    /// `async`: a sensor whose samples are older than `max_age_ms` by the time they come, but not than this, holds the
    /// room's present back so far that they can be used; 0 to 250, 0 holds nothing back.
    pub max_lag_ms: f64,
    /// `async`: how long a due frame waits for the other sensors of the same instant.
    pub coalesce_ms: f64,
    /// `window`: how long after a grid time a frame waits for the last live sensor.
    pub max_wait_ms: f64,
    /// `async`: after how long without a frame ticks carry the room on.
    pub silence_ms: f64,
    /// A sensor not heard from for this long is waited for no more.
    pub live_ms: f64,
}

impl Default for IntakeConfig {
    fn default() -> Self {
        Self {
            mode: IntakeMode::Async,
            rate_hz: 30.0,
            max_age_ms: 80.0,
            max_lag_ms: 250.0,
            coalesce_ms: 4.0,
            max_wait_ms: 100.0,
            silence_ms: 100.0,
            live_ms: 500.0,
        }
    }
}

impl IntakeConfig {
    fn check(&self, check: &mut Checker) {
        check.within("intake.rate_hz", self.rate_hz, 1.0, 240.0);
        check.within("intake.max_age_ms", self.max_age_ms, 1.0, 1000.0);
        check.within("intake.max_lag_ms", self.max_lag_ms, 0.0, 250.0);
        check.within("intake.coalesce_ms", self.coalesce_ms, 0.0, 1000.0);
        check.within("intake.max_wait_ms", self.max_wait_ms, 1.0, 5000.0);
        check.within("intake.silence_ms", self.silence_ms, 10.0, 5000.0);
        check.within("intake.live_ms", self.live_ms, 10.0, 60_000.0);
    }

    /// Time between two frames, ns.
    pub(crate) fn period_ns(&self) -> i64 {
        seconds_to_ns(1.0 / self.rate_hz).max(1)
    }

    /// `max_age_ms` in ns.
    pub(crate) fn max_age_ns(&self) -> i64 {
        ms_to_ns(self.max_age_ms)
    }
}

/// `[clock]`: how agents' clocks are mapped to the server's.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ClockConfig {
    /// Clock probes older than this are forgotten.
    pub window_s: f64,
    /// A drift is estimated once the probes span this long; before, it is taken as 0 within its bound.
    pub slope_after_s: f64,
    /// No two clocks drift apart faster than this (NTP slews by up to 500).
    pub max_drift_ppm: f64,
    /// A disagreement this large is a step: frames are held back from the first sign on.
    pub step_ms: f64,
}

impl Default for ClockConfig {
    fn default() -> Self {
        Self {
            window_s: 60.0,
            slope_after_s: 10.0,
            max_drift_ppm: 300.0,
            step_ms: 250.0,
        }
    }
}

impl ClockConfig {
    fn check(&self, check: &mut Checker) {
        check.within("clock.window_s", self.window_s, 1.0, 3600.0);
        check.within("clock.slope_after_s", self.slope_after_s, 1.0, 3600.0);
        check.within("clock.max_drift_ppm", self.max_drift_ppm, 1.0, 10_000.0);
        check.within("clock.step_ms", self.step_ms, 1.0, 10_000.0);
    }
}

/// `[associate]`: which bodies are the same person.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AssociateConfig {
    /// Mean joint distance up to which a body can be a track's.
    pub gate_m: f64,
    /// How much nearer a body counts whose sensor's own id is bound to the track.
    pub id_bonus_m: f64,
    /// Observations before a track becomes a person with an id.
    pub birth_hits: u32,
    /// How long an unseen person's id is kept.
    pub memory_s: f64,
    /// How long an unseen person is still shown, carried on from the past.
    pub show_s: f64,
    /// Two tracks of different sensors with a median joint distance below this are one person.
    pub merge_m: f64,
    /// For how many frames they must be.
    pub merge_frames: u32,
    /// Most people followed at a time.
    pub max_people: usize,
}

impl Default for AssociateConfig {
    fn default() -> Self {
        Self {
            gate_m: 0.5,
            id_bonus_m: 0.25,
            birth_hits: 3,
            memory_s: 2.0,
            show_s: 0.5,
            merge_m: 0.14,
            merge_frames: 10,
            max_people: 16,
        }
    }
}

impl AssociateConfig {
    fn check(&self, check: &mut Checker) {
        check.within("associate.gate_m", self.gate_m, 0.05, 5.0);
        check.within("associate.id_bonus_m", self.id_bonus_m, 0.0, 5.0);
        check.within(
            "associate.birth_hits",
            f64::from(self.birth_hits),
            1.0,
            1000.0,
        );
        check.within("associate.memory_s", self.memory_s, 0.0, 600.0);
        check.within("associate.show_s", self.show_s, 0.0, 60.0);
        check.within("associate.merge_m", self.merge_m, 0.0, 1.0);
        check.within(
            "associate.merge_frames",
            f64::from(self.merge_frames),
            1.0,
            1000.0,
        );
        check.within("associate.max_people", self.max_people as f64, 1.0, 64.0);
    }

    /// `show_s` in ns.
    pub(crate) fn show_ns(&self) -> i64 {
        seconds_to_ns(self.show_s)
    }

    /// `memory_s` in ns, at least as long as a person is shown.
    pub(crate) fn memory_ns(&self) -> i64 {
        seconds_to_ns(self.memory_s.max(self.show_s))
    }
}

/// How several sensors' joints become one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FuseMethod {
    /// The mean of the joints of at least `min_confidence` (Menard 2014), where the trackers report them.
    Average,
    /// The mean weighted by each sensor's noise at that distance and direction, and by confidence.
    Weighted,
    /// A filter per joint that takes each sample at its own time and can look back.
    Kalman,
}

/// `[fuse]`: how several sensors' joints become one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FuseConfig {
    /// `average`, `weighted` or `kalman`.
    pub method: FuseMethod,
    /// `kalman`: newer frames waited for, 0 to 30, so that each frame is smoothed by what came after it.
    pub look_ahead: usize,
    /// Confidence from which on a joint counts as measured with trust.
    pub min_confidence: f64,
    /// Whether bodies whose left and right a tracker exchanged are put right.
    pub swaps: bool,
}

impl Default for FuseConfig {
    fn default() -> Self {
        Self {
            method: FuseMethod::Kalman,
            look_ahead: 1,
            min_confidence: 0.75,
            swaps: true,
        }
    }
}

/// Most frames that fusing waits for.
const MAX_LOOK_AHEAD: f64 = 30.0;

impl FuseConfig {
    /// How many newer frames fusing waits for.
    pub(crate) fn look_ahead_frames(&self) -> usize {
        match self.method {
            FuseMethod::Kalman => self.look_ahead,
            FuseMethod::Average | FuseMethod::Weighted => 0,
        }
    }
}

/// Milliseconds as whole nanoseconds.
pub(crate) fn ms_to_ns(ms: f64) -> i64 {
    (ms * 1e6).round() as i64
}

/// Seconds as whole nanoseconds.
pub(crate) fn seconds_to_ns(seconds: f64) -> i64 {
    (seconds * 1e9).round() as i64
}
