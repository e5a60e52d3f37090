//! `Leveller`: level images of one camera.

use std::sync::Arc;

use numpy::PyReadwriteArray1;
use pyo3::prelude::*;
use tiltvp_core::tilt as core;

use crate::array::Array;
use crate::call::{call, call_long, invalid};
use crate::camera::Camera;
use crate::convert;
use crate::reader;

/// Level images of one camera, as another camera would take them on the upright robot, or along given rays.
///
/// The rays of their pixels are made once. `tiltvp.Leveller` and `tiltvp.Unwrapper` say what is shown. `camera` is the
/// camera whose images will come, `robot_from_camera` (3, 3) its mounting, by default the identity; what is shown is
/// what the camera `shown` sees that is mounted by `robot_from_shown`, or the `rays` (H W, 3) of the robot frame of an
/// image of `columns` columns, NaN where it shows nothing.
#[pyclass(frozen, module = "tiltvp._core")]
pub(crate) struct Leveller {
    inner: Arc<core::Leveller>,
    camera: Py<Camera>,
}

#[pymethods]
impl Leveller {
    #[new]
    #[pyo3(signature = (
        camera, shown = None, *, robot_from_camera: "ArrayLike | None" = None,
        robot_from_shown: "ArrayLike | None" = None, rays: "ArrayLike | None" = None, columns = 0,
    ))]
    fn new(
        py: Python<'_>,
        camera: &Bound<'_, Camera>,
        shown: Option<&Bound<'_, Camera>>,
        robot_from_camera: Option<&Bound<'_, PyAny>>,
        robot_from_shown: Option<&Bound<'_, PyAny>>,
        rays: Option<&Bound<'_, PyAny>>,
        columns: usize,
    ) -> PyResult<Self> {
        let mounting = reader::robot_from_camera(robot_from_camera)?;
        let lens = camera.get().inner.clone();
        let inner = match (shown, rays) {
            (Some(shown), None) => {
                let shown = shown.get().inner.clone();
                let own = robot_from_shown.map(|own| convert::matrix3(own, "robot_from_shown")).transpose()?;
                call_long(py, || core::Leveller::new(lens, &mounting, shown, &own.unwrap_or(mounting)))?
            }
            (None, Some(rays)) => {
                let rays = convert::rows::<3>(rays, "rays")?.0;
                let rays: Vec<_> = rays.iter().map(|ray| ray.map(|x| x as f32)).collect();
                call_long(py, || core::Leveller::from_rays(lens, &mounting, columns, &rays))?
            }
            _ => return Err(invalid("shown, rays: both or none, expected one of them".to_owned())),
        };
        Ok(Self { inner: Arc::new(inner), camera: camera.clone().unbind() })
    }

    /// The camera whose images are made level.
    #[getter]
    fn camera(&self, py: Python<'_>) -> Py<Camera> {
        self.camera.clone_ref(py)
    }

    /// (3, 3): R of v_robot = R v_camera.
    #[getter]
    fn robot_from_camera<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
        convert::to_matrix(py, self.inner.robot_from_camera())
    }

    /// (H, W): rows and columns of level images.
    #[getter]
    fn shape(&self) -> (usize, usize) {
        (self.inner.height(), self.inner.width())
    }

    /// The map of level images by a tilt, which is given as the ground normal (3,) of the robot frame.
    fn _map(&self, py: Python<'_>, normal: &Bound<'_, PyAny>) -> PyResult<LevelMap> {
        let tilt = convert::tilt(normal, "normal")?;
        call(py, || Ok(LevelMap(self.inner.map(&tilt))))
    }
}

/// See `Leveller._map`.
#[pyclass(frozen, module = "tiltvp._core")]
pub(crate) struct LevelMap(core::LevelMap);

#[pymethods]
impl LevelMap {
    /// Rows that are written together.
    #[getter]
    fn strip_rows(&self) -> usize {
        self.0.strip_rows()
    }

    /// Writes, for the pixels of the strip of that number, the columns and the rows (h W,) of those of the leaning image that
    /// show the same; `unseen` for none. Only those from the first column to before the last are written, the two that are
    /// returned: nothing is seen beside them.
    #[pyo3(signature = (number, columns: "NDArray[np.float32]", rows: "NDArray[np.float32]", unseen))]
    fn write_strip(
        &self,
        py: Python<'_>,
        number: usize,
        mut columns: PyReadwriteArray1<'_, f32>,
        mut rows: PyReadwriteArray1<'_, f32>,
        unseen: f32,
    ) -> PyResult<(usize, usize)> {
        let places = [columns.as_slice_mut()?, rows.as_slice_mut()?];
        call(py, || {
            let seen = self.0.write_strip(number, places, unseen)?;
            Ok((seen.start, seen.end))
        })
    }
}
