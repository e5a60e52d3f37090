//! `Leveller`: level images of one camera.

use numpy::{PyArray1, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::prelude::*;
use tiltvp_core::tilt as core;

use crate::array::Array;
use crate::call::{call, call_long, exception, invalid};
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
    inner: core::Leveller,
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
                let rays = rays.iter().map(|ray| ray.map(|x| x as f32)).collect();
                core::Leveller::from_rays(lens, &mounting, columns, rays).map_err(|error| exception(&error))?
            }
            _ => return Err(invalid("shown, rays: both or none, expected one of them".to_owned())),
        };
        Ok(Self { inner, camera: camera.clone().unbind() })
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

    /// (H, W) or (H, W, 3): the level image of one of the camera, C-contiguous uint8.
    #[pyo3(signature = (image: "NDArray[np.uint8]", normal: "ArrayLike") -> "NDArray[np.uint8]")]
    fn _level<'py>(
        &self,
        py: Python<'py>,
        image: &Bound<'py, PyAny>,
        normal: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let tilt = convert::tilt(normal, "normal")?;
        let (height, width) = self.shape();
        let level = |data: &[u8], got: &[usize], channels: usize| {
            let lens = self.inner.camera();
            let expected = [lens.height() as usize, lens.width() as usize];
            if got[..2] != expected {
                return Err(invalid(format!("image: shape {got:?}, expected {expected:?}, as the camera's images")));
            }
            let level = call(py, || self.inner.level(data, channels, &tilt))?;
            Ok(PyArray1::from_vec(py, level))
        };
        let slice = |error| invalid(format!("image: {error}"));
        if let Ok(gray) = convert::gray(image, "image") {
            let level = level(gray.as_slice().map_err(slice)?, gray.shape(), 1)?;
            return Ok(level.reshape([height, width])?.into_any());
        }
        let color = convert::color(image, "image")?;
        let level = level(color.as_slice().map_err(slice)?, color.shape(), 3)?;
        Ok(level.reshape([height, width, 3])?.into_any())
    }

    /// (H, W, 2): where each pixel (u, v) of the level image is in the leaning one; NaN where it was not seen.
    #[pyo3(signature = (normal: "ArrayLike") -> "NDArray[np.float32]")]
    fn _map<'py>(&self, py: Python<'py>, normal: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let tilt = convert::tilt(normal, "normal")?;
        let map = call(py, || Ok(self.inner.map(&tilt)))?;
        let (height, width) = self.shape();
        Ok(PyArray1::from_slice(py, map.as_flattened()).reshape([height, width, 2])?.into_any())
    }
}
