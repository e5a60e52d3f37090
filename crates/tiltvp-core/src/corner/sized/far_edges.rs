//! Where an edge of a box ends in one image: where the two further edges that begin there, along the other axes, both meet it.

use nalgebra::Vector3;

use crate::camera::Camera;
use crate::corner::feature::CornerFeature;
use crate::corner::ray::FittedRay;
use crate::corner::trace::{RaySearch, TracedRay};
use crate::geometry::meeting;

/// How far from where an end is expected its further edges are looked for first, and again, in pixels. Ends are tried 4 pixels apart, and
/// of two lines that are farther apart, as a face's edge and that of a label on it, each look sees one. A fit of 15 pixels and
/// more leaves less than one.
const SEARCH_PX: [f64; 2] = [4.0, 3.0];

/// Pixels about the end where the edges' gradients mix: as next to the vertex of the coloured cuboid.
const CLEAR_PX: f64 = 5.0;

/// Along how much of the ray with the same direction a further edge is looked for: opposite edges of a box are equally long, and
/// the farther one is seen shorter, by less than a third from twice the box' size.
const FAR_SHARE: f64 = 0.7;

/// Least length along which a further edge is looked for, in pixels: twice the least number of places of a ray's fit.
const FAR_MIN_PX: f64 = 20.0;

/// Least share of the places of a further edge that show it.
const SEEN_SHARE: f64 = 0.7;

/// How far apart both further edges may meet the edge, in pixels, before their standard deviations are asked: the bevel of a
/// real box is within it, the second edge of another thing is not.
const MEET_PX: f64 = 3.0;

/// The last pixels of an edge, and those beyond its end. They tell an end from a line that crosses.
const LAST_PX: f64 = 20.0;

/// The share of these pixels from which on the edge is seen: as of a ray. The best line through places of noise has a half.
const EDGE_SHARE: f64 = 0.6;

/// Least length of a line that agrees with it, in pixels, below [`EDGE_SHARE`] of [`LAST_PX`], so that all that show an edge are counted.
pub(crate) const SUPPORT_MIN_PX: f64 = 8.0;

/// A line of the box in the image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum BoxLine {
    /// One of the corner's own edges.
    Edge(usize),
    /// The edge along one axis that begins where the edge along another ends.
    Far {
        /// The edge that ends there.
        end_of: usize,
        /// The axis.
        along: usize,
    },
}

/// The end of an edge, and the edges that begin there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SeenEnd {
    /// Which edge ends.
    pub(crate) axis: usize,
    /// Unit bearing of the end.
    pub(crate) bearing: Vector3<f64>,
    /// The further edges with the axis of each.
    pub(crate) far: [(usize, FittedRay); 2],
}

/// Why the end of an edge is not seen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Unseen {
    /// Something is before it, or its further edges are too faint.
    Hidden,
    /// The edge leaves the image.
    Outside,
}

/// A corner in an image, and how lines are looked for there.
pub(crate) struct BoxView<'a> {
    pub(crate) camera: &'a Camera,
    pub(crate) corner: &'a CornerFeature,
    /// The directions of its edges x, y, z, camera frame.
    pub(crate) edges: &'a [Vector3<f64>; 3],
    /// A search whose line, reach and width are replaced.
    pub(crate) search: RaySearch,
}

