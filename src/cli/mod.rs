//! The command line: one file per subcommand.

mod bench;
mod compare;
mod completions;
mod devices;
mod materials;
mod nameable;
mod progress;
mod render;
mod rendered;
mod scene_flags;
pub mod signals;
mod threads;
#[cfg(feature = "viewer")]
mod view;

use anyhow::Context;
use clap::{Parser, Subcommand};
use std::io::{self, ErrorKind, IsTerminal, Write};
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use threadlight::low_level::memo::{Memo, default_folder};

const EXAMPLES: &str = "\
Examples:
  threadlight render -o image.png
  threadlight render --mesh dragon.obj --material gold.toml --environment studio.hdr -o dragon.png
  threadlight render scene.toml --size 1920x1080 --subpixels 3 -o scene.exr
  threadlight compare dragon.exr reference.exr --mask-background
  threadlight threads alumina-oxide.binary --count 100 -o alumina.threads --plot alumina.png
  threadlight materials

Exit codes: 0 done, 1 the machine could not, 2 the input was wrong, 130 cancelled.";

/// Renders measured and analytic BRDFs under HDR environment light, in real time and without noise.
#[derive(Parser)]
#[command(version, after_help = EXAMPLES, infer_subcommands = true)]
pub struct Arguments {
    /// Say more: -v what is done, -vv in detail.
    #[arg(short, long, global = true, action = clap::ArgAction::Count)]
    pub verbose: u8,
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Render(Box<render::Render>),
    #[cfg(feature = "viewer")]
    View(Box<view::ViewArguments>),
    Compare(compare::Compare),
    Bench(bench::Bench),
    Threads(threads::Threads),
    Materials(materials::Materials),
    Devices(devices::Devices),
    Completions(completions::Completions),
}

impl Arguments {
    /// Does what was asked.
    pub fn run(self) -> anyhow::Result<()> {
        match self.command {
            Command::Render(render) => render.run(),
            #[cfg(feature = "viewer")]
            Command::View(view) => view.run(),
            Command::Compare(compare) => compare.run(),
            Command::Bench(bench) => bench.run(),
            Command::Threads(threads) => threads.run(),
            Command::Materials(materials) => materials.run(),
            Command::Devices(devices) => devices.run(),
            Command::Completions(completions) => completions.run(),
        }
    }
}

/// An error if the validation layer has said anything.
fn none_of(messages: &[String]) -> anyhow::Result<()> {
    match messages.first() {
        Some(first) => {
            anyhow::bail!("validation: {} messages, the first: {}", messages.len(), first.replace('\n', " "))
        }
        None => Ok(()),
    }
}

/// What is wrong with the command line, on one line: clap's error and its tips, without the usage and what helps with no value here.
pub fn mistake(error: &clap::Error) -> String {
    if error.kind() == clap::error::ErrorKind::InvalidUtf8 {
        // It does not say where.
        let unreadable = std::env::args_os().filter(|argument| argument.to_str().is_none());
        let names = unreadable.map(|argument| format!("{argument:?}")).collect::<Vec<_>>().join(", ");
        return format!("{names}: is not UTF-8; give the file a name that is");
    }
    let text = error.to_string();
    let paragraphs = text.trim_start_matches("error: ").split("\n\n");
    let of_use = paragraphs
        .filter(|paragraph| !["Usage:", "For more", "  tip: to pass"].iter().any(|start| paragraph.starts_with(start)));
    let lines = of_use.map(|paragraph| paragraph.split_whitespace().collect::<Vec<_>>().join(" "));
    lines.collect::<Vec<_>>().join("; ") + "; see --help"
}

/// Says something on standard error. Where nobody listens any more, nothing is said, and the work goes on.
pub fn say(line: std::fmt::Arguments) {
    let _ = writeln!(io::stderr(), "{line}");
}

/// Prints `text` on standard output. Where nobody listens any more, as behind `head`, nothing is printed, and the work goes on.
fn print(text: impl std::fmt::Display) -> io::Result<()> {
    let mut out = io::stdout().lock();
    unless_unheard(write!(out, "{text}").and_then(|()| out.flush()))
}

/// `value` as JSON with a last line end, for this flag.
fn json(flag: &'static str, value: &impl serde::Serialize) -> anyhow::Result<String> {
    Ok(serde_json::to_string_pretty(value).context(flag)? + "\n")
}

