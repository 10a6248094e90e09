//! What the user does, as data: the window makes these of its events, and `--replay` reads them from a file.
//!
//! # Replay files
//!
//! One event a line, in JSON; empty lines and lines that begin with `#` are skipped. Pixels are physical, count from the top left of the
//! window's picture, and may have fractions.
//!
//! | line | what the user does |
//! |---|---|
//! | `{"drag": {"button": "left", "from": [320, 240], "by": [40, -10]}}` | drags the mouse; `"button"` is `left` (orbit), `middle` or `right` (pan); with `"shift": true` a left drag pans, with `"control": true` it turns the environment |
//! | `{"move": [320, 240]}` | moves the cursor there |
//! | `{"scroll": {"lines": 3}}`, `{"scroll": {"pixels": -40}}` | scrolls a wheel or a touchpad, forwards if positive |
//! | `{"key": "f"}` | presses and releases a key: what it writes, in lower case, or `"space"`, `"home"` or `"escape"` |
//! | `{"drop": "material.binary"}` | drops a file on the window |
//! | `{"resize": [800, 600]}` | gives the window's picture this size |
//! | `{"minimise": true}`, `{"minimise": false}` | minimises and restores the window |
//! | `{"set": {"exposure": 2}}` | changes a setting in the panel: any [`Change`] |
//! | `{"compare": "reference"}`, `{"compare": {"shading": {"method": "paper", "threads": 64}}}` | compares the picture with the reference, or with another method or number of threads; `{"compare": null}` ends that |
//! | `{"wipe": 0.5}` | drags the line between two compared pictures: 0 is the left edge, 1 the right one |
//! | `{"heat_map": true}` | shows where the two differ in the place of the other picture, or no longer |
//! | `"undo"`, `"redo"` | takes back what was last set or dropped, and does it again; the camera stays where it is, but where a whole scene is taken back |
//! | `"wait"` | waits until all background work is done and its frame drawn; an error after `--replay-limit` seconds |
//! | `{"save_picture": "x.png"}`, `{"save_scene": "x.toml"}` | saves; a picture is waited for until its threads are finished, as `"wait"` does |
//! | `"quit"` | closes the window |
//!
//! Paths are relative to the folder of the replay file. A setting is named as in `{"set": {"material": {"builtin": "silver"}}}`,
//! `{"set": {"material": {"file": "x.binary"}}}`, `{"set": {"one_material": {"material": "left", "source": {"builtin": "silver"}}}}`,
//! `{"set": {"parameter": {"material": "gold", "key": "alpha", "value": 0.3}}}`,
//! `{"set": {"environment": {"builtin": "sun"}}}`, `{"set": {"mesh": {"file": "x.obj"}}}`, `{"set": {"method": "paper"}}`,
//! `{"set": {"threads": 64}}`, `{"set": {"size": [320, 240]}}`, `{"set": {"rotation": 90}}`, `{"set": {"camera": null}}`.
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::change::Change;
use super::comparison::Other;
use crate::brdf::{Brdf, resolve_base_files};
use crate::environment::Environment;
use crate::error::{Error, Result};
use crate::files::{self, FileKind};
use crate::scene::{MaterialSource, Mesh, Scene, Source};

/// Something that the user does.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Input {
    /// The mouse was dragged.
    Drag(Drag),
    /// The cursor is there, in pixels.
    Move([f64; 2]),
    /// A wheel or a touchpad scrolled.
    Scroll(Scroll),
    /// A key was pressed: in lower case, `space` and the like by name.
    Key(String),
    /// A file was dropped on the window.
    Drop(PathBuf),
    /// The window's picture has this many columns and rows.
    Resize(u32, u32),
    /// The window was minimised or restored.
    Minimise(bool),
    /// A setting was changed.
    Set(Change),
    /// Compare the picture with another one; none ends that.
    Compare(Option<Other>),
    /// The line between two compared pictures is there, from 0 at the left edge to 1.
    Wipe(f64),
    /// Show where the two differ in the place of the other picture, or no longer.
    HeatMap(bool),
    /// Take back what was last set or dropped.
    Undo,
    /// Do again what was taken back.
    Redo,
    /// Go on when all background work is done and has been drawn.
    Wait,
    /// Save the picture, once its threads are finished.
    SavePicture(PathBuf),
    /// Save the scene.
    SaveScene(PathBuf),
    /// Close the window.
    Quit,
}

