//! What a panic says in a WebAssembly module, where none can be caught: the line goes to the sink of the call
//! that runs, and then the module stops.

use crate::abi::plugin_side::write;
use crate::abi::table::{Sink, channel};
use std::cell::Cell;
use std::panic::PanicHookInfo;

thread_local! {
    static SINK: Cell<Option<Sink>> = const { Cell::new(None) };
}

/// A call begins, and lends this sink. One that is left over from a call that has ended is never used: no code of
/// the author's runs between calls.
pub(super) fn go_to(sink: Sink) {
    SINK.set(Some(sink));
}

/// Writes where a panic was and what it said.
pub(super) fn write_panic(info: &PanicHookInfo<'_>) {
    let Some(sink) = SINK.get() else { return };
    let payload = info.payload();
    let text = payload.downcast_ref::<&str>().copied();
    let text = text.or_else(|| payload.downcast_ref::<String>().map(String::as_str));
    let place = info.location().map(|l| format!(" at {}:{}", l.file(), l.line()));
    let (place, text) = (place.unwrap_or_default(), text.unwrap_or("a value that is not text"));
    write(sink, channel::ERROR, format!("panicked{place}: {text}").as_bytes());
}
