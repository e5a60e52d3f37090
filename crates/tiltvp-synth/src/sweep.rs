//! Rendering one frame of a drive: rays from a table, one per pixel, and more where surfaces meet.

use nalgebra::{Matrix3, Vector2, Vector3};
use rayon::prelude::*;
use tiltvp_core::camera::Camera;
use tiltvp_core::interrupt::check;

use crate::builder::Material;
use crate::lights::Lights;
use crate::scene::Contact;
use crate::tiles::{Candidate, Cone, SIDES, VisibleFacets};
use crate::tone::{Film, RenderOptions};
use crate::world::{Ray, World, mirrored};

/// The rays of a camera, in its own frame, and the cones of its tiles.
pub(crate) struct Rays {
    width: usize,
    height: usize,
    bearings: Vec<Option<Vector3<f64>>>,
    /// Per pixel, for one pixel to the right and one down.
    steps: Vec<[Vector3<f64>; 2]>,
    /// The angle off the axis, in right angles.
    off_axis: Vec<f64>,
    /// Per side of [`SIDES`], row by row.
    cones: Vec<Vec<Option<Cone>>>,
}

impl Rays {
    /// The rays through the middles of all pixels, made in parallel on the current rayon pool, that see more than `blind_rad` aside of the camera's `z` axis.
    pub(crate) fn new(camera: &Camera, blind_rad: f64) -> Self {
        let (width, height) = (camera.width() as usize, camera.height() as usize);
        let middle = |k: usize| Vector2::new((k % width) as f64, (k / width) as f64);
        let bearings: Vec<_> = (0..width * height)
            .into_par_iter()
            .map(|k| camera.unproject(&middle(k)).filter(|b| b.xy().norm().atan2(b.z.abs()) >= blind_rad))
            .collect();
        let step = |k: usize, aside: Vector2<f64>| {
            let near = |sign: f64| camera.unproject(&(middle(k) + aside * (0.5 * sign)));
            match (near(-1.0), bearings[k], near(1.0)) {
                (Some(a), _, Some(b)) => b - a,
                (Some(a), Some(b), None) | (None, Some(a), Some(b)) => (b - a) * 2.0,
                _ => Vector3::zeros(),
            }
        };
        let steps: Vec<_> =
            (0..width * height).into_par_iter().map(|k| [step(k, Vector2::x()), step(k, Vector2::y())]).collect();
        let cones = SIDES.map(|side| {
            let (nx, ny) = (width.div_ceil(side), height.div_ceil(side));
            let of_tile = |tile: usize| {
                let pixels = pixels([tile % nx, tile / nx], side, [width, height]);
                let known: Vec<usize> = pixels.filter(|&k| bearings[k].is_some()).collect();
                let directions: Vec<Vector3<f64>> = known.iter().filter_map(|&k| bearings[k]).collect();
                let margin = known.iter().map(|&k| steps[k][0].norm() + steps[k][1].norm()).fold(0.0, f64::max);
                Cone::around(&directions, margin)
            };
            (0..nx * ny).into_par_iter().map(of_tile).collect()
        });
        let angle = |b: &Vector3<f64>| b.xy().norm().atan2(b.z.abs()) / std::f64::consts::FRAC_PI_2;
        let off_axis = bearings.iter().map(|b| b.as_ref().map_or(0.0, angle)).collect();
        Self { width, height, bearings, steps, off_axis, cones: cones.into() }
    }

    /// The ray through a place of a pixel, from its middle on.
    fn bearing(&self, k: usize, dx: f64, dy: f64) -> Option<Vector3<f64>> {
        let [right, down] = self.steps[k];
        self.bearings[k].map(|bearing| (bearing + right * dx + down * dy).normalize())
    }

    fn cone(&self, level: usize, at: [usize; 2]) -> Option<Cone> {
        self.cones[level][at[1] * self.width.div_ceil(SIDES[level]) + at[0]]
    }
}

/// The pixels of a tile, row by row.
fn pixels(at: [usize; 2], side: usize, [width, height]: [usize; 2]) -> impl Iterator<Item = usize> {
    let columns = at[0] * side..((at[0] + 1) * side).min(width);
    let rows = at[1] * side..((at[1] + 1) * side).min(height);
    rows.flat_map(move |y| columns.clone().map(move |x| y * width + x))
}

/// A smallest tile, and what its rays, and their mirror images, may meet.
struct Tile {
    at: [usize; 2],
    direct: Vec<Candidate>,
    mirrored: Vec<Candidate>,
}

