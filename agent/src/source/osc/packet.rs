//! From the bytes of a packet to its messages. Whatever comes over the network ends here or is well-formed from here on.

use rosc::{OscBundle, OscMessage, OscPacket, decoder};

/// Bundles inside bundles, and arrays inside arrays, at most: the decoder follows them by recursion.
const DEEPEST: usize = 16;

/// One message, and the time tag of the bundle it came in; `None` for a message on its own and for "immediately".
pub(super) type Tagged = (Option<u64>, OscMessage);

/// The packet's messages in their order, or `None` where it is no OSC.
pub(super) fn messages(packet: &[u8]) -> Option<Vec<Tagged>> {
    if too_deep(packet) {
        return None;
    }
    let (_, packet) = decoder::decode_udp(packet).ok()?;
    let mut messages = Vec::new();
    flatten(packet, None, &mut messages);
    Some(messages)
}

fn too_deep(packet: &[u8]) -> bool {
    let bundles = packet
        .windows(8)
        .filter(|window| *window == b"#bundle\0")
        .count();
    // Brackets also occur within numbers, where they open and close at random: only many more of one kind are strange.
    let (mut open, mut most) = (0_usize, 0);
    for byte in packet {
        match byte {
            b'[' => open += 1,
            b']' => open = open.saturating_sub(1),
            _ => {}
        }
        most = most.max(open);
    }
    bundles > DEEPEST || most > 8 * DEEPEST
}

fn flatten(packet: OscPacket, tag: Option<u64>, messages: &mut Vec<Tagged>) {
    match packet {
        OscPacket::Message(message) => messages.push((tag, message)),
        OscPacket::Bundle(OscBundle { timetag, content }) => {
            let own = u64::from(timetag.seconds) << 32 | u64::from(timetag.fractional);
            // 0 and 1 stand for no time and for "immediately".
            let tag = (own > 1).then_some(own);
            for inner in content {
                flatten(inner, tag, messages);
            }
        }
    }
}
