//! The memo: the one place that decides what has to be made again.
//!
//! Whatever takes time is a [`Step`]: loading a file, fitting threads, blurring a map, uploading, compiling. A step has a [`Key`] made of
//! all that its output is a function of, and a way to make it. Asking a [`Round`] for a step finds its output in memory, else on disk,
//! else makes it. So a frame asks for all that it needs each time, and only what has changed is made.
//!
//! The memo owns nothing. Outputs live as long as someone holds them: a round holds what was asked of it, and [`Round::held`] hands that
//! on to whoever needs it for the next round, such as the scene on a device that was made of it. What the latest round did not ask for is let go with
//! the round before.
mod disk;
mod files;
mod key;

pub use disk::{Stored, default_folder};
pub use key::{Key, KeyBuilder};

use crate::error::Result;
use crate::progress::Observer;
use files::Files;
use rayon::prelude::*;
use std::any::Any;
use std::cell::RefCell;
use std::collections::HashMap;
use std::ops::Deref;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError, Weak};
use std::time::{Duration, Instant};

/// Something that takes time to make.
pub trait Step {
    /// What is made.
    type Output: Send + Sync + 'static;

    /// What it is called, in a word or two, while it is made. Part of no key.
    const NAME: &'static str;

    /// The key of the output.
    ///
    /// # Errors
    /// A file that cannot be read: contents are part of keys.
    fn key(&self, memo: &Memo) -> Result<Key>;

    /// Makes the output. What it needs of other steps it asks `round` for.
    ///
    /// # Errors
    /// Whatever goes wrong; [`crate::Error::Cancelled`] if the round's observer has had enough.
    fn make(&self, round: &Round) -> Result<Self::Output>;

    /// What other steps know the output by, where that is not [`Self::key`]: its contents. So what is kept on disk is made again when
    /// another version of the program reads the same file otherwise, or makes other built-ins.
    fn content_key(&self, _output: &Self::Output) -> Option<Key> {
        None
    }

    /// How the output is kept on disk; none for what is as quickly made.
    fn stored(&self) -> Option<Stored<'_, Self::Output>> {
        None
    }
}

/// An output and its key.
#[derive(Debug)]
pub struct Keyed<T> {
    /// Of equal key are only equal outputs.
    pub key: Key,
    output: Arc<T>,
}

impl<T> Keyed<T> {
    /// `output` under `key`.
    pub fn new(key: Key, output: T) -> Self {
        Self { key, output: Arc::new(output) }
    }
}

impl<T> Clone for Keyed<T> {
    fn clone(&self) -> Self {
        Self { key: self.key, output: self.output.clone() }
    }
}

impl<T> Deref for Keyed<T> {
    type Target = T;
    fn deref(&self) -> &T {
        &self.output
    }
}

type Output = Arc<dyn Any + Send + Sync>;

/// Knows which outputs are in memory and where they are on disk.
#[derive(Default)]
pub struct Memo {
    folder: Option<PathBuf>,
    known: Mutex<HashMap<Key, Weak<dyn Any + Send + Sync>>>,
    files: Files,
    /// What files of these contents name: see [`Memo::file_named_in`].
    named: Mutex<HashMap<(PathBuf, Key), Option<PathBuf>>>,
}

/// Where an output came from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    /// It was in memory.
    Memory,
    /// It was on disk.
    Disk,
    /// It was made.
    Made,
}

/// What became of one step that a round was asked for.
#[derive(Clone, Copy, Debug)]
pub struct Asked {
    /// Name of the step.
    pub step: &'static str,
    /// Where its output came from.
    pub origin: Origin,
    /// How long that took.
    pub time: Duration,
}

