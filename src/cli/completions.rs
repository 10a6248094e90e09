//! `threadlight completions`: scripts that teach a shell the command line.
use clap::CommandFactory;

/// Prints a completion script for a shell.
#[derive(clap::Args)]
pub struct Completions {
    /// Which shell.
    shell: clap_complete::Shell,
}

impl Completions {
    pub fn run(self) -> anyhow::Result<()> {
        clap_complete::generate(
            self.shell,
            &mut super::Arguments::command(),
            "threadlight",
            &mut std::io::stdout().lock(),
        );
        Ok(())
    }
}
