//! What tests share: differences, tolerances and a zoo of calibrations (feature "testing").

use crate::camera::{Camera, Model, Parameter};

pub use crate::camera::{Derivative, derivative};

/// Largest round trip pixel -> bearing -> pixel of a camera that is right, in pixels.
pub const ROUND_TRIP_PX: f64 = 1e-6;

/// Largest relative difference between a Jacobian and central differences.
pub const JACOBIAN_RELATIVE: f64 = 1e-6;

/// The camera of named numbers and lists.
///
/// # Panics
/// If the parameters are refused.
#[allow(clippy::panic)]
pub fn camera(model: &str, size: [u32; 2], scalars: &[(&str, f64)], lists: &[(&str, &[f64])]) -> Camera {
    let parameters: Vec<_> = scalars
        .iter()
        .map(|&(name, value)| (name.to_owned(), Parameter::Scalar(value)))
        .chain(lists.iter().map(|&(name, values)| (name.to_owned(), Parameter::List(values.to_vec()))))
        .collect();
    Model::from_parameters(model, size[0], size[1], &parameters)
        .and_then(|model| Camera::new(size[0], size[1], model))
        .unwrap_or_else(|error| panic!("{error}"))
}

/// The same lens over a larger image: `margin_px` more on every side, so that its rim may be seen. Panoramas stay as they are.
///
/// # Panics
/// If the camera is refused, which would be a defect.
#[allow(clippy::panic)]
pub fn with_margin(camera: &Camera, margin_px: u32) -> Camera {
    let model = camera.model();
    let mut parameters: Vec<_> = model.parameters().into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
    if parameters.is_empty() {
        return camera.clone();
    }
    for (name, value) in &mut parameters {
        if let (true, Parameter::Scalar(x)) = (name == "cx" || name == "cy", value) {
            *x += f64::from(margin_px);
        }
    }
    let (width, height) = (camera.width() + 2 * margin_px, camera.height() + 2 * margin_px);
    let wide = Model::from_parameters(model.name(), width, height, &parameters)
        .and_then(|model| Camera::new(width, height, model))
        .and_then(|wide| wide.with_max_theta_rad(camera.max_theta_rad()))
        .unwrap_or_else(|error| panic!("{error}"));
    if camera.is_mirrored() { wide.mirrored() } else { wide }
}

/// An inverse polynomial of 33 terms with the large alternating numbers that OCamCalib writes.
const INVERSE_33: [f64; 33] = [
    276.0, 218.0, 71.1, 69.8, 73.7, 164.5, -373.2, -2690.8, 4329.4, 34287.0, -15201.0, -258_423.0, -84849.0, 1.2047e6,
    1.1536e6, -3.3598e6, -5.5860e6, 4.5912e6, 1.48248e7, 1.5106e6, -2.19324e7, -1.64497e7, 1.40296e7, 2.51144e7,
    4.9814e6, -1.40991e7, -1.21211e7, -1.2274e6, 3.8719e6, 2.9106e6, 1.0119e6, 183_063.0, 13964.0,
];

/// A camera of every model, with numbers of the size that real lenses have.
pub fn zoo() -> Vec<(&'static str, Camera)> {
    let mut zoo = pinholes();
    zoo.extend(fisheyes());
    zoo.extend(scaramuzzas());
    zoo.extend(spheres());
    zoo
}

fn pinholes() -> Vec<(&'static str, Camera)> {
    let frame = [("fx", 458.0), ("fy", 457.0), ("cx", 367.2), ("cy", 248.4)];
    let with = |more: &[(&str, f64)]| camera("pinhole", [752, 480], &[&frame[..], more].concat(), &[]);
    vec![
        ("pinhole", with(&[])),
        ("pinhole 4", with(&[("k1", -0.283), ("k2", 0.074), ("p1", 1.9e-4), ("p2", 1.8e-5)])),
        ("pinhole 5", with(&[("k1", -0.31), ("k2", 0.12), ("p1", 9e-4), ("p2", -7e-4), ("k3", -0.021)])),
        (
            "pinhole 8",
            with(&[
                ("k1", 6.31),
                ("k2", 3.72),
                ("p1", -1.1e-4),
                ("p2", 6e-5),
                ("k3", 0.19),
                ("k4", 6.68),
                ("k5", 5.71),
                ("k6", 1.04),
            ]),
        ),
    ]
}

