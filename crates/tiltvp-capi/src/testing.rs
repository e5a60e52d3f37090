//! What the tests share: a camera, and the picture that it takes in a room.

use std::ffi::CStr;
use std::mem::MaybeUninit;
use std::sync::LazyLock;

use nalgebra::Vector2;
use tiltvp_core::geometry::Tilt;
use tiltvp_synth::{RenderOptions, RoomKind, RoomOptions, View, World, render};

use crate::border::{Status, tiltvp_last_error};
use crate::camera::{Camera, parse, tiltvp_camera_parse};
use crate::pointers::Image;

/// A small upward fisheye.
pub(crate) const CAMERA: &CStr = c"
format = 'tiltvp-camera'
version = 1
[[camera]]
name = 'up'
model = 'equidistant'
width = 320
height = 240
max_theta_rad = 1.6
parameters = { focal_px = 70, cx = 159.5, cy = 119.5 }
";

/// How the robot of the picture leans.
pub(crate) static LEAN: LazyLock<Tilt> = LazyLock::new(|| Tilt::from_alpha_beta(0.06, 0.5));

/// The last error of this thread.
pub(crate) fn last_error() -> String {
    // SAFETY: the pointer is that of a text of this thread's.
    unsafe { CStr::from_ptr(tiltvp_last_error()) }.to_str().unwrap().to_owned()
}

/// What a call makes, which has to succeed.
pub(crate) fn made<T>(call: impl FnOnce(Option<&mut MaybeUninit<T>>) -> Status) -> T {
    let mut place = MaybeUninit::uninit();
    assert_eq!(call(Some(&mut place)), Status::Ok, "{}", last_error());
    // SAFETY: a call that ends well has written it.
    unsafe { place.assume_init() }
}

/// What a call makes as a box, which ends it.
pub(crate) fn boxed<T>(call: impl FnOnce(Option<&mut MaybeUninit<*mut T>>) -> Status) -> Box<T> {
    // SAFETY: the handle is that of a box.
    unsafe { Box::from_raw(made(call)) }
}

/// The camera.
pub(crate) fn camera() -> Box<Camera> {
    // SAFETY: a text.
    boxed(|camera| unsafe { tiltvp_camera_parse(CAMERA.as_ptr(), std::ptr::null(), camera) })
}

/// Rows of 320 pixels, 330 bytes apart: the room as the leaning robot's camera sees it.
pub(crate) static PIXELS: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let camera = parse(CAMERA.to_str().unwrap(), None).unwrap().inner;
    let world = World::new(&RoomOptions::new(RoomKind::Office, 1)).unwrap();
    let pose = world.free_poses(1, 1).unwrap()[0];
    let lens = |x: f64, y: f64| camera.unproject(&Vector2::new(x, y));
    let view = View { tilt: *LEAN, ..View::new(&lens, 320, 240, pose) };
    let gray = render(&world, &view, &RenderOptions::default()).unwrap().image.gray;
    gray.chunks(320).flat_map(|row| row.iter().copied().chain([255; 10])).collect()
});

/// The picture.
pub(crate) fn image() -> Image {
    Image { data: PIXELS.as_ptr(), width: 320, height: 240, stride: 330 }
}
