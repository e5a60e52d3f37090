//! `Laboratory`: a coloured cuboid in a room.

use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::PyDict;
use tiltvp_synth::{LaboratoryOptions, World, on_threads};

use crate::call::call;
use crate::convert;
use crate::synth::{seed_from, threads_from};

/// A plain room with a coloured cuboid on its floor.
#[pyclass(frozen, subclass, module = "tiltvp._core")]
pub(crate) struct Laboratory {
    options: LaboratoryOptions,
    pub(crate) world: Arc<World>,
}

#[pymethods]
impl Laboratory {
    #[new]
    #[pyo3(signature = (
        seed, *, size_m=None, gamma_rad=None, clutter=None, side_light=None, light_spacing_m=None, threads=None
    ))]
    #[expect(clippy::too_many_arguments, reason = "keyword-only on the Python side")]
    fn new(
        py: Python<'_>,
        seed: &Bound<'_, PyAny>,
        size_m: Option<&Bound<'_, PyAny>>,
        gamma_rad: Option<f64>,
        clutter: Option<f64>,
        side_light: Option<f64>,
        light_spacing_m: Option<f64>,
        threads: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let own = LaboratoryOptions::default();
        let options = LaboratoryOptions {
            seed: seed_from(seed)?,
            size_m: size_m.map_or(Ok(own.size_m), |size| Ok::<_, PyErr>(convert::vector3(size, "size_m")?.into()))?,
            gamma_rad: gamma_rad.unwrap_or(own.gamma_rad),
            clutter: clutter.unwrap_or(own.clutter),
            side_light: side_light.unwrap_or(own.side_light),
            light_spacing_m: light_spacing_m.unwrap_or(own.light_spacing_m),
        };
        let threads = threads_from(threads)?;
        let world = call(py, || on_threads(threads, || World::laboratory(&options))?)?;
        Ok(Self { options, world: Arc::new(world) })
    }

    /// The seed of everything in it.
    #[getter]
    fn seed(&self) -> u64 {
        self.options.seed
    }

    /// Lengths of the cuboid's edges x, y, z, metres.
    #[getter]
    fn size_m(&self) -> (f64, f64, f64) {
        self.options.size_m.into()
    }

    /// The angle between the cuboid's level edges, radians.
    #[getter]
    fn gamma_rad(&self) -> f64 {
        self.options.gamma_rad
    }

    /// How full the walls are, from 0 to 1.
    #[getter]
    fn clutter(&self) -> f64 {
        self.options.clutter
    }

    /// Power of the lamp beside the cuboid, from 0 to 1.
    #[getter]
    fn side_light(&self) -> f64 {
        self.options.side_light
    }

    /// Spacing of the points where light was gathered, metres.
    #[getter]
    fn light_spacing_m(&self) -> f64 {
        self.options.light_spacing_m
    }

    fn __repr__(&self) -> String {
        let (own, plain, mut text) =
            (&self.options, LaboratoryOptions::default(), format!("Laboratory({}", self.options.seed));
        if own.size_m != plain.size_m {
            text = format!("{text}, size_m={:?}", self.size_m());
        }
        let numbers = [
            ("gamma_rad", own.gamma_rad, plain.gamma_rad),
            ("clutter", own.clutter, plain.clutter),
            ("side_light", own.side_light, plain.side_light),
            ("light_spacing_m", own.light_spacing_m, plain.light_spacing_m),
        ];
        for (name, value, _) in numbers.into_iter().filter(|(_, value, usual)| value != usual) {
            text = format!("{text}, {name}={value:?}");
        }
        text + ")"
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        other.cast::<Self>().is_ok_and(|other| self.options == other.get().options)
    }

    fn __hash__(&self) -> u64 {
        self.options.seed.wrapping_mul(31).wrapping_add(7)
    }

    fn __getnewargs_ex__<'py>(&self, py: Python<'py>) -> PyResult<((u64,), Bound<'py, PyDict>)> {
        let keywords = PyDict::new(py);
        keywords.set_item("size_m", self.size_m())?;
        keywords.set_item("gamma_rad", self.options.gamma_rad)?;
        keywords.set_item("clutter", self.options.clutter)?;
        keywords.set_item("side_light", self.options.side_light)?;
        keywords.set_item("light_spacing_m", self.options.light_spacing_m)?;
        Ok(((self.options.seed,), keywords))
    }
}