/// A part of a drag, or a whole one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Drag {
    /// What is held down.
    pub button: Button,
    /// Where it began, in pixels.
    pub from: [f64; 2],
    /// How far the cursor moved, in pixels.
    pub by: [f64; 2],
    /// Whether Shift is held down.
    #[serde(default)]
    pub shift: bool,
    /// Whether Ctrl is held down (Command on macOS).
    #[serde(default)]
    pub control: bool,
}

/// A button of the mouse.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Button {
    /// The first.
    Left,
    /// The wheel.
    Middle,
    /// The second.
    Right,
}

/// How far a wheel or a touchpad scrolled; positive away from the user.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Scroll {
    /// Notches of a wheel.
    Lines(f64),
    /// Pixels of a touchpad, at a scale of the display of 1.
    Pixels(f64),
}

/// What a drag does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DragAction {
    /// Turns the camera around its target.
    Orbit,
    /// Moves the camera along the image.
    Pan,
    /// Turns the environment.
    TurnEnvironment,
}

impl Drag {
    /// What it does: see the module's table.
    pub fn action(&self) -> DragAction {
        match self {
            Self { button: Button::Left, control: true, .. } => DragAction::TurnEnvironment,
            Self { button: Button::Left, shift: false, .. } => DragAction::Orbit,
            _ => DragAction::Pan,
        }
    }
}

/// The events of the replay file at `path`, their paths made relative to where the program runs.
///
/// # Errors
/// The file cannot be read; the first line that is no event, by its number.
pub fn read_replay(path: &Path) -> Result<Vec<Input>> {
    let bytes = files::read(path)?;
    parse_replay(files::text(path, &bytes)?, path)
}

/// The events in the text of the replay file at `path`.
///
/// # Errors
/// A line that is no event.
pub fn parse_replay(text: &str, path: &Path) -> Result<Vec<Input>> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let lines = text.lines().enumerate().map(|(index, line)| (index + 1, line.trim()));
    let events = lines.filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
    let parse = |(number, line): (usize, &str)| {
        let input = serde_json::from_str::<Input>(line).map_err(|cause| {
            // The position is that within the one line that serde_json saw.
            let cause = cause.to_string();
            let cause = cause.split(" at line ").next().unwrap_or(&cause);
            let problem = format!("line {number} (`{line}`): {cause}");
            Error::in_file(path, problem, "the guide has all that a line can be, in src/viewer/input.rs")
        })?;
        input.relative_to(folder)
    };
    events.map(parse).collect()
}

impl Input {
    /// Whether the picture is another one by it.
    pub fn changes_picture(&self) -> bool {
        matches!(self, Self::Drag(_) | Self::Scroll(_) | Self::Set(_))
    }

    /// The same with paths that begin at `folder`, those of bases under coats too.
    fn relative_to(mut self, folder: &Path) -> Result<Self> {
        match &mut self {
            Self::Drop(path)
            | Self::SavePicture(path)
            | Self::SaveScene(path)
            | Self::Set(
                Change::Material(MaterialSource::File(path))
                | Change::OneMaterial { source: MaterialSource::File(path), .. }
                | Change::Environment(Source::File(path))
                | Change::Mesh(Source::File(path)),
            ) => *path = folder.join(&*path),
            Self::Set(
                Change::Material(MaterialSource::Model { parameters, .. })
                | Change::OneMaterial { source: MaterialSource::Model { parameters, .. }, .. },
            ) => resolve_base_files(parameters, folder)?,
            Self::Set(Change::Parameter { key, value, .. }) => {
                let last = key.rsplit('.').next().unwrap_or(key);
                let mut parameters = toml::Table::from_iter([(last.to_owned(), value.clone())]);
                resolve_base_files(&mut parameters, folder)?;
                *value = parameters.remove(last).unwrap_or_else(|| value.clone());
            }
            _ => {}
        }
        Ok(self)
    }
}