impl BoxView<'_> {
    /// The end of one edge near one of the `candidates`, angles from the vertex along its ray; the first that holds. `follow` looks
    /// for a line.
    pub(crate) fn end(
        &self,
        axis: usize,
        candidates: &[f64],
        follow: &mut dyn FnMut(BoxLine, &RaySearch) -> Option<TracedRay>,
    ) -> Result<SeenEnd, Unseen> {
        for candidate in candidates {
            if let Some(end) = self.far_edges(axis, *candidate, follow).filter(|end| self.ends_at(end, follow)) {
                return Ok(end);
            }
        }
        Err(if self.leaves(axis) { Unseen::Outside } else { Unseen::Hidden })
    }

    /// The bearing at an angle along a ray.
    fn at(&self, axis: usize, angle_rad: f64) -> Vector3<f64> {
        let vertex = self.on_ray(axis);
        let (sin, cos) = angle_rad.sin_cos();
        vertex * cos + self.corner.rays()[axis].normal.cross(&vertex) * sin
    }

    /// The vertex on a ray's own circle.
    fn on_ray(&self, axis: usize) -> Vector3<f64> {
        let (vertex, normal) = (self.corner.vertex(), self.corner.rays()[axis].normal);
        (vertex - normal * normal.dot(&vertex)).normalize()
    }

    /// Both edges that begin at the end, if they meet the ray in one place.
    fn far_edges(
        &self,
        axis: usize,
        candidate: f64,
        follow: &mut dyn FnMut(BoxLine, &RaySearch) -> Option<TracedRay>,
    ) -> Option<SeenEnd> {
        let ray = self.corner.rays()[axis];
        let mut bearing = self.at(axis, candidate);
        let others = [(axis + 1) % 3, (axis + 2) % 3];
        let mut far = None;
        for search_px in SEARCH_PX {
            let px_per_rad = self.camera.px_per_rad(&bearing)?;
            let mut ends = [Vector3::zeros(); 2];
            let mut rays = [None; 2];
            for ((end, found), along) in ends.iter_mut().zip(&mut rays).zip(others) {
                let normal = bearing.cross(&self.edges[along]).try_normalize(0.05)?;
                let to_rad = FAR_SHARE * self.corner.vertex().angle(&self.corner.rays()[along].toward);
                let from_rad = CLEAR_PX / px_per_rad;
                let to_rad = to_rad.max(from_rad + FAR_MIN_PX / px_per_rad);
                let search = RaySearch { normal, vertex: bearing, from_rad, to_rad, search_px, ..self.search };
                let traced = follow(BoxLine::Far { end_of: axis, along }, &search)
                    .filter(|traced| traced.share >= SEEN_SHARE && traced.begins_at_vertex())?;
                *end = meeting(&ray.normal, &traced.ray.normal, &bearing)?;
                *found = Some((along, traced.ray));
            }
            if search_px < SEARCH_PX[0] && ends[0].angle(&ends[1]) * px_per_rad > MEET_PX {
                return None;
            }
            bearing = (ends[0] + ends[1]).normalize();
            far = rays[0].zip(rays[1]);
        }
        let (first, second) = far?;
        Some(SeenEnd { axis, bearing, far: [first, second] })
    }

    /// Whether the edge is seen up to its end, and not beyond it.
    fn ends_at(&self, end: &SeenEnd, follow: &mut dyn FnMut(BoxLine, &RaySearch) -> Option<TracedRay>) -> bool {
        let Some(px_per_rad) = self.camera.px_per_rad(&end.bearing) else { return false };
        let angle = self.on_ray(end.axis).angle(&end.bearing);
        let mut share = |from_px: f64, to_px: f64| {
            let (from_rad, to_rad) = (angle + from_px / px_per_rad, angle + to_px / px_per_rad);
            let normal = self.corner.rays()[end.axis].normal;
            let vertex = self.on_ray(end.axis);
            let search = RaySearch { normal, vertex, from_rad: from_rad.max(0.0), to_rad, ..self.search };
            follow(BoxLine::Edge(end.axis), &search).map_or(0.0, |traced| traced.share)
        };
        share(-CLEAR_PX - LAST_PX, -CLEAR_PX) >= EDGE_SHARE && share(CLEAR_PX, CLEAR_PX + LAST_PX) < EDGE_SHARE
    }

    /// Whether the edge is followed up to the border of the image.
    fn leaves(&self, axis: usize) -> bool {
        let far = self.corner.rays()[axis].toward;
        let Some(px_per_rad) = self.camera.px_per_rad(&far) else { return true };
        let beyond = self.at(axis, self.on_ray(axis).angle(&far) + LAST_PX / px_per_rad);
        let [width, height] = [self.camera.width(), self.camera.height()].map(f64::from);
        self.camera.project(&beyond).is_none_or(|pixel| {
            let margin = CLEAR_PX;
            !(margin..width - margin).contains(&pixel.x) || !(margin..height - margin).contains(&pixel.y)
        })
    }
}
