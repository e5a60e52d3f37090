//! What the targets have learned, which every build of the core takes: `cargo test --package tiltvp-benches --test fuzz`.

use std::fs;

/// The inputs of a target that are kept, one after the other, as a run of the fuzzer begins.
#[test]
fn every_target_takes_what_is_kept() {
    type Target = fn(&[u8]);
    let targets: [(&str, Target); 8] = [
        ("lens", crate::lens),
        ("image", crate::image),
        ("segments", crate::segments),
        ("corner", crate::corner),
        ("point", crate::point),
        ("options", crate::options),
        ("state", crate::state),
        ("calibrator", crate::calibrator),
    ];
    for (name, target) in targets {
        let folder = format!("{}/../fuzz/corpus/{name}", env!("CARGO_MANIFEST_DIR"));
        let kept = fs::read_dir(&folder).expect("a folder of inputs").map(|file| file.expect("a file").path());
        let kept: Vec<_> = kept.collect();
        assert!(!kept.is_empty(), "{folder}");
        for path in kept {
            target(&fs::read(path).expect("an input"));
        }
    }
}
