//! Names of corners that last: each is a place in a world, beside other places, by which it is known again.
//!
//! A world is what the camera has seen without losing its way in it. Where a frame shows corners of it, the camera's motion
//! in it follows, and what is hidden meanwhile keeps its place and its name. A wrong name is worse than a new one: what fits two
//! places has none, and what is near a place without fitting it neither.

mod motion;

use nalgebra::{Matrix3, Vector3};

use self::motion::{Found, Sighting};
use crate::corner::estimate::BelievedCorner;
use crate::corner::estimator_options::EstimatorOptions;
use crate::corner::sequence::track::SEEN_MIN;
use crate::geometry::RigidMotion;

/// Sightings after which the mean of a place hardly moves any more. Errors of neighbouring frames are much the same, so that more
/// do not make it better; a camera that goes around a corner shows it from elsewhere by then.
const SEEN_ENOUGH: u32 = 20;

/// The pace of a camera that was seen once, as a share of the distance: a hand at 0.5 m/s, 30 frames a second and 1.7 m. At 0 a
/// faster one gets new names from frame to frame; at 0.1, four of 2400 made-up worlds have a wrong name in their second frame.
const PACE_START: f64 = 0.01;

/// Most places of a world, which bounds time and memory: a room has some hundred corners.
const PLACES_MAX: usize = 256;

/// Most worlds that are kept, which bounds time and memory.
const WORLDS_MAX: usize = 8;

/// A corner that has a name.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NamedPlace {
    /// Its name.
    pub id: u32,
    /// Where it is in the world, metres.
    pub place_m: Vector3<f64>,
    /// The covariance of the best sighting of it, world frame, square metres.
    pub covariance_m2: Matrix3<f64>,
    /// The directions of its edges away from it, world frame, unit vectors.
    pub edges: [Vector3<f64>; 3],
    /// How long these are, where that was seen, metres, with standard deviations.
    pub lengths_m: [Option<(f64, f64)>; 3],
    /// In how many frames it was seen.
    pub seen: u32,
    /// How many frames ago that was last so.
    pub age: u32,
}

/// Places that have been seen together.
#[derive(Debug, Clone, PartialEq)]
pub struct KnownWorld {
    /// The last known motion of the camera.
    pub camera_from_world: RigidMotion,
    /// How many frames ago that was.
    pub age: u32,
    /// How far the camera moved from frame to frame, as a share of the distance of what it saw.
    pub pace: f64,
    /// Its places.
    pub places: Vec<NamedPlace>,
}

/// All corners that have a name.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CornerNames {
    /// The worlds, the one that was seen last first.
    pub worlds: Vec<KnownWorld>,
    /// The last name that was given.
    pub last: u32,
}

impl CornerNames {
    /// Forgets all corners. Their names are not given again.
    pub(crate) fn forget(&mut self) {
        self.worlds.clear();
    }

    /// Gives the corners of the next frame their names: those of the places where they are, and new ones to corners at new places.
    pub(crate) fn give(&mut self, corners: &mut [BelievedCorner], options: &EstimatorOptions) {
        for world in &mut self.worlds {
            world.grow_older(options.forget_after);
        }
        self.worlds.retain(|world| !world.places.is_empty());
        let (places, seen): (Vec<usize>, Vec<Sighting>) =
            corners.iter().enumerate().filter_map(|(i, corner)| Some((i, Sighting::of(corner)?))).unzip();
        if seen.is_empty() {
            return;
        }
        let found = self.worlds.iter().enumerate().filter_map(|(i, world)| {
            let found = motion::find(world, &seen, options)?;
            Some((i, world.age, found))
        });
        // The world of which most is seen; of several the one that was seen last.
        let most = found.max_by(|a, b| a.2.pairs.len().cmp(&b.2.pairs.len()).then(b.1.cmp(&a.1)).then(b.0.cmp(&a.0)));
        let found = if let Some((i, _, found)) = most {
            self.worlds[..=i].rotate_right(1);
            found
        } else {
            self.worlds.insert(0, KnownWorld::new(&seen[0]));
            self.worlds.truncate(WORLDS_MAX);
            Found::nothing(self.worlds[0].camera_from_world)
        };
        let names = self.worlds[0].take(&seen, &found, &mut self.last);
        for (place, id) in places.into_iter().zip(names) {
            corners[place].id = id;
        }
    }
}

impl KnownWorld {
    /// An empty world with the axes of a corner and its origin there.
    fn new(seen: &Sighting) -> Self {
        let camera_from_world = RigidMotion { rotation: seen.camera_from_object, translation_m: seen.place_m };
        Self { camera_from_world, age: 0, pace: PACE_START, places: Vec::new() }
    }

    /// One frame more. What was seen too rarely is forgotten.
    fn grow_older(&mut self, forget_after: u32) {
        self.age = self.age.saturating_add(1);
        for place in &mut self.places {
            place.age = place.age.saturating_add(1);
        }
        self.places.retain(|place| place.seen >= SEEN_MIN || place.age <= forget_after);
    }

    /// Goes on to the motion that was found, and returns the name of each corner that is seen.
    fn take(&mut self, seen: &[Sighting], found: &Found, last: &mut u32) -> Vec<Option<u32>> {
        if !found.pairs.is_empty() {
            self.pace = found.moved / f64::from(self.age.max(1));
        }
        (self.camera_from_world, self.age) = (found.camera_from_world, 0);
        let world_from_camera = self.camera_from_world.inverse();
        let mut names = vec![None; seen.len()];
        for (number, place) in &found.pairs {
            let known = &mut self.places[*place];
            known.see(&seen[*number].moved(&world_from_camera));
            names[*number] = Some(known.id);
        }
        for number in (0..seen.len()).filter(|number| !found.unsure.contains(number)) {
            if names[number].is_none() {
                *last += 1;
                names[number] = Some(*last);
                self.places.push(NamedPlace::new(*last, &seen[number].moved(&world_from_camera)));
            }
        }
        if self.places.len() > PLACES_MAX {
            self.places.sort_by_key(|place| (std::cmp::Reverse(place.seen), place.age));
            self.places.truncate(PLACES_MAX);
        }
        names
    }
}

impl NamedPlace {
    fn new(id: u32, seen: &Sighting) -> Self {
        Self {
            id,
            place_m: seen.place_m,
            covariance_m2: seen.covariance_m2,
            edges: seen.edges,
            lengths_m: seen.lengths_m,
            seen: 1,
            age: 0,
        }
    }

    /// The mean of all sightings, each by its variance; `seen` is in the frame of the world.
    fn see(&mut self, seen: &Sighting) {
        let (own, new) = (self.covariance_m2.trace(), seen.covariance_m2.trace());
        let count = f64::from(self.seen.min(SEEN_ENOUGH));
        let share = own / (own + count * new);
        self.place_m += (seen.place_m - self.place_m) * share;
        if new < own {
            self.covariance_m2 = seen.covariance_m2;
        }
        let paired = motion::paired(&self.edges, &seen.edges).unwrap_or([0, 1, 2]);
        for (axis, other) in paired.into_iter().enumerate() {
            self.edges[axis] = (self.edges[axis] + (seen.edges[other] - self.edges[axis]) * share).normalize();
            // The one that is known best.
            let length = [self.lengths_m[axis], seen.lengths_m[other]].into_iter().flatten();
            self.lengths_m[axis] = length.min_by(|a, b| a.1.total_cmp(&b.1));
        }
        self.seen = self.seen.saturating_add(1);
        self.age = 0;
    }
}

#[cfg(test)]
mod tests;
