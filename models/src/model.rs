//! A network as an occlusion model.

use std::ops::Range;
use std::time::Duration;

use posefuse_fusion::{Fill, ModelError, Needs, OcclusionModel, Window};
use posefuse_skeleton::JointMap;

use crate::backend::{Chosen, Session};
use crate::tensors::Tensors;
use crate::trial;
use crate::windows::{self, Ask, Piece, Sums};
use crate::{Batch, Config, Manifest, ModelFile, Refused, Runtime};

/// Most windows in one call: what a room full of people may ask in one frame.
const MAX_BATCH: usize = 64;

/// Each wanted pose's made up joints, or why there are none.
pub type Filled = Result<Vec<JointMap<Fill>>, ModelError>;

/// A model that is ready to run.
pub struct NeuralModel {
    manifest: Manifest,
    runtime: Runtime,
    why: String,
    latency: Duration,
    session: Box<dyn Session>,
    tensors: Tensors,
    pieces: Vec<Piece>,
}

impl NeuralModel {
    /// Opens a model: chooses what runs it, compares the network with its manifest and tries it on a standing person.
    ///
    /// # Errors
    /// No runtime can use it, or it is not what its manifest says, or it gives nonsense.
    pub fn open(file: &ModelFile, config: &Config) -> Result<Self, Refused> {
        let Chosen {
            runtime,
            why,
            latency,
            session,
            ..
        } = trial::choose(file, config)?;
        Ok(Self {
            tensors: Tensors::of(&file.manifest),
            manifest: file.manifest.clone(),
            runtime,
            why,
            latency,
            session,
            pieces: Vec::new(),
        })
    }

    /// Its manifest.
    pub fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    /// What runs it.
    pub fn runtime(&self) -> &Runtime {
        &self.runtime
    }

    /// Why that runs it, in words.
    pub fn why(&self) -> &str {
        &self.why
    }

    /// One call for one window, median of those it was tried with.
    pub fn latency(&self) -> Duration {
        self.latency
    }

    /// Fills several windows in as few calls as possible; one answer for each. A window that cannot be filled does not
    /// spoil the others.
    pub fn fill_all(&mut self, asks: &[Ask]) -> Vec<Filled> {
        let mut results: Vec<Result<Sums, String>> = asks
            .iter()
            .map(|ask| windows::check(&self.manifest, ask).map(|()| Sums::new(ask)))
            .collect();
        let mut pieces = std::mem::take(&mut self.pieces);
        pieces.clear();
        for (number, ask) in asks.iter().enumerate() {
            if results[number].is_ok() {
                windows::pieces(&self.manifest, number, ask, &mut pieces);
            }
        }
        let at_once = match self.manifest.batch {
            Batch::Fixed(count) => count.max(1),
            Batch::Any(_) => MAX_BATCH,
        };
        for batch in pieces.chunks(at_once) {
            self.run(batch, asks, &mut results);
        }
        self.pieces = pieces;
        let error = |reason| ModelError {
            model: self.manifest.name.clone(),
            reason,
        };
        let fills = |result: Result<Sums, String>| result.map(|sums| sums.fills()).map_err(error);
        results.into_iter().map(fills).collect()
    }

    /// One call.
    fn run(&mut self, batch: &[Piece], asks: &[Ask], results: &mut [Result<Sums, String>]) {
        self.tensors.clear();
        for piece in batch {
            windows::append(&mut self.tensors, asks[piece.ask].window, *piece);
        }
        let n = batch.len();
        let ran = self.tensors.run(&mut *self.session, n);
        for (number, piece) in batch.iter().enumerate() {
            let result = &mut results[piece.ask];
            let added = match (&ran, &mut *result) {
                (Ok(()), Ok(sums)) => sums.add(&self.manifest, &self.tensors, number, *piece),
                (Err(reason), Ok(_)) => Err(reason.clone()),
                (_, Err(_)) => continue,
            };
            if let Err(reason) = added {
                *result = Err(reason);
            }
        }
    }
}

impl OcclusionModel for NeuralModel {
    fn name(&self) -> &str {
        &self.manifest.name
    }

    fn needs(&self) -> Needs {
        self.manifest.needs()
    }

    fn fill(&mut self, window: &Window, wanted: Range<usize>) -> Filled {
        let mut answers = self.fill_all(&[Ask { window, wanted }]);
        answers.pop().unwrap_or_else(|| Ok(Vec::new()))
    }
}
