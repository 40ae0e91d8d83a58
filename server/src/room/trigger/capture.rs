//! Orders as the XML packets by which motion-capture systems (Vicon, OptiTrack) start and stop each other over UDP:
//!
//! ```xml
//! <CaptureStart><Name VALUE="walk"/><Notes VALUE=""/><Delay VALUE="33"/><PacketID VALUE="17"/></CaptureStart>
//! <CaptureStop RESULT="SUCCESS"><Name VALUE="walk"/><PacketID VALUE="18"/></CaptureStop>
//! ```
//!
//! Senders repeat a packet, for UDP loses some; copies have the same `PacketID` and are one order. A stop ends only the take
//! that such a packet began, so that another system's stop does not end what somebody records here by hand. Nothing is
//! answered: the senders do not listen.

use std::collections::VecDeque;
use std::net::{IpAddr, SocketAddr};
use std::sync::Arc;

use posefuse_skeleton::Timestamp;

use super::{Order, Way, start};
use crate::room::Room;

/// A packet is a copy of an earlier one for so long.
const COPY_NS: i64 = 10_000_000_000;
/// Packets that are remembered.
const REMEMBERED: usize = 64;

/// What a packet says.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
struct Packet {
    is_start: bool,
    name: String,
    notes: String,
    /// Empty: it has none, and every one counts.
    id: String,
}

/// One port's memory.
#[derive(Debug, Default)]
pub(super) struct Captures {
    seen: VecDeque<(Timestamp, IpAddr, Packet)>,
    /// The take that the latest start began.
    ours: Option<String>,
}

impl Captures {
    /// Carries out what a packet says.
    pub(super) async fn obey(&mut self, room: &Arc<Room>, from: SocketAddr, bytes: &[u8]) {
        let packet = match parse(bytes) {
            Ok(packet) => packet,
            Err(problem) => return room.not_an_order(Way::Capture, problem),
        };
        if self.is_copy(room.clock.now(), from.ip(), &packet) {
            return;
        }
        if packet.is_start {
            let order = start(&packet.name, "", packet.notes);
            let started = room.order(Way::Capture, Some(from), order).await;
            if let Ok(take) = started {
                self.ours = Some(take.name);
            }
            return;
        }
        let running = room.takes.current().as_ref().map(|take| take.name.clone());
        match running {
            Some(running) if self.ours.as_ref() != Some(&running) => room.not_an_order(
                Way::Capture,
                format!("refused: take `{running}` was not started by a capture packet, so none stops it"),
            ),
            _ => {
                let _ = room.order(Way::Capture, Some(from), Order::Stop).await;
                self.ours = None;
            }
        }
    }

    fn is_copy(&mut self, now: Timestamp, from: IpAddr, packet: &Packet) -> bool {
        self.seen.retain(|(at, ..)| now.since_ns(*at) < COPY_NS);
        if packet.id.is_empty() {
            return false;
        }
        let is_same = |known: &Packet| {
            (known.is_start, &known.id, &known.name) == (packet.is_start, &packet.id, &packet.name)
        };
        if self
            .seen
            .iter()
            .any(|(_, ip, known)| *ip == from && is_same(known))
        {
            return true;
        }
        self.seen.push_back((now, from, packet.clone()));
        if self.seen.len() > REMEMBERED {
            self.seen.pop_front();
        }
        false
    }
}

/// Reads a packet: one element with elements whose attribute `VALUE` says it. Upper and lower case are the same.
fn parse(bytes: &[u8]) -> Result<Packet, String> {
    let text = String::from_utf8_lossy(bytes);
    let mut tags = text
        .split('<')
        .skip(1)
        .filter(|tag| !tag.starts_with(['?', '!', '/']));
    let root = tags.next().unwrap_or_default();
    let is_start = match element(root).to_ascii_lowercase().as_str() {
        "capturestart" => true,
        "capturestop" => false,
        _ => {
            let shown: String = text.chars().take(40).collect();
            return Err(format!(
                "a packet begins `{}`: expected CaptureStart or CaptureStop",
                shown.escape_debug()
            ));
        }
    };
    let end = if is_start {
        "</capturestart>"
    } else {
        "</capturestop>"
    };
    if !text.to_ascii_lowercase().contains(end) {
        return Err("a capture packet has no end: it was cut off".to_owned());
    }
    let mut packet = Packet {
        is_start,
        ..Packet::default()
    };
    let mut words = Vec::new();
    for tag in tags {
        let value = attribute(tag, "value").unwrap_or_default();
        match element(tag).to_ascii_lowercase().as_str() {
            "name" => packet.name = value,
            "notes" | "description" => words.push(value),
            "packetid" => packet.id = value,
            _ => {}
        }
    }
    words.retain(|word| !word.trim().is_empty());
    packet.notes = words.join("\n");
    Ok(packet)
}

