//! The macro of the classes that read the images of one camera, and what their constructors take.

use nalgebra::Matrix3;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple, PyType};

use crate::camera::Camera;
use crate::convert;

/// What a frozen class of `inner`, `camera` and a pool of `scratch` has beside its own methods: the camera, the method and the
/// options as attributes, equality, hash, copies and pickle. `$placed` is the keyword that it takes beside the options.
macro_rules! image_reader {
    ($class:ident, $scratch:ty, $placed:ident) => {
        #[pyo3::pymethods]
        impl $class {
            /// The camera whose images are read.
            #[getter]
            fn camera(&self, py: pyo3::Python<'_>) -> pyo3::Py<$crate::camera::Camera> {
                self.camera.clone_ref(py)
            }

            /// The name of the method.
            #[getter]
            fn method(&self) -> &'static str {
                self.inner.options().method.name()
            }

            /// The options that are in force, by name, defaults included; a fresh dict, good as keywords.
            #[getter]
            fn options<'py>(&self, py: pyo3::Python<'py>) -> pyo3::PyResult<pyo3::Bound<'py, pyo3::types::PyDict>> {
                $crate::options::in_force(py, self.inner.options())
            }

            fn __reduce__<'py>(slf: &pyo3::Bound<'py, Self>) -> pyo3::PyResult<pyo3::Bound<'py, pyo3::types::PyTuple>> {
                let (py, this) = (slf.py(), slf.get());
                let keywords = this.options(py)?;
                keywords.set_item("method", this.method())?;
                keywords.set_item(stringify!($placed), this.$placed(py)?)?;
                $crate::reader::remade(&slf.get_type(), this.camera(py), &keywords)
            }
        }

        $crate::value::frozen!($class, |own| (own.inner.camera(), own.inner.$placed(), own.inner.options()), |own| (
            own.method(),
            own.inner.camera().width(),
            own.inner.camera().height()
        ));

        impl $class {
            fn with_scratch<R: Send>(
                &self,
                py: pyo3::Python<'_>,
                work: impl FnOnce(&mut $scratch) -> Result<R, tiltvp_core::Error> + Send,
            ) -> pyo3::PyResult<R> {
                self.scratch.with(py, self.inner.camera(), || self.inner.scratch(), work)
            }
        }
    };
}
pub(crate) use image_reader;

/// What pickle keeps of an object that is made again from its camera and keywords.
pub(crate) fn remade<'py>(
    class: &Bound<'py, PyType>,
    camera: Py<Camera>,
    keywords: &Bound<'py, PyDict>,
) -> PyResult<Bound<'py, PyTuple>> {
    let py = class.py();
    let make = py.import("functools")?.getattr("partial")?.call((class, camera), Some(keywords))?;
    (make, PyTuple::empty(py)).into_pyobject(py)
}

/// The camera that a constructor was given.
pub(crate) fn camera<'a, 'py>(camera: &'a Bound<'py, PyAny>) -> PyResult<&'a Bound<'py, Camera>> {
    convert::object(camera, "camera", "a tiltvp.Camera")
}

/// The rotation that was given, or the identity.
pub(crate) fn robot_from_camera(rotation: Option<&Bound<'_, PyAny>>) -> PyResult<Matrix3<f64>> {
    rotation.map_or(Ok(Matrix3::identity()), |rotation| convert::matrix3(rotation, "robot_from_camera"))
}
