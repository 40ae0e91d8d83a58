//! Frames that the server has not acknowledged yet.
//!
//! Every frame that was put in ends in exactly one of three ways: acknowledged, dropped (and counted), or still here.
//! When full, the oldest goes. If it was never sent, it is lost there and then; if it was sent, it is *in doubt*
//! until the server says what it has.

use std::collections::VecDeque;
use std::ops::Range;

use posefuse_proto::v1;
use prost::Message;

/// How much may wait for a server that is away. The oldest frames go first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BufferLimits {
    /// Most frames.
    pub frames: usize,
    /// Most bytes, as encoded.
    pub bytes: usize,
}

impl Default for BufferLimits {
    /// 4096 frames (68 s at 60 frames a second) and 64 MiB.
    fn default() -> Self {
        Self {
            frames: 4096,
            bytes: 64 << 20,
        }
    }
}

/// The resend buffer of one agent.
#[derive(Debug)]
pub(crate) struct ResendBuffer {
    limits: BufferLimits,
    /// Consecutive sequence numbers, the last one is `next - 1`.
    frames: VecDeque<(v1::Frame, usize)>,
    bytes: usize,
    next: u64,
    newest_captured_ns: Option<i64>,
    /// What the present connection sends next; without one, where the last one stopped. What is before it and not
    /// acknowledged may or may not have reached the server.
    cursor: u64,
    /// Sent, evicted, not acknowledged.
    doubt: VecDeque<Range<u64>>,
    dropped: u64,
    acknowledged: u64,
}

impl ResendBuffer {
    pub(crate) fn new(limits: BufferLimits) -> Self {
        Self {
            limits,
            frames: VecDeque::new(),
            bytes: 0,
            next: 0,
            newest_captured_ns: None,
            cursor: 0,
            doubt: VecDeque::new(),
            dropped: 0,
            acknowledged: 0,
        }
    }

    /// Takes a frame in, gives it its sequence number, and makes room for it.
    pub(crate) fn push(&mut self, captured_ns: i64, bodies: Vec<v1::Body>) {
        let frame = v1::Frame {
            sequence: self.next,
            captured_ns,
            bodies,
        };
        let bytes = frame.encoded_len();
        self.next += 1;
        self.newest_captured_ns = Some(captured_ns);
        self.bytes += bytes;
        self.frames.push_back((frame, bytes));
        while self.frames.len() > self.limits.frames
            || (self.bytes > self.limits.bytes && self.frames.len() > 1)
        {
            self.evict();
        }
    }

    fn evict(&mut self) {
        let sequence = self.oldest();
        self.pop();
        if sequence < self.cursor {
            match self.doubt.back_mut() {
                Some(last) if last.end == sequence => last.end += 1,
                _ => self.doubt.push_back(sequence..sequence + 1),
            }
        } else {
            self.dropped += 1;
        }
        self.cursor = self.cursor.max(sequence + 1);
    }

    fn pop(&mut self) {
        if let Some((_, bytes)) = self.frames.pop_front() {
            self.bytes -= bytes;
        }
    }

    /// The number of the first frame that waits for its acknowledgement, or of the next one.
    pub(crate) fn oldest(&self) -> u64 {
        self.next - self.frames.len() as u64
    }

    /// When the latest frame was captured, by the sensor's clock.
    pub(crate) fn newest_captured_ns(&self) -> Option<i64> {
        self.newest_captured_ns
    }

    /// A connection begins; `last` is the highest number that the server has of this run.
    pub(crate) fn welcomed(&mut self, last: Option<u64>) {
        if let Some(last) = last {
            self.acknowledge(last);
        }
        self.dropped += self
            .doubt
            .drain(..)
            .map(|range| range.end - range.start)
            .sum::<u64>();
        self.cursor = self.oldest();
    }

    /// The server has everything up to and including `last`.
    pub(crate) fn acknowledge(&mut self, last: u64) {
        while let Some(range) = self.doubt.front_mut() {
            let known = range.end.min(last.saturating_add(1)).max(range.start);
            self.acknowledged += known - range.start;
            range.start = known;
            if !range.is_empty() {
                break;
            }
            self.doubt.pop_front();
        }
        while !self.frames.is_empty() && self.oldest() <= last {
            self.pop();
            self.acknowledged += 1;
        }
        self.cursor = self.cursor.max(self.oldest());
    }

    /// Whether the present connection has something left to send.
    pub(crate) fn has_unsent(&self) -> bool {
        self.cursor < self.next
    }

    /// The next frame for the present connection.
    pub(crate) fn send_next(&mut self) -> Option<v1::Frame> {
        let index = (self.cursor - self.oldest()) as usize;
        let (frame, _) = self.frames.get(index)?;
        self.cursor += 1;
        Some(frame.clone())
    }

