//! Bones as `/tf` for ROS 2 with rmw_zenoh: key expressions, liveliness tokens and attachments as its design document has them
//! (<https://github.com/ros2/rmw_zenoh/blob/rolling/docs/design.md>), messages in CDR. The room's axes are those of REP 103.

use posefuse_proto::foxglove::Child;
use zenoh::Session;
use zenoh::bytes::Encoding;
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::Publisher;

use super::publish::publisher;
use crate::LiveFrame;
use crate::bone_frames::bones_of;

const TYPE: &str = "tf2_msgs::msg::dds_::TFMessage_";
/// REP 2016's hash of the message's definition, of ROS 2 Iron and later.
const TYPE_HASH: &str = "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087";
/// Reliable, volatile, the last 100 kept; the rest as by default.
const QOS: &str = "::,100:,:,:,,";

/// A publisher of `/tf` as ROS 2 sees it.
pub(super) struct Ros {
    publisher: Publisher<'static>,
    /// The node and its publisher are in ROS's graph as long as these are.
    _tokens: [LivelinessToken; 2],
    sequence: i64,
    /// Which publisher it is: unique in the world.
    gid: [u8; 16],
}

impl Ros {
    pub(super) async fn open(session: &Session, domain: u32) -> zenoh::Result<Self> {
        let id = session.zid();
        let node = format!("@ros2_lv/{domain}/{id}/0/0/NN/%/%/posefuse");
        let tf = format!("@ros2_lv/{domain}/{id}/0/1/MP/%/%/posefuse/%tf/{TYPE}/{TYPE_HASH}/{QOS}");
        let key = format!("{domain}/tf/{TYPE}/{TYPE_HASH}");
        Ok(Self {
            publisher: publisher(session, key, Encoding::default()).await?,
            _tokens: [
                session.liveliness().declare_token(node).await?,
                session.liveliness().declare_token(tf).await?,
            ],
            sequence: 0,
            gid: id.to_le_bytes(),
        })
    }

    /// Sends the bones of everybody who has a body; nothing while nobody has.
    pub(super) async fn put(&mut self, frame: &LiveFrame) -> zenoh::Result<()> {
        if frame.figures.is_empty() {
            return Ok(());
        }
        self.sequence += 1;
        let bones: Vec<Child> = frame.figures.iter().flat_map(bones_of).collect();
        let put = self.publisher.put(tf_message(&bones, frame.unix_ns));
        put.attachment(self.attachment(frame.unix_ns)).await
    }

    fn attachment(&self, unix_ns: i64) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(33);
        bytes.extend(self.sequence.to_le_bytes());
        bytes.extend(unix_ns.to_le_bytes());
        bytes.push(self.gid.len() as u8);
        bytes.extend(self.gid);
        bytes
    }
}

/// A `tf2_msgs/msg/TFMessage`.
fn tf_message(children: &[Child], unix_ns: i64) -> Vec<u8> {
    let mut cdr = Cdr::new();
    cdr.u32(children.len() as u32);
    for child in children {
        cdr.u32(unix_ns.div_euclid(1_000_000_000) as u32);
        cdr.u32(unix_ns.rem_euclid(1_000_000_000) as u32);
        cdr.text(&child.parent);
        cdr.text(&child.name);
        let (at, turn) = (child.origin, child.rotation);
        for value in [at.x, at.y, at.z, turn.i, turn.j, turn.k, turn.w] {
            cdr.f64(value);
        }
    }
    cdr.0
}

/// Plain CDR, little-endian: values stand at multiples of their size, counted from after the four bytes of the header.
struct Cdr(Vec<u8>);

impl Cdr {
    const HEADER: [u8; 4] = [0, 1, 0, 0];

    fn new() -> Self {
        Self(Self::HEADER.to_vec())
    }

    fn align(&mut self, size: usize) {
        let filled = self.0.len() - Self::HEADER.len();
        let length = self.0.len() + filled.next_multiple_of(size) - filled;
        self.0.resize(length, 0);
    }

    fn u32(&mut self, value: u32) {
        self.align(4);
        self.0.extend(value.to_le_bytes());
    }

    fn f64(&mut self, value: f64) {
        self.align(8);
        self.0.extend(value.to_le_bytes());
    }

    /// With its length, and a zero byte at the end that counts.
    fn text(&mut self, text: &str) {
        self.u32(text.len() as u32 + 1);
        self.0.extend(text.as_bytes());
        self.0.push(0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_aligned_and_texts_end_with_zero() {
        let child = Child {
            name: "abc".to_owned(),
            parent: "room".to_owned(),
            origin: nalgebra::Vector3::new(1.0, 2.0, 3.0),
            rotation: nalgebra::UnitQuaternion::identity(),
        };
        let bytes = tf_message(&[child], 5_000_000_007);
        // Header, count, seconds, nanoseconds, 5 + "room\0" + 3 to align, 4 + "abc\0", then from 32 seven doubles.
        let word = |at: usize| {
            u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
        };
        assert_eq!([word(4), word(8), word(12), word(16)], [1, 5, 7, 5]);
        assert_eq!(&bytes[20..28], b"room\0\0\0\0");
        assert_eq!(word(28), 4);
        assert_eq!(&bytes[32..36], b"abc\0");
        assert_eq!(bytes.len(), 36 + 56);
        assert_eq!(bytes[36..44], 1f64.to_le_bytes());
        assert_eq!(bytes[84..92], 1f64.to_le_bytes());
    }
}
