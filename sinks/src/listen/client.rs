//! One client, from its request to its end.

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::{Duration, Instant};

use futures_util::{SinkExt, StreamExt};
use tokio::net::TcpStream;
use tokio_tungstenite::tungstenite::handshake::server::{ErrorResponse, Request, Response};
use tokio_tungstenite::tungstenite::http::{HeaderValue, StatusCode, header};
use tokio_tungstenite::tungstenite::protocol::WebSocketConfig;
use tokio_tungstenite::tungstenite::{Bytes, Message};
use tokio_tungstenite::{WebSocketStream, accept_hdr_async_with_config};

use super::door::refusal;
use super::house::{House, Place};
use super::{Asked, Talk, Welcome};

/// Whoever has not said by then what they want is let go.
const HANDSHAKE: Duration = Duration::from_secs(4);
/// Whoever takes nothing for so long is cut.
const CUT_AFTER: Duration = Duration::from_secs(5);
/// How often a client is asked whether it is there.
const HEARTBEAT: Duration = Duration::from_secs(1);
/// Largest message that a client may send, bytes.
const LONGEST_HEARD: usize = 64 << 10;
/// More than any message that is written, bytes.
const LONGEST_SAID: usize = 8 << 20;

/// Serves one connection.
pub(super) async fn attend<T: Talk>(house: Arc<House<T>>, stream: TcpStream, peer: SocketAddr) {
    // Without it a frame may wait for the client's answer to the one before.
    let _ = stream.set_nodelay(true);
    let Ok(Some(guest)) = tokio::time::timeout(HANDSHAKE, Guest::receive(house, stream)).await
    else {
        return;
    };
    tracing::info!(%peer, "a client came");
    let why = guest.stay().await;
    tracing::info!(%peer, why, "a client went");
}

struct Guest<T: Talk> {
    house: Arc<House<T>>,
    place: Place<T>,
    client: T::Client,
    socket: WebSocketStream<TcpStream>,
    greeting: Vec<Message>,
    /// When it last showed that it is there.
    alive: Instant,
}

impl<T: Talk> Guest<T> {
    #[allow(clippy::result_large_err, reason = "the library wants whole answers")]
    async fn receive(house: Arc<House<T>>, stream: TcpStream) -> Option<Self> {
        let mut let_in = None;
        let config = WebSocketConfig::default()
            .read_buffer_size(4 << 10)
            .write_buffer_size(0)
            .max_write_buffer_size(LONGEST_SAID)
            .max_message_size(Some(LONGEST_HEARD))
            .max_frame_size(Some(LONGEST_HEARD));
        let answer = |request: &Request, response: Response| match ask(&house, request) {
            Ok((place, welcome)) => {
                let response = agree(response, welcome.protocol);
                let_in = Some((place, welcome));
                Ok(response)
            }
            Err(refused) => {
                tracing::warn!(reason = refused.body().as_deref(), "a client was refused");
                Err(*refused)
            }
        };
        let socket = accept_hdr_async_with_config(stream, answer, Some(config)).await;
        let socket = socket
            .inspect_err(|error| tracing::debug!(%error, "no WebSocket client"))
            .ok()?;
        let (place, welcome) = let_in?;
        Some(Self {
            house,
            place,
            client: welcome.client,
            socket,
            greeting: welcome.greeting,
            alive: Instant::now(),
        })
    }

    /// Until the client goes or is cut; says why.
    async fn stay(mut self) -> &'static str {
        let greeting = std::mem::take(&mut self.greeting);
        match self.turns(greeting).await {
            Ok(never) => match never {},
            Err(why) => why,
        }
    }

    async fn turns(
        &mut self,
        greeting: Vec<Message>,
    ) -> Result<std::convert::Infallible, &'static str> {
        let mut heartbeat = tokio::time::interval(HEARTBEAT);
        heartbeat.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
        self.say(greeting).await?;
        loop {
            tokio::select! {
                heard = self.socket.next() => {
                    let answers = self.hear(heard)?;
                    self.say(answers).await?;
                }
                frame = self.place.frames.next() => {
                    let messages = self.house.talk.tell(&mut self.client, &frame);
                    if !messages.is_empty() {
                        self.say(messages).await?;
                        self.house.meter.sent(self.house.talk.live(&frame));
                    }
                }
                _ = heartbeat.tick() => {
                    if self.alive.elapsed() > CUT_AFTER {
                        return Err("it took nothing for 5 s");
                    }
                    self.say(vec![Message::Ping(Bytes::new())]).await?;
                }
            }
        }
    }

    fn hear<E>(&mut self, heard: Option<Result<Message, E>>) -> Result<Vec<Message>, &'static str> {
        let Some(heard) = heard else {
            return Err("it ended the connection");
        };
        let message = heard
            .map_err(|_| "the connection broke, or what it said was too long or no WebSocket")?;
        self.alive = Instant::now();
        Ok(match message {
            Message::Text(text) => self.house.talk.hear(&mut self.client, &text),
            // The answer to `Close` goes out with the next reading.
            _ => Vec::new(),
        })
    }

    async fn say(&mut self, messages: Vec<Message>) -> Result<(), &'static str> {
        let began = Instant::now();
        for message in messages {
            match tokio::time::timeout(CUT_AFTER, self.socket.send(message)).await {
                Ok(Ok(())) => {}
                Ok(Err(_)) => return Err("the connection broke"),
                Err(_) => return Err("it took nothing for 5 s"),
            }
        }
        // It was slow, and took something; what it said meanwhile was not read yet.
        if began.elapsed() > HEARTBEAT {
            self.alive = Instant::now();
        }
        Ok(())
    }
}

type Admitted<T> = (Place<T>, Welcome<<T as Talk>::Client>);

fn ask<T: Talk>(
    house: &Arc<House<T>>,
    request: &Request,
) -> Result<Admitted<T>, Box<ErrorResponse>> {
    let headers = request.headers();
    if let Some(why) = refusal(headers, &house.door.allowed_origins) {
        return Err(no(StatusCode::FORBIDDEN, why));
    }
    let protocols = headers.get_all(header::SEC_WEBSOCKET_PROTOCOL).iter();
    let asked = Asked {
        query: request.uri().query().unwrap_or_default(),
        protocols: protocols
            .filter_map(|value| value.to_str().ok())
            .flat_map(|value| value.split(',').map(str::trim))
            .collect(),
    };
    let welcome = house.talk.welcome(&asked);
    let welcome = welcome.map_err(|expected| no(StatusCode::BAD_REQUEST, &expected))?;
    match house.enter() {
        Some(place) => Ok((place, welcome)),
        None => Err(no(
            StatusCode::SERVICE_UNAVAILABLE,
            "there are as many clients as may be: close one, or raise `max_clients` of the sink",
        )),
    }
}

fn agree(mut response: Response, protocol: Option<&'static str>) -> Response {
    if let Some(protocol) = protocol {
        let value = HeaderValue::from_static(protocol);
        let headers = response.headers_mut();
        headers.insert(header::SEC_WEBSOCKET_PROTOCOL, value);
    }
    response
}

fn no(status: StatusCode, why: &str) -> Box<ErrorResponse> {
    let mut response = ErrorResponse::new(Some(why.to_owned()));
    *response.status_mut() = status;
    Box::new(response)
}
