//! How a recording is played, for every source that plays one.

use clap::Args;
use posefuse_agent::source::ReplayConfig;

use crate::values;

/// How something recorded is played.
#[derive(Debug, Args)]
pub(super) struct ReplayArgs {
    /// How many times faster than recorded
    #[arg(long, value_name = "FACTOR", default_value = "1", value_parser = values::speed)]
    speed: f64,
    /// Begin again at the end, for ever. Unless --align is given, the clock says where in the recording to begin, so
    /// that agents of one recording play in step whenever they are started
    #[arg(long = "loop")]
    repeat: bool,
    /// Begin at the recording's beginning, at the next multiple of this many seconds of the clock, so that agents
    /// started within that time play in step; 0: at once [default: 0]
    #[arg(long, value_name = "S", value_parser = values::align)]
    align: Option<f64>,
}

impl ReplayArgs {
    pub(super) fn config(&self) -> ReplayConfig {
        let by_the_clock = self.repeat && self.align.is_none();
        ReplayConfig {
            speed: self.speed,
            repeat: self.repeat,
            align_s: self.align.unwrap_or_default(),
            epoch_unix_ns: by_the_clock.then_some(0),
        }
    }
}
