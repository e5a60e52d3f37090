//! A world: a furnished room with its light, ready to be looked at.

use nalgebra::{Vector2, Vector3};
use tiltvp_core::{Error, Result};

use crate::builder::{Builder, Footprint, Material};
use crate::corner::{self, Corner};
use crate::laboratory::LaboratoryOptions;
use crate::light::{LightMap, sun_reaches};
use crate::lights::Lights;
use crate::options::{RoomKind, RoomOptions, WallPattern};
use crate::outdoors::Outdoors;
use crate::plan::Plan;
use crate::rng::Rng;
use crate::scene::{Contact, Scene};
use crate::segment::Segment;
use crate::texture::{Color, mix};
use crate::view::{RobotPose, View};
use crate::{furniture, laboratory, shell, yard};

/// Greatest radiance that the camera sees, in units of white in the room's light: what is brighter is burnt out anyway, and
/// would fray the edges of windows and lamps.
const GLARE: f64 = 3.0;

/// Most poses that are drawn at a time: 24 MB, and a hundred times those of the largest dataset.
const MOST_POSES: usize = 1_000_000;

/// Radius of the free circle that a robot needs to stand, metres: a cleaning robot of 0.35 m across with room to turn
/// (`ways_are_free_smooth_and_lead_far` holds the ways to it).
pub(crate) const ROBOT_RADIUS_M: f64 = 0.22;

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
    painted: Vec<Segment>,
    corners: Vec<Corner>,
    /// Whether the first of the corners is the coloured cuboid's.
    cuboid: bool,
    light_spacing_m: f64,
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
        if options.kind == RoomKind::Yard && options.wall_pattern != WallPattern::Drawn {
            return Err(Error::option(
                "wall_pattern",
                options.wall_pattern.name(),
                "drawn, as houses of a yard differ",
            ));
        }
        let mut rng = Rng::new(options.seed, options.kind as u64);
        let mut plan = Plan::draw(options, &mut rng);
        let mut builder = Builder::default();
        let (mut corners, mut places) = (Vec::new(), Vec::new());
        if options.kind == RoomKind::Yard {
            yard::build(&mut plan, options.clutter, &mut builder, &mut rng);
        } else {
            shell::build(&plan, &mut builder, &mut rng);
            places = furniture::furnish(&plan, options, &mut builder, &mut rng);
            corners = corner::of_room(&plan);
        }
        corners.append(&mut builder.corners);
        Self::lit(plan, builder, corners, places, options.light_spacing_m)
    }

    /// Draws and lights a laboratory with a coloured cuboid, whose corner is the first of the world's. Light is gathered in
    /// parallel on the current rayon pool; the world does not depend on it.
    ///
    /// # Errors
    /// If the options are outside their domains.
    pub fn laboratory(options: &LaboratoryOptions) -> Result<Self> {
        laboratory::check(options)?;
        let mut builder = Builder::default();
        let plan = laboratory::build(options, &mut builder);
        let mut corners = std::mem::take(&mut builder.corners);
        corners.extend(corner::of_room(&plan));
        Ok(Self { cuboid: true, ..Self::lit(plan, builder, corners, Vec::new(), options.light_spacing_m)? })
    }

    fn lit(
        plan: Plan,
        mut builder: Builder,
        mut corners: Vec<Corner>,
        places: Vec<Footprint>,
        light_spacing_m: f64,
    ) -> Result<Self> {
        corners.sort_by_key(|corner| !corner.is_large());
        let outdoors = plan.outdoors;
        let edges = std::mem::take(&mut builder.edges);
        let painted = std::mem::take(&mut builder.painted);
        let solids = std::mem::take(&mut builder.solids);
        let scene = Scene::new(builder)?;
        let light = LightMap::bake(&scene, &outdoors, light_spacing_m);
        let unit = 1.0 / light.typical().max(1e-9);
        Ok(Self {
            plan,
            scene,
            light,
            unit,
            outdoors,
            edges,
            painted,
            corners,
            cuboid: false,
            light_spacing_m,
            solids,
            places,
        })
    }

    /// The vertical edges of walls, openings and furniture, visible or not.
    pub fn vertical_edges(&self) -> &[Segment] {
        &self.edges
    }

    /// Where an upright and two level edges of room and boxes meet, visible or not. In a laboratory the first is the coloured
    /// cuboid's; in a room those of the room itself come first. Those with an edge below 0.15 m, as of boards, come last.
    pub fn corners(&self) -> &[Corner] {
        &self.corners
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

    /// The camera's centre, of a view from within.
    pub(crate) fn center_of(&self, view: &View<'_>) -> Result<Vector3<f64>> {
        view.validate()?;
        let center = view.center();
        if self.contains(&center) {
            return Ok(center);
        }
        let got = format!("x {:.2} m, y {:.2} m, height {:.2} m", center.x, center.y, center.z);
        Err(Error::argument("view.pose", got, "a place in the room"))
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
    /// If the room is too full to find them, and for more than anybody looks from.
    pub fn free_poses(&self, count: usize, seed: u64) -> Result<Vec<RobotPose>> {
        if count > MOST_POSES {
            return Err(Error::argument("count", count, format!("at most {MOST_POSES} places")));
        }
        let mut rng = Rng::new(seed, 1 << 32);
        let (low, high) = self.plan.bounds();
        let mut poses = Vec::with_capacity(count);
        for _ in 0..20_000 + 2_000 * count {
            if poses.len() == count {
                break;
            }
            let point = Vector2::new(rng.within(low.x, high.x), rng.within(low.y, high.y));
            let meant = self.places.is_empty() || self.places.iter().any(|place| place.distance(&point) <= 0.0);
            if meant && self.is_free(point.x, point.y) {
                let yaw_rad = rng.within(-std::f64::consts::PI, std::f64::consts::PI);
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
        let contact = self.scene.cast(origin, direction, 1e3);
        self.seen(&Ray { origin, direction, spread }, contact, &Lights::STEADY, || {
            let contact = contact?;
            let (below, down) = mirrored(origin, direction);
            let point = below + down * (contact.distance * (1.0 + 1e-9) + 1e-6);
            let further = self.scene.cast(&point, &down, 1e3)?;
            Some(Contact { distance: contact.distance + further.distance, ..further })
        })
    }

    /// The radiance that arrives along a ray that meets `contact` first; `reflected` is what the ray that the floor mirrors
    /// meets, at its distance from the mirrored origin.
    pub(crate) fn seen(
        &self,
        ray: &Ray<'_>,
        contact: Option<Contact>,
        lights: &Lights<'_>,
        reflected: impl FnOnce() -> Option<Contact>,
    ) -> Color {
        let mut color = self.own_radiance(ray, contact, lights);
        if let Some(contact) = contact
            && let Material::Polished(_, gloss) = self.scene.material(contact.patch)
        {
            // Schlick's approximation of Fresnel's law.
            let slant = self.scene.normal(contact.patch).dot(ray.direction).abs().min(1.0);
            let share = gloss * (0.05 + 0.95 * (1.0 - slant).powi(5));
            let (origin, direction) = mirrored(ray.origin, ray.direction);
            let other = Ray { origin: &origin, direction: &direction, spread: ray.spread };
            color = mix(color, self.own_radiance(&other, reflected(), lights), share);
        }
        color.map(|c| (c * self.unit).min(GLARE))
    }

    /// The radiance of what a ray meets, but for mirror images in it.
    fn own_radiance(&self, ray: &Ray<'_>, contact: Option<Contact>, lights: &Lights<'_>) -> Color {
        let Ray { origin, direction, spread } = *ray;
        let outside = || tinted(self.outdoors.radiance(direction), lights.day);
        let Some(contact) = contact else {
            return outside();
        };
        match self.scene.material(contact.patch) {
            Material::Lamp(radiance) => tinted(*radiance, lights.lamps),
            Material::Glass => outside(),
            Material::Matt(texture) | Material::Polished(texture, _) => {
                let normal = self.scene.normal(contact.patch);
                let slant = normal.dot(direction).abs().max(0.1);
                let [u, v] = self.scene.texture_coordinates(&contact);
                let reflectance = texture.reflectance(u, v, contact.distance * spread / slant);
                let mut light = lights.shone(self.light.at(&contact), &contact);
                if self.light.sun_may_reach(&contact) {
                    let point = origin + direction * (contact.distance - 1e-3);
                    if sun_reaches(&self.scene, &self.outdoors, normal, &point) {
                        let sun = self.outdoors.sun * normal.dot(&self.outdoors.towards_sun);
                        let sun = tinted([sun, 0.95 * sun, 0.85 * sun], lights.day);
                        light = [light[0] + sun[0], light[1] + sun[1], light[2] + sun[2]];
                    }
                }
                [0, 1, 2].map(|c| reflectance[c] * light[c])
            }
        }
    }

    /// Whether a surface may have sharp edges here that are not its own: shadows in the sun, the view through a window.
    pub(crate) fn is_patterned(&self, contact: &Contact) -> bool {
        self.light.sun_may_reach(contact) || matches!(self.scene.material(contact.patch), Material::Glass)
    }

    /// The light of the windows alone, at the points where the room's light is known.
    pub(crate) fn daylight(&self) -> LightMap {
        LightMap::bake_daylight(&self.scene, &self.outdoors, self.light_spacing_m)
    }

    /// The surfaces.
    pub(crate) fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The true upright edges that are painted on walls.
    pub(crate) fn painted_edges(&self) -> &[Segment] {
        &self.painted
    }

    /// How far a point of the floor is from the next thing a low robot cannot drive over, metres; negative outside.
    pub(crate) fn clearance(&self, x_m: f64, y_m: f64) -> f64 {
        let point = Vector2::new(x_m, y_m);
        if !self.plan.contains(&point) {
            return -1.0;
        }
        self.solids.iter().map(|solid| solid.distance(&point)).fold(self.plan.distance_to_walls(&point), f64::min)
    }

    /// The least and the greatest corner of the floor.
    pub(crate) fn bounds(&self) -> (Vector2<f64>, Vector2<f64>) {
        self.plan.bounds()
    }

    /// Whether the first of the corners is a laboratory's coloured cuboid's.
    pub(crate) fn has_cuboid(&self) -> bool {
        self.cuboid
    }

    /// The kind of place.
    pub fn kind(&self) -> RoomKind {
        self.plan.kind
    }
}

/// A ray, and the angle that it stands for.
pub(crate) struct Ray<'a> {
    pub(crate) origin: &'a Vector3<f64>,
    pub(crate) direction: &'a Vector3<f64>,
    pub(crate) spread: f64,
}

/// A ray as the floor mirrors it.
pub(crate) fn mirrored(origin: &Vector3<f64>, direction: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    (Vector3::new(origin.x, origin.y, -origin.z), Vector3::new(direction.x, direction.y, -direction.z))
}

fn tinted(color: Color, tint: Color) -> Color {
    [0, 1, 2].map(|c| color[c] * tint[c])
}
