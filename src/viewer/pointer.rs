//! The pointer: where it is, and what is held down over the picture.
use super::input::{Button, Drag};
use winit::event::MouseButton;

/// The pointer in the window.
#[derive(Debug, Default)]
pub struct Pointer {
    /// Where it is, in pixels.
    pub at: [f64; 2],
    held: Option<Held>,
}

/// A button that is held down.
#[derive(Debug)]
struct Held {
    button: Button,
    /// Where it was pressed.
    from: [f64; 2],
    /// Whether the pointer has moved since.
    has_moved: bool,
}

impl Pointer {
    /// `button` is pressed over the picture: it drags from here, unless another one does already.
    pub fn press(&mut self, button: Button) {
        let from = self.at;
        self.held.get_or_insert(Held { button, from, has_moved: false });
    }

    /// `button` is released; gives whether that ends a drag.
    pub fn release(&mut self, button: Button) -> bool {
        self.held.take_if(|held| held.button == button).is_some()
    }

    /// The window does not hear of releases any more; gives whether that ends a drag.
    pub fn let_go(&mut self) -> bool {
        self.held.take().is_some()
    }

    /// It moves there; gives the part of a drag that this is.
    pub fn move_to(&mut self, to: [f64; 2], shift: bool, control: bool) -> Option<Drag> {
        let from = std::mem::replace(&mut self.at, to);
        let by = [to[0] - from[0], to[1] - from[1]];
        let held = self.held.as_mut().filter(|_| by != [0.0; 2])?;
        held.has_moved = true;
        Some(Drag { button: held.button, from: held.from, by, shift, control })
    }

    /// Whether it is dragging.
    pub fn is_dragging(&self) -> bool {
        self.held.as_ref().is_some_and(|held| held.has_moved)
    }
}

/// A button that can drag, as inputs name it.
pub fn button_of(button: MouseButton) -> Option<Button> {
    match button {
        MouseButton::Left => Some(Button::Left),
        MouseButton::Middle => Some(Button::Middle),
        MouseButton::Right => Some(Button::Right),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_drag_is_of_the_button_that_was_pressed_first_and_ends_with_it() {
        let mut pointer = Pointer::default();
        assert_eq!(pointer.move_to([10.0, 20.0], false, false), None);
        pointer.press(Button::Left);
        assert!(pointer.move_to([10.0, 20.0], false, false).is_none() && !pointer.is_dragging());
        pointer.press(Button::Right);
        assert!(!pointer.release(Button::Right));
        let drag = Drag { button: Button::Left, from: [10.0, 20.0], by: [3.0, -4.0], shift: true, control: false };
        assert_eq!(pointer.move_to([13.0, 16.0], true, false), Some(drag));
        assert!(pointer.is_dragging());
        assert!(pointer.release(Button::Left) && !pointer.is_dragging());
        assert_eq!(pointer.move_to([0.0, 0.0], false, false), None);
    }

    #[test]
    fn a_drag_ends_where_the_window_hears_no_more() {
        let mut pointer = Pointer::default();
        pointer.press(Button::Middle);
        assert!(pointer.let_go() && !pointer.let_go());
        assert_eq!(pointer.move_to([5.0, 5.0], false, false), None);
    }
}
