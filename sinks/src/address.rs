//! Addresses as people write them in settings.

use std::net::SocketAddr;

use serde::de::{Deserialize, Deserializer, Error};

/// `127.0.0.1:9000`, or `localhost` for that machine: names of others are not looked up, for they may change.
fn parse(text: &str) -> Result<SocketAddr, String> {
    let local = text
        .strip_prefix("localhost:")
        .and_then(|port| port.parse().ok());
    let local = local.map(|port: u16| SocketAddr::from(([127, 0, 0, 1], port)));
    local.map_or_else(|| text.parse(), Ok).map_err(|_| {
        format!(
            "expected an address and a port such as \"127.0.0.1:9000\" or \"192.168.1.20:9000\", found \"{text}\"; of names only \
             localhost is known"
        )
    })
}

pub(crate) fn one<'de, D: Deserializer<'de>>(from: D) -> Result<SocketAddr, D::Error> {
    parse(&String::deserialize(from)?).map_err(D::Error::custom)
}

pub(crate) fn several<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<SocketAddr>, D::Error> {
    let texts = Vec::<String>::deserialize(from)?.into_iter();
    texts
        .map(|text| parse(&text).map_err(D::Error::custom))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn localhost_is_this_machine_and_the_rest_is_told_what_is_wanted() {
        assert_eq!(parse("localhost:9000"), parse("127.0.0.1:9000"));
        assert_eq!(parse("[::1]:7").unwrap().port(), 7);
        for wrong in [
            "127.0.0.1",
            "localhost",
            "studio:9000",
            "localhost:99999",
            "",
        ] {
            let refused = parse(wrong).unwrap_err();
            assert!(refused.contains(&format!("found \"{wrong}\"")), "{refused}");
        }
    }
}