/// What a ray meets, and what it is mirrored to.
#[derive(Debug, Clone, Copy)]
struct Meeting {
    direct: Option<Contact>,
    mirrored: Option<Contact>,
}

/// Stands for no surface.
const NOTHING: u32 = u32::MAX;

/// Stands for the surfaces of a pixel without a ray.
const BLIND: [u32; 2] = [u32::MAX - 1; 2];

impl Meeting {
    /// Which surfaces are seen, directly and mirrored.
    fn surfaces(&self) -> [u32; 2] {
        let number = |contact: &Option<Contact>| contact.as_ref().map_or(NOTHING, |c| c.patch as u32);
        [number(&self.direct), number(&self.mirrored)]
    }
}

/// One look at a world.
pub(crate) struct Sweep<'a> {
    world: &'a World,
    rays: &'a Rays,
    center: Vector3<f64>,
    world_from_camera: Matrix3<f64>,
    direct: VisibleFacets,
    /// Only where the floor shines.
    mirrored: Option<VisibleFacets>,
}

impl<'a> Sweep<'a> {
    /// A look from a point of a room.
    pub(crate) fn new(world: &'a World, rays: &'a Rays, center: Vector3<f64>, world_from_camera: Matrix3<f64>) -> Self {
        let scene = world.scene();
        let shines = scene.materials.iter().any(|material| matches!(material, Material::Polished(..)));
        let mirrored = shines.then(|| VisibleFacets::mirrored(scene, &center));
        Self { world, rays, center, world_from_camera, direct: VisibleFacets::new(scene, &center), mirrored }
    }

    /// The light on every pixel.
    pub(crate) fn film(&self, lights: &Lights<'_>, options: &RenderOptions) -> Film {
        let (width, height) = (self.rays.width, self.rays.height);
        let side = SIDES[0];
        let all = self.direct.all();
        let all_mirrored = self.mirrored.as_ref().map(VisibleFacets::all).unwrap_or_default();
        let bands: Vec<(Vec<Tile>, Vec<Option<Meeting>>)> = (0..height.div_ceil(side))
            .into_par_iter()
            .map(|band| {
                let mut tiles = Vec::new();
                for column in 0..width.div_ceil(side) {
                    check();
                    self.split(0, [column, band], &all, &all_mirrored, &mut tiles);
                }
                let first = band * side * width;
                let mut met = vec![None; (height * width - first).min(side * width)];
                for tile in &tiles {
                    for k in pixels(tile.at, SIDES[SIDES.len() - 1], [width, height]) {
                        met[k - first] = self.rays.bearings[k].map(|b| self.meet(tile, &(self.world_from_camera * b)));
                    }
                }
                (tiles, met)
            })
            .collect();
        let surface = |met: &Option<Meeting>| met.as_ref().map_or(BLIND, Meeting::surfaces);
        let surfaces: Vec<[u32; 2]> = bands.iter().flat_map(|band| band.1.iter().map(surface)).collect();
        let mut light = vec![[0f32; 3]; width * height];
        light.par_chunks_mut(side * width).zip(&bands).enumerate().for_each(|(band, (light, (tiles, met)))| {
            let first = band * side * width;
            for tile in tiles {
                check();
                for k in pixels(tile.at, SIDES[SIDES.len() - 1], [width, height]) {
                    if let Some(meeting) = met[k - first] {
                        let single = options.samples == 1 || !self.is_mixed(&surfaces, &meeting, k);
                        let color = if single {
                            self.shade(k, meeting, lights)
                        } else {
                            self.pixel(tile, k, options.samples, lights)
                        };
                        light[k - first] = self.dimmed(k, color, options.vignetting);
                    }
                }
            }
        });
        Film { width, light, valid: self.rays.bearings.iter().map(Option::is_some).collect() }
    }

