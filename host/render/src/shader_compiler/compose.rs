//! Resolves `#import`s of the host's shader modules, numbers the bindings and validates.
//!
//! Authors write `var<uniform> settings: Settings;` without group and binding: numbers are given
//! here, after composing, in the order of the variables. Names of imported variables, which the
//! composer decorates, are turned back into `module::name` everywhere a person can see them.

use crate::shader_compiler::directives::{Headed, headed};
use crate::shader_compiler::numbered::{member_with_digit, numbered};
pub(crate) use crate::shader_compiler::report::ShaderError;
use crate::shader_compiler::report::{OWN_FILE, one_line};
use crate::shader_compiler::validate::{Invalid, check_variables, validated};
use crate::shader_compiler::work_limit::WorkLimit;
use crate::shader_compiler::{bound_loops, expanded, loops, text};
use crate::shader_features::ShaderFeature;
use naga_oil::compose::{
    ComposableModuleDescriptor, Composer, ErrSource, NagaModuleDescriptor, ShaderDefValue,
    ShaderLanguage,
};
use std::collections::HashMap;
use surfelshop_api::graph::Module;

/// A validated module.
pub(crate) struct Composed {
    pub(crate) module: naga::Module,
    pub(crate) info: naga::valid::ModuleInfo,
    /// Operations of the largest function with those it calls.
    pub(crate) n_operations: u64,
}

/// The host's shader modules, by import path.
///
/// They belong to the API version: functions and members are added, never changed or removed.
const MODULES: &[(&str, &str)] = &[
    ("view.wgsl", include_str!("../../../../shaders/surface/view.wgsl")),
    ("packing.wgsl", include_str!("../../../../shaders/surface/packing.wgsl")),
    ("surfels.wgsl", include_str!("../../../../shaders/surface/surfels.wgsl")),
    ("splat.wgsl", include_str!("../../../../shaders/surface/splat.wgsl")),
    ("surface.wgsl", include_str!("../../../../shaders/surface/surface.wgsl")),
    ("environment.wgsl", include_str!("../../../../shaders/lighting/environment.wgsl")),
    ("light.wgsl", include_str!("../../../../shaders/lighting/light.wgsl")),
    ("sh.wgsl", include_str!("../../../../shaders/lighting/sh.wgsl")),
    ("filtered.wgsl", include_str!("../../../../shaders/noise/filtered.wgsl")),
    ("noise.wgsl", include_str!("../../../../shaders/noise/noise.wgsl")),
    ("numbers.wgsl", include_str!("../../../../shaders/numbers/numbers.wgsl")),
    ("occlusion.wgsl", include_str!("../../../../shaders/lighting/occlusion.wgsl")),
    ("phong.wgsl", include_str!("../../../../shaders/lighting/phong.wgsl")),
];

/// A sum over the text of all modules: what was made with other ones may be other.
pub(crate) fn fingerprint() -> u64 {
    use std::hash::{DefaultHasher, Hash as _, Hasher as _};
    let mut hasher = DefaultHasher::new();
    MODULES.hash(&mut hasher);
    hasher.finish()
}

/// Composes shaders from text and the host's modules.
pub(crate) struct Library {
    composer: Composer,
    /// Most loops one after another.
    max_loops: u64,
}

impl Library {
    /// A library with all of the host's modules, for a device that computes on the CPU or another.
    ///
    /// # Errors
    /// Where a host module is broken, which the tests exclude.
    pub(crate) fn new(on_cpu: bool) -> Result<Self, ShaderError> {
        let mut composer = Composer::non_validating();
        // What a text may use is checked when all of it is composed.
        let of_features = ShaderFeature::ALL.iter().map(|feature| feature.capabilities);
        composer.capabilities = of_features.fold(capabilities(), |all, of| all | of);
        for (file, source) in MODULES {
            let added = composer.add_composable_module(ComposableModuleDescriptor {
                source,
                file_path: file,
                language: ShaderLanguage::Wgsl,
                ..Default::default()
            });
            if let Err(error) = added.map(|_| ()) {
                return Err(one_line(&error.emit_to_string(&composer), &[]));
            }
        }
        let max_loops = if on_cpu { loops::MAX_ON_CPU } else { loops::MAX_ON_CARD };
        Ok(Self { composer, max_loops })
    }

