//! Light that was gathered once: direct light of lamps and windows with soft shadows, and one bounce between surfaces.

use nalgebra::Vector3;
use rayon::prelude::*;
use tiltvp_core::interrupt::check;

use crate::builder::Material;
use crate::noise::hash_unit;
use crate::outdoors::Outdoors;
use crate::scene::{Contact, Scene};
use crate::texture::{Color, Texture, add, luminance, scale};

/// How far points are lifted off their surface before rays start there, in metres: below what a texture shows, far above
/// rounding.
const LIFT_M: f64 = 2e-3;
/// Directions of the hemisphere in which bounced light is gathered, per bounce: the cost of a room goes with this number.
const GATHER: usize = 18;
/// Bounces that are followed: the light of lamps reaches the shadows by the first, the second fills corners.
const BOUNCES: usize = 2;
/// Sunlit spots that a point gathers light from, the same for all points of a room.
const SUN_SPOTS: usize = 10;
/// Points of a lamp or window, per side, from which light is gathered: nine make a soft shadow.
const LAMP_SIDE: usize = 3;

/// A lamp or window: a patch that shines.
struct Source {
    patch: usize,
    radiance: Color,
}

/// A grid of points on a patch, at its corners and between.
#[derive(Debug, Clone, Copy)]
struct Grid {
    first: usize,
    counts: [usize; 2],
}

impl Grid {
    /// The `k`-th point of a patch's grid, lifted off the surface.
    fn point(&self, scene: &Scene, patch: usize, k: usize) -> Vector3<f64> {
        let [nu, nv] = self.counts;
        let share = |i: usize, n: usize| if n == 1 { 0.4 } else { i as f64 / (n - 1) as f64 };
        lifted(scene, patch, [share(k % nu, nu), share(k / nu, nv)])
    }
}

/// A spot on which the sun shines, as a source of bounced light.
struct Spot {
    point: Vector3<f64>,
    normal: Vector3<f64>,
    /// Radiant exitance times area, and the area.
    flux: Color,
    area: f64,
}

/// The irradiance on every surface, on a grid of points per patch, and where the sun can reach.
pub(crate) struct LightMap {
    grids: Vec<Grid>,
    irradiance: Vec<[f32; 3]>,
    sunlit: Vec<bool>,
}

impl LightMap {
    /// Gathers the light of a scene at points about `spacing` metres apart.
    pub(crate) fn bake(scene: &Scene, outdoors: &Outdoors, spacing: f64) -> Self {
        Self::gathered(scene, outdoors, spacing, &sources(scene, outdoors))
    }

    /// The part of [`bake`](Self::bake) that comes in through the windows.
    pub(crate) fn bake_daylight(scene: &Scene, outdoors: &Outdoors, spacing: f64) -> Self {
        let mut sources = sources(scene, outdoors);
        sources.retain(|source| matches!(scene.material(source.patch), Material::Glass));
        Self::gathered(scene, outdoors, spacing, &sources)
    }

    fn gathered(scene: &Scene, outdoors: &Outdoors, spacing: f64, sources: &[Source]) -> Self {
        let mut first = 0;
        let grids: Vec<Grid> = scene
            .patches
            .iter()
            .map(|patch| {
                let count = |length: f64| if length < 0.08 { 1 } else { (length / spacing).ceil() as usize + 1 };
                let counts = [count(patch.du.norm()), count(patch.dv.norm())];
                let grid = Grid { first, counts };
                first += counts[0] * counts[1];
                grid
            })
            .collect();
        let means: Vec<Color> = scene.materials.iter().map(|m| m.texture().map_or([0.0; 3], Texture::mean)).collect();

        let direct = per_point(scene, &grids, |index, normal, point| {
            let sun = sun_reaches(scene, outdoors, normal, point);
            (direct_light(scene, sources, index, normal, point), sun)
        });
        let lit: Vec<bool> = direct.iter().map(|d| d.1).collect();
        let spots = sun_spots(scene, outdoors, &grids, &means, &lit);
        let mut own: Vec<Color> = direct.iter().map(|d| d.0).collect();
        smooth(&grids, &mut own, 1);
        let mut map = Self { sunlit: spread(&grids, &lit), irradiance: as_stored(&own), grids };
        let directions = cosine_directions();
        for _ in 0..BOUNCES {
            let mut bounced = per_point(scene, &map.grids, |index, normal, point| {
                let diffuse = map.gather(scene, &means, &directions, index, normal, point);
                add(diffuse, spot_light(scene, &spots, index, normal, point))
            });
            smooth(&map.grids, &mut bounced, 3);
            // Further bounces are taken as even in all directions: a share of the average light of the room.
            let average = [0, 1, 2].map(|i| bounced.iter().map(|b| b[i]).sum::<f64>() / bounced.len().max(1) as f64);
            for (b, d) in bounced.iter_mut().zip(&own) {
                *b = add(add(*b, *d), scale(average, 0.12));
            }
            map.irradiance = as_stored(&bounced);
        }
        map
    }

