//! Every kernel against single numbers, to the last bit.

use super::*;

const WIDTH: usize = 300;

/// What a kernel finds: slots, places, gradients, how many were strong.
type Found = (Vec<u32>, Vec<u32>, Vec<i16>, Vec<i16>, usize);

fn found(with: impl FnOnce(&mut KeptPixels<'_>)) -> Found {
    let room = 3 * WIDTH;
    let (mut slots, mut places) = (vec![0; room], vec![0; room]);
    let (mut gx, mut gy) = (vec![0; room], vec![0; room]);
    let mut kept = KeptPixels { slots: &mut slots, places: &mut places, gx: &mut gx, gy: &mut gy, len: 0, strong: 0 };
    with(&mut kept);
    let (len, strong) = (kept.len, kept.strong);
    slots.truncate(len);
    places.truncate(len);
    gx.truncate(len);
    gy.truncate(len);
    (slots, places, gx, gy, strong)
}

fn compare<L: GradientLevel>(data: &[L], at_least: i32) {
    let each: Vec<[i16; 2]> = (0..WIDTH as i16).map(|i| [i * 107 - 30_000, 20_000 - i * 11]).collect();
    let levels = Levels { data, stride: WIDTH, places: usize::MAX, left: 0 };
    let (mut passing, mut kernels) = (0, GradientKernel::all());
    for n in (1..150).chain([200]) {
        // The last ones reach the end of the data.
        for first in [1, 9, WIDTH - 1 - n] {
            let blocks = |mask: &dyn Fn(u64) -> u64| -> Vec<PixelBlock> {
                let cut = (0..n).step_by(BLOCK);
                let own = |k: usize| mask(u64::MAX >> (k + BLOCK).saturating_sub(n));
                cut.map(|k| PixelBlock { own: own(k), slot: k as u32, place: place(1, first + k) }).collect()
            };
            let from = Directions::From { centre: [9000, -8000], parts: 91 };
            let fewer = Directions::Each(&each[..n / 2]);
            for directions in [Directions::None, Directions::Each(&each[..n]), fewer, from] {
                for at_least in [1, at_least, i32::MAX] {
                    let threshold = Threshold { at_least, directions, limit: 1e8 };
                    let plain = found(|kept| {
                        portable::threshold_blocks(&levels, &blocks(&|pixels| pixels), &threshold, kept);
                    });
                    for kernel in &mut kernels {
                        let own = blocks(&|pixels| kernel.mask::<L>(pixels));
                        let ours = found(|kept| {
                            kernel.run(&levels, &own, &threshold, kept);
                            kernel.flush::<L>(kept);
                        });
                        assert_eq!(ours, plain, "{n}, {threshold:?}");
                    }
                    passing += plain.0.len();
                }
            }
        }
    }
    assert!(passing > 30_000, "{passing}");
}

#[test]
fn vectors_give_the_same_bits_as_single_numbers() {
    let random = |i: u32| i.wrapping_mul(2_654_435_761).rotate_left(11).wrapping_mul(0x85eb_ca6b) >> 16;
    let numbers = || 0..3 * WIDTH as u32;
    let extreme = |i: u32| random(i) & 1 == 1;
    compare::<u8>(&numbers().map(|i| random(i) as u8).collect::<Vec<_>>(), 500 * 500);
    compare::<u8>(&numbers().map(|i| if extreme(i) { 255 } else { 0 }).collect::<Vec<_>>(), 500 * 500);
    compare::<i16>(&numbers().map(|i| (random(i) % 2041) as i16).collect::<Vec<_>>(), 4000 * 4000);
    compare::<i16>(&numbers().map(|i| if extreme(i) { 2040 } else { 0 }).collect::<Vec<_>>(), 4000 * 4000);
}

#[test]
fn widened_gradients_are_those_of_a_loop() {
    let gradients: Vec<i16> = (0..1000).map(|i| (i * 97 - 32_000) as i16).collect();
    let mut out = vec![f32::NAN; 1000];
    widen_gradients(&gradients, 0.125, &mut out);
    assert!(gradients.iter().zip(&out).all(|(g, out)| *out == f32::from(*g) * 0.125));
}
