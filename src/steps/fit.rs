//! Makes the threads of a BRDF, drafts of them, and the split sum.
use crate::Result;
use crate::brdf::Brdf;
use crate::error::Error;
use crate::memo::{Key, Keyed, Memo, Round, Step, Stored};
use crate::threads::fitted::draft;
use crate::threads::{FORMAT_VERSION, SplitSum, ThreadSettings, Threads, generate, read, write};

/// Makes the threads of `brdf`. They are kept on disk as the `.threads` files that users write.
pub struct FitThreads<'a> {
    /// Of what.
    pub brdf: &'a Keyed<Brdf>,
    /// Which.
    pub settings: ThreadSettings,
}

impl Step for FitThreads<'_> {
    type Output = Threads;
    const NAME: &'static str = "threads";

    fn key(&self, _: &Memo) -> Result<Key> {
        let ThreadSettings { kind, count, rows, seed, sets } = self.settings;
        // A fit draws nothing.
        let seed = if kind.are_kernels() { 0 } else { seed };
        let key = Key::builder(kind.name()).key(self.brdf.key).number(FORMAT_VERSION);
        Ok(key.number(count as u64).number(rows as u64).number(seed).number(sets as u64).build())
    }

    fn make(&self, round: &Round) -> Result<Threads> {
        let Self { brdf, settings } = self;
        generate(brdf, settings, round.observer())
    }

    fn stored(&self) -> Option<Stored<'_, Threads>> {
        let ThreadSettings { kind, count, rows, .. } = self.settings;
        Some(Stored {
            extension: "threads",
            read: Box::new(move |path| match read(path)? {
                threads if (threads.kind(), threads.size()) == (kind, [rows, count]) => Ok(threads),
                _ => Err(Error::in_file(path, "holds threads of another kind", "they are made again")),
            }),
            write: Box::new(|path, threads| write(threads, path)),
        })
    }
}

/// Makes threads of `brdf` that continue others at once, in the place of those that take longer.
pub struct DraftThreads<'a> {
    /// Of what.
    pub brdf: &'a Keyed<Brdf>,
    /// Of a BRDF that is like it, fitted or a draft themselves.
    pub before: &'a Keyed<Threads>,
}

impl Step for DraftThreads<'_> {
    type Output = Threads;
    const NAME: &'static str = "draft";

    fn key(&self, _: &Memo) -> Result<Key> {
        Ok(Key::builder("draft").key(self.brdf.key).key(self.before.key).build())
    }

    fn make(&self, round: &Round) -> Result<Threads> {
        match &**self.before {
            Threads::Fitted(before) => Ok(Threads::Fitted(draft(self.brdf, before, round.observer())?)),
            _ => Err(Error::input("threads", "of this kind are not drafted", "make them")),
        }
    }
}

/// Fits the split sum to a BRDF.
pub struct FitSplitSum<'a>(pub &'a Keyed<Brdf>);

impl Step for FitSplitSum<'_> {
    type Output = SplitSum;
    const NAME: &'static str = "split sum";

    fn key(&self, _: &Memo) -> Result<Key> {
        Ok(self.0.key)
    }

    fn make(&self, _: &Round) -> Result<SplitSum> {
        Ok(SplitSum::new(self.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::memo::Origin;
    use crate::scene::MaterialSource;
    use crate::steps::LoadMaterial;
    use crate::threads::ThreadKind;

    const SETTINGS: ThreadSettings = ThreadSettings { kind: ThreadKind::Paper, count: 4, rows: 3, seed: 1, sets: 1 };

    fn ask(material: &str, settings: ThreadSettings, folder: &std::path::Path) -> (Threads, Origin) {
        let memo = Memo::new(Some(folder));
        let round = memo.round(&());
        let brdf = round.ask(&LoadMaterial(&MaterialSource::Builtin(material.into()))).unwrap();
        let threads = round.ask(&FitThreads { brdf: &brdf, settings }).unwrap();
        ((*threads).clone(), round.asked(FitThreads::NAME)[0].origin)
    }

    #[test]
    fn the_second_time_they_are_on_disk_and_any_other_question_makes_others() {
        let folder = tempfile::tempdir().unwrap();
        let ask = |material, settings| ask(material, settings, folder.path());
        let (threads, origin) = ask("clay", SETTINGS);
        assert_eq!(origin, Origin::Made);
        assert_eq!(ask("clay", SETTINGS), (threads, Origin::Disk));
        for settings in [
            ThreadSettings { kind: ThreadKind::Fitted, ..SETTINGS },
            ThreadSettings { count: 5, ..SETTINGS },
            ThreadSettings { rows: 4, ..SETTINGS },
            ThreadSettings { seed: 2, ..SETTINGS },
        ] {
            assert_eq!(ask("clay", settings).1, Origin::Made, "{settings:?}");
        }
        assert_eq!(ask("gold", SETTINGS).1, Origin::Made);
    }

    #[test]
    fn drafts_that_continue_other_threads_are_others() {
        let memo = Memo::default();
        let round = memo.round(&());
        let brdf = round.ask(&LoadMaterial(&MaterialSource::Builtin("clay".into()))).unwrap();
        let [first, second] = [4, 5].map(|count| {
            let before =
                round.ask(&FitThreads { brdf: &brdf, settings: ThreadSettings { count, ..SETTINGS } }).unwrap();
            DraftThreads { brdf: &brdf, before: &before }.key(&memo).unwrap()
        });
        assert_ne!(first, second);
    }

    #[test]
    fn threads_of_another_size_in_their_place_are_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let file = |folder: &std::path::Path| std::fs::read_dir(folder).unwrap().next().unwrap().unwrap().path();
        let (threads, _) = ask("clay", SETTINGS, folder.path());
        let other = tempfile::tempdir().unwrap();
        ask("clay", ThreadSettings { count: 5, ..SETTINGS }, other.path());
        std::fs::copy(file(other.path()), file(folder.path())).unwrap();
        assert_eq!(ask("clay", SETTINGS, folder.path()), (threads.clone(), Origin::Made));
        assert_eq!(ask("clay", SETTINGS, folder.path()), (threads, Origin::Disk));
    }
}
