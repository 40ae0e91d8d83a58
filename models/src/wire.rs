//! Whether bytes are built as an ONNX file (a protobuf message, <https://protobuf.dev/programming-guides/encoding>)
//! before a runtime reads them: rten 0.27 never comes back from a number of more than ten bytes.

/// Parts of a model that are messages themselves: each field's number and what may lie in it.
struct Message(&'static [(u64, Message)]);

const LEAF: Message = Message(&[]);
/// Node, initializer, input, output and shape information.
const GRAPH: Message = Message(&[(1, LEAF), (5, LEAF), (11, LEAF), (12, LEAF), (13, LEAF)]);
const MODEL: Message = Message(&[(7, GRAPH), (8, LEAF)]);

/// Checks a whole file.
///
/// # Errors
/// Where it stops being a message, in words.
pub(crate) fn check(onnx: &[u8]) -> Result<(), String> {
    let graph = scan(onnx, &MODEL)
        .map_err(|at| format!("no ONNX file: damaged at byte {at} of {}", onnx.len()))?;
    match graph {
        true => Ok(()),
        false => Err("no ONNX file: there is no graph in it".to_owned()),
    }
}

/// Whether any inner message was met; the error is where the message breaks.
fn scan(bytes: &[u8], message: &Message) -> Result<bool, usize> {
    let mut at = 0;
    let mut met = false;
    while at < bytes.len() {
        let start = at;
        let tag = number(bytes, &mut at).ok_or(start)?;
        let length = match tag & 7 {
            0 => {
                number(bytes, &mut at).ok_or(start)?;
                0
            }
            1 => 8,
            2 => number(bytes, &mut at)
                .and_then(|length| usize::try_from(length).ok())
                .ok_or(start)?,
            5 => 4,
            _ => return Err(start),
        };
        let end = at
            .checked_add(length)
            .filter(|end| *end <= bytes.len())
            .ok_or(start)?;
        if let Some((_, inner)) = message.0.iter().find(|(field, _)| *field == tag >> 3) {
            scan(&bytes[at..end], inner).map_err(|inside| at + inside)?;
            met = true;
        }
        at = end;
    }
    Ok(met)
}

/// A number of up to ten bytes, seven bits each.
fn number(bytes: &[u8], at: &mut usize) -> Option<u64> {
    let mut value = 0;
    for index in 0..10 {
        let byte = *bytes.get(*at)?;
        *at += 1;
        value |= u64::from(byte & 0x7f) << (7 * index);
        if byte < 0x80 {
            return Some(value);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_without_end_and_a_part_longer_than_the_file_are_found() {
        assert!(check(&[0xff; 400]).unwrap_err().contains("byte 0 of 400"));
        assert!(check(b"").unwrap_err().contains("no graph"));
        // Field 8, two bytes long, of which one is there.
        assert!(check(&[0x42, 2, 0]).unwrap_err().contains("byte 0 of 3"));
        // A graph with a node of eleven bytes that is a number without end.
        let mut deep = vec![0x3a, 13, 0x0a, 11];
        deep.extend([0xff; 11]);
        assert!(check(&deep).unwrap_err().contains("byte 4 of 15"));
        assert_eq!(check(&[0x3a, 2, 0x0a, 0]), Ok(()));
    }
}