    /// Composes a text with the modules it brings along, and validates; `defines` are set for `#ifdef`. All loops of
    /// a frame share `work` units, where there is such a number. To be called on a large stack.
    ///
    /// # Errors
    /// One line with the position where a text does not parse, import or validate.
    pub(crate) fn compose_with(
        &mut self,
        (source, work): (&str, Option<u32>),
        modules: &[Module],
        defines: &[&str],
    ) -> Result<Composed, ShaderError> {
        text::check(source, modules)?;
        check_imports(source, modules)?;
        let needs: Vec<ShaderFeature> = ShaderFeature::set_in(defines).collect();
        let composed = self
            .add(modules, &needs)
            .and_then(|shifted| self.compose_checked((source, work), defines, &needs, shifted));
        let composed = composed.map_err(|error| error.in_file(modules));
        // They belong to this text alone; another may bring others of the same path.
        for module in modules {
            self.composer.remove_composable_module(&module.path);
        }
        composed
    }

    /// The same where each loop is bounded by itself.
    #[cfg(test)]
    pub(crate) fn compose(
        &mut self,
        source: &str,
        modules: &[Module],
        defines: &[&str],
    ) -> Result<Composed, ShaderError> {
        self.compose_with((source, None), modules, defines)
    }

    /// Adds the modules of a text, each of which may import those before it; the files that a line was put before.
    fn add<'a>(
        &mut self,
        modules: &'a [Module],
        needs: &[ShaderFeature],
    ) -> Result<Vec<&'a str>, ShaderError> {
        let mut shifted_files = Vec::new();
        for (i, module) in modules.iter().enumerate() {
            let words = module.path.split("::").collect::<Vec<_>>();
            let is_word = |word: &&str| {
                let mut letters = word.chars();
                letters.next().is_some_and(|c| c.is_ascii_alphabetic())
                    && letters.all(|c| c.is_ascii_alphanumeric() || c == '_')
            };
            let of_host = words[0] == "surfelshop";
            let twice = modules[..i].iter().any(|other| other.path == module.path);
            if of_host || twice || !words.iter().all(is_word) {
                return Err(ShaderError::new(format!(
                    "a module cannot be called `{}`; it takes words joined by `::`, each once, not \
                     below `surfelshop`",
                    module.path.escape_debug()
                )));
            }
            check_imports(&module.wgsl, &modules[..i])
                .map_err(|error| ShaderError::new(format!("{}: {error}", module.file)))?;
            if let Some(name) = member_with_digit(&module.wgsl) {
                return Err(ShaderError::new(format!(
                    "{}: members of structures in modules cannot end in a digit, as `{name}` does",
                    module.file
                )));
            }
            let Headed { text, shifted } = headed(&module.wgsl, needs)
                .map_err(|error| ShaderError::new(format!("{}, {error}", module.file)))?;
            shifted_files.extend(shifted.then_some(module.file.as_str()));
            let added = self.composer.add_composable_module(ComposableModuleDescriptor {
                source: &numbered(&text, i),
                file_path: &module.file,
                language: ShaderLanguage::Wgsl,
                as_name: Some(module.path.clone()),
                ..Default::default()
            });
            if let Err(error) = added.map(|_| ()) {
                return Err(one_line(&error.emit_to_string(&self.composer), &shifted_files));
            }
        }
        Ok(shifted_files)
    }

    fn compose_checked(
        &mut self,
        (source, work): (&str, Option<u32>),
        defines: &[&str],
        needs: &[ShaderFeature],
        mut shifted_files: Vec<&str>,
    ) -> Result<Composed, ShaderError> {
        let of_needs = needs.iter().map(|feature| feature.capabilities);
        let allowed = of_needs.fold(capabilities() | wide_atomics(defines), |all, of| all | of);
        let Headed { text, shifted } = headed(source, needs)?;
        shifted_files.extend(shifted.then_some(OWN_FILE));
        let defines = defines.iter().map(|name| ((*name).to_owned(), ShaderDefValue::Bool(true)));
        let defines: HashMap<String, ShaderDefValue> = defines.collect();
        let described = || NagaModuleDescriptor {
            source: &text,
            file_path: OWN_FILE,
            shader_defs: defines.clone(),
            ..Default::default()
        };
        let composer = &mut self.composer;
        let mut module = composer
            .make_naga_module(described())
            .map_err(|error| one_line(&error.emit_to_string(composer), &shifted_files))?;
        restore_names(&mut module);
        number_bindings(&mut module);
        // Where parts of the text are, the composer tells only of what it finds wrong itself: that bindings have no
        // numbers, at least.
        let located = |invalid: Box<Invalid>, composer: &mut Composer| {
            let before = std::mem::replace(&mut composer.capabilities, allowed);
            composer.validate = true;
            let found = composer.make_naga_module(described()).err();
            (composer.validate, composer.capabilities) = (false, before);
            let line = match found.map(|error| error.source) {
                Some(ErrSource::Constructing { source, offset, .. }) => {
                    invalid.line_in(&source, offset)
                }
                _ => None,
            };
            let place =
                line.map(|line| format!("line {}: ", line.saturating_sub(usize::from(shifted))));
            ShaderError::new(place.unwrap_or_default() + &invalid.error.message)
        };
        if let Some(most) = work {
            let info =
                validated(&module, allowed).map_err(|error| located(error, &mut self.composer))?;
            let sizes = expanded::check(&module, &info)?;
            WorkLimit::put(&mut module, [&sizes.functions, &sizes.entries], most);
        } else {
            bound_loops::bound(&mut module);
        }
        let info =
            validated(&module, allowed).map_err(|error| located(error, &mut self.composer))?;
        check_variables(&module)?;
        let n_operations = expanded::check(&module, &info)?.largest();
        let n_loops = loops::check(&module, self.max_loops)?;
        tracing::debug!(n_loops, n_operations, "operations of a shader");
        Ok(Composed { module, info, n_operations })
    }
}

