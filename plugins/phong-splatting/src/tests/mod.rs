//! Tests through `Tool::run`.
