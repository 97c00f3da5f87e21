//! The functions that an entry point calls.

use crate::shader_compiler::compose::undecorated;
use naga::{Block, Function, Handle, Module, Statement};
use std::collections::BTreeSet;

/// The names of all functions that an entry point calls, those of modules as `module::name`; none where there is no such
/// entry point.
pub(crate) fn called_by(module: &Module, entry: &str) -> BTreeSet<String> {
    let mut known: BTreeSet<Handle<Function>> = BTreeSet::new();
    let mut waiting = Vec::new();
    if let Some(entry) = module.entry_points.iter().find(|point| point.name == entry) {
        calls(&entry.function.body, &mut waiting);
    }
    while let Some(function) = waiting.pop() {
        if known.insert(function) {
            calls(&module.functions[function].body, &mut waiting);
        }
    }
    let name = |handle: Handle<Function>| module.functions[handle].name.as_deref().map(undecorated);
    known.into_iter().filter_map(name).collect()
}

fn calls(block: &Block, found: &mut Vec<Handle<Function>>) {
    for statement in block {
        match statement {
            Statement::Call { function, .. } => found.push(*function),
            Statement::Block(inner) => calls(inner, found),
            Statement::If { accept, reject, .. } => {
                calls(accept, found);
                calls(reject, found);
            }
            Statement::Switch { cases, .. } => {
                cases.iter().for_each(|case| calls(&case.body, found));
            }
            Statement::Loop { body, continuing, .. } => {
                calls(body, found);
                calls(continuing, found);
            }
            _ => {}
        }
    }
}
