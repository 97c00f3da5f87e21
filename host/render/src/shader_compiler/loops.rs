//! How many loops stand one after another once functions stand where they are called.
//!
//! llvmpipe counts the rounds of all loops of a shader in one variable, and the time of LLVM to understand it
//! doubles with each loop that follows: Mesa 22.3 with LLVM 15 takes 1.4 s for 12, 5 s for 14 and more than
//! 15 s for 16. Loops with loops in them end that chain, and loops of few rounds are unrolled before.

use crate::shader_compiler::compose::{ShaderError, undecorated};
use naga::{BinaryOperator, Block, Expression, Function, Handle, Literal, Module, Statement};

/// Most loops one after another where the CPU draws.
pub(super) const MAX_ON_CPU: u64 = 14;
/// The same for graphics cards, whose compilers do not mind.
pub(super) const MAX_ON_CARD: u64 = 1_000;

/// Most rounds of a loop that is taken for one that drivers unroll.
const UNROLLED: i64 = 32;

/// Refuses modules with too many loops; says how many the largest of its functions has.
pub(super) fn check(module: &Module, max: u64) -> Result<u64, ShaderError> {
    // A function stands behind all that it calls; the validator has seen to that.
    let mut known: Vec<u64> = Vec::with_capacity(module.functions.len());
    let mut most = 0;
    let functions = module.functions.iter().map(|(_, function)| (function, &function.name));
    let functions = functions.map(|(function, name)| (function, name.as_deref()));
    let entries = module.entry_points.iter().map(|entry| (&entry.function, Some(&*entry.name)));
    for (function, name) in functions.chain(entries) {
        let BlockLoops { chain, longest } =
            Search { function, known: &known }.block(&function.body);
        let n = chain.max(longest);
        if n > max {
            return Err(ShaderError::new(format!(
                "function `{}` has {n} loops one after another with those of all functions it calls, at \
                 most {max} are compiled on this device; put them into one loop, or several passes",
                undecorated(name.unwrap_or_default())
            )));
        }
        most = most.max(n);
        known.push(chain);
    }
    Ok(most)
}

/// Loops of a block.
#[derive(Clone, Copy, Default)]
struct BlockLoops {
    /// One after another, from its begin to its end.
    chain: u64,
    /// The longest chain inside a loop.
    longest: u64,
}

impl BlockLoops {
    fn then(self, next: Self) -> Self {
        Self {
            chain: self.chain.saturating_add(next.chain),
            longest: self.longest.max(next.longest),
        }
    }
}

struct Search<'a> {
    function: &'a Function,
    /// Of the functions before: their chain.
    known: &'a [u64],
}

impl Search<'_> {
    fn block(&self, block: &Block) -> BlockLoops {
        block
            .iter()
            .map(|statement| self.statement(statement))
            .fold(BlockLoops::default(), BlockLoops::then)
    }

    fn statement(&self, statement: &Statement) -> BlockLoops {
        match statement {
            Statement::Block(inner) => self.block(inner),
            Statement::If { accept, reject, .. } => self.block(accept).then(self.block(reject)),
            Statement::Switch { cases, .. } => cases
                .iter()
                .map(|case| self.block(&case.body))
                .fold(BlockLoops::default(), BlockLoops::then),
            Statement::Loop { body, continuing, .. } => {
                let inside = self.block(body).then(self.block(continuing));
                let n = u64::from(inside.chain == 0 && !self.is_unrolled(body));
                BlockLoops { chain: n, longest: inside.longest.max(inside.chain) }
            }
            Statement::Call { function, .. } => {
                let chain = self.known.get(function.index()).copied().unwrap_or(u64::MAX);
                BlockLoops { chain, longest: 0 }
            }
            _ => BlockLoops::default(),
        }
    }

    /// Whether a loop is left once a variable has reached a small number, and nowhere else.
    fn is_unrolled(&self, body: &Block) -> bool {
        // One more is the limit that every loop was given.
        n_exits(body) <= 2
            && body.iter().any(|statement| {
                let Statement::If { condition, accept, reject } = statement else { return false };
                let leaves = |block: &Block| matches!(block[..], [Statement::Break]);
                (leaves(accept) || leaves(reject)) && self.is_of_few(*condition)
            })
    }

    fn is_of_few(&self, condition: Handle<Expression>) -> bool {
        use BinaryOperator::{Equal, Greater, GreaterEqual, Less, LessEqual, NotEqual};
        let Expression::Binary { op, left, right } = self.function.expressions[condition] else {
            return false;
        };
        let compares = matches!(op, Equal | Greater | GreaterEqual | Less | LessEqual | NotEqual);
        let is_variable = matches!(self.function.expressions[left], Expression::Load { .. });
        let few = match self.function.expressions[right] {
            Expression::Literal(Literal::I32(n)) => i64::from(n).abs() <= UNROLLED,
            Expression::Literal(Literal::U32(n)) => i64::from(n) <= UNROLLED,
            _ => false,
        };
        compares && is_variable && few
    }
}