    /// The light that other surfaces send to a point, by rays of the cosine law, turned differently at every point.
    fn gather(
        &self,
        scene: &Scene,
        means: &[Color],
        directions: &[Vector3<f64>],
        index: usize,
        normal: &Vector3<f64>,
        point: &Vector3<f64>,
    ) -> Color {
        let basis = tiltvp_core::geometry::tangent_basis(normal);
        let (s, c) = (std::f64::consts::TAU * hash_unit(index as i64, 0, 1)).sin_cos();
        let mut sum = [0.0; 3];
        for d in directions {
            let direction =
                basis.column(0) * (c * d.x - s * d.y) + basis.column(1) * (s * d.x + c * d.y) + normal * d.z;
            if let Some(contact) = scene.cast(point, &direction, 50.0) {
                let (mean, light) = (means[scene.patches[contact.patch].material], self.at(&contact));
                for i in 0..3 {
                    sum[i] += mean[i] * light[i] / GATHER as f64;
                }
            }
        }
        sum
    }

    /// The irradiance, as luminance, of a well lit surface: four fifths of all points have less.
    pub(crate) fn typical(&self) -> f64 {
        let mut all: Vec<f64> = self.irradiance.iter().map(|l| luminance(l.map(f64::from))).collect();
        all.sort_by(f64::total_cmp);
        all.get(all.len() * 4 / 5).copied().unwrap_or(1.0)
    }

    /// The irradiance at a point of a patch, without the sun, interpolated between the points of its grid.
    pub(crate) fn at(&self, contact: &Contact) -> Color {
        let grid = self.grids[contact.patch];
        let [nu, nv] = grid.counts;
        let split = |t: f64, n: usize| {
            let x = t * (n - 1) as f64;
            let i = (x as usize).min(n.saturating_sub(2));
            (i, (i + 1).min(n - 1), x - i as f64)
        };
        let ((i0, i1, s), (j0, j1, t)) = (split(contact.at[0], nu), split(contact.at[1], nv));
        let get = |i: usize, j: usize, c: usize| f64::from(self.irradiance[grid.first + j * nu + i][c]);
        [0, 1, 2].map(|c| {
            let low = get(i0, j0, c) * (1.0 - s) + get(i1, j0, c) * s;
            let high = get(i0, j1, c) * (1.0 - s) + get(i1, j1, c) * s;
            low * (1.0 - t) + high * t
        })
    }

    /// Whether the sun shines on some point of the grid near here.
    pub(crate) fn sun_may_reach(&self, contact: &Contact) -> bool {
        self.sunlit[self.nearest(contact)]
    }

    fn nearest(&self, contact: &Contact) -> usize {
        let grid = self.grids[contact.patch];
        let [nu, nv] = grid.counts;
        let near = |t: f64, n: usize| (t * (n - 1) as f64 + 0.5) as usize;
        grid.first + near(contact.at[1], nv) * nu + near(contact.at[0], nu)
    }
}

