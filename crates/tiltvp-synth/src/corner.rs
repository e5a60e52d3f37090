//! Corners: where one upright and two level edges of a world meet, the truth behind corner features.

use nalgebra::Vector3;

use crate::plan::Plan;

/// Least length of every edge of a corner that is looked at, metres: shorter ones are a few pixels long from where hands hold cameras.
const LARGE_EDGE_M: f64 = 0.15;

/// Least length of every edge of a corner that is kept, metres: that of the fronts of drawers, which stand before the corners of their case.
const LEAST_EDGE_M: f64 = 0.01;

/// What a corner looks like from where it is seen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum CornerKind {
    /// The corner of a box, seen from outside: all edges point away from the viewer.
    Solid,
    /// The corner of a room, seen from inside: all edges point towards the viewer.
    Hollow,
    /// Where two walls jut into the room: the level edges point away from the viewer, the upright one towards it.
    Jutting,
}

impl CornerKind {
    /// The name of the kind.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Solid => "solid",
            Self::Hollow => "hollow",
            Self::Jutting => "jutting",
        }
    }
}

/// A vertex and the three edges that leave it, world frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corner {
    /// The vertex, metres.
    pub position: Vector3<f64>,
    /// Unit directions, away from the vertex, of the edges `x`, `y`, `z`: `y` is the upright one, and `z` is on the side of
    /// `x` cross `y`.
    pub edges: [Vector3<f64>; 3],
    /// How long they are, metres.
    pub lengths_m: [f64; 3],
    /// From which side it is seen.
    pub kind: CornerKind,
}

impl Corner {
    /// The corner with the given edges, one upright and two level, in either order of the latter.
    pub(crate) fn new(
        position: Vector3<f64>,
        upright: Vector3<f64>,
        level: [Vector3<f64>; 2],
        kind: CornerKind,
    ) -> Self {
        let [a, b] = level;
        let [x, z] = if a.cross(&upright).dot(&b) > 0.0 { [a, b] } else { [b, a] };
        let edges = [x, upright, z];
        Self { position, edges: edges.map(|e| e / e.norm()), lengths_m: edges.map(|e| e.norm()), kind }
    }

    /// The angle between the two level edges, radians.
    pub fn gamma_rad(&self) -> f64 {
        tiltvp_core::geometry::angle_between(&self.edges[0], &self.edges[2])
    }

    /// Whether its edges are long enough to be looked at.
    pub(crate) fn is_large(&self) -> bool {
        self.has_edges_from(LARGE_EDGE_M)
    }

    fn has_edges_from(&self, least_m: f64) -> bool {
        self.lengths_m.iter().all(|length| *length >= least_m)
    }

    /// The unit direction, level, from the vertex to the middle of the places from which all its faces are seen.
    pub(crate) fn towards_viewer(&self) -> Vector3<f64> {
        let inwards = (self.edges[0] + self.edges[2]).normalize();
        if self.kind == CornerKind::Hollow { inwards } else { -inwards }
    }

    /// Whether it is seen from above.
    pub(crate) fn is_seen_from_above(&self) -> bool {
        (self.edges[1].z > 0.0) == (self.kind != CornerKind::Solid)
    }
}

/// The eight corners of an upright box: one of its lower corners, and the edges from there, the last of them upright.
pub(crate) fn of_box(origin: Vector3<f64>, edges: [Vector3<f64>; 3]) -> impl Iterator<Item = Corner> {
    let [a, b, c] = edges;
    (0..8)
        .map(move |k| {
            let far = [k & 1 != 0, k & 2 != 0, k & 4 != 0];
            let position =
                origin + [a, b, c].iter().zip(far).filter(|(_, far)| *far).map(|(e, _)| e).sum::<Vector3<f64>>();
            let away = |edge: Vector3<f64>, far: bool| if far { -edge } else { edge };
            Corner::new(position, away(c, far[2]), [away(a, far[0]), away(b, far[1])], CornerKind::Solid)
        })
        .filter(|corner| corner.has_edges_from(LEAST_EDGE_M))
}

/// The corners of a room, at floor and ceiling.
pub(crate) fn of_room(plan: &Plan) -> Vec<Corner> {
    let count = plan.walls.len();
    let mut corners = Vec::with_capacity(2 * count);
    for (k, wall) in plan.walls.iter().enumerate() {
        let before = &plan.walls[(k + count - 1) % count];
        let along = |x: nalgebra::Vector2<f64>, length: f64| Vector3::new(x.x, x.y, 0.0) * length;
        let level = [along(wall.frame.x, wall.length), along(before.frame.x, -before.length)];
        // The outline is counter-clockwise: where it turns right, walls jut into the room.
        let kind = if before.frame.x.perp(&wall.frame.x) > 0.0 { CornerKind::Hollow } else { CornerKind::Jutting };
        let foot = wall.frame.origin;
        corners.push(Corner::new(foot, Vector3::z() * plan.height, level, kind));
        corners.push(Corner::new(foot + Vector3::z() * plan.height, -Vector3::z() * plan.height, level, kind));
    }
    corners
}