/// The change that a dropped file asks for, by its extension and its content.
///
/// # Errors
/// An extension of no format.
pub fn change_of_dropped(path: &Path) -> Result<Dropped> {
    let file = || PathBuf::from(path);
    let candidates = [
        candidate(&Brdf::FILES, path, Dropped::Change(Change::Material(MaterialSource::File(file())))),
        candidate(&Environment::FILES, path, Dropped::Change(Change::Environment(Source::File(file())))),
        candidate(&Mesh::FILES, path, Dropped::Change(Change::Mesh(Source::File(file())))),
        candidate(&Scene::FILES, path, Dropped::Scene(file())),
    ];
    let mut candidates: Vec<_> = candidates.into_iter().flatten().collect();
    // The content tells apart what has the same extension.
    if candidates.len() > 1 {
        let bytes = files::read(path)?;
        candidates.retain(|candidate| (candidate.is_of_format)(&bytes));
    }
    candidates.into_iter().next().map(|candidate| candidate.dropped).ok_or_else(|| {
        let kinds = [
            ("a material", Brdf::FILES.extensions()),
            ("an environment", Environment::FILES.extensions()),
            ("a mesh", Mesh::FILES.extensions()),
            ("a scene", Scene::FILES.extensions()),
        ];
        let kinds = kinds.map(|(what, extensions)| format!("{what} ({extensions})")).join(", ");
        Error::in_file(path, "is of no kind that can be dropped here", format!("drop {kinds}"))
    })
}

/// What a dropped file may be.
struct Candidate {
    is_of_format: fn(&[u8]) -> bool,
    dropped: Dropped,
}

/// `dropped`, if the file at `path` has an extension of `kind`.
fn candidate<T>(kind: &FileKind<T>, path: &Path, dropped: Dropped) -> Option<Candidate> {
    let is_of_format = kind.format_of(path).ok()?.is_of_format;
    Some(Candidate { is_of_format, dropped })
}

/// What a dropped file is.
#[derive(Clone, Debug, PartialEq)]
pub enum Dropped {
    /// A part of the scene.
    Change(Change),
    /// A whole scene.
    Scene(PathBuf),
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Vec<Input>> {
        parse_replay(text, Path::new("/replays/a.jsonl"))
    }

    #[test]
    fn every_line_of_the_documentation_is_read_and_written_back() {
        let documentation = include_str!("input.rs");
        let documented = documentation.lines().filter(|line| line.starts_with("//! "));
        // What stands in back quotes and looks like an event.
        let quoted: Vec<_> = documented
            .flat_map(|line| line.split('`').skip(1).step_by(2))
            .filter(|text| text.starts_with('{') || ["\"wait\"", "\"quit\"", "\"undo\"", "\"redo\""].contains(text))
            .collect();
        assert!(quoted.len() > 20, "{quoted:?}");
        for text in quoted {
            let events = parse(text).unwrap();
            let [event] = &events[..] else { panic!("{text}: {events:?}") };
            let written = serde_json::to_string(event).unwrap();
            assert_eq!(serde_json::from_str::<Input>(&written).unwrap(), *event, "{written}");
        }
    }

    #[test]
    fn comments_are_skipped_and_paths_begin_at_the_file() {
        let events = parse("# a comment\n\n{\"drop\": \"x.obj\"}\n  \"wait\"\n{\"save_scene\": \"/tmp/y.toml\"}\n{\"set\": {\"material\": {\"file\": \"m.binary\"}}}").unwrap();
        let material = Change::Material(MaterialSource::File("/replays/m.binary".into()));
        let expected = [
            Input::Drop("/replays/x.obj".into()),
            Input::Wait,
            Input::SaveScene("/tmp/y.toml".into()),
            Input::Set(material),
        ];
        assert_eq!(events, expected);
        assert_eq!(parse("").unwrap(), []);
    }