/// Whether the sun shines on a point of a surface with the given normal: through glass, past everything else.
pub(crate) fn sun_reaches(scene: &Scene, outdoors: &Outdoors, normal: &Vector3<f64>, point: &Vector3<f64>) -> bool {
    outdoors.sun > 0.0
        && normal.dot(&outdoors.towards_sun) > 0.0
        && scene
            .cast(point, &outdoors.towards_sun, 100.0)
            .is_some_and(|contact| matches!(scene.material(contact.patch), Material::Glass))
}

/// A point of a patch, lifted to its front, and kept off the patch's rim.
fn lifted(scene: &Scene, patch: usize, at: [f64; 2]) -> Vector3<f64> {
    let p = &scene.patches[patch];
    let inset = |t: f64, length: f64| {
        let margin = (0.01 / length.max(1e-9)).min(0.25);
        t.clamp(margin, 1.0 - margin)
    };
    let (s, t) = (inset(at[0], p.du.norm()), inset(at[1], p.dv.norm()));
    p.origin + p.du * s + p.dv * t + scene.normal(patch) * LIFT_M
}

/// Evaluates something at every point of every grid, in parallel and in order.
fn per_point<T: Send>(
    scene: &Scene,
    grids: &[Grid],
    f: impl Fn(usize, &Vector3<f64>, &Vector3<f64>) -> T + Sync,
) -> Vec<T> {
    let per_patch: Vec<Vec<T>> = grids
        .par_iter()
        .enumerate()
        .map(|(patch, grid)| {
            let normal = scene.normal(patch);
            (0..grid.counts[0] * grid.counts[1])
                .map(|k| {
                    check();
                    f(grid.first + k, normal, &grid.point(scene, patch, k))
                })
                .collect()
        })
        .collect();
    per_patch.into_iter().flatten().collect()
}

/// Each point's flag or that of any of its neighbours on the grid.
fn spread(grids: &[Grid], flags: &[bool]) -> Vec<bool> {
    let mut out = Vec::with_capacity(flags.len());
    for grid in grids {
        let [nu, nv] = grid.counts;
        for j in 0..nv {
            for i in 0..nu {
                let rows = j.saturating_sub(1)..=(j + 1).min(nv - 1);
                let mut near = rows.flat_map(|y| (i.saturating_sub(1)..=(i + 1).min(nu - 1)).map(move |x| (x, y)));
                out.push(near.any(|(x, y)| flags[grid.first + y * nu + x]));
            }
        }
    }
    out
}

/// The light-map's storage of the gathered light.
fn as_stored(light: &[Color]) -> Vec<[f32; 3]> {
    light.iter().map(|l| l.map(|c| c as f32)).collect()
}

/// Averages noisy light with its neighbours on the grid, so many times.
fn smooth(grids: &[Grid], light: &mut [Color], times: usize) {
    for grid in grids {
        let [nu, nv] = grid.counts;
        let own = &mut light[grid.first..grid.first + nu * nv];
        for _ in 0..times {
            for (step, count, lines, stride) in [(1, nu, nv, nu), (nu, nv, nu, 1)] {
                for line in 0..lines {
                    let at = |k: usize| line * stride + k * step;
                    let mut before = own[at(0)];
                    for k in 0..count {
                        let (here, after) = (own[at(k)], own[at((k + 1).min(count - 1))]);
                        own[at(k)] = [0, 1, 2].map(|c| 0.3 * before[c] + 0.4 * here[c] + 0.3 * after[c]);
                        before = here;
                    }
                }
            }
        }
    }
}

fn sun_spots(scene: &Scene, outdoors: &Outdoors, grids: &[Grid], means: &[Color], lit: &[bool]) -> Vec<Spot> {
    let mut spots = Vec::new();
    for (patch, grid) in grids.iter().enumerate() {
        let (count, p) = (grid.counts[0] * grid.counts[1], &scene.patches[patch]);
        let normal = *scene.normal(patch);
        let area = p.du.cross(&p.dv).norm() / count as f64;
        let strength = outdoors.sun * normal.dot(&outdoors.towards_sun).max(0.0) * area;
        for k in (0..count).filter(|k| lit[grid.first + k]) {
            let flux = means[p.material].map(|mean| mean * strength);
            spots.push(Spot { point: grid.point(scene, patch, k), normal, flux, area });
        }
    }
    spots
}

