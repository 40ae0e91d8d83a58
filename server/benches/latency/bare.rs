//! The references: the same messages over tonic with nothing behind it.

use std::convert::Infallible;
use std::net::SocketAddr;
use std::pin::Pin;
use std::time::Duration;

use futures_util::Stream;
use futures_util::future::BoxFuture;
use http::uri::PathAndQuery;
use posefuse_proto::v1;
use posefuse_proto::v1::ingest_server::{Ingest, IngestServer};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::mpsc;
use tokio_stream::wrappers::{ReceiverStream, TcpListenerStream};
use tonic::server::StreamingService;
use tonic::service::AxumBody;
use tonic::transport::{Channel, Server};
use tonic::{Request, Response, Status, Streaming};
use tonic_prost::ProstCodec;

type Out<T> = Pin<Box<dyn Stream<Item = Result<T, Status>> + Send>>;

/// Takes the agents' messages, looks at nothing, acknowledges ten times a second.
struct BareIngest;

#[tonic::async_trait]
impl Ingest for BareIngest {
    type StreamStream = ReceiverStream<Result<v1::ServerMessage, Status>>;

    async fn stream(
        &self,
        request: Request<Streaming<v1::AgentMessage>>,
    ) -> Result<Response<Self::StreamStream>, Status> {
        let mut up = request.into_inner();
        let (down, queue) = mpsc::channel(16);
        tokio::spawn(async move {
            let mut beat = tokio::time::interval(Duration::from_millis(50));
            let mut last = None;
            loop {
                tokio::select! {
                    biased;
                    _ = beat.tick() => {
                        let Some(sequence) = last else { continue };
                        let ack = v1::server_message::Message::Ack(v1::Ack { sequence });
                        let _ = down.try_send(Ok(v1::ServerMessage { message: Some(ack) }));
                    }
                    message = up.message() => match message {
                        Ok(Some(message)) => if let Some(v1::agent_message::Message::Frame(frame)) = message.message {
                            last = Some(frame.sequence);
                        },
                        _ => return,
                    }
                }
            }
        });
        Ok(Response::new(ReceiverStream::new(queue)))
    }
}

async fn listen() -> (SocketAddr, impl Stream<Item = std::io::Result<TcpStream>>) {
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = listener.local_addr().unwrap();
    let connections = tokio_stream::StreamExt::map(TcpListenerStream::new(listener), |stream| {
        let stream = stream?;
        stream.set_nodelay(true)?;
        Ok(stream)
    });
    (address, connections)
}

pub(crate) async fn ingest() -> SocketAddr {
    let (address, connections) = listen().await;
    let server = Server::builder().add_service(IngestServer::new(BareIngest));
    tokio::spawn(server.serve_with_incoming(connections));
    address
}

/// Gives back what it gets.
#[derive(Clone)]
struct EchoMethod;

impl StreamingService<v1::Frame> for EchoMethod {
    type Response = v1::Frame;
    type ResponseStream = Out<v1::Frame>;
    type Future = BoxFuture<'static, Result<Response<Out<v1::Frame>>, Status>>;

    fn call(&mut self, request: Request<Streaming<v1::Frame>>) -> Self::Future {
        let frames: Out<v1::Frame> = Box::pin(request.into_inner());
        Box::pin(async move { Ok(Response::new(frames)) })
    }
}

/// A client of the echo.
pub(crate) struct Echo {
    up: mpsc::Sender<v1::Frame>,
    down: Streaming<v1::Frame>,
}

impl Echo {
    pub(crate) async fn round_trip(&mut self, frame: v1::Frame) {
        self.up.send(frame).await.unwrap();
        self.down.message().await.unwrap().unwrap();
    }
}

pub(crate) async fn echo() -> Echo {
    let (address, connections) = listen().await;
    let service = tower::service_fn(|request: http::Request<AxumBody>| async move {
        let mut grpc = tonic::server::Grpc::new(ProstCodec::default());
        Ok::<_, Infallible>(grpc.streaming(EchoMethod, request).await)
    });
    let router = axum::Router::new().route_service("/bare.Echo/Stream", service);
    let server = Server::builder().add_routes(tonic::service::Routes::from(router));
    tokio::spawn(server.serve_with_incoming(connections));
    let channel = Channel::from_shared(format!("http://{address}")).unwrap();
    let mut client = tonic::client::Grpc::new(channel.connect().await.unwrap());
    client.ready().await.unwrap();
    let (up, queue) = mpsc::channel(16);
    let path = PathAndQuery::from_static("/bare.Echo/Stream");
    let codec = ProstCodec::<v1::Frame, v1::Frame>::default();
    let request = Request::new(ReceiverStream::new(queue));
    let down = client
        .streaming(request, path, codec)
        .await
        .unwrap()
        .into_inner();
    Echo { up, down }
}