fn fisheyes() -> Vec<(&'static str, Camera)> {
    let frame = [("fx", 286.0), ("fy", 285.9), ("cx", 425.1), ("cy", 399.6)];
    let stereo = [("k1", -0.0081), ("k2", 0.0436), ("k3", -0.0405), ("k4", 0.0066)];
    let folding = [("k1", 0.0173), ("k2", -0.0255), ("k3", 0.0226), ("k4", -0.0073)];
    let growing = [("k1", 0.021), ("k2", 0.002), ("k3", 0.0004), ("k4", 0.00002)];
    let kannala_brandt = |k: &[(&str, f64)], size| camera("kannala_brandt", size, &[&frame[..], k].concat(), &[]);
    let wide = kannala_brandt(&growing, [850, 800]);
    let half_field = (185.0f64 / 2.0).to_radians();
    let equidistant = camera("equidistant", [640, 640], &[("focal_px", 190.0), ("cx", 319.5), ("cy", 321.0)], &[]);
    let woodscape = [("k1", 340.0), ("k2", -32.0), ("k3", 48.3), ("k4", -7.2), ("cx", 643.4), ("cy", 479.4)];
    let limited = |camera: &Camera, angle| camera.clone().with_max_theta_rad(angle).unwrap_or_else(|_| camera.clone());
    vec![
        ("kannala_brandt", kannala_brandt(&stereo, [848, 800])),
        ("kannala_brandt folding", kannala_brandt(&folding, [848, 800])),
        ("kannala_brandt 360 deg", wide.clone()),
        ("kannala_brandt 185 deg", limited(&wide, half_field)),
        ("equidistant 360 deg", equidistant.clone()),
        ("equidistant 190 deg", limited(&equidistant, 95f64.to_radians())),
        ("equidistant mirrored", limited(&equidistant, 95f64.to_radians()).mirrored()),
        ("radial_polynomial", camera("radial_polynomial", [1280, 966], &woodscape, &[])),
        (
            "radial_polynomial stretched",
            camera("radial_polynomial", [1280, 966], &[&woodscape[..], &[("aspect_ratio", 0.97)]].concat(), &[]),
        ),
        ("equirectangular", camera("equirectangular", [1024, 512], &[], &[])),
    ]
}

fn scaramuzzas() -> Vec<(&'static str, Camera)> {
    let fisheye = [-206.5, 0.0, 2.2072e-3, -4.8796e-6, 1.8657e-8];
    let super_fisheye = [-153.5, 0.0, 1.0347e-3, 5.1382e-6, -5.6949e-9];
    let mirror = [-131.5, 0.0, 1.849e-3, 2.2512e-7, -7.3432e-10];
    let physical = mirror.map(|a| -a);
    let long = [-553.0, 0.0, 8.4e-4, -6.5e-7, 1.24e-9, -1e-13, 2e-16, 1e-20];
    let affine = [("c", 1.00065), ("d", -6.25e-4), ("e", 4.31e-4)];
    let centre = [("cx", 456.3), ("cy", 382.8)];
    let ocam = |polynomial: &[f64], affine: &[(&str, f64)], inverse: &[f64]| {
        let lists = [("polynomial", polynomial), ("inverse_polynomial", inverse)];
        camera("ocam", [1024, 768], &[&centre[..], affine].concat(), &lists)
    };
    vec![
        ("ocam fisheye", ocam(&fisheye, &[], &[])),
        ("ocam affine", ocam(&super_fisheye, &affine, &[])),
        ("ocam affine, 33 inverse terms", ocam(&super_fisheye, &affine, &INVERSE_33)),
        ("ocam 8 coefficients", ocam(&long, &affine, &[])),
        ("ocam catadioptric", ocam(&mirror, &affine, &[])),
        ("ocam catadioptric, physical frame", ocam(&physical, &affine, &[])),
        ("ocam catadioptric, mirrored", ocam(&mirror, &affine, &[]).mirrored()),
    ]
}

fn spheres() -> Vec<(&'static str, Camera)> {
    let unified = |xi: f64, f: f64, more: &[(&str, f64)]| {
        let frame = [("xi", xi), ("fx", f), ("fy", f * 1.002), ("cx", 632.7), ("cy", 487.5)];
        camera("unified", [1280, 960], &[&frame[..], more].concat(), &[])
    };
    let frame = |f: f64| [("fx", f), ("fy", f * 0.997), ("cx", 365.9), ("cy", 249.3)];
    let extended = |alpha: f64, beta: f64| {
        camera("extended_unified", [752, 480], &[&[("alpha", alpha), ("beta", beta)][..], &frame(230.0)].concat(), &[])
    };
    let double = |xi: f64, alpha: f64, f: f64| {
        camera("double_sphere", [752, 480], &[&[("xi", xi), ("alpha", alpha)][..], &frame(f)].concat(), &[])
    };
    vec![
        ("unified xi < 1", unified(0.91, 520.0, &[("k1", -0.12), ("k2", 0.02), ("p1", 6e-4), ("p2", -4e-4)])),
        ("unified xi = 1", unified(1.0, 520.0, &[])),
        (
            "unified xi > 1",
            unified(2.08, 1124.7, &[("k1", -0.2117), ("k2", 0.4394), ("p1", 1.54e-3), ("p2", -7.4e-4), ("skew", 0.7)]),
        ),
        (
            "unified xi > 2, large k2",
            unified(2.94, 1126.0, &[("k1", 0.2266), ("k2", 6.73), ("p1", 4.6e-3), ("p2", 9.7e-4)]),
        ),
        ("extended_unified", extended(0.63, 1.04)),
        ("extended_unified alpha < 1/2", extended(0.41, 0.9)),
        ("double_sphere", double(-0.24, 0.567, 349.8)),
        ("double_sphere alpha < 1/2", double(0.3, 0.45, 300.0)),
        ("double_sphere mirrored", double(-0.21, 0.577, 361.7).mirrored()),
    ]
}
