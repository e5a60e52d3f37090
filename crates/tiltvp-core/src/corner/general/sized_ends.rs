//! Where edges of a box of known size end in a grey image: at the segments along the other axes that meet them.

use nalgebra::Vector3;

use super::edge_ends::{EDGE_MIN_PX, GAP_PX};
use super::{AXIS_SINE, GeneralScratch, gray_search};
use crate::corner::options::GeneralOptions;
use crate::corner::sized::{BoxView, SUPPORT_MIN_PX, SeenEnd, Unseen};
use crate::corner::trace::{RaySearch, trace};
use crate::geometry::meeting;
use crate::image::{ImageView, LightTable};

/// Ends that are closer than this are looked for together, in pixels: the reach of the first look.
const TOGETHER_PX: f64 = 4.0;

/// The search for lines of a box, whose line and reach are set for each.
pub(in crate::corner) fn box_search(options: &GeneralOptions) -> RaySearch {
    gray_search(options, Vector3::z(), Vector3::x(), [0.0; 2])
}

/// The end of an edge, the farthest that holds.
pub(in crate::corner) fn find_end(
    view: &BoxView<'_>,
    axis: usize,
    image: &ImageView<'_>,
    light: &LightTable,
    scratch: &mut GeneralScratch,
) -> Result<SeenEnd, Unseen> {
    let GeneralScratch { segments, trace: memory, .. } = scratch;
    let (vertex, normal) = (view.corner.vertex(), view.corner.rays()[axis].normal);
    let along = normal.cross(&vertex);
    let mut angles = Vec::new();
    for segment in &segments.list {
        let is_along = |other: usize| segment.normal.dot(&view.edges[other]).abs() < AXIS_SINE;
        if !(0..3).any(|other| other != axis && is_along(other)) {
            continue;
        }
        let Some(crossing) = meeting(&normal, &segment.normal, &vertex) else { continue };
        let angle = crossing.dot(&along).atan2(crossing.dot(&vertex));
        let px_per_rad = segment.px_per_rad;
        let off_px = segment.ends.map(|end| end.angle(&crossing) * px_per_rad);
        if angle * px_per_rad >= EDGE_MIN_PX && off_px[0].min(off_px[1]) <= GAP_PX {
            angles.push((angle, px_per_rad));
        }
    }
    angles.sort_by(|a, b| b.0.total_cmp(&a.0));
    angles.dedup_by(|next, kept| (kept.0 - next.0) * kept.1 < TOGETHER_PX);
    let candidates: Vec<f64> = angles.into_iter().map(|(angle, _)| angle).collect();
    view.end(axis, &candidates, &mut |_, search| {
        let signal = |at: &_, step: &_, out: &mut [f64]| light.gray_profile(image, at, step, out);
        trace(view.camera, search, SUPPORT_MIN_PX, signal, memory)
    })
}