/// What keeps outputs in memory.
#[derive(Clone, Default)]
pub struct Held(#[allow(dead_code)] Vec<Output>);

impl Memo {
    /// A memo that keeps what takes long in `folder`, if there is one.
    pub fn new(folder: Option<&Path>) -> Self {
        Self { folder: folder.map(Path::to_owned), ..Self::default() }
    }

    /// The folder in which it keeps what takes long.
    pub fn folder(&self) -> Option<&Path> {
        self.folder.as_deref()
    }

    /// Begins to ask for what belongs together, such as all that a frame needs. `observer` sees what is made, and may end it.
    pub fn round<'r>(&'r self, observer: &'r dyn Observer) -> Round<'r> {
        Round { memo: self, observer, within: None, held: RefCell::default(), asked: RefCell::default() }
    }

    /// The key of the contents of the file at `path`, as they were when this was first asked, or after [`Self::look_again`].
    ///
    /// # Errors
    /// A file that cannot be read.
    pub fn file_key(&self, path: &Path) -> Result<Key> {
        self.files.key(path)
    }

    /// The contents that [`Self::file_key`] is the key of.
    ///
    /// # Errors
    /// A file that cannot be read, or has been changed since.
    pub fn file_bytes(&self, path: &Path) -> Result<Vec<u8>> {
        self.files.bytes(path)
    }

    /// The file that the one at `path` names, by `find` in the contents that [`Self::file_key`] is the key of; found once for these.
    ///
    /// # Errors
    /// A file that cannot be read, or has been changed since.
    pub fn file_named_in(&self, path: &Path, find: impl FnOnce(&[u8]) -> Option<PathBuf>) -> Result<Option<PathBuf>> {
        let named = || self.named.lock().unwrap_or_else(PoisonError::into_inner);
        let key = (path.to_owned(), self.file_key(path)?);
        if let Some(found) = named().get(&key) {
            return Ok(found.clone());
        }
        let found = self.files.look(path, find)?;
        named().insert(key, found.clone());
        Ok(found)
    }

    /// The file at `path` is read anew where its key is asked for next: someone has named it again.
    pub fn look_again(&self, path: &Path) {
        self.files.forget(path);
    }

    /// The file at `path` counts as it was when its key was `key`, as long as nobody names it again: what it has by now cannot be used.
    pub fn set_file_key(&self, path: &Path, key: Key) {
        self.files.set_key(path, key);
    }

    /// Contents that were read for their key are read again where they are needed.
    pub fn let_go_of_files(&self) {
        self.files.release();
    }

    /// How many outputs are in memory.
    pub fn outputs_in_memory(&self) -> usize {
        let known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        known.values().filter(|output| output.strong_count() > 0).count()
    }

    fn find(&self, key: Key) -> Option<Output> {
        self.known.lock().unwrap_or_else(PoisonError::into_inner).get(&key)?.upgrade()
    }

    fn remember(&self, key: Key, output: &Output) {
        let mut known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        // What was let go leaves only its key, but an hour of editing makes many of them.
        known.retain(|_, output| output.strong_count() > 0);
        known.insert(key, Arc::downgrade(output));
    }
}

/// An output, where it came from, and how long that took.
struct Found<T> {
    output: Arc<T>,
    origin: Origin,
    time: Duration,
}

/// What of a round makes outputs, on any thread.
#[derive(Clone, Copy)]
struct Maker<'r> {
    memo: &'r Memo,
    observer: &'r dyn Observer,
    within: Option<&'static str>,
}

impl Maker<'_> {
    fn make<S: Step>(&self, step: &S, key: Key) -> Result<Found<S::Output>> {
        let start = Instant::now();
        self.observer.begin(S::NAME);
        // What is only needed on the way is let go at its end.
        let output = step.make(&Round { within: Some(S::NAME), ..self.memo.round(self.observer) })?;
        if let Some(name) = self.within {
            self.observer.begin(name);
        }
        if let Some((stored, folder)) = step.stored().zip(self.memo.folder()) {
            stored.write(folder, key, &output);
        }
        Ok(Found { output: Arc::new(output), origin: Origin::Made, time: start.elapsed() })
    }
}

/// Asks a memo for what belongs together, and holds it.
pub struct Round<'r> {
    memo: &'r Memo,
    observer: &'r dyn Observer,
    /// The step that asks for others while it is made.
    within: Option<&'static str>,
    held: RefCell<HashMap<Key, Output>>,
    asked: RefCell<Vec<Asked>>,
}

impl<'r> Round<'r> {
    /// The output of `step`: from memory, from disk, or made now.
    ///
    /// # Errors
    /// Those of the step; cancelled.
    pub fn ask<S: Step>(&self, step: &S) -> Result<Keyed<S::Output>> {
        let key = self.key_of(step)?;
        match self.find(step, key) {
            Some(output) => Ok(output),
            None => Ok(self.hold(step, key, self.maker().make(step, key)?)),
        }
    }

    /// The outputs of `steps`, as of [`Self::ask`]; those that have to be made are made side by side.
    ///
    /// # Errors
    /// Those of any of the steps; cancelled.
    pub fn ask_all<S: Step + Sync>(&self, steps: &[S]) -> Result<Vec<Keyed<S::Output>>> {
        let keys = steps.iter().map(|step| self.key_of(step)).collect::<Result<Vec<_>>>()?;
        let mut outputs = HashMap::new();
        let mut missing = Vec::new();
        for (step, &key) in steps.iter().zip(&keys) {
            if outputs.contains_key(&key) || missing.iter().any(|&(_, other)| other == key) {
                continue;
            }
            match self.find(step, key) {
                Some(output) => _ = outputs.insert(key, output),
                None => missing.push((step, key)),
            }
        }
        let maker = self.maker();
        let made = missing.par_iter().map(|&(step, key)| maker.make(step, key)).collect::<Result<Vec<_>>>()?;
        for ((step, key), found) in missing.into_iter().zip(made) {
            outputs.insert(key, self.hold(step, key, found));
        }
        Ok(keys.iter().map(|key| outputs[key].clone()).collect())
    }

