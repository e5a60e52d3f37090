//! Names in made-up worlds: corners with known places before a camera that moves, hides them and loses its way.

use nalgebra::{Matrix3, Matrix6, Rotation3, Vector3};
use std::collections::BTreeMap;

use super::CornerNames;
use crate::corner::estimate::{BelievedCorner, Hypothesis};
use crate::corner::estimator_options::EstimatorOptions;
use crate::geometry::RigidMotion;

/// A corner of a world: its place, and the signs of its edges along the axes.
type Corner = (Vector3<f64>, [f64; 3]);

/// Standard deviation of what is seen, metres and radians.
const NOISE_M: f64 = 0.004;
const NOISE_RAD: f64 = 0.002;

/// Numbers between -1 and 1 that look random.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as f64 / f64::from(1_u32 << 30) - 1.0
    }

    fn vector(&mut self) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.next())
    }
}

fn seen(corner: &Corner, camera_from_world: &RigidMotion, numbers: &mut Numbers) -> BelievedCorner {
    let turn = Rotation3::new(numbers.vector() * NOISE_RAD * 1.7);
    let rotation = turn.matrix() * camera_from_world.rotation;
    let mut covariance = Matrix6::identity() * NOISE_RAD.powi(2);
    covariance.fixed_view_mut::<3, 3>(3, 3).copy_from(&(Matrix3::identity() * NOISE_M.powi(2)));
    let pose = Hypothesis {
        camera_from_object: rotation,
        edges: [0, 1, 2].map(|axis| rotation.column(axis) * corner.1[axis]),
        // Even numbers of the same spread.
        vertex_m: Some(camera_from_world.point(&corner.0) + numbers.vector() * NOISE_M * 1.7),
        covariance,
        probability: 1.0,
        right_handed: corner.1.iter().product::<f64>() > 0.0,
        misfit: 1.0,
    };
    BelievedCorner { id: None, hypotheses: vec![pose], left: 0, right: Some(0), ends: [None; 3], angles: [None; 3] }
}

/// Before a world, a step aside for each frame, and turned about the vertical (radians).
fn camera(frame: u32, turn: f64) -> RigidMotion {
    let aside = Vector3::new(0.01 * f64::from(frame), 0.0, 2.5);
    let rotation = *Rotation3::from_axis_angle(&Vector3::y_axis(), 0.3 + turn).matrix();
    RigidMotion { rotation, translation_m: aside }
}

/// Names that frames give to the corners that they show, none for those that have none.
struct Watch {
    names: CornerNames,
    numbers: Numbers,
}

impl Watch {
    fn new(seed: u64) -> Self {
        Self { names: CornerNames::default(), numbers: Numbers(seed) }
    }

    fn look(&mut self, world: &[Corner], shown: &[usize], camera_from_world: &RigidMotion) -> BTreeMap<usize, u32> {
        let mut corners: Vec<BelievedCorner> =
            shown.iter().map(|which| seen(&world[*which], camera_from_world, &mut self.numbers)).collect();
        self.names.give(&mut corners, &EstimatorOptions::default());
        shown.iter().zip(corners).filter_map(|(which, corner)| Some((*which, corner.id?))).collect()
    }
}

/// A box, a shelf and something else, all about the origin.
fn things() -> Vec<Corner> {
    vec![
        (Vector3::new(0.0, 0.0, 0.0), [1.0, 1.0, 1.0]),
        (Vector3::new(0.4, 0.0, 0.0), [-1.0, 1.0, 1.0]),
        (Vector3::new(0.0, 0.3, 0.0), [1.0, -1.0, 1.0]),
        (Vector3::new(-0.7, 0.2, 0.5), [-1.0, -1.0, 1.0]),
        (Vector3::new(0.9, -0.5, 0.4), [-1.0, 1.0, -1.0]),
    ]
}

#[test]
fn what_is_hidden_keeps_its_name() {
    let world = things();
    for seed in 0..20 {
        let mut watch = Watch::new(seed);
        let mut first = BTreeMap::new();
        for frame in 0..60 {
            // Longer than the last pose is remembered.
            let shown: &[usize] = if (20..50).contains(&frame) { &[1, 3] } else { &[0, 1, 2, 3, 4] };
            let names = watch.look(&world, shown, &camera(frame, 0.0));
            if frame == 0 {
                first.clone_from(&names);
            }
            assert_eq!(names.len(), shown.len(), "seed {seed}, frame {frame}");
            assert!(names.iter().all(|(which, id)| first[which] == *id), "seed {seed}, frame {frame}");
        }
        assert_eq!(first.values().collect::<std::collections::BTreeSet<_>>().len(), world.len());
    }
}

