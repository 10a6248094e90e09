//! Threadlight's command line: parse, call, exit code.
//!
//! Exit codes: 0 done; 1 the machine could not (Vulkan, memory, validation messages); 2 the input was wrong;
//! 130 cancelled by Ctrl-C.

mod cli;

use clap::Parser;
use std::process::ExitCode;
use threadlight::Error;
use threadlight::vulkan::VulkanError;

fn main() -> ExitCode {
    let arguments = cli::Arguments::parse();
    cli::start_logging(arguments.verbose);
    match arguments.run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("threadlight: {error:#}");
            ExitCode::from(exit_code(&error))
        }
    }
}

fn exit_code(error: &anyhow::Error) -> u8 {
    match error.downcast_ref::<Error>() {
        Some(Error::Input { .. } | Error::Vulkan(VulkanError::NoSuchDevice { .. })) => 2,
        Some(Error::Cancelled) => 130,
        _ => 1,
    }
}
