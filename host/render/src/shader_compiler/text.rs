//! Bounds on a text before it is composed: what makes the composer itself take minutes or gigabytes.
//!
//! Its time grows with the square of an expression's length, and it writes a constant out wherever it is used,
//! so that twenty arrays of two of the one before are a million numbers.

use crate::shader_compiler::compose::ShaderError;
use crate::shader_compiler::tokens::{Token, tokens};
use std::collections::HashMap;
use surfelshop_api::graph::Module;

/// Longest text of a shader with its modules, in bytes.
const MAX_BYTES: usize = 256 << 10;

/// Most `else` of a shader: each nests the next one deeper, in drivers' compilers too, whose stack is not ours
/// to choose.
const MAX_ELSE: usize = 1_000;

/// Most words and operators of a statement; numbers do not count, so that tables may be long. A sum of 4,096
/// terms takes the composer half a second on one core. The longest statement of this project has 178.
const MAX_STATEMENT: usize = 8_192;

/// Most brackets within each other. The front end stops at some thousand with no word of the reason.
const MAX_BRACKETS: usize = 256;

/// Most values that constants are written out as, over all places that name them: the composer takes about 110
/// bytes for each.
const MAX_VALUES: u64 = 1 << 20;

/// Refuses what takes the composer too long, with the line and, of a module, its file.
pub(super) fn check(source: &str, modules: &[Module]) -> Result<(), ShaderError> {
    let texts = || modules.iter().map(|module| module.wgsl.as_str()).chain([source]);
    let n_bytes: usize = texts().map(str::len).sum();
    if n_bytes > MAX_BYTES {
        return Err(ShaderError::new(format!(
            "the shader has {n_bytes} bytes, at most {MAX_BYTES} are compiled"
        )));
    }
    let n_else: usize = texts().map(|text| text.matches("else").count()).sum();
    if n_else > MAX_ELSE {
        return Err(ShaderError::new(format!(
            "the shader has {n_else} `else`, at most {MAX_ELSE} are compiled"
        )));
    }
    for module in modules {
        check_statements(&module.wgsl)
            .map_err(|error| ShaderError::new(format!("{}, {}", module.file, error.message)))?;
    }
    check_statements(source)?;
    Constants::of(texts()).check(texts())
}

fn check_statements(text: &str) -> Result<(), ShaderError> {
    // Where the statement that is read begins, and its words and operators.
    let (mut begin, mut length) = (0, 0usize);
    // Of each condition of the composer that is open: the length before it, and the largest of its branches so
    // far. Any branch may be left out, and an end of a statement with it.
    let mut conditions: Vec<(usize, usize)> = Vec::new();
    let mut brackets = 0usize;
    let at_line = |at: usize| text[..at].matches('\n').count() + 1;
    for (at, token) in tokens(text) {
        match token {
            Token::Mark(';' | '{' | '}') => (length, brackets) = (0, 0),
            Token::Directive(line) => {
                let word = line[1..].trim_start();
                if word.starts_with("if") {
                    conditions.push((length, length));
                } else if word.starts_with("else") {
                    if let Some((before, largest)) = conditions.last_mut() {
                        *largest = length.max(*largest);
                        length = *before;
                    }
                } else if word.starts_with("endif") {
                    let (_, largest) = conditions.pop().unwrap_or_default();
                    length = length.max(largest);
                }
            }
            Token::Number | Token::Mark(',') => {}
            Token::Word(_) | Token::Mark(_) => {
                if length == 0 {
                    begin = at;
                }
                length += 1;
                match token {
                    Token::Mark('(' | '[') => brackets += 1,
                    Token::Mark(')' | ']') => brackets = brackets.saturating_sub(1),
                    _ => {}
                }
            }
        }
        if length > MAX_STATEMENT {
            return Err(ShaderError::new(format!(
                "line {}: a statement has more than {MAX_STATEMENT} words and operators; split it",
                at_line(begin)
            )));
        }
        if brackets > MAX_BRACKETS {
            return Err(ShaderError::new(format!(
                "line {}: more than {MAX_BRACKETS} brackets within each other; split the statement",
                at_line(at)
            )));
        }
    }
    Ok(())
}

/// The names that each constant is made of; constants of one name in several places are taken for one.
struct Constants<'a> {
    made_of: HashMap<&'a str, Vec<&'a str>>,
    values: HashMap<&'a str, u64>,
}

