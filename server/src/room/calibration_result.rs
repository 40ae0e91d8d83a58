//! The outcome of a calibration as the wire says it.

use posefuse_calibration::{PairRow, Report, SensorRow, Verdict};
use posefuse_proto::v1;
use posefuse_skeleton::PoseSigma;

/// Verdict, reasons and tables; the calibration itself is not in it.
pub(crate) fn result(report: &Report) -> v1::CalibrateResult {
    let reasons = report.reasons.iter();
    v1::CalibrateResult {
        verdict: verdict_to_wire(report.verdict).into(),
        reasons: reasons
            .map(|reason| format!("{}: {}", reason.what, reason.remedy))
            .collect(),
        calibration: None,
        in_force: false,
        pairs: report.pairs.iter().map(pair).collect(),
        sensors: report.sensors.iter().map(sensor).collect(),
        ray_bias_mm: report.ray_bias_mm,
    }
}

/// One that could not be made, and why.
pub(crate) fn failed(reason: String) -> v1::CalibrateResult {
    v1::CalibrateResult {
        verdict: v1::Verdict::Failed.into(),
        reasons: vec![reason],
        ..Default::default()
    }
}

fn verdict_to_wire(verdict: Verdict) -> v1::Verdict {
    match verdict {
        Verdict::Passed => v1::Verdict::Passed,
        Verdict::Weak => v1::Verdict::Weak,
        Verdict::Failed => v1::Verdict::Failed,
    }
}

fn pair(pair: &PairRow) -> v1::PairResidual {
    v1::PairResidual {
        a: pair.a.clone(),
        b: pair.b.clone(),
        before_rms_m: pair.rms_before_mm * 1e-3,
        after_median_m: pair.median_mm * 1e-3,
        after_p95_m: pair.p95_mm * 1e-3,
        samples: pair.samples,
        before_median_m: pair.median_before_mm * 1e-3,
        agreeing_share: pair.agreeing_share,
        mirrored_share: pair.mirrored_share,
        weakest: pair.weakest,
    }
}

fn sensor(row: &SensorRow) -> v1::SensorResult {
    let sigma = |sigma: &PoseSigma| v1::PoseSigma {
        position_m: sigma.position_m,
        rotation_deg: sigma.rotation_rad.to_degrees(),
        time_ms: sigma.time_s * 1e3,
    };
    v1::SensorResult {
        sensor: row.name.clone(),
        median_m: row.median_mm * 1e-3,
        p95_m: row.p95_mm * 1e-3,
        samples: row.samples,
        time_offset_ms: row.time_offset_ms,
        clock_drift_ppm: row.clock_drift_ppm,
        bone_scale: row.bone_scale,
        sigma: row.sigma.as_ref().map(sigma),
    }
}
