//! How much a driver has to compile: drivers put functions in place of their calls, so a short text of
//! functions that call each other twice is a program of any length.
//!
//! Invariants: every function is looked at once, whatever calls it; sizes saturate and never wrap.

use crate::shader_compiler::compose::{ShaderError, undecorated};
use crate::shader_compiler::weights::Weights;
use naga::valid::{FunctionInfo, ModuleInfo};
use naga::{AddressSpace, Block, Function, Module, Statement};

/// Most operations of a function with all that it calls, as [`Weights`] counts them. The largest one of this
/// project, a pattern of `procedural`, has 9,412. Of 292 texts made to be slow llvmpipe (Mesa 22.3, LLVM 15, one
/// core) takes 2.9 s at most for one that is let through.
pub(super) const MAX_OPERATIONS: u64 = 32_768;

/// Operations of functions with all that they call.
pub(super) struct Sizes {
    pub(super) functions: Vec<u64>,
    pub(super) entries: Vec<u64>,
}

impl Sizes {
    /// Those of the largest.
    pub(super) fn largest(&self) -> u64 {
        self.functions.iter().chain(&self.entries).copied().max().unwrap_or(0)
    }
}

/// Operations of the functions of a validated module.
///
/// # Errors
/// The first function that is larger than drivers compile in reasonable time.
pub(super) fn check(module: &Module, info: &ModuleInfo) -> Result<Sizes, ShaderError> {
    let weights = Weights::new(module);
    // By index: a function comes after those it calls.
    let mut functions: Vec<u64> = Vec::with_capacity(module.functions.len());
    for (handle, function) in module.functions.iter() {
        let size = size(&weights, function, &info[handle], &functions);
        let name = undecorated(function.name.as_deref().unwrap_or_default());
        functions.push(within(size, &name)?);
    }
    let mut entries = Vec::with_capacity(module.entry_points.len());
    for (i, entry) in module.entry_points.iter().enumerate() {
        let info = info.get_entry_point(i);
        let private = module.global_variables.iter().filter(|(handle, variable)| {
            variable.space == AddressSpace::Private && !info[*handle].is_empty()
        });
        let private = weights.variables(private.map(|(_, variable)| variable.ty));
        let size = size(&weights, &entry.function, info, &functions).saturating_add(private);
        entries.push(within(size, &entry.name)?);
    }
    Ok(Sizes { functions, entries })
}

fn within(size: u64, name: &str) -> Result<u64, ShaderError> {
    if size <= MAX_OPERATIONS {
        return Ok(size);
    }
    Err(ShaderError::new(format!(
        "function `{name}` has {size} operations with those of all functions it calls, at most \
         {MAX_OPERATIONS} are compiled; call fewer functions, or in a loop, and put long arrays into buffers"
    )))
}

/// Operations of a function with those it calls, whose sizes are known.
fn size(weights: &Weights<'_>, function: &Function, info: &FunctionInfo, called: &[u64]) -> u64 {
    let variables = function.local_variables.iter().map(|(_, variable)| variable.ty);
    let expressions = function.expressions.iter();
    let expressions = expressions.map(|(at, _)| weights.expression(function, info, at));
    let expressions = expressions.fold(weights.variables(variables), u64::saturating_add);
    let statement = |s: &Statement| weights.statement(function, info, s);
    expressions.saturating_add(block_size(&function.body, called, &statement))
}

