//! From the shift of the vanishing point in the image to an angle: where it is, and the closed-form gain of each pixel.

use nalgebra::{Matrix3, Vector1, Vector2, Vector3};

use super::trained::TrainedCorrection;
use crate::camera::{Camera, Interpolated};
use crate::edges::Region;
use crate::error::Result;
use crate::options::{Kind, OptionValue, Value};
use crate::parallel;

/// How the image-space methods turn a shift in pixels into a lean (Fleer 2017, eqs. 26 and 30).
#[derive(Debug, Clone, PartialEq, Default)]
pub enum Correction {
    /// `alpha = l / a0` with the lens' own scale at the vanishing point, eq. 26: overestimates by about a half.
    None,
    /// Trained on images of known tilt: a factor in pixels per radian, eqs. 30 and 31, a line, or a posterior.
    Trained(TrainedCorrection),
    /// Each pixel's offset is divided by its own gain: no training images.
    ///
    /// A vertical edge at the bearing `v`, with unit normal `m0` and unit tangent `e = v x m0`, is moved by a lean `delta` to
    /// the normal `m0 - (m0 . delta) / e_z e`. With `D = d bearing / d pixel` the edge offset of eq. 17 changes by
    /// `G = |(D^T e) . (p - p_c)| / (|e_z| |D^T m0|)` pixels per radian. For a lens that is round about a vertical axis this is
    /// `r^2 / (r'(theta) sin^2 theta)`.
    #[default]
    ClosedForm,
}

impl Correction {
    /// A trained factor in pixels per radian.
    pub fn factor(factor: f64) -> Self {
        Self::Trained(TrainedCorrection::Factor(factor))
    }

    /// Checks what is trained.
    ///
    /// # Errors
    /// Those of [`TrainedCorrection::validate`].
    pub fn validate(&self) -> Result<()> {
        match self {
            Self::Trained(trained) => trained.validate(),
            Self::None | Self::ClosedForm => Ok(()),
        }
    }
}

/// The word of [`Correction::ClosedForm`].
const CLOSED_FORM: &str = "closed-form";

impl OptionValue for Correction {
    const KIND: Kind =
        Kind::Object("\"closed-form\", None, a number (a factor), an AffineCorrection or a PosteriorCorrection");

    fn to_value(&self) -> Value {
        match self {
            Self::None => Value::None,
            Self::ClosedForm => Value::Text(CLOSED_FORM.to_owned()),
            Self::Trained(trained) => trained.to_value(),
        }
    }

    fn from_value(value: &Value) -> Option<Self> {
        match value {
            Value::None => Some(Self::None),
            Value::Text(word) if word == CLOSED_FORM => Some(Self::ClosedForm),
            _ => TrainedCorrection::from_value(value).map(Self::Trained),
        }
    }
}

/// Where the vertical vanishing point of an upright robot lies in the image, and how a lean moves it.
#[derive(Debug, Clone)]
pub(super) struct VanishingPoint {
    /// The point `p_c` of eq. 2: of the zenith, or of the nadir where that is what the lens is about.
    pub pixel: Vector2<f64>,
    /// The lens' scale there in pixels per radian, `a0` of eq. 26.
    pub scale: f64,
    /// `d (n_x, n_y) / d pixel` up to the scale: takes the unit direction of a shift to the unit direction of the lean.
    direction: nalgebra::Matrix2<f64>,
}

impl VanishingPoint {
    /// Of zenith and nadir the one that is seen nearer to the middle of the image: a mirrored lens without a stated limit
    /// has a pixel for the other too, but far outside of the image.
    pub(super) fn new(camera: &Camera, robot_from_camera: &Matrix3<f64>) -> Option<Self> {
        let middle = Vector2::new(f64::from(camera.width()) - 1.0, f64::from(camera.height()) - 1.0) / 2.0;
        let point = |sign: f64| {
            let pixel = camera.project(&(robot_from_camera.transpose() * Vector3::new(0.0, 0.0, sign)))?;
            let (_, back) = camera.unproject_jacobian(&pixel)?;
            let scale = (2.0 / (back.transpose() * back).trace()).sqrt();
            let direction = (robot_from_camera * back * (sign * scale)).fixed_rows::<2>(0).into_owned();
            (scale.is_finite() && scale > 0.0).then_some(Self { pixel, scale, direction })
        };
        match (point(1.0), point(-1.0)) {
            (Some(up), Some(down)) if (down.pixel - middle).norm() < (up.pixel - middle).norm() => Some(down),
            (up, down) => up.or(down),
        }
    }

    /// The horizontal part of the ground normal for a unit shift `(cos beta', sin beta')`: eqs. 28 and 29 for any lens.
    pub(super) fn lean(&self, shift: &Vector2<f64>) -> Vector2<f64> {
        self.direction * shift
    }

