//! Smooth functions of time: ramps, and tracks of several channels whose second derivative is continuous.

/// 0 before 0, 1 after 1, in between the quintic whose first and second derivative vanish at both ends.
pub(crate) fn ramp(share: f64) -> f64 {
    let u = share.clamp(0.0, 1.0);
    u * u * u * (10.0 + u * (6.0 * u - 15.0))
}

/// How far one is after `time` on a way of `length` at cruising speed `speed`, speeding up and slowing down over
/// `ease` seconds each. Takes [`eased_duration`] in all.
pub(crate) fn eased_distance(time: f64, length: f64, speed: f64, ease: f64) -> f64 {
    let duration = eased_duration(length, speed, ease);
    let speeding_up = |u: f64| u * u * u - 0.5 * u * u * u * u;
    let t = time.clamp(0.0, duration);
    if t < ease {
        speed * ease * speeding_up(t / ease)
    } else if t > duration - ease {
        length - speed * ease * speeding_up((duration - t) / ease)
    } else {
        speed * (t - 0.5 * ease)
    }
}

/// How long that way takes, seconds. Ways shorter than `speed * ease` should be given a lower speed.
pub(crate) fn eased_duration(length: f64, speed: f64, ease: f64) -> f64 {
    length / speed + ease
}

/// The angle that equals `angle` up to full turns and lies within half a turn of `near`, radians.
pub(crate) fn unwrapped(angle: f64, near: f64) -> f64 {
    let turn = std::f64::consts::TAU;
    near + (angle - near + turn / 2.0).rem_euclid(turn) - turn / 2.0
}

/// `N` numbers as functions of time, a uniform cubic B-spline through (almost) its control values.
///
/// The spline lies within the hull of four neighbouring control values, is constant where they are, and its first
/// and second derivatives are continuous. Periodic: after the last control value comes the first again, with
/// `turn` added per round (for headings that have gone round).
#[derive(Clone, Debug)]
pub(crate) struct Track<const N: usize> {
    step: f64,
    values: Vec<[f64; N]>,
    turn: [f64; N],
}

impl<const N: usize> Track<N> {
    /// `values[i]` belongs to the time `i * step` seconds. At least one value.
    pub(crate) fn new(step: f64, values: Vec<[f64; N]>, turn: [f64; N]) -> Self {
        Self { step, values, turn }
    }

    /// The values at `time`, any number of rounds on.
    pub(crate) fn at(&self, time: f64) -> [f64; N] {
        let position = time / self.step;
        let first = position.floor();
        let u = position - first;
        let weights = [
            (1.0 - u).powi(3) / 6.0,
            (3.0 * u * u * u - 6.0 * u * u + 4.0) / 6.0,
            (-3.0 * u * u * u + 3.0 * u * u + 3.0 * u + 1.0) / 6.0,
            u * u * u / 6.0,
        ];
        let mut sum = [0.0; N];
        for (offset, weight) in weights.into_iter().enumerate() {
            let (values, rounds) = self.control(first as i64 + offset as i64 - 1);
            for channel in 0..N {
                sum[channel] += weight * (values[channel] + rounds * self.turn[channel]);
            }
        }
        sum
    }

    fn control(&self, index: i64) -> (&[f64; N], f64) {
        let count = self.values.len() as i64;
        (
            &self.values[index.rem_euclid(count) as usize],
            index.div_euclid(count) as f64,
        )
    }
}

/// The lowest value within `reach` neighbours on either side, then averaged over the same reach; periodic.
///
/// No result lies above any of the `values` up to its direct neighbours: a smooth curve underneath.
pub(crate) fn smooth_floor(values: &[f64], reach: usize) -> Vec<f64> {
    let count = values.len();
    let window = move |centre: usize, width: usize| {
        (0..=2 * width).map(move |k| (centre + count * (1 + width / count) + k - width) % count)
    };
    let lowest: Vec<f64> = (0..count)
        .map(|i| {
            window(i, reach + 2)
                .map(|k| values[k])
                .fold(f64::INFINITY, f64::min)
        })
        .collect();
    (0..count)
        .map(|i| window(i, reach).map(|k| lowest[k]).sum::<f64>() / (2 * reach + 1) as f64)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_eased_way_starts_and_ends_where_it_should() {
        let (length, speed, ease) = (2.0, 0.8, 0.6);
        let end = eased_duration(length, speed, ease);
        assert_eq!(eased_distance(0.0, length, speed, ease), 0.0);
        assert!((eased_distance(end, length, speed, ease) - length).abs() < 1e-12);
        let before = eased_distance(ease - 1e-9, length, speed, ease);
        assert!((before - eased_distance(ease + 1e-9, length, speed, ease)).abs() < 1e-8);
    }

    #[test]
    fn a_track_is_constant_between_equal_values_and_goes_round() {
        let values: Vec<[f64; 1]> = (0..20).map(|i| [if i < 10 { 1.0 } else { 3.0 }]).collect();
        let track = Track::new(0.1, values, [5.0]);
        assert!((track.at(0.5)[0] - 1.0).abs() < 1e-12);
        assert!((track.at(1.55)[0] - 3.0).abs() < 1e-12);
        assert!(
            (track.at(2.5)[0] - 6.0).abs() < 1e-12,
            "one round adds the turn"
        );
    }

    #[test]
    fn the_smooth_floor_is_below_everything_near() {
        let values: Vec<f64> = (0..100).map(|i| (i as f64 * 0.7).sin()).collect();
        let floor = smooth_floor(&values, 3);
        for (near, low) in values.windows(5).zip(&floor[2..]) {
            assert!(near.iter().all(|value| *low <= value + 1e-12));
        }
    }

    #[test]
    fn unwrapping_takes_the_short_way() {
        assert!((unwrapped(3.0, -3.0) + 3.283).abs() < 1e-3);
        assert!((unwrapped(0.1, 12.6) - 12.666).abs() < 1e-3);
    }
}
