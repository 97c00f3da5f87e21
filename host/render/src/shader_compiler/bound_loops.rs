//! Puts an iteration limit into every loop, so that no graph can keep a device busy for ever.

use crate::shader_compiler::work_limit::WorkLimit;
use naga::{
    BinaryOperator, Block, Expression, Function, Handle, Literal, LocalVariable, Module, Scalar,
    Span, Statement, Type, TypeInner,
};

/// Most iterations of one loop. At 2^26 a runaway shader ends within seconds on a GPU while the
/// longest honest loops of this project, over a picture's pixels, stay far below.
pub(crate) const MAX_ITERATIONS: u32 = 1 << 26;

/// How the loops of a function are bounded.
pub(super) enum Bound<'a> {
    /// Each by itself, at [`MAX_ITERATIONS`].
    Each,
    /// All together, by what a frame may take; operations of the function, with those it calls.
    Together(&'a WorkLimit, u64),
}

/// Inserts a counter into every loop of every function; a loop that reaches
/// [`MAX_ITERATIONS`] is left.
pub(crate) fn bound(module: &mut Module) {
    let u32_type = u32_type(module);
    for (_, function) in module.functions.iter_mut() {
        bound_function(function, u32_type, &Bound::Each);
    }
    for entry in &mut module.entry_points {
        bound_function(&mut entry.function, u32_type, &Bound::Each);
    }
}

/// The type of counters.
pub(super) fn u32_type(module: &mut Module) -> Handle<Type> {
    let ty = Type { name: None, inner: TypeInner::Scalar(Scalar::U32) };
    module.types.insert(ty, Span::UNDEFINED)
}

/// Bounds the loops of a function.
pub(super) fn bound_function(function: &mut Function, u32_type: Handle<Type>, how: &Bound<'_>) {
    let mut body = std::mem::take(&mut function.body);
    bound_block(function, &mut body, u32_type, how);
    function.body = body;
}

fn bound_block(
    function: &mut Function,
    block: &mut Block,
    u32_type: Handle<Type>,
    how: &Bound<'_>,
) {
    let statements: Vec<(Statement, Span)> = std::mem::take(block).span_into_iter().collect();
    let mut out = Block::with_capacity(statements.len());
    for (mut statement, span) in statements {
        match &mut statement {
            Statement::Block(inner) => bound_block(function, inner, u32_type, how),
            Statement::If { accept, reject, .. } => {
                bound_block(function, accept, u32_type, how);
                bound_block(function, reject, u32_type, how);
            }
            Statement::Switch { cases, .. } => {
                for case in cases {
                    bound_block(function, &mut case.body, u32_type, how);
                }
            }
            Statement::Loop { body, continuing, .. } => {
                bound_block(function, body, u32_type, how);
                bound_block(function, continuing, u32_type, how);
                match how {
                    Bound::Each => out.push(count_iterations(function, body, u32_type), span),
                    Bound::Together(limit, size) => limit.count(function, body, *size),
                }
            }
            _ => {}
        }
        out.push(statement, span);
    }
    *block = out;
}

/// Puts `counter += 1; if counter > MAX { break; }` in front of a loop's body and returns the
/// statement that clears the counter before the loop.
fn count_iterations(
    function: &mut Function,
    body: &mut Block,
    u32_type: Handle<Type>,
) -> Statement {
    let counter = function
        .local_variables
        .append(LocalVariable { name: None, ty: u32_type, init: None }, Span::UNDEFINED);
    let zero = literal(function, 0);
    let pointer = append(function, Expression::LocalVariable(counter));
    let mut leave = Block::new();
    leave.push(Statement::Break, Span::UNDEFINED);
    put_counter(function, body, (pointer, MAX_ITERATIONS), leave);
    Statement::Store { pointer, value: zero }
}

pub(super) fn append(function: &mut Function, expression: Expression) -> Handle<Expression> {
    function.expressions.append(expression, Span::UNDEFINED)
}

pub(super) fn literal(function: &mut Function, value: u32) -> Handle<Expression> {
    append(function, Expression::Literal(Literal::U32(value)))
}

/// Puts `counter += 1; if counter > most { beyond }` in front of a loop's body.
pub(super) fn put_counter(
    function: &mut Function,
    body: &mut Block,
    (pointer, most): (Handle<Expression>, u32),
    beyond: Block,
) {
    let span = Span::UNDEFINED;
    let [one, limit] = [1, most].map(|value| literal(function, value));
    let mark = function.expressions.len();
    let load = append(function, Expression::Load { pointer });
    let add = Expression::Binary { op: BinaryOperator::Add, left: load, right: one };
    let increased = append(function, add);
    let compare = Expression::Binary { op: BinaryOperator::Greater, left: increased, right: limit };
    let exceeded = append(function, compare);
    let emitted = function.expressions.range_from(mark);

    let mut head = Block::new();
    head.push(Statement::Emit(emitted), span);
    head.push(Statement::Store { pointer, value: increased }, span);
    head.push(Statement::If { condition: exceeded, accept: beyond, reject: Block::new() }, span);
    head.extend_block(std::mem::take(body));
    *body = head;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn loops_of_every_kind_stay_valid_and_gain_a_counter() {
        let source = "
            @compute @workgroup_size(1) fn main() {
                var total = 0u;
                for (var i = 0u; i < 4u; i++) { total += i; }
                while total < 100u { total += 1u; if total == 50u { continue; } }
                loop { if total > 5u { break; } continuing { total += 1u; } }
                loop { loop { break; } break; }
            }";
        let mut module = naga::front::wgsl::parse_str(source).unwrap();
        let before = module.entry_points[0].function.local_variables.len();
        bound(&mut module);
        assert_eq!(module.entry_points[0].function.local_variables.len(), before + 5);
        let mut validator = naga::valid::Validator::new(
            naga::valid::ValidationFlags::all(),
            naga::valid::Capabilities::default(),
        );
        validator.validate(&module).unwrap();
    }
}
