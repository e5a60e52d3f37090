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
}

impl Default for RoomOptions {
    fn default() -> Self {
        Self { kind: RoomKind::Office, seed: 0, clutter: 0.7, daylight: 0.7, light_spacing_m: 0.15 }
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
        Ok(())
    }
}
