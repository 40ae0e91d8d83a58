//! Rotations as three angles, in the order that a format lists them, without jumps from frame to frame.

use nalgebra::UnitQuaternion;

/// Three angles in degrees, one about each of three axes in turn, each about the axes as the ones before left them.
pub(crate) type Angles = [f64; 3];

/// This near to +-90 degrees of the middle angle, the outer two turn about the same line: the third is left as it was.
const LOCKED_COSINE: f64 = 1e-6;

/// The rotation by `angles` about the axes `order` (0, 1, 2 for X, Y, Z): the first is the outermost.
#[cfg(test)]
pub(crate) fn rotation(order: [usize; 3], angles: Angles) -> UnitQuaternion<f64> {
    use nalgebra::Vector3;
    let axes = [Vector3::x_axis(), Vector3::y_axis(), Vector3::z_axis()];
    let turn = |n: usize| UnitQuaternion::from_axis_angle(&axes[order[n]], angles[n].to_radians());
    turn(0) * turn(1) * turn(2)
}

/// Angles about three different axes for a rotation. Of the ways to say it, the one nearest to `last`: tools interpolate
/// each angle by itself, so a jump of 360 degrees would be a spin.
pub(crate) fn angles(
    order: [usize; 3],
    rotation: &UnitQuaternion<f64>,
    last: Option<Angles>,
) -> Angles {
    let [i, j, k] = order;
    // +1 where the three axes follow each other like X, Y, Z.
    let sign = if (i + 1) % 3 == j { 1.0 } else { -1.0 };
    let matrix = rotation.to_rotation_matrix();
    let m = |row: usize, column: usize| matrix[(row, column)];
    let sine = (sign * m(i, k)).clamp(-1.0, 1.0);
    let last_or_zero = last.unwrap_or_default();
    let principal = if (1.0 - sine * sine).sqrt() > LOCKED_COSINE {
        [
            (-sign * m(j, k)).atan2(m(k, k)),
            sine.asin(),
            (-sign * m(i, j)).atan2(m(i, i)),
        ]
    } else {
        // Only the sum (or difference) of the outer angles shows.
        let third = last_or_zero[2].to_radians();
        let both = (sign * m(k, j)).atan2(m(j, j));
        [both - sign * sine.signum() * third, sine.asin(), third]
    };
    let principal = principal.map(f64::to_degrees);
    let mirrored = [
        principal[0] + 180.0,
        180.0 - principal[1],
        principal[2] + 180.0,
    ];
    let near = |angles: Angles| {
        let unwound =
            |n: usize| angles[n] - 360.0 * ((angles[n] - last_or_zero[n]) / 360.0).round();
        std::array::from_fn::<f64, 3, _>(unwound)
    };
    let (principal, mirrored) = (near(principal), near(mirrored));
    let way =
        |angles: &Angles| -> f64 { (0..3).map(|n| (angles[n] - last_or_zero[n]).powi(2)).sum() };
    // The first frame has the common form, with the middle angle within +-90 degrees.
    match last.is_some() && way(&mirrored) < way(&principal) {
        true => mirrored,
        false => principal,
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;

    const ORDERS: [[usize; 3]; 6] = [
        [0, 1, 2],
        [0, 2, 1],
        [1, 0, 2],
        [1, 2, 0],
        [2, 0, 1],
        [2, 1, 0],
    ];

    #[test]
    fn every_rotation_comes_back_in_every_order_also_where_the_angles_lock() {
        let mut turns: Vec<UnitQuaternion<f64>> = Vec::new();
        for n in 0..200 {
            let n = f64::from(n);
            turns.push(UnitQuaternion::from_euler_angles(1.7 * n, 0.9 * n, 2.3 * n));
        }
        let quarter = std::f64::consts::FRAC_PI_2;
        for axis in [Vector3::x_axis(), Vector3::y_axis(), Vector3::z_axis()] {
            for n in -3..4 {
                let locked = UnitQuaternion::from_axis_angle(&axis, quarter * f64::from(n));
                turns.push(locked);
                turns.push(UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 0.7) * locked);
                turns.push(locked * UnitQuaternion::from_axis_angle(&Vector3::x_axis(), -0.4));
            }
        }
        for order in ORDERS {
            let mut last = None;
            for turn in &turns {
                let found = angles(order, turn, last);
                let off = rotation(order, found).angle_to(turn);
                assert!(off < 1e-6, "{order:?} {found:?}: {off}");
                last = Some(found);
            }
        }
    }

    #[test]
    fn a_steady_turn_has_steady_angles() {
        let (mut last, mut before) = (None, None::<Angles>);
        for step in 0..2000 {
            let turn = UnitQuaternion::from_axis_angle(
                &nalgebra::Unit::new_normalize(Vector3::new(0.2, 1.0, 0.1)),
                f64::from(step) * 0.02,
            );
            let found = angles([2, 0, 1], &turn, last);
            if let Some(before) = before {
                let jump = (0..3)
                    .map(|n| (found[n] - before[n]).abs())
                    .fold(0.0, f64::max);
                assert!(jump < 10.0, "step {step}: {before:?} to {found:?}");
            }
            (last, before) = (Some(found), Some(found));
        }
        assert!(last.unwrap()[2] > 2000.0, "turned on and on: {last:?}");
    }
}
