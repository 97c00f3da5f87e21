//! Modules as they are compiled.

use crate::stop::one_line;
use std::sync::atomic::{AtomicUsize, Ordering};
use wasmi::{Config, CustomFuelCosts, EnforcedLimits, Engine};
use wasmparser::{Parser, Payload};

/// How deep the calls of a module may go.
const MAX_RECURSION: usize = 10_000;
/// Most bytes of values on the stack of a call.
const MAX_STACK_BYTES: usize = 4 << 20;

/// Most variables of a function: clearing them at each call costs no steps. Compilers need some hundreds.
const MAX_VARIABLES: u64 = 2000;

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
        if let Some(why) = code_that_is_not_taken(bytes) {
            return Err(format!("its code cannot be run here: {why}"));
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

/// Why code is not taken that the interpreter would take: bytes of functions and no function, by whose number it divides, and
/// functions of very many variables. What else is wrong with a module the interpreter says.
fn code_that_is_not_taken(bytes: &[u8]) -> Option<String> {
    Parser::new(0).parse_all(bytes).map_while(Result::ok).find_map(|payload| match payload {
        Payload::CodeSectionStart { count: 0, size: 2.., .. } => {
            Some("bytes of functions, and no function".to_owned())
        }
        Payload::CodeSectionEntry(body) => {
            let variables = body.get_locals_reader().into_iter().flatten().map_while(Result::ok);
            let n: u64 = variables.map(|(n, _)| u64::from(n)).sum();
            (n > MAX_VARIABLES)
                .then(|| format!("a function has {n} variables, at most {MAX_VARIABLES} are taken"))
        }
        _ => None,
    })
}
