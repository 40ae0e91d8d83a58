//! A UDP port on which other programs start and stop takes.

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use tokio::net::UdpSocket;

use super::{Order, Way, capture, osc};
use crate::room::Room;

/// Longest packet that is read; what is longer is cut off and then refused.
const LONGEST: usize = 8192;
/// A port that could not be opened is tried again after this.
const WAIT: Duration = Duration::from_secs(5);

/// Opens the port and obeys what comes, until the server stops. One order at a time: the system's queue holds further ones.
pub(super) async fn listen(room: Arc<Room>, way: Way, address: SocketAddr) {
    // Outlives the port: a stop must be known for that of a start that came before it was opened anew.
    let mut captures = capture::Captures::default();
    loop {
        let result = tokio::select! {
            () = room.stop.cancelled() => return,
            result = obey(&room, way, address, &mut captures) => result,
        };
        let Err(error) = result;
        let trouble = match error.kind() {
            io::ErrorKind::AddrInUse => format!(
                "port {} is in use: end the program that has it, or choose another for `{way}` under `[trigger]`",
                address.port()
            ),
            _ => format!("cannot listen on udp {address}: {error}"),
        };
        tracing::warn!(%way, "{trouble}");
        room.triggers.set_trouble(way, trouble);
        tokio::select! {
            () = room.stop.cancelled() => return,
            () = room.clock.sleep(WAIT) => {}
        }
    }
}

/// What never ends well.
enum Never {}

async fn obey(
    room: &Arc<Room>,
    way: Way,
    address: SocketAddr,
    captures: &mut capture::Captures,
) -> io::Result<Never> {
    let socket = UdpSocket::bind(address).await?;
    tracing::info!(%way, %address, "takes can be started and stopped over UDP");
    room.triggers.set_trouble(way, String::new());
    let mut buffer = vec![0; LONGEST];
    loop {
        let (length, from) = match socket.recv_from(&mut buffer).await {
            Ok(received) => received,
            // What an earlier answer met, as some systems tell: nobody at the other end any more.
            Err(error) if is_of_an_answer(&error) => continue,
            Err(error) => return Err(error),
        };
        let packet = &buffer[..length];
        if way == Way::Capture {
            captures.obey(room, from, packet).await;
        } else {
            for answer in by_osc(room, from, packet).await {
                // Whoever wants no answer does not listen.
                let _ = socket.send_to(&answer, from).await;
            }
        }
    }
}

fn is_of_an_answer(error: &io::Error) -> bool {
    use io::ErrorKind::{ConnectionRefused, ConnectionReset};
    matches!(error.kind(), ConnectionRefused | ConnectionReset)
}

/// Carries out an OSC packet's orders; the answers to its sender.
async fn by_osc(room: &Arc<Room>, from: SocketAddr, packet: &[u8]) -> Vec<Vec<u8>> {
    let orders = match osc::orders(packet) {
        Ok(orders) => orders,
        // Not answered: who sent it may take the answer for something else.
        Err(problem) => {
            room.not_an_order(Way::Osc, problem);
            return Vec::new();
        }
    };
    let mut answers = Vec::new();
    for order in orders {
        answers.push(match order {
            Ok(order) => obeyed(room, from, order).await,
            Err(problem) => {
                let answer = osc::answer("error", &problem);
                room.not_an_order(Way::Osc, problem);
                answer
            }
        });
    }
    answers
}

/// Carries out one order; the answer.
async fn obeyed(room: &Arc<Room>, from: SocketAddr, order: Order) -> Vec<u8> {
    let what = match order {
        Order::Start(_) => "started",
        Order::Stop => "stopped",
    };
    match room.order(Way::Osc, Some(from), order).await {
        Ok(take) => osc::answer(what, &take.name),
        Err(status) => osc::answer("error", status.message()),
    }
}
