//! What the targets have learned, which every build of the core takes: `cargo test --package tiltvp-benches --test fuzz`.

use std::fs;

type Target = fn(&[u8]);

/// Inputs of any bytes for each target.
const INPUTS: usize = 200;

const TARGETS: [(&str, Target); 12] = [
    ("lens", crate::lens),
    ("image", crate::image),
    ("segments", crate::segments),
    ("corner", crate::corner),
    ("point", crate::point),
    ("options", crate::options),
    ("state", crate::state),
    ("calibrator", crate::calibrator),
    ("matching", crate::matching),
    ("sequence", crate::sequence),
    ("log", crate::log),
    ("training", crate::training),
];

/// The inputs of a target that are kept, one after the other, as a run of the fuzzer begins.
#[test]
fn every_target_takes_what_is_kept() {
    for (name, target) in TARGETS {
        let folder = format!("{}/../fuzz/corpus/{name}", env!("CARGO_MANIFEST_DIR"));
        let kept = fs::read_dir(&folder).expect("a folder of inputs").map(|file| file.expect("a file").path());
        let kept: Vec<_> = kept.collect();
        assert!(!kept.is_empty(), "{folder}");
        for path in kept {
            target(&fs::read(path).expect("an input"));
        }
    }
}

/// Inputs that nobody chose: what a fuzzer would come upon first.
#[test]
fn every_target_takes_any_bytes() {
    let mut state = 20_171_028u64;
    let mut byte = || {
        // Marsaglia 2003.
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 32) as u8
    };
    for (_, target) in TARGETS {
        for _ in 0..INPUTS {
            let length = 4 * usize::from(byte()) / 3;
            target(&(0..length).map(|_| byte()).collect::<Vec<_>>());
        }
    }
}
