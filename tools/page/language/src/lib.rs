//! The language of questions as WebAssembly, for web pages: the program's own modules, and what a page calls.
//!
//! A page writes bytes where [`room`] says, then calls [`know`], [`open`] or [`ask`], and reads answers at [`told`].

#[allow(dead_code, unused_imports)]
#[path = "../../../../src/pipeline/semantics/query/language/mod.rs"]
mod language;
#[allow(dead_code, unused_imports)]
#[path = "../../../../src/math/mod.rs"]
mod math;
#[allow(dead_code)]
#[path = "../../../../src/pipeline/semantics/query/parse.rs"]
mod parse;
#[allow(dead_code, unused_imports)]
#[path = "../../../../src/scene/mod.rs"]
mod scene;

mod answers;
mod models;

/// Paths by which the modules know each other.
mod pipeline {
    pub(crate) mod semantics {
        pub(crate) mod query {
            pub(crate) use crate::{language, parse};
        }
    }
}

use std::cell::RefCell;

use self::answers::AskedScene;

thread_local! {
    /// Bytes from the page.
    static RECEIVED: RefCell<Vec<u8>> = const { RefCell::new(Vec::new()) };
    /// Bytes for the page.
    static TOLD: RefCell<String> = const { RefCell::new(String::new()) };
    static SCENE: RefCell<Option<AskedScene>> = const { RefCell::new(None) };
}

fn received<T>(read: impl FnOnce(&[u8]) -> T) -> T {
    RECEIVED.with_borrow(|bytes| read(bytes))
}

/// Makes room for bytes from the page, and returns their address.
#[unsafe(no_mangle)]
pub extern "C" fn room(bytes: usize) -> *mut u8 {
    RECEIVED.with_borrow_mut(|all| {
        *all = vec![0; bytes];
        all.as_mut_ptr()
    })
}

/// Takes the words that people write, in order, with spaces between them: others may be slips.
#[unsafe(no_mangle)]
pub extern "C" fn know() {
    received(|bytes| models::know(&String::from_utf8_lossy(bytes)));
}

/// Takes the scene. Returns 1, or 0 if it is damaged.
#[unsafe(no_mangle)]
pub extern "C" fn open() -> i32 {
    let scene = received(AskedScene::read);
    let is_whole = scene.is_some();
    SCENE.with_borrow_mut(|place| *place = scene);
    i32::from(is_whole)
}

/// Answers a question, and returns the number of bytes of the answer.
#[unsafe(no_mangle)]
pub extern "C" fn ask() -> usize {
    let answer = SCENE.with_borrow(|scene| received(|bytes| scene.as_ref()?.answer(bytes)));
    TOLD.with_borrow_mut(|told| {
        *told = answer.unwrap_or_else(|| "null".into());
        told.len()
    })
}

/// Returns the address of the answer.
#[unsafe(no_mangle)]
pub extern "C" fn told() -> *const u8 {
    TOLD.with_borrow(|told| told.as_ptr())
}
