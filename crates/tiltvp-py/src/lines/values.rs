//! `Lines`: the vertical lines of one image as a frozen Python value.

use nalgebra::Vector3;
use pyo3::prelude::*;
use tiltvp_core::lines::{self as core, Line, LineFrame};

use crate::call::{exception, invalid};
use crate::reader;
use crate::value::value;

value! {
    /// The vertical lines of one image, by rising bearing. Frozen, comparable, to be pickled.
    ///
    /// `LineExtractor` makes them. Bearings are azimuths atan2(y, x) about the vertical in the upright robot's frame
    /// (the camera's without `robot_from_camera`).
    Lines(core::Lines as own) {
        /// (N,) float64: azimuth about the vertical in the upright robot's frame, radians.
        bearing_rad: Vec<f64> = column(own, |line| line.bearing_rad),
        /// (N,) float64: standard deviation of the bearing, radians.
        sigma_rad: Vec<f64> = column(own, |line| line.sigma_rad),
        /// (N,) uint32: edge pixels on the line, one across the edge.
        support_px: Vec<u32> = column(own, |line| line.support_px),
        /// (N,) float64: elevation of the lowest pixel above the upright robot's horizon, radians.
        elevation_min_rad: Vec<f64> = column(own, |line| line.elevation_min_rad),
        /// (N,) float64: elevation of the highest pixel, radians.
        elevation_max_rad: Vec<f64> = column(own, |line| line.elevation_max_rad),
        /// (N,) in [-1, 1]: share of the pixels that are brighter towards greater azimuth minus that of the others.
        polarity: Vec<f64> = column(own, |line| line.polarity),
        /// Fresh (3,) float64: the ground normal in the robot frame that was taken for the vertical.
        normal: Vector3<f64> = own.frame.normal,
        /// Where radial lines meet, (u, v); None but for the method "radial".
        center_px: Option<(f64, f64)> = own.frame.center_px.map(|center| (center.x, center.y)),
        /// Tells the camera and the mounting that found the lines from others, 32 bits; None where they are not known.
        seen_by: Option<u32> = own.frame.seen_by,
    }
    make {
        let n = bearing_rad.len();
        let others = [&sigma_rad, &elevation_min_rad, &elevation_max_rad, &polarity].map(Vec::len);
        if support_px.len() != n || others.iter().any(|m| *m != n) {
            return Err(invalid(format!("values: lists of different lengths, expected {n} of each")));
        }
        let line = |i: usize| Line {
            bearing_rad: bearing_rad[i],
            sigma_rad: sigma_rad[i],
            support_px: support_px[i],
            elevation_min_rad: elevation_min_rad[i],
            elevation_max_rad: elevation_max_rad[i],
            polarity: polarity[i],
        };
        let frame = LineFrame { normal, center_px: center_px.map(|(u, v)| [u, v].into()), seen_by };
        let made = core::Lines { lines: (0..n).map(line).collect(), frame };
        made.check().map_err(|error| exception(&error))?;
        made
    };
    repr {
        let degrees: Vec<String> = own.lines.iter().map(|l| format!("{:.1}", l.bearing_rad.to_degrees())).collect();
        format!("Lines({} at {} deg)", own.lines.len(), degrees.join(", "))
    };
}

fn column<T>(lines: &core::Lines, pick: fn(&Line) -> T) -> Vec<T> {
    lines.lines.iter().map(pick).collect()
}

#[pymethods]
impl Lines {
    fn __len__(&self) -> usize {
        self.inner.lines.len()
    }

    /// Refuses a camera, or a mounting of it, other than that which found the lines.
    #[pyo3(signature = (camera: "Camera", robot_from_camera: "ArrayLike | None"))]
    fn _check_seen_by(&self, camera: &Bound<'_, PyAny>, robot_from_camera: Option<&Bound<'_, PyAny>>) -> PyResult<()> {
        let (camera, rotation) = (reader::camera(camera)?, reader::robot_from_camera(robot_from_camera)?);
        let frame = &self.inner.frame;
        let own = core::fingerprint(&camera.get().inner, &rotation, frame.center_px.is_some());
        frame.check_seen_by(own).map_err(|error| exception(&error))
    }
}
