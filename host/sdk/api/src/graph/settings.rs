//! A uniform with the WGSL module that declares it, so that no shader writes its structure.

use crate::graph::members::Members;
use crate::graph::passes::{Module, Pass};
use crate::graph::resources::UniformId;

/// A uniform and the WGSL module that declares it: see [`Graph::settings`](crate::Graph::settings). ABI 3.10.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    id: UniformId,
    path: String,
    wgsl: String,
}

/// The variable of such a module.
const VARIABLE: &str = "settings";

impl Settings {
    pub(super) fn new(id: UniformId, path: &str, members: &Members) -> Self {
        let declarations = members.declarations();
        let mut wgsl = format!("#define_import_path {path}\n");
        // A structure without members is none in WGSL.
        if !declarations.is_empty() {
            wgsl = format!(
                "{wgsl}struct Settings {{\n{declarations}}}\nvar<uniform> {VARIABLE}: Settings;\n"
            );
        }
        Self { id, path: path.to_owned(), wgsl }
    }

    /// The uniform, for passes that declare a structure of their own.
    #[must_use]
    pub fn uniform(&self) -> UniformId {
        self.id
    }

    /// The path that its module is imported by.
    #[must_use]
    pub fn path(&self) -> &str {
        &self.path
    }

    /// The text of the module.
    #[must_use]
    pub fn wgsl(&self) -> &str {
        &self.wgsl
    }
}

impl Pass {
    /// Reads settings: brings their module along, for the shader and all other modules of the pass. ABI 3.10.
    #[must_use]
    pub fn settings(mut self, settings: &Settings) -> Self {
        let module = Module {
            path: settings.path.clone(),
            file: format!("settings `{}`", settings.path),
            wgsl: settings.wgsl.clone(),
        };
        // In front: it imports nothing, and modules may import those before them.
        self.modules.insert(0, module);
        self.bind(&format!("{}::{VARIABLE}", settings.path), settings.id)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Graph;

    #[test]
    fn a_pass_brings_the_structure_along_before_its_other_modules() {
        let mut graph = Graph::new();
        let settings = graph.settings("rim", Members::new().f32("gain", 0.5).u32("n", 3));
        let expected = "#define_import_path rim\nstruct Settings {\n    gain: f32,\n    n: u32,\n}\n\
                        var<uniform> settings: Settings;\n";
        assert_eq!(settings.wgsl(), expected);
        let pass = Pass::shading("shade", "", "shade").module("rim::noise", "noise.wgsl", "");
        let pass = pass.settings(&settings);
        let paths: Vec<&str> = pass.modules.iter().map(|module| module.path.as_str()).collect();
        assert_eq!(paths, ["rim", "rim::noise"]);
        assert_eq!(pass.bindings["rim::settings"], settings.uniform().into());
    }

    #[test]
    fn settings_of_no_members_declare_nothing() {
        let settings = Graph::new().settings("rim", Members::new());
        assert_eq!(settings.wgsl(), "#define_import_path rim\n");
    }
}
