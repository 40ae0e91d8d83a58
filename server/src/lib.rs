//! The room server: agents' frames in, fused people out.
//!
//! A frame's way: `net` (the one port) → `ingest` (an agent's stream, validated once) → `fusion_thread` (the one
//! thread that owns the engine) → `sinks` (subscribers) and `record` (takes). `room` is the service by which
//! everybody sees and changes it all.
//!
//! [`run`] is the whole API: a [`Config`], the [`Parts`] it is made with, and a future that says when to stop.
//!
//! ```no_run
//! # async fn example() -> Result<(), posefuse_server::ServerError> {
//! let config = posefuse_server::Config::default();
//! let parts = posefuse_server::Parts::system(&config).await?;
//! posefuse_server::run(config, parts, async { tokio::signal::ctrl_c().await.unwrap_or(()) }).await
//! # }
//! ```
//!
//! Not here: a system clock, file or socket outside [`SystemClock`], [`Parts::system`], [`bind`] and the ports of UDP that a
//! configuration may ask for (`[trigger]`), so that a simulated network can run the same server; randomness, anywhere; a
//! logger (events go out through `tracing`).

mod commented;
mod config;
mod drift;
mod error;
mod fusion_thread;
mod ingest;
mod net;
mod parts;
mod record;
mod repair;
mod room;
mod run;
mod sinks;

pub use config::Config;
pub use drift::Config as DriftConfig;
pub use error::ServerError;
pub use ingest::Config as IngestConfig;
pub use net::{Config as NetConfig, bind};
pub use parts::{Clock, Listener, Parts, SystemClock, Threads};
pub use posefuse_models::Config as ModelsConfig;
pub use record::Config as TakesConfig;
pub use room::{BUILD, CalibrationConfig, TimecodeConfig, TimecodeZoneName, TriggerConfig};
pub use run::run;
pub use sinks::Config as WatchConfig;
