//! How calls into a module end that do not return.

use wasmi::TrapCode;
use wasmi::errors::ErrorKind;

/// Why a call into a module did not return.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Stop {
    /// Its code went wrong; says how.
    #[error("{0}")]
    Trapped(String),
    /// It broke the rules of the boundary.
    #[error("{0}")]
    Misbehaved(String),
    /// It was asked to stop and did not.
    #[error("did not end when it was asked to, and was stopped")]
    Cancelled,
    /// It cannot be done in the memory that a module may have, or with what was lent.
    #[error("{0}")]
    Impossible(String),
}

impl Stop {
    pub(crate) fn misbehaved(line: impl Into<String>) -> Self {
        Self::Misbehaved(line.into())
    }

    /// What the runtime says, in the words of people who do not know it.
    pub(crate) fn of(error: &wasmi::Error) -> Self {
        let line = match error.kind() {
            ErrorKind::TrapCode(code) => trap(*code).to_owned(),
            ErrorKind::Func(error) => {
                return Self::misbehaved(format!(
                    "one of its functions has other arguments than the interface says ({error}); Rust \
                     builds them so from 1.89 on"
                ));
            }
            ErrorKind::Host(_) => return Self::misbehaved("it passed on a function of the host"),
            ErrorKind::Memory(_) => "it needs more memory than a module may have".to_owned(),
            ErrorKind::Table(_) => "it needs a larger table than a module may have".to_owned(),
            _ => one_line(&error.to_string()),
        };
        Self::Trapped(line)
    }
}

fn trap(code: TrapCode) -> &'static str {
    match code {
        TrapCode::UnreachableCodeReached => "it gave up: its code reached `unreachable`",
        TrapCode::MemoryOutOfBounds => "it read or wrote outside its memory",
        TrapCode::TableOutOfBounds | TrapCode::IndirectCallToNull | TrapCode::BadSignature => {
            "it called a function that is none"
        }
        TrapCode::IntegerDivisionByZero => "it divided a whole number by zero",
        TrapCode::IntegerOverflow | TrapCode::BadConversionToInteger => {
            "it made a whole number of one that is too large"
        }
        TrapCode::StackOverflow => "its calls went too deep: a recursion without end?",
        TrapCode::OutOfFuel => "it ran for more steps than it may",
        TrapCode::GrowthOperationLimited => "it needs more memory than a module may have",
        TrapCode::OutOfSystemMemory => "there is no more memory",
    }
}

pub(crate) fn one_line(text: &str) -> String {
    let line = text.split_whitespace().collect::<Vec<_>>().join(" ");
    line.chars().take(400).map(|c| if c.is_control() { '?' } else { c }).collect()
}
