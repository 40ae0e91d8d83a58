//! Which runtime runs a model, and whether the model is what its manifest says.
//!
//! `auto` takes the embedded runtime wherever that is quick enough: it needs nothing installed, and no foreign library
//! then lives in the program. ONNX Runtime is loaded only when that may help: the embedded one cannot read the network
//! or is too slow, or another device is wanted.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use super::{Backend, FoundPort, Ports, Runtime, Session, embedded, installed};
use crate::{Axis, BackendChoice, Config, Device, Port, Refused};

/// Calls before and while timing.
const WARM_CALLS: usize = 2;
const TIMED_CALLS: usize = 9;

/// A network that is to be opened, and what is known of it.
pub(crate) struct Candidate<'a> {
    pub(crate) place: &'a str,
    pub(crate) onnx: &'a [u8],
    pub(crate) inputs: &'a BTreeMap<String, Port>,
    pub(crate) outputs: &'a BTreeMap<String, Port>,
    /// Quick enough for one call with one item.
    pub(crate) quick: Duration,
    /// How many items it is tried with, one call for each; the last is timed.
    pub(crate) counts: [usize; 2],
}

/// What a network is tried with before it is used.
pub(crate) trait Trial {
    /// In words.
    fn what(&self) -> &'static str;

    /// Makes `count` items ready to go in.
    fn fill(&mut self, count: usize);

    /// Runs the network on them.
    fn run(&mut self, session: &mut dyn Session, count: usize) -> Result<(), String>;

    /// Whether what came out makes sense.
    fn check(&self) -> Result<(), String>;
}

/// A network with what runs it.
pub(crate) struct Chosen {
    pub(crate) runtime: Runtime,
    pub(crate) why: String,
    /// One call for one item, median.
    pub(crate) latency: Duration,
    /// The quickest: what it costs, whatever else the machine does meanwhile.
    least: Duration,
    pub(crate) session: Box<dyn Session>,
}

/// Opens a network with the configured runtime or the one that suits it best.
pub(crate) fn choose(
    candidate: &Candidate,
    trial: &mut dyn Trial,
    config: &Config,
) -> Result<Chosen, Refused> {
    match (config.backend, config.device) {
        (BackendChoice::Rten, Device::Cpu) => open(&embedded(), candidate, trial, "as configured"),
        (BackendChoice::Rten, device) => Err(Refused::Network {
            place: candidate.place.to_owned(),
            runtime: "rten".to_owned(),
            problem: format!(
                "it computes on processors only, and models.device is {}",
                device.name()
            ),
        }),
        (BackendChoice::Ort, _) => open(&installed(config)?, candidate, trial, "as configured"),
        (BackendChoice::Auto, Device::Cpu) => best(candidate, trial, config),
        (BackendChoice::Auto, device) => {
            let why = format!("models.device is {}", device.name());
            open(&installed(config)?, candidate, trial, &why)
        }
    }
}

fn best(candidate: &Candidate, trial: &mut dyn Trial, config: &Config) -> Result<Chosen, Refused> {
    let quick = candidate.quick;
    let limit = quick.as_millis();
    let built_in = open(
        &embedded(),
        candidate,
        trial,
        "part of the program and quick enough",
    );
    let slow = match built_in {
        Ok(chosen) if chosen.least <= quick => return Ok(chosen),
        // What is wrong with the model is wrong everywhere.
        Err(error) if !matches!(error, Refused::Network { .. }) => return Err(error),
        slow => slow,
    };
    let other = installed(config).map_err(Refused::from);
    let other = other.and_then(|other| {
        let why = match &slow {
            Ok(slow) => format!("rten needs {:.1} ms, more than {limit}", ms(slow.least)),
            Err(_) => "rten cannot use the network".to_owned(),
        };
        open(&other, candidate, trial, &why)
    });
    match (slow, other) {
        (Ok(slow), Ok(other)) if other.least < slow.least => Ok(other),
        (Err(_), Ok(other)) => Ok(other),
        (Ok(slow), Ok(other)) => Ok(Chosen {
            why: format!("quicker than {} ({:.1} ms)", other.runtime, ms(other.least)),
            ..slow
        }),
        (Ok(slow), Err(error)) => Ok(Chosen {
            why: format!("slower than the {limit} ms wished for, but the only one: {error}"),
            ..slow
        }),
        (Err(error), Err(_)) => Err(error),
    }
}

