//! Which attitude most straight edges of a frame have, and how sure that is.

use nalgebra::{Matrix3, Vector3};

use super::askew::askew;
use super::common_attitude::{CommonAttitude, REACH_SINE, StraightEdge, common_attitude, common_attitude_amid_others};
use super::manhattan::{manhattan, manhattan_about};

/// The share of all edges along the axes of one attitude that is enough to trust it: random edges pass within 2 degrees
/// of one of three axes in a tenth of all cases.
pub(crate) const MOST: f64 = 0.4;

/// How far the vertical of what stands beside most may be from theirs: the sine of 1 degree. Desks, cupboards and boxes are 0.1 to 0.4 degrees
/// off, as edges that are nearly level tell it; backs of chairs, whose edges are at no right angles, 2 to 10.
const UPRIGHT_SINE: f64 = 0.0175;

/// Attitudes about which the common one may be.
#[derive(Debug, Clone, Default)]
pub(crate) struct Starts {
    /// The likeliest first.
    pub(crate) attitudes: Vec<Matrix3<f64>>,
    /// Whether the first is that of one corner in one image, which any three lines make.
    pub(crate) lone: bool,
}

/// The attitude that most lines have in common; where most have none, that near the first of `starts`, which may be turned against most
/// of the room. That of a lone corner is held against the others in any case. Beside them one is found by lines alone, upright near
/// `down`, else as the first start is; lines that run along the axes of the other one tell nothing.
pub(crate) fn attitude_of_most(
    lines: &[StraightEdge],
    starts: &Starts,
    down: Option<Vector3<f64>>,
) -> Option<CommonAttitude> {
    let common = most_common(lines, starts, down)?;
    Some(CommonAttitude { covariance: common.covariance + askew(lines, &common), ..common })
}

/// That attitude, as if all edges were of things that stand parallel.
fn most_common(
    lines: &[StraightEdge],
    Starts { attitudes, lone }: &Starts,
    down: Option<Vector3<f64>>,
) -> Option<CommonAttitude> {
    let of_first = attitudes.first().and_then(|start| common_attitude(lines, start));
    let down = down.or(attitudes.first().map(|start| start.column(1).into_owned()))?;
    let others = attitudes.iter().skip(1).copied().chain(manhattan(lines, &down));
    let is_of_most = |common: &CommonAttitude| common.support >= MOST * lines.len() as f64;
    let found = others.filter_map(|start| common_attitude(lines, &start)).filter(is_of_most);
    let best = found.max_by(|a, b| a.support.total_cmp(&b.support));
    let (Some(first), Some(other)) = (of_first, best) else { return of_first.or(best) };
    let agreed = !lone && is_of_most(&first);
    // A count scatters by its root: with less than that more, the corners' own one is as good.
    let is_better = other.support - first.support > other.support.sqrt();
    let (common, rival) = if is_better && !agreed { (other, first) } else { (first, other) };
    Some(if is_of_most(&rival) { by_own_lines(lines, &common, &rival) } else { common })
}

/// An attitude without the lines that run along another axis of a rival: a wall's edges may pass within a degree or two of the axis of a
/// cuboid that stands turned before it.
fn by_own_lines(lines: &[StraightEdge], common: &CommonAttitude, rival: &CommonAttitude) -> CommonAttitude {
    let nearest = |line: &StraightEdge, attitude: &Matrix3<f64>| {
        let (axis, miss) = line.missed(attitude);
        (attitude.column(axis).into_owned(), miss.abs())
    };
    let is_own = |line: &&StraightEdge| {
        let (own, miss) = nearest(line, &common.camera_from_object);
        let (others, others_miss) = nearest(line, &rival.camera_from_object);
        miss <= others_miss || own.cross(&others).norm() <= REACH_SINE
    };
    let own: Vec<StraightEdge> = lines.iter().filter(is_own).copied().collect();
    let refined = common_attitude_amid_others(&own, &common.camera_from_object);
    refined.map_or(*common, |refined| CommonAttitude { support: common.support, ..refined })
}

