//! What can be asked of a room.

use tiltvp_core::{Error, Result};

/// The kind of place.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
#[non_exhaustive]
pub enum RoomKind {
    /// Desks with screens, shelves, a tiled ceiling with light panels.
    #[default]
    Office,
    /// Sofa, low table, dining table with chairs, curtains, wooden floor, pendant lamp.
    LivingRoom,
    /// A long passage with many doors.
    Corridor,
    /// Two joined parts with a reflex corner between them.
    LShaped,
    /// A storeroom: an aisle of about a metre between tall shelves.
    Narrow,
    /// A dining room whose robot places are under the table, among the legs of table and chairs.
    UnderTable,
}

impl RoomKind {
    /// Every kind, in the order of declaration.
    pub const ALL: [Self; 6] =
        [Self::Office, Self::LivingRoom, Self::Corridor, Self::LShaped, Self::Narrow, Self::UnderTable];

    /// The kind's name as a user writes it, in kebab case.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Office => "office",
            Self::LivingRoom => "living-room",
            Self::Corridor => "corridor",
            Self::LShaped => "l-shaped",
            Self::Narrow => "narrow",
            Self::UnderTable => "under-table",
        }
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
        Self::ALL.into_iter().find(|kind| kind.name() == name).ok_or_else(|| {
            Error::option("room.kind", name, "one of office, living-room, corridor, l-shaped, narrow, under-table")
        })
    }
}

/// What all walls of a room have in common.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
#[non_exhaustive]
pub enum WallPattern {
    /// Nothing: paint, wallpaper or brick as the seed draws them.
    #[default]
    Drawn,
    /// The same upright stripes, again and again.
    Stripes,
    /// Upright battens on paint, equally spaced.
    Panels,
    /// Large tiles, all alike, with upright and level joints.
    Tiles,
}

impl WallPattern {
    /// Every pattern, in the order of declaration.
    pub const ALL: [Self; 4] = [Self::Drawn, Self::Stripes, Self::Panels, Self::Tiles];

    /// The pattern's name as a user writes it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Drawn => "drawn",
            Self::Stripes => "stripes",
            Self::Panels => "panels",
            Self::Tiles => "tiles",
        }
    }
}

impl std::str::FromStr for WallPattern {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        Self::ALL
            .into_iter()
            .find(|pattern| pattern.name() == name)
            .ok_or_else(|| Error::option("room.wall_pattern", name, "one of drawn, stripes, panels, tiles"))
    }
}

/// How a room is drawn: equal options give equal worlds.
#[derive(Debug, Clone, PartialEq)]
pub struct RoomOptions {
    /// The kind of place; `Office` by default.
    pub kind: RoomKind,
    /// Seed of everything that is drawn: size, colours, furniture, light; 0 by default.
    pub seed: u64,
    /// How full the room is, in `[0, 1]`: the share of the places along the walls that furniture is tried for, and how much
    /// hangs on the walls; 0.7 by default.
    pub clutter: f64,
    /// Brightness of the day outside, in `[0, 1]`: 0 is night, with the lamps alone; 0.7 by default.
    pub daylight: f64,
    /// Spacing of the points where light is gathered, in metres, within `[0.02, 1]`; 0.15 by default. Finer is slower to
    /// build with sharper soft shadows.
    pub light_spacing_m: f64,
    /// How many times larger the floor is than the kind's own, in `[1, 4]`; 1 by default. A corridor grows in length only;
    /// other kinds grow both ways, into halls with pillars from 1.5 on.
    pub extent: f64,
    /// How much the floor shines, in `[0, 1]`: 0 is matt, 1 mirrors like polished stone under a clear lacquer, the more so
    /// the flatter one looks; 0 by default.
    pub floor_gloss: f64,
    /// What all walls have in common; drawn, each on its own, by default.
    pub wall_pattern: WallPattern,
}

impl Default for RoomOptions {
    fn default() -> Self {
        Self {
            kind: RoomKind::Office,
            seed: 0,
            clutter: 0.7,
            daylight: 0.7,
            light_spacing_m: 0.15,
            extent: 1.0,
            floor_gloss: 0.0,
            wall_pattern: WallPattern::Drawn,
        }
    }
}

impl RoomOptions {
    /// The default room of one kind and seed.
    pub fn new(kind: RoomKind, seed: u64) -> Self {
        Self { kind, seed, ..Self::default() }
    }

    /// Checks every field's domain.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] for the first field outside its domain.
    pub fn validate(&self) -> Result<()> {
        if !(0.0..=1.0).contains(&self.clutter) {
            return Err(Error::option("room.clutter", self.clutter, "a number in [0, 1]"));
        }
        if !(0.0..=1.0).contains(&self.daylight) {
            return Err(Error::option("room.daylight", self.daylight, "a number in [0, 1]"));
        }
        if !(0.02..=1.0).contains(&self.light_spacing_m) {
            return Err(Error::option("room.light_spacing_m", self.light_spacing_m, "metres in [0.02, 1]"));
        }
        if !(1.0..=4.0).contains(&self.extent) {
            return Err(Error::option("room.extent", self.extent, "a factor in [1, 4]"));
        }
        if !(0.0..=1.0).contains(&self.floor_gloss) {
            return Err(Error::option("room.floor_gloss", self.floor_gloss, "a number in [0, 1]"));
        }
        Ok(())
    }
}