fn open(
    backend: &dyn Backend,
    candidate: &Candidate,
    trial: &mut dyn Trial,
    why: &str,
) -> Result<Chosen, Refused> {
    let runtime = backend.about();
    let network = |problem| Refused::Network {
        place: candidate.place.to_owned(),
        runtime: runtime.to_string(),
        problem,
    };
    crate::wire::check(candidate.onnx).map_err(network)?;
    let mut session = backend.open(candidate.onnx).map_err(network)?;
    check_ports(candidate, &session.ports()).map_err(|problem| Refused::Ports {
        place: candidate.place.to_owned(),
        problem,
    })?;
    for count in candidate.counts {
        trial.fill(count);
        trial.run(&mut *session, count).map_err(network)?;
        trial.check().map_err(|problem| Refused::Nonsense {
            place: candidate.place.to_owned(),
            tried_on: trial.what(),
            problem,
        })?;
    }
    let [_, count] = candidate.counts;
    let (least, latency) = timed(&mut *session, trial, count).map_err(network)?;
    Ok(Chosen {
        why: why.to_owned(),
        runtime,
        latency,
        least,
        session,
    })
}

/// The least and the median time of a call with `count` items.
fn timed(
    session: &mut dyn Session,
    trial: &mut dyn Trial,
    count: usize,
) -> Result<(Duration, Duration), String> {
    for _ in 0..WARM_CALLS {
        trial.run(session, count)?;
    }
    let mut times = [Duration::ZERO; TIMED_CALLS];
    for time in &mut times {
        let began = Instant::now();
        trial.run(session, count)?;
        *time = began.elapsed();
    }
    times.sort();
    Ok((times[0], times[TIMED_CALLS / 2]))
}

fn ms(duration: Duration) -> f64 {
    duration.as_secs_f64() * 1e3
}

fn check_ports(candidate: &Candidate, found: &Ports) -> Result<(), String> {
    let sides = [
        ("input", candidate.inputs, &found.inputs),
        ("output", candidate.outputs, &found.outputs),
    ];
    for (side, expected, found) in sides {
        for (name, port) in expected {
            let found = found
                .iter()
                .find(|found| found.name == *name)
                .ok_or_else(|| format!("the network has no {side} `{name}`"))?;
            check_port(port, found).map_err(|problem| format!("{side} `{name}` {problem}"))?;
        }
        let unknown = found.iter().find(|port| !expected.contains_key(&port.name));
        if let Some(unknown) = unknown.filter(|_| side == "input") {
            let name = &unknown.name;
            return Err(format!(
                "the network wants an input `{name}` that the manifest does not name"
            ));
        }
    }
    Ok(())
}

fn check_port(expected: &Port, found: &FoundPort) -> Result<(), String> {
    if !found.is_f32 {
        return Err("is not of 32-bit floats".to_owned());
    }
    // What the file leaves open shows when it runs.
    let Some(shape) = &found.shape else {
        return Ok(());
    };
    let fits = |(expected, found): (&Axis, &Option<usize>)| match (expected, found) {
        (Axis::Length(expected), Some(found)) => expected == found,
        (Axis::Named(_), Some(_)) => false,
        (_, None) => true,
    };
    if shape.len() == expected.shape.len() && expected.shape.iter().zip(shape).all(fits) {
        return Ok(());
    }
    let axes = shape
        .iter()
        .map(|axis| axis.map_or("any".to_owned(), |length| length.to_string()));
    let axes: Vec<String> = axes.collect();
    Err(format!(
        "is {} in the network, {} in the manifest",
        axes.join(" x "),
        expected.shown()
    ))
}
