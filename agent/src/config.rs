//! What an agent is told: where the server is, what its sensor is called and where frames come from.

use std::time::Duration;

use posefuse_proto::check_sensor_name;
use tonic::transport::Uri;

use crate::{AgentError, BufferLimits, SourceConfig};

/// Everything that differs from one agent to the next.
#[derive(Clone, Debug)]
pub struct AgentConfig {
    /// The server, e.g. `http://127.0.0.1:7400`; see [`parse_server`].
    pub server: Uri,
    /// The sensor's name, unique in the room.
    pub name: String,
    /// Where frames come from.
    pub source: SourceConfig,
    /// How much is kept for a server that is away.
    pub buffer: BufferLimits,
    /// How long to go on trying to deliver what is buffered after the source has ended.
    pub drain: Duration,
}

impl AgentConfig {
    /// An agent with the usual buffer: at least 60 s at 60 frames a second.
    pub fn new(server: Uri, name: impl Into<String>, source: SourceConfig) -> Self {
        Self {
            server,
            name: name.into(),
            source,
            buffer: BufferLimits::default(),
            drain: Duration::from_secs(60),
        }
    }

    pub(crate) fn check(&self) -> Result<(), AgentError> {
        let config = |reason: String| AgentError::Config { reason };
        check_sensor_name(&self.name).map_err(|error| config(error.to_string()))?;
        if self.buffer.frames == 0 || self.buffer.bytes == 0 {
            return Err(config(
                "the resend buffer needs room for at least one frame".into(),
            ));
        }
        if self.server.scheme_str() != Some("http") || self.server.host().is_none() {
            return Err(config(not_a_server(&self.server.to_string())));
        }
        Ok(())
    }
}

/// Reads a server's address as a person writes it: `127.0.0.1:7400`, `studio:7400`, `http://studio:7400`.
pub fn parse_server(text: &str) -> Result<Uri, AgentError> {
    let wrong = || AgentError::Config {
        reason: not_a_server(text),
    };
    let full = match text.contains("://") {
        true => text.to_owned(),
        false => format!("http://{text}"),
    };
    let uri: Uri = full.parse().map_err(|_| wrong())?;
    let usable =
        uri.scheme_str() == Some("http") && uri.host().is_some_and(|host| !host.is_empty());
    if usable && uri.port_u16().is_some() {
        Ok(uri)
    } else {
        Err(wrong())
    }
}

fn not_a_server(text: &str) -> String {
    format!("server `{text}`: expected host and port, e.g. 127.0.0.1:7400 or http://studio:7400")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_as_people_write_them() {
        assert_eq!(
            parse_server("127.0.0.1:7400").unwrap().to_string(),
            "http://127.0.0.1:7400/"
        );
        assert_eq!(
            parse_server("http://[::1]:7400").unwrap().port_u16(),
            Some(7400)
        );
        for bad in [
            "",
            "studio",
            "https://studio:1",
            ":7400",
            "http://",
            "a b:1",
        ] {
            let error = parse_server(bad).unwrap_err().to_string();
            assert!(error.contains("expected host and port"), "{bad}: {error}");
        }
    }
}
