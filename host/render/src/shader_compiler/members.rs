//! Which members of the host's surface an entry point looks at.

use crate::shader_compiler::compose::{Composed, undecorated};
use naga::proc::TypeResolution;
use naga::valid::FunctionInfo;
use naga::{Block, Expression, Function, Handle, Literal, Module, Statement, Type, TypeInner};
use std::collections::{BTreeMap, HashSet};

/// Members of `surfelshop::surface::Surface` that come of columns a cloud may do without.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct SurfaceMembers {
    pub(crate) albedo: bool,
    pub(crate) ao: bool,
}

impl SurfaceMembers {
    /// All of them.
    pub(crate) const ALL: Self = Self { albedo: true, ao: true };

    /// Those of either.
    pub(crate) fn or(self, other: Self) -> Self {
        Self { albedo: self.albedo || other.albedo, ao: self.ao || other.ao }
    }
}

const SURFACE: &str = "surfelshop::surface::Surface";
const PACKED: &str = "surfelshop::surface::surface_packed";
/// The host's own functions that read the packed surface; what is made of it is then looked at member by
/// member.
const UNPACKING: [&str; 2] =
    ["surfelshop::surface::surface_at", "surfelshop::surface::normal_variance_at"];

/// Members that an entry point looks at, through every function it calls, with these values of boolean
/// `override` constants: what they rule out is not looked at.
pub(crate) fn members_read(
    composed: &Composed,
    stage: naga::ShaderStage,
    entry: &str,
    flags: &BTreeMap<String, bool>,
) -> SurfaceMembers {
    let module = &composed.module;
    let is_it = |point: &naga::EntryPoint| point.stage == stage && point.name == entry;
    let Some(index) = module.entry_points.iter().position(is_it) else {
        return SurfaceMembers::ALL;
    };
    let mut reader = Reader {
        composed,
        flags,
        members: SurfaceMembers::default(),
        waiting: Vec::new(),
        known: HashSet::new(),
    };
    let function = &module.entry_points[index].function;
    reader.function(function, composed.info.get_entry_point(index), "");
    while let Some(handle) = reader.waiting.pop() {
        let function = &module.functions[handle];
        let name = undecorated(function.name.as_deref().unwrap_or_default());
        reader.function(function, &composed.info[handle], &name);
    }
    reader.members
}

struct Reader<'a> {
    composed: &'a Composed,
    flags: &'a BTreeMap<String, bool>,
    members: SurfaceMembers,
    /// Functions that are called and were not looked at.
    waiting: Vec<Handle<Function>>,
    known: HashSet<Handle<Function>>,
}

impl Reader<'_> {
    fn function(&mut self, function: &Function, info: &FunctionInfo, name: &str) {
        let module = &self.composed.module;
        if !UNPACKING.contains(&name) && reads_packed(module, function) {
            // Whoever has the bits may take anything out of them.
            self.members = SurfaceMembers::ALL;
        }
        self.block(function, info, &function.body);
    }

    fn block(&mut self, function: &Function, info: &FunctionInfo, block: &Block) {
        for statement in block {
            match statement {
                Statement::Emit(range) => {
                    for handle in range.clone() {
                        self.expression(function, info, handle);
                    }
                }
                Statement::Block(inner) => self.block(function, info, inner),
                Statement::If { condition, accept, reject } => {
                    let known = self.value_of(function, *condition);
                    if known != Some(false) {
                        self.block(function, info, accept);
                    }
                    if known != Some(true) {
                        self.block(function, info, reject);
                    }
                }
                Statement::Switch { cases, .. } => {
                    for case in cases {
                        self.block(function, info, &case.body);
                    }
                }
                Statement::Loop { body, continuing, .. } => {
                    self.block(function, info, body);
                    self.block(function, info, continuing);
                }
                Statement::Call { function: called, .. } if self.known.insert(*called) => {
                    self.waiting.push(*called);
                }
                _ => {}
            }
        }
    }

    fn expression(&mut self, function: &Function, info: &FunctionInfo, at: Handle<Expression>) {
        let Expression::AccessIndex { base, index } = function.expressions[at] else { return };
        let module = &self.composed.module;
        let Some(structure) = structure_behind(module, &info[base].ty) else { return };
        let ty = &module.types[structure];
        if ty.name.as_deref().map(undecorated).as_deref() != Some(SURFACE) {
            return;
        }
        let TypeInner::Struct { members, .. } = &ty.inner else { return };
        match members.get(index as usize).and_then(|member| member.name.as_deref()) {
            Some("albedo") => self.members.albedo = true,
            Some("ao") => self.members.ao = true,
            _ => {}
        }
    }

    /// A condition, where it is known.
    fn value_of(&self, function: &Function, condition: Handle<Expression>) -> Option<bool> {
        match function.expressions[condition] {
            Expression::Literal(Literal::Bool(value)) => Some(value),
            Expression::Override(handle) => {
                let constant = &self.composed.module.overrides[handle];
                let set = constant.name.as_ref().and_then(|name| self.flags.get(name));
                set.copied().or_else(|| {
                    match self.composed.module.global_expressions[constant.init?] {
                        Expression::Literal(Literal::Bool(value)) => Some(value),
                        _ => None,
                    }
                })
            }
            // A function of another module that says whether a feature of that is there.
            Expression::CallResult(called) => {
                let called = &self.composed.module.functions[called];
                let mut statements =
                    called.body.iter().filter(|one| !matches!(one, Statement::Emit(_)));
                match (statements.next(), statements.next()) {
                    (Some(Statement::Return { value: Some(value) }), None) => {
                        self.value_of(called, *value)
                    }
                    _ => None,
                }
            }
            Expression::Unary { op: naga::UnaryOperator::LogicalNot, expr } => {
                self.value_of(function, expr).map(|value| !value)
            }
            _ => None,
        }
    }
}

