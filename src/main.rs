//! Threadlight's command line: parse, call, exit code.
//!
//! Exit codes: 0 done; 1 the machine could not (Vulkan, memory, a full disk, validation messages), or pictures differ by more than they may
//! (`compare --at-most`); 2 the input was wrong;
//! 130 cancelled, by Ctrl-C or SIGTERM. Whatever went wrong is one line on standard error.

mod cli;

use clap::Parser;
use cli::say;
use std::process::ExitCode;
use threadlight::Error;
use threadlight::low_level::vulkan::VulkanError;

fn main() -> ExitCode {
    #[cfg(unix)]
    outlive_file_limits();
    if let Err(cause) = cli::signals::listen() {
        say(format_args!("threadlight: Ctrl-C has no handler: {cause}"));
    }
    let arguments = match cli::Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) if is_mistake(&error) => return fail(2, &cli::mistake(&error)),
        Err(help_or_version) => return show(&help_or_version),
    };
    cli::start_logging(arguments.verbose);
    match arguments.run() {
        Ok(()) => ExitCode::SUCCESS,
        // Errors about files name them.
        Err(error) if error.is::<std::io::Error>() => unprinted(&error),
        Err(error) => fail(exit_code(&error), &format!("{error:#}")),
    }
}

/// A file that becomes larger than it may (`ulimit -f`) is an error of the call that writes, as a full disk is. Without a handler the signal
/// would end the program.
#[cfg(unix)]
fn outlive_file_limits() {
    use signal_hook::{consts::SIGXFSZ, flag};
    if let Err(cause) = flag::register(SIGXFSZ, std::sync::Arc::<std::sync::atomic::AtomicBool>::default()) {
        say(format_args!("threadlight: SIGXFSZ has no handler: {cause}"));
    }
}

/// Says on one line what went wrong.
fn fail(code: u8, problem: &str) -> ExitCode {
    say(format_args!("threadlight: {}", problem.replace('\n', " ")));
    ExitCode::from(code)
}

fn unprinted(cause: &dyn std::fmt::Display) -> ExitCode {
    fail(1, &format!("standard output cannot be written ({cause})"))
}

/// Prints help or the version.
fn show(help_or_version: &clap::Error) -> ExitCode {
    match cli::unless_unheard(help_or_version.print()) {
        Err(cause) if !help_or_version.use_stderr() => unprinted(&cause),
        _ => ExitCode::from(help_or_version.exit_code() as u8),
    }
}

/// Whether clap means an error, rather than help or the version that was asked for.
fn is_mistake(error: &clap::Error) -> bool {
    error.use_stderr() && error.kind() != clap::error::ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand
}

fn exit_code(error: &anyhow::Error) -> u8 {
    match error.downcast_ref::<Error>() {
        Some(Error::Input { .. }) => 2,
        Some(Error::Vulkan(cause)) => match cause.downcast_ref() {
            Some(VulkanError::NoSuchDevice { .. } | VulkanError::NoStatistics { .. }) => 2,
            _ => 1,
        },
        Some(Error::Cancelled) => 130,
        _ => 1,
    }
}
