//! A world: a furnished room with its light, ready to be looked at.

use nalgebra::{Vector2, Vector3};
use tiltvp_core::{Error, Result};

use crate::builder::{Builder, Footprint, Material};
use crate::dice::Dice;
use crate::light::{LightMap, sun_reaches};
use crate::options::RoomOptions;
use crate::outdoors::Outdoors;
use crate::plan::Plan;
use crate::scene::Scene;
use crate::segment::Segment;
use crate::texture::Color;
use crate::view::RobotPose;
use crate::{furniture, shell};

/// Greatest radiance that the camera sees, in units of white in the room's light: what is brighter is burnt out anyway, and
/// would fray the edges of windows and lamps.
const GLARE: f64 = 3.0;

/// Radius of the circle a robot needs to stand, metres.
const ROBOT_RADIUS_M: f64 = 0.22;

/// Where a ray meets the world first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// How far from the ray's origin, metres.
    pub distance_m: f64,
    /// Unit normal of the surface, on the side the ray came from, world frame.
    pub normal: Vector3<f64>,
    /// Number of the flat surface that was hit.
    pub surface: usize,
}

/// A furnished, lit room with known truth; equal options give equal worlds.
///
/// ```
/// use tiltvp_synth::{RobotPose, RoomKind, RoomOptions, World};
/// let world = World::new(&RoomOptions { light_spacing_m: 0.5, ..RoomOptions::new(RoomKind::Office, 7) })?;
/// let pose: RobotPose = world.free_poses(1, 0)?[0];
/// assert!(!world.vertical_edges().is_empty());
/// # Ok::<(), tiltvp_core::Error>(())
/// ```
pub struct World {
    plan: Plan,
    scene: Scene,
    light: LightMap,
    /// From radiance to units of white in the room's light.
    unit: f64,
    outdoors: Outdoors,
    edges: Vec<Segment>,
    solids: Vec<Footprint>,
    /// Where the robot is meant to stand; empty for anywhere.
    places: Vec<Footprint>,
}

impl World {
    /// Draws, furnishes and lights a room. Light is gathered in parallel on the current rayon pool; the world does not depend
    /// on it.
    ///
    /// # Errors
    /// If the options are outside their domains.
    pub fn new(options: &RoomOptions) -> Result<Self> {
        options.validate()?;
        let mut dice = Dice::new(options.seed, options.kind as u64);
        let plan = Plan::draw(options, &mut dice);
        let outdoors = plan.outdoors;
        let mut builder = Builder::default();
        shell::build(&plan, &mut builder, &mut dice);
        let places = furniture::furnish(&plan, options, &mut builder, &mut dice);
        let edges = std::mem::take(&mut builder.edges);
        let solids = std::mem::take(&mut builder.solids);
        let scene = Scene::new(builder)?;
        let light = LightMap::bake(&scene, &outdoors, options.light_spacing_m);
        let unit = 1.0 / light.typical().max(1e-9);
        Ok(Self { plan, scene, light, unit, outdoors, edges, solids, places })
    }

    /// The vertical edges of walls, openings and furniture, visible or not.
    pub fn vertical_edges(&self) -> &[Segment] {
        &self.edges
    }

    /// The corners of the floor, counter-clockwise, metres.
    pub fn floor_outline(&self) -> &[Vector2<f64>] {
        &self.plan.outline
    }

    /// The height of the ceiling, metres.
    pub fn height_m(&self) -> f64 {
        self.plan.height
    }

    /// Whether a point is between the walls, above the floor and below the ceiling.
    pub fn contains(&self, point: &Vector3<f64>) -> bool {
        point.z > 0.0 && point.z < self.plan.height && self.plan.contains(&point.xy())
    }

    /// Whether a round robot of 0.22 m radius and less than 0.4 m height can stand with its centre here.
    pub fn is_free(&self, x_m: f64, y_m: f64) -> bool {
        let point = Vector2::new(x_m, y_m);
        self.plan.contains(&point)
            && self.plan.distance_to_walls(&point) > ROBOT_RADIUS_M
            && self.solids.iter().all(|solid| solid.distance(&point) > ROBOT_RADIUS_M)
    }

    /// Draws poses at which the robot stands free, with any heading.
    ///
    /// # Errors
    /// If the room is too full to find them.
    pub fn free_poses(&self, count: usize, seed: u64) -> Result<Vec<RobotPose>> {
        let mut dice = Dice::new(seed, 1 << 32);
        let (low, high) = self.plan.bounds();
        let mut poses = Vec::with_capacity(count);
        for _ in 0..20_000 + 2_000 * count {
            if poses.len() == count {
                break;
            }
            let point = Vector2::new(dice.within(low.x, high.x), dice.within(low.y, high.y));
            let meant = self.places.is_empty() || self.places.iter().any(|place| place.distance(&point) <= 0.0);
            if meant && self.is_free(point.x, point.y) {
                let yaw_rad = dice.within(-std::f64::consts::PI, std::f64::consts::PI);
                poses.push(RobotPose { x_m: point.x, y_m: point.y, yaw_rad });
            }
        }
        if poses.len() < count {
            return Err(Error::argument("count", count, format!("at most {} places in this room", poses.len())));
        }
        Ok(poses)
    }

    /// The first surface that a ray meets; none if the direction is zero or not finite.
    pub fn cast(&self, origin: &Vector3<f64>, direction: &Vector3<f64>) -> Option<Hit> {
        let direction = direction.try_normalize(0.0).filter(|d| d.iter().all(|c| c.is_finite()))?;
        let contact = self.scene.cast(origin, &direction, 1e3)?;
        let normal = *self.scene.normal(contact.patch);
        let normal = if normal.dot(&direction) > 0.0 { -normal } else { normal };
        Some(Hit { distance_m: contact.distance, normal, surface: contact.patch })
    }

    /// The linear radiance that arrives from a unit direction, in units of white in the room's light; `spread` is
    /// the angle that the ray stands for, radians.
    pub(crate) fn radiance(&self, origin: &Vector3<f64>, direction: &Vector3<f64>, spread: f64) -> Color {
        self.unscaled_radiance(origin, direction, spread).map(|c| (c * self.unit).min(GLARE))
    }

    fn unscaled_radiance(&self, origin: &Vector3<f64>, direction: &Vector3<f64>, spread: f64) -> Color {
        let Some(contact) = self.scene.cast(origin, direction, 1e3) else {
            return self.outdoors.radiance(direction);
        };
        match self.scene.material(contact.patch) {
            Material::Lamp(radiance) => *radiance,
            Material::Glass => self.outdoors.radiance(direction),
            Material::Matt(texture) => {
                let normal = self.scene.normal(contact.patch);
                let slant = normal.dot(direction).abs().max(0.1);
                let [u, v] = self.scene.texture_coordinates(&contact);
                let reflectance = texture.reflectance(u, v, contact.distance * spread / slant);
                let mut light = self.light.at(&contact);
                if self.light.sun_may_reach(&contact) {
                    let point = origin + direction * (contact.distance - 1e-3);
                    if sun_reaches(&self.scene, &self.outdoors, normal, &point) {
                        let sun = self.outdoors.sun * normal.dot(&self.outdoors.towards_sun);
                        light = [light[0] + sun, light[1] + 0.95 * sun, light[2] + 0.85 * sun];
                    }
                }
                [0, 1, 2].map(|c| reflectance[c] * light[c])
            }
        }
    }
}
