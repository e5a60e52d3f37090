//! `Laboratory`: a coloured cuboid in a room.

use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::PyDict;
use tiltvp_synth::{LaboratoryOptions, World};

use crate::options;
use crate::synth::{call_on_threads, seed_from};
use crate::value::{frozen, getters};

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
        let options =
            options::given(LaboratoryOptions { seed: seed_from(seed)?, ..LaboratoryOptions::default() }, options)?;
        let world = call_on_threads(py, threads, || World::laboratory(&options))?;
        Ok(Self { options, world: Arc::new(world) })
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

getters! {
    Laboratory as own {
        /// The seed of everything in it.
        seed: u64 = own.options.seed,
        /// Lengths of the cuboid's edges x, y, z, metres.
        size_m: (f64, f64, f64) = own.options.size_m.into(),
        /// The angle between the cuboid's level edges, radians.
        gamma_rad: f64 = own.options.gamma_rad,
        /// Side of the ArUco markers on the coloured faces, metres; 0 for none.
        marker_m: f64 = own.options.marker_m,
        /// How full the walls are, from 0 to 1.
        clutter: f64 = own.options.clutter,
        /// Power of the lamp beside the cuboid, from 0 to 1.
        side_light: f64 = own.options.side_light,
        /// Spacing of the points where light was gathered, metres.
        light_spacing_m: f64 = own.options.light_spacing_m,
    }
}

frozen!(Laboratory, |own| &own.options, |own| own.options.seed);
