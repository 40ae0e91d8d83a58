//! Serde for the state of a stream: bit-exact, and checked when it is read back.

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::stream::State;
use crate::{Error, Spec, Stream};

impl<const D: usize> Serialize for Stream<D> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.state().serialize(serializer)
    }
}

impl<'de, const D: usize> Deserialize<'de> for Stream<D> {
    fn deserialize<R: Deserializer<'de>>(deserializer: R) -> Result<Self, R::Error> {
        let state = State::deserialize(deserializer)?;
        Stream::try_from(state).map_err(R::Error::custom)
    }
}

impl<'de> Deserialize<'de> for Spec {
    fn deserialize<R: Deserializer<'de>>(deserializer: R) -> Result<Self, R::Error> {
        #[derive(Deserialize)]
        #[serde(rename = "Spec", deny_unknown_fields)]
        struct Unchecked {
            window: usize,
            order: usize,
            look_ahead: usize,
            derivative: usize,
        }
        let read = Unchecked::deserialize(deserializer)?;
        Spec::new(read.window, read.order, read.look_ahead, read.derivative)
            .map_err(|error: Error| R::Error::custom(error))
    }
}

/// Arrays of any length as a tuple; serde itself stops at 32.
pub(crate) mod array {
    use std::fmt;

    use serde::de::{Error, SeqAccess, Visitor};
    use serde::ser::SerializeTuple;
    use serde::{Deserializer, Serializer};

    pub(crate) fn serialize<S: Serializer, const D: usize>(
        values: &[f64; D],
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        let mut tuple = serializer.serialize_tuple(D)?;
        for value in values {
            tuple.serialize_element(value)?;
        }
        tuple.end()
    }

    pub(crate) fn deserialize<'de, R: Deserializer<'de>, const D: usize>(
        deserializer: R,
    ) -> Result<[f64; D], R::Error> {
        deserializer.deserialize_tuple(D, Components)
    }

    struct Components<const D: usize>;

    impl<'de, const D: usize> Visitor<'de> for Components<D> {
        type Value = [f64; D];

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            write!(f, "{D} numbers")
        }

        fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<[f64; D], A::Error> {
            let mut values = [0.0; D];
            for (found, value) in values.iter_mut().enumerate() {
                *value = seq
                    .next_element()?
                    .ok_or_else(|| A::Error::invalid_length(found, &self))?;
            }
            Ok(values)
        }
    }
}
