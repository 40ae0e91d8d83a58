//! What can fill in joints that no sensor sees, and what runs it.

use posefuse_fusion::SimpleModel;
use posefuse_models::{
    BackendChoice, Config, Kind, Library, ModelFile, NeuralModel, NoRuntime, Refused, onnx_runtime,
};

use super::Finding;

/// A live model that needs longer than this for one person makes a full room late.
const QUICK_MS: f64 = 2.0;

pub(super) fn examine(config: &Config) -> Vec<Finding> {
    let library = Library::new(config);
    let mut findings = vec![usual(&library), runtime(config)];
    let models = library.all().into_iter();
    findings.extend(models.map(|(name, file)| model(&name, file, config)));
    findings
}

/// What `auto` means.
fn usual(library: &Library) -> Finding {
    let of = |kind, simple: SimpleModel| match library.default_model(kind) {
        Some(name) => name,
        None => format!("{}, part of the engine", simple.label()),
    };
    let live = of(Kind::Live, SimpleModel::BEST);
    let offline = of(Kind::Offline, SimpleModel::BEST_TWO_SIDED);
    Finding::good(
        "repair",
        format!("auto is {live}; for smoothed recordings {offline}"),
    )
}

fn runtime(config: &Config) -> Finding {
    let what = "ONNX Runtime";
    match onnx_runtime(config) {
        Ok(runtime) => {
            let place = runtime
                .library
                .as_deref()
                .map_or_else(String::new, |library| {
                    format!(", {}", crate::paths::shown(library))
                });
            let used = match config.backend {
                BackendChoice::Auto => "; used where rten is too slow or lacks an operator",
                BackendChoice::Rten => "; not used, for models.backend is rten",
                BackendChoice::Ort => "",
            };
            Finding::good(what, format!("{}{place}{used}", runtime.version))
        }
        Err(why @ (NoRuntime::NotBuilt | NoRuntime::NotFound { .. }))
            if config.backend != BackendChoice::Ort =>
        {
            Finding::unknown(what, format!("not used, and not needed: {why}"))
        }
        Err(why) => Finding::doubtful(
            what,
            why.to_string(),
            "correct it, or let the embedded runtime do it: models.backend = \"rten\"",
        ),
    }
}

fn model(name: &str, file: Result<ModelFile, Refused>, config: &Config) -> Finding {
    let what = format!("model {name}");
    let opened = file.and_then(|file| NeuralModel::open(&file, config));
    let model = match opened {
        Ok(model) => model,
        Err(refused) => {
            return Finding::bad(
                what,
                refused.to_string(),
                "take it out of the models folder, or replace it",
            );
        }
    };
    let kind = match model.manifest().kind {
        Kind::Live => "live",
        Kind::Offline => "for recordings",
    };
    let ms = 1e3 * model.latency().as_secs_f64();
    let found = format!(
        "{kind}, {} ({}), {ms:.1} ms a window; {}",
        model.runtime(),
        model.why(),
        model.manifest().about.summary
    );
    if kind == "live" && ms > QUICK_MS && !cfg!(debug_assertions) {
        return Finding::doubtful(
            what,
            found,
            "several people may make it late: another model, or another runtime",
        );
    }
    Finding::good(what, found)
}
