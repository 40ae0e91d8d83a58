//! Where frames end, whenever the sender says so.

use posefuse_skeleton::{Confidence, Position};

use super::*;

const GAP_NS: i64 = 8_000_000;

/// How many people there are in each frame of what is said at these moments, nanoseconds; a silence follows it.
fn people(said: &[(i64, Option<u64>, Said)]) -> Vec<usize> {
    let mut gather = Gather::new(25, GAP_NS);
    for (at_ns, tag, said) in said {
        gather.idle(*at_ns);
        gather.hear(said.clone(), *tag, *at_ns);
    }
    gather.idle(said.last().unwrap().0 + GAP_NS);
    std::iter::from_fn(|| gather.next())
        .map(|frame| frame.bodies.len())
        .collect()
}

fn seen(person: u64, joint: usize) -> Said {
    let raw = RawJoint {
        position: Position::new(0.1, 0.0, 2.0),
        confidence: Confidence::FULL,
    };
    Said::Joint(person, joint, Some(raw))
}

#[test]
fn the_end_of_a_frame_told_outside_of_its_bundle_ends_that_frame() {
    let frame = |at_ns, tag: u64| {
        [
            (at_ns, Some(tag), seen(1, 0)),
            (at_ns, Some(tag), seen(2, 0)),
            (at_ns, None, Said::Lost(2)),
            (at_ns, None, Said::EndOfFrame),
        ]
    };
    let two = [frame(0, 100), frame(1, 101)].concat();
    assert_eq!(people(&two), [1, 1]);
    let empty = (2, None, Said::EndOfFrame);
    assert_eq!(people(&[two, vec![empty]].concat()), [1, 1, 0]);
}

#[test]
fn the_end_of_a_frame_that_has_ended_is_no_empty_frame_and_the_next_is() {
    let period_ns = 4 * GAP_NS;
    let late: Vec<_> = (0..3)
        .flat_map(|n| {
            let at_ns = n * period_ns;
            let end = (at_ns + 2 * GAP_NS, None, Said::EndOfFrame);
            [(at_ns, None, seen(1, 0)), (at_ns, None, seen(1, 1)), end]
        })
        .collect();
    assert_eq!(people(&late), [1, 1, 1], "told after a pause");
    let gone = (3 * period_ns, None, Said::EndOfFrame);
    assert_eq!(people(&[late, vec![gone]].concat()), [1, 1, 1, 0]);

    let first: Vec<_> = (1..4)
        .flat_map(|n| {
            let at_ns = n * period_ns;
            [(at_ns, None, Said::EndOfFrame), (at_ns, None, seen(1, 0))]
        })
        .collect();
    assert_eq!(people(&first), [0, 1, 1, 1], "told before each frame");

    let repeated = [
        (0, None, seen(1, 0)),
        (1, None, seen(1, 0)),
        (2, None, Said::EndOfFrame),
        (3, None, Said::EndOfFrame),
    ];
    assert_eq!(people(&repeated), [1, 1, 0], "a joint came again");
}