/// The light of sunlit spots, from a few of them that stand for all.
fn spot_light(scene: &Scene, spots: &[Spot], index: usize, normal: &Vector3<f64>, point: &Vector3<f64>) -> Color {
    let mut sum = [0.0; 3];
    let count = SUN_SPOTS.min(spots.len());
    for k in 0..count {
        let share = (k as f64 + hash_unit(index as i64, k as i64, 2)) / count as f64;
        let spot = &spots[((share * spots.len() as f64) as usize).min(spots.len() - 1)];
        let to = spot.point - point;
        let distance = to.norm();
        if distance < 0.01 {
            continue;
        }
        let direction = to / distance;
        let (here, there) = (direction.dot(normal), -direction.dot(&spot.normal));
        if here > 0.0 && there > 0.0 && scene.is_clear(point, &direction, distance - 2.0 * LIFT_M) {
            let form = here * there / (std::f64::consts::PI * distance * distance + 0.2 + spot.area);
            sum = add(sum, scale(spot.flux, form * spots.len() as f64 / count as f64));
        }
    }
    sum
}

fn sources(scene: &Scene, outdoors: &Outdoors) -> Vec<Source> {
    (0..scene.patches.len())
        .filter_map(|patch| {
            let radiance = match scene.material(patch) {
                Material::Matt(_) | Material::Polished(..) => return None,
                Material::Lamp(radiance) => *radiance,
                Material::Glass => [0.80, 0.88, 1.0].map(|c| c * 0.7 * outdoors.brightness),
            };
            (radiance[1] > 0.0).then_some(Source { patch, radiance })
        })
        .collect()
}

fn direct_light(scene: &Scene, sources: &[Source], index: usize, normal: &Vector3<f64>, point: &Vector3<f64>) -> Color {
    let mut sum = [0.0; 3];
    for source in sources {
        let patch = &scene.patches[source.patch];
        let facing = scene.normal(source.patch);
        // Small lamps are sampled at one point.
        let area = patch.du.cross(&patch.dv).norm() * if patch.triangle { 0.5 } else { 1.0 };
        let side = if area < 0.03 { 1 } else { LAMP_SIDE };
        let part = area / (side * side) as f64;
        let mut form = 0.0;
        for k in 0..side * side {
            // Another place of the cell at every point, so that shadows have soft edges instead of steps.
            let place = |cell: usize, axis: i64| {
                let jitter = if side == 1 { 0.5 } else { hash_unit(index as i64, 2 * k as i64 + axis, 3) };
                (cell as f64 + jitter) / side as f64
            };
            let (s, t) = (place(k % side, 0), place(k / side, 1));
            let (s, t) = if patch.triangle { (0.33, 0.33) } else { (s, t) };
            let to = patch.origin + patch.du * s + patch.dv * t - point;
            let distance = to.norm();
            if distance < 1e-6 {
                continue;
            }
            let direction = to / distance;
            let (here, there) = (direction.dot(normal), -direction.dot(facing));
            if here > 0.0 && there > 0.0 && scene.is_clear(point, &direction, distance - 2.0 * LIFT_M) {
                form += here * there * part / (distance * distance + part);
            }
        }
        sum = add(sum, scale(source.radiance, form / std::f64::consts::PI));
    }
    sum
}

/// Directions spread over the hemisphere around `z` by the cosine law: a Fibonacci spiral.
fn cosine_directions() -> Vec<Vector3<f64>> {
    let golden = std::f64::consts::PI * (3.0 - 5.0f64.sqrt());
    (0..GATHER)
        .map(|k| {
            let radius = ((k as f64 + 0.5) / GATHER as f64).sqrt();
            let (s, c) = (golden * k as f64).sin_cos();
            Vector3::new(radius * c, radius * s, (1.0 - radius * radius).sqrt())
        })
        .collect()
}
