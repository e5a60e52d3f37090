//! Long tables, made on as many threads as the machine has for us. No entry depends on how many those are.
//!
//! Threads are started for each table and end with it: a process may be forked at any time between.

use std::num::NonZero;
use std::ops::Range;
use std::panic::resume_unwind;
use std::sync::Mutex;
use std::thread;

use crate::interrupt::{Interrupt, check};

/// Entries after which a thread asks whether it is to end: a millisecond where an entry takes 0.2 us.
const BLOCK: usize = 4096;

/// Fewest blocks for which another thread is started: that takes 50 us, and they take milliseconds.
const LEAST: usize = 4;

/// The entries `0..len`, each by its number.
pub(crate) fn table<T: Clone + Default + Send>(len: usize, entry: impl Fn(usize) -> T + Sync) -> Vec<T> {
    table_in_blocks(len, BLOCK, entry)
}

/// The same of entries that take longer: `block` of them as long as [`BLOCK`] others.
pub(crate) fn table_in_blocks<T: Clone + Default + Send>(
    len: usize,
    block: usize,
    entry: impl Fn(usize) -> T + Sync,
) -> Vec<T> {
    filled_in_blocks(len, block, |first, out| out.iter_mut().enumerate().for_each(|(i, out)| *out = entry(first + i)))
}

/// The entries `0..len`, written by blocks of them: `fill` is told the number of a block's first.
pub(crate) fn filled<T: Clone + Default + Send>(len: usize, fill: impl Fn(usize, &mut [T]) + Sync) -> Vec<T> {
    filled_in_blocks(len, BLOCK, fill)
}

/// The entries of an image in row order, written by rows: `fill` is told the number of each.
pub(crate) fn rows<T: Clone + Default + Send>(
    [width, height]: [usize; 2],
    fill: impl Fn(usize, &mut [T]) + Sync,
) -> Vec<T> {
    let width = width.max(1);
    filled_in_blocks(width * height, width * BLOCK.div_ceil(width), |first, out| {
        out.chunks_mut(width).enumerate().for_each(|(k, row)| fill(first / width + k, row));
    })
}

fn filled_in_blocks<T: Clone + Default + Send>(
    len: usize,
    block: usize,
    fill: impl Fn(usize, &mut [T]) + Sync,
) -> Vec<T> {
    let mut out = vec![T::default(); len];
    let part = part_of(len, block);
    on_threads(out.chunks_mut(part).enumerate(), |(number, out)| {
        for (place, out) in out.chunks_mut(block).enumerate() {
            check();
            fill(number * part + place * block, out);
        }
    });
    out
}

/// What `of` makes of each block of the numbers `0..len`, in order; blocks are always the same.
pub(crate) fn blocks<T: Send>(len: usize, of: impl Fn(Range<usize>) -> T + Sync) -> Vec<T> {
    let part = part_of(len, BLOCK);
    let parts = (0..len).step_by(part).map(|first| first..(first + part).min(len));
    let made = on_threads(parts, |part| {
        let own = part.clone().step_by(BLOCK).map(|first| {
            check();
            of(first..(first + BLOCK).min(part.end))
        });
        own.collect::<Vec<_>>()
    });
    made.into_iter().flatten().collect()
}

/// How many entries a thread makes, in whole blocks.
fn part_of(len: usize, block: usize) -> usize {
    let threads = thread::available_parallelism().map_or(1, NonZero::get);
    let blocks = len.div_ceil(block);
    block * blocks.div_ceil(threads.min(blocks.div_ceil(LEAST)).max(1)).max(1)
}

/// Each part on a thread of its own, the first on this one, and so is each for which the system starts no thread.
fn on_threads<P: Send, T: Send>(parts: impl Iterator<Item = P>, work: impl Fn(P) -> T + Sync) -> Vec<T> {
    let parts: Vec<_> = parts.map(|part| Mutex::new(Some(part))).collect();
    let take = |part: &Mutex<Option<P>>| part.lock().ok().and_then(|mut part| part.take()).map(&work);
    let (flag, take) = (Interrupt::current(), &take);
    let made = thread::scope(|scope| {
        let start = |part| {
            let flag = flag.clone();
            let begin = move || {
                Interrupt::adopt(flag.as_ref());
                take(part)
            };
            thread::Builder::new().spawn_scoped(scope, begin).ok()
        };
        let others: Vec<_> = parts.iter().skip(1).map(start).collect();
        let mut made: Vec<_> = parts.iter().take(1).map(take).collect();
        made.extend(others.into_iter().zip(parts.iter().skip(1)).map(|(thread, part)| match thread {
            Some(thread) => thread.join().unwrap_or_else(|fault| resume_unwind(fault)),
            None => take(part),
        }));
        made
    });
    made.into_iter().flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_and_blocks_have_every_number_in_order() {
        for len in [0, 1, BLOCK - 1, BLOCK, BLOCK + 1, LEAST * BLOCK, LEAST * BLOCK + 1, 5 * LEAST * BLOCK + 17] {
            assert!(table(len, |i| i).into_iter().eq(0..len), "{len}");
            assert!(table_in_blocks(len, 7, |i| i).into_iter().eq(0..len), "{len}");
            let made = blocks(len, |range| range);
            assert!(made.iter().cloned().flatten().eq(0..len), "{len}");
            assert!(made.iter().rev().skip(1).all(|block| block.len() == BLOCK), "{len}");
        }
    }

    #[test]
    fn every_thread_ends_when_asked() {
        let flag = Interrupt::default();
        let ended = flag.run(|| {
            table(100 * BLOCK, |i| {
                if i == 3 {
                    flag.ask();
                }
                // Nobody is done before the flag is up.
                while i % BLOCK == 7 && !flag.is_asked() {
                    thread::yield_now();
                }
            })
        });
        assert!(ended.is_none());
    }
}
