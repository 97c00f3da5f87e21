//! Modules as they are compiled.

use crate::stop::one_line;
use std::sync::atomic::{AtomicUsize, Ordering};
use wasmi::{Config, CustomFuelCosts, EnforcedLimits, Engine};
use wasmparser::{Parser, Payload};

/// How deep the calls of a module may go.
const MAX_RECURSION: usize = 10_000;
/// Most bytes of values on the stack of a call.
const MAX_STACK_BYTES: usize = 4 << 20;

/// Modules that were compiled in this process.
static COMPILED: AtomicUsize = AtomicUsize::new(0);

/// How many modules this process has compiled, or tried to: as long as it is 0, no engine was made.
#[must_use]
pub fn n_compiled() -> usize {
    COMPILED.load(Ordering::Relaxed)
}

/// What its work costs besides an instruction's one step. Its functions are compiled when they are first called, which costs
/// nothing: each is compiled once, and together they are no longer than the file. A call that ran out of steps within that
/// could not go on.
const COSTS: CustomFuelCosts = CustomFuelCosts {
    bytes_copied_per_fuel: 64,
    fuel_per_bytes_translated: 0,
    fuel_per_bytes_validated: 0,
};

/// A module in memory, from which instances are made.
#[derive(Debug)]
pub struct Module {
    pub(crate) module: wasmi::Module,
}

impl Module {
    /// Checks a module and gets it ready to run; its functions are compiled when they are first called.
    ///
    /// # Errors
    /// Where it is no sound module, or needs an extension of WebAssembly that is not taken; says why.
    pub fn new(bytes: &[u8]) -> Result<Self, String> {
        if has_bytes_of_no_function(bytes) {
            return Err(
                "its code cannot be run here: bytes of functions, and no function".to_owned()
            );
        }
        COMPILED.fetch_add(1, Ordering::Relaxed);
        let mut config = Config::default();
        config
            .consume_fuel(true)
            .fuel_cost(COSTS)
            .ignore_custom_sections(true)
            .enforced_limits(EnforcedLimits::strict())
            .wasm_multi_memory(false)
            .wasm_custom_page_sizes(false)
            .set_max_recursion_depth(MAX_RECURSION)
            .set_max_stack_height(MAX_STACK_BYTES);
        // An engine of its own: the lists of an engine grow with every module and are never emptied.
        let engine = Engine::new(&config);
        // Strangers' bytes shall not end the program, whatever else the interpreter's reader takes for granted. Engine
        // and module are dropped after a panic.
        let compile = std::panic::AssertUnwindSafe(|| wasmi::Module::new(&engine, bytes));
        let Ok(compiled) = std::panic::catch_unwind(compile) else {
            return Err("its code cannot be run here: it is damaged".to_owned());
        };
        let module = compiled.map_err(|error| {
            format!("its code cannot be run here: {}", one_line(&error.to_string()))
        })?;
        Ok(Self { module })
    }
}

/// Whether a section of code has bytes but no function: the interpreter divides the one by the other.
fn has_bytes_of_no_function(bytes: &[u8]) -> bool {
    Parser::new(0)
        .parse_all(bytes)
        .map_while(Result::ok)
        .any(|payload| matches!(payload, Payload::CodeSectionStart { count: 0, size: 2.., .. }))
}
