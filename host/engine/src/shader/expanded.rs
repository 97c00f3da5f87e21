//! How large a shader is once the functions it calls stand where they are called: compilers of drivers put them
//! there. Nineteen functions that each call the one before twice are a kilobyte of text and a million calls.

use super::compose::{ShaderError, undecorated};
use naga::{Block, Expression, Function, Module, Statement};

/// Most operations of an entry point with all it calls. The largest one of this project, a pattern of
/// `procedural`, has 4173. llvmpipe (Mesa 22.3, LLVM 15, one core) takes 1.1 s for 4,000 in functions that call
/// each other, 2.5 s for 7,000, 6.4 s for 14,000, 21 s for 28,000, and memory in proportion to that time.
pub(super) const MAX_OPERATIONS: u64 = 20_000;

/// Most operations of a function alone. The largest one of this project has 198; a sum of 8,000 terms takes
/// llvmpipe 2.3 s, one of 12,000 took 38 s of a busy machine.
pub(super) const MAX_OF_FUNCTION: u64 = 8_000;

/// Operations of the largest function, and of the largest entry point with all it calls.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Size {
    pub(super) function: u64,
    pub(super) expanded: u64,
}

/// Refuses modules that drivers would take too long for, or all memory; says how large this one is.
pub(super) fn check(module: &Module) -> Result<Size, ShaderError> {
    // A function stands behind all that it calls; the validator has seen to that.
    let mut expanded: Vec<u64> = Vec::with_capacity(module.functions.len());
    let mut size = Size::default();
    for (_, function) in module.functions.iter() {
        let all = one(function, function.name.as_deref(), &expanded, &mut size)?;
        expanded.push(all);
    }
    for entry in &module.entry_points {
        one(&entry.function, Some(&entry.name), &expanded, &mut size)?;
    }
    Ok(size)
}

/// Operations of a function with all it calls, where they are not too many.
fn one(
    function: &Function,
    name: Option<&str>,
    expanded: &[u64],
    size: &mut Size,
) -> Result<u64, ShaderError> {
    let name = || undecorated(name.unwrap_or_default());
    let (mut own, mut called) = (0u64, 0u64);
    count(&function.body, &mut |statement| {
        own += 1;
        if let Statement::Call { function, .. } = statement {
            called = called.saturating_add(expanded.get(function.index()).copied().unwrap_or(0));
        }
    });
    own += operations(function);
    if own > MAX_OF_FUNCTION {
        return Err(ShaderError::new(format!(
            "function `{}` has {own} operations, at most {MAX_OF_FUNCTION} are compiled; use loops, \
             or several passes",
            name()
        )));
    }
    let all = own.saturating_add(called);
    if all > MAX_OPERATIONS {
        return Err(ShaderError::new(format!(
            "function `{}` has {all} operations with those of all functions it calls, at most \
             {MAX_OPERATIONS} are compiled; call fewer functions, or in a loop",
            name()
        )));
    }
    *size = Size { function: size.function.max(own), expanded: size.expanded.max(all) };
    Ok(all)
}

/// Expressions of a function that compute something.
fn operations(function: &Function) -> u64 {
    let computes = |expression: &Expression| {
        !matches!(
            expression,
            Expression::Literal(_)
                | Expression::Constant(_)
                | Expression::Override(_)
                | Expression::ZeroValue(_)
                | Expression::FunctionArgument(_)
                | Expression::GlobalVariable(_)
                | Expression::LocalVariable(_)
                | Expression::CallResult(_)
        )
    };
    function.expressions.iter().filter(|(_, expression)| computes(expression)).count() as u64
}

/// Calls `each` with all statements of a block and the blocks in it.
fn count(block: &Block, each: &mut impl FnMut(&Statement)) {
    for statement in block.iter() {
        each(statement);
        match statement {
            Statement::Block(inner) => count(inner, each),
            Statement::If { accept, reject, .. } => {
                count(accept, each);
                count(reject, each);
            }
            Statement::Switch { cases, .. } => {
                cases.iter().for_each(|case| count(&case.body, each))
            }
            Statement::Loop { body, continuing, .. } => {
                count(body, each);
                count(continuing, each);
            }
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shader::on_large_stack;

    fn checked(source: &str) -> Result<Size, ShaderError> {
        let checked = || check(&naga::front::wgsl::parse_str(source).unwrap());
        on_large_stack(checked).unwrap()
    }

    /// `f0` to `f(n-1)`, each calling the one before twice.
    fn doubling(n: usize) -> String {
        let mut text = "fn f0(x: f32) -> f32 { return x * x; }\n".to_owned();
        for i in 1..n {
            let before = i - 1;
            text += &format!("fn f{i}(x: f32) -> f32 {{ return f{before}(f{before}(x)); }}\n");
        }
        text + &format!("@compute @workgroup_size(1) fn main() {{ _ = f{}(1.0); }}", n - 1)
    }

    #[test]
    fn what_is_called_counts_where_it_is_called() {
        // f0: a product, told to be computed, and a return. Each other: two calls and a return, and all of the
        // one before twice.
        let size = |n: u32| checked(&doubling(n as usize)).unwrap().expanded;
        let expected = |n: u32| (0..n - 1).fold(3, |before, _| 2 * before + 3);
        for n in [2, 3, 8] {
            // The entry point calls the last one and returns.
            assert_eq!(size(n), expected(n) + 2, "{n}");
        }
        let error = checked(&doubling(19)).unwrap_err().message;
        assert!(error.contains("function `f12`") && error.contains("24573 operations"), "{error}");
    }

    #[test]
    fn long_sums_are_refused_with_their_function() {
        let sum = |n: usize| {
            let terms = vec!["x"; n].join(" + ");
            format!(
                "fn f(x: f32) -> f32 {{ return {terms}; }}\n@compute @workgroup_size(1) fn main() {{ _ = f(1.0); }}"
            )
        };
        assert_eq!(checked(&sum(1000)).unwrap().function, 999 + 2);
        let error = checked(&sum(12_000)).unwrap_err().message;
        assert!(error.contains("function `f` has 12001 operations, at most 8000"), "{error}");
    }
}
