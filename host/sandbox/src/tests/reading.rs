//! What modules say of themselves without being run.

use super::{manifest, module};
use crate::{MAX_MODULE_LEN, Module, Unfit, is_module, read};

fn line(bytes: &[u8]) -> String {
    read(bytes, |_| false).err().map(|unfit| unfit.to_string()).unwrap_or_default()
}

#[test]
fn a_manifest_is_read_out_of_its_section() {
    let whole = module("");
    assert!(is_module(&whole));
    assert_eq!(read(&whole, |_| false).unwrap(), manifest());
    // A manifest that names formats needs their functions, which this has not.
    let lacks = read(&whole, |_| true).unwrap_err();
    assert!(matches!(lacks, Unfit::Lacks("SURFELSHOP_FORMATS", _)), "{lacks}");
}

/// Every cut of a small module, and bytes of it that are changed: refused in a line, or read; never a panic. Costs
/// some milliseconds.
#[test]
fn cut_and_damaged_modules_are_refused_in_a_line() {
    let whole = module("");
    // Behind the manifest are only names for people, which may be missing.
    let manifest = manifest();
    let at = whole.windows(manifest.len()).position(|bytes| bytes == manifest).unwrap();
    for len in 4..at + manifest.len() {
        assert_ne!(line(&whole[..len]), "", "accepted with {len} of {} bytes", whole.len());
    }
    let cut = line(&whole[..40]);
    assert!(cut.contains("is damaged or cut off") && !cut.contains('\n'), "{cut}");
    let magic = line(b"\0as\x02\x01\0\0\0");
    assert!(magic.contains("magic header not detected") && !magic.contains('\n'), "{magic}");
    let mut changed = whole.clone();
    for i in 0..whole.len() {
        for value in [0, 1, 0x7f, 0x80, 0xff] {
            changed[i] = value;
            if read(&changed, |_| false).is_ok() {
                drop(Module::new(&changed)); // Any answer is right as long as there is one.
            }
        }
        changed[i] = whole[i];
    }
}

#[test]
fn what_is_no_plugin_is_refused_by_name() {
    let refused = |text: &str| line(&wat::parse_str(text).unwrap());
    let found = refused("(module (import \"wasi_snapshot_preview1\" \"fd_write\" (func)))");
    assert!(found.starts_with("imports `wasi_snapshot_preview1.fd_write`"), "{found}");
    let found = refused("(module (import \"a\\n\" \"b\\u{202e}\" (memory 1)))");
    assert!(found.starts_with("imports `a?.b? (a memory)`"), "{found}");
    assert!(refused("(module)").contains("it has no section `surfelshop.manifest`"));
    let found = refused("(module (@custom \"surfelshop.manifest\" \"\"))");
    assert!(found.starts_with("does not export `memory`"), "{found}");
    let two =
        "(module (@custom \"surfelshop.manifest\" \"\") (@custom \"surfelshop.manifest\" \"\"))";
    assert!(refused(two).starts_with("has 2 sections"));
    let found =
        refused("(module (memory (export \"memory\") 1) (@custom \"surfelshop.manifest\" \"\"))");
    assert!(found.contains("--export-table"), "{found}");
    let long = vec![0; MAX_MODULE_LEN as usize + 1];
    assert!(line(&long).contains("33554433 bytes, at most 33554432"), "{}", line(&long));
}

/// Extensions that the sandbox does without are refused when the module is compiled.
#[test]
fn extensions_that_are_not_taken_are_named() {
    let vectors = "(module (func (result v128) (v128.const i64x2 0 0)))";
    let found = Module::new(&wat::parse_str(vectors).unwrap()).unwrap_err();
    assert!(found.contains("SIMD"), "{found}");
    let wide = Module::new(&wat::parse_str("(module (memory i64 1))").unwrap()).unwrap_err();
    assert!(wide.contains("memory64"), "{wide}");
}

/// The interpreter panics at such a section (wasmi 2.0.0: it divides the section's bytes by its functions).
#[test]
fn code_without_functions_is_refused() {
    let mut bytes = b"\0asm\x01\0\0\0".to_vec();
    // Section 10 of 2,001 bytes: no functions, and zeros.
    bytes.extend([10, 0xd1, 0x0f]);
    bytes.extend([0; 2001]);
    let found = Module::new(&bytes).unwrap_err();
    assert!(found.contains("no function"), "{found}");
}
