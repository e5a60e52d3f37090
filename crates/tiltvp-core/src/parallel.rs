//! Long tables, made on as many threads as the machine has for us. No entry depends on how many those are.
//!
//! Threads are started for each table and end with it: a process may be forked at any time between.

use std::num::NonZero;
use std::ops::Range;
use std::panic::resume_unwind;
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
    let mut out = vec![T::default(); len];
    let part = part_of(len, block);
    on_threads(out.chunks_mut(part).enumerate(), |(number, out)| {
        for (place, out) in out.chunks_mut(block).enumerate() {
            check();
            let first = number * part + place * block;
            out.iter_mut().enumerate().for_each(|(i, out)| *out = entry(first + i));
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

/// Each part on a thread of its own, the first on this one.
fn on_threads<P: Send, T: Send>(parts: impl Iterator<Item = P>, work: impl Fn(P) -> T + Sync) -> Vec<T> {
    let mut parts = parts;
    let Some(first) = parts.next() else { return Vec::new() };
    let (flag, work) = (Interrupt::current(), &work);
    thread::scope(|scope| {
        let start = |part| {
            let flag = flag.clone();
            scope.spawn(move || {
                Interrupt::adopt(flag.as_ref());
                work(part)
            })
        };
        let others: Vec<_> = parts.map(start).collect();
        let mut done = vec![work(first)];
        done.extend(others.into_iter().map(|other| other.join().unwrap_or_else(|fault| resume_unwind(fault))));
        done
    })
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
