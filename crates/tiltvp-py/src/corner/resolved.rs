//! What several features agree on, as a frozen Python value: `ResolvedAttitude`.

use nalgebra::Matrix3;
use tiltvp_core::corner as core;

use crate::value::value;

value! {
    /// One attitude that several features agree on, with how likely it is among all such.
    ///
    /// Frozen, comparable, hashable, and to be pickled.
    ResolvedAttitude(core::ResolvedAttitude as own) {
        /// Fresh (3, 3) float64: the rotation from the first feature's object to the frame that all features share.
        common_from_object: Matrix3<f64>,
        /// Fresh (3, 3) float64 in squared radians: covariance of the rotation vector, common frame, of the error.
        covariance_rad2: Matrix3<f64> = own.covariance,
        /// The probability that it is this one and none of the others, in [0, 1].
        probability: f64,
        /// Which attitude of each feature it is, in the order of `tiltvp.corner.attitudes`.
        choice: Box<[usize]> = own.choice.clone().into(),
        /// How far the features are apart: chi-square of three degrees of freedom per feature after the first.
        ///
        /// Two where only the vertical is shared.
        chi_square: f64,
    }
    make core::ResolvedAttitude {
        common_from_object,
        covariance: covariance_rad2,
        probability,
        choice: choice.into(),
        chi_square,
    };
}
