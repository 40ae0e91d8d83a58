//! Processor time of this process and of its named threads, from Linux's /proc.

use std::fs;

/// Seconds of processor time used so far.
#[derive(Default)]
pub(crate) struct Usage {
    pub(crate) all_s: f64,
    pub(crate) fusion_s: f64,
    pub(crate) recorder_s: f64,
}

impl Usage {
    pub(crate) fn now() -> Self {
        let mut usage = Self {
            all_s: seconds("/proc/self/stat"),
            ..Self::default()
        };
        for task in fs::read_dir("/proc/self/task")
            .into_iter()
            .flatten()
            .flatten()
        {
            let path = task.path();
            let name = fs::read_to_string(path.join("comm")).unwrap_or_default();
            let used = seconds(&path.join("stat").display().to_string());
            match name.trim() {
                "fusion" => usage.fusion_s += used,
                "recorder" => usage.recorder_s += used,
                _ => {}
            }
        }
        usage
    }

    pub(crate) fn since(&self, earlier: &Self) -> Self {
        Self {
            all_s: self.all_s - earlier.all_s,
            fusion_s: self.fusion_s - earlier.fusion_s,
            recorder_s: self.recorder_s - earlier.recorder_s,
        }
    }
}

/// User and system time of a stat file; Linux counts it in hundredths of a second.
fn seconds(path: &str) -> f64 {
    let text = fs::read_to_string(path).unwrap_or_default();
    let fields: Vec<f64> = text
        .rsplit(')')
        .next()
        .unwrap_or_default()
        .split_whitespace()
        .map(|field| field.parse().unwrap_or(0.0))
        .collect();
    let field = |index: usize| fields.get(index).copied().unwrap_or(0.0);
    (field(11) + field(12)) / 100.0
}