#[test]
fn what_was_moved_has_a_new_name() {
    let mut watch = Watch::new(3);
    let mut world = things();
    let before = (0..10).map(|frame| watch.look(&world, &[0, 1, 2, 3, 4], &camera(frame, 0.0))).last().unwrap();
    (10..40).for_each(|frame| {
        watch.look(&world, &[1, 2, 3], &camera(frame, 0.0));
    });
    // To where another corner stands that is hidden: its edges run otherwise.
    world[4].0 = world[0].0;
    let after = watch.look(&world, &[1, 2, 3, 4], &camera(40, 0.0));
    assert!(!before.values().any(|id| *id == after[&4]));
    assert!([1, 2, 3].iter().all(|which| before[which] == after[which]));
    // A little aside it is not told from what was there.
    let mut world = things();
    world[0].0.x += 0.1;
    let after = watch.look(&world, &[0, 1, 2, 3], &camera(41, 0.0));
    assert_ne!(after.get(&0), Some(&before[&0]));
}

#[test]
fn a_camera_that_lost_its_way_knows_three_corners_and_not_two() {
    let world = things();
    for (shown, known) in [(&[0, 2, 3, 4][..], true), (&[0, 3][..], false)] {
        let mut watch = Watch::new(5);
        let before = (0..10).map(|frame| watch.look(&world, &[0, 1, 2, 3, 4], &camera(frame, 0.0))).last().unwrap();
        (10..70).for_each(|frame| {
            watch.look(&world, &[], &camera(frame, 0.0));
        });
        let after = watch.look(&world, shown, &camera(30, 0.2));
        assert!(after.iter().all(|(which, id)| (before[which] == *id) == known), "{before:?} {after:?}");
    }
}

#[test]
fn a_table_from_its_other_side_is_not_taken_for_the_same_side() {
    let table: Vec<Corner> = [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)]
        .map(|(x, z): (f64, f64)| (Vector3::new(0.5 * x, 0.0, 0.3 * z), [-x, 1.0, -z]))
        .to_vec();
    let mut watch = Watch::new(7);
    let before = (0..10).map(|frame| watch.look(&table, &[0, 1, 2, 3], &camera(frame, 0.0))).last().unwrap();
    (10..70).for_each(|frame| {
        watch.look(&table, &[], &camera(frame, 0.0));
    });
    let after = watch.look(&table, &[0, 1, 2, 3], &camera(10, std::f64::consts::PI));
    assert!(after.iter().all(|(which, id)| !before.values().any(|old| old == id) || before[which] == *id));
}

#[test]
fn different_corners_never_share_a_name() {
    for seed in 0..40 {
        let mut numbers = Numbers(1000 + seed);
        let world: Vec<Corner> =
            (0..12).map(|_| (numbers.vector(), [0, 1, 2].map(|_| numbers.next().signum()))).collect();
        let mut watch = Watch::new(seed);
        let mut owners: BTreeMap<u32, usize> = BTreeMap::new();
        for frame in 0..80 {
            // The camera loses its way now and then, and jumps meanwhile.
            let shown: Vec<usize> = (0..world.len()).filter(|_| numbers.next() > 0.2 && frame % 30 < 18).collect();
            let jumped = camera(frame, 0.3 * f64::from(frame / 30));
            for (which, id) in watch.look(&world, &shown, &jumped) {
                assert_eq!(*owners.entry(id).or_insert(which), which, "seed {seed}, frame {frame}");
            }
        }
    }
}

#[test]
fn names_are_not_given_again() {
    let world = things();
    let mut watch = Watch::new(2);
    let before = watch.look(&world, &[0, 1], &camera(0, 0.0));
    watch.names.forget();
    let after = watch.look(&world, &[0, 1], &camera(1, 0.0));
    assert!(before.values().all(|id| !after.values().any(|other| other == id)));
}
