//! How far the levels on both sides of an edge can be trusted to be light: cameras roll highlights off, each in its own way.

use super::segmentation::Primary;
use crate::camera::Camera;
use crate::corner::trace::{RayProfile, RaySearch};
use crate::image::{ColorView, LightTable};

/// Shares of full light between which a level goes from linear to rolled off: sRGB levels of 202 and 230 of 255, where
/// consumer cameras bend.
const ROLLED_OFF: [f64; 2] = [0.6, 0.8];

/// How far beside an edge its faces are looked at, in pixels: beyond the blur.
const BESIDE_PX: f64 = 5.0;

/// Places along a ray that are looked at: a mean over twelve is within a third of one level's noise.
const PLACES: u32 = 12;

/// The weights of two faces' primaries in an edge's profile, the larger one 1.
///
/// A blurred edge with one side rolled off seems to lie towards its dark side. Across the edge between two faces each primary is
/// bright on one side alone, so the dimmer of both shows the place where the other cannot.
pub(crate) fn trusts(
    camera: &Camera,
    search: &RaySearch,
    image: &ColorView<'_>,
    light: &LightTable,
    faces: (Primary, Primary),
) -> [f64; 2] {
    let bytes = [faces.0.byte(), faces.1.byte()];
    let (mut sums, mut looked_at) = ([0.0; 2], 0.0);
    for i in 0..PLACES {
        let angle = search.from_rad + (search.to_rad - search.from_rad) * (f64::from(i) + 0.5) / f64::from(PLACES);
        let Some(RayProfile { pixel, across, .. }) = search.profile(camera, angle) else { continue };
        let beside = |side: f64| {
            let place = pixel + across * (side * BESIDE_PX);
            light.color(image, place.x, place.y)
        };
        let (Some(one), Some(other)) = (beside(1.0), beside(-1.0)) else { continue };
        looked_at += 1.0;
        for (sum, byte) in sums.iter_mut().zip(bytes) {
            *sum += one[byte].max(other[byte]);
        }
    }
    let [from, to] = ROLLED_OFF.map(|share| 255.0 * share * looked_at);
    let trusts = sums.map(|sum| ((to - sum) / (to - from)).clamp(0.0, 1.0));
    let most = trusts[0].max(trusts[1]);
    if most > 0.0 { trusts.map(|trust| trust / most) } else { [1.0; 2] }
}
