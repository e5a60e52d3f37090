//! `Laboratory`: a coloured cuboid in a room.

use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::PyDict;
use tiltvp_synth::{LaboratoryOptions, World, on_threads};

use crate::call::call_long;
use crate::options;
use crate::synth::{seed_from, threads_from};
use crate::value::frozen;

/// A plain room with a coloured cuboid, to be looked at by `tiltvp.synth.StereoSequence`.
///
/// Frozen, comparable, hashable, and to be pickled. It is built and lit on `threads` threads (None: one per core), on
/// which it does not depend.
#[pyclass(frozen, subclass, module = "tiltvp._core")]
pub(crate) struct Laboratory {
    pub(crate) options: LaboratoryOptions,
    pub(crate) world: Arc<World>,
}

#[pymethods]
impl Laboratory {
    #[new]
    #[pyo3(signature = (seed: "SupportsIndex", *, threads: "SupportsIndex | None" = None, **options: "Option | None"))]
    fn new(
        py: Python<'_>,
        seed: &Bound<'_, PyAny>,
        threads: Option<&Bound<'_, PyAny>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let mut parsed = LaboratoryOptions { seed: seed_from(seed)?, ..LaboratoryOptions::default() };
        options::set_given(&mut parsed, options)?;
        let options = parsed;
        let threads = threads_from(threads)?;
        let world = call_long(py, || on_threads(threads, || World::laboratory(&options))?)?;
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

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let usual = LaboratoryOptions { seed: self.options.seed, ..LaboratoryOptions::default() };
        let others = options::shown_beside(py, &self.options, &usual)?;
        Ok(format!("Laboratory({}{others})", self.options.seed))
    }

    fn __getnewargs_ex__<'py>(&self, py: Python<'py>) -> PyResult<((u64,), Bound<'py, PyDict>)> {
        let keywords = options::in_force_without(py, &self.options, &["seed"])?;
        Ok(((self.options.seed,), keywords))
    }
}

frozen!(Laboratory, |own| &own.options, |own| own.options.seed);
