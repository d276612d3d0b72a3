//! The studio's compiler as a WebAssembly module, for `studio/web/js/worker.js`.
//!
//! A call takes and returns bytes: the page writes a request to the memory that [`reserve`] returns,
//! [`call`] answers it, and the answer lies at [`answer`]. Nothing here dereferences a pointer; a
//! generator of bindings would add its dependencies to every build of the page for these three names.
#![cfg(target_arch = "wasm32")]
#![allow(clippy::cast_precision_loss, reason = "progress is shown in per cent")]
#![expect(unsafe_code, reason = "names of exports and imports are unsafe attributes")]

use std::cell::RefCell;

use studio::{Step, Studio};

#[link(wasm_import_module = "page")]
unsafe extern "C" {
    /// A step of the work, and how much of it is done.
    safe fn progress(step: u32, done: f64, all: f64);
    /// The text of a panic; the module cannot be used afterwards.
    safe fn panicked(text: *const u8, length: usize);
}

#[derive(Default)]
struct State {
    studio: Studio,
    request: Vec<u8>,
    answer: Vec<u8>,
}

thread_local! {
    static STATE: RefCell<State> = RefCell::default();
}

/// Memory for a request of this length.
#[unsafe(no_mangle)]
pub extern "C" fn reserve(length: usize) -> *mut u8 {
    std::panic::set_hook(Box::new(|panic| {
        let text = panic.to_string();
        panicked(text.as_ptr(), text.len());
    }));
    STATE.with_borrow_mut(|state| {
        state.request = vec![0; length];
        state.request.as_mut_ptr()
    })
}

/// Answers the request; returns the length of the answer.
#[unsafe(no_mangle)]
pub extern "C" fn call() -> usize {
    STATE.with_borrow_mut(|state| {
        let request = std::mem::take(&mut state.request);
        state.answer = state.studio.call(&request, &|step| {
            let (number, done, all) = match step {
                Step::Placing => (0, 0.0, 1.0),
                Step::Ordering(done, all) => (1, done as f64, all as f64),
                Step::Planning(done, all) => (2, done as f64, all as f64),
                Step::Verifying(done, all) => (3, done as f64, all as f64),
            };
            progress(number, done, all);
        });
        state.answer.len()
    })
}

/// The answer.
#[unsafe(no_mangle)]
pub extern "C" fn answer() -> *const u8 {
    STATE.with_borrow(|state| state.answer.as_ptr())
}
