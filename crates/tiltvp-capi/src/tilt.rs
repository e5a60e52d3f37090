//! The tilt of single images.

use std::ffi::c_char;
use std::mem::MaybeUninit;

use tiltvp_core::geometry::Tilt;
use tiltvp_core::tilt::{self as core, Scratch, TiltOptions};

use crate::border::{Status, answer, end, given, make};
use crate::camera::Camera;
use crate::pointers::Image;
use crate::reader::{ScratchPool, setting};
use crate::text::{TILTVP_REASON_BYTES, sentence};

/// Estimates the tilt of a robot from single images of one camera. Any number of threads may use it at once.
pub struct TiltEstimator {
    inner: core::TiltEstimator,
    scratch: ScratchPool<Scratch>,
}

/// The tilt of one image. Without one the angles and the normal are NaN, the covariance is infinite and the confidence 0.
#[repr(C)]
pub struct TiltEstimate {
    /// Whether there is a tilt.
    pub valid: bool,
    /// How far the robot leans, in [0, pi] radians.
    pub alpha_rad: f64,
    /// In which direction it leans, in (-pi, pi] radians: 0 is forward, +pi/2 to the left.
    pub beta_rad: f64,
    /// Roll about the robot's x in radians, right side down positive (Rz Ry Rx, ROS REP 103).
    pub roll_rad: f64,
    /// Pitch about the robot's y in radians, nose down positive.
    pub pitch_rad: f64,
    /// The unit ground normal in the robot frame.
    pub normal: [f64; 3],
    /// Covariance of the normal in its tangent plane in squared radians, 2 x 2 in row order: close to the robot's x and y.
    pub covariance_rad2: [f64; 4],
    /// Probability, in [0, 1], that the error is below two degrees.
    pub confidence: f64,
    /// Edge pixels in the elevation band.
    pub edge_pixels: usize,
    /// Those that agree with the estimate.
    pub inlier_pixels: usize,
    /// Why the fit stopped, and what most likely keeps it from being sure: a sentence.
    pub reason: [c_char; TILTVP_REASON_BYTES],
}

/// An estimator for the images of a camera: its tables are made once.
///
/// `robot_from_camera` is the rotation R of v_robot = R v_camera, 9 numbers in row order; NULL for that of the camera's file, or the
/// identity. `mask` has 128 and more where images show the world, NULL for everywhere. `options` is a text in TOML, such as
/// "method = 'segments'\ntilt_max_rad = 0.2", with the names of docs/options.md; NULL for the defaults.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tiltvp_tilt_estimator_new(
    camera: Option<&Camera>,
    robot_from_camera: *const f64,
    mask: Option<&Image>,
    options: *const c_char,
    estimator: Option<&mut MaybeUninit<*mut TiltEstimator>>,
) -> Status {
    make(estimator, "estimator", || {
        let of_method = |method: Option<&str>| TiltOptions::for_method(method.unwrap_or(core::METHODS[0]));
        // SAFETY: pointers of the caller's, each NULL or what the header says.
        let (camera, rotation, options) = unsafe { setting(camera, robot_from_camera, mask, options, of_method) }?;
        Ok(TiltEstimator {
            inner: core::TiltEstimator::new(camera, rotation, options)?,
            scratch: ScratchPool::default(),
        })
    })
}

/// The tilt of an image of the camera's size.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tiltvp_tilt_estimator_estimate(
    estimator: Option<&TiltEstimator>,
    image: Option<&Image>,
    estimate: Option<&mut MaybeUninit<TiltEstimate>>,
) -> Status {
    answer(estimate, "estimate", || {
        let TiltEstimator { inner, scratch } = given(estimator, "estimator")?;
        // SAFETY: rows of the caller's, or NULL.
        let view = unsafe { given(image, "image")?.view("image") }?;
        let found = scratch.with(|| inner.scratch(), |scratch| inner.estimate(&view, scratch))?;
        Ok(TiltEstimate::from(&found))
    })
}

