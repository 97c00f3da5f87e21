//! One limit for all loops of a frame, for shaders of authors whom nobody trusts.
//!
//! Every loop counts its iterations in a variable of the invocation; each [`STRIDE`] of them add units of work to a
//! word that all invocations of a frame share. Once that has reached its limit, every loop is left: loops in
//! loops, and any number of invocations, end together. The host reads the word and refuses the picture. An invocation
//! that alone would take too long sets the word to its limit.
//!
//! Invariants: loops with barriers in them are left by a count of the invocation alone, so that all invocations of
//! a workgroup leave them alike; the word never wraps: none adds to it who finds it at its limit.

use crate::shader_compiler::bound_loops::{self, Bound, append, bound_function, literal, u32_type};
use naga::{
    AddressSpace, AtomicFunction, BinaryOperator, Block, Expression, Function, GlobalVariable,
    Handle, MemoryDecorations, Module, ResourceBinding, Scalar, ShaderStage, Span, Statement,
    StorageAccess, Type, TypeInner,
};

/// The word of a frame: units of work that were spent. Authors cannot name it.
pub(crate) const SPENT: &str = "surfelshop::sandbox::spent";

/// Iterations that an invocation counts by itself.
const STRIDE: u32 = 256;

/// Operations in an iteration that count as one unit for a stride: a unit of work is 2^14 operations.
const OPERATIONS: u64 = 64;

/// Units of work that one invocation may spend: 2^30 operations, or 2^24 iterations of a short loop. An iteration that
/// waits for memory takes up to a microsecond on a graphics card, so these are ten seconds or so.
pub(crate) const MAX_OF_INVOCATION: u32 = 1 << 16;

/// Most iterations, for an invocation, of all loops that have barriers in them. Sums and sorts of a workgroup take
/// about as many as a workgroup has bits.
const MAX_WITH_BARRIERS: u32 = 1 << 14;

/// The variables of the limit in a module.
pub(super) struct WorkLimit {
    /// Iterations of an invocation since it last added to the word.
    counter: Handle<GlobalVariable>,
    /// Units of work that an invocation has spent.
    own: Handle<GlobalVariable>,
    /// Iterations of loops with barriers.
    with_barriers: Handle<GlobalVariable>,
    spent: Handle<GlobalVariable>,
    most: u32,
    /// Whether each function, or one that it calls, has a barrier.
    has_barrier: Vec<bool>,
}

impl WorkLimit {
    /// Bounds all loops of a module, whose functions and entry points have so many operations, by `most` units of work, but those that vertices run: they
    /// are the host's.
    pub(super) fn put(module: &mut Module, [functions, entries]: [&[u64]; 2], most: u32) {
        let u32_type = u32_type(module);
        let atomic = Type { name: None, inner: TypeInner::Atomic(Scalar::U32) };
        let atomic = module.types.insert(atomic, Span::UNDEFINED);
        let bindings = module.global_variables.iter().filter_map(|(_, v)| v.binding);
        let next = bindings.map(|binding| binding.binding + 1).max().unwrap_or(0);
        let variable = |name: Option<&str>, space, binding, ty| GlobalVariable {
            name: name.map(str::to_owned),
            space,
            binding,
            ty,
            init: None,
            memory_decorations: MemoryDecorations::empty(),
        };
        let access = StorageAccess::LOAD | StorageAccess::STORE;
        let word = variable(
            Some(SPENT),
            AddressSpace::Storage { access },
            Some(ResourceBinding { group: 0, binding: next }),
            atomic,
        );
        let counter = variable(None, AddressSpace::Private, None, u32_type);
        let mut add = |variable| module.global_variables.append(variable, Span::UNDEFINED);
        let mut limit = Self {
            counter: add(counter.clone()),
            own: add(counter.clone()),
            with_barriers: add(counter),
            spent: add(word),
            most,
            has_barrier: Vec::new(),
        };
        for (_, function) in module.functions.iter() {
            let has = limit.has_barrier(&function.body);
            limit.has_barrier.push(has);
        }
        let of_vertices = run_by_vertices(module);
        for ((handle, function), size) in module.functions.iter_mut().zip(functions) {
            let how = match of_vertices[handle.index()] {
                true => Bound::Each,
                false => Bound::Together(&limit, *size),
            };
            bound_function(function, u32_type, &how);
        }
        for (entry, size) in module.entry_points.iter_mut().zip(entries) {
            let how = match entry.stage {
                ShaderStage::Vertex => Bound::Each,
                _ => Bound::Together(&limit, *size),
            };
            bound_function(&mut entry.function, u32_type, &how);
        }
    }