fn block_size(block: &Block, called: &[u64], weight: &impl Fn(&Statement) -> u64) -> u64 {
    let within = |block: &Block| block_size(block, called, weight);
    let each = block.iter().map(|statement| {
        let inside = match statement {
            Statement::Block(inner) => within(inner),
            Statement::If { accept, reject, .. } => within(accept).saturating_add(within(reject)),
            Statement::Switch { cases, .. } => {
                cases.iter().map(|case| within(&case.body)).fold(0, u64::saturating_add)
            }
            Statement::Loop { body, continuing, .. } => {
                within(body).saturating_add(within(continuing))
            }
            // The validator has seen that it comes before its callers.
            Statement::Call { function, .. } => {
                called.get(function.index()).copied().unwrap_or(u64::MAX)
            }
            _ => 0,
        };
        inside.saturating_add(weight(statement))
    });
    each.fold(0, u64::saturating_add)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shader_compiler::on_large_stack;
    use naga::valid::{Capabilities, ValidationFlags, Validator};

    fn checked(source: &str) -> Result<u64, String> {
        let checked = || {
            let module = naga::front::wgsl::parse_str(source).unwrap();
            let mut validator = Validator::new(ValidationFlags::all(), Capabilities::default());
            let info = validator.validate(&module).unwrap();
            check(&module, &info).map(|sizes| sizes.largest()).map_err(|error| error.message)
        };
        on_large_stack(checked).unwrap()
    }

    fn main(functions: &str, body: &str) -> String {
        format!("{functions}\n@compute @workgroup_size(1) fn main() {{ {body} }}")
    }

    /// `f0` to `f(n-1)`, each calling the one before twice.
    fn doubling(n: usize) -> String {
        let next =
            |i: usize| format!("fn f{i}(x: f32) -> f32 {{ return f{0}(f{0}(x)); }}\n", i - 1);
        let all: String = (1..n).map(next).collect();
        let first = "fn f0(x: f32) -> f32 { return x * x; }\n";
        main(&format!("{first}{all}"), &format!("_ = f{}(1.0);", n - 1))
    }

    #[test]
    fn what_is_called_counts_where_it_is_called() {
        // f0: a product and a return. Each other: two calls of one argument, a return, and all of the one before
        // twice.
        let expected = |n: usize| (1..n).fold(2, |before, _| 2 * before + 5);
        for n in [2, 3, 8] {
            // The entry point calls the last one and returns.
            assert_eq!(checked(&doubling(n)), Ok(expected(n) + 3), "{n}");
        }
        let error = checked(&doubling(19)).unwrap_err();
        assert!(error.contains("function `f13`") && error.contains("operations"), "{error}");
    }

    #[test]
    fn arrays_count_by_what_is_copied() {
        let copies =
            "fn g(q: f32) -> f32 { var s = array<f32, 16384>(); var t = s; t[u32(q)] = q; s = t;
            return s[u32(q)]; }";
        assert!(checked(&main(copies, "_ = g(1.0);")).unwrap_err().contains("function `g`"));
        let of = |n: usize| {
            format!("fn g(q: f32) -> f32 {{ var s: array<f32, {n}>; return s[u32(q)]; }}")
        };
        assert!(checked(&main(&of(256), "_ = g(1.0);")).is_ok());
        assert!(checked(&main(&of(1024), "_ = g(1.0);")).is_err());
        // A short one is as much where it is called often.
        assert!(checked(&main(&of(64), &"_ = g(1.0);".repeat(10))).is_err());
        let table = "const t = array<array<f32, 64>, 64>();
            fn g(q: f32) -> f32 { return t[u32(q)][u32(q)]; }";
        assert!(checked(&main(table, "_ = g(1.0);")).is_err());
        let private = "var<private> p: array<f32, 1024>; fn g(q: u32) -> f32 { return p[q]; }";
        assert!(checked(&main(private, "_ = g(1u);")).unwrap_err().contains("function `main`"));
        // What no entry point reads is not there for drivers.
        assert!(checked(&main(private, "")).is_ok());
    }

    #[test]
    fn products_of_matrices_and_functions_count_by_what_they_compute() {
        let products = |n: usize| {
            let lines = "m = m * m;".repeat(n);
            main("", &format!("var m = mat4x4<f32>(); {lines}"))
        };
        let one = checked(&products(2)).unwrap() - checked(&products(1)).unwrap();
        assert!(one >= 16 * 7, "{one}");
        assert!(checked(&products(500)).is_err());
        assert!(checked(&main("", &"_ = 1 + 1;".repeat(4_000))).is_ok());
        let powers = |n: usize| {
            let lines = "x = pow(x, x);".repeat(n);
            main("", &format!("var x = 2.0; {lines}"))
        };
        assert!(checked(&powers(900)).is_err() && checked(&powers(100)).is_ok());
    }
}
