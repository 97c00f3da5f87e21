//! Slices as they cross the boundary.

use crate::abi::table::Bytes;

impl Bytes {
    /// The C form of a slice, valid as long as the slice is.
    #[must_use]
    pub fn of(slice: &[u8]) -> Self {
        Self { ptr: slice.as_ptr(), len: slice.len() }
    }

    /// The slice; empty where the pointer is null.
    ///
    /// # Safety
    /// The bytes are alive and unchanged for `'a`.
    #[must_use]
    pub unsafe fn as_slice<'a>(self) -> &'a [u8] {
        if self.len == 0 || self.ptr.is_null() {
            return &[];
        }
        // SAFETY: by the caller's promise.
        unsafe { std::slice::from_raw_parts(self.ptr, self.len) }
    }
}
