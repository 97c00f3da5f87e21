//! Puts an iteration limit into every loop, so that no graph can keep a device busy for ever.

use naga::{
    BinaryOperator, Block, Expression, Function, Handle, Literal, LocalVariable, Module, Scalar,
    Span, Statement, Type, TypeInner,
};

/// Most iterations of one loop. At 2^26 a runaway shader ends within seconds on a GPU while the
/// longest honest loops of this project, over a picture's pixels, stay far below.
pub(crate) const MAX_ITERATIONS: u32 = 1 << 26;

/// Inserts a counter into every loop of every function; a loop that reaches
/// [`MAX_ITERATIONS`] is left.
pub(crate) fn bound(module: &mut Module) {
    let u32_type = module
        .types
        .insert(Type { name: None, inner: TypeInner::Scalar(Scalar::U32) }, Span::UNDEFINED);
    for (_, function) in module.functions.iter_mut() {
        bound_function(function, u32_type);
    }
    for entry in &mut module.entry_points {
        bound_function(&mut entry.function, u32_type);
    }
}

fn bound_function(function: &mut Function, u32_type: Handle<Type>) {
    let mut body = std::mem::take(&mut function.body);
    bound_block(function, &mut body, u32_type);
    function.body = body;
}

fn bound_block(function: &mut Function, block: &mut Block, u32_type: Handle<Type>) {
    let statements: Vec<(Statement, Span)> = std::mem::take(block).span_into_iter().collect();
    let mut out = Block::with_capacity(statements.len());
    for (mut statement, span) in statements {
        match &mut statement {
            Statement::Block(inner) => bound_block(function, inner, u32_type),
            Statement::If { accept, reject, .. } => {
                bound_block(function, accept, u32_type);
                bound_block(function, reject, u32_type);
            }
            Statement::Switch { cases, .. } => {
                for case in cases {
                    bound_block(function, &mut case.body, u32_type);
                }
            }
            Statement::Loop { body, continuing, .. } => {
                bound_block(function, body, u32_type);
                bound_block(function, continuing, u32_type);
                let reset = count_iterations(function, body, u32_type);
                out.push(reset, span);
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
    let span = Span::UNDEFINED;
    let counter = function
        .local_variables
        .append(LocalVariable { name: None, ty: u32_type, init: None }, span);
    let literal = |function: &mut Function, value: u32| {
        function.expressions.append(Expression::Literal(Literal::U32(value)), span)
    };
    let zero = literal(function, 0);
    let one = literal(function, 1);
    let limit = literal(function, MAX_ITERATIONS);
    let pointer = function.expressions.append(Expression::LocalVariable(counter), span);

    let mark = function.expressions.len();
    let load = function.expressions.append(Expression::Load { pointer }, span);
    let add = Expression::Binary { op: BinaryOperator::Add, left: load, right: one };
    let increased = function.expressions.append(add, span);
    let compare = Expression::Binary { op: BinaryOperator::Greater, left: increased, right: limit };
    let exceeded = function.expressions.append(compare, span);
    let emitted = function.expressions.range_from(mark);

    let mut accept = Block::new();
    accept.push(Statement::Break, span);
    let mut head = Block::new();
    head.push(Statement::Emit(emitted), span);
    head.push(Statement::Store { pointer, value: increased }, span);
    head.push(Statement::If { condition: exceeded, accept, reject: Block::new() }, span);
    head.extend_block(std::mem::take(body));
    *body = head;
    Statement::Store { pointer, value: zero }
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