/// The attitude of what stands upright beside most, turned about the second axis of their `attitude`: that which most lines have in common
/// of those along none of its axes. Such lines tell their vertical again.
pub(crate) fn attitude_beside(lines: &[StraightEdge], attitude: &Matrix3<f64>) -> Option<CommonAttitude> {
    let others: Vec<StraightEdge> = lines.iter().filter(|line| !line.runs_along(attitude)).copied().collect();
    let vertical = attitude.column(1).into_owned();
    let found = common_attitude(&others, &manhattan_about(&others, &vertical)?)?;
    let leans = found.camera_from_object.column(1).cross(&vertical).norm() > UPRIGHT_SINE;
    (!leans).then_some(found)
}

#[cfg(test)]
mod tests {
    use nalgebra::Rotation3;

    use super::super::common_attitude::tests::{lines, off_in_any_naming_rad};
    use super::*;

    #[test]
    fn corners_have_their_own_attitude_unless_another_has_clearly_more_lines() {
        let [own, other] = [0.0, 0.8].map(|turn_rad| {
            let turn = Rotation3::from_axis_angle(&Vector3::y_axis(), turn_rad);
            *(Rotation3::from_euler_angles(0.5, -0.3, 0.2) * turn).matrix()
        });
        let found = |of_own: u32, of_other: u32, lone: bool| {
            let both = [lines(&own, of_own, &[0.001, -0.001]), lines(&other, of_other, &[0.001, -0.001])].concat();
            let found = attitude_of_most(&both, &Starts { attitudes: vec![own], lone }, None).unwrap();
            [own, other].map(|of| off_in_any_naming_rad(&found.camera_from_object, &of) < 5e-3)
        };
        assert_eq!(found(12, 6, true), [true, false]);
        assert_eq!(found(12, 13, true), [true, false]);
        assert_eq!(found(12, 17, true), [false, true]);
        assert_eq!(found(12, 17, false), [true, false]);
        assert_eq!(found(6, 40, false), [false, true]);
        assert!(attitude_of_most(&lines(&own, 12, &[0.0]), &Starts::default(), None).is_none());
    }

    #[test]
    fn edges_of_walls_do_not_turn_the_cuboid_before_them() {
        let own = *Rotation3::from_euler_angles(0.5, -0.3, 0.2).matrix();
        let walls = own * Rotation3::from_axis_angle(&Vector3::y_axis(), 0.8).matrix();
        // Edges of a wall near the horizon, whose plane passes within a degree of the cuboid's axis.
        let near = |k: u32| {
            let rise = (0.005 + 0.001 * f64::from(k)) / 0.8_f64.sin();
            let normal = walls.column(1) * rise.cos() + walls.column(2) * rise.sin();
            StraightEdge { normal, sigma_rad: 0.002, length_px: 200.0 }
        };
        let (cuboid, wall) = (lines(&own, 12, &[0.001, -0.001]), lines(&walls, 10, &[0.001, -0.001]));
        let all = [cuboid, wall, (0..8).map(near).collect()].concat();
        let off_rad = |found: &CommonAttitude| off_in_any_naming_rad(&found.camera_from_object, &own);
        let by_all = off_rad(&common_attitude(&all, &own).unwrap());
        let starts = Starts { attitudes: vec![own], lone: false };
        let found = off_rad(&attitude_of_most(&all, &starts, None).unwrap());
        assert!(found < 0.5 * by_all, "{found} {by_all}");
    }

    #[test]
    fn what_stands_upright_beside_most_has_an_attitude_of_its_own() {
        let most = *Rotation3::from_euler_angles(0.5, -0.3, 0.2).matrix();
        let beside = |turn: [f64; 3]| {
            let own = most * Rotation3::from_euler_angles(turn[0], turn[1], turn[2]).matrix();
            let all = [lines(&most, 20, &[0.001, -0.001]), lines(&own, 8, &[0.001, -0.001])].concat();
            attitude_beside(&all, &most).map(|found| off_in_any_naming_rad(&found.camera_from_object, &own))
        };
        assert!(beside([0.0, 0.3, 0.0]).is_some_and(|off_rad| off_rad < 3e-3));
        // A chair's back leans.
        assert_eq!(beside([0.1, 0.3, 0.0]), None);
        assert_eq!(attitude_beside(&lines(&most, 20, &[0.001, -0.001]), &most), None);
    }
}
