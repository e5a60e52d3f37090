//! Lines of any numbers, matched and followed: refused, or no line is two.

use tiltvp_core::lines::{
    BearingGate, Line, LineTracker, Lines, MatchOptions, MatchScratch, Motion, Profiles, TrackerOptions, WideOptions,
    WideScratch, match_descriptors, match_wide,
};

use crate::bytes::Bytes;

/// Values of a profile.
const PROFILE: usize = 190;

/// Two images by descriptors, and by profiles; then frames of any lines and motions.
pub fn matching(data: &[u8]) {
    let mut bytes = Bytes::new(data);
    let [a, b] = [(); 2].map(|()| lines(&mut bytes));
    let (n, m) = (a.lines.len(), b.lines.len());
    let width = 1 + bytes.below(4);
    let [x, y] = [n, m].map(|count| values(&mut bytes, count * width));
    let [expected_rad, seen_rad] = [&a, &b].map(|of| of.lines.iter().map(|line| line.bearing_rad).collect::<Vec<_>>());
    let gate_rad = bytes.mostly(0.0, 1.0);
    let gate = BearingGate { expected_rad: &expected_rad, seen_rad: &seen_rad, gate_rad };
    let (mut scratch, mut found) = (MatchScratch::default(), Vec::new());
    let gate = bytes.flag().then_some(&gate);
    if match_descriptors(&x, &y, width, &MatchOptions::default(), gate, &mut scratch, &mut found).is_ok() {
        assert!(found.iter().all(|pair| pair.a < n && pair.b < m), "{found:?}");
        assert!(found.windows(2).all(|two| two[0].a < two[1].a), "{found:?}");
    }
    let [x, y] = [n, m].map(|count| values(&mut bytes, count * PROFILE));
    let ahead = bytes.flag().then(|| [bytes.mostly(-3.2, 3.2), bytes.mostly(-3.2, 3.2)]);
    let (first, second) = (Profiles { lines: &a, values: &x }, Profiles { lines: &b, values: &y });
    let (mut scratch, mut found) = (WideScratch::default(), Vec::new());
    if match_wide(&first, &second, ahead, &WideOptions::default(), &mut scratch, &mut found).is_ok() {
        assert!(found.iter().all(|pair| (0.0..=1.0).contains(&pair.confidence)), "{found:?}");
        let mut seconds: Vec<_> = found.iter().map(|pair| pair.b).collect();
        seconds.sort_unstable();
        assert!(seconds.windows(2).all(|two| two[0] < two[1]), "one line is two: {found:?}");
    }
    follow(&mut bytes);
}

fn follow(bytes: &mut Bytes<'_>) {
    let (mut tracker, mut out) = (LineTracker::default(), Vec::new());
    for _ in 0..=bytes.byte() % 4 {
        let seen = lines(bytes);
        let descriptors = values(bytes, 3 * seen.lines.len());
        let motion = bytes.flag().then(|| Motion {
            turn_rad: bytes.mostly(-1.0, 1.0),
            distance_m: bytes.flag().then(|| bytes.mostly(-1.0, 1.0)),
        });
        let before = tracker.state().clone();
        if tracker.update(&seen, &descriptors, motion.as_ref(), &mut out).is_err() {
            assert_eq!(before, *tracker.state(), "a frame that was refused has changed the state");
        }
        let state = tracker.state().clone();
        let again = LineTracker::with_state(TrackerOptions::default(), state).expect("its own state");
        assert_eq!(again.state(), tracker.state(), "{seen:?} {motion:?}");
    }
}

/// A few lines of any numbers, in the order of their bearings.
pub(crate) fn lines(bytes: &mut Bytes<'_>) -> Lines {
    let mut lines = Lines::default();
    for _ in 0..bytes.byte() % 6 {
        lines.lines.push(Line {
            bearing_rad: bytes.mostly(-3.1, 3.1),
            sigma_rad: bytes.mostly(1e-4, 0.1),
            support_px: bytes.byte().into(),
            elevation_min_rad: bytes.mostly(-0.5, 0.0),
            elevation_max_rad: bytes.mostly(0.0, 0.5),
            polarity: bytes.mostly(-1.0, 1.0),
        });
    }
    lines.lines.sort_by(|a, b| a.bearing_rad.total_cmp(&b.bearing_rad));
    lines
}

/// So many, of which the bytes make the first, and these the others.
fn values(bytes: &mut Bytes<'_>, count: usize) -> Vec<f32> {
    let own: Vec<f32> = (0..=bytes.below(16)).map(|_| bytes.mostly(0.0, 1.0) as f32).collect();
    own.into_iter().cycle().take(count).collect()
}