/// What was `printed` into a pipe without a reader is no error.
pub fn unless_unheard(printed: io::Result<()>) -> io::Result<()> {
    printed.or_else(|cause| if cause.kind() == ErrorKind::BrokenPipe { Ok(()) } else { Err(cause) })
}

/// Sends the library's log to standard error; RUST_LOG overrides the flag, where it says anything.
pub fn start_logging(verbose: u8) {
    let level = ["warn,winit=error", "threadlight=info", "threadlight=debug"][usize::from(verbose.min(2))];
    let is_set = |name: &str| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    let asked = is_set("RUST_LOG").then(tracing_subscriber::EnvFilter::try_from_default_env);
    let filter = asked.and_then(Result::ok).unwrap_or_else(|| level.into());
    // As https://no-color.org has it.
    let is_plain = is_set("NO_COLOR") || std::env::var_os("TERM").is_some_and(|name| name == "dumb");
    tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(io::stderr)
        // It would tell of them on standard error, and end the program where that is what fails.
        .log_internal_errors(false)
        .with_ansi(io::stderr().is_terminal() && !is_plain)
        .without_time()
        .with_target(false)
        .init();
}

/// The folder that threads, blurred environments and pipelines are cached in; none with `--no-cache`.
fn cache_folder(no_cache: bool) -> Option<PathBuf> {
    (!no_cache).then(default_folder).flatten()
}

/// What commands ask for what takes long to make; with `--no-cache` it knows nothing of earlier runs, and leaves nothing to later ones.
fn memo(no_cache: bool) -> Memo {
    Memo::new(cache_folder(no_cache).as_deref())
}

/// Parses a number in `range`; the error is that it must be `what`.
fn number(range: RangeInclusive<f64>, what: &'static str) -> impl Fn(&str) -> Result<f64, String> + Clone {
    move |text| text.parse().ok().filter(|number| range.contains(number)).ok_or_else(|| format!("use {what}"))
}

/// Parses an error of display values: a picture that is wrong everywhere has 1.
fn display_error() -> impl Fn(&str) -> Result<f64, String> + Clone {
    number(f64::MIN_POSITIVE..=1.0, "a positive number up to 1")
}

/// The last part of a path, without its extension.
fn stem(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The words of a command as a shell has them, of those that have no quotes but double ones around whole words.
    fn words(command: &str) -> Vec<&str> {
        let in_and_out = command.split('"').enumerate();
        let words = in_and_out.flat_map(|(i, part)| match i % 2 {
            0 => part.split_whitespace().collect(),
            _ => vec![part],
        });
        words.collect()
    }

    /// The program's commands in the shell's blocks of a text.
    fn commands(text: &str) -> Vec<String> {
        let mut lines = text.lines();
        let mut commands = Vec::new();
        while lines.any(|line| line.starts_with("```sh")) {
            let block: Vec<&str> = lines.by_ref().take_while(|line| !line.starts_with("```")).collect();
            for line in block.join("\n").replace("\\\n", " ").lines() {
                let line = line.split("  #").next().unwrap_or_default();
                let parts = line.split(['|', ';']).flat_map(|part| part.split("&&")).map(str::trim);
                commands.extend(parts.filter(|part| part.starts_with("threadlight ")).map(str::to_owned));
            }
        }
        commands
    }

    #[test]
    fn commands_of_the_guide_are_understood() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR"));
        let chapters = std::fs::read_dir(root.join("src/guide")).expect("the guide's folder");
        let chapters = chapters.map(|entry| entry.expect("a readable folder").path());
        let mut count = 0;
        for path in chapters.chain([root.join("README.md")]) {
            let text = std::fs::read_to_string(&path).expect("a readable text");
            // The program may be built without its window.
            let is_here = |command: &String| cfg!(feature = "viewer") || !command.starts_with("threadlight view ");
            for command in commands(&text).into_iter().filter(is_here) {
                // What it prints is no mistake.
                if let Err(error) = Arguments::try_parse_from(words(&command))
                    && error.use_stderr()
                {
                    panic!("{}: {command}: {error}", path.display());
                }
                count += 1;
            }
        }
        assert!(count > 60, "only {count}");
    }
}
