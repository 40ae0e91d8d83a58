//! The thread that runs the model: takes what waits in its queue, fills it in one call, and gives the answers to the
//! engine as inputs.

use std::sync::Arc;
use std::time::Duration;

use posefuse_fusion::{Input, RepairAnswer, RepairRequest};
use posefuse_models::{Ask, NeuralModel};
use tokio::sync::mpsc;

use super::{Meter, Repair};
use crate::fusion_thread::Inputs;
use crate::{Clock, ServerError, Threads};

/// Windows that may wait: two frames of a full room. When there is no room the newest is not asked, and counted as late.
const QUEUE: usize = 64;

/// The fusion thread's side of the queue.
pub(crate) struct Requests {
    queue: Option<mpsc::Sender<Box<RepairRequest>>>,
    meter: Arc<Meter>,
}

impl Requests {
    /// Asks; never waits.
    pub(crate) fn ask(&self, request: Box<RepairRequest>) {
        let asked = self.queue.as_ref().map(|queue| queue.try_send(request));
        let late = u64::from(!matches!(asked, Some(Ok(()))));
        self.meter.count(|view| {
            view.requests += 1;
            view.late += late;
        });
    }
}

/// Starts the thread where there is a model to run.
pub(crate) fn start(
    repair: Repair,
    inputs: Inputs,
    clock: Arc<dyn Clock>,
    threads: Threads,
) -> Result<(Requests, Arc<Meter>), ServerError> {
    let meter = Arc::new(Meter::new(repair.about));
    let queue = match repair.model {
        Some(model) => {
            let (queue, requests) = mpsc::channel(QUEUE);
            let worker = Worker {
                model,
                inputs,
                clock,
                meter: meter.clone(),
                told: false,
            };
            // It ends when the fusion thread has let go of the queue.
            let _ended = threads.spawn("repair", worker.work(requests))?;
            Some(queue)
        }
        None => None,
    };
    let requests = Requests {
        queue,
        meter: meter.clone(),
    };
    Ok((requests, meter))
}

struct Worker {
    model: NeuralModel,
    inputs: Inputs,
    clock: Arc<dyn Clock>,
    meter: Arc<Meter>,
    /// A failure was told of in the log.
    told: bool,
}

impl Worker {
    async fn work(mut self, mut requests: mpsc::Receiver<Box<RepairRequest>>) {
        let mut waiting = Vec::with_capacity(QUEUE);
        while requests.recv_many(&mut waiting, QUEUE).await > 0 {
            let now = self.clock.now();
            let count = waiting.len();
            waiting.retain(|request| request.deadline > now);
            let late = (count - waiting.len()) as u64;
            self.meter.count(|view| view.late += late);
            for answer in self.answer(&waiting) {
                if self
                    .inputs
                    .send(Input::Repaired(Box::new(answer)))
                    .await
                    .is_err()
                {
                    return;
                }
            }
            waiting.clear();
        }
    }

    /// The answers that are in time; one that says that the model failed where it did.
    fn answer(&mut self, requests: &[Box<RepairRequest>]) -> Vec<RepairAnswer> {
        let asks: Vec<Ask> = requests
            .iter()
            .map(|request| Ask {
                window: &request.window,
                wanted: request.wanted.clone(),
            })
            .collect();
        let filled = self.model.fill_all(&asks);
        let received = self.clock.now();
        let mut answers = Vec::with_capacity(requests.len());
        for (request, filled) in requests.iter().zip(filled) {
            let fills = filled.unwrap_or_else(|error| {
                self.failed(&error);
                Vec::new()
            });
            if received >= request.deadline {
                self.meter.count(|view| view.late += 1);
                continue;
            }
            if !fills.is_empty() {
                let after_ns = received.since_ns(request.asked).max(0);
                self.meter.answered(Duration::from_nanos(after_ns as u64));
            }
            answers.push(RepairAnswer {
                number: request.number,
                received,
                fills,
            });
        }
        answers
    }

    fn failed(&mut self, error: &posefuse_fusion::ModelError) {
        self.meter.count(|view| view.failed += 1);
        if !std::mem::replace(&mut self.told, true) {
            tracing::warn!(%error, "the simple model answers; told once");
        }
    }
}