    /// Frames that wait for their acknowledgement.
    pub(crate) fn len(&self) -> usize {
        self.frames.len()
    }

    /// Frames taken in so far.
    pub(crate) fn captured(&self) -> u64 {
        self.next
    }

    /// Frames that are lost for good.
    pub(crate) fn dropped(&self) -> u64 {
        self.dropped
    }

    /// Frames that the server has.
    pub(crate) fn acknowledged(&self) -> u64 {
        self.acknowledged
    }

    /// Frames sent and evicted, of which the server may or may not have taken hold.
    pub(crate) fn in_doubt(&self) -> u64 {
        self.doubt.iter().map(|range| range.end - range.start).sum()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn filled(limit: usize, frames: usize) -> ResendBuffer {
        let mut buffer = ResendBuffer::new(BufferLimits {
            frames: limit,
            bytes: 1 << 20,
        });
        for frame in 0..frames {
            buffer.push(frame as i64, Vec::new());
        }
        buffer
    }

    #[test]
    fn what_was_never_sent_is_lost_at_once_and_what_was_sent_when_the_server_says_so() {
        let mut buffer = filled(4, 6);
        assert_eq!((buffer.len(), buffer.dropped()), (4, 2));
        buffer.welcomed(None);
        let sent: Vec<u64> = std::iter::from_fn(|| buffer.send_next())
            .map(|f| f.sequence)
            .collect();
        assert_eq!(sent, [2, 3, 4, 5]);
        buffer.push(6, Vec::new());
        buffer.push(7, Vec::new());
        assert_eq!(
            (buffer.in_doubt(), buffer.dropped()),
            (2, 2),
            "2 and 3 may have arrived"
        );
        buffer.welcomed(Some(2));
        assert_eq!((buffer.in_doubt(), buffer.dropped()), (0, 3), "3 did not");
        assert_eq!(buffer.send_next().unwrap().sequence, 4);
    }

    #[test]
    fn bytes_are_bounded_too() {
        let mut buffer = ResendBuffer::new(BufferLimits {
            frames: 1000,
            bytes: 1000,
        });
        let body = v1::Body {
            positions: vec![1.0; 75],
            ..Default::default()
        };
        for frame in 0..10 {
            buffer.push(frame, vec![body.clone()]);
        }
        assert!(
            buffer.bytes <= 1000 && buffer.len() == 3,
            "{} bytes, {}",
            buffer.bytes,
            buffer.len()
        );
    }

    #[derive(Clone, Debug)]
    enum Step {
        Push,
        Send,
        Ack(u64),
        Reconnect(u64),
    }

    fn step() -> impl Strategy<Value = Step> {
        prop_oneof![
            4 => Just(Step::Push),
            4 => Just(Step::Send),
            1 => (0..4u64).prop_map(Step::Ack),
            1 => (0..6u64).prop_map(Step::Reconnect),
        ]
    }

    proptest! {
        /// Whatever happens, every frame is accounted for exactly once, and a server that takes only what follows
        /// its last frame has exactly those frames that the agent does not call dropped.
        #[test]
        fn captured_is_delivered_plus_dropped_plus_waiting(steps in prop::collection::vec(step(), 1..400)) {
            let mut buffer = ResendBuffer::new(BufferLimits { frames: 5, bytes: 1 << 20 });
            let mut server: Vec<u64> = Vec::new();
            let mut wire: VecDeque<u64> = VecDeque::new();
            for step in steps {
                match step {
                    Step::Push => buffer.push(0, Vec::new()),
                    Step::Send => wire.extend(buffer.send_next().map(|f| f.sequence)),
                    Step::Ack(behind) => {
                        server.extend(wire.drain(..));
                        if let Some(&last) = server.last() {
                            buffer.acknowledge(last.saturating_sub(behind));
                        }
                    }
                    Step::Reconnect(arrived) => {
                        let arrived = wire.len().min(arrived as usize);
                        server.extend(wire.drain(..arrived));
                        wire.clear();
                        buffer.welcomed(server.last().copied());
                    }
                }
                prop_assert!(buffer.len() <= 5);
                prop_assert_eq!(
                    buffer.captured(),
                    buffer.acknowledged() + buffer.dropped() + buffer.in_doubt() + buffer.len() as u64
                );
                prop_assert!(server.windows(2).all(|pair| pair[0] < pair[1]), "a duplicate or a step back");
            }
            server.extend(wire.drain(..));
            buffer.welcomed(server.last().copied());
            server.extend(std::iter::from_fn(|| buffer.send_next()).map(|f| f.sequence));
            prop_assert_eq!(server.len() as u64 + buffer.dropped(), buffer.captured());
        }
    }
}
