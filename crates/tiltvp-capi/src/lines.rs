//! The vertical lines of single images.

use std::ffi::c_char;
use std::mem::MaybeUninit;

use tiltvp_core::geometry::Tilt;
use tiltvp_core::lines::{self as core, LineMethod, LineOptions, LineScratch, Lines};

use crate::border::{Status, end, given, make, refused, run};
use crate::camera::Camera;
use crate::pointers::{Image, room, vector};
use crate::reader::{ScratchPool, setting};

/// Finds the vertical lines of single images of one camera. Any number of threads may use it at once.
pub struct LineExtractor {
    inner: core::LineExtractor,
    scratch: ScratchPool<(LineScratch, Lines)>,
}

/// A vertical line of the world as one image shows it.
#[repr(C)]
pub struct Line {
    /// Azimuth atan2(y, x) about the vertical in the upright robot's frame, in (-pi, pi] radians.
    pub bearing_rad: f64,
    /// Standard deviation of the bearing in radians.
    pub sigma_rad: f64,
    /// Elevation of the lowest pixel above the upright robot's horizon, in radians.
    pub elevation_min_rad: f64,
    /// Elevation of the highest pixel, in radians.
    pub elevation_max_rad: f64,
    /// Share of the pixels that are brighter towards greater azimuth minus that of the others, in [-1, 1].
    pub polarity: f64,
    /// Edge pixels on the line, one across the edge.
    pub support_px: u32,
}

/// An extractor for the images of a camera. The arguments are those of `tiltvp_tilt_estimator_new`; the options are those of
/// `LineExtractor` in docs/options.md.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tiltvp_line_extractor_new(
    camera: Option<&Camera>,
    robot_from_camera: *const f64,
    mask: Option<&Image>,
    options: *const c_char,
    extractor: Option<&mut MaybeUninit<*mut LineExtractor>>,
) -> Status {
    make(extractor, "extractor", || {
        let of_method = |method: Option<&str>| LineOptions::for_method(method.unwrap_or(LineMethod::NAMES[0]));
        // SAFETY: pointers of the caller's, each NULL or what the header says.
        let (camera, rotation, options) = unsafe { setting(camera, robot_from_camera, mask, options, of_method) }?;
        Ok(LineExtractor {
            inner: core::LineExtractor::new(camera, rotation, options)?,
            scratch: ScratchPool::default(),
        })
    })
}

/// The vertical lines of an image of the camera's size, by rising bearing.
///
/// `normal` is the ground normal in the robot frame, as an estimate tells it, 3 numbers; NULL for a robot that does not lean. `lines`
/// has room for `capacity` lines. `count` tells how many there are: where that is more than the room for them, nothing is written and
/// the call fails.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tiltvp_line_extractor_extract(
    extractor: Option<&LineExtractor>,
    image: Option<&Image>,
    normal: *const f64,
    lines: *mut Line,
    capacity: usize,
    count: Option<&mut MaybeUninit<usize>>,
) -> Status {
    run(|| {
        let count = count.map(|count| count.write(0));
        let LineExtractor { inner, scratch } = given(extractor, "extractor")?;
        // SAFETY: pointers of the caller's, each NULL or what the header says.
        let (view, normal, places) = unsafe {
            (given(image, "image")?.view("image")?, vector(normal, "normal")?, room(lines, capacity, "lines")?)
        };
        let count = given(count, "count")?;
        let tilt = match normal.map(|normal| Tilt::from_normal(&normal)) {
            Some(None) => return refused("normal", "no direction", "three numbers that are not all zero"),
            told => told.flatten(),
        };
        scratch.with(
            || (inner.scratch(), Lines::default()),
            |(scratch, found)| {
                inner.extract(&view, tilt.as_ref(), None, scratch, found)?;
                *count = found.lines.len();
                if places.len() < found.lines.len() {
                    return refused(
                        "capacity",
                        &capacity.to_string(),
                        &format!("room for {} lines", found.lines.len()),
                    );
                }
                for (place, line) in places.iter_mut().zip(&found.lines) {
                    place.write(Line::from(line));
                }
                Ok(())
            },
        )
    })
}

