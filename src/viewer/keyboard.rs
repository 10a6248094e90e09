//! The keyboard: what keys ask for, whatever its layout.
use super::input::Input;
use winit::keyboard::{Key, KeyCode, ModifiersState, NamedKey, PhysicalKey};

/// Names of the keys that write no character.
const NAMED: [(NamedKey, &str); 3] =
    [(NamedKey::Space, "space"), (NamedKey::Home, "home"), (NamedKey::Escape, "escape")];

/// Whether inputs call a key so, whatever it does.
pub fn is_key(name: &str) -> bool {
    let is_typed = |typed: u8| typed.is_ascii_graphic() && !typed.is_ascii_uppercase();
    matches!(name.as_bytes(), [typed] if is_typed(*typed)) || NAMED.iter().any(|(_, named)| *named == name)
}

/// What a pressed key asks for, which means `logical` and is at `physical`, with what is `held` down beside it. One that is held down itself
/// `repeats`.
pub fn input_of(logical: &Key, physical: PhysicalKey, repeats: bool, held: ModifiersState) -> Option<Input> {
    let key = name_of(logical, physical)?;
    let shift = held.shift_key();
    // Command on macOS.
    let control = [ModifiersState::CONTROL, ModifiersState::SUPER].contains(&(held - ModifiersState::SHIFT));
    match key.as_str() {
        "z" if control && !shift => return Some(Input::Undo),
        "z" if control => return Some(Input::Redo),
        "y" if control && !shift => return Some(Input::Redo),
        _ => {}
    }
    // Some layouts have brackets only with Alt (Option).
    let (may_be_held, steps) = match key.as_str() {
        "[" | "]" => (ModifiersState::SHIFT | ModifiersState::ALT, true),
        "+" | "=" | "-" => (ModifiersState::SHIFT, true),
        _ => (ModifiersState::SHIFT, false),
    };
    // What is switched on and off would flicker.
    (may_be_held.contains(held) && (steps || !repeats)).then_some(Input::Key(key))
}

/// A key as inputs name it.
fn name_of(logical: &Key, physical: PhysicalKey) -> Option<String> {
    let name = match logical {
        Key::Character(text) if text.is_ascii() => return Some(text.to_lowercase()).filter(|name| is_key(name)),
        // Keyboards of other scripts have Latin letters printed beside theirs.
        Key::Character(_) => match physical {
            PhysicalKey::Code(KeyCode::KeyB) => "b",
            PhysicalKey::Code(KeyCode::KeyF) => "f",
            PhysicalKey::Code(KeyCode::KeyT) => "t",
            PhysicalKey::Code(KeyCode::KeyY) => "y",
            PhysicalKey::Code(KeyCode::KeyZ) => "z",
            _ => return None,
        },
        Key::Named(named) => NAMED.iter().find(|(key, _)| key == named)?.1,
        _ => return None,
    };
    Some(name.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    const NONE: ModifiersState = ModifiersState::empty();

    /// What the key that writes `text` asks for, at the place of `code`.
    fn typed(text: &str, code: KeyCode, repeats: bool, held: ModifiersState) -> Option<Input> {
        input_of(&Key::Character(text.into()), PhysicalKey::Code(code), repeats, held)
    }

    fn key(name: &str) -> Option<Input> {
        Some(Input::Key(name.to_owned()))
    }

    #[test]
    fn what_is_held_down_steps_on_but_does_not_switch_to_and_fro() {
        for (text, code) in [("t", KeyCode::KeyT), ("b", KeyCode::KeyB), ("f", KeyCode::KeyF)] {
            assert_eq!(typed(text, code, false, NONE), key(text));
            assert_eq!(typed(text, code, true, NONE), None);
        }
        for (text, code) in [("+", KeyCode::NumpadAdd), ("-", KeyCode::Minus), ("]", KeyCode::BracketRight)] {
            assert_eq!(typed(text, code, true, NONE), key(text));
        }
        assert_eq!(typed("z", KeyCode::KeyZ, true, ModifiersState::CONTROL), Some(Input::Undo));
    }

    #[test]
    fn letters_are_found_on_keyboards_of_any_script() {
        assert_eq!(typed("е", KeyCode::KeyT, false, NONE), key("t"));
        assert_eq!(typed("Я", KeyCode::KeyZ, false, ModifiersState::CONTROL), Some(Input::Undo));
        assert_eq!(typed("ö", KeyCode::Semicolon, false, NONE), None);
        // Where letters are Latin, they are where they are written.
        assert_eq!(typed("z", KeyCode::KeyY, false, ModifiersState::CONTROL), Some(Input::Undo));
        assert_eq!(typed("T", KeyCode::KeyK, false, ModifiersState::SHIFT), key("t"));
    }

    #[test]
    fn brackets_are_typed_with_alt_and_other_keys_are_not() {
        let alt = ModifiersState::ALT;
        assert_eq!(typed("[", KeyCode::Digit5, false, alt), key("["));
        assert_eq!(typed("]", KeyCode::Digit6, false, alt | ModifiersState::SHIFT), key("]"));
        assert_eq!(typed("t", KeyCode::KeyT, false, alt), None);
        assert_eq!(typed("[", KeyCode::BracketLeft, false, ModifiersState::CONTROL), None);
    }

    #[test]
    fn keys_that_do_nothing_are_keys_and_other_words_are_none() {
        for name in ["f", "q", "0", "[", "space", "home", "escape"] {
            assert!(is_key(name), "{name}");
        }
        for name in ["", "nope", "F", "ö", " ", "\n"] {
            assert!(!is_key(name), "{name:?}");
        }
        assert_eq!(typed("q", KeyCode::KeyQ, false, NONE), key("q"));
        assert_eq!(typed("^q", KeyCode::KeyQ, false, NONE), None);
    }

    #[test]
    fn undo_and_redo_have_the_shortcuts_of_every_platform() {
        let (control, command, shift) = (ModifiersState::CONTROL, ModifiersState::SUPER, ModifiersState::SHIFT);
        for held in [control, command] {
            assert_eq!(typed("z", KeyCode::KeyZ, false, held), Some(Input::Undo));
            assert_eq!(typed("Z", KeyCode::KeyZ, false, held | shift), Some(Input::Redo));
            assert_eq!(typed("y", KeyCode::KeyY, false, held), Some(Input::Redo));
        }
        let named = input_of(&Key::Named(NamedKey::Home), PhysicalKey::Code(KeyCode::Home), false, NONE);
        assert_eq!(named, key("home"));
    }
}