/// Names a misspelt import where it stands; the composer would only miss it where it is used, by
/// its last word.
fn check_imports(source: &str, modules: &[Module]) -> Result<(), ShaderError> {
    for (number, line) in source.lines().enumerate() {
        let Some(import) = line.trim_start().strip_prefix("#import ") else { continue };
        let path = import.split(['{', ',', ';']).next().unwrap_or_default();
        let path = path.split_whitespace().next().unwrap_or_default().trim_end_matches("::");
        let own = modules.iter().map(|module| module.path.as_str());
        let all: Vec<_> =
            MODULES.iter().map(|(_, source)| import_path(source)).chain(own).collect();
        let known = |module: &&str| {
            path == *module || path.strip_prefix(*module).is_some_and(|item| item.starts_with("::"))
        };
        if !all.iter().any(known) {
            return Err(ShaderError::new(format!(
                "line {}: there is no module `{path}`; there are: {}",
                number + 1,
                all.join(", ")
            )));
        }
    }
    Ok(())
}

/// The name a host module is imported by.
fn import_path(source: &str) -> &str {
    let mut lines = source.lines();
    lines.find_map(|line| line.strip_prefix("#define_import_path ")).unwrap_or_default().trim()
}

/// Language features graphs may use: those every device this engine opens has.
fn capabilities() -> naga::valid::Capabilities {
    naga::valid::Capabilities::SHADER_FLOAT16_IN_FLOAT32
}

/// What shaders of the host use besides on devices that have it; graphs set no names.
fn wide_atomics(defines: &[&str]) -> naga::valid::Capabilities {
    use naga::valid::Capabilities;
    let mut allowed = Capabilities::empty();
    if defines.iter().any(|name| name.starts_with("ATOMIC64")) {
        allowed |= Capabilities::SHADER_INT64 | Capabilities::SHADER_INT64_ATOMIC_MIN_MAX;
    }
    if defines.contains(&"ATOMIC64_ALL") {
        allowed |= Capabilities::SHADER_INT64_ATOMIC_ALL_OPS;
    }
    allowed
}

