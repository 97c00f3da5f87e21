//! What expressions and statements cost a driver's compiler, in operations on one number.
//!
//! The scale is an addition of two numbers. Weights were measured with Mesa's llvmpipe, which writes out
//! in full what cards have instructions for: a thousand of each, one after the other, and rounded. What was
//! not measured one by one is taken for one operation on each number of its result.

use naga::valid::FunctionInfo;
use naga::{
    AddressSpace, ArraySize, BinaryOperator, Expression, Function, Handle, MathFunction, Module,
    ScalarKind, Statement, Type, TypeInner,
};

/// An element of an array that each invocation has of its own, where it is cleared, copied or passed on.
const ELEMENT: u64 = 64;
/// An index into such an array that only the running shader knows.
const INDEX: u64 = 64;
/// A number that is read from a buffer or stored into one.
const BUFFERED: u64 = 8;
/// A texel that is filtered, and one that is read or stored as it is.
const SAMPLE: u64 = 256;
const TEXEL: u64 = 64;
/// An atomic operation, and one among the invocations of a group.
const SHARED: u64 = 64;
/// A condition, a case, or a loop, without what is in it.
const BRANCH: u64 = 8;
/// A whole number divided by another.
const WHOLE_DIVISION: u64 = 64;

/// Weighs the parts of one module's functions.
pub(super) struct Weights<'a> {
    module: &'a Module,
    /// By type: how many numbers a value is. Types come after those they are made of.
    numbers: Vec<u64>,
    /// By type: what it costs to clear or copy a value.
    copied: Vec<u64>,
}

impl<'a> Weights<'a> {
    pub(super) fn new(module: &'a Module) -> Self {
        let mut weights = Self { module, numbers: Vec::new(), copied: Vec::new() };
        for (_, ty) in module.types.iter() {
            let (numbers, copied) = match &ty.inner {
                TypeInner::Array { base, size, .. } => {
                    let numbers = weights.numbers[base.index()].saturating_mul(length(*size));
                    (numbers, numbers.saturating_mul(ELEMENT))
                }
                TypeInner::Struct { members, .. } => {
                    let sum = |of: &[u64]| {
                        let each = members.iter().map(|member| of[member.ty.index()]);
                        each.fold(0, u64::saturating_add)
                    };
                    (sum(&weights.numbers), sum(&weights.copied))
                }
                plain => (numbers_of_plain(plain), numbers_of_plain(plain)),
            };
            weights.numbers.push(numbers);
            weights.copied.push(copied);
        }
        weights
    }

    /// What it costs that there are these variables.
    pub(super) fn variables(&self, types: impl Iterator<Item = Handle<Type>>) -> u64 {
        types.map(|ty| self.copied[ty.index()]).fold(0, u64::saturating_add)
    }

    /// What one expression of a function costs.
    pub(super) fn expression(
        &self,
        function: &Function,
        info: &FunctionInfo,
        at: Handle<Expression>,
    ) -> u64 {
        let n = self.numbers(info, at);
        match &function.expressions[at] {
            Expression::Constant(_) | Expression::ZeroValue(_) => match self.copied(info, at) {
                plain if plain == n => 0,
                // Tables: drivers copy them to wherever they are used.
                table => table,
            },
            Expression::Literal(_)
            | Expression::Override(_)
            | Expression::FunctionArgument(_)
            | Expression::GlobalVariable(_)
            | Expression::LocalVariable(_)
            | Expression::CallResult(_)
            | Expression::AtomicResult { .. }
            | Expression::WorkGroupUniformLoadResult { .. }
            | Expression::SubgroupBallotResult
            | Expression::SubgroupOperationResult { .. } => 0,
            Expression::Access { base, .. } => self.index(info, *base),
            Expression::AccessIndex { .. } => 1,
            Expression::Load { pointer } => self.moved(info, *pointer, at),
            Expression::ImageSample { .. } => SAMPLE,
            Expression::ImageLoad { .. } => TEXEL,
            Expression::ImageQuery { .. } | Expression::ArrayLength(_) => BUFFERED,
            Expression::Binary { op, left, right } => self.binary(info, *op, [*left, *right], n),
            Expression::Math { fun, arg, .. } => {
                let of = n.max(self.numbers(info, *arg));
                weight_of_function(*fun).saturating_mul(of)
            }
            Expression::Compose { .. } => self.copied(info, at),
            // Of one number each: conversions, choices, swizzles. No other is allowed here.
            _ => n,
        }
    }

    /// What one statement costs without those in it and without the function it calls.
    pub(super) fn statement(
        &self,
        function: &Function,
        info: &FunctionInfo,
        statement: &Statement,
    ) -> u64 {
        match statement {
            Statement::Emit(_) | Statement::Block(_) | Statement::Break | Statement::Continue => 0,
            Statement::If { .. } | Statement::Loop { .. } => BRANCH,
            Statement::Switch { cases, .. } => BRANCH.saturating_mul(1 + cases.len() as u64),
            Statement::Store { pointer, value } => self.moved(info, *pointer, *value),
            Statement::ImageStore { .. } => TEXEL,
            Statement::Call { arguments, .. } => {
                let each = arguments.iter().map(|at| match function.expressions[*at] {
                    // What is handed on as a place, and not as a value.
                    Expression::LocalVariable(_) | Expression::GlobalVariable(_) => 1,
                    _ => self.copied(info, *at),
                });
                each.fold(1, u64::saturating_add)
            }
            Statement::Return { value } => value.map_or(1, |at| self.copied(info, at)),
            _ => SHARED,
        }
    }

