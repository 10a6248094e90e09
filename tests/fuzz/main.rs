//! Any bytes in the place of a file: an answer or a reason on one line that names the file, within a second, in memory that is bounded
//! by the file's size. No panic.
//!
//! A reader's seeds are whole files that code makes. They are changed at random; what is answered in a new way is changed further, so
//! that changes get past the first checks. `THREADLIGHT_FUZZ_RUNS` is the number of runs of each reader, in the place of as many as a second takes, and
//! `THREADLIGHT_FUZZ_SEED` a number from which others follow. What a reader does not survive is left in `target/fuzz`.
#[path = "../common/mod.rs"]
mod common;
mod mutation;
mod outside;
mod readers;

use std::collections::HashSet;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use mutation::Mutator;
use peak_alloc::PeakAlloc;
use readers::Reader;

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// Memory and time are those of one reader.
static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());

/// How long the runs of a reader last where their number is not given.
const SHORT: Duration = Duration::from_millis(1000);

/// How long a run may last.
const MOST: Duration = Duration::from_secs(1);

/// What any reader may allocate, for messages and tables of its own.
const FREE_BYTES: usize = 1 << 16;

/// Files that answered in a new way, at most.
const MAX_CORPUS: usize = 200;

fn variable(name: &str) -> Option<u64> {
    std::env::var(name).ok().map(|text| text.parse().unwrap_or_else(|_| panic!("{name} has to be a number")))
}

/// How long this thread has had a processor, by the first number of Linux's file; 0 on other systems.
fn processor_time() -> Duration {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    Duration::from_nanos(text.split(' ').next().and_then(|number| number.parse().ok()).unwrap_or_default())
}

/// What `reader` answers to `bytes`; the error is what it did wrong.
fn answer(reader: &Reader, bytes: &[u8]) -> Result<String, String> {
    let path = Path::new(reader.file_name);
    let before = MEMORY.current_usage();
    MEMORY.reset_peak_usage();
    let start = Instant::now();
    let read = catch_unwind(AssertUnwindSafe(|| (reader.read)(path, bytes)));
    let (time, most) = (start.elapsed(), MEMORY.peak_usage().saturating_sub(before));
    let answer = read.map_err(|_| "panicked".to_owned())?;
    let allowed = reader.bytes_per_byte * bytes.len() + FREE_BYTES;
    if most > allowed {
        return Err(format!("took {most} bytes of memory for {} of a file, more than {allowed}", bytes.len()));
    }
    // On a machine that does something else, a run may wait: what counts is the time on the processor.
    if time > MOST {
        let start = processor_time();
        let _ = (reader.read)(path, bytes);
        let time = processor_time().saturating_sub(start);
        if time > MOST {
            return Err(format!("took {time:?}"));
        }
    }
    if let Err(reason) = &answer
        && (!reason.contains(reader.file_name) || reason.contains(['\n', '\r']))
    {
        return Err(format!("refused with a reason that names no file or has many lines: {reason:?}"));
    }
    // Answers are the same if they differ only in numbers and in what they quote.
    Ok(match answer {
        Ok(()) => "read".to_owned(),
        Err(reason) => {
            let unquoted: String = reason.split(['`', '"', '\'']).step_by(2).collect();
            unquoted.chars().filter(|letter| letter.is_ascii_alphabetic()).take(100).collect()
        }
    })
}

fn fuzz(reader: &Reader) {
    let _alone = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
    let runs = variable("THREADLIGHT_FUZZ_RUNS");
    let mut mutator = Mutator::new(variable("THREADLIGHT_FUZZ_SEED").unwrap_or(1));
    let mut corpus = (reader.seeds)();
    let mut answers = HashSet::new();
    for seed in &corpus {
        let answer = answer(reader, seed).unwrap_or_else(|wrong| panic!("{}: a seed {wrong}", reader.file_name));
        assert_eq!(answer, "read", "{}: a seed is no whole file", reader.file_name);
        answers.insert(answer);
    }
    // Of large seeds a few changes take all of the time, so what is left of them counts as much.
    let are_large = corpus.iter().any(|seed| seed.len() > 1 << 20);
    let whole_seeds = if are_large { 0 } else { corpus.len() };
    let start = Instant::now();
    let (mut count, mut whole) = (0, 0);
    while runs.map_or_else(|| start.elapsed() < SHORT, |runs| count < runs) {
        let mut bytes = mutator.change(&corpus, whole_seeds, reader.words);
        if let Some(seal) = reader.seal
            && mutator.below(8) > 0
        {
            seal(&mut bytes);
        }
        count += 1;
        match answer(reader, &bytes) {
            Ok(answer) => {
                whole += u64::from(answer == "read");
                if answers.insert(answer) && corpus.len() < MAX_CORPUS {
                    corpus.push(bytes);
                }
            }
            Err(wrong) => {
                let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/fuzz");
                let path = folder.join(format!("{count}-{}", reader.file_name));
                std::fs::create_dir_all(&folder).and_then(|()| std::fs::write(&path, &bytes)).expect("target/fuzz");
                panic!("{} {wrong}: see {}", reader.file_name, path.display());
            }
        }
    }
    println!("{}: {count} runs, {whole} files read, {} answers", reader.file_name, answers.len());
    assert!(count > 0);
}

macro_rules! readers {
    ($($(#[$condition:meta])? $module:ident::$name:ident,)+) => {
        $($(#[$condition])?
        #[test]
        fn $name() {
            fuzz(&$module::$name());
        })+
    };
}
readers! {
    readers::merl_table,
    readers::rgl_file,
    readers::mit_file,
    readers::utia_file,
    readers::material,
    readers::mesh,
    readers::hdr_environment,
    readers::exr_environment,
    readers::scene,
    readers::threads,
    readers::pyramid,
    readers::moments,
    readers::kept_reference,
    readers::device_verdict,
    #[cfg(feature = "viewer")]
    readers::replay,
    readers::png_picture,
    readers::measurements,
    outside::evaluated_angles,
    outside::evaluated_directions,
    outside::pipeline_cache,
}