/// The type of a value, or of what a pointer points to.
fn structure_behind(module: &Module, ty: &TypeResolution) -> Option<Handle<Type>> {
    let pointed = |inner: &TypeInner| match inner {
        TypeInner::Pointer { base, .. } => Some(*base),
        _ => None,
    };
    match ty {
        TypeResolution::Handle(handle) => pointed(&module.types[*handle].inner).or(Some(*handle)),
        TypeResolution::Value(inner) => pointed(inner),
    }
}

/// Whether a function reads the packed surface. (Whole surfaces cannot lie in buffers, where another shader
/// might read them under other names: they have a member of type `bool`.)
fn reads_packed(module: &Module, function: &Function) -> bool {
    function.expressions.iter().any(|(_, expression)| match expression {
        Expression::GlobalVariable(variable) => {
            module.global_variables[*variable].name.as_deref() == Some(PACKED)
        }
        _ => false,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shader_compiler::compose::Library;

    fn read(body: &str, flags: &[(&str, bool)]) -> (bool, bool) {
        let source = format!(
            "#import surfelshop::surface\n\
             #import surfelshop::surface::Surface\n\
             override HAS_AO: bool = true;\n\
             override GLOWS: bool = false;\n\
             {body}\n\
             @fragment fn main(@builtin(position) p: vec4<f32>) -> @location(0) vec4<f32> {{\n\
                 return shade(surface::surface_at(vec2<u32>(p.xy)));\n\
             }}"
        );
        let composed = Library::new(true).unwrap().compose(&source, &[], &[]).unwrap();
        let flags = flags.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect();
        let members = members_read(&composed, naga::ShaderStage::Fragment, "main", &flags);
        (members.albedo, members.ao)
    }

    #[test]
    fn members_are_found_through_calls_variables_and_structures() {
        let none = "fn shade(s: Surface) -> vec4<f32> { return vec4(s.normal, s.depth); }";
        assert_eq!(read(none, &[]), (false, false));
        let direct = "fn shade(s: Surface) -> vec4<f32> { return vec4(s.albedo, 1.0); }";
        assert_eq!(read(direct, &[]), (true, false));
        let held = "struct Held { inner: Surface }\n\
             fn ao_of(h: ptr<function, Held>) -> f32 { return (*h).inner.ao; }\n\
             fn shade(s: Surface) -> vec4<f32> { var h = Held(s); return vec4(ao_of(&h)); }";
        assert_eq!(read(held, &[]), (false, true));
    }

    #[test]
    fn what_constants_rule_out_is_not_looked_at() {
        let guarded = "fn shade(s: Surface) -> vec4<f32> {\n\
                 var all = s.normal;\n\
                 if HAS_AO { all *= s.ao; }\n\
                 if !GLOWS { return vec4(all, 1.0); }\n\
                 return vec4(all * s.albedo, 1.0);\n\
             }";
        assert_eq!(read(guarded, &[("HAS_AO", true)]), (true, true), "code after a return counts");
        let guarded = guarded
            .replace("return vec4(all * s.albedo", "else { all *= s.albedo; } return vec4(all");
        let guarded = guarded
            .replace("if !GLOWS { return vec4(all, 1.0); }\n", "if !GLOWS { all += 1.0; }\n");
        assert_eq!(read(&guarded, &[]), (false, true), "defaults count");
        assert_eq!(read(&guarded, &[("HAS_AO", false)]), (false, false));
        assert_eq!(read(&guarded, &[("HAS_AO", false), ("GLOWS", true)]), (true, false));
        let called = "#import surfelshop::occlusion\n\
            fn shade(s: Surface) -> vec4<f32> {\n\
                if occlusion::counts() { return vec4(s.ao); }\n\
                return vec4(1.0);\n\
            }";
        let counts = |value| read(called, &[("surfelshop::occlusion::COUNTS", value)]);
        assert_eq!((counts(true), counts(false)), ((false, true), (false, false)));
    }

    #[test]
    fn functions_that_only_look_constant_are_looked_into() {
        for body in [
            "if s.covered { return false; } return true;",
            "switch s.pixel.x { case 0u: { return false; } default: {} } return true;",
            "loop { if s.covered { return false; } break; } return true;",
        ] {
            let source = format!(
                "fn is_bare(s: Surface) -> bool {{ {body} }}\n\
                 fn shade(s: Surface) -> vec4<f32> {{\n\
                     if is_bare(s) {{ return vec4(1.0); }} else {{ return vec4(s.albedo, 1.0); }}\n\
                 }}"
            );
            assert_eq!(read(&source, &[]), (true, false), "{body}");
        }
    }

    #[test]
    fn whoever_takes_the_bits_themselves_reads_everything() {
        let raw = "fn shade(s: Surface) -> vec4<f32> {\n\
                 return vec4<f32>(textureLoad(surface::surface_packed, s.pixel, 0));\n\
             }";
        assert_eq!(read(raw, &[]), (true, true));
    }
}