    fn numbers(&self, info: &FunctionInfo, at: Handle<Expression>) -> u64 {
        let ty = &info[at].ty;
        match ty.handle() {
            Some(ty) => self.numbers[ty.index()],
            None => numbers_of_plain(ty.inner_with(&self.module.types)),
        }
    }

    fn copied(&self, info: &FunctionInfo, at: Handle<Expression>) -> u64 {
        let ty = &info[at].ty;
        match ty.handle() {
            Some(ty) => self.copied[ty.index()],
            None => numbers_of_plain(ty.inner_with(&self.module.types)),
        }
    }

    fn inner<'b>(&'b self, info: &'b FunctionInfo, at: Handle<Expression>) -> &'b TypeInner {
        info[at].ty.inner_with(&self.module.types)
    }

    /// Reading or storing a value through a pointer.
    fn moved(
        &self,
        info: &FunctionInfo,
        pointer: Handle<Expression>,
        value: Handle<Expression>,
    ) -> u64 {
        match self.inner(info, pointer).pointer_space() {
            Some(AddressSpace::Function | AddressSpace::Private) => self.copied(info, value),
            _ => self.numbers(info, value).saturating_mul(BUFFERED),
        }
    }

    /// An index that only the running shader knows.
    fn index(&self, info: &FunctionInfo, base: Handle<Expression>) -> u64 {
        match self.inner(info, base).pointer_space() {
            Some(AddressSpace::Function | AddressSpace::Private) => INDEX,
            Some(_) => BUFFERED,
            // A value has no places: it is copied to a variable that has.
            None => INDEX.saturating_add(self.copied(info, base)),
        }
    }

    fn binary(
        &self,
        info: &FunctionInfo,
        op: BinaryOperator,
        [left, right]: [Handle<Expression>; 2],
        n: u64,
    ) -> u64 {
        let is_whole = |inner: &TypeInner| {
            let scalar = inner.scalar();
            scalar.is_some_and(|s| matches!(s.kind, ScalarKind::Sint | ScalarKind::Uint))
        };
        match op {
            BinaryOperator::Multiply => {
                // Each number of a product with a matrix is a sum of up to four.
                let is_matrix = |at| matches!(self.inner(info, at), TypeInner::Matrix { .. });
                let (a, b) = (self.numbers(info, left), self.numbers(info, right));
                match is_matrix(left) || is_matrix(right) {
                    true if a > 1 && b > 1 => n.saturating_mul(8),
                    _ => n,
                }
            }
            BinaryOperator::Divide | BinaryOperator::Modulo if is_whole(self.inner(info, left)) => {
                n.saturating_mul(WHOLE_DIVISION)
            }
            BinaryOperator::Divide | BinaryOperator::Modulo => n.saturating_mul(4),
            _ => n.max(self.numbers(info, left)),
        }
    }
}

fn length(size: ArraySize) -> u64 {
    match size {
        ArraySize::Constant(n) => u64::from(n.get()),
        // No invocation has one of its own, nor is one copied.
        ArraySize::Pending(_) | ArraySize::Dynamic => 1,
    }
}

/// Numbers of a type that is neither an array nor a structure.
fn numbers_of_plain(inner: &TypeInner) -> u64 {
    match *inner {
        TypeInner::Vector { size, .. } => size as u64,
        TypeInner::Matrix { columns, rows, .. } => columns as u64 * rows as u64,
        _ => 1,
    }
}

/// What a built-in function costs for each number of what it takes or gives.
fn weight_of_function(function: MathFunction) -> u64 {
    use MathFunction as F;
    match function {
        F::Atan2 => 80,
        F::Tan | F::Sinh | F::Cosh | F::Asinh | F::Acosh | F::Atan | F::Asin | F::Pow => 40,
        F::Sin | F::Cos | F::Acos | F::Atanh | F::Tanh => 32,
        F::Log | F::Log2 | F::Inverse | F::Refract => 24,
        F::Pack2x16float | F::Unpack2x16float => 24,
        F::Exp | F::Exp2 | F::Modf | F::Frexp | F::Ldexp => 16,
        F::FirstLeadingBit | F::FirstTrailingBit | F::CountLeadingZeros => 12,
        F::CountTrailingZeros => 12,
        F::Pack4x8snorm | F::Pack4x8unorm | F::Pack2x16snorm | F::Pack2x16unorm => 8,
        F::Pack4xI8 | F::Pack4xU8 | F::Pack4xI8Clamp | F::Pack4xU8Clamp => 8,
        F::Unpack4x8snorm | F::Unpack4x8unorm | F::Unpack2x16snorm | F::Unpack2x16unorm => 8,
        F::Unpack4xI8 | F::Unpack4xU8 | F::Dot4I8Packed | F::Dot4U8Packed => 8,
        F::QuantizeToF16 | F::Normalize | F::SmoothStep | F::ReverseBits | F::CountOneBits => 6,
        F::Determinant | F::Reflect | F::FaceForward | F::Length | F::Distance | F::Cross => 4,
        F::Sqrt | F::InverseSqrt | F::Sign | F::ExtractBits | F::InsertBits | F::Round => 4,
        _ => 2,
    }
}
