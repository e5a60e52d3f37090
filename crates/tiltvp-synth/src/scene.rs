//! The finished geometry: flat patches in one triangle mesh, and the ray cast that finds the first of them.

use nalgebra::Vector3;
use parry3d_f64::math::Vector;
use parry3d_f64::query::{Ray, RayCast};
use parry3d_f64::shape::TriMesh;
use tiltvp_core::{Error, Result};

use crate::builder::{Builder, Material, Patch, Piece};

/// Where a ray meets a patch first.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Contact {
    pub(crate) patch: usize,
    pub(crate) distance: f64,
    /// Coordinates along `du` and `dv` in `[0, 1]`.
    pub(crate) at: [f64; 2],
}

/// The geometry of a world.
pub(crate) struct Scene {
    pub(crate) patches: Vec<Patch>,
    pub(crate) materials: Vec<Material>,
    pub(crate) pieces: Vec<Piece>,
    mesh: TriMesh,
    patch_of_triangle: Vec<u32>,
    /// Per patch the vectors whose dot products with `point - origin` are the coordinates along `du` and `dv`.
    duals: Vec<[Vector3<f64>; 2]>,
    normals: Vec<Vector3<f64>>,
}

fn parry(v: &Vector3<f64>) -> Vector {
    Vector::new(v.x, v.y, v.z)
}

impl Scene {
    /// Takes over the patches of a builder and builds their bounding volume hierarchy.
    pub(crate) fn new(builder: Builder) -> Result<Self> {
        let Builder { patches, pieces, materials, .. } = builder;
        let (mut vertices, mut indices) = (Vec::with_capacity(4 * pieces.len()), Vec::with_capacity(2 * pieces.len()));
        let mut patch_of_triangle = Vec::with_capacity(2 * pieces.len());
        for Piece { patch: k, low, high } in pieces.iter().copied() {
            let (patch, first) = (&patches[k], vertices.len() as u32);
            let at = |s: f64, t: f64| parry(&(patch.origin + patch.du * s + patch.dv * t));
            vertices.extend([at(low[0], low[1]), at(high[0], low[1]), at(low[0], high[1])]);
            indices.push([first, first + 1, first + 2]);
            patch_of_triangle.push(k as u32);
            if !patch.triangle {
                vertices.push(at(high[0], high[1]));
                indices.push([first + 1, first + 3, first + 2]);
                patch_of_triangle.push(k as u32);
            }
        }
        let mesh = TriMesh::new(vertices, indices)
            .map_err(|error| Error::argument("room", error.to_string(), "a room with surfaces"))?;
        let duals = patches
            .iter()
            .map(|p| {
                let n = p.du.cross(&p.dv);
                let area = n.norm_squared().max(f64::MIN_POSITIVE);
                [p.dv.cross(&n) / area, n.cross(&p.du) / area]
            })
            .collect();
        let normals = patches.iter().map(|p| p.du.cross(&p.dv).try_normalize(0.0).unwrap_or_else(Vector3::z)).collect();
        Ok(Self { patches, materials, pieces, mesh, patch_of_triangle, duals, normals })
    }

    /// The first patch that a ray meets within `reach` metres; `direction` is a unit vector.
    pub(crate) fn cast(&self, origin: &Vector3<f64>, direction: &Vector3<f64>, reach: f64) -> Option<Contact> {
        let ray = Ray::new(parry(origin), parry(direction));
        let shape = parry3d_f64::shape::CompositeShapeRef(&self.mesh);
        let (triangle, distance) = shape.cast_local_ray(&ray, reach, false)?;
        let patch = *self.patch_of_triangle.get(triangle as usize)? as usize;
        let offset = origin + direction * distance - self.patches[patch].origin;
        let [a, b] = &self.duals[patch];
        Some(Contact { patch, distance, at: [a.dot(&offset).clamp(0.0, 1.0), b.dot(&offset).clamp(0.0, 1.0)] })
    }

    /// Whether nothing stands within `reach` metres of a ray.
    pub(crate) fn is_clear(&self, origin: &Vector3<f64>, direction: &Vector3<f64>, reach: f64) -> bool {
        self.mesh.cast_local_ray(&Ray::new(parry(origin), parry(direction)), reach, false).is_none()
    }

    /// The unit normal of a patch's front.
    pub(crate) fn normal(&self, patch: usize) -> &Vector3<f64> {
        &self.normals[patch]
    }

    /// The vectors whose dot products with an offset from the patch's origin are its coordinates along `du` and `dv`.
    pub(crate) fn duals(&self, patch: usize) -> &[Vector3<f64>; 2] {
        &self.duals[patch]
    }

    /// What a patch is made of.
    pub(crate) fn material(&self, patch: usize) -> &Material {
        &self.materials[self.patches[patch].material]
    }

    /// The texture coordinates of a point of a patch, in metres.
    pub(crate) fn texture_coordinates(&self, contact: &Contact) -> [f64; 2] {
        let patch = &self.patches[contact.patch];
        [patch.uv[0] + contact.at[0] * patch.du.norm(), patch.uv[1] + contact.at[1] * patch.dv.norm()]
    }
}
