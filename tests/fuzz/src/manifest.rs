//! Plugin files and the manifests in them.

use crate::assert_one_line;
use surfelshop_api::manifest::decode;
use surfelshop_runtime::plugins::inspect_bytes;

/// Takes the bytes as a library and as a manifest.
///
/// # Panics
/// Where it finds what must not be: that is a finding.
pub fn manifest(bytes: &[u8]) {
    // What is refused says why in one line, whatever it is.
    if let Err(refused) = inspect_bytes(bytes) {
        assert_one_line(&refused.to_string());
    }
    drop(decode(bytes));
}
