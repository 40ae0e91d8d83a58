//! Orders as OSC: `/posefuse/take/start [name [slate [notes]]]` and `/posefuse/take/stop`.
//!
//! Buttons of control surfaces send 1 when pressed and 0 when let go: a single number in place of words starts or stops
//! when it is not 0. Answers go to the sender: `/posefuse/take/started name`, `/posefuse/take/stopped name` or
//! `/posefuse/take/error words`. Time tags are not heeded: an order holds when it comes.

use rosc::{OscMessage, OscPacket, OscType, decoder, encoder};

use super::{Order, start};

const START: &str = "/posefuse/take/start";
const STOP: &str = "/posefuse/take/stop";

/// Addresses of orders begin so; what else comes is for somebody else, or an answer that an OSC router sent back.
const OURS: &str = "/posefuse/take/";
const ANSWERS: [&str; 3] = ["started", "stopped", "error"];

/// The orders of a packet, in their order, and in place of each that cannot be read the reason.
///
/// # Errors
/// It is no OSC.
pub(super) fn orders(packet: &[u8]) -> Result<Vec<Result<Order, String>>, String> {
    let (rest, packet) =
        decoder::decode_udp(packet).map_err(|error| format!("a packet is no OSC: {error}"))?;
    if !rest.is_empty() {
        return Err(format!("{} bytes follow an OSC packet's end", rest.len()));
    }
    let mut orders = Vec::new();
    let mut waiting = vec![packet];
    while let Some(packet) = waiting.pop() {
        match packet {
            OscPacket::Message(message) if is_for_us(&message.addr) => {
                orders.extend(order(&message).transpose());
            }
            OscPacket::Message(_) => {}
            OscPacket::Bundle(bundle) => waiting.extend(bundle.content.into_iter().rev()),
        }
    }
    Ok(orders)
}

fn is_for_us(address: &str) -> bool {
    address
        .strip_prefix(OURS)
        .is_some_and(|rest| !ANSWERS.contains(&rest))
}

/// The answer `/posefuse/take/WHAT words`.
pub(super) fn answer(what: &str, words: &str) -> Vec<u8> {
    let message = OscMessage {
        addr: format!("/posefuse/take/{what}"),
        args: vec![OscType::String(words.to_owned())],
    };
    encoder::encode(&OscPacket::Message(message)).unwrap_or_default()
}

/// `None`: a button that was let go.
fn order(message: &OscMessage) -> Result<Option<Order>, String> {
    let (address, arguments) = (message.addr.as_str(), &message.args[..]);
    let is_start = match address {
        START => true,
        STOP => false,
        other => {
            let shown: String = other.chars().take(80).collect();
            return Err(format!(
                "no order is called `{shown}`: expected {START} or {STOP}"
            ));
        }
    };
    let words = match arguments {
        [button] if !matches!(button, OscType::String(_)) => match pressed(button) {
            Some(true) => Vec::new(),
            Some(false) => return Ok(None),
            None => return Err(format!("{address} takes words or one number")),
        },
        // What a stop brings with it, e.g. the take's name, changes nothing.
        _ if !is_start => Vec::new(),
        words => words
            .iter()
            .map(|word| match word {
                OscType::String(word) => Ok(word.as_str()),
                _ => Err(format!(
                    "{address} takes name, slate and notes as words, or one number"
                )),
            })
            .collect::<Result<_, _>>()?,
    };
    if !is_start {
        return Ok(Some(Order::Stop));
    }
    if words.len() > 3 {
        return Err(format!(
            "{address} takes at most three words: name, slate and notes; found {}",
            words.len()
        ));
    }
    let word = |index: usize| words.get(index).copied().unwrap_or_default();
    Ok(Some(start(word(0), word(1), word(2).to_owned())))
}

fn pressed(argument: &OscType) -> Option<bool> {
    match argument {
        OscType::Int(number) => Some(*number != 0),
        OscType::Long(number) => Some(*number != 0),
        OscType::Float(number) => Some(*number != 0.0),
        OscType::Double(number) => Some(*number != 0.0),
        OscType::Bool(on) => Some(*on),
        OscType::Nil | OscType::Inf => Some(true),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use posefuse_proto::v1::StartTakeRequest;
    use rosc::{OscBundle, OscTime};

    fn message(address: &str, args: Vec<OscType>) -> OscPacket {
        OscPacket::Message(OscMessage {
            addr: address.into(),
            args,
        })
    }

    fn read(packet: &OscPacket) -> Result<Vec<Order>, String> {
        let orders = orders(&encoder::encode(packet).unwrap()).unwrap();
        orders.into_iter().collect()
    }

    fn started(name: &str, slate: &str, notes: &str) -> Order {
        Order::Start(StartTakeRequest {
            name: name.into(),
            slate: slate.into(),
            notes: notes.into(),
        })
    }

    #[test]
    fn words_buttons_and_bundles_are_orders() {
        let word = |text: &str| OscType::String(text.into());
        let plain = message(START, vec![]);
        assert_eq!(read(&plain).unwrap(), [started("", "", "")]);
        let named = message(START, vec![word("walk"), word("12A"), word("two turns")]);
        assert_eq!(read(&named).unwrap(), [started("walk", "12A", "two turns")]);
        for (value, orders) in [(1.0, vec![Order::Stop]), (0.0, vec![])] {
            let button = message(STOP, vec![OscType::Float(value)]);
            assert_eq!(read(&button).unwrap(), orders);
        }
        let bundle = OscPacket::Bundle(OscBundle {
            timetag: OscTime::from((0, 1)),
            content: vec![
                message("/fader/1", vec![OscType::Float(0.5)]),
                message(STOP, vec![word("walk")]),
                named,
            ],
        });
        assert_eq!(
            read(&bundle).unwrap(),
            [Order::Stop, started("walk", "12A", "two turns")]
        );
    }

    #[test]
    fn what_is_for_others_and_answers_that_come_back_are_no_orders() {
        for address in ["/ping", "/posefuse/take/error", "/posefuse/take/started"] {
            assert_eq!(read(&message(address, vec![])).unwrap(), [], "{address}");
        }
    }

    #[test]
    fn anything_else_is_refused_in_words() {
        let blob = OscType::Blob(vec![1]);
        for (packet, word) in [
            (message("/posefuse/take/begin", vec![]), START),
            (message(START, vec![blob.clone()]), "one number"),
            (
                message(START, vec![OscType::String("a".into()), blob]),
                "as words",
            ),
            (
                message(START, vec![OscType::String("a".into()); 4]),
                "at most three",
            ),
        ] {
            let problem = read(&packet).unwrap_err();
            assert!(problem.contains(word), "{problem}");
        }
        for bytes in [
            &b""[..],
            b"GET / HTTP/1.1",
            b"/posefuse/take/start\0\0\0\0,s\0\0nam",
            &[0xff; 700],
        ] {
            assert!(orders(bytes).is_err(), "{bytes:?}");
        }
    }
}
