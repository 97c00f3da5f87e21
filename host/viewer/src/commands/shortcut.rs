//! Shortcuts as they are written: `Ctrl+Shift+P`.

use eframe::egui::{Key, KeyboardShortcut, Modifiers};

pub(super) const fn key(key: Key) -> KeyboardShortcut {
    KeyboardShortcut::new(Modifiers::NONE, key)
}

pub(super) const fn ctrl(key: Key) -> KeyboardShortcut {
    KeyboardShortcut::new(Modifiers::COMMAND, key)
}

pub(super) const fn shift(key: Key) -> KeyboardShortcut {
    KeyboardShortcut::new(Modifiers::SHIFT, key)
}

pub(super) const fn alt(key: Key) -> KeyboardShortcut {
    KeyboardShortcut::new(Modifiers::ALT, key)
}

pub(super) const fn ctrl_shift(key: Key) -> KeyboardShortcut {
    KeyboardShortcut::new(Modifiers::COMMAND.plus(Modifiers::SHIFT), key)
}

/// Keys that move the camera while they are held, and those of the toolkit.
const RESERVED: [(Key, &str); 13] = [
    (Key::W, "flies forward"),
    (Key::A, "flies to the left"),
    (Key::S, "flies backward"),
    (Key::D, "flies to the right"),
    (Key::E, "flies up"),
    (Key::Q, "flies down"),
    (Key::Tab, "goes to the next control"),
    (Key::Enter, "presses the control that has the focus"),
    (Key::Escape, "closes what is open"),
    (Key::ArrowUp, "moves in lists"),
    (Key::ArrowDown, "moves in lists"),
    (Key::ArrowLeft, "changes the control that has the focus"),
    (Key::ArrowRight, "changes the control that has the focus"),
];

/// What a shortcut does that no command may have.
pub(super) fn reserved(shortcut: KeyboardShortcut) -> Option<&'static str> {
    let is_plain = !shortcut.modifiers.command && !shortcut.modifiers.alt;
    let found = RESERVED.iter().find(|(key, _)| *key == shortcut.logical_key);
    found.filter(|_| is_plain).map(|(_, what)| *what)
}

/// The text of a shortcut.
pub(crate) fn text(shortcut: KeyboardShortcut) -> String {
    let KeyboardShortcut { modifiers, logical_key } = shortcut;
    let parts = [
        (modifiers.command || modifiers.ctrl, "Ctrl+"),
        (modifiers.shift, "Shift+"),
        (modifiers.alt, "Alt+"),
    ];
    let mut text: String =
        parts.into_iter().filter(|(held, _)| *held).map(|(_, name)| name).collect();
    text += match logical_key {
        Key::Questionmark | Key::Comma | Key::OpenBracket | Key::CloseBracket => {
            logical_key.symbol_or_name()
        }
        key => key.name(),
    };
    text
}

/// Reads a shortcut.
pub(super) fn parse(text: &str) -> Result<KeyboardShortcut, String> {
    let wrong = || format!("expected a shortcut such as Ctrl+Shift+P, found `{text}`");
    let mut modifiers = Modifiers::NONE;
    let mut parts = text.split('+').map(str::trim).peekable();
    while let Some(part) = parts.next() {
        if parts.peek().is_none() {
            let named = Key::ALL
                .iter()
                .copied()
                .find(|key| key.name().eq_ignore_ascii_case(part) || key.symbol_or_name() == part);
            return named.map(|key| KeyboardShortcut::new(modifiers, key)).ok_or_else(wrong);
        }
        modifiers = match part.to_ascii_lowercase().as_str() {
            "ctrl" | "cmd" | "command" => modifiers.plus(Modifiers::COMMAND),
            "shift" => modifiers.plus(Modifiers::SHIFT),
            "alt" => modifiers.plus(Modifiers::ALT),
            _ => return Err(wrong()),
        };
    }
    Err(wrong())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shortcuts_are_read_as_they_are_written() {
        for shortcut in [
            key(Key::F1),
            key(Key::Questionmark),
            key(Key::OpenBracket),
            ctrl(Key::Comma),
            ctrl(Key::Plus),
            ctrl_shift(Key::P),
            alt(Key::Num3),
            shift(Key::R),
        ] {
            assert_eq!(parse(&text(shortcut)), Ok(shortcut), "{}", text(shortcut));
        }
        assert_eq!(text(ctrl_shift(Key::P)), "Ctrl+Shift+P");
        for wrong in ["", "Ctrl+", "Hyper+P", "Ctrl+Shift", "PP"] {
            assert!(parse(wrong).is_err(), "{wrong}");
        }
    }
}
