//! Which parameters of the calibration are free, and where they are among those that keyframes share.

/// Which calibration parameters are estimated beside the mounting.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[expect(clippy::struct_excessive_bools, reason = "each is free or not, whatever the others are")]
pub(crate) struct FreeParameters {
    pub(crate) wheels: bool,
    pub(crate) offset: bool,
    #[cfg_attr(feature = "serde", serde(default))]
    pub(crate) centre: bool,
    /// How much later lines are seen on one side of the camera than on the other; looked for, not estimated.
    #[cfg_attr(feature = "serde", serde(default))]
    pub(crate) shutter: bool,
}

impl FreeParameters {
    /// All that is estimated.
    pub(crate) const ALL: Self = Self { wheels: true, offset: true, centre: true, shutter: false };

    /// The number of calibration parameters; those of the landmarks follow.
    pub(crate) fn width(self) -> usize {
        self.shutter_at() + 2 * usize::from(self.shutter)
    }

    /// The place of the time offset among them.
    pub(crate) fn offset_at(self) -> usize {
        3 + 2 * usize::from(self.wheels)
    }

    /// The place of the image centre among them.
    pub(crate) fn centre_at(self) -> usize {
        self.offset_at() + usize::from(self.offset)
    }

    /// The place of the rolling shutter among them.
    pub(crate) fn shutter_at(self) -> usize {
        self.centre_at() + 2 * usize::from(self.centre)
    }
}
