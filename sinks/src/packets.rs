//! OSC messages in bundles that each fit a datagram (OSC 1.0).

use rosc::{OscMessage, OscPacket, OscType, encoder};

use crate::udp::MAX_PACKET;

/// An OSC time tag.
pub(crate) type TimeTag = [u8; 8];

/// "Immediately".
pub(crate) const NOW: TimeTag = [0, 0, 0, 0, 0, 0, 0, 1];
/// `#bundle`, a zero and the time tag.
const HEAD: usize = 16;
/// Before each message its length.
const LENGTH: usize = 4;
/// Seconds from 1900, from where time tags count, to 1970.
const NTP_S: i64 = 2_208_988_800;

/// The time tag of a civil time, nanoseconds since 1970, UTC.
pub(crate) fn time_tag(unix_ns: i64) -> TimeTag {
    let seconds = unix_ns.div_euclid(1_000_000_000) + NTP_S;
    let fraction = (unix_ns.rem_euclid(1_000_000_000) << 32) / 1_000_000_000;
    let mut tag = [0; 8];
    // Seconds wrap in 2036, as NTP's do.
    tag[..4].copy_from_slice(&(seconds as u32).to_be_bytes());
    tag[4..].copy_from_slice(&(fraction as u32).to_be_bytes());
    tag
}

/// A message as it stands in a packet.
pub(crate) fn message(address: impl Into<String>, args: Vec<OscType>) -> Vec<u8> {
    let message = OscPacket::Message(OscMessage {
        addr: address.into(),
        args,
    });
    // Writing to memory cannot fail.
    encoder::encode(&message).unwrap_or_default()
}

/// A message of floats.
pub(crate) fn floats(address: impl Into<String>, values: impl IntoIterator<Item = f64>) -> Vec<u8> {
    let values = values.into_iter();
    message(
        address,
        values.map(|value| OscType::Float(value as f32)).collect(),
    )
}

/// Puts messages into bundles of at most [`MAX_PACKET`] bytes, in order. `first` makes the message that each bundle begins
/// with, of its number from 1 and how many there are; its length must not depend on them.
pub(crate) fn bundles(
    messages: &[Vec<u8>],
    tag: TimeTag,
    first: impl Fn(usize, usize) -> Option<Vec<u8>>,
) -> Vec<Vec<u8>> {
    let begin = HEAD + first(1, 1).map_or(0, |message| LENGTH + message.len());
    let (mut ends, mut size) = (Vec::new(), begin);
    for (index, message) in messages.iter().enumerate() {
        if size + LENGTH + message.len() > MAX_PACKET && size > begin {
            ends.push(index);
            size = begin;
        }
        size += LENGTH + message.len();
    }
    ends.push(messages.len());
    let starts = std::iter::once(0).chain(ends.iter().copied());
    let parts = starts.zip(&ends).enumerate();
    parts
        .map(|(part, (start, end))| {
            let mut bundle = Vec::with_capacity(MAX_PACKET);
            bundle.extend_from_slice(b"#bundle\0");
            bundle.extend_from_slice(&tag);
            let first = first(part + 1, ends.len());
            for message in first.iter().chain(&messages[start..*end]) {
                bundle.extend_from_slice(&(message.len() as u32).to_be_bytes());
                bundle.extend_from_slice(message);
            }
            bundle
        })
        .collect()
}

#[cfg(test)]
pub(crate) mod tests {
    use rosc::decoder;

    use super::*;

    /// What is in packets, as somebody else's decoder has it.
    pub(crate) fn opened(packets: &[Vec<u8>]) -> Vec<OscMessage> {
        let mut found = Vec::new();
        for packet in packets {
            assert!(packet.len() <= MAX_PACKET, "{} bytes", packet.len());
            let (rest, packet) = decoder::decode_udp(packet).unwrap();
            assert!(rest.is_empty());
            let OscPacket::Bundle(bundle) = packet else {
                panic!("no bundle");
            };
            for content in bundle.content {
                let OscPacket::Message(message) = content else {
                    panic!("a bundle in a bundle");
                };
                found.push(message);
            }
        }
        found
    }

    #[test]
    fn many_messages_come_in_bundles_that_fit_and_keep_their_order() {
        let messages: Vec<Vec<u8>> = (0..100)
            .map(|number| floats(format!("/somewhere/{number}"), [f64::from(number); 3]))
            .collect();
        let packets = bundles(&messages, NOW, |part, parts| {
            Some(floats("/part", [part as f64, parts as f64]))
        });
        assert!(packets.len() > 2);
        let found = opened(&packets);
        let parts: Vec<&OscMessage> = found.iter().filter(|m| m.addr == "/part").collect();
        assert_eq!(parts.len(), packets.len());
        for (index, part) in parts.iter().enumerate() {
            let expected = [index as f32 + 1.0, packets.len() as f32];
            assert_eq!(part.args, expected.map(OscType::Float));
        }
        let others = found.iter().filter(|message| message.addr != "/part");
        let numbers: Vec<String> = others.map(|message| message.addr.clone()).collect();
        let expected: Vec<String> = (0..100).map(|i| format!("/somewhere/{i}")).collect();
        assert_eq!(numbers, expected);
    }

    #[test]
    fn nothing_is_still_one_packet() {
        assert_eq!(bundles(&[], NOW, |_, _| None).len(), 1);
    }

    #[test]
    fn time_tags_count_from_1900() {
        let tag = time_tag(1_500_000_000);
        assert_eq!(tag[..4], 2_208_988_801_u32.to_be_bytes());
        assert_eq!(tag[4..], 0x8000_0000_u32.to_be_bytes());
    }
}