    /// Has the body of a loop begin with the limit; `size` are the operations of its function.
    pub(super) fn count(&self, function: &mut Function, body: &mut Block, size: u64) {
        let span = Span::UNDEFINED;
        let mut leave = Block::new();
        leave.push(Statement::Break, span);
        if self.has_barrier(body) {
            let counter = append(function, Expression::GlobalVariable(self.with_barriers));
            bound_loops::put_counter(function, body, (counter, MAX_WITH_BARRIERS), leave);
            return;
        }
        let variables = [self.counter, self.own, self.spent];
        let [counter, own, word] =
            variables.map(|variable| append(function, Expression::GlobalVariable(variable)));
        let units = u32::try_from(size.div_ceil(OPERATIONS)).unwrap_or(u32::MAX).max(1);
        // So that the sum below never wraps.
        let units = units.min(MAX_OF_INVOCATION);
        let [zero, units, most, most_own] =
            [0, units, self.most, MAX_OF_INVOCATION].map(|value| literal(function, value));
        let mark = function.expressions.len();
        let [spent, of_invocation] =
            [word, own].map(|pointer| append(function, Expression::Load { pointer }));
        let mut binary = |op, left, right| append(function, Expression::Binary { op, left, right });
        let is_spent = binary(BinaryOperator::GreaterEqual, spent, most);
        let is_long = binary(BinaryOperator::GreaterEqual, of_invocation, most_own);
        let sum = binary(BinaryOperator::Add, of_invocation, units);
        let emitted = function.expressions.range_from(mark);
        let atomic = |fun, value| Statement::Atomic { pointer: word, fun, value, result: None };
        let mut end_all = Block::new();
        end_all.push(atomic(AtomicFunction::Max, most), span);
        end_all.push(Statement::Break, span);
        let mut add = Block::new();
        add.push(Statement::Emit(emitted), span);
        add.push(Statement::If { condition: is_spent, accept: leave, reject: Block::new() }, span);
        add.push(Statement::If { condition: is_long, accept: end_all, reject: Block::new() }, span);
        add.push(atomic(AtomicFunction::Add, units), span);
        add.push(Statement::Store { pointer: own, value: sum }, span);
        add.push(Statement::Store { pointer: counter, value: zero }, span);
        bound_loops::put_counter(function, body, (counter, STRIDE - 1), add);
    }

    /// Whether a block waits for other invocations.
    fn has_barrier(&self, block: &Block) -> bool {
        block.iter().any(|statement| match statement {
            Statement::ControlBarrier(_) | Statement::WorkGroupUniformLoad { .. } => true,
            Statement::Block(inner) => self.has_barrier(inner),
            Statement::If { accept, reject, .. } => {
                self.has_barrier(accept) || self.has_barrier(reject)
            }
            Statement::Switch { cases, .. } => {
                cases.iter().any(|case| self.has_barrier(&case.body))
            }
            Statement::Loop { body, continuing, .. } => {
                self.has_barrier(body) || self.has_barrier(continuing)
            }
            // The validator has seen that it comes before its callers.
            Statement::Call { function, .. } => {
                self.has_barrier.get(function.index()).copied().unwrap_or(false)
            }
            _ => false,
        })
    }
}

