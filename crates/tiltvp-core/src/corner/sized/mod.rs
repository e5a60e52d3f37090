//! A corner of a box of which lengths are known: where its edges end, and the pose that rays, ends and lengths agree on.

mod far_edges;
mod fit;

pub(super) use self::far_edges::{BoxLine, BoxView, SUPPORT_MIN_PX, SeenEnd, Unseen};
pub(super) use self::fit::{KnownLengths, SizedPose, fit_sized};