/// Ends an extractor. NULL is nothing to end.
#[unsafe(no_mangle)]
pub extern "C" fn tiltvp_line_extractor_free(extractor: Option<Box<LineExtractor>>) {
    end(extractor);
}

impl From<&core::Line> for Line {
    fn from(line: &core::Line) -> Self {
        let core::Line { bearing_rad, sigma_rad, support_px, elevation_min_rad, elevation_max_rad, polarity } = *line;
        Self { bearing_rad, sigma_rad, elevation_min_rad, elevation_max_rad, polarity, support_px }
    }
}

#[cfg(test)]
mod tests {
    use std::ptr;

    use super::*;
    use crate::testing::{LEAN, boxed, camera, image, last_error};

    fn extractor() -> Box<LineExtractor> {
        // SAFETY: NULL.
        boxed(|handle| unsafe { tiltvp_line_extractor_new(Some(&camera()), ptr::null(), None, ptr::null(), handle) })
    }

    fn extract(extractor: &LineExtractor, normal: *const f64, lines: &mut [MaybeUninit<Line>]) -> (Status, usize) {
        let mut count = MaybeUninit::new(usize::MAX);
        // SAFETY: rows and room of the test, three numbers or NULL.
        let status = unsafe {
            let (place, room) = (lines.as_mut_ptr().cast(), lines.len());
            tiltvp_line_extractor_extract(Some(extractor), Some(&image()), normal, place, room, Some(&mut count))
        };
        // SAFETY: it was initialised.
        (status, unsafe { count.assume_init() })
    }

    #[test]
    fn lines_are_those_of_the_core() {
        let extractor = extractor();
        let mut lines = [const { MaybeUninit::uninit() }; 100];
        let (status, count) = extract(&extractor, LEAN.normal().as_ptr(), &mut lines);
        let image = image();
        // SAFETY: rows of the test.
        let view = unsafe { image.view("image") }.unwrap();
        let mut expected = Lines::default();
        extractor.inner.extract(&view, Some(&LEAN), None, &mut extractor.inner.scratch(), &mut expected).unwrap();
        assert_eq!((status, count), (Status::Ok, expected.lines.len()));
        assert!(count > 3, "{count}");
        for (line, expected) in lines.iter().zip(&expected.lines) {
            // SAFETY: so many were written.
            let line = unsafe { line.assume_init_ref() };
            assert_eq!((line.bearing_rad, line.support_px), (expected.bearing_rad, expected.support_px));
        }
    }

    #[test]
    fn too_little_room_is_refused_with_the_count() {
        let extractor = extractor();
        let needed = extract(&extractor, ptr::null(), &mut [const { MaybeUninit::uninit() }; 100]).1;
        let (status, count) = extract(&extractor, ptr::null(), &mut [const { MaybeUninit::uninit() }; 1]);
        assert_eq!((status, count), (Status::InvalidArgument, needed));
        assert_eq!(last_error(), format!("capacity: got 1, expected room for {needed} lines"));
        assert_eq!(extract(&extractor, ptr::null(), &mut []).1, needed);
    }

    #[test]
    fn normals_that_are_none_and_null_are_refused() {
        let extractor = extractor();
        let mut lines = [const { MaybeUninit::uninit() }; 100];
        for normal in [[0.0; 3], [f64::NAN, 0.0, 1.0], [f64::INFINITY, 0.0, 0.0]] {
            assert_eq!(extract(&extractor, normal.as_ptr(), &mut lines), (Status::InvalidArgument, 0));
            assert!(last_error().contains("normal: got no direction"), "{}", last_error());
        }
        // SAFETY: NULL.
        let status = unsafe {
            tiltvp_line_extractor_extract(Some(&extractor), Some(&image()), ptr::null(), ptr::null_mut(), 3, None)
        };
        assert_eq!((status, last_error().as_str()), (Status::InvalidArgument, "lines: got NULL, expected a pointer"));
        tiltvp_line_extractor_free(None);
    }
}
