//! What every shader must keep, whoever wrote it.

use crate::shader_compiler::compose::{ShaderError, missing_need, undecorated, undecorated_text};

/// What a module breaks, and what of it.
pub(super) struct Invalid {
    pub(super) error: ShaderError,
    pub(super) parts: naga::WithSpan<naga::valid::ValidationError>,
}

/// # Errors
/// What a module breaks, in one line.
pub(super) fn validated(
    module: &naga::Module,
    allowed: naga::valid::Capabilities,
) -> Result<naga::valid::ModuleInfo, Box<Invalid>> {
    let mut validator = naga::valid::Validator::new(naga::valid::ValidationFlags::all(), allowed);
    validator.validate(module).map_err(|parts| {
        let mut message = parts.as_inner().to_string();
        let mut cause = std::error::Error::source(parts.as_inner());
        while let Some(inner) = cause {
            message.push_str(": ");
            message.push_str(&inner.to_string());
            cause = inner.source();
        }
        let line = format!("{}{}", undecorated_text(&message), missing_need(&message));
        Box::new(Invalid { error: ShaderError::new(line), parts })
    })
}

/// The bits of a place that count bytes; those above number modules, 0 for a text itself.
///
/// Source: the composer, `naga_oil` 0.23, `SPAN_SHIFT`.
const PLACE_BITS: usize = 21;

impl Invalid {
    /// The line of the smallest part that is wrong, in the composer's `text`, which begins at this byte; `None` where that
    /// is in a module. Types are named where they were used first, which says nothing.
    pub(super) fn line_in(&self, text: &str, begins: usize) -> Option<usize> {
        let spans = self.parts.spans().filter(|(_, what)| !what.contains("Type ["));
        let spans = spans.filter_map(|(span, _)| span.to_range());
        let smallest =
            spans.filter(|span| span.start >> PLACE_BITS == 0).min_by_key(|s| s.len())?;
        let before = text.get(..smallest.start.checked_sub(begins)?)?;
        Some(1 + before.matches('\n').count())
    }
}

/// Most bytes of a variable that each invocation has of its own. Drivers keep them in registers where
/// they can, and take minutes or all memory where they cannot.
const MAX_VARIABLE_BYTES: u32 = 64 << 10;

/// Refuses variables that no invocation should have of its own.
pub(super) fn check_variables(module: &naga::Module) -> Result<(), ShaderError> {
    use naga::AddressSpace::{Private, WorkGroup};
    let global = module.global_variables.iter().map(|(_, variable)| variable);
    let private = global
        .filter(|variable| matches!(variable.space, Private | WorkGroup))
        .map(|variable| (&variable.name, variable.ty));
    let functions = module.functions.iter().map(|(_, function)| function);
    let functions = functions.chain(module.entry_points.iter().map(|entry| &entry.function));
    let local = functions
        .flat_map(|function| function.local_variables.iter().map(|(_, v)| (&v.name, v.ty)));
    for (name, ty) in private.chain(local) {
        let size = module.types[ty].inner.try_size(module.to_ctx()).unwrap_or(u32::MAX);
        if size > MAX_VARIABLE_BYTES {
            let name = undecorated(name.as_deref().unwrap_or_default());
            return Err(ShaderError::new(format!(
                "variable `{name}` takes {size} bytes of each invocation, at most \
                 {MAX_VARIABLE_BYTES} are compiled"
            )));
        }
    }
    Ok(())
}
