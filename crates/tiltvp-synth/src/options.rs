//! What can be asked of a room.

use tiltvp_core::options::Kind;
use tiltvp_core::{Error, Result, options, words};

words! {
    /// The kind of place.
    #[derive(Default)]
    #[non_exhaustive]
    pub enum RoomKind {
        /// Desks with screens, shelves, a tiled ceiling with light panels.
        #[default]
        Office = "office",
        /// Sofa, low table, dining table with chairs, curtains, wooden floor, pendant lamp.
        LivingRoom = "living-room",
        /// A long passage with many doors.
        Corridor = "corridor",
        /// Two joined parts with a reflex corner between them.
        LShaped = "l-shaped",
        /// A storeroom: an aisle of about a metre between tall shelves.
        Narrow = "narrow",
        /// A dining room whose robot places are under the table, among the legs of table and chairs.
        UnderTable = "under-table",
        /// Outdoors: a yard between the fronts of houses and garden walls.
        Yard = "yard",
    }
}

impl std::fmt::Display for RoomKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

impl std::str::FromStr for RoomKind {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        Self::from_name(name).ok_or_else(|| Error::option("kind", name, format!("one of {}", Self::NAMES.join(", "))))
    }
}

words! {
    /// What all walls of a room have in common.
    #[derive(Default)]
    #[non_exhaustive]
    pub enum WallPattern {
        /// Nothing: paint, wallpaper or brick as the seed draws them.
        #[default]
        Drawn = "drawn",
        /// The same upright stripes, again and again.
        Stripes = "stripes",
        /// Upright battens on paint, equally spaced.
        Panels = "panels",
        /// Large tiles, all alike, with upright and level joints.
        Tiles = "tiles",
    }
}

impl std::str::FromStr for WallPattern {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        Self::from_name(name).ok_or_else(|| Error::option("wall_pattern", name, Kind::Word(Self::NAMES).to_string()))
    }
}

options! {
    /// How a room is drawn: equal options give equal worlds.
    pub struct RoomOptions {
        /// The kind of place.
        kind: RoomKind = RoomKind::Office;
        /// Seed of everything that is drawn: size, colours, furniture, light.
        seed: u64 = 0;
        /// How full the room is: the share of the places along the walls that furniture is tried for, and how much hangs on the
        /// walls.
        clutter: f64 = 0.7 => 0.0..=1.0, "a number in [0, 1]";
        /// Brightness of the day outside: 0 is night, with the lamps alone.
        daylight: f64 = 0.7 => 0.0..=1.0, "a number in [0, 1]";
        /// Spacing of the points where light is gathered, in metres. Finer is slower to build with sharper soft shadows.
        light_spacing_m: f64 = 0.15 => 0.02..=1.0, "metres in [0.02, 1]";
        /// How many times larger the floor is than the kind's own. A corridor grows in length only; other kinds grow both ways,
        /// into halls with pillars from 1.5 on.
        extent: f64 = 1.0 => 1.0..=4.0, "a factor in [1, 4]";
        /// How much the floor shines: 0 is matt, 1 mirrors like polished stone under a clear lacquer, the more so the flatter one
        /// looks.
        floor_gloss: f64 = 0.0 => 0.0..=1.0, "a number in [0, 1]";
        /// What all walls have in common; drawn, each on its own, if nothing.
        wall_pattern: WallPattern = WallPattern::Drawn;
    }
}

impl RoomOptions {
    /// The default room of one kind and seed.
    pub fn new(kind: RoomKind, seed: u64) -> Self {
        Self { kind, seed, ..Self::default() }
    }
}