    /// The map from shifts to horizontal leans.
    pub(super) fn direction(&self) -> &nalgebra::Matrix2<f64> {
        &self.direction
    }
}

/// What a lean moves the edge offset of each pixel by.
#[derive(Debug)]
pub(super) struct Gains {
    /// Of each pixel relative to the mean, NaN where there is none; empty where all count alike.
    pub relative: Vec<f32>,
    /// The mean, or the one factor of all, in pixels per radian.
    pub mean: f64,
}

/// By how much of itself the gain of a pixel may be off in the middle of eight by eight pixels, far below what any edge's offset is off.
const GAIN_SHARE: f64 = 1e-5;

/// The closed-form gain of each pixel of the region relative to their mean, and that mean in pixels per radian.
pub(super) fn closed_form_gains(
    camera: &Camera,
    robot_from_camera: &Matrix3<f64>,
    region: &Region,
    centre: &VanishingPoint,
) -> Gains {
    let gain = |pixel| closed_form_gain(camera, robot_from_camera, centre, pixel);
    let lens = Interpolated::new(region.image_size(), GAIN_SHARE, |pixel| gain(pixel).map(Vector1::new));
    let gains = parallel::filled(region.len(), |first, out: &mut [f64]| {
        region.along(&lens, first..first + out.len(), |k, gain| out[k] = gain.x);
    });
    let is_usable = |gain: &f64| gain.is_finite() && *gain > 0.0;
    let usable = gains.iter().filter(|gain| is_usable(gain));
    let mean = usable.clone().sum::<f64>() / (usable.count().max(1) as f64);
    let relative = |gain: &f64| if is_usable(gain) { (gain / mean) as f32 } else { f32::NAN };
    Gains { relative: gains.iter().map(relative).collect(), mean }
}

/// The gain of a pixel, in pixels per radian.
fn closed_form_gain(
    camera: &Camera,
    robot_from_camera: &Matrix3<f64>,
    centre: &VanishingPoint,
    pixel: Vector2<f64>,
) -> Option<f64> {
    let (bearing, back) = camera.unproject_jacobian(&pixel)?;
    let (bearing, back) = (robot_from_camera * bearing, robot_from_camera * back);
    let normal = Vector3::z().cross(&bearing).try_normalize(1e-9)?;
    let along = bearing.cross(&normal);
    let across = (back.transpose() * normal).norm();
    Some(((back.transpose() * along).dot(&(pixel - centre.pixel)) / (along.z * across)).abs())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Equidistant, Model};
    use crate::edges::EdgeOptions;

    #[test]
    fn corrections_are_what_they_are_written_as() {
        for correction in
            [Correction::None, Correction::ClosedForm, Correction::Trained(TrainedCorrection::Factor(0.9))]
        {
            assert_eq!(Correction::from_value(&correction.to_value()), Some(correction));
        }
    }

    #[test]
    fn gains_of_an_equidistant_lens_are_those_of_the_formula() {
        let lens = Equidistant::new(139.7, 319.5, 239.5).unwrap();
        let camera = Camera::new(640, 480, Model::Equidistant(lens)).unwrap();
        let identity = Matrix3::identity();
        let region = Region::new(&camera, &identity, &EdgeOptions::default(), None).unwrap();
        let centre = VanishingPoint::new(&camera, &identity).unwrap();
        assert!((centre.scale - 139.7).abs() < 1e-9);
        let Gains { relative: gains, mean } = closed_form_gains(&camera, &identity, &region, &centre);
        for ((_, _, bearing), gain) in region.pixels().zip(&gains) {
            let theta = bearing.xy().norm().atan2(bearing.z);
            let expected = 139.7 * (theta / theta.sin()).powi(2);
            assert!((f64::from(*gain) * mean / expected - 1.0).abs() < 1e-5);
        }
    }

    #[test]
    fn gains_between_nodes_are_those_of_each_pixel() {
        let lens = Equidistant::new(139.7, 321.3, 236.1).unwrap();
        let camera = Camera::new(640, 480, Model::Equidistant(lens)).unwrap();
        let leaning = *nalgebra::Rotation3::from_euler_angles(0.1, -0.2, 0.7).matrix();
        let region = Region::new(&camera, &leaning, &EdgeOptions::default(), None).unwrap();
        let centre = VanishingPoint::new(&camera, &leaning).unwrap();
        let Gains { relative: gains, mean } = closed_form_gains(&camera, &leaning, &region, &centre);
        for ((u, v, _), gain) in region.pixels().zip(&gains) {
            let exact = closed_form_gain(&camera, &leaning, &centre, Vector2::new(u as f64, v as f64)).unwrap();
            assert!((f64::from(*gain) * mean / exact - 1.0).abs() < 3e-5, "{u}, {v}: {gain}");
        }
    }
}