/// Ends an estimator. NULL is nothing to end.
#[unsafe(no_mangle)]
pub extern "C" fn tiltvp_tilt_estimator_free(estimator: Option<Box<TiltEstimator>>) {
    end(estimator);
}

impl From<&core::TiltEstimate> for TiltEstimate {
    fn from(found: &core::TiltEstimate) -> Self {
        let tilt = found.tilt;
        let angle = |of: fn(&Tilt) -> f64| tilt.as_ref().map_or(f64::NAN, of);
        let c = found.covariance_rad2;
        Self {
            valid: tilt.is_some(),
            alpha_rad: angle(Tilt::alpha_rad),
            beta_rad: angle(Tilt::beta_rad),
            roll_rad: angle(Tilt::roll_rad),
            pitch_rad: angle(Tilt::pitch_rad),
            normal: tilt.map_or([f64::NAN; 3], |tilt| tilt.normal().into()),
            covariance_rad2: [c.m11, c.m12, c.m21, c.m22],
            confidence: found.confidence,
            edge_pixels: found.edge_pixels,
            inlier_pixels: found.inlier_pixels,
            reason: sentence(&found.reason()),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::ptr;

    use super::*;
    use crate::testing::{LEAN, boxed, camera, image, last_error, made};

    fn estimator(options: *const c_char, mask: Option<&Image>) -> Box<TiltEstimator> {
        // SAFETY: a text, or NULL.
        boxed(|handle| unsafe { tiltvp_tilt_estimator_new(Some(&camera()), ptr::null(), mask, options, handle) })
    }

    #[test]
    fn an_estimate_is_that_of_the_core_and_near_the_truth() {
        let made_here = estimator(c"method = 'refined'\nseed = 3".as_ptr(), None);
        // SAFETY: rows of the test.
        let found = made(|place| unsafe { tiltvp_tilt_estimator_estimate(Some(&made_here), Some(&image()), place) });
        let image = image();
        // SAFETY: the same.
        let view = unsafe { image.view("image") }.unwrap();
        let expected = made_here.inner.estimate(&view, &mut made_here.inner.scratch()).unwrap();
        let tilt = expected.tilt.unwrap();
        assert!(found.valid);
        assert_eq!((found.alpha_rad, found.beta_rad), (tilt.alpha_rad(), tilt.beta_rad()));
        assert_eq!((found.roll_rad, found.pitch_rad), (tilt.roll_rad(), tilt.pitch_rad()));
        assert_eq!((found.confidence, found.covariance_rad2[1]), (expected.confidence, expected.covariance_rad2.m12));
        assert_eq!(found.reason, sentence(&expected.reason()));
        assert!(tilt.angle_to(&LEAN) < 0.02, "{}", tilt.angle_to(&LEAN));
    }

    #[test]
    fn an_image_of_nothing_has_no_tilt_but_a_reason() {
        let levels = vec![90u8; 320 * 240];
        let image = Image { data: levels.as_ptr(), width: 320, height: 240, stride: 320 };
        let estimator = estimator(ptr::null(), None);
        // SAFETY: rows of the test.
        let found = made(|place| unsafe { tiltvp_tilt_estimator_estimate(Some(&estimator), Some(&image), place) });
        assert!(!found.valid && found.alpha_rad.is_nan() && found.normal[2].is_nan());
        assert!(found.covariance_rad2[0].is_infinite() && found.confidence == 0.0 && found.reason[0] != 0);
    }

    #[test]
    fn a_mask_leaves_pixels_out_and_that_of_a_robots_file_is_asked_for() {
        let mut levels = vec![255u8; 320 * 240];
        levels[..320 * 120].fill(127);
        let mask = Image { data: levels.as_ptr(), width: 320, height: 240, stride: 320 };
        let [all, half] = [None, Some(&mask)].map(|mask| estimator(ptr::null(), mask).inner.region_pixels());
        assert!(half > all / 3 && half < 2 * all / 3, "{half} of {all}");
        let mut robot = camera();
        robot.mask = Some("robot-mask.png".to_owned());
        let mut handle = MaybeUninit::uninit();
        let of = |camera: &Camera, mask: Option<&Image>, handle: &mut MaybeUninit<_>| {
            // SAFETY: rows of the test, or NULL.
            unsafe { tiltvp_tilt_estimator_new(Some(camera), ptr::null(), mask, ptr::null(), Some(handle)) }
        };
        assert_eq!(of(&robot, None, &mut handle), Status::InvalidArgument);
        assert!(last_error().contains("the pixels of \"robot-mask.png\""), "{}", last_error());
        assert_eq!(of(&robot, Some(&Image { width: 319, ..mask }), &mut handle), Status::InvalidArgument);
        assert!(last_error().contains("mask"), "{}", last_error());
    }

    #[test]
    fn the_mounting_is_the_callers_or_the_files_or_none() {
        let forward = [0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0];
        let mut robot = camera();
        robot.robot_from_camera = Some(nalgebra::Matrix3::identity());
        let of = |camera: &Camera, rotation| {
            // SAFETY: nine numbers, or NULL.
            let make = |handle: Option<&mut MaybeUninit<_>>| unsafe {
                tiltvp_tilt_estimator_new(Some(camera), rotation, None, ptr::null(), handle)
            };
            *boxed(make).inner.robot_from_camera()
        };
        let expected = nalgebra::Matrix3::from_row_slice(&forward);
        assert_eq!(of(&robot, forward.as_ptr()), expected);
        assert_eq!(of(&camera(), ptr::null()), nalgebra::Matrix3::identity());
        robot.robot_from_camera = Some(expected);
        assert_eq!(of(&robot, ptr::null()), expected);
        let (mut handle, no_rotation) = (MaybeUninit::uninit(), [1.0; 9]);
        // SAFETY: nine numbers.
        let status = unsafe {
            tiltvp_tilt_estimator_new(Some(&robot), no_rotation.as_ptr(), None, ptr::null(), Some(&mut handle))
        };
        assert_eq!(status, Status::InvalidArgument);
    }

    #[test]
    fn images_of_another_size_and_null_are_refused() {
        let estimator = estimator(ptr::null(), None);
        let smaller = Image { width: 319, ..image() };
        let mut place = MaybeUninit::uninit();
        // SAFETY: rows of the test, or NULL.
        let statuses = unsafe {
            [
                tiltvp_tilt_estimator_estimate(Some(&estimator), None, Some(&mut place)),
                tiltvp_tilt_estimator_estimate(None, Some(&image()), Some(&mut place)),
                tiltvp_tilt_estimator_estimate(Some(&estimator), Some(&image()), None),
                tiltvp_tilt_estimator_new(None, ptr::null(), None, ptr::null(), Some(&mut MaybeUninit::uninit())),
                tiltvp_tilt_estimator_new(Some(&camera()), ptr::null(), None, ptr::null(), None),
                tiltvp_tilt_estimator_estimate(Some(&estimator), Some(&smaller), Some(&mut place)),
            ]
        };
        assert_eq!(statuses, [Status::InvalidArgument; 6]);
        assert!(last_error().contains("240 x 319 pixels, expected 240 x 320"), "{}", last_error());
        tiltvp_tilt_estimator_free(None);
    }

    #[test]
    fn threads_share_an_estimator() {
        let estimator = estimator(ptr::null(), None);
        let one = || {
            // SAFETY: rows of the test.
            let found =
                made(|place| unsafe { tiltvp_tilt_estimator_estimate(Some(&estimator), Some(&image()), place) });
            found.alpha_rad.to_bits()
        };
        let alone = one();
        std::thread::scope(|scope| {
            let threads: Vec<_> = (0..4).map(|_| scope.spawn(|| (0..5).map(|_| one()).collect::<Vec<_>>())).collect();
            assert!(threads.into_iter().all(|thread| thread.join().unwrap().iter().all(|alpha| *alpha == alone)));
        });
    }
}
