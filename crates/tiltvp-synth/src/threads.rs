//! Work on threads of its own.

use tiltvp_core::interrupt::Interrupt;
use tiltvp_core::{Error, Result};

/// Runs `work` on a pool of `threads` threads that ends with it; 0 means one thread per core.
///
/// A process may fork afterwards: no thread is left behind that its child would wait for.
///
/// # Errors
/// If the system gives no threads.
pub fn on_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> Result<T> {
    let flag = Interrupt::current();
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .start_handler(move |_| Interrupt::adopt(flag.as_ref()))
        .build()
        .map_err(|error| Error::argument("threads", threads, format!("as many as the system gives ({error})")))?;
    Ok(pool.install(work))
}
