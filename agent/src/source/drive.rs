//! Runs a source, on a named thread or as part of the agent's task.

use std::time::Duration;

use tokio::sync::mpsc;

use super::{SensorSource, SourceError, SourceFrame};

/// Frames that a source may be ahead. When they wait, the source waits too.
const AHEAD: usize = 8;
/// Pause before a source in trouble is asked again.
const RETRY: Duration = Duration::from_secs(1);

/// What comes out of a source.
#[derive(Debug)]
pub(crate) enum SourceEvent {
    Frame(SourceFrame),
    Trouble(String),
    Failed(String),
    Ended,
}

fn event(source: &mut dyn SensorSource) -> SourceEvent {
    match source.next_frame() {
        Ok(Some(frame)) => SourceEvent::Frame(frame),
        Ok(None) => SourceEvent::Ended,
        Err(SourceError::Trouble(why)) => SourceEvent::Trouble(why),
        Err(SourceError::Final(why)) => SourceEvent::Failed(why),
    }
}

/// Runs the source on a thread called `source-NAME` until it ends or the receiver is gone.
pub(crate) fn on_thread(
    mut source: Box<dyn SensorSource>,
    name: &str,
) -> std::io::Result<mpsc::Receiver<SourceEvent>> {
    let (events, receiver) = mpsc::channel(AHEAD);
    let body = move || loop {
        let event = event(source.as_mut());
        let last = matches!(event, SourceEvent::Failed(_) | SourceEvent::Ended);
        let trouble = matches!(event, SourceEvent::Trouble(_));
        if events.blocking_send(event).is_err() || last {
            return;
        }
        if trouble {
            std::thread::sleep(RETRY);
        }
    };
    // The kernel keeps 15 bytes of a thread's name.
    let short: String = format!("source-{name}").chars().take(15).collect();
    std::thread::Builder::new().name(short).spawn(body)?;
    Ok(receiver)
}

/// Runs a source that never blocks within the agent's own task, for simulated time.
pub(crate) async fn inline(mut source: Box<dyn SensorSource>, events: mpsc::Sender<SourceEvent>) {
    loop {
        let event = event(source.as_mut());
        let last = matches!(event, SourceEvent::Failed(_) | SourceEvent::Ended);
        let trouble = matches!(event, SourceEvent::Trouble(_));
        if events.send(event).await.is_err() || last {
            return;
        }
        if trouble {
            tokio::time::sleep(RETRY).await;
        }
    }
}

/// The queue between [`inline`] and the agent.
pub(crate) fn inline_queue() -> (mpsc::Sender<SourceEvent>, mpsc::Receiver<SourceEvent>) {
    mpsc::channel(AHEAD)
}
