//! How bright lamps and daylight are at one moment of a drive.

use crate::light::LightMap;
use crate::noise::fractal_noise;
use crate::scene::Contact;
use crate::texture::Color;

/// The light of one moment, as factors of the light that was gathered for the room.
pub(crate) struct Lights<'a> {
    /// Factor of the lamps.
    pub(crate) lamps: Color,
    /// Factor of what comes in from outside.
    pub(crate) day: Color,
    /// The light of the windows alone; without it both factors are 1.
    pub(crate) daylight: Option<&'a LightMap>,
}

impl Lights<'_> {
    /// The light as it was gathered.
    pub(crate) const STEADY: Self = Self { lamps: [1.0; 3], day: [1.0; 3], daylight: None };

    /// What becomes of the light that was gathered at a point.
    pub(crate) fn shone(&self, all: Color, contact: &Contact) -> Color {
        let Some(map) = self.daylight else { return all };
        let day = map.at(contact);
        [0, 1, 2].map(|c| self.lamps[c] * (all[c] - day[c]).max(0.0) + self.day[c] * day[c])
    }
}

/// How the light changes along a drive, and with it the exposure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Weather {
    /// How much, in `[0, 1]`; 0 is steady.
    pub(crate) strength: f64,
    pub(crate) seed: u32,
}

impl Weather {
    /// The factors of lamps and daylight at a frame, and that of the mean level that the camera exposes for.
    pub(crate) fn at(&self, frame: usize) -> (Color, Color, f64) {
        // Half a period off the lattice, where the noise is not at rest.
        let wave = |period: f64, stream: u32| {
            self.strength * fractal_noise(frame as f64, 0.5 * period, period, 3, 0.0, self.seed ^ (stream << 16))
        };
        let tint = |level: f64, warm: f64| [level * (0.15 * warm).exp(), level, level * (-0.15 * warm).exp()];
        let lamps = tint(wave(110.0, 1).exp(), wave(150.0, 2));
        let day = tint((1.8 * wave(70.0, 3)).exp(), wave(90.0, 4));
        (lamps, day, (0.5 * wave(45.0, 5)).exp())
    }
}
