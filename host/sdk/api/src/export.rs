/// Exports a plugin's units from a `cdylib`.
///
/// ```text
/// export_plugin! {
///     id: "org.example.mine",
///     renderers: [MyRenderer],
///     tracers: [MyTracer],
///     tools: [MyTool],
///     formats: [MyFormat],
/// }
/// ```
///
/// Lists that are empty can be left out; their order is fixed. The package's version, authors and
/// licence are taken from its `Cargo.toml`.
///
/// `minor: 7,` behind the id says that hosts from ABI 3.7 on will do, though the crate is newer: such hosts load the
/// library, and what of a frame they would not know is refused with a line by every host. Formats need 8 and columns
/// in `NEEDS` 9, tools with `HANDLING` 11, or they do not compile. Without it hosts have to be as new as the crate. ABI 3.10.
#[macro_export]
macro_rules! export_plugin {
    ($($body:tt)*) => {
        $crate::static_plugin! { $($body)* }

        #[cfg(all(panic = "abort", not(target_family = "wasm")))]
        compile_error!(
            "a Surfelshop plugin needs panic = \"unwind\": with \"abort\" its first panic would end the whole program"
        );

        /// The pointer-free description that the host reads before it loads this library.
        #[allow(unsafe_code, reason = "exports a symbol; the macro is the plugin boundary")]
        // SAFETY: the name is the interface's own; nothing else defines it.
        #[unsafe(no_mangle)]
        #[cfg(not(target_family = "wasm"))]
        pub static SURFELSHOP_MANIFEST: [u8; SURFELSHOP_STATIC_MANIFEST.len()] =
            SURFELSHOP_STATIC_MANIFEST;

        /// The same as a custom section of a WebAssembly module.
        #[allow(unsafe_code, reason = "names a section; the macro is the plugin boundary")]
        // SAFETY: custom sections are no part of a module's memory; the name is the interface's own.
        #[unsafe(link_section = "surfelshop.manifest")]
        #[cfg(target_family = "wasm")]
        #[used]
        static SURFELSHOP_MANIFEST_SECTION: [u8; SURFELSHOP_STATIC_MANIFEST.len()] =
            SURFELSHOP_STATIC_MANIFEST;

        /// The functions the host calls.
        #[allow(unsafe_code, reason = "exports a symbol; the macro is the plugin boundary")]
        // SAFETY: the name is the interface's own; nothing else defines it.
        #[unsafe(no_mangle)]
        pub static SURFELSHOP_PLUGIN: $crate::abi::table::PluginTable =
            $crate::abi::plugin_side::table::<SurfelshopPackage>();

        /// The functions of formats.
        #[allow(unsafe_code, reason = "exports a symbol; the macro is the plugin boundary")]
        // SAFETY: the name is the interface's own; nothing else defines it.
        #[unsafe(no_mangle)]
        pub static SURFELSHOP_FORMATS: $crate::abi::format_table::FormatTable =
            $crate::abi::plugin_format::package_format_table::<SurfelshopPackage>();
    };
}

/// Registers a plugin's units inside a program, without exporting symbols: for tests.
///
/// Takes what [`export_plugin!`] takes and defines `SurfelshopPackage`, to be loaded with
/// `Plugin::of` of the host's runtime.
#[macro_export]
macro_rules! static_plugin {
    (
        id: $id:literal
        $(, minor: $minor:literal)?
        $(, renderers: [$($renderer:ty),* $(,)?])?
        $(, tracers: [$($tracer:ty),* $(,)?])?
        $(, tools: [$($tool:ty),* $(,)?])?
        $(, formats: [$($format:ty),* $(,)?])?
        $(,)?
    ) => {
        /// This plugin's units.
        pub struct SurfelshopPackage;

        impl $crate::abi::plugin_side::Package for SurfelshopPackage {
            const UNITS: &'static [$crate::abi::plugin_side::Unit] = &[
                $($($crate::abi::plugin_side::Unit::renderer::<$renderer>(),)*)?
                $($($crate::abi::plugin_side::Unit::tracer::<$tracer>(),)*)?
                $($($crate::abi::plugin_side::Unit::tool::<$tool>(),)*)?
                $($($crate::abi::plugin_side::Unit::format::<$format>(),)*)?
            ];
            const MINOR: u16 = SURFELSHOP_PACKAGE_INFO.abi.1;
        }

        const SURFELSHOP_PACKAGE_INFO: $crate::manifest::PackageInfo =
            $crate::manifest::PackageInfo {
                id: $id,
                version: env!("CARGO_PKG_VERSION"),
                authors: env!("CARGO_PKG_AUTHORS"),
                license: env!("CARGO_PKG_LICENSE"),
                abi: (
                    $crate::manifest::ABI_MAJOR,
                    $crate::manifest::least_minor(&[$($minor)?], SURFELSHOP_UNITS),
                ),
            };

        const SURFELSHOP_UNITS: &[($crate::UnitKind, $crate::UnitInfo)] = &[
            $($((
                $crate::UnitKind::Renderer,
                <$renderer as $crate::Renderer>::INFO
                    .reading(<$renderer as $crate::Renderer>::NEEDS),
            ),)*)?
            $($(($crate::UnitKind::Tracer, <$tracer as $crate::Tracer>::INFO),)*)?
            $($((
                $crate::UnitKind::Tool,
                <$tool as $crate::Tool>::INFO.handled(<$tool as $crate::Tool>::HANDLING),
            ),)*)?
            $($((
                $crate::UnitKind::Format,
                <$format as $crate::Format>::INFO.recognising(<$format as $crate::Format>::FILES),
            ),)*)?
        ];

        /// The manifest's bytes.
        pub const SURFELSHOP_STATIC_MANIFEST: [u8; $crate::manifest::encoded_len(
            &SURFELSHOP_PACKAGE_INFO,
            SURFELSHOP_UNITS,
        )] = $crate::manifest::encode(&SURFELSHOP_PACKAGE_INFO, SURFELSHOP_UNITS);
    };
}
