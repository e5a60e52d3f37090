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
    /// How much later lines are seen on one side of the camera than on the other.
    #[cfg_attr(feature = "serde", serde(default))]
    pub(crate) shutter: bool,
    /// By how much the camera turned all along the drive, up to the last keyframe; looked for, not estimated.
    #[cfg_attr(feature = "serde", serde(default))]
    pub(crate) creep: bool,
}

impl FreeParameters {
    /// All that is estimated.
    pub(crate) const ALL: Self = Self { wheels: true, offset: true, centre: true, shutter: false, creep: false };

    /// All that is estimated or looked for.
    pub(crate) const ALL_LOOKED_FOR: Self = Self { shutter: true, creep: true, ..Self::ALL };

    /// The number of calibration parameters; those of the landmarks follow.
    pub(crate) fn width(self) -> usize {
        self.creep_at() + usize::from(self.creep)
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

    /// The place of the creep among them.
    pub(crate) fn creep_at(self) -> usize {
        self.shutter_at() + 2 * usize::from(self.shutter)
    }
}