/// What a text that uses something without saying so is told besides.
pub(super) fn missing_need(message: &str) -> String {
    let told_by = [
        ("SUBGROUP", "subgroups"),
        ("SHADER_FLOAT16", "f16"),
        ("SHADER_INT64", "64-bit-integers"),
        ("SHADER_INT64_ATOMIC_MIN_MAX", "64-bit-atomic-max"),
        ("SHADER_INT64_ATOMIC_ALL_OPS", "64-bit-atomics"),
        ("SHADER_FLOAT32_ATOMIC", "float32-atomics"),
    ];
    let mut words = message.split(|c: char| !(c.is_ascii_alphanumeric() || c == '_'));
    let of_word = |word: &str| {
        told_by.iter().find(|(told_by, _)| *told_by == word).map(|(_, feature)| *feature)
    };
    match words.find_map(of_word) {
        Some(feature) => format!("; a pass that uses it says so with `.needs(\"{feature}\")`"),
        None => String::new(),
    }
}

/// Turns the composer's decorated names back into `module::name`.
fn restore_names(module: &mut naga::Module) {
    for (_, variable) in module.global_variables.iter_mut() {
        if let Some(name) = &mut variable.name {
            *name = undecorated(name);
        }
    }
    for (_, constant) in module.overrides.iter_mut() {
        if let Some(name) = &mut constant.name {
            *name = undecorated(name);
        }
    }
}

/// `nameX_naga_oil_mod_XBASE32X` as `module::name`; other names unchanged.
pub(super) fn undecorated(name: &str) -> String {
    const MARK: &str = "X_naga_oil_mod_X";
    let Some((item, rest)) = name.split_once(MARK) else {
        return name.to_owned();
    };
    let Some(module) = rest.strip_suffix('X').and_then(decode_base32) else {
        return name.to_owned();
    };
    format!("{module}::{item}")
}

/// A message in which decorated names stand in quotes.
pub(super) fn undecorated_text(message: &str) -> String {
    message.split('\'').map(undecorated).collect::<Vec<_>>().join("'")
}

/// RFC 4648 base 32 without padding, as the composer writes module names.
fn decode_base32(text: &str) -> Option<String> {
    let mut bytes = Vec::new();
    let (mut bits, mut n_bits) = (0u32, 0u32);
    for c in text.bytes() {
        let value = match c {
            b'A'..=b'Z' => c - b'A',
            b'2'..=b'7' => c - b'2' + 26,
            _ => return None,
        };
        bits = (bits << 5 | u32::from(value)) & 0xffff;
        n_bits += 5;
        if n_bits >= 8 {
            n_bits -= 8;
            bytes.push((bits >> n_bits) as u8);
        }
    }
    String::from_utf8(bytes).ok()
}

