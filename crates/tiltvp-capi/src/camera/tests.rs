//! Which texts and files are cameras.

use std::ptr;

use super::*;
use crate::border::Failure;
use crate::testing::{CAMERA, camera, last_error, made};

fn text() -> String {
    CAMERA.to_str().unwrap().to_owned()
}

/// The text with a part of it replaced.
fn with(part: &str, by: &str) -> String {
    assert!(text().contains(part), "{part}");
    text().replace(part, by)
}

#[test]
fn a_text_is_the_camera_that_the_core_makes() {
    let made = camera();
    let lens = core::Equidistant::new(70.0, 159.5, 119.5).unwrap();
    let expected = core::Camera::new(320, 240, Model::Equidistant(lens)).unwrap().with_max_theta_rad(1.6).unwrap();
    assert_eq!((&made.inner, made.robot_from_camera, &made.mask), (&expected, None, &None));
    let (mut width, mut height) = (MaybeUninit::new(0), MaybeUninit::new(0));
    assert_eq!(tiltvp_camera_size(Some(&made), Some(&mut width), Some(&mut height)), Status::Ok);
    // SAFETY: both were initialised.
    assert_eq!(unsafe { (width.assume_init(), height.assume_init()) }, (320, 240));
    let mirrored = parse(&with("max_theta_rad = 1.6", "mirror = true"), None).unwrap().inner;
    assert!(mirrored.is_mirrored());
}

#[test]
fn the_camera_of_a_name_is_taken_else_the_first() {
    let two =
        text() + &with("\nformat = 'tiltvp-camera'\nversion = 1", "").replace("'up'", "'down'").replace("320", "330");
    let width = |name| parse(&two, name).unwrap().inner.width();
    assert_eq!((width(None), width(Some("up")), width(Some("down"))), (320, 320, 330));
    let why = parse(&two, Some("left")).err().unwrap().1;
    assert_eq!(why, "camera: none named \"left\", expected one of up, down");
}

#[test]
fn a_robots_file_has_its_mounting_and_its_mask() {
    let robot = with("'tiltvp-camera'", "'tiltvp-robot'").replace(
        "version = 1",
        "version = 1\nmask = 'robot-mask.png'\n[mounting]\nrobot_from_camera = [[0, 0, 1], [-1.0, 0, 0], [0, -1, 0]]\n\
         covariance_rad2 = [[1.0, 0.0], [0.0, 1.0]]\n[wheels]\nwheel_base_m = 0.4",
    );
    let made = parse(&robot, None).unwrap();
    assert_eq!(made.robot_from_camera, Some(Matrix3::new(0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0)));
    assert_eq!(made.mask.as_deref(), Some("robot-mask.png"));
    let why = parse(&robot.replace("[0, 0, 1]", "[0, 0]"), None).err().unwrap().1;
    assert!(why.contains("mounting.robot_from_camera: [[0, 0], "), "{why}");
    assert!(
        parse(&robot.replace("tiltvp-robot", "tiltvp-camera"), None).err().unwrap().1.contains("unknown key \"mask\"")
    );
}

#[test]
fn what_is_no_camera_is_refused_in_words() {
    for (text, expected) in [
        (String::new(), "format: missing, expected \"tiltvp-camera\" or"),
        (with("version = 1", "version = 2"), "version: 2, expected 1"),
        (with("[[camera]]", "[camera]"), "expected one or more [[camera]]"),
        (with("name = 'up'", "nome = 'up'"), "camera: unknown key \"nome\""),
        (with("'equidistant'", "'equidistand'"), "did you mean equidistant?"),
        (with("width = 320", "width = -1"), "width: -1, expected a number of pixels"),
        (with("width = 320", "width = 0"), "width"),
        (with("width = 320", "width = 100001"), "100001"),
        (with("focal_px = 70", "focal_px = 'long'"), "focal_px: \"long\", expected a number, or a list of numbers"),
        (with("focal_px = 70", "focal_px = nan"), "focal_px = NaN"),
        (with("focal_px = 70", "focal_px = [70]"), "focal_px = a list of 1, expected one number"),
        (with("max_theta_rad = 1.6", "max_theta_rad = 'all'"), "expected an angle in radians"),
        (with("max_theta_rad = 1.6", "mirror = 1"), "mirror: 1, expected true or false"),
        (with("model = 'equidistant'", "model = "), "line 6: "),
    ] {
        let Failure(status, why) = parse(&text, None).err().unwrap_or_else(|| panic!("{text}"));
        assert!(why.contains(expected), "{why}");
        assert_eq!(status, Status::InvalidCamera, "{why}");
    }
}

#[test]
fn files_are_read_if_they_are_regular_and_small() {
    let folder = std::env::temp_dir().join(format!("tiltvp-capi-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let place = |name: &str| std::ffi::CString::new(folder.join(name).to_str().unwrap()).unwrap();
    // SAFETY: texts, or NULL.
    let load = |path: &std::ffi::CStr, handle: &mut MaybeUninit<*mut Camera>| unsafe {
        tiltvp_camera_load(path.as_ptr(), ptr::null(), Some(handle))
    };
    std::fs::write(folder.join("good.toml"), text()).unwrap();
    std::fs::write(folder.join("large.toml"), text() + &"#".repeat(LARGEST_TOML_BYTES)).unwrap();
    std::fs::write(folder.join("bytes.toml"), b"format = '\xff'").unwrap();
    let good = made(|handle| load(&place("good.toml"), handle.unwrap()));
    // SAFETY: the handle of a call that ended well.
    assert_eq!(*unsafe { Box::from_raw(good) }.inner.model(), *camera().inner.model());
    for (name, expected) in [
        ("none.toml", "No such file"),
        ("", "a folder, pipe or device, expected a file"),
        ("large.toml", "more than 200000 bytes"),
        ("bytes.toml", "no text in UTF-8"),
    ] {
        let mut handle = MaybeUninit::new(ptr::dangling_mut());
        assert_eq!(load(&place(name), &mut handle), Status::UnreadableFile);
        assert!(last_error().contains(expected), "{}", last_error());
        // SAFETY: it was initialised.
        assert!(unsafe { handle.assume_init() }.is_null());
    }
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn null_is_refused_and_its_end_is_no_fault() {
    // SAFETY: NULL.
    let outcomes = unsafe {
        [
            tiltvp_camera_load(ptr::null(), ptr::null(), Some(&mut MaybeUninit::uninit())),
            tiltvp_camera_parse(CAMERA.as_ptr(), ptr::null(), None),
            tiltvp_camera_size(None, None, None),
        ]
    };
    assert_eq!(outcomes, [Status::InvalidArgument; 3]);
    assert_eq!(last_error(), "camera: got NULL, expected a pointer");
    tiltvp_camera_free(None);
}