    #[test]
    fn bases_of_a_replay_are_beside_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.jsonl");
        let coat = r#""coat": {"alpha": 0.1, "ior": 1.5}"#;
        let text = format!(
            r#"{{"set": {{"material": {{"model": {{"model": "layered", "parameters": {{"base": "base.toml", {coat}}}}}}}}}}}
{{"set": {{"parameter": {{"material": "m", "key": "base", "value": "base.toml"}}}}}}"#
        );
        std::fs::write(&path, text).unwrap();
        let beside = toml::Value::from(folder.path().join("base.toml").to_str().unwrap());
        let events = read_replay(&path).unwrap();
        let [
            Input::Set(Change::Material(MaterialSource::Model { parameters, .. })),
            Input::Set(Change::Parameter { value, .. }),
        ] = &events[..]
        else {
            panic!("{events:?}")
        };
        assert_eq!((&parameters["base"], value), (&beside, &beside));
    }

    #[test]
    fn errors_name_the_file_and_the_line() {
        for (text, what) in [
            ("\"wait\"\n{\"drag\": 3}", "line 2"),
            ("\"wait\"\n\n\"wiat\"", "wiat"),
            ("{\"set\": {\"exposur\": 3}}", "exposur"),
            ("{\"set\": {\"exposure\": \"much\"}}", "line 1"),
            ("{\"drag\": {\"button\": \"left\", \"from\": [0, 0], \"by\": [1]}}", "line 1"),
            ("{\"drag\": {\"button\": \"left\", \"from\": [0, 0], \"by\": [1, 1], \"alt\": true}}", "alt"),
            ("{\"key\": \"f\"", "line 1"),
            ("{\"key\": \"f\"} {\"key\": \"g\"}", "line 1"),
            ("{\"resize\": [-1, 3]}", "line 1"),
            ("{\"scroll\": {\"lines\": NaN}}", "line 1"),
        ] {
            let error = parse(text).unwrap_err().to_string();
            assert!(error.contains(what) && error.contains("a.jsonl") && !error.contains('\n'), "{text}: {error}");
        }
        assert!(read_replay(Path::new("missing.jsonl")).unwrap_err().to_string().contains("missing.jsonl"));
    }

    #[test]
    fn modifiers_and_buttons_choose_what_a_drag_does() {
        let drag = Drag { button: Button::Left, from: [0.0; 2], by: [1.0; 2], shift: false, control: false };
        assert_eq!(drag.action(), DragAction::Orbit);
        assert_eq!(Drag { shift: true, ..drag }.action(), DragAction::Pan);
        assert_eq!(Drag { control: true, ..drag }.action(), DragAction::TurnEnvironment);
        assert_eq!(Drag { button: Button::Middle, ..drag }.action(), DragAction::Pan);
        assert_eq!(Drag { button: Button::Right, ..drag }.action(), DragAction::Pan);
    }

    #[test]
    fn a_dropped_file_is_what_its_name_and_content_say() {
        let folder = tempfile::tempdir().unwrap();
        let file = |name: &str, text: &str| {
            std::fs::write(folder.path().join(name), text).unwrap();
            folder.path().join(name)
        };
        let material = file("m.toml", "model = 'lambert'\nreflectance = 0.5");
        let scene = file("s.toml", "[image]\nwidth = 3");
        let change = |change| Dropped::Change(change);
        for (path, expected) in [
            (PathBuf::from("x.BINARY"), change(Change::Material(MaterialSource::File("x.BINARY".into())))),
            ("x.hdr".into(), change(Change::Environment(Source::File("x.hdr".into())))),
            ("x.exr".into(), change(Change::Environment(Source::File("x.exr".into())))),
            ("x.obj".into(), change(Change::Mesh(Source::File("x.obj".into())))),
            (material.clone(), change(Change::Material(MaterialSource::File(material)))),
            (scene.clone(), Dropped::Scene(scene)),
        ] {
            assert_eq!(change_of_dropped(&path).unwrap(), expected);
        }
        for (path, what) in [("x.png", "x.png"), ("x", "drop a material"), ("absent.toml", "absent.toml")] {
            assert!(change_of_dropped(Path::new(path)).unwrap_err().to_string().contains(what));
        }
    }
}
