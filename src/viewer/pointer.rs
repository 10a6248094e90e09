//! The pointer: where it is, what is held down over the picture, and how far wheels and touchpads scroll.
use super::input::{Button, Drag, Scroll};
use winit::event::{MouseButton, MouseScrollDelta};

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

/// How far was scrolled on a display of this scale: a touchpad says it in pixels, of which the same motion has more on a finer display.
pub fn scroll_of(delta: MouseScrollDelta, scale: f64) -> Scroll {
    match delta {
        MouseScrollDelta::LineDelta(_, lines) => Scroll::Lines(f64::from(lines)),
        MouseScrollDelta::PixelDelta(pixels) => Scroll::Pixels(pixels.to_logical::<f64>(scale).y),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use winit::dpi::PhysicalPosition;

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

    #[test]
    fn a_touchpad_scrolls_as_far_on_a_finer_display() {
        let pixels = |y: f64| MouseScrollDelta::PixelDelta(PhysicalPosition::new(0.0, y));
        assert_eq!(scroll_of(pixels(30.0), 1.0), Scroll::Pixels(30.0));
        assert_eq!(scroll_of(pixels(60.0), 2.0), Scroll::Pixels(30.0));
        assert_eq!(scroll_of(MouseScrollDelta::LineDelta(1.0, -2.0), 2.0), Scroll::Lines(-2.0));
    }
}
