//! WebAssembly modules: what the sandbox says of them, and a refusal of all where the program has none.

#[cfg(feature = "sandbox")]
pub(super) use surfelshop_sandbox::{MAX_MODULE_LEN, Unfit, read};

use crate::boundary::Plugin;

/// Whether a file is a WebAssembly module or component, by its first bytes.
#[must_use]
pub fn is_module(bytes: &[u8]) -> bool {
    bytes.starts_with(b"\0asm")
}

/// How many modules this process has compiled: 0 where no module was used, and no part of the runtime was started.
#[must_use]
pub fn n_compiled() -> usize {
    #[cfg(feature = "sandbox")]
    return surfelshop_sandbox::n_compiled();
    #[cfg(not(feature = "sandbox"))]
    return 0;
}

/// A module as a plugin: it runs in a sandbox.
///
/// # Errors
/// Where it is no module that can be run; says why.
#[cfg(feature = "sandbox")]
pub(super) fn sandboxed(module: &[u8]) -> Result<Plugin, String> {
    let module = surfelshop_sandbox::Module::new(module)?;
    tracing::info!(target: "surfelshop_runtime::modules", "a module was compiled");
    Ok(Plugin::apart(module))
}

#[cfg(feature = "sandbox")]
impl super::inspect::Refused {
    /// A module that is too long to be read.
    pub(super) fn too_long(found: u64) -> Self {
        Self::Module(Unfit::TooLong(found))
    }

    /// Whether it may be a module that has to do with other programs.
    pub(super) fn is_foreign_module(&self) -> bool {
        matches!(self, Self::Module(Unfit::NoManifest))
    }
}

#[cfg(not(feature = "sandbox"))]
mod absent {
    use super::Plugin;

    /// No module is taken, so it does not matter how long one is.
    pub(in crate::plugins) const MAX_MODULE_LEN: u64 = 32 << 20;

    /// Why a module is not used; reads on from the file's name.
    #[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
    #[error(
        "is a WebAssembly module, and this program was built without the sandbox that runs modules: \
         build it with the Cargo feature `sandbox`, or build the plugin as a library"
    )]
    #[expect(unnameable_types, reason = "only shown; with the sandbox its crate names it")]
    pub struct Unfit;

    /// Refuses every module.
    pub(in crate::plugins) fn read(
        _module: &[u8],
        _formats: impl FnOnce(&[u8]) -> bool,
    ) -> Result<&[u8], Unfit> {
        Err(Unfit)
    }

    /// Runs no module.
    pub(in crate::plugins) fn sandboxed(_module: &[u8]) -> Result<Plugin, String> {
        Err(Unfit.to_string())
    }

    impl crate::plugins::inspect::Refused {
        /// A module, however long.
        pub(in crate::plugins) fn too_long(_found: u64) -> Self {
            Self::Module(Unfit)
        }

        /// Whether it may be a module that has to do with other programs: nobody looks.
        pub(in crate::plugins) fn is_foreign_module(&self) -> bool {
            matches!(self, Self::Module(Unfit))
        }
    }
}
#[cfg(not(feature = "sandbox"))]
pub(super) use absent::{MAX_MODULE_LEN, Unfit, read, sandboxed};

#[cfg(all(test, not(feature = "sandbox")))]
mod tests {
    use crate::plugins::{Origin, Place, Registry, SearchPath, State};

    #[test]
    fn without_a_sandbox_a_module_is_refused_in_one_line_that_says_what_to_do() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("rim.wasm");
        std::fs::write(&file, b"\0asm\x01\0\0\0").unwrap();
        let files = vec![Place::new(&file, Origin::CommandLine)];
        let registry = Registry::scan(&SearchPath { files, ..SearchPath::default() });
        let State::Refused(line) = &registry.entries()[0].state else { panic!() };
        assert!(!line.contains('\n') && line.contains("Cargo feature `sandbox`"), "{line}");
        assert_eq!(super::n_compiled(), 0);
    }
}