/// Gives every resource without a binding a number of its own in group 0.
fn number_bindings(module: &mut naga::Module) {
    let mut next = 0;
    for (_, variable) in module.global_variables.iter_mut() {
        let is_resource = matches!(
            variable.space,
            naga::AddressSpace::Uniform
                | naga::AddressSpace::Storage { .. }
                | naga::AddressSpace::Handle
        );
        if is_resource {
            variable.binding = Some(naga::ResourceBinding { group: 0, binding: next });
            next += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_host_module_composes() {
        let mut library = Library::new(true).unwrap();
        let source = "
            #import surfelshop::surface::{Surface, surface_at}
            #import surfelshop::light::diffuse_irradiance
            @fragment fn main(@builtin(position) p: vec4<f32>) -> @location(0) vec4<f32> {
                let s = surface_at(vec2<u32>(p.xy));
                return vec4(diffuse_irradiance(s.normal) * s.albedo, 1.0);
            }";
        let composed = library.compose(source, &[], &[]).unwrap();
        let names: Vec<_> =
            composed.module.global_variables.iter().filter_map(|(_, v)| v.name.clone()).collect();
        assert!(names.contains(&"surfelshop::view::view".to_owned()), "{names:?}");
    }

    #[test]
    fn mistakes_are_one_line_with_their_position() {
        let mut library = Library::new(true).unwrap();
        let unknown = library.compose("fn f() -> f32 {\n  return nothing;\n}", &[], &[]);
        let message = unknown.err().unwrap().message;
        assert!(message.contains("nothing") && message.contains("line 2"), "{message}");
        let import = library.compose("fn f() {}\n#import surfelshop::lihgt\n", &[], &[]);
        let message = import.err().unwrap().message;
        assert!(message.contains("line 2: there is no module `surfelshop::lihgt`"), "{message}");
        let types = "@fragment fn f() -> @location(0) vec4<f32> {\n  return vec4<u32>(1u);\n}";
        let message = library.compose(types, &[], &[]).err().unwrap().message;
        assert!(message.contains('f') && !message.contains('\n'), "{message}");
    }

    #[test]
    fn what_a_pass_needs_is_allowed_in_its_text_and_its_modules() {
        let mut library = Library::new(true).unwrap();
        let module = |wgsl: &str| {
            let (path, file) = ("own::half".to_owned(), "half.wgsl".to_owned());
            vec![Module { path, file, wgsl: wgsl.to_owned() }]
        };
        let head = "#import own::half\nvar<storage, read_write> x: array<u32>;\n";
        let entry = "@compute @workgroup_size(64) fn go() {";
        let half = module("enable f16;\nfn twice(h: f16) -> f16 { return h * 2.0h; }");
        let text = format!("{head}{entry} x[0] = u32(half::twice(f16(x[0]))); }}");
        library.compose(&text, &half, &["NEEDS_F16"]).unwrap();
        let line = library.compose(&text, &half, &[]).err().unwrap().message;
        assert!(line.starts_with("half.wgsl, line 1: `enable f16;`"), "{line}");
        // A line is put before the text, and none is counted for it.
        let wrong = format!("{head}{entry}\n x[0] = nothing; }}");
        let line = library.compose(&wrong, &half, &["NEEDS_F16"]).err().unwrap().message;
        assert!(line.starts_with("line 4: "), "{line}");
        let wrong = module("fn twice(h: f16) -> f16 {\n return nothing; }");
        let line = library.compose(&text, &wrong, &["NEEDS_F16"]).err().unwrap().message;
        assert!(line.contains("half.wgsl, line 2: "), "{line}");

        let all = module("fn sum(x: u32) -> u32 { return subgroupAdd(x); }");
        let text = format!("{head}{entry} x[0] = half::sum(x[0]); }}");
        library.compose(&text, &all, &["NEEDS_SUBGROUPS"]).unwrap();
        let line = library.compose(&text, &all, &[]).err().unwrap().message;
        assert!(line.contains(".needs(\"subgroups\")"), "{line}");

        let wide = "var<storage, read_write> best: array<atomic<u64>>;\n";
        let text = format!("{wide}{entry} atomicMax(&best[0], 7lu); }}");
        library.compose(&text, &[], &["NEEDS_ATOMIC64_MAX"]).unwrap();
        let text = format!("{wide}{entry} atomicAdd(&best[0], 7lu); }}");
        library.compose(&text, &[], &["NEEDS_ATOMIC64"]).unwrap();
        let text = "var<storage, read_write> sum: array<atomic<f32>>;\n";
        let text = format!("{text}{entry} atomicAdd(&sum[0], 1.0); }}");
        library.compose(&text, &[], &["NEEDS_FLOAT32_ATOMICS"]).unwrap();
        let line = library.compose(&text, &[], &[]).err().unwrap().message;
        assert!(line.contains(".needs(\"float32-atomics\")"), "{line}");
    }

    #[test]
    fn decorated_names_are_restored() {
        let name = Composer::decorated_name(Some("surfelshop::view"), "view");
        assert_eq!(undecorated(&name), "surfelshop::view::view");
        assert_eq!(undecorated("plain"), "plain");
    }

    /// What parses and is no valid shader.
    #[test]
    fn mistakes_that_validation_finds_have_their_position() {
        let mut library = Library::new(true).unwrap();
        // A type that it names stands behind it.
        let text = "#import surfelshop::splat\n\nfn draw() -> splat::Splat {\n    var s = splat::Splat();\n    \
                    s.payload[0] = vec3(1.0);\n    return s;\n}\n\
                    var<storage, read_write> all: array<vec4<f32>>;\n\
                    @compute @workgroup_size(1) fn main() { all[0] = draw().payload[0]; }\n";
        let error = library.compose(text, &[], &[]).err().unwrap();
        assert!(error.message.starts_with("line 5: "), "{error}");
    }
}