/// The name of the element that a tag, without its `<`, opens.
fn element(tag: &str) -> &str {
    let end = tag.find(|c: char| c.is_whitespace() || matches!(c, '/' | '>'));
    &tag[..end.unwrap_or(tag.len())]
}

/// An attribute's value. `<` cannot stand in one, `>` can.
fn attribute(tag: &str, name: &str) -> Option<String> {
    let mut rest = tag;
    while let Some((before, after)) = rest.split_once('=') {
        let after = after.trim_start();
        let quote = after.chars().next().filter(|c| matches!(c, '"' | '\''))?;
        let (value, later) = after[1..].split_once(quote)?;
        let key = before
            .trim_end()
            .rsplit(char::is_whitespace)
            .next()
            .unwrap_or_default();
        if key.eq_ignore_ascii_case(name) {
            return Some(unescaped(value));
        }
        rest = later;
    }
    None
}

fn unescaped(text: &str) -> String {
    // `&amp;` last, or `&amp;lt;` would become `<`.
    [
        ("&lt;", "<"),
        ("&gt;", ">"),
        ("&quot;", "\""),
        ("&apos;", "'"),
        ("&amp;", "&"),
    ]
    .iter()
    .fold(text.to_owned(), |text, (from, to)| text.replace(from, to))
}

#[cfg(test)]
mod tests {
    use super::*;

    const START: &str = r#"<?xml version="1.0" encoding="UTF-8" standalone="no" ?>
<CaptureStart>
<Name VALUE="Fight 3 &amp;lt; 'b' > c"/>
<Notes VALUE="two &quot;turns&quot;"/>
<Description VALUE=''/>
<DatabasePath VALUE="S:/shared/dbase1"/>
<Delay VALUE="33"/>
<PacketID VALUE="17"/>
</CaptureStart>"#;

    #[test]
    fn packets_are_read() {
        let packet = parse(START.as_bytes()).unwrap();
        assert_eq!(packet.name, "Fight 3 &lt; 'b' > c");
        assert_eq!(
            (packet.notes.as_str(), packet.id.as_str()),
            ("two \"turns\"", "17")
        );
        assert!(packet.is_start);
        let stop = b"<capturestop result=\"SUCCESS\"><Name value=\"walk\"/></capturestop>\0";
        let stop = parse(stop).unwrap();
        assert_eq!(
            (stop.is_start, stop.name.as_str(), stop.id.as_str()),
            (false, "walk", "")
        );
    }

    #[test]
    fn anything_else_is_refused_in_words() {
        for bytes in [
            &b""[..],
            b"<Capture/>",
            b"\xff\xfe<",
            b"/posefuse/take/start",
            &START.as_bytes()[..200],
        ] {
            let problem = parse(bytes).unwrap_err();
            assert!(problem.contains("packet"), "{problem}");
        }
        // Half attributes and bare words.
        let odd =
            parse(b"<CaptureStart><Name VALUE=walk/><Notes VALUE=\"x/></CaptureStart>").unwrap();
        assert_eq!((odd.name.as_str(), odd.notes.as_str()), ("", ""));
    }

    #[test]
    fn copies_of_a_packet_are_one_order() {
        let mut captures = Captures::default();
        let [here, there] = ["127.0.0.1", "127.0.0.2"].map(|ip| ip.parse().unwrap());
        let at = Timestamp::from_seconds;
        let packet = parse(START.as_bytes()).unwrap();
        assert!(!captures.is_copy(at(0.0), here, &packet));
        assert!(captures.is_copy(at(0.1), here, &packet));
        assert!(!captures.is_copy(at(0.1), there, &packet));
        let next = Packet {
            id: "18".into(),
            ..packet.clone()
        };
        assert!(!captures.is_copy(at(0.2), here, &next));
        let stop = Packet {
            is_start: false,
            ..packet.clone()
        };
        assert!(!captures.is_copy(at(0.3), here, &stop));
        // A sender that starts anew counts anew.
        assert!(!captures.is_copy(at(11.0), here, &packet));
        let without = Packet {
            id: String::new(),
            ..packet
        };
        assert!(
            !captures.is_copy(at(11.0), here, &without)
                && !captures.is_copy(at(11.0), here, &without)
        );
    }
}