/// Places where a loop with this body is left.
fn n_exits(body: &Block) -> usize {
    let exits = |statement: &Statement| match statement {
        Statement::Break | Statement::Return { .. } => 1,
        Statement::Block(inner) => n_exits(inner),
        Statement::If { accept, reject, .. } => n_exits(accept) + n_exits(reject),
        _ => 0,
    };
    body.iter().map(exits).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shader_compiler::bound_loops;

    fn loops(source: &str) -> Result<u64, String> {
        let mut module = naga::front::wgsl::parse_str(source).unwrap();
        bound_loops::bound(&mut module);
        check(&module, 12).map_err(|error| error.message)
    }

    fn shader(body: &str) -> String {
        format!(
            "fn f(n: u32) -> u32 {{ var k = n; for (var i = 0u; i < n; i++) {{ k *= i; }} return k; }}
             fn g(n: u32) -> u32 {{ return f(f(n)); }}
             @compute @workgroup_size(1) fn main(@builtin(local_invocation_index) n: u32) {{
                var k = n; {body} }}"
        )
    }

    #[test]
    fn loops_count_where_they_follow_each_other() {
        let simple = "while k > n { k -= 1u; }";
        assert_eq!(loops(&shader(&simple.repeat(12))), Ok(12));
        let error = loops(&shader(&simple.repeat(13))).unwrap_err();
        assert!(error.starts_with("function `main` has 13 loops one after another"), "{error}");
        assert!(loops(&shader(&"k = g(k);".repeat(7))).unwrap_err().contains("14 loops"));
        assert_eq!(loops(&shader(&"k = g(k);".repeat(6))), Ok(12));
        let both = format!("if k > 2u {{ {} }} else {{ {} }}", simple.repeat(6), simple.repeat(6));
        assert_eq!(loops(&shader(&both)), Ok(12));
    }

    #[test]
    fn loops_in_loops_and_unrolled_ones_do_not() {
        let nested = "for (var i = 0u; i < n; i++) { while k > n { k -= 1u; } }";
        assert_eq!(loops(&shader(&nested.repeat(20))), Ok(2));
        let inner = format!("loop {{ {} if k == n {{ break; }} }}", "k = f(k);".repeat(13));
        assert!(loops(&shader(&inner)).unwrap_err().contains("13 loops"));
        let short = "for (var i = 0u; i < 8u; i++) { k += i; }";
        assert_eq!(loops(&shader(&short.repeat(30))), Ok(2));
        let left = "for (var i = 0u; i < 8u; i++) { k += i; if k > n { break; } }";
        assert!(loops(&shader(&left.repeat(13))).is_err());
        let long = "for (var i = 0u; i < 800u; i++) { k += i; }";
        assert!(loops(&shader(&long.repeat(13))).is_err());
    }
}
