//! Tracks of lines: identities, predictions by motions, jumps, options.

#![allow(clippy::unwrap_used)]

mod scene;

use scene::random;
use tiltvp_core::lines::{
    FrameMemory, Line, LineTracker, Lines, MatchOptions, Motion, TrackedLine, TrackerOptions, TrackerState,
};

/// A frame of lines that are told apart by their descriptors: unit vectors, one for each name.
fn frame(names: &[usize], bearing: impl Fn(usize) -> f64) -> (Lines, Vec<f32>) {
    let mut descriptors = vec![0.0; names.len() * 64];
    let line = |name: usize| Line {
        bearing_rad: bearing(name),
        sigma_rad: 1e-3,
        support_px: 50,
        elevation_min_rad: 0.0,
        elevation_max_rad: 0.5,
        polarity: 1.0,
    };
    for (i, name) in names.iter().enumerate() {
        descriptors[i * 64 + name] = 1.0;
    }
    (Lines { lines: names.iter().map(|name| line(*name)).collect(), ..Lines::default() }, descriptors)
}

#[test]
fn tracks_are_born_die_are_found_again_and_never_reused() {
    let mut tracker = LineTracker::new(TrackerOptions { look_back: 3, ..TrackerOptions::default() }).unwrap();
    let mut out: Vec<TrackedLine> = Vec::new();
    let mut step = |tracker: &mut LineTracker, names: &[usize]| {
        let (lines, descriptors) = frame(names, |name| name as f64 * 0.1);
        tracker.update(&lines, &descriptors, None, &mut out).unwrap();
        out.iter().map(|line| (line.track, line.frames_back)).collect::<Vec<_>>()
    };
    assert_eq!(step(&mut tracker, &[0, 1, 2, 3]), [(0, 0), (1, 0), (2, 0), (3, 0)]);
    assert_eq!(step(&mut tracker, &[1, 2, 3]), [(1, 1), (2, 1), (3, 1)]);
    assert_eq!(step(&mut tracker, &[]), []);
    assert_eq!(step(&mut tracker, &[0, 3, 2]), [(0, 3), (3, 2), (2, 2)]);
    let kept = tracker.state().clone();
    assert_eq!(step(&mut tracker, &[1, 3, 9]), [(1, 3), (3, 1), (4, 0)]);
    for _ in 0..3 {
        step(&mut tracker, &[]);
    }
    assert_eq!(step(&mut tracker, &[1, 3]), [(5, 0), (6, 0)]);
    let mut again = LineTracker::with_state(*tracker.options(), kept).unwrap();
    assert_eq!(step(&mut again, &[1, 3, 9]), [(1, 3), (3, 1), (4, 0)]);
}

#[test]
fn a_known_turn_keeps_far_lines_apart_and_unknown_turns_do_not() {
    let see = |tracker: &mut LineTracker, bearing: f64, turn: Option<f64>| {
        let mut out = Vec::new();
        let (lines, descriptors) = frame(&[0, 1, 2], |name| bearing + 1.0 * name as f64);
        let motion = turn.map(|turn_rad| Motion { turn_rad, distance_m: Some(0.0) });
        tracker.update(&lines, &descriptors, motion.as_ref(), &mut out).unwrap();
        out.iter().map(|line| line.track).collect::<Vec<_>>()
    };
    let mut tracker = LineTracker::default();
    assert_eq!(see(&mut tracker, 0.0, None), [0, 1, 2]);
    // The robot turns left: bearings fall by as much.
    assert_eq!(see(&mut tracker, -0.5, Some(0.5)), [0, 1, 2]);
    assert_eq!(see(&mut tracker, 0.0, Some(0.5)), [3, 4, 5]);
    assert_eq!(see(&mut tracker, 2.0, None), [3, 4, 5]);
    let own = tracker.state().clone();
    // Two of one track would give it to two lines.
    let twice =
        |frame: &FrameMemory| FrameMemory { tracks: frame.tracks.repeat(2), descriptors: frame.descriptors.repeat(2) };
    for wrong in [
        TrackerState { next_track: 1, ..own.clone() },
        TrackerState { next_track: u64::MAX, ..own.clone() },
        TrackerState { next_frame: u64::MAX, ..own.clone() },
        TrackerState { followed: own.followed.iter().chain(&own.followed).cloned().collect(), ..own.clone() },
        TrackerState { frames: own.frames.iter().map(twice).collect(), ..own },
    ] {
        assert!(LineTracker::with_state(TrackerOptions::default(), wrong).is_err());
    }
}