    /// Sorts out what the rays of a tile, and of those in it, may meet.
    fn split(&self, level: usize, at: [usize; 2], direct: &[Candidate], mirror: &[Candidate], tiles: &mut Vec<Tile>) {
        let Some(cone) = self.rays.cone(level, at) else { return };
        let cone = cone.turned(&self.world_from_camera);
        let mut tile = Tile { at, direct: Vec::new(), mirrored: Vec::new() };
        self.direct.candidates(direct, &cone, &mut tile.direct);
        if let Some(facets) = &self.mirrored
            && self.direct.meets_polish(&tile.direct, self.world.scene())
        {
            facets.candidates(mirror, &cone.mirrored(), &mut tile.mirrored);
        }
        if level + 1 == SIDES.len() {
            tiles.push(tile);
            return;
        }
        let (side, ratio) = (SIDES[level + 1], SIDES[level] / SIDES[level + 1]);
        for k in 0..ratio * ratio {
            let part = [at[0] * ratio + k % ratio, at[1] * ratio + k / ratio];
            if part[0] * side < self.rays.width && part[1] * side < self.rays.height {
                self.split(level + 1, part, &tile.direct, &tile.mirrored, tiles);
            }
        }
    }

    fn meet(&self, tile: &Tile, direction: &Vector3<f64>) -> Meeting {
        let direct = self.direct.cast(&tile.direct, direction);
        let shines = direct.is_some_and(|c| matches!(self.world.scene().material(c.patch), Material::Polished(..)));
        let mirrored = self.mirrored.as_ref().filter(|_| shines);
        Meeting { direct, mirrored: mirrored.and_then(|s| s.cast(&tile.mirrored, &mirrored_direction(direction))) }
    }

    /// Whether a pixel sees another surface than one of its neighbours, or what it sees has edges of its own.
    fn is_mixed(&self, surfaces: &[[u32; 2]], meeting: &Meeting, k: usize) -> bool {
        let width = self.rays.width;
        let (x, y) = (k % width, k / width);
        let (first, last) = (x.saturating_sub(1), (x + 1).min(width - 1));
        for row in y.saturating_sub(1)..=(y + 1).min(self.rays.height - 1) {
            for other in &surfaces[row * width + first..=row * width + last] {
                if *other != surfaces[k] && *other != BLIND {
                    return true;
                }
            }
        }
        meeting.direct.is_some_and(|contact| self.world.is_patterned(&contact))
    }

    /// The light on a pixel from its middle's ray.
    fn shade(&self, k: usize, meeting: Meeting, lights: &Lights<'_>) -> [f64; 3] {
        let Some(bearing) = self.rays.bearings[k] else { return [0.0; 3] };
        let (direction, spread) = (self.world_from_camera * bearing, self.rays.steps[k][0].norm());
        let ray = Ray { origin: &self.center, direction: &direction, spread };
        self.world.seen(&ray, meeting.direct, lights, || meeting.mirrored)
    }

    /// The light on a pixel: `n` by `n` rays say how much of it each surface fills, and one of them what that looks like.
    fn pixel(&self, tile: &Tile, k: usize, n: usize, lights: &Lights<'_>) -> [f64; 3] {
        let spread = self.rays.steps[k][0].norm() / n as f64;
        let shade = |direction: &Vector3<f64>, meeting: Meeting| {
            let ray = Ray { origin: &self.center, direction, spread };
            self.world.seen(&ray, meeting.direct, lights, || meeting.mirrored)
        };
        let mut known: Vec<([u32; 2], [f64; 3])> = Vec::with_capacity(4);
        let mut sum = [0.0; 3];
        for sample in 0..n * n {
            let place = |cell: usize| (cell as f64 + 0.5) / n as f64 - 0.5;
            let Some(bearing) = self.rays.bearing(k, place(sample % n), place(sample / n)) else { continue };
            let direction = self.world_from_camera * bearing;
            let meeting = self.meet(tile, &direction);
            let surfaces = meeting.surfaces();
            let same = known.iter().find(|(seen, _)| *seen == surfaces).map(|(_, color)| *color);
            let color = same.unwrap_or_else(|| shade(&direction, meeting));
            // In the sun, or through a window, a surface has edges of its own.
            let is_plain = meeting.direct.is_some_and(|contact| !self.world.is_patterned(&contact));
            if same.is_none() && is_plain {
                known.push((surfaces, color));
            }
            for c in 0..3 {
                sum[c] += color[c] / (n * n) as f64;
            }
        }
        sum
    }

    /// The light that the lens lets through at a pixel.
    fn dimmed(&self, k: usize, color: [f64; 3], vignetting: f64) -> [f32; 3] {
        let off_axis = self.rays.off_axis[k];
        let kept = (1.0 - vignetting * off_axis * off_axis).max(0.0);
        color.map(|c| (c * kept) as f32)
    }
}

fn mirrored_direction(direction: &Vector3<f64>) -> Vector3<f64> {
    mirrored(&Vector3::zeros(), direction).1
}
