//! `Watch`, `WatchSensors` and `WatchDepth` without encoding a message once per subscriber: they are served ahead of the
//! generated service, from bytes that were encoded once.

use std::convert::Infallible;
use std::marker::PhantomData;
use std::pin::Pin;

use bytes::{BufMut, Bytes};
use futures_util::Stream;
use futures_util::future::BoxFuture;
use http::{Request, Response};
use prost::Message;
use tonic::Status;
use tonic::body::Body;
use tonic::codec::{Codec, DecodeBuf, Decoder, EncodeBuf, Encoder};
use tonic::server::{Grpc, ServerStreamingService};
use tower::util::BoxCloneSyncService;

use crate::room::RoomService;

/// Encoded messages for one subscriber.
pub(crate) type EncodedStream = Pin<Box<dyn Stream<Item = Result<Bytes, Status>> + Send>>;

type Service = BoxCloneSyncService<Request<Body>, Response<Body>, Infallible>;

/// Serves `Room.Watch`.
pub(super) fn watch(room: RoomService) -> Service {
    serve(move |request| {
        let room = room.clone();
        Box::pin(async move { room.open_watch(request) })
    })
}

/// Serves `Room.WatchSensors`.
pub(super) fn watch_sensors(room: RoomService) -> Service {
    serve(move |request| {
        let room = room.clone();
        Box::pin(async move { room.open_watch_sensors(request) })
    })
}

/// Serves `Room.WatchDepth`.
pub(super) fn watch_depth(room: RoomService) -> Service {
    serve(move |request| {
        let room = room.clone();
        Box::pin(async move { room.open_watch_depth(request) })
    })
}

type Opened = BoxFuture<'static, Result<EncodedStream, Status>>;

fn serve<Q, F>(open: F) -> Service
where
    Q: Message + Default + 'static,
    F: Fn(tonic::Request<Q>) -> Opened + Clone + Send + Sync + 'static,
{
    let service = tower::service_fn(move |request: Request<Body>| {
        let method = Method(open.clone(), PhantomData);
        async move {
            let mut grpc = Grpc::new(RawCodec(PhantomData));
            Ok::<_, Infallible>(grpc.server_streaming(method, request).await)
        }
    });
    BoxCloneSyncService::new(service)
}

struct Method<F, Q>(F, PhantomData<fn(Q)>);

impl<F, Q> ServerStreamingService<Q> for Method<F, Q>
where
    F: Fn(tonic::Request<Q>) -> Opened,
{
    type Response = Bytes;
    type ResponseStream = EncodedStream;
    type Future = BoxFuture<'static, Result<tonic::Response<EncodedStream>, Status>>;

    fn call(&mut self, request: tonic::Request<Q>) -> Self::Future {
        let opened = (self.0)(request);
        Box::pin(async move { opened.await.map(tonic::Response::new) })
    }
}

/// Decodes `Q`, sends bytes as they are.
struct RawCodec<Q>(PhantomData<fn(Q)>);

impl<Q: Message + Default + 'static> Codec for RawCodec<Q> {
    type Encode = Bytes;
    type Decode = Q;
    type Encoder = RawEncoder;
    type Decoder = RawDecoder<Q>;

    fn encoder(&mut self) -> RawEncoder {
        RawEncoder
    }

    fn decoder(&mut self) -> RawDecoder<Q> {
        RawDecoder(PhantomData)
    }
}

struct RawEncoder;

impl Encoder for RawEncoder {
    type Item = Bytes;
    type Error = Status;

    fn encode(&mut self, message: Bytes, buffer: &mut EncodeBuf<'_>) -> Result<(), Status> {
        buffer.reserve(message.len());
        buffer.put(message);
        Ok(())
    }
}

struct RawDecoder<Q>(PhantomData<fn(Q)>);

impl<Q: Message + Default> Decoder for RawDecoder<Q> {
    type Item = Q;
    type Error = Status;

    fn decode(&mut self, buffer: &mut DecodeBuf<'_>) -> Result<Option<Q>, Status> {
        Q::decode(buffer)
            .map(Some)
            .map_err(|error| Status::invalid_argument(error.to_string()))
    }
}

/// Decodes what a subscriber gets, for callers inside the program.
pub(crate) fn decoded<M: Message + Default>(bytes: Result<Bytes, Status>) -> Result<M, Status> {
    M::decode(bytes?).map_err(|error| Status::internal(error.to_string()))
}