/// There is no frame after the last, whose number a state could not have.
#[test]
fn counting_ends_with_a_refusal() {
    let last = u64::MAX / 2;
    for (next_frame, next_track, lines) in [(last, 0, 0), (last, 0, 2), (0, last - 1, 2)] {
        let state = TrackerState { next_frame, next_track, ..TrackerState::default() };
        let mut tracker = LineTracker::with_state(TrackerOptions::default(), state.clone()).unwrap();
        let (lines, descriptors) = frame(&[0, 1][..lines], |name| name as f64);
        let refusal = tracker.update(&lines, &descriptors, None, &mut Vec::new()).unwrap_err().to_string();
        assert!(refusal.contains("below 2^63") && tracker.state() == &state, "{refusal}");
    }
}

/// Edges around a robot that drives to and fro, the nearest half a metre away, three of them alike: each keeps its track, also
/// after frames without it.
#[test]
fn a_known_motion_keeps_near_edges_and_edges_that_look_alike_on_their_tracks() {
    let edges: Vec<[f64; 2]> =
        vec![[0.2, 0.7], [0.3, -0.6], [2.0, 1.0], [2.0, 1.08], [2.0, 1.16], [-1.5, 2.0], [0.3, -2.0], [-1.2, -0.8]];
    for (camera_m, seed) in [([0.0; 2], 1), ([0.15, -0.1], 2)] {
        let mut tracker = LineTracker::new(TrackerOptions { camera_m, ..TrackerOptions::default() }).unwrap();
        let (mut x, mut y, mut yaw, mut out) = (0.0f64, 0.0f64, 0.0f64, Vec::new());
        for k in 0..40u64 {
            let (distance, turn) = if (10..30).contains(&k) { (-0.04, -0.03) } else { (0.04, -0.03) };
            if k > 0 {
                let chord = distance * (0.5f64 * turn).sin() / (0.5 * turn);
                (x, y) = (x + chord * (yaw + 0.5 * turn).cos(), y + chord * (yaw + 0.5 * turn).sin());
                yaw += turn;
            }
            let (s, c) = yaw.sin_cos();
            let at = [x + c * camera_m[0] - s * camera_m[1], y + s * camera_m[0] + c * camera_m[1]];
            let bearing = |name: usize| {
                let angle = (edges[name][1] - at[1]).atan2(edges[name][0] - at[0]) - yaw;
                angle.sin().atan2(angle.cos()) + 2e-3 * (random(seed, 100 * k + name as u64) - 0.5)
            };
            // Edge 6 blinks, edges 2 to 4 have one descriptor.
            let names: Vec<usize> = (0..edges.len()).filter(|name| *name != 6 || k % 4 == 0).collect();
            let (lines, mut descriptors) = frame(&names, bearing);
            for (i, name) in names.iter().enumerate().filter(|(_, name)| (3..5).contains(*name)) {
                descriptors[i * 64 + name] = 0.0;
                descriptors[i * 64 + 2] = 1.0;
            }
            // Encoders err.
            let told = Motion {
                turn_rad: if k > 0 { turn + 0.01 * (random(seed + 9, k) - 0.5) } else { 0.0 },
                distance_m: Some(if k > 0 { distance } else { 0.0 }),
            };
            tracker.update(&lines, &descriptors, Some(&told), &mut out).unwrap();
            for (tracked, name) in out.iter().zip(&names) {
                assert_eq!(tracked.track as usize, *name, "frame {k}");
            }
        }
    }
}

/// Twelve lines go on by any turn that was not told, as after a bump. Other lines at the same places do not, nor do a few.
#[test]
fn lines_go_on_where_the_camera_jumps_and_are_new_where_the_scene_does() {
    let still = Motion { turn_rad: 0.0, distance_m: Some(0.05) };
    let bearing = |name: usize| 0.4 * (name % 15) as f64 + 0.1 * random(3, name as u64);
    for (jump_rad, names, shared) in [
        (0.0, 0..12, 12),
        (0.07, 0..12, 12),
        (-2.8, 0..12, 12),
        (0.07, 7..19, 0),
        (0.07, 15..27, 0),
        (0.0, 15..27, 0),
        (0.07, 0..4, 0),
    ] {
        let (mut tracker, mut out) = (LineTracker::default(), Vec::new());
        let first: Vec<usize> = if names.len() > 4 { (0..12).collect() } else { (0..4).collect() };
        let (lines, descriptors) = frame(&first, bearing);
        for _ in 0..2 {
            assert_eq!(tracker.update(&lines, &descriptors, Some(&still), &mut out).unwrap(), 0.0);
        }
        let names: Vec<usize> = names.collect();
        let (lines, descriptors) = frame(&names, |name| bearing(name) - jump_rad);
        let found = tracker.update(&lines, &descriptors, Some(&still), &mut out).unwrap();
        let going_on = out.iter().filter(|line| line.frames_back > 0).count();
        let expected = if shared > 0 { jump_rad } else { 0.0 };
        assert!((found - expected).abs() < 0.02 && going_on == shared, "{names:?}, {jump_rad}: {found}, {going_on}");
    }
}