    /// The output of `step` if it is in memory or on disk; it is not made.
    ///
    /// # Errors
    /// A step that has no key; cancelled.
    pub fn known<S: Step>(&self, step: &S) -> Result<Option<Keyed<S::Output>>> {
        Ok(self.find(step, self.key_of(step)?))
    }

    /// Two steps of different outputs have no key in common.
    fn key_of<S: Step>(&self, step: &S) -> Result<Key> {
        self.observer.check()?;
        Ok(Key::builder(std::any::type_name::<S::Output>()).key(step.key(self.memo)?).build())
    }

    fn find<S: Step>(&self, step: &S, key: Key) -> Option<Keyed<S::Output>> {
        let start = Instant::now();
        let found = |output, origin| Found { output, origin, time: start.elapsed() };
        if let Some(output) = self.memo.find(key).and_then(|output| output.downcast().ok()) {
            return Some(self.hold(step, key, found(output, Origin::Memory)));
        }
        let output = step.stored()?.read(self.memo.folder()?, key)?;
        Some(self.hold(step, key, found(Arc::new(output), Origin::Disk)))
    }

    fn maker(&self) -> Maker<'r> {
        Maker { memo: self.memo, observer: self.observer, within: self.within }
    }

    /// Holds what was found of `step`, and notes where it came from.
    fn hold<S: Step>(&self, step: &S, key: Key, found: Found<S::Output>) -> Keyed<S::Output> {
        let Found { output, origin, time } = found;
        let held: Output = output.clone();
        if origin != Origin::Memory {
            self.memo.remember(key, &held);
            tracing::debug!("{}: {origin:?}, {:.1} ms", S::NAME, time.as_secs_f64() * 1e3);
        }
        self.held.borrow_mut().insert(key, held);
        self.asked.borrow_mut().push(Asked { step: S::NAME, origin, time });
        Keyed { key: step.content_key(&output).unwrap_or(key), output }
    }

    /// The memo.
    pub fn memo(&self) -> &'r Memo {
        self.memo
    }

    /// Who watches.
    pub fn observer(&self) -> &'r dyn Observer {
        self.observer
    }

    /// What became of each step called `name`, in the order in which they were asked for.
    pub fn asked(&self, name: &str) -> Vec<Asked> {
        self.asked.borrow().iter().filter(|asked| asked.step == name).copied().collect()
    }

    /// Names of the steps whose outputs had to be made or read from disk, each once, in order.
    pub fn made(&self) -> Vec<&'static str> {
        let mut names = Vec::new();
        for asked in self.asked.borrow().iter().filter(|asked| asked.origin != Origin::Memory) {
            if !names.contains(&asked.step) {
                names.push(asked.step);
            }
        }
        names
    }

    /// Keeps in memory what was asked for, for as long as this or a clone of it lives.
    pub fn held(&self) -> Held {
        self.memo.let_go_of_files();
        Held(self.held.borrow().values().cloned().collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Error;

    /// Its own number, and whether it is kept on disk.
    struct Number(u64, bool);

    impl Step for Number {
        type Output = u64;
        const NAME: &'static str = "number";

        fn key(&self, _: &Memo) -> Result<Key> {
            Ok(Key::builder("number").number(self.0).build())
        }

        fn make(&self, _: &Round) -> Result<u64> {
            if self.0 == 13 { Err(Error::input("13", "is refused", "use another")) } else { Ok(self.0) }
        }

        fn stored(&self) -> Option<Stored<'_, u64>> {
            self.1.then(|| Stored {
                extension: "number",
                read: Box::new(|path| {
                    let text = std::fs::read_to_string(path).map_err(|cause| Error::unreadable(path, cause))?;
                    text.parse().map_err(|_| Error::in_file(path, "is damaged", "it is made again"))
                }),
                write: Box::new(|path, number: &u64| crate::files::write_whole(path, number.to_string().as_bytes())),
            })
        }
    }

    fn origin(round: &Round, step: &Number) -> Origin {
        assert_eq!(*round.ask(step).unwrap(), step.0);
        round.asked("number").last().unwrap().origin
    }

    #[test]
    fn an_output_is_found_in_memory_as_long_as_someone_holds_it() {
        let memo = Memo::default();
        let first = memo.round(&());
        assert_eq!(origin(&first, &Number(1, false)), Origin::Made);
        assert_eq!(origin(&first, &Number(1, false)), Origin::Memory);
        let held = first.held();
        drop(first);
        assert_eq!(origin(&memo.round(&()), &Number(1, false)), Origin::Memory);
        drop(held);
        assert_eq!(memo.outputs_in_memory(), 0);
        assert_eq!(origin(&memo.round(&()), &Number(1, false)), Origin::Made);
    }

    #[test]
    fn what_is_known_is_in_memory_or_on_disk() {
        let folder = tempfile::tempdir().unwrap();
        let memo = Memo::new(Some(folder.path()));
        let round = memo.round(&());
        assert!(round.known(&Number(1, true)).unwrap().is_none() && round.asked("number").is_empty());
        round.ask(&Number(1, true)).unwrap();
        assert_eq!(*round.known(&Number(1, true)).unwrap().unwrap(), 1);
        drop(round);
        let round = Memo::new(Some(folder.path()));
        let round = round.round(&());
        assert_eq!(*round.known(&Number(1, true)).unwrap().unwrap(), 1);
        assert_eq!(round.asked("number")[0].origin, Origin::Disk);
    }

    #[test]
    fn what_is_asked_for_at_once_is_each_made_once_and_given_in_order() {
        let memo = Memo::default();
        let round = memo.round(&());
        round.ask(&Number(2, false)).unwrap();
        let numbers = [3, 1, 2, 3, 1].map(|number| Number(number, false));
        let outputs = round.ask_all(&numbers).unwrap();
        assert_eq!(outputs.iter().map(|output| **output).collect::<Vec<_>>(), [3, 1, 2, 3, 1]);
        let origins = round.asked("number").iter().map(|asked| asked.origin).collect::<Vec<_>>();
        assert_eq!(origins, [Origin::Made, Origin::Memory, Origin::Made, Origin::Made]);
        assert_eq!(memo.outputs_in_memory(), 3);
        assert!(round.ask_all(&[4, 13].map(|number| Number(number, false))).is_err());
    }

    #[test]
    fn what_the_next_round_does_not_ask_for_is_let_go() {
        let memo = Memo::default();
        let mut held = Held::default();
        for number in 20..220 {
            let round = memo.round(&());
            round.ask(&Number(1000, false)).unwrap();
            round.ask(&Number(number, false)).unwrap();
            held = round.held();
        }
        assert_eq!(memo.outputs_in_memory(), 2);
        drop(held);
        assert_eq!(memo.outputs_in_memory(), 0);
    }

    #[test]
    fn what_is_kept_on_disk_is_found_there_and_damage_is_mended() {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path().join("made/on/demand");
        let ask = |number| origin(&Memo::new(Some(&folder)).round(&()), &Number(number, true));
        assert_eq!([ask(1), ask(1), ask(2)], [Origin::Made, Origin::Disk, Origin::Made]);
        for file in std::fs::read_dir(&folder).unwrap() {
            std::fs::write(file.unwrap().path(), "not a number").unwrap();
        }
        assert_eq!([ask(1), ask(1)], [Origin::Made, Origin::Disk]);
    }

    #[test]
    fn an_unwritable_folder_and_things_that_are_no_files_are_no_matter() {
        let folder = tempfile::tempdir().unwrap();
        let occupied = folder.path().join("file");
        std::fs::write(&occupied, "").unwrap();
        assert_eq!(origin(&Memo::new(Some(&occupied)).round(&()), &Number(1, true)), Origin::Made);
        let ask = || origin(&Memo::new(Some(folder.path())).round(&()), &Number(1, true));
        assert_eq!(ask(), Origin::Made);
        let entries = || std::fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().path());
        let file = entries().find(|path| path.extension().is_some()).unwrap();
        std::fs::remove_file(&file).unwrap();
        std::fs::create_dir(&file).unwrap();
        assert_eq!([ask(), ask()], [Origin::Made, Origin::Disk], "a folder in its place is put away");
        #[cfg(unix)]
        {
            std::fs::remove_file(&file).unwrap();
            let made = std::process::Command::new("mkfifo").arg(&file).status();
            if made.is_ok_and(|status| status.success()) {
                assert_eq!([ask(), ask()], [Origin::Made, Origin::Disk], "nobody waits for a pipe");
            }
        }
    }

    #[test]
    fn a_failure_leaves_nothing_behind() {
        let folder = tempfile::tempdir().unwrap();
        let memo = Memo::new(Some(folder.path()));
        assert!(memo.round(&()).ask(&Number(13, true)).is_err());
        assert_eq!((memo.outputs_in_memory(), std::fs::read_dir(folder.path()).unwrap().count()), (0, 0));
    }

    #[test]
    fn a_round_that_is_cancelled_makes_nothing() {
        struct Never;
        impl Observer for Never {
            fn progress(&self, _: usize, _: usize) {}
            fn cancelled(&self) -> bool {
                true
            }
        }
        let memo = Memo::default();
        assert!(matches!(memo.round(&Never).ask(&Number(1, false)), Err(Error::Cancelled)));
    }
}