/// Whether each function is called, by others or not, where a vertex is made: nothing is stored into there.
fn run_by_vertices(module: &Module) -> Vec<bool> {
    let mut run = vec![false; module.functions.len()];
    let note = |block: &Block, run: &mut [bool]| called(block, &mut |i| run[i] = true);
    for entry in module.entry_points.iter().filter(|entry| entry.stage == ShaderStage::Vertex) {
        note(&entry.function.body, &mut run);
    }
    // Callers come behind those they call.
    let functions: Vec<&Function> = module.functions.iter().map(|(_, function)| function).collect();
    for i in (0..functions.len()).rev() {
        if run[i] {
            note(&functions[i].body, &mut run);
        }
    }
    run
}

/// Tells the functions that a block calls.
fn called(block: &Block, tell: &mut impl FnMut(usize)) {
    for statement in block {
        match statement {
            Statement::Block(inner) => called(inner, tell),
            Statement::If { accept, reject, .. } => {
                called(accept, tell);
                called(reject, tell);
            }
            Statement::Switch { cases, .. } => {
                cases.iter().for_each(|case| called(&case.body, tell));
            }
            Statement::Loop { body, continuing, .. } => {
                called(body, tell);
                called(continuing, tell);
            }
            Statement::Call { function, .. } => tell(function.index()),
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shader_compiler::{Library, on_large_stack};

    fn composed(source: &str) -> Result<Module, String> {
        let compose = || {
            let mut library = Library::new(true).unwrap();
            let composed = library.compose_with((source, Some(1 << 20)), &[], &[]);
            composed.map(|composed| composed.module).map_err(|error| error.message)
        };
        on_large_stack(compose).unwrap()
    }

    fn atomics(function: &Function) -> usize {
        format!("{:?}", function.body).matches("Atomic {").count()
    }

    /// Invariant: every loop counts, those of called functions and in loops, too; those with barriers by themselves
    #[test]
    fn every_loop_counts() {
        let module = composed(
            "var<workgroup> shared_sum: u32;
            fn inner(n: u32) -> u32 {
                var sum = 0u;
                for (var i = 0u; i < n; i++) { loop { sum += i; if sum > 3u { break; } } }
                return sum;
            }
            @compute @workgroup_size(64) fn main(@builtin(local_invocation_index) i: u32) {
                for (var k = 0u; k < 9u; k++) {
                    if i == k { shared_sum += inner(k); }
                    workgroupBarrier();
                }
                while inner(i) > 7u { shared_sum = 1u; }
            }",
        )
        .unwrap();
        let all: Vec<usize> = module.functions.iter().map(|(_, f)| atomics(f)).collect();
        // Each adds to the word, or sets it to its limit.
        assert_eq!((all, atomics(&module.entry_points[0].function)), (vec![4], 2));
    }

    /// Invariant: vertices store nothing, whatever fragments do by the same functions
    #[test]
    fn what_vertices_run_has_limits_of_its_own() {
        let module = composed(
            "fn both(n: u32) -> f32 {
                var x = 0.0;
                for (var i = 0u; i < n; i++) { x += 0.5; }
                return x;
            }
            @vertex fn far(@builtin(vertex_index) i: u32) -> @builtin(position) vec4<f32> {
                return vec4(both(i));
            }
            @fragment fn near() -> @location(0) vec4<f32> {
                var x = both(3u);
                loop { x += 1.0; if x > 9.0 { break; } }
                return vec4(x);
            }",
        )
        .unwrap();
        let of: Vec<usize> = module.entry_points.iter().map(|e| atomics(&e.function)).collect();
        assert_eq!(of, [0, 2]);
        assert_eq!(module.functions.iter().map(|(_, f)| atomics(f)).sum::<usize>(), 0);
    }

    #[test]
    fn mistakes_are_told_as_ever() {
        let error = composed("@compute @workgroup_size(1) fn main() { let x: u32 = 1.5; }");
        assert!(error.unwrap_err().contains("line 1"), "with its line");
    }
}