/// What a tracker makes of three frames by a distance and a turn, by a turn alone, and by nothing.
fn course(options: TrackerOptions) -> (Vec<Vec<TrackedLine>>, TrackerState) {
    let mut tracker = LineTracker::new(options).unwrap();
    let mut all = Vec::new();
    let metric = Motion { turn_rad: 0.02, distance_m: Some(0.05) };
    for (k, motion) in [None, Some(metric), Some(Motion { distance_m: None, ..metric }), None].iter().enumerate() {
        let off = k as f64;
        let (lines, mut descriptors) = frame(&[0, 1, 2, 3, 4], |name| 0.5 + name as f64 - 0.02 * off);
        let mut lines = lines;
        // One is off, one looks another way, one is off and looks another way.
        lines.lines[1].bearing_rad -= 0.045 * off;
        for (line, share) in [(2, 0.6 * off), (3, 0.3 * off)] {
            descriptors[line * 64 + 40 + k] = share as f32;
        }
        lines.lines[3].bearing_rad += 0.02 * off;
        let mut out = Vec::new();
        tracker.update(&lines, &descriptors, motion.as_ref(), &mut out).unwrap();
        all.push(out);
    }
    (all, tracker.state().clone())
}

#[test]
fn every_option_of_the_tracker_is_read() {
    let plain = TrackerOptions::default();
    let matching = |distance_max, mean_ratio_max, second_ratio_max| TrackerOptions {
        matching: MatchOptions { distance_max, mean_ratio_max, second_ratio_max, ..plain.matching },
        ..plain
    };
    for (name, options) in [
        ("look_back", TrackerOptions { look_back: 2, ..plain }),
        ("f1", matching(0.1, 0.75, 0.8)),
        ("f2", matching(1.05, 0.1, 0.8)),
        ("f3", matching(1.05, 0.75, 0.1)),
        ("nearest_m", TrackerOptions { nearest_m: 1.0, ..plain }),
        ("camera_m", TrackerOptions { camera_m: [0.3, 0.1], ..plain }),
        ("camera_yaw_rad", TrackerOptions { camera_yaw_rad: 0.5, ..plain }),
        ("turn_sigma_rad", TrackerOptions { turn_sigma_rad: 0.05, ..plain }),
        ("distance_sigma", TrackerOptions { distance_sigma: 0.9, ..plain }),
        ("rate_sigma_rad", TrackerOptions { rate_sigma_rad: 0.001, ..plain }),
        ("bearing_sigma_rad", TrackerOptions { bearing_sigma_rad: 0.02, ..plain }),
        ("gate_sigmas", TrackerOptions { gate_sigmas: 0.2, ..plain }),
        ("descriptor_sigma", TrackerOptions { descriptor_sigma: 0.1, ..plain }),
        ("descriptor_max", TrackerOptions { descriptor_max: 0.1, ..plain }),
        ("new_cost", TrackerOptions { new_cost: 1.0, ..plain }),
    ] {
        let (mine, other) = (course(plain), course(options));
        // The last frame is matched without a motion: only tracks tell how it went.
        let tracks = |all: &[Vec<TrackedLine>]| all.concat().iter().map(|line| line.track).collect::<Vec<_>>();
        let told = |c: &(Vec<Vec<TrackedLine>>, TrackerState)| (tracks(&c.0), c.1.frames.len());
        let near = |c: &TrackerOptions| {
            let mut tracker = LineTracker::new(*c).unwrap();
            let metric = Motion { turn_rad: 0.02, distance_m: Some(0.05) };
            let mut out = Vec::new();
            for k in 0..2 {
                let (lines, descriptors) = frame(&[0, 1], |name| 0.5 + name as f64 - 0.02 * f64::from(k));
                tracker.update(&lines, &descriptors, Some(&metric), &mut out).unwrap();
            }
            tracker.state().followed.clone()
        };
        assert!(told(&mine) != told(&other) || near(&plain) != near(&options), "{name} changes nothing");
    }
}