impl<'a> Constants<'a> {
    fn of(texts: impl Iterator<Item = &'a str>) -> Self {
        let mut made_of: HashMap<&str, Vec<&str>> = HashMap::new();
        for text in texts {
            let mut all = tokens(text).map(|(_, token)| token);
            while let Some(token) = all.next() {
                if token != Token::Word("const") {
                    continue;
                }
                let Some(Token::Word(name)) = all.next() else { continue };
                let names = made_of.entry(name).or_default();
                let value = all.by_ref().take_while(|token| *token != Token::Mark(';'));
                names.extend(value.filter_map(|token| match token {
                    Token::Word(word) => Some(word),
                    _ => None,
                }));
            }
        }
        Self { made_of, values: HashMap::new() }
    }

    fn check(mut self, texts: impl Iterator<Item = &'a str>) -> Result<(), ShaderError> {
        let mut all = 0u64;
        for (_, token) in texts.flat_map(tokens) {
            let Token::Word(name) = token else { continue };
            if self.made_of.contains_key(name) {
                all = all.saturating_add(self.values_of(name));
            }
            if all > MAX_VALUES {
                return Err(ShaderError::new(format!(
                    "constant `{name}` and those before it are more than {MAX_VALUES} values, written out \
                     wherever one is named; use fewer or a buffer"
                )));
            }
        }
        Ok(())
    }

    /// Values of a constant with all that it names; one for a name that is no constant. As deep as names go:
    /// to be called on a large stack.
    fn values_of(&mut self, name: &'a str) -> u64 {
        if let Some(known) = self.values.get(name) {
            return *known;
        }
        let Some(names) = self.made_of.get(name).cloned() else { return 1 };
        // One that names itself is refused by the front end.
        self.values.insert(name, 1);
        let each = names.iter().map(|name| self.values_of(name));
        let n = each.fold(1, u64::saturating_add);
        self.values.insert(name, n);
        n
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shader_compiler::on_large_stack;

    fn refused(text: &str) -> String {
        on_large_stack(|| check(text, &[])).unwrap().err().map(|e| e.message).unwrap_or_default()
    }

    #[test]
    fn long_statements_are_refused_with_their_line() {
        let sum = |n: usize| format!("fn f() {{\n let y = {};}}", vec!["x"; n].join("+"));
        assert_eq!(refused(&sum(4_000)), "");
        assert!(refused(&sum(4_200)).starts_with("line 2: a statement has more than 8192 words"));
        // Tables of numbers may be as long as the text.
        let table = vec!["1.5"; 20_000].join(",");
        assert_eq!(refused(&format!("const t = array({table});")), "");
    }

    #[test]
    fn ends_that_may_be_left_out_end_no_statement() {
        let parts = vec!["x+"; 3_000].concat();
        let left_out = format!("let y = {parts}\n#ifdef A\nx;\n#endif\n{parts}x;");
        assert!(refused(&left_out).contains("line 1: a statement"), "{}", refused(&left_out));
        let either = format!("let y = x\n#ifdef A\n+{parts}\n#else\n-{parts}\n#endif\nx;");
        assert_eq!(refused(&either), "");
        let in_both = format!("#ifdef A\nlet y={parts}x;\n#endif\nlet z={parts}x;");
        assert_eq!(refused(&in_both), "");
    }

    #[test]
    fn brackets_go_so_deep() {
        let nested = |n: usize| format!("let y = {}x{};", "(".repeat(n), ")".repeat(n));
        assert_eq!(refused(&nested(256)), "");
        assert!(refused(&nested(257)).contains("more than 256 brackets"));
        assert_eq!(refused(&vec!["(x)[1]"; 300].join(";")), "");
    }

    #[test]
    fn constants_that_double_are_refused_in_any_order() {
        let chain = |n: usize| -> Vec<String> {
            let next = |i: usize| format!("const a{} = array(a{i}, a{i});", i + 1);
            std::iter::once("const a0 = 1.0;".to_owned()).chain((0..n).map(next)).collect()
        };
        assert_eq!(refused(&chain(10).concat()), "");
        let mut long = chain(40);
        assert!(refused(&long.concat()).starts_with("constant `a"));
        long.reverse();
        assert!(refused(&long.concat()).starts_with("constant `a"));
        assert_eq!(refused("const a = b; const b = a;"), "");
    }
}
