//! How many instructions an image takes by each method: the same number on a busy machine as on a quiet one, held to a limit.
//!
//! Valgrind runs this very program (it knows vectors of 256 bits, not of 512). Limits are rewritten by hand, beside the change
//! that earns or costs them.

#![allow(clippy::unwrap_used, clippy::panic)]

mod scene;

use std::collections::BTreeMap;
use std::hint::black_box;
use std::process::Command;

use nalgebra::Matrix3;
use scene::{Image, fisheye, stripes};
use tiltvp_core::geometry::Tilt;
use tiltvp_core::image::ImageView;
use tiltvp_core::tilt::{METHODS, Scratch, TiltEstimate, TiltEstimator, TiltOptions};

/// Most instructions of one image of 240 x 240 pixels in the profile of the tests (with its checks of overflows; optimised
/// builds take fewer), in thousands, in the order of the methods: about a twentieth more than when they were last looked at.
const LIMITS: [u64; 4] = [2750, 1340, 1260, 585];

/// Names that valgrind shows, in the order of the methods.
const NAMES: [&str; 4] = ["refined_image", "sampled_image", "trimmed_image", "consensus_image"];

type Measured = fn(&TiltEstimator, &ImageView<'_>, &mut Scratch) -> Option<TiltEstimate>;

/// One image by one method, under a name of its own.
macro_rules! measured {
    ($($name:ident)*) => {
        $(
            #[inline(never)]
            fn $name(estimator: &TiltEstimator, image: &ImageView<'_>, scratch: &mut Scratch) -> Option<TiltEstimate> {
                // Functions of the same code would be made one.
                black_box(stringify!($name));
                black_box(estimator.estimate(image, scratch).ok())
            }
        )*
    };
}

measured!(refined_image sampled_image trimmed_image consensus_image);

/// What valgrind looks at: every method once, after a first image that grows its memory.
#[test]
#[ignore = "run under valgrind by the other test"]
fn images() {
    let camera = fisheye(240);
    let tilt = Tilt::from_alpha_beta(0.05, 0.7);
    let image: Image = stripes(&camera, &Matrix3::identity(), &tilt, 23, 2.0, 1);
    let functions: [Measured; 4] = [refined_image, sampled_image, trimmed_image, consensus_image];
    for (method, function) in METHODS.into_iter().zip(functions) {
        let options = TiltOptions::for_method(method).unwrap();
        let estimator = TiltEstimator::new(camera.clone(), Matrix3::identity(), options).unwrap();
        let mut scratch = estimator.scratch();
        estimator.estimate(&image.view(), &mut scratch).unwrap();
        assert!(function(&estimator, &image.view(), &mut scratch).unwrap().tilt.is_some());
    }
}

/// Inclusive cost by callee, of the first call of each.
fn costs(profile: &str) -> BTreeMap<String, u64> {
    let mut costs = BTreeMap::new();
    let mut lines = profile.lines();
    let mut callee = "";
    while let Some(line) = lines.next() {
        if let Some(name) = line.strip_prefix("cfn=") {
            callee = name;
        } else if line.starts_with("calls=") {
            let cost = lines.next().and_then(|line| line.split(' ').nth(1)).and_then(|cost| cost.parse().ok());
            costs.entry(callee.to_owned()).or_insert(cost.unwrap_or(0));
        }
    }
    costs
}

#[test]
fn an_image_takes_no_more_instructions_than_it_may() {
    let out = std::env::temp_dir().join(format!("tiltvp-instructions-{}", std::process::id()));
    let run = Command::new("valgrind")
        .args(["--tool=callgrind", "--compress-strings=no", "--compress-pos=no"])
        .arg(format!("--callgrind-out-file={}", out.display()))
        .arg(std::env::current_exe().unwrap())
        .args(["--exact", "images", "--ignored", "--test-threads=1"])
        .output()
        .unwrap_or_else(|error| panic!("this test needs valgrind (`apt-get install valgrind`): {error}"));
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let profile = std::fs::read_to_string(&out).unwrap();
    std::fs::remove_file(&out).unwrap();
    let costs = costs(&profile);
    let mut above = Vec::new();
    for ((method, name), limit) in METHODS.into_iter().zip(NAMES).zip(LIMITS) {
        let cost = costs.iter().find(|(callee, _)| callee.contains(name)).map(|(_, cost)| *cost / 1000);
        let cost = cost.unwrap_or_else(|| panic!("{name} is not in the profile"));
        println!("{method}: {cost} thousand instructions, at most {limit}");
        if cost > limit {
            above.push(format!("{method} takes {cost} thousand instructions, more than {limit}"));
        }
    }
    assert!(above.is_empty(), "{}", above.join("; "));
}
