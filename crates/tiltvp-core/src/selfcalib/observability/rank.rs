//! What a motion can tell about the mounting: the rank conditions of section 8.1 of Scaramuzza et al. (2009).

use nalgebra::{DMatrix, RowSVector};

/// A motion of section 8.1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PureMotion {
    /// Turning about the middle of the axle.
    Rotation,
    /// Driving straight on.
    Straight,
    /// Both, one after the other.
    Both,
}

/// Where the observed feature is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FeatureRange {
    /// So far away that eq. 25 holds: `beta = -theta - phi - psi`.
    Far,
    /// So close that eq. 24 is needed.
    Close,
}

/// Poses at which the bearing is differentiated along a motion: at least as many as there are parameters, five.
const SAMPLES: u32 = 12;

/// Share of the largest singular value from which on another one counts: between rounding, 1e-16, and the smallest one of the
/// four cases of section 8.1 (`the_four_cases_of_the_paper`).
const LEAST_SINGULAR_VALUE: f64 = 1e-8;

/// The dimension of the observable part of (D, theta, phi, rho, psi) when one feature is observed during a motion: the rank
/// of the gradients of the bearing along it, whose Taylor coefficients are the Lie derivatives of section 8.1.
///
/// `state` is (D, theta, phi, rho, psi) at the start of the motion. For both motions the straight one observes the feature
/// in the given range, and the rotation from close.
pub fn observable_dimension(state: &[f64; 5], motion: PureMotion, range: FeatureRange) -> usize {
    let mut rows = Vec::new();
    let (rotation, straight) = (motion != PureMotion::Straight, motion != PureMotion::Rotation);
    for i in 0..SAMPLES {
        let s = f64::from(i) / f64::from(SAMPLES - 1);
        if straight {
            rows.push(gradient(state, 0.5 * state[0] * s, 0.0, range));
        }
        if rotation {
            let range = if motion == PureMotion::Both { FeatureRange::Close } else { range };
            rows.push(gradient(state, 0.0, 2.5 * s, range));
        }
    }
    let jacobian = DMatrix::from_fn(rows.len(), 5, |r, c| rows[r][c]);
    let values = jacobian.singular_values();
    values.iter().filter(|value| **value > LEAST_SINGULAR_VALUE * values.max()).count()
}

/// The gradient by (D, theta, phi, rho, psi) at the start of the bearing after driving `way` straight on and turning by `turn`.
fn gradient(state: &[f64; 5], way: f64, turn: f64, range: FeatureRange) -> RowSVector<f64, 5> {
    let [distance, theta, phi, rho, _] = *state;
    // The feature is at the origin, the robot on the x axis.
    let (x, y) = (distance + way * theta.cos(), way * theta.sin());
    let far = x.hypot(y);
    // By D and theta at the start.
    let distance_by = [x / far, way * (-x * theta.sin() + y * theta.cos()) / far];
    let direction_by = [-y / (far * far), way * (x * theta.cos() + y * theta.sin()) / (far * far)];
    let now = theta + turn - y.atan2(x);
    let theta_by = [-direction_by[0], 1.0 - direction_by[1]];
    let (sin, cos) = (now + phi).sin_cos();
    let scale = 1.0 / (far * far + 2.0 * rho * far * cos + rho * rho);
    let (h1, h2, h4) = match range {
        FeatureRange::Far => (0.0, -1.0, 0.0),
        FeatureRange::Close => (-rho * sin * scale, -(far * rho * cos + far * far) * scale, far * sin * scale),
    };
    RowSVector::from([h1 * distance_by[0] + h2 * theta_by[0], h1 * distance_by[1] + h2 * theta_by[1], h2, h4, -1.0])
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix3;
    use proptest::prelude::*;

    fn state() -> impl Strategy<Value = [f64; 5]> {
        (0.6..3.0f64, 0.3..1.2f64, -1.2..1.2f64, 0.1..0.4f64, -1.2..1.2f64)
            .prop_map(|(d, t, phi, rho, psi)| [d, t, phi, rho, psi])
    }

    proptest! {
        #[test]
        fn the_four_cases_of_the_paper(s in state()) {
            use FeatureRange::{Close, Far};
            // 8.1.1: the sum of theta, phi and psi. 8.1.2: D, theta and eta. 8.1.3: lambda, gamma and psi. 8.1.4: not all.
            prop_assert_eq!(observable_dimension(&s, PureMotion::Rotation, Far), 1);
            prop_assert_eq!(observable_dimension(&s, PureMotion::Straight, Far), 3);
            prop_assert_eq!(observable_dimension(&s, PureMotion::Rotation, Close), 3);
            prop_assert!(observable_dimension(&s, PureMotion::Straight, Close) < 5);
            // The remark that ends 8.1: straight far from the feature, then rotations close to it.
            prop_assert_eq!(observable_dimension(&s, PureMotion::Both, Far), 5);
        }

        /// Of the bearing by eq. 30 where the robot is after driving on and turning.
        #[test]
        fn gradients_are_those_of_the_bearing(s in state(), way in -0.3..0.5f64, turn in -2.0..2.0f64) {
            let bearing = |[distance, theta, phi, rho, psi]: [f64; 5]| {
                let (x, y) = (distance + way * theta.cos(), way * theta.sin());
                let (far, gamma) = (x.hypot(y), theta + turn - y.atan2(x) + phi);
                (-rho * gamma.sin()).atan2(-far - rho * gamma.cos()) - gamma - psi
            };
            let found = gradient(&s, way, turn, FeatureRange::Close);
            for k in 0..5 {
                let moved = |by: f64| bearing(std::array::from_fn(|i| if i == k { s[i] + by } else { s[i] }));
                let slope = crate::geometry::wrap_angle(moved(1e-6) - moved(-1e-6)) / 2e-6;
                prop_assert!((found[k] - slope).abs() < 1e-6, "{}: {} {}", k, found[k], slope);
            }
        }

        #[test]
        fn the_determinant_of_a_1(d in 0.5..5.0f64, t in -3.0..3.0f64) {
            let m = Matrix3::new(
                0.0, -1.0, -1.0,
                -t.sin() / (d * d), t.cos() / d, 0.0,
                2.0 * (2.0 * t).sin() / d.powi(3), -2.0 * (2.0 * t).cos() / (d * d), 0.0,
            );
            prop_assert!((m.determinant() - 2.0 * t.sin() / d.powi(4)).abs() < 1e-9 * (1.0 + d.powi(-4)));
        }

        #[test]
        fn the_determinant_of_a_2(l in 1.2..5.0f64, g in -3.0..3.0f64) {
            // Derivatives along gamma of beta = atan(sin g / (l + cos g)) - g - psi, of which psi is in the first only.
            let first = |l: f64, g: f64| (l * g.cos() + 1.0) / (l * l + 2.0 * l * g.cos() + 1.0) - 1.0;
            let h = 1e-4;
            let second = |l: f64, g: f64| (first(l, g + h) - first(l, g - h)) / (2.0 * h);
            let by = |f: &dyn Fn(f64, f64) -> f64| {
                [(f(l + h, g) - f(l - h, g)) / (2.0 * h), (f(l, g + h) - f(l, g - h)) / (2.0 * h)]
            };
            let (a, b) = (by(&first), by(&second));
            let determinant = -(a[0] * b[1] - a[1] * b[0]);
            let printed = -l * (l * l - 1.0) / (l * l + 2.0 * l * g.cos() + 1.0).powi(3);
            prop_assert!((determinant - printed).abs() < 1e-4 * (1.0 + printed.abs()), "{determinant} {printed}");
        }
    }
}
